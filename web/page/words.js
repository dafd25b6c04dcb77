// SPDX-License-Identifier: MIT
// Answers of the daemon in words: pure functions, without the page.

export const metres = (v) => (v === null || v === undefined || !isFinite(v) ? "–" : v < 9.995 ? v.toFixed(2) + " m" : v.toFixed(1) + " m");
// Of what is free: cut off and not rounded, never farther than it is.
export const freeMetres = (v) => metres(v === null || v === undefined ? v : v < 10 ? Math.floor(v * 100 + 1e-6) / 100 : Math.floor(v * 10 + 1e-6) / 10);
export const seconds = (v) =>
  v === null || v === undefined ? "never" : v < 9.95 ? v.toFixed(1) + " s" : v < 120 ? Math.round(v) + " s" : v < 7200 ? Math.round(v / 60) + " min" : Math.round(v / 3600) + " h";
// "1:05.3": minutes, and seconds with a tenth.
export function clock(v) {
  const tenths = Math.round(v * 10);
  return `${Math.floor(tenths / 600)}:${((tenths % 600) / 10).toFixed(1).padStart(4, "0")}`;
}
export const timeOfDay = (unix) => new Date(unix * 1000).toISOString().slice(11, 19) + " UTC";
export const degrees = (v) => `${Math.round(v) % 360}°`;
// "No position: ... ." of "no position: ...": what the daemon says, as a sentence by itself.
export const sentence = (text) => text.charAt(0).toUpperCase() + text.slice(1) + (/[.!?]$/.test(text) ? "" : ".");
export const bytes = (n) => (n === null || n === undefined ? "" : n < 1e6 ? Math.round(n / 1024) + " KiB" : (n / 1048576).toFixed(1) + " MiB");
export const microseconds = (v) => (v < 1000 ? Math.round(v) + " µs" : (v / 1000).toFixed(1) + " ms");

const many = (n, one, more) => `${n} ${n === 1 ? one : more}`;

const SIDES = ["ahead", "ahead to starboard", "to starboard", "astern to starboard", "astern", "astern to port", "to port", "ahead to port"];

// "30° (ahead to starboard)" of an azimuth clockwise from the bow.
export function direction(azimuth) {
  const a = ((Math.round(azimuth) % 360) + 360) % 360;
  return `${a}° (${SIDES[Math.round(a / 45) % 8]})`;
}

// The reasons of the protocol, with what to do about them.
const REASONS = [
  ["never observed", "No beam has covered it yet: wait for a full revolution of the head, or check sector, mount and near in the configuration."],
  ["no obstacle detected", "The water is known to be free only up to there. Ask for less; the rule is no_echo in [extract]."],
  ["water next to the vehicle", "The vehicle may have drifted since the last scan: the top of the page says what would make that less."],
  ["blind zone", "It lies within the transducer's ring-down. Ask for more, or set near in [vehicle]."],
  ["last scan of this direction", "The last scan is older than clear_for. Scan faster: a larger step or a smaller sector."],
  ["has moved since", "The vehicle has moved since: scan this direction again."],
  ["is offline", "The sonar that covers this direction sends no pings: see Sonars."],
  ["pose", "Keep sending poses: answers are unknown while the last one is too old."],
];

export function remedy(reason) {
  const found = REASONS.find(([part]) => (reason || "").includes(part));
  return found ? found[1] : "";
}

// The worst of the sectors within `half` degrees of an azimuth: blocked before unknown before clear.
export function summary(sectors, azimuth, half) {
  const off = (a) => Math.abs(((a - azimuth + 540) % 360) - 180);
  const inside = sectors.filter((s) => off(s.azimuth_deg) <= half);
  const blocked = inside.filter((s) => s.state === "blocked").sort((a, b) => a.range_m - b.range_m)[0];
  if (blocked) return { state: "blocked", range_m: blocked.range_m, age_s: blocked.age_s };
  const free_to_m = Math.min(...inside.map((s) => s.free_to_m));
  const ages = inside.map((s) => s.age_s);
  const age_s = ages.some((a) => a === null) ? null : Math.max(...ages);
  const clear = inside.length > 0 && inside.every((s) => s.state === "clear");
  return { state: clear ? "clear" : "unknown", free_to_m: isFinite(free_to_m) ? free_to_m : 0, age_s };
}

// What summary says, in words; null: nothing is known.
export const inWords = (s) => !s ? "no answer" : s.state === "blocked" ? `blocked at ${metres(s.range_m)}` : s.state === "clear" ? "clear" : `unknown, free to ${freeMetres(s.free_to_m)}`;

// Metres to the obstacle, or that are free; "?" where it is unknown, after what is free before. Cut off and not rounded:
// never farther than it is.
function howFar(s, near) {
  const m = s.state === "blocked" ? s.range_m : s.free_to_m, text = m < 10 ? (Math.floor(m * 10) / 10).toFixed(1) : String(Math.floor(m));
  return s.state !== "unknown" ? text : m > near ? text + "?" : "?";
}

// The numbers around the ring, one for each 15 degrees: [{azimuth, state, text}].
export const aroundInNumbers = (sectors, near) => Array.from({ length: 24 }, (_, k) => {
  const s = summary(sectors, 15 * k, 7.5);
  return { azimuth: 15 * k, state: s.state, text: howFar(s, near) };
});

// What clear water is clear of, as an answer says it ("wall", "7 dB below a wall", "what the sonar reports"): mud is no wall.
export function target(a) {
  if (!a || !a.target) return "";
  const obstacles = a.target.replace(/^(\w+)(?=,|$)/, "$1s").replace(/^\d/, "what echoes $&");
  return obstacles + (a.bottom_db === null ? "; soft bottoms may be there" : `, and of bottoms down to ${a.bottom_db} dB below a wall; softer mud may be there`);
}

// An answer of the method explain as {verdict, state, text, points}.
export function explain(e, azimuth, distance) {
  const a = e.answer, points = [];
  const where = `${direction(azimuth)}, up to ${metres(distance)}`;
  const verdict = a.state === "blocked" ? `Blocked at ${metres(a.range_m)}` : a.state === "clear" ? `Clear to ${metres(distance)}` : "Unknown";
  const text =
    a.state === "blocked"
      ? `An obstacle stands at ${metres(a.range_m)} ± ${metres(a.range_sd_m)}, ${Math.round(a.confidence * 100)} % sure. Its last echo came ${seconds(a.age_s)} ago.`
      : a.state === "clear"
        ? `Beams passed without an echo, the oldest ${seconds(a.age_s)} ago. Nearer than ${metres(a.blind_to_m)} nothing is known.${target(a) && ` Clear of ${target(a)}.`}`
        : `Because: ${a.reason}. Known to be free up to ${freeMetres(a.free_to_m)}. ${remedy(a.reason)}`;
  const nearest = e.cells.nearest[0];
  if (nearest)
    points.push(
      `${many(e.cells.all, "cell of the grid blocks", "cells of the grid block")} there. The nearest begins at ${metres(nearest.near_m)}, was built by ${many(nearest.echoes, "echo", "echoes")} ` +
        `(the first ${seconds(nearest.first_echo_age_s)} ago), and ${nearest.misses === 0 ? "no beam has" : many(nearest.misses, "beam has", "beams have")} passed it since without one.`,
    );
  if (e.gone.all > 0) points.push(`${many(e.gone.all, "cell that stood there was", "cells that stood there were")} cleared by later beams.`);
  if (e.water !== null && e.water.free_to_m > e.water.free_from_m) points.push(`By the records of pings the cone is free from ${metres(e.water.free_from_m)} to ${metres(e.water.free_to_m)}.`);
  const p = e.pings, all = p.echo + p.free + p.nothing + p.own;
  points.push(
    all > 0
      ? `Of the last ${all} beams that touched it (the oldest ${seconds(p.back_to_s)} ago), ${p.echo} had an echo there, ${p.free} found free space, and ${p.nothing} showed nothing usable${p.own > 0 ? `; ${p.own} had an echo of the vehicle itself` : ""}.`
      : "No remembered beam touched it.",
  );
  const last = p.newest[0];
  if (last)
    points.push(
      `The newest of ${last.sensor}, ${seconds(last.age_s)} ago at ${Math.round(last.azimuth_deg)}°: ` +
        (last.says === "echo" ? `echo at ${metres(last.range_m)}, ${Math.round(last.confidence * 100)} % sure` : last.says === "free" ? `free space from ${metres(last.blind_to_m)} to ${freeMetres(last.free_to_m)}` : last.says === "own" ? `an echo of the vehicle itself at ${metres(last.range_m)}` : "nothing usable") +
        ".",
    );
  return { where, verdict, state: a.state, text, points };
}

// The echoes of the picture within `half` degrees of an azimuth, nearest first, as a list of at most one sentence.
export function echoes(rows, azimuth, half) {
  const off = (a) => Math.abs(((a - azimuth + 540) % 360) - 180), found = [];
  for (const row of rows) if (off(row.azimuth) <= half) found.push(...row.echoes);
  found.sort((a, b) => a.range - b.range);
  const told = found.slice(0, 6).map((e) => `${metres(e.range)} (${Math.round(e.sure * 100)} % sure${e.marks ? ", doubtful" : ""})`);
  if (!told.length) return [];
  return [`Echoes of the newest beams there: ${told.join(", ")}${found.length > told.length ? `, and ${found.length - told.length} more` : ""}.`];
}

// Does another warning name the cause of what `data` says?
function isNamed(status) {
  const lost = status.sensors.some((s) => s.state !== "running"), deaf = status.sensors.some((s) => s.hearing_doubt), age = status.pose.age_s;
  return (lost && /no data from|stopped sending/.test(status.data)) || (deaf && status.data.includes("hearing_doubt")) || (age !== null && age > 1 && status.data.includes("pose is too old"));
}

// What a person should do something about: [{what, remedy, grave}].
export function warnings(status, rates) {
  const list = [], add = (what, todo, grave) => list.push({ what, remedy: todo, grave: !!grave });
  if (status.leak && status.leak.state === "wet") add("Leak: the probe is wet", "Bring the vehicle up now.", true);
  for (const s of status.sensors) {
    if (s.state === "no port") add(`${s.name}: no port. ${s.port_error || ""}`, "Is the adapter plugged in, and user sonard in group dialout? sonard tries again every second.", true);
    else if (s.state === "silent") add(`${s.name} sends no pings`, "Check its power, its cable and the baud rate. sonard tries again by itself.", true);
    else if (s.state !== "running") add(`${s.name}: ${s.state}`, "Wait some seconds. If it stays so: power, cable, baud rate.");
    if (s.hearing_doubt) add(`${s.name}: ${s.hearing_doubt}`, "Nothing that it reports as free is believed. Check the transducer, its cable and whether the head is in the water.");
    if (s.amplitude_doubt) add(`${s.name}: ${s.amplitude_doubt}`, "See the sonar's page in docs/devices: the amplitude law decides what counts as an echo.");
    if (s.detects && s.detects.noisy) add(`${s.name}: its noise is as loud as the bottom that is looked for, so nothing is free`, "Lower its gain, or set bottom in [extract] to fewer decibels or to off.");
    if (rates.get(s.name + ".bad_checksum") > 0.2) add(`${s.name}: frames arrive damaged`, "Check cable, ground and baud rate.");
  }
  if (status.data !== "ok" && !isNamed(status)) add(status.data, "Answers use old data only.", true);
  const pose = status.pose.age_s;
  if (pose !== null && pose > 1) add(`The pose is ${seconds(pose)} old`, "Keep sending poses: directions are unknown while the last one is too old. Check sonard-mavlink, or the program that sends them.", true);
  if (status.pose.drift && status.pose.speed_bound.state !== "used") add(sentence(status.pose.drift), "");
  if (status.pose.doubt) add(`Poses: ${status.pose.doubt}`, "A DVL without bottom lock sends zeros: let its program leave the velocity out meanwhile.", true);
  if (rates.get("dropped") > 0) add("Pings are dropped: the computer is too slow", "Set [pipeline] threads, or find cheaper settings with sonard-tune.");
  if (status.grid.cells_lost > 0) add(`${status.grid.cells_lost} cells of the grid were lost`, "Raise max_cells in [grid].");
  if (status.record && status.record.error) add(`Recording: ${status.record.error}`, "Check the disk of [record] directory.");
  return list;
}
