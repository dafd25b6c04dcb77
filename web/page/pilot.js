// SPDX-License-Identifier: MIT
// For the pilot: how fast the vehicle may go ahead and why, what is nearest, when it is met, and a sound when the speed drops.
import { newest, state } from "./live.js";
import { fill, make, pairs } from "./panels.js";
import { fresh, view } from "./view.js";
import * as words from "./words.js";

export const ASKED_MPS = 5; // more than a small vehicle goes: what `limit` leaves of it is how fast it may go
const DROP = 0.75; // to less than this part of the speed before: a sound
const AGAIN_MS = 3000; // between sounds while no speed is known
const $ = (id) => document.getElementById(id);
const said = (method) => (fresh() && view.back === null ? newest(method) : null);

export const sound = { context: null, on: false, played: 0 };
let before = 0, playedAt = 0, awake = null;

export const questions = () => [
  { method: "limit", params: { velocity_mps: [ASKED_MPS, 0, 0] } },
  { method: "time_to_collision", params: {} },
  { method: "nearest", params: {} },
];

// ---- the numbers ----

function showSpeed() {
  const answer = said("limit"), l = answer && answer.result, e = $("limit-speed");
  e.className = !l ? "unknown" : l.limited_by === "nothing" ? "clear" : l.limited_by;
  fill(e, make("b", l ? l.speed_mps.toFixed(2) : "–"), l && l.limited_by === "nothing" ? " m/s or more ahead" : " m/s ahead");
  fill($("limit-why"), !l ? (answer && answer.error ? answer.error.message : "Not known: no answer comes.")
    : l.limited_by === "nothing" ? `Free water ahead: ${words.metres(l.free_m)}.` : words.sentence(l.reason));
  if (sound.on) heed(l ? l.speed_mps : null);
}

function showFacts() {
  const limit = said("limit"), remedy = limit && limit.result && limit.result.remedy;
  const near = said("nearest"), n = near && near.result, hit = said("time_to_collision"), t = hit && hit.result;
  fill($("facts"), pairs([
    ["nearest obstacle", !n ? "not known" : n.state === "blocked" ? `${words.metres(n.range_m)} at ${words.direction(n.azimuth_deg)}` : n.state === "clear" ? "none" : "none is known"],
    ["water nearer than that", !n ? "–" : `${Math.round(100 * n.unknown_share)} % unknown`],
    ["time to collision", !t ? (hit && hit.error ? "no velocity is known" : "not known") : t.state === "blocked" ? words.seconds(t.time_s) : t.state === "clear" ? `none within ${words.seconds(t.ahead_s)}` : `unknown after ${words.seconds(t.unknown_after_s)}`],
  ]), make("p", remedy ? `To go faster: ${remedy}.` : "", "muted"));
}

// Where no folder is configured nothing can be recorded, and without --settings not from here.
function showRecording() {
  const r = fresh() && state.link && state.link.settings && state.status && state.status.record, b = $("record");
  b.hidden = !r;
  if (!r) return;
  b.setAttribute("aria-pressed", String(!r.paused));
  b.textContent = r.paused ? "Record" : r.recording ? `Stop recording ${r.path.split("/").pop()}` : r.error ? "Recording has stopped: see the warnings" : "Recording begins …";
}

export function showPilot() {
  if (view.tab === "pilot" || sound.on) showSpeed();
  if (view.tab === "pilot") showFacts();
  if (view.tab === "pilot") showRecording();
}

// ---- the sound ----

function play(speed) {
  const c = sound.context, stop = speed === null || speed < 0.15;
  sound.played++;
  playedAt = performance.now();
  for (let i = 0; i < (stop ? 3 : 1); i++) {
    const tone = c.createOscillator(), level = c.createGain(), at = c.currentTime + 0.18 * i;
    tone.frequency.value = stop ? 1320 : 880;
    level.gain.setValueAtTime(0.3, at);
    level.gain.exponentialRampToValueAtTime(0.001, at + 0.15);
    tone.connect(level).connect(c.destination);
    tone.start(at);
    tone.stop(at + 0.16);
  }
}

// speed: null is not known, which sounds as a stop does, and again: silence never means that all is well.
function heed(speed) {
  const now = speed ?? 0;
  if (now < DROP * before - 0.02 || (speed === null && performance.now() - playedAt > AGAIN_MS)) {
    play(speed);
    before = now;
  } else before = Math.max(before, now);
}

export function switchSound() {
  sound.on = !sound.on;
  if (!sound.context) sound.context = new AudioContext(); // a browser lets a page sound only after a click
  sound.context.resume();
  before = 0;
  playedAt = performance.now();
  $("sound").setAttribute("aria-pressed", String(sound.on));
}

// ---- the screen ----

// Browsers keep the screen awake only for pages of this computer or over https.
async function keepAwake() {
  try {
    awake = await navigator.wakeLock.request("screen");
    $("awake").textContent = "The screen stays awake.";
  } catch {
    awake = null;
    $("awake").textContent = "This browser does not keep the screen awake here (it wants https or localhost): set the device's own timeout.";
  }
}

export async function switchFullScreen() {
  if (document.fullscreenElement) await document.exitFullscreen();
  else await Promise.allSettled([document.documentElement.requestFullscreen(), keepAwake()]);
}

document.addEventListener("fullscreenchange", () => {
  const full = document.fullscreenElement !== null;
  $("full").setAttribute("aria-pressed", String(full));
  if (full) return;
  if (awake) awake.release();
  awake = null;
  $("awake").textContent = "";
});
document.addEventListener("visibilitychange", () => { if (!document.hidden && document.fullscreenElement) keepAwake(); });
