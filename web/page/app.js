// SPDX-License-Identifier: MIT
// The page: a WebSocket to sonard-web, what came over it, and what is shown of that. What is not fresh is unknown.
import { Painter } from "./draw.js";
import * as words from "./words.js";

const STALE_MS = 2500; // sectors older than this are not shown
const TRACK_MAX = 2000;
const LATE_MS = 2000; // an answer to a change that takes longer is doubted
const $ = (id) => document.getElementById(id);

// What the daemon said last; null: not known.
const state = { link: null, status: null, sectors: null, stats: null, plan: null, slice: null, map: null, connected: false, sectorsAt: 0 };
const rows = new Map(); // azimuth in hundredths of a degree -> row
const clock = { unix: 0, at: 0 }; // of the daemon, and when it said so
const rates = new Map();
const track = [];
// What came, oldest first, to look back at: rows of the image, and {t, sectors, pose}. A multibeam fills a phone in minutes.
const past = { rows: [], bytes: 0, frames: [] };
const PAST_S = 1800, PAST_BYTES = 48 << 20;
const bytesOf = (row) => 256 + row.bins.length;
const view = { tab: "sonar", back: null /* the time that is shown; null: now */, rows, selected: null, sensor: "", range: 10, newest: null, dragging: false };
let before = null; // an older status, for rates
const painter = new Painter($("canvas"));

// ---- the connection ----

let socket = null, retry = 500, lastId = 0;
const waiting = new Map();

function wanted() {
  if (document.hidden) return [];
  const list = [{ method: "status" }, { method: "stats" }, { method: "plan" }, { method: "map" }];
  const distance = parseFloat($("distance").value);
  list.push({ method: "sectors", params: { distance_m: distance || 0 } });
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

const hasMap = () => state.map !== null && !state.map.state.startsWith("none");

function watch() {
  if (socket && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify({ watch: wanted() }));
}

function forget() {
  state.status = state.sectors = state.stats = state.plan = state.slice = state.map = null;
  before = null;
  clock.unix = 0;
  rates.clear();
  past.rows.length = past.frames.length = past.bytes = 0;
  view.back = null;
  view.rows = rows;
  forgetImage();
  track.length = 0;
}

function forgetImage() {
  rows.clear();
  view.newest = null;
  painter.image.clear();
  repaint();
}

function connect() {
  socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/live`, "sonard");
  socket.binaryType = "arraybuffer";
  socket.onopen = () => { retry = 500; state.connected = true; watch(); };
  socket.onmessage = (event) => {
    if (typeof event.data === "string") takeText(JSON.parse(event.data));
    else takeRows(event.data);
    draw();
  };
  socket.onclose = () => {
    state.connected = false;
    state.link = null;
    for (const reject of waiting.values()) reject({ lost: true, error: { message: "the connection was lost" } });
    waiting.clear();
    forget();
    show();
    setTimeout(connect, retry);
    retry = Math.min(retry * 2, 4000);
  };
}

function ask(method, params) {
  return new Promise((resolve) => {
    if (!socket || socket.readyState !== WebSocket.OPEN || waiting.size >= 2) return resolve({ error: { message: "sonard-web cannot be asked now" } });
    waiting.set(++lastId, resolve);
    socket.send(JSON.stringify({ id: lastId, method, params }));
  });
}

// ---- what came ----

function takeText(message) {
  if (message.id !== undefined) {
    const resolve = waiting.get(message.id);
    waiting.delete(message.id);
    if (resolve) resolve(message);
    return;
  }
  const { method, result } = message;
  if (method === "link") {
    forget();
    state.link = result;
  } else if (method === "sectors") {
    state.sectors = result || null;
    state.sectorsAt = performance.now();
    remember();
  } else if (method === "status") takeStatus(result || null);
  else if (method === "map_slice") takeSlice(message);
  else if (method === "map") takeMap(result || null);
  else if (method in state) state[method] = result || null;
  show();
}

function takeStatus(status) {
  state.status = status;
  if (!status) return;
  if (clock.unix !== status.t_unix) Object.assign(clock, { unix: status.t_unix, at: performance.now() });
  if (before && status.t_unix - before.t_unix < 0.9) return;
  if (before && status.t_unix > before.t_unix) {
    const dt = status.t_unix - before.t_unix;
    rates.set("dropped", (status.pipeline.dropped - before.pipeline.dropped) / dt);
    for (const s of status.sensors) {
      const b = before.sensors.find((o) => o.name === s.name);
      if (b) for (const key of ["pings", "bad_checksum"]) rates.set(`${s.name}.${key}`, (s[key] - b[key]) / dt);
    }
  }
  before = status;
}

function takeMap(map) {
  const had = hasMap();
  state.map = map;
  if (hasMap() !== had) watch();
}

function takeSlice(message) {
  state.slice = message.result || null;
  const place = state.slice && state.slice.vehicle_m, last = track[track.length - 1];
  if (!place || (last && Math.hypot(last[0] - place[0], last[1] - place[1]) < 0.05)) return;
  track.push([place[0], place[1]]);
  if (track.length > TRACK_MAX) track.shift();
}

function remember() {
  const t = daemonNow(), last = past.frames[past.frames.length - 1];
  if (!state.sectors || !clock.unix || (last && t - last.t < 0.45)) return;
  past.frames.push({ t, sectors: state.sectors, pose: state.status && state.status.pose });
  const old = past.frames.findIndex((f) => f.t > t - PAST_S);
  if (old > 200) past.frames.splice(0, old);
}

function dropOldRows() {
  const before = daemonNow() - PAST_S;
  let old = 0, bytes = past.bytes;
  for (; old < past.rows.length && (past.rows[old].t <= before || bytes > PAST_BYTES); old++) bytes -= bytesOf(past.rows[old]);
  if (old <= 200) return;
  past.rows.splice(0, old);
  past.bytes = bytes;
}

// What was shown at the time that is looked back to; null: nothing then.
function then() {
  const frame = past.frames.findLast((f) => f.t <= view.back);
  return frame && view.back - frame.t < STALE_MS / 1000 ? frame : null;
}

function lookBack(seconds) {
  view.back = seconds > 0 ? daemonNow() - seconds : null;
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

// As web_rows.h has them.
function takeRows(buffer) {
  const data = new DataView(buffer), name = data.getUint8(1), n = data.getUint16(2, true), touched = new Set();
  const now = data.getFloat64(4, true);
  if (now > clock.unix) Object.assign(clock, { unix: now, at: performance.now() });
  let at = 12 + name;
  for (let i = 0; i < n; i++) {
    const f = (k) => data.getFloat32(at + 8 + 4 * k, true);
    const row = { t: data.getFloat64(at, true), azimuth: f(0), width: f(1), r0: f(2), r1: f(3), blind: f(4), state: data.getUint8(at + 32), echoes: [] };
    const echoes = data.getUint8(at + 33), bins = data.getUint16(at + 34, true);
    at += 36;
    for (let k = 0; k < echoes; k++, at += 6) row.echoes.push({ range: data.getFloat32(at, true), marks: data.getUint8(at + 4), sure: data.getUint8(at + 5) / 100 });
    row.bins = new Uint8Array(buffer, at, bins);
    at += bins;
    rows.set(Math.round(row.azimuth * 100), row);
    past.rows.push(row);
    past.bytes += bytesOf(row);
    if (view.back !== null) continue;
    if (!view.newest || row.t >= view.newest.t) view.newest = row;
    for (const slot of painter.image.take(row)) touched.add(slot);
  }
  dropOldRows();
  painter.image.paint(touched, range(), fade, painter.table);
}

// ---- the picture ----

const hasEnded = () => state.status !== null && state.status.mode === "replay, ended";

// How fast the daemon's clock runs: in a replay that is paused or has ended it stands.
function pace() {
  const r = state.status && state.status.replay;
  return !r ? 1 : hasEnded() || r.paused || r.jumping ? 0 : r.speed;
}

const daemonNow = () => clock.unix + pace() * (performance.now() - clock.at) / 1000;

function fade(row) {
  const grid = state.status && state.status.grids[0], life = (grid && grid.clear_for_s) || 30;
  return Math.max(0.12, 1 - Math.max(0, (view.back ?? daemonNow()) - row.t) / (life * 1.2));
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

const fresh = () => view.back !== null ? then() !== null : state.connected && state.link !== null && state.link.fault === null && state.sectors !== null && performance.now() - state.sectorsAt < STALE_MS;

// The sectors as they are up to the chosen distance; `obstacle`: there is one, maybe farther away.
function sectorsNow() {
  const distance = parseFloat($("distance").value) || null;
  return shown().sectors.map((s) => ({ ...s, state: words.within(s, distance), obstacle: s.state === "blocked" }));
}

const shown = () => (view.back !== null ? then().sectors : state.sectors);
const poseShown = () => (view.back !== null ? then() && then().pose : state.status && state.status.pose);

// Clockwise from north, in degrees; null: no fresh attitude. The daemon gives none that is too old.
function headingNow() {
  const pose = poseShown(), attitude = pose && pose.attitude_deg;
  return attitude ? (attitude[2] + 360) % 360 : null;
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
    if (view.tab === "map") painter.map(state.slice && state.slice.rows.length > 1 ? state.slice : null, track, now);
    else
      painter.sonar({ fresh: now, sectors: now ? sectorsNow() : [], near: now ? shown().near_m : 0, rows: view.rows, fade, range: range(), newest: view.newest, selected: view.selected, heading: now ? headingNow() : null });
  }), wait);
}

// ---- the panels ----

function make(tag, text, className) {
  const e = document.createElement(tag);
  if (text !== undefined) e.textContent = text;
  if (className) e.className = className;
  return e;
}

function pairs(list) {
  const dl = make("dl");
  for (const [name, value] of list) dl.append(make("dt", name), make("dd", value));
  return dl;
}

// Replaces a panel's content only when it has changed, so that a screen reader does not read it again and again.
function fill(element, ...nodes) {
  const next = make("div");
  next.append(...nodes);
  if (element.dataset.shown === next.innerHTML) return;
  element.dataset.shown = next.innerHTML;
  element.replaceChildren(...next.childNodes);
}

function showHead() {
  const s = state.status, chip = $("link"), good = fresh();
  chip.className = "chip " + (good && view.back === null ? "good" : "bad");
  chip.textContent = view.back !== null ? `looking back ${words.seconds(daemonNow() - view.back)}` : good ? "live" : !state.connected ? "no connection" : state.link && state.link.fault ? "daemon lost" : "waiting";
  $("mode").hidden = !s || s.mode === "live";
  $("mode").textContent = !s ? "" : s.mode === "replay" && s.replay && s.replay.paused ? "replay, paused" : s.mode;
  $("clock").textContent = s ? new Date(s.t_unix * 1000).toISOString().slice(0, 19).replace("T", " ") + " UTC" : "";
  const curtain = $("curtain");
  curtain.hidden = good;
  curtain.textContent = view.back !== null ? "Nothing was received at that time." : !state.connected ? "No connection to sonard-web. Nothing is known. It is tried again by itself."
    : state.link && state.link.fault ? `The daemon does not answer: ${state.link.fault}. Nothing is known. It is tried again every second.`
      : "Waiting for the daemon's first answers.";
}

function showWarnings() {
  const list = state.status ? words.warnings(state.status, rates) : [];
  fill($("warnings"), ...list.map((w) => {
    const e = make("div", undefined, "warning" + (w.grave ? " grave" : "")), text = make("div");
    text.append(make("b", w.what), w.remedy);
    e.append(text);
    return e;
  }));
}

// The key to the picture says what clear water is clear of.
function showTarget() {
  const text = words.target(fresh() ? shown() : null);
  $("clear-of").lastChild.textContent = text ? `clear of: ${text}` : "clear";
}

function showTiles() {
  const sides = [["Ahead", 0], ["Starboard", 90], ["Astern", 180], ["Port", 270]], good = fresh();
  fill($("tiles"), ...sides.map(([name, azimuth]) => {
    const s = good ? words.summary(sectorsNow(), azimuth, 15) : { state: "unknown", free_to_m: 0, age_s: null };
    const e = make("div", undefined, "tile " + s.state);
    const what = s.state === "blocked" ? `■ Blocked ${words.metres(s.range_m).replace(" ", "\u00a0")}` : s.state === "clear" ? "✓ Clear" : "? Unknown";
    const more = !good ? "no answer" : s.state === "blocked" ? `echo ${words.seconds(s.age_s)} ago` : `free to ${words.metres(s.free_to_m)}`;
    e.append(make("small", `${name} ±15°`), make("b", what), make("small", more));
    e.dataset.azimuth = azimuth;
    return e;
  }));
}

function showSonars() {
  const list = state.status ? state.status.sensors : [];
  const nodes = list.map((s) => {
    const e = make("div", undefined, "sonar"), head = make("header"), rate = rates.get(s.name + ".pings");
    const faults = [["damaged", s.bad_checksum + s.bad_frame], ["lost", s.lost_frames], ["timeouts", s.timeouts], ["reconnects", s.reconnects], ["garbage", s.garbage_bytes]].filter(([, n]) => n > 0);
    head.append(make("b", s.name), make("span", s.state, "state" + (s.state === "running" ? "" : " bad")));
    e.append(head, make("div", s.what || s.device, "muted"), pairs([
      ["last ping", words.seconds(s.last_ping_age_s) + (s.last_ping_age_s === null ? "" : " ago")],
      ["pings", (rate === undefined ? "–" : rate.toFixed(1)) + "/s"], ["range", words.metres(s.range_m)],
      ["faults", faults.length ? faults.map(([k, n]) => `${n} ${k}`).join(", ") : "none"]]));
    return e;
  });
  fill($("sonars"), make("h2", "Sonars"), ...(nodes.length ? nodes : [make("p", "–", "muted")]));
  const select = $("sensor"), names = list.map((s) => s.name).join("\n");
  $("sensor-label").hidden = list.length < 2 || view.tab !== "sonar";
  if (select.dataset.names !== names && list.length) {
    select.dataset.names = names;
    select.replaceChildren(...list.map((s) => new Option(s.name, s.name)));
    if (view.sensor) select.value = view.sensor;
  }
}

function showVehicle() {
  const s = state.status, p = s && s.pose, slice = state.slice, list = [];
  if (p) {
    list.push(["pose", p.age_s === null ? "none was given" : `${words.seconds(p.age_s)} old`]);
    if (p.has.length) list.push(["it has", p.has.join(", ")]);
    if (p.attitude_deg) list.push(["heading", words.degrees((p.attitude_deg[2] + 360) % 360)], ["roll, pitch", `${p.attitude_deg[0].toFixed(1)}°, ${p.attitude_deg[1].toFixed(1)}°`]);
    if (slice && slice.vehicle_m) list.push(["place", slice.vehicle_m.map((v) => v.toFixed(1)).join(", ") + " m NED"]);
    if (p.altitude_m !== null) list.push(["altitude", `${words.metres(p.altitude_m)} above the bottom`]);
    if (s.depth) list.push(["depth", `${words.metres(s.depth.depth_m)} (${s.depth.state})`]);
    if (p.drift && p.speed_bound.state === "used") list.push(["drift", p.drift]);
    if (p.jumps) list.push(["pose jumps", String(p.jumps)]);
    if (s.leak) list.push(["leak probe", s.leak.state]);
    if (s.record) list.push(["recording", s.record.recording ? `${s.record.messages} messages` : "off"]);
    if (state.map) list.push(["map", state.map.state.split(":")[0]]);
    list.push(["clients", String(s.server.clients_now)]);
  }
  fill($("vehicle"), make("h2", "Vehicle"), list.length ? pairs(list) : make("p", "–", "muted"));
}

// In the corner of the picture: where it points, and how old that is.
function showCompass() {
  const p = fresh() ? poseShown() : null, heading = p ? headingNow() : null;
  const old = !p ? "" : p.age_s === null ? "no pose" : `pose ${words.seconds(p.age_s)} old`;
  fill($("compass"), make("b", heading === null ? "Heading unknown" : `Heading ${words.degrees(heading)}`), make("small", old));
}

function showTiming() {
  const metric = state.stats && state.stats.metrics.find((m) => m.name === "sonard_latency_seconds"), table = make("table");
  const head = make("tr");
  head.append(...["", "median", "99 %", "max"].map((t) => make("th", t)));
  table.append(head);
  for (const s of metric ? metric.samples.filter((x) => x.count > 0) : []) {
    const tr = make("tr");
    tr.append(...[s.labels.stage.replaceAll("_", " "), words.microseconds(s.p50_us), words.microseconds(s.p99_us), words.microseconds(s.max_us)].map((t) => make("td", t)));
    table.append(tr);
  }
  fill($("timing"), make("h2", "Timing"), table);
}

function showPlan() {
  const ul = make("ul");
  for (const s of state.plan ? state.plan.stages : []) {
    const li = make("li", undefined, s.in ? "in" : "out");
    li.append(make("b", (s.in ? "✓ " : "– ") + s.name), ` ${s.of ? "(" + s.of + ") " : ""}${s.why}${s.in && s.bytes ? " · " + words.bytes(s.bytes) : ""}`);
    ul.append(li);
  }
  fill($("plan").querySelector("div"), make("p", state.plan ? `${words.bytes(state.plan.bytes)} in use` : "–", "muted"), ul);
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

let shownAt = 0, showDue = false;
function show() {
  if (showDue) return;
  showDue = true;
  setTimeout(() => {
    showDue = false;
    shownAt = performance.now();
    showHead();
    showWarnings();
    showTiles();
    showTarget();
    showSonars();
    showVehicle();
    showCompass();
    showTiming();
    showPlan();
    showBack();
    showReplay();
    showMapBar();
    const canvas = $("canvas");
    canvas.setAttribute("aria-label", view.tab === "map" ? "Map around the vehicle"
      : "Ring of sectors: " + Array.from(document.querySelectorAll(".tile")).map((t) => t.textContent.trim()).join("; "));
    draw();
  }, Math.max(0, 200 - (performance.now() - shownAt)));
}

// ---- what a person does ----

async function why() {
  const distance = parseFloat($("distance").value) || view.range, azimuth = view.selected, card = $("why");
  draw();
  if (view.back !== null) return fill(card, make("h2", "Why?"), make("p", "sonard explains what it knows now: move the slider to its end."));
  const answer = await ask("explain", { azimuth_deg: azimuth, distance_m: distance, half_angle_deg: 7.5, count: 8 });
  if (answer.error) return fill(card, make("h2", "Why?"), make("p", answer.error.message));
  const w = words.explain(answer.result, azimuth, distance), ul = make("ul");
  ul.append(...w.points.concat(words.echoes(rows.values(), azimuth, 7.5)).map((t) => make("li", t)));
  fill(card, make("h2", "Why?"), make("div", w.where, "muted"), make("div", w.verdict, "verdict " + w.state), make("p", w.text), ul);
}

async function applySetting() {
  const said = $("setting-said");
  said.textContent = "…";
  const late = setTimeout(() => { said.textContent = "No answer yet: it is not known whether this was taken."; }, LATE_MS);
  const answer = await ask("settings", { text: $("setting").value.trim(), token: $("token").value });
  clearTimeout(late);
  said.textContent = answer.lost ? "The connection to sonard-web was lost: it is not known whether this was taken. Apply it again."
    : answer.error ? answer.error.message
    : answer.result.applied.length ? `Applied: ${answer.result.applied.join("; ")}` : "Nothing changed: it was so already, or the daemon does not read this file.";
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
  why();
}

// To the next range that is offered, nearer or farther.
function zoomBy(nearer) {
  const offered = Array.from($("zoom").options, (o) => parseFloat(o.value)).filter((v) => (nearer ? v < view.range : v > view.range));
  if (offered.length) $("zoom").value = String(nearer ? Math.max(...offered) : Math.min(...offered));
}

function setTab(tab) {
  view.tab = tab;
  for (const t of ["sonar", "map"]) $("tab-" + t).setAttribute("aria-selected", String(t === tab));
  for (const e of document.querySelectorAll("[data-for]")) e.hidden = e.dataset.for !== tab;
  state.slice = null;
  watch();
  show();
}

function setTheme(theme) {
  document.documentElement.dataset.theme = theme;
  painter.restyle();
  repaint();
  draw();
}

$("canvas").addEventListener("click", (event) => {
  if (view.tab !== "sonar") return;
  const box = event.target.getBoundingClientRect();
  select((Math.atan2(event.clientX - box.left - box.width / 2, box.top + box.height / 2 - event.clientY) * 180) / Math.PI);
});
$("canvas").addEventListener("keydown", (event) => {
  const step = event.shiftKey ? 1 : 5;
  if (view.tab !== "sonar") return;
  if (event.key === "ArrowLeft" || event.key === "ArrowRight") view.selected = ((view.selected ?? 0) + (event.key === "ArrowLeft" ? -step : step) + 360) % 360;
  else if (event.key === "Enter" || event.key === " ") select(view.selected ?? 0);
  else if (event.key === "+" || event.key === "-") zoomBy(event.key === "+");
  else return;
  event.preventDefault();
  draw();
});
$("tab-sonar").addEventListener("click", () => setTab("sonar"));
$("tab-map").addEventListener("click", () => setTab("map"));
$("distance").addEventListener("change", () => { watch(); show(); });
$("zoom").addEventListener("change", draw);
$("sensor").addEventListener("change", () => { view.sensor = $("sensor").value; forgetImage(); watch(); });
$("size").addEventListener("change", watch);
$("follow").addEventListener("change", () => { $("depth").disabled = $("follow").checked; watch(); });
$("depth").addEventListener("change", watch);
$("settings").querySelector("form").addEventListener("submit", (event) => { event.preventDefault(); applySetting(); });
$("back").addEventListener("input", () => lookBack(-parseFloat($("back").value)));
$("play").addEventListener("click", playOrPause);
$("at").addEventListener("input", () => { view.dragging = true; show(); });
$("at").addEventListener("change", () => replay({ to_s: parseFloat($("at").value) }));
$("speed").addEventListener("change", () => replay({ speed: parseFloat($("speed").value) }));
$("theme").addEventListener("click", () => setTheme(document.documentElement.dataset.theme === "light" ? "dark" : "light"));
document.addEventListener("visibilitychange", watch);
window.addEventListener("resize", draw);
setInterval(() => { if (!document.hidden) { repaint(); show(); } }, 1000);

setTheme(matchMedia("(prefers-color-scheme: light)").matches ? "light" : "dark");
connect();
show();

// For tests: what is shown, and from what.
globalThis.sonardPage = { state, past, rows, view, fresh, painter };
