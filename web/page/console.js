// SPDX-License-Identifier: MIT
// The sonar console: how the picture is coloured, whether it stands still, and what the head is told.
import { ask, state } from "./live.js";
import { gradient } from "./image.js";
import { view } from "./view.js";

const RANGES_M = [1, 2, 3, 5, 7.5, 10, 15, 20, 30, 50, 75, 100, 150, 200];
const LATE_MS = 2000; // an answer to a change that takes longer is doubted
const $ = (id) => document.getElementById(id);

export const questions = () => ($("console").open && view.tab === "sonar" ? [{ method: "sensors" }] : []);

// ---- what may be set, with the token ----

// "[section] key = value" to the daemon, and what came of it into an element that says so.
export async function applySetting(text, said) {
  said.textContent = "…";
  const late = setTimeout(() => { said.textContent = "No answer yet: it is not known whether this was taken."; }, LATE_MS);
  const answer = await ask("settings", { text, token: $("token").value });
  clearTimeout(late);
  said.textContent = answer.lost ? "The connection to sonard-web was lost: it is not known whether this was taken. Apply it again."
    : answer.error ? answer.error.message
    : answer.result.applied.length ? `Applied: ${answer.result.applied.join("; ")}` : "Nothing changed: it was so already, or a file with a later name or the command line says otherwise.";
}

// ---- the head ----

const head = () => (state.sensors ? state.sensors.sensors.find((s) => s.name === view.sensor) || state.sensors.sensors[0] : null) || null;

function offer(select, values, now, text) {
  const all = values.includes(now) ? values : [...values, now].sort((a, b) => a - b), key = all.join();
  if (select.dataset.offered !== key) {
    select.dataset.offered = key;
    select.replaceChildren(...all.map((v) => new Option(text(v), v)));
  }
  if (document.activeElement !== select) select.value = String(now);
}

// What is missing before the head can be told something; "": nothing.
function missing(t) {
  if (!t) return "This sonar takes its settings when sonard starts.";
  if (!state.link || !state.link.settings) return "Nothing can be set from this page: sonard-web was started without --settings. Its manual says how to allow it (sonard-web(8), SETTINGS).";
  return $("token").value ? "" : "To set these, enter the token: at the bottom of this page, under Settings.";
}

// A head that takes nothing while it runs is named, and why there is nothing to set.
export function showConsole() {
  const s = $("console").open ? head() : null, t = s && s.tuning;
  $("head").disabled = !t || !state.link || !state.link.settings;
  $("head-name").textContent = s ? `Settings of ${s.name}` : "Settings of the sonar";
  $("head-none").textContent = s ? missing(t) : "";
  $("head-none").hidden = !$("head-none").textContent;
  for (const id of ["head-range", "head-gain"]) $(id).parentElement.hidden = !t;
  $("head-mode").parentElement.hidden = !t || t.mode === null;
  if (!t) return;
  offer($("head-range"), RANGES_M.filter((r) => r >= t.range_least_m && r <= t.range_most_m), t.range_m, (v) => `${v} m`);
  offer($("head-gain"), Array.from({ length: t.gain_most + 2 }, (_, k) => k - 1), t.gain ?? -1, (v) => (v < 0 ? "auto" : String(v)));
  if (t.mode !== null && document.activeElement !== $("head-mode")) $("head-mode").value = t.mode;
}

// What was chosen is told to the head at once; what is shown afterwards is what the daemon says.
async function tell(key, value) {
  const s = head(), said = $("head-said");
  if (!s) return;
  if (!$("token").value) {
    said.textContent = "This needs the token: enter it under Settings, and choose again.";
    $("settings").open = true;
    $("token").focus();
  } else await applySetting(`[sonar ${s.name}] ${key} = ${value}`, said);
  showConsole();
}

// ---- the picture ----

// The key to the picture has its colours.
export function showPalette() {
  document.querySelector(".key.loud").style.background = gradient(document.documentElement.dataset.theme, view);
  $("contrast").setAttribute("aria-valuetext", $("contrast-said").textContent);
}

// repaint: colour the picture anew; freeze: let it stand still, or go on; watch: ask for what is shown.
export function beginConsole({ repaint, freeze, watch }) {
  $("palette").addEventListener("change", () => { view.palette = $("palette").value; repaint(); });
  $("contrast").addEventListener("input", () => {
    view.contrast = parseFloat($("contrast").value);
    $("contrast-said").textContent = view.contrast === 0 ? "normal" : `${view.contrast > 0 ? "+" : "−"}${Math.abs(view.contrast)}`;
    repaint();
  });
  $("freeze").addEventListener("click", freeze);
  $("token").addEventListener("input", showConsole);
  $("console").addEventListener("toggle", () => { watch(); showConsole(); });
  $("head-range").addEventListener("change", () => tell("range", `${$("head-range").value} m`));
  $("head-gain").addEventListener("change", () => tell("gain", parseInt($("head-gain").value) < 0 ? "auto" : $("head-gain").value));
  $("head-mode").addEventListener("change", () => tell("mode", $("head-mode").value));
}
