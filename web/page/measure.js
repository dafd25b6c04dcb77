// SPDX-License-Identifier: MIT
// Measuring in the picture: two points, set by clicks or by arrow keys and Enter, in metres ahead (north) and to starboard (east).
import { view } from "./view.js";
import * as words from "./words.js";

const $ = (id) => document.getElementById(id);
export const measure = { on: false, points: [], cursor: [0, 0] };

export function say() {
  const [a, b] = measure.points, from = view.tab === "map" ? "from north" : "from the bow";
  $("measured").textContent = !measure.on ? "" : !a ? "Set the first point: click, or arrow keys and Enter." : !b ? "Set the second point."
    : `${words.metres(Math.hypot(b[0] - a[0], b[1] - a[1]))}, ${words.degrees((Math.atan2(b[1] - a[1], b[0] - a[0]) * 180) / Math.PI + 360)} ${from}`;
}

export function switchMeasure(on) {
  Object.assign(measure, { on, points: [], cursor: [0, 0] });
  $("measure").setAttribute("aria-pressed", String(on));
  say();
}

export function setPoint(point) {
  measure.points = measure.points.length === 1 ? [measure.points[0], point] : [point];
  measure.cursor = point;
  say();
}

const STEPS = { ArrowUp: [1, 0], ArrowDown: [-1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1] };

// True: the key was one of these. step: in metres.
export function measureKey(key, step) {
  if (key in STEPS) measure.cursor = measure.cursor.map((v, i) => v + step * STEPS[key][i]);
  else if (key === "Enter" || key === " ") setPoint(measure.cursor);
  else if (key === "Escape") switchMeasure(false);
  else return false;
  return true;
}
