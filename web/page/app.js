// SPDX-License-Identifier: MIT
// The page: the picture, what is said around it, and what a person does.
import * as tuner from "./console.js";
import { Painter } from "./draw.js";
import { PAST_S, ask, connect, daemonNow, hasEnded, hasMap, past, rows, state, track, watch } from "./live.js";
import { measure, measureKey, setPoint, switchMeasure } from "./measure.js";
import { fill, make, showPlan, showSonars, showTiles, showTiming, showVehicle, showWarnings } from "./panels.js";
import * as pilot from "./pilot.js";
import { fresh, headingNow, judged, poseShown, shown, shownAt, turnNow, view } from "./view.js";
import { showWhy } from "./why.js";
import * as words from "./words.js";

const $ = (id) => document.getElementById(id);
const painter = new Painter($("canvas"));

function wanted() {
  if (document.hidden && !pilot.sound.on) return [];
  const list = [{ method: "status" }, { method: "stats" }, { method: "plan" }, { method: "map" }, ...tuner.questions()];
  if (view.tab === "pilot" || pilot.sound.on) list.push(...pilot.questions());
  const distance = $("distance").value; // empty: as the daemon has it by itself
  list.push({ method: "sectors", params: distance === "" ? {} : { distance_m: parseFloat(distance) } });
  if (view.tab === "map") list.push({ method: "map_slice", params: sliceParams() });
  else {
    list.push({ method: "image", params: view.sensor ? { sensor: view.sensor } : {} });
    if (hasMap()) list.push({ method: "map_slice", params: { size_m: 1, cells: 1 } }); // where the vehicle is
  }
  return list;
}

function sliceParams() {
  const params = { size_m: parseFloat($("size").value), cells: 160 };
  if (!$("follow").checked) params.depth_m = parseFloat($("depth").value);
  return params;
}

// All that was shown is void.
function forgotten() {
  view.back = null;
  view.rows = rows;
  view.newest = null;
  painter.image.clear();
  repaint();
}

function forgetImage() {
  rows.clear();
  view.newest = null;
  painter.image.clear();
  repaint();
}

function newRows(came) {
  const touched = new Set();
  for (const row of view.back === null ? came : []) {
    if (!view.newest || row.t >= view.newest.t) view.newest = row;
    for (const slot of painter.image.take(row)) touched.add(slot);
  }
  painter.image.paint(touched, range(), fade, painter.table);
  draw();
}

function lookBack(seconds) {
  lookAt(seconds > 0 ? daemonNow() - seconds : null);
}

// The picture stands still while all goes on: it is of the past then, and says so.
const freeze = () => lookAt(view.back === null ? daemonNow() : null);

// back: a time; null: now.
function lookAt(back) {
  view.back = back;
  view.rows = rows;
  if (view.back !== null) {
    view.rows = new Map();
    for (const row of past.rows) if (row.t <= view.back) view.rows.set(Math.round(row.azimuth * 100), row);
  }
  painter.image.clear();
  view.newest = null;
  for (const row of view.rows.values()) {
    painter.image.take(row);
    if (!view.newest || row.t >= view.newest.t) view.newest = row;
  }
  repaint();
  show();
}

// ---- the picture ----

function fade(row) {
  const grid = state.status && state.status.grids[0], life = (grid && grid.clear_for_s) || 30;
  return Math.max(0.12, 1 - Math.max(0, shownAt() - row.t) / (life * 1.2));
}

function range() {
  const chosen = parseFloat($("zoom").value);
  const most = state.status ? Math.max(0, ...state.status.sensors.map((s) => s.range_m)) : 0;
  const r = chosen || most || 10;
  if (r !== view.range) {
    view.range = r;
    repaint();
  }
  return r;
}

function repaint() {
  painter.image.paint(Array.from(painter.image.cover.keys()), view.range, fade, painter.table);
}

let drawn = 0, due = false;
function draw() {
  if (due) return;
  due = true;
  const wait = Math.max(0, 50 - (performance.now() - drawn));
  setTimeout(() => requestAnimationFrame(() => {
    due = false;
    drawn = performance.now();
    const now = fresh();
    const turn = turnNow();
    if (view.tab === "map") painter.map(state.slice && state.slice.rows.length > 1 ? state.slice : null, track, now);
    else
      painter.sonar({ fresh: now, sectors: now ? shown().sectors : [], near: now ? shown().near_m : 0, judged: judged() ?? 0, turn, rows: view.rows, fade, range: range(), newest: view.newest, selected: view.selected, heading: now ? headingNow() : null });
    if (measure.on) painter.ruler(measure);
  }), wait);
}

// ---- what is said around it ----

function showHead() {
  const s = state.status, chip = $("link"), good = fresh();
  chip.className = "chip " + (good && view.back === null ? "good" : "bad");
  chip.textContent = view.back !== null ? `looking back ${words.seconds(daemonNow() - view.back)}` : good ? "live" : !state.connected ? "no connection" : state.link && state.link.fault ? "daemon lost" : "waiting";
  const said = view.back !== null ? "looking back: this is not now" : chip.textContent;
  if ($("link-said").textContent !== said) $("link-said").textContent = said; // once, not at every change of a number
  $("freeze").setAttribute("aria-pressed", String(view.back !== null));
  $("mode").hidden = !s || s.mode === "live";
  $("mode").textContent = !s ? "" : s.mode === "replay" && s.replay && s.replay.paused ? "replay, paused" : s.mode;
  $("clock").textContent = s ? new Date(s.t_unix * 1000).toISOString().slice(0, 19).replace("T", " ") + " UTC" : "";
  const curtain = $("curtain");
  curtain.hidden = good;
  curtain.textContent = view.back !== null ? "Nothing was received at that time." : !state.connected ? "No connection to sonard-web. Nothing is known. It is tried again by itself."
    : state.link && state.link.fault ? `The daemon does not answer: ${state.link.fault}. Nothing is known. It is tried again every second.`
      : "Waiting for the daemon's first answers.";
}

// The key to the picture says what clear water is clear of.
function showTarget() {
  const text = words.target(fresh() ? shown() : null);
  $("clear-of").lastChild.textContent = text ? `clear of: ${text}` : "clear";
}

// Above the picture: where it points, how old that is, and how far the ring is judged.
function showCaption() {
  const p = fresh() ? poseShown() : null, heading = p ? headingNow() : null;
  const old = !p ? "" : p.age_s === null ? "no pose" : `pose ${words.seconds(p.age_s)} old`;
  const distance = judged();
  fill($("compass"), make("b", heading === null ? "Heading unknown" : `Heading ${words.degrees(heading)}`), " " + old);
  $("judged").textContent = distance === null ? "" : `Ring judged to ${words.metres(distance)}`;
}

function showBack() {
  const first = past.frames[0], row = past.rows[0];
  const span = first ? Math.floor(daemonNow() - Math.max(first.t, row ? row.t : 0)) : 0;
  $("back").min = -Math.min(span, PAST_S);
  $("back-said").textContent = view.back === null ? "now" : new Date(view.back * 1000).toISOString().slice(11, 19);
  if (view.back === null) $("back").value = 0;
}

function showReplay() {
  const r = state.status && state.status.replay, at = $("at");
  $("replay").hidden = !r || r.length_s === null;
  if ($("replay").hidden) return;
  for (const e of [$("play"), at, $("speed")]) e.disabled = !state.link || !state.link.replay;
  at.title = at.disabled ? "sonard-web --replay lets pages pause and jump" : "";
  at.max = r.length_s;
  if (!view.dragging) at.value = r.position_s;
  $("at-said").textContent = `${words.clock(view.dragging ? parseFloat(at.value) : r.position_s)} of ${words.clock(r.length_s)}${r.jumping ? ", jumping" : ""}`;
  $("play").textContent = r.paused || hasEnded() ? "Play" : "Pause";
  if (document.activeElement !== $("speed")) {
    if (!Array.from($("speed").options).some((o) => parseFloat(o.value || "0") === r.speed)) $("speed").add(new Option(r.speed === 0 ? "full" : r.speed, r.speed));
    $("speed").value = r.speed;
  }
}

function showMapBar() {
  const note = $("note");
  note.hidden = view.tab !== "map" || !fresh() || !state.map || (state.slice !== null && state.map.state === "kept");
  note.textContent = !state.map ? "" : !hasMap() ? "No map is kept. Set voxel in [map] of sonard.conf to keep one."
    : state.map.state === "kept" ? "Waiting for the slice of the map." : `The map is empty or held: ${state.map.state}.`;
  if (view.tab !== "map" || !state.slice) return;
  if ($("follow").checked && state.slice.depth_m !== undefined) $("depth").value = state.slice.depth_m;
  $("depth-said").textContent = words.metres(state.slice.depth_m);
}

// For a screen reader: a slider of the direction that is asked about; the map is a picture; measuring has keys of its own.
function showCanvas() {
  const canvas = $("canvas"), ring = view.tab !== "map" && !measure.on, azimuth = view.selected ?? 0;
  const set = (name, value) => { if (canvas.getAttribute(name) !== value) canvas.setAttribute(name, value); };
  set("role", measure.on ? "application" : ring ? "slider" : "img");
  set("aria-label", measure.on ? "Measure: arrow keys move the point, Enter sets it" : view.tab === "map" ? "Map around the vehicle"
    : "Ring of sectors: " + Array.from(document.querySelectorAll(".tile")).map((t) => Array.from(t.children, (e) => e.textContent).join(" ")).join("; "));
  if (!ring) return ["aria-valuenow", "aria-valuetext"].forEach((name) => canvas.removeAttribute(name));
  set("aria-valuenow", String(azimuth));
  set("aria-valuetext", `${words.direction(azimuth)}: ${words.inWords(fresh() ? words.summary(shown().sectors, azimuth, 7.5) : null)}`);
}

let saidAt = 0, showDue = false;
function show() {
  if (showDue) return;
  showDue = true;
  setTimeout(() => {
    showDue = false;
    saidAt = performance.now();
    showHead();
    showWarnings();
    showTiles();
    showTarget();
    showSonars();
    tuner.showConsole();
    showVehicle();
    showCaption();
    showWhy();
    pilot.showPilot();
    showTiming();
    showPlan();
    showBack();
    showReplay();
    showMapBar();
    showCanvas();
    draw();
  }, Math.max(0, 200 - (performance.now() - saidAt)));
}

// ---- what a person does ----

// Begin a recording, or end it.
async function recordOrStop() {
  const said = $("record-said"), r = state.status && state.status.record;
  if (!r) return;
  const token = $("token").value;
  if (!token) {
    said.textContent = "Recording needs the token: enter it on the page Sonar, under Settings.";
    return;
  }
  said.textContent = "…";
  const answer = await ask("record", { on: r.paused, token });
  said.textContent = answer.lost ? "The connection to sonard-web was lost: it is not known whether this was taken." : answer.error ? answer.error.message : "";
  if (!answer.lost && !answer.error) state.status.record = answer.result;
  show();
}

// What the daemon says to that comes with its next status.
async function replay(params) {
  const answer = await ask("replay", params);
  view.dragging = false;
  if (!answer.error && state.status) state.status.replay = answer.result;
  show();
}

function playOrPause() {
  const r = state.status && state.status.replay;
  if (r) replay(hasEnded() ? { pause: "no", to_s: 0 } : { pause: r.paused ? "no" : "yes" });
}

function select(azimuth) {
  view.selected = ((Math.round(azimuth) % 360) + 360) % 360;
  showWhy();
  draw();
}

// To the next range that is offered, nearer or farther.
function zoomBy(nearer) {
  const offered = Array.from($("zoom").options, (o) => parseFloat(o.value)).filter((v) => (nearer ? v < view.range : v > view.range));
  if (offered.length) $("zoom").value = String(nearer ? Math.max(...offered) : Math.min(...offered));
}

// As a file: the picture, with a line that says of when and of what it is.
function savePicture() {
  const from = $("canvas"), to = document.createElement("canvas"), g = to.getContext("2d"), u = painter.unit;
  const text = [$("clock").textContent, $("link").textContent, $("compass").textContent, $("judged").textContent, $("measured").textContent].filter((t) => t).join("  ·  ");
  to.width = from.width;
  to.height = from.height + 26 * u;
  g.fillStyle = painter.colour.ground;
  g.fillRect(0, 0, to.width, to.height);
  g.drawImage(from, 0, 0);
  g.fillStyle = painter.colour.text;
  g.font = `${11 * u}px system-ui, sans-serif`;
  g.fillText(text, 8 * u, from.height + 17 * u, to.width - 16 * u);
  to.toBlob((blob) => {
    const a = make("a");
    a.href = URL.createObjectURL(blob);
    a.download = `sonard-${new Date(shownAt() * 1000).toISOString().slice(0, 19).replaceAll(":", "")}Z.png`;
    a.click();
    setTimeout(() => URL.revokeObjectURL(a.href), 10000);
  });
}

// As a list of tabs has it: arrow keys go round, Home and End to its ends.
function tabKey(event) {
  const tabs = Array.from(document.querySelectorAll("[role=tab]")), at = tabs.indexOf(event.target);
  const to = { ArrowRight: at + 1, ArrowLeft: at - 1, Home: 0, End: tabs.length - 1 }[event.key];
  if (to === undefined) return;
  const tab = tabs[(to + tabs.length) % tabs.length];
  tab.focus();
  tab.click();
  event.preventDefault();
}

function setTab(tab) {
  if (tab !== "sonar" && view.back !== null) lookBack(0);
  view.tab = tab;
  switchMeasure(false);
  for (const t of ["pilot", "sonar", "map"]) {
    $("tab-" + t).setAttribute("aria-selected", String(t === tab));
    $("tab-" + t).tabIndex = t === tab ? 0 : -1;
  }
  $("stage").setAttribute("aria-labelledby", "tab-" + tab);
  for (const e of document.querySelectorAll("[data-for]")) e.hidden = !e.dataset.for.split(" ").includes(tab);
  state.slice = null;
  watch();
  show();
}

const THEMES = ["dark", "light", "night"];

function setTheme(theme) {
  document.documentElement.dataset.theme = theme;
  $("theme").textContent = words.sentence(theme).slice(0, -1);
  $("theme").setAttribute("aria-label", `Theme: ${$("theme").textContent}`);
  recolour();
}

function recolour() {
  painter.restyle(view);
  tuner.showPalette();
  repaint();
  draw();
}

$("canvas").addEventListener("click", (event) => {
  const box = event.target.getBoundingClientRect(), place = painter.place(event.clientX - box.left, event.clientY - box.top);
  if (measure.on) setPoint(place);
  else if (view.tab !== "map") select((Math.atan2(place[1], place[0]) * 180) / Math.PI);
  draw();
});
$("canvas").addEventListener("keydown", (event) => {
  const step = event.shiftKey ? 1 : 5;
  if (measure.on && measureKey(event.key, (view.tab === "map" ? parseFloat($("size").value) / 2 : view.range) * step / 100)) { /* done */ }
  else if (view.tab === "map") return;
  else if (event.key === "ArrowLeft" || event.key === "ArrowRight") select((view.selected ?? 0) + (event.key === "ArrowLeft" ? -step : step));
  else if (event.key === "Enter" || event.key === " ") select(view.selected ?? 0);
  else if (event.key === "+" || event.key === "-") zoomBy(event.key === "+");
  else if (event.key === "f" && !event.ctrlKey && view.tab === "sonar") freeze();
  else return;
  event.preventDefault();
  draw();
});
document.querySelector("[role=tablist]").addEventListener("keydown", tabKey);
$("tab-pilot").addEventListener("click", () => setTab("pilot"));
$("north-up").addEventListener("click", () => {
  view.northUp = !view.northUp;
  $("north-up").setAttribute("aria-pressed", String(view.northUp));
  show();
});
$("measure").addEventListener("click", () => { switchMeasure(!measure.on); $("canvas").focus(); draw(); });
$("shot").addEventListener("click", savePicture);
$("sound").addEventListener("click", () => { pilot.switchSound(); watch(); });
$("full").addEventListener("click", pilot.switchFullScreen);
$("record").addEventListener("click", recordOrStop);
$("tab-sonar").addEventListener("click", () => setTab("sonar"));
$("tab-map").addEventListener("click", () => setTab("map"));
$("distance").addEventListener("change", () => { watch(); show(); });
$("zoom").addEventListener("change", draw);
$("sensor").addEventListener("change", () => { view.sensor = $("sensor").value; forgetImage(); watch(); });
$("size").addEventListener("change", watch);
$("follow").addEventListener("change", () => { $("depth").disabled = $("follow").checked; watch(); });
$("depth").addEventListener("change", watch);
$("settings").querySelector("form").addEventListener("submit", (event) => { event.preventDefault(); tuner.applySetting($("setting").value.trim(), $("setting-said")); });
$("back").addEventListener("input", () => lookBack(-parseFloat($("back").value)));
$("play").addEventListener("click", playOrPause);
$("at").addEventListener("input", () => { view.dragging = true; show(); });
$("at").addEventListener("change", () => replay({ to_s: parseFloat($("at").value) }));
$("speed").addEventListener("change", () => replay({ speed: parseFloat($("speed").value) }));
$("theme").addEventListener("click", () => setTheme(THEMES[(THEMES.indexOf(document.documentElement.dataset.theme) + 1) % THEMES.length]));
document.addEventListener("visibilitychange", watch);
window.addEventListener("resize", draw);
setInterval(() => { if (!document.hidden || pilot.sound.on) { repaint(); show(); } }, 1000);

tuner.beginConsole({ repaint: recolour, freeze, watch });
setTheme(matchMedia("(prefers-color-scheme: light)").matches ? "light" : "dark");
if (location.hash === "#pilot") setTab("pilot");
connect({ wanted, news: show, newRows, forgotten });
show();

// For tests: what is shown, and from what.
globalThis.sonardPage = { state, past, rows, view, fresh, painter, measure, sound: pilot.sound, numbers: () => words.aroundInNumbers(shown().sectors, shown().near_m).map((n) => n.text) };
