// SPDX-License-Identifier: MIT
// The pictures: the sonar's image with the ring around it, and the slice of the map. Colours come from the style sheet.
import { Image, palette } from "./image.js";
import { aroundInNumbers, metres } from "./words.js";

const TAU = 2 * Math.PI;
const rad = (deg) => ((deg - 90) * Math.PI) / 180; // an angle on the screen, clockwise from up, to the canvas's angle
const apart = (a, b) => Math.abs(((a - b + 540) % 360) - 180);
const FACE = "system-ui, sans-serif";

// How solid a sector of the ring is: an obstacle the more so the nearer it stands, free water the farther behind it the
// nearest one stands.
export function shade(s, judged) {
  if (s.state === "unknown" || !judged) return 1;
  const part = s.range_m === null ? 1 : s.state === "blocked" ? 1 - s.range_m / judged : s.range_m / judged - 1;
  return 0.45 + 0.55 * Math.min(1, Math.max(0, part));
}

export class Painter {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.image = new Image(560);
    this.turn = 0; // of the picture, clockwise in degrees: where the bow points on the screen
    this.frame = { x: 0, y: 0, scale: 1, turn: 0 }; // where the picture's origin is, and how many pixels a metre has
    this.scaleAt = 0; // direction of the scale's labels
    this.restyle({ palette: "page", contrast: 0 });
  }

  // look: {palette, contrast} of the image.
  restyle(look) {
    const style = getComputedStyle(document.documentElement);
    this.colour = {};
    for (const name of ["ground", "panel", "line", "text", "muted", "accent", "blocked", "clear", "unknown", "disc", "echo", "echo-edge", "warn"])
      this.colour[name] = style.getPropertyValue("--" + name).trim();
    this.table = palette(document.documentElement.dataset.theme, look);
    const tile = document.createElement("canvas"), t = tile.getContext("2d");
    tile.width = tile.height = 8;
    t.strokeStyle = this.colour.unknown;
    t.lineWidth = 1.6;
    t.beginPath();
    for (const k of [-8, 0, 8]) { t.moveTo(k, 8); t.lineTo(k + 8, 0); }
    t.stroke();
    this.hatch = this.context.createPattern(tile, "repeat");
  }

  begin() {
    const box = this.canvas.getBoundingClientRect(), dpr = Math.min(window.devicePixelRatio || 1, 2);
    const side = Math.max(1, Math.round(box.width * dpr));
    if (this.canvas.width !== side) this.canvas.width = this.canvas.height = side;
    this.unit = dpr;
    this.side = side;
    this.context.setTransform(1, 0, 0, 1, 0, 0);
    this.context.clearRect(0, 0, side, side);
    return this.context;
  }

  // Radii of the disc and of the ring around it, in pixels.
  geometry() {
    const u = this.unit, outer = this.side / 2 - 24 * u, thick = Math.max(12 * u, outer * 0.055);
    return { u, c: this.side / 2, outer, inner: outer - thick, disc: outer - thick - 4 * u };
  }

  // An azimuth from the bow to the canvas's angle.
  rad(azimuth) {
    return rad(azimuth + this.turn);
  }

  // Metres ahead (north) and to starboard (east) of a place on the canvas, in CSS pixels; and back, in the canvas's own.
  place(x, y) {
    const f = this.frame, dx = (x * this.unit - f.x) / f.scale, dy = (y * this.unit - f.y) / f.scale, sin = Math.sin(f.turn), cos = Math.cos(f.turn);
    return [dx * sin - dy * cos, dx * cos + dy * sin];
  }

  pixels([ahead, right]) {
    const f = this.frame, sin = Math.sin(f.turn), cos = Math.cos(f.turn);
    return [f.x + f.scale * (ahead * sin + right * cos), f.y + f.scale * (right * sin - ahead * cos)];
  }

  // What is measured: points joined by a line, and where the next one goes.
  ruler(measure) {
    const g = this.context, u = this.unit, points = measure.points.map((p) => this.pixels(p)), [x, y] = this.pixels(measure.cursor);
    g.lineWidth = 2 * u;
    g.strokeStyle = this.colour.warn;
    g.beginPath();
    points.forEach((p, i) => (i ? g.lineTo(...p) : g.moveTo(...p)));
    for (const [px, py] of points) { g.moveTo(px + 5 * u, py); g.arc(px, py, 5 * u, 0, TAU); }
    g.moveTo(x - 9 * u, y); g.lineTo(x + 9 * u, y);
    g.moveTo(x, y - 9 * u); g.lineTo(x, y + 9 * u);
    g.stroke();
  }

  sector(from, to, r0, r1) {
    const g = this.context, c = this.side / 2;
    g.beginPath();
    g.arc(c, c, r1, this.rad(from), this.rad(to));
    g.arc(c, c, Math.max(0, r0), this.rad(to), this.rad(from), true);
    g.closePath();
  }

  // model: what is known now (app.js); everything is unknown when model.fresh is false.
  sonar(model) {
    const g = this.begin(), { u, c, outer, inner, disc } = this.geometry(), px = disc / model.range;
    this.turn = model.turn;
    this.frame = { x: c, y: c, scale: px, turn: (model.turn * Math.PI) / 180 };
    g.fillStyle = this.colour.disc;
    g.beginPath();
    g.arc(c, c, disc, 0, TAU);
    g.fill();
    if (model.fresh) {
      g.save();
      g.beginPath();
      g.arc(c, c, disc, 0, TAU);
      g.clip();
      this.picture(c, disc);
      this.freeWater(model, px, disc);
      g.restore();
    }
    this.circles(model, px, disc);
    if (model.fresh) {
      this.echoes(model, px, disc);
      this.obstacles(model, px, disc);
      this.sweep(model, disc);
    }
    this.ring(model, inner, outer);
    this.selection(model, disc, outer);
    this.boat(c, c, this.turn, u);
    this.labels(model, px, disc);
    this.bearings(model, disc, u);
    if (model.fresh) this.numbers(model, outer, u);
  }

  picture(c, disc) {
    const g = this.context;
    g.save();
    g.translate(c, c);
    g.rotate((this.turn * Math.PI) / 180);
    g.imageSmoothingQuality = "high";
    g.drawImage(this.image.canvas, -disc, -disc, 2 * disc, 2 * disc);
    g.restore();
  }

  freeWater(model, px, disc) {
    const g = this.context;
    for (const s of model.sectors) {
      const r0 = s.blind_to_m * px, r1 = Math.min(s.free_to_m * px, disc);
      if (r1 <= r0) continue;
      this.sector(s.azimuth_deg - s.width_deg / 2, s.azimuth_deg + s.width_deg / 2, r0, r1);
      g.globalAlpha = 0.13;
      g.fillStyle = this.colour.clear;
      g.fill();
      g.globalAlpha = 0.9;
      g.strokeStyle = this.colour.clear;
      g.lineWidth = 1.6 * this.unit;
      g.beginPath();
      g.arc(this.side / 2, this.side / 2, r1, this.rad(s.azimuth_deg - s.width_deg / 2), this.rad(s.azimuth_deg + s.width_deg / 2));
      if (s.free_to_m * px < disc) g.stroke();
    }
    g.globalAlpha = 1;
  }

  circle(r, width, colour, dash) {
    const g = this.context, c = this.side / 2;
    g.lineWidth = width * this.unit;
    g.strokeStyle = colour;
    g.setLineDash(dash.map((v) => v * this.unit));
    g.beginPath();
    g.arc(c, c, r, 0, TAU);
    g.stroke();
    g.setLineDash([]);
  }

  step(model) {
    return [0.25, 0.5, 1, 2, 5, 10, 20, 50].find((s) => model.range / s <= 5) || 100;
  }

  circles(model, px, disc) {
    const g = this.context, step = this.step(model);
    g.globalAlpha = 0.35;
    for (let r = step; r < model.range * 0.999; r += step) this.circle(r * px, 1, this.colour.muted, []);
    g.globalAlpha = 1;
    if (model.near > 0) this.circle(Math.min(model.near * px, disc), 1, this.colour.muted, [3, 3]);
    if (model.judged * px < disc) this.circle(model.judged * px, 1.5, this.colour.accent, [8, 5]);
  }

  // The ranges of the circles, along the direction where they cover least; it changes only for a better one.
  labels(model, px, disc) {
    const g = this.context, c = this.side / 2, u = this.unit, step = this.step(model);
    const candidates = Array.from({ length: 8 }, (_, k) => 22.5 + 45 * k);
    const covered = candidates.map((a) => {
      const screen = (azimuth) => apart(azimuth + this.turn, a) < 12;
      let n = model.sectors.filter((s) => s.obstacle && screen(s.azimuth_deg)).length;
      for (const row of model.rows.values()) if (screen(row.azimuth)) n += row.echoes.length;
      return n;
    });
    const best = covered.indexOf(Math.min(...covered));
    if (covered[best] + 3 < covered[this.scaleAt]) this.scaleAt = best;
    const a = rad(candidates[this.scaleAt]);
    g.font = `${11 * u}px ${FACE}`;
    g.textAlign = "center";
    g.textBaseline = "middle";
    const judged = model.judged > 0 && model.judged * px < disc - 24 * u ? c + model.judged * px + 9 * u : null; // below its circle
    for (let r = step; r * px < disc - 24 * u; r += step) {
      const x = c + r * px * Math.cos(a), y = c + r * px * Math.sin(a);
      const free = judged === null || Math.abs(x - c) > 70 * u || Math.abs(y - judged) > 14 * u;
      if (free && r * px > 16 * u) this.label(`${+r.toFixed(2)} m`, x, y, this.colour.muted);
    }
    if (judged !== null) this.label(`judged to ${metres(model.judged)}`, c, judged, this.colour.accent);
  }

  label(text, x, y, colour) {
    const g = this.context;
    g.lineWidth = 3 * this.unit;
    g.strokeStyle = this.colour.disc;
    g.lineJoin = "round";
    g.strokeText(text, x, y);
    g.fillStyle = colour;
    g.fillText(text, x, y);
  }

  echoes(model, px, disc) {
    const g = this.context, c = this.side / 2, u = this.unit;
    for (const row of model.rows.values())
      for (const echo of row.echoes) {
        const r = echo.range * px;
        if (r > disc - 2 * u) continue;
        const a = this.rad(row.azimuth), x = c + r * Math.cos(a), y = c + r * Math.sin(a);
        g.globalAlpha = Math.max(0.15, model.fade(row));
        g.beginPath();
        if (echo.marks) { // what is no target, or may be none, has no body
          const d = 2.6 * u;
          g.moveTo(x - d, y - d); g.lineTo(x + d, y + d);
          g.moveTo(x - d, y + d); g.lineTo(x + d, y - d);
          g.lineWidth = u;
          g.strokeStyle = this.colour.muted;
          g.stroke();
          continue;
        }
        g.arc(x, y, (1.2 + 1.4 * echo.sure) * u, 0, TAU);
        g.fillStyle = this.colour.echo;
        g.fill();
        g.lineWidth = 0.8 * u;
        g.strokeStyle = this.colour["echo-edge"];
        g.stroke();
      }
    g.globalAlpha = 1;
  }

  obstacles(model, px, disc) {
    const g = this.context, c = this.side / 2, u = this.unit;
    for (const s of model.sectors) {
      if (s.range_m === null || s.range_m * px > disc) continue; // beyond the distance, too
      const from = this.rad(s.azimuth_deg - s.width_deg / 2), to = this.rad(s.azimuth_deg + s.width_deg / 2);
      for (const [width, colour] of [[5.5, this.colour.disc], [3.2, this.colour.blocked]]) {
        g.lineWidth = width * u;
        g.strokeStyle = colour;
        g.beginPath();
        g.arc(c, c, s.range_m * px, from, to);
        g.stroke();
      }
    }
  }

  sweep(model, disc) {
    if (!model.newest) return;
    const g = this.context, c = this.side / 2, a = this.rad(model.newest.azimuth);
    g.strokeStyle = this.colour.text;
    g.globalAlpha = 0.75;
    g.lineWidth = 1.5 * this.unit;
    g.beginPath();
    g.moveTo(c, c);
    g.lineTo(c + disc * Math.cos(a), c + disc * Math.sin(a));
    g.stroke();
    g.globalAlpha = 1;
  }

  ring(model, inner, outer) {
    const g = this.context, u = this.unit;
    const sectors = model.fresh && model.sectors.length ? model.sectors : [{ azimuth_deg: 180, width_deg: 359.99, state: "unknown" }];
    for (const s of sectors) {
      const from = s.azimuth_deg - s.width_deg / 2, to = s.azimuth_deg + s.width_deg / 2;
      const gap = sectors.length > 1 ? Math.min(0.35, s.width_deg * 0.08) : 0;
      this.sector(from + gap, to - gap, s.state === "clear" ? (inner + outer) / 2 : inner, outer);
      g.fillStyle = this.colour.disc;
      g.fill();
      g.globalAlpha = shade(s, model.judged);
      g.fillStyle = s.state === "blocked" ? this.colour.blocked : s.state === "clear" ? this.colour.clear : this.hatch;
      g.fill();
      g.globalAlpha = 1;
      if (s.state === "unknown") {
        g.lineWidth = 0.7 * u;
        g.strokeStyle = this.colour.unknown;
        g.stroke();
      }
    }
  }

  // How far it is in metres, a number for each 15 degrees.
  numbers(model, outer, u) {
    const g = this.context, c = this.side / 2, r = outer + 12 * u;
    g.textAlign = "center";
    g.textBaseline = "middle";
    for (const { azimuth, state, text } of aroundInNumbers(model.sectors, model.near)) {
      const a = this.rad(azimuth);
      g.font = `${state === "blocked" ? "700 " : ""}${11 * u}px ${FACE}`;
      g.fillStyle = state === "unknown" ? this.colour.muted : this.colour[state];
      g.fillText(text, c + r * Math.cos(a), c + r * Math.sin(a));
    }
  }

  selection(model, disc, outer) {
    if (model.selected === null) return;
    const g = this.context;
    this.sector(model.selected - 7.5, model.selected + 7.5, 0, outer + 3 * this.unit);
    g.fillStyle = this.colour.accent;
    g.globalAlpha = 0.12;
    g.fill();
    g.globalAlpha = 1;
    g.strokeStyle = this.colour.accent;
    g.lineWidth = 2 * this.unit;
    g.stroke();
  }

  boat(x, y, heading, u) {
    const g = this.context;
    g.save();
    g.translate(x, y);
    g.rotate((heading * Math.PI) / 180);
    g.beginPath();
    g.moveTo(0, -11 * u);
    g.lineTo(7 * u, 9 * u);
    g.lineTo(0, 5 * u);
    g.lineTo(-7 * u, 9 * u);
    g.closePath();
    g.fillStyle = this.colour.text;
    g.fill();
    g.lineWidth = 2 * u;
    g.strokeStyle = this.colour.disc;
    g.stroke();
    g.restore();
  }

  // Bearings at the rim: from the bow, or from north where that is at the top; and where north is.
  bearings(model, disc, u) {
    const g = this.context, c = this.side / 2, r = disc - 10 * u, north = model.heading === null ? null : this.turn - model.heading;
    const at = (a, inward = 0) => [c + (r - inward) * Math.cos(rad(a)), c + (r - inward) * Math.sin(rad(a))];
    g.textAlign = "center";
    g.textBaseline = "middle";
    for (let a = 0; a < 360; a += 30) {
      if (north !== null && apart(a, north) < 3 + (1200 * u) / r) continue;
      g.font = `${a % 90 === 0 ? "600 " : ""}${10 * u}px ${FACE}`;
      this.label(`${a}°`, ...at(a, 8 * u * Math.abs(Math.cos(rad(a)))), a % 90 === 0 ? this.colour.text : this.colour.muted);
    }
    if (north === null) return;
    g.beginPath();
    g.arc(...at(north), 9 * u, 0, TAU);
    g.fillStyle = this.colour.accent;
    g.fill();
    g.font = `700 ${11 * u}px ${FACE}`;
    g.fillStyle = this.colour.ground;
    g.fillText("N", ...at(north));
  }

  // slice: a result of map_slice, or null; track: places [north, east].
  map(slice, track, fresh) {
    const g = this.begin(), side = this.side, u = this.unit;
    g.fillStyle = this.colour.disc;
    g.fillRect(0, 0, side, side);
    g.globalAlpha = 0.35;
    g.fillStyle = this.hatch;
    g.fillRect(0, 0, side, side);
    g.globalAlpha = 1;
    if (!slice || !fresh) return;
    const n = slice.rows.length, cell = side / n, size = n * slice.step_m;
    const x = (east) => ((east - slice.east_m) / slice.step_m + 0.5) * cell, y = (north) => ((slice.north_m - north) / slice.step_m + 0.5) * cell;
    this.frame = { x: x(0), y: y(0), scale: cell / slice.step_m, turn: 0 };
    slice.rows.forEach((row, i) => {
      for (let k = 0; k < row.length; k++) {
        if (row[k] === " ") continue;
        g.fillStyle = this.colour.disc;
        g.fillRect(k * cell, i * cell, cell + 0.5, cell + 0.5);
        g.globalAlpha = row[k] === "#" ? 1 : 0.3;
        g.fillStyle = row[k] === "#" ? this.colour.blocked : this.colour.clear;
        g.fillRect(k * cell, i * cell, cell + 0.5, cell + 0.5);
        g.globalAlpha = 1;
      }
    });
    g.strokeStyle = this.colour.text;
    g.lineWidth = 1.5 * u;
    g.beginPath();
    track.forEach(([north, east], i) => (i ? g.lineTo(x(east), y(north)) : g.moveTo(x(east), y(north))));
    g.stroke();
    if (slice.vehicle_m) this.boat(x(slice.vehicle_m[1]), y(slice.vehicle_m[0]), slice.heading_deg || 0, u);
    const step = [0.5, 1, 2, 5, 10, 20, 50].find((s) => size / s <= 6) || 100, length = (step / size) * side;
    g.font = `600 ${12 * u}px ${FACE}`;
    g.textAlign = "left";
    g.textBaseline = "bottom";
    this.label(metres(step), 12 * u, side - 16 * u, this.colour.text);
    g.strokeStyle = this.colour.text;
    g.lineWidth = 3 * u;
    g.beginPath();
    g.moveTo(12 * u, side - 12 * u);
    g.lineTo(12 * u + length, side - 12 * u);
    g.stroke();
    g.textAlign = "center";
    g.textBaseline = "top";
    this.label("N ↑", side / 2, 8 * u, this.colour.text);
  }
}
