// SPDX-License-Identifier: MIT
// The panels beside the picture.
import { rates, state } from "./live.js";
import { fresh, shown, view } from "./view.js";
import * as words from "./words.js";

const $ = (id) => document.getElementById(id);

export function make(tag, text, className) {
  const e = document.createElement(tag);
  if (text !== undefined) e.textContent = text;
  if (className) e.className = className;
  return e;
}

export function pairs(list) {
  const dl = make("dl");
  for (const [name, value] of list) dl.append(make("dt", name), make("dd", value));
  return dl;
}

// Replaces a panel's content only when it has changed, so that a screen reader does not read it again and again.
export function fill(element, ...nodes) {
  const next = make("div");
  next.append(...nodes);
  if (element.dataset.shown === next.innerHTML) return;
  element.dataset.shown = next.innerHTML;
  element.replaceChildren(...next.childNodes);
}

// All of them beside the picture; where that is below it, the gravest also in one line above.
export function showWarnings() {
  const list = state.status ? words.warnings(state.status, rates) : [], first = list.find((w) => w.grave) || list[0];
  fill($("warnings"), ...list.map((w) => {
    const e = make("div", undefined, "warning" + (w.grave ? " grave" : "")), text = make("div");
    text.append(make("b", w.what), w.remedy);
    e.append(text);
    return e;
  }));
  $("alarm").hidden = !first;
  $("alarm").textContent = first ? `⚠ ${first.what}${list.length > 1 ? ` (1 of ${list.length})` : ""}` : "";
  $("alarm").classList.toggle("grave", !!first && first.grave);
}

export function showTiles() {
  const sides = [["Ahead", 0], ["Starboard", 90], ["Astern", 180], ["Port", 270]], good = fresh();
  fill($("tiles"), ...sides.map(([name, azimuth]) => {
    const s = good ? words.summary(shown().sectors, azimuth, 15) : { state: "unknown", free_to_m: 0, age_s: null };
    const e = make("div", undefined, "tile " + s.state);
    const what = s.state === "blocked" ? `■ Blocked ${words.metres(s.range_m).replace(" ", "\u00a0")}` : s.state === "clear" ? "✓ Clear" : "? Unknown";
    const more = !good ? "no answer" : s.state === "blocked" ? `echo ${words.seconds(s.age_s)} ago` : `free to ${words.metres(s.free_to_m)}`;
    e.append(make("small", `${name} ±15°`), make("b", what), make("small", more));
    e.dataset.azimuth = azimuth;
    return e;
  }));
}

export function showSonars() {
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
  $("sensor-label").hidden = list.length < 2 || view.tab === "map";
  if (select.dataset.names !== names && list.length) {
    select.dataset.names = names;
    select.replaceChildren(...list.map((s) => new Option(s.name, s.name)));
    if (view.sensor) select.value = view.sensor;
  }
}

export function showVehicle() {
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
    if (s.record) list.push(["recording", s.record.recording ? `${s.record.recording_messages} messages` : s.record.paused ? "ready" : "off"]);
    if (state.map) list.push(["map", state.map.state.split(":")[0]]);
    list.push(["clients", String(s.server.clients_now)]);
  }
  fill($("vehicle"), make("h2", "Vehicle"), list.length ? pairs(list) : make("p", "–", "muted"));
}

export function showTiming() {
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

export function showPlan() {
  const ul = make("ul");
  for (const s of state.plan ? state.plan.stages : []) {
    const li = make("li", undefined, s.in ? "in" : "out");
    li.append(make("b", (s.in ? "✓ " : "– ") + s.name), ` ${s.of ? "(" + s.of + ") " : ""}${s.why}${s.in && s.bytes ? " · " + words.bytes(s.bytes) : ""}`);
    ul.append(li);
  }
  fill($("plan").querySelector("div"), make("p", state.plan ? `${words.bytes(state.plan.bytes)} in use` : "–", "muted"), ul);
}
