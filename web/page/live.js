// SPDX-License-Identifier: MIT
// What the daemon says, over a WebSocket to sonard-web: the newest of everything, and what came before, to look back at.
// What is not fresh is unknown.

export const STALE_MS = 2500; // sectors older than this are not shown
const TRACK_MAX = 2000;

// What the daemon said last; null: not known.
export const state = { link: null, status: null, sensors: null, sectors: null, stats: null, plan: null, slice: null, map: null, connected: false, sectorsAt: 0 };
const answers = new Map(); // method -> {result or error, at}: of methods that are not in state
export const rows = new Map(); // azimuth in hundredths of a degree -> newest row of the image
export const rates = new Map();
export const track = [];
// What came, oldest first, to look back at: rows of the image, and {t, sectors, pose}. A multibeam fills a phone in minutes.
export const past = { rows: [], bytes: 0, frames: [] };
export const PAST_S = 1800;
const PAST_BYTES = 48 << 20;
const bytesOf = (row) => 256 + row.bins.length;
const clock = { unix: 0, at: 0 }; // of the daemon, and when it said so
let before = null; // an older status, for rates
// Of the page: what it wants to see, and what it does with news, with rows, and when all of it is void.
let page = { wanted: () => [], news() {}, newRows() {}, forgotten() {} };

// ---- the connection ----

let socket = null, retry = 500, lastId = 0;
const waiting = new Map();

const isOpen = () => socket !== null && socket.readyState === WebSocket.OPEN;

export function watch() {
  if (isOpen()) socket.send(JSON.stringify({ watch: page.wanted() }));
}

function forget() {
  state.status = state.sensors = state.sectors = state.stats = state.plan = state.slice = state.map = null;
  before = null;
  clock.unix = 0;
  rates.clear();
  answers.clear();
  rows.clear();
  past.rows.length = past.frames.length = past.bytes = 0;
  track.length = 0;
  page.forgotten();
}

function open() {
  socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/live`, "sonard");
  socket.binaryType = "arraybuffer";
  socket.onopen = () => { retry = 500; state.connected = true; watch(); };
  socket.onmessage = (event) => {
    if (typeof event.data === "string") takeText(JSON.parse(event.data));
    else takeRows(event.data);
  };
  socket.onclose = () => {
    state.connected = false;
    state.link = null;
    for (const resolve of waiting.values()) resolve({ lost: true, error: { message: "the connection was lost" } });
    waiting.clear();
    forget();
    page.news();
    setTimeout(open, retry);
    retry = Math.min(retry * 2, 4000);
  };
}

export function connect(callbacks) {
  page = callbacks;
  open();
}

// The answer to one question: {result} or {error}; `lost`: it is not known what became of the question.
export function ask(method, params) {
  return new Promise((resolve) => {
    if (!isOpen() || waiting.size >= 2) return resolve({ error: { message: "sonard-web cannot be asked now" } });
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
  else answers.set(method, { result: result || null, error: message.error || null, at: performance.now() });
  page.news();
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

export const hasMap = () => state.map !== null && !state.map.state.startsWith("none");

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

// As view_rows.h has them.
function takeRows(buffer) {
  const data = new DataView(buffer), name = data.getUint8(1), n = data.getUint16(2, true), came = [];
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
    came.push(row);
  }
  dropOldRows();
  page.newRows(came);
}

// ---- the time ----

export const hasEnded = () => state.status !== null && state.status.mode === "replay, ended";

// How fast the daemon's clock runs: in a replay that is paused or has ended it stands.
function pace() {
  const r = state.status && state.status.replay;
  return !r ? 1 : hasEnded() || r.paused || r.jumping ? 0 : r.speed;
}

export const daemonNow = () => clock.unix + pace() * (performance.now() - clock.at) / 1000;

// What the daemon said last of a method, while that is new; else null.
export function newest(method) {
  const answer = answers.get(method);
  return answer && performance.now() - answer.at < STALE_MS ? answer : null;
}

// Is what the daemon said last still true enough to be shown?
export const isFresh = () => state.connected && state.link !== null && state.link.fault === null && state.sectors !== null && performance.now() - state.sectorsAt < STALE_MS;
