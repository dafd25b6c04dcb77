// SPDX-License-Identifier: MIT
// Why? - what the daemon says of the chosen direction, asked again as long as it is chosen: an explanation that is older
// than the picture beside it is not shown.
import { STALE_MS, ask, daemonNow, rows, state } from "./live.js";
import { fill, make } from "./panels.js";
import { fresh, judged, view } from "./view.js";
import * as words from "./words.js";

const EVERY_MS = 1000, LOST_MS = 10000, HALF_DEG = 7.5;
let told = null; // {azimuth, distance, link, at, unix, result or error}
let asked = null; // {azimuth, distance, link, at, waits} of the newest question
let announced = "";

const isOf = (what, azimuth, distance) => what !== null && what.azimuth === azimuth && what.distance === distance && what.link === state.link;

// One question at a time; an answer that is lost is waited for no longer than LOST_MS.
function isDue(azimuth, distance) {
  const old = asked === null ? Infinity : performance.now() - asked.at;
  return asked !== null && asked.waits ? old >= LOST_MS : old >= EVERY_MS || !isOf(asked, azimuth, distance);
}

async function askAgain(azimuth, distance) {
  const question = { azimuth, distance, link: state.link, at: performance.now(), waits: true };
  asked = question;
  const answer = await ask("explain", { azimuth_deg: azimuth, distance_m: distance, half_angle_deg: HALF_DEG, count: 8 });
  question.waits = false;
  told = { ...question, at: performance.now(), unix: daemonNow(), ...answer };
  showWhy();
}

function explanation() {
  const w = words.explain(told.result, told.azimuth, told.distance), ul = make("ul");
  ul.append(...w.points.concat(words.echoes(rows.values(), told.azimuth, HALF_DEG)).map((t) => make("li", t)));
  return [w, [make("div", w.where, "muted"), make("div", w.verdict, "verdict " + w.state), make("p", w.text), ul,
    make("p", `As of ${words.timeOfDay(told.unix)}`, "muted asof")]];
}

// A screen reader is told when the direction or the state changes, not every second.
function announce(text) {
  if (text === announced) return;
  announced = text;
  document.getElementById("why-said").textContent = text;
}

export function showWhy() {
  const card = document.getElementById("why"), title = make("h2", "Why?"), azimuth = view.selected, distance = judged();
  const say = (text) => { announce(""); fill(card, title, make("p", text, "muted")); };
  if (azimuth === null)
    return say("Click a direction in the picture: sonard says what it knows there, and which echoes and pings that rests on.");
  if (view.back !== null) return say("sonard explains what it knows now: move the slider to its end.");
  if (!fresh() || distance === null) return say(`${words.direction(azimuth)}: nothing is known there now.`);
  const current = isOf(told, azimuth, distance) && performance.now() - told.at < STALE_MS;
  if (isDue(azimuth, distance)) askAgain(azimuth, distance);
  if (!current) return say(`${words.direction(azimuth)}: asking …`);
  if (told.error) return say(told.error.message);
  const [w, nodes] = explanation();
  announce(`${words.direction(azimuth)}: ${w.state}`);
  fill(card, title, ...nodes);
}
