// SPDX-License-Identifier: MIT
// What the page shows: what the daemon says now, or what it said at the time that is looked back to.
import { STALE_MS, daemonNow, isFresh, past, rows, state } from "./live.js";

// back: the time that is shown; null: now. rows, newest: of the image then. selected: an azimuth; null: none. palette,
// contrast: of the image.
export const view = { tab: "sonar", northUp: false, back: null, rows, newest: null, selected: null, sensor: "", range: 10, dragging: false, palette: "page", contrast: 0 };

// What was shown at the time that is looked back to; null: nothing then.
function then() {
  const frame = past.frames.findLast((f) => f.t <= view.back);
  return frame && view.back - frame.t < STALE_MS / 1000 ? frame : null;
}

export const fresh = () => (view.back !== null ? then() !== null : isFresh());
export const shown = () => (view.back !== null ? then().sectors : state.sectors);
export const shownAt = () => view.back ?? daemonNow();
export const poseShown = () => (view.back !== null ? then() && then().pose : state.status && state.status.pose);

// How far the sectors are judged, in metres; null: nothing is known.
export const judged = () => (fresh() && shown().distance_m > 0 ? shown().distance_m : null);

// Clockwise from north, in degrees; null: no fresh attitude. The daemon gives none that is too old.
export function headingNow() {
  const pose = poseShown(), attitude = pose && pose.attitude_deg;
  return attitude ? (attitude[2] + 360) % 360 : null;
}

// How far the picture is turned, clockwise: north is at the top when that is wanted and the heading is known.
export const turnNow = () => (view.northUp && fresh() ? headingNow() ?? 0 : 0);
