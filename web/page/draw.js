// SPDX-License-Identifier: MIT
// The pictures: the sonar's image with the ring around it, and the slice of the map. Colours come from the style sheet.
import { metres } from "./words.js";

const TAU = 2 * Math.PI;
const rad = (deg) => ((deg - 90) * Math.PI) / 180; // azimuth, clockwise from up, to the canvas's angle
const SLOTS = 720; // directions of the image, half a degree each
const PALETTES = {
  dark: [[7, 12, 16], [23, 69, 107], [95, 128, 135], [201, 182, 96], [255, 243, 176]],
  light: [[255, 255, 255], [201, 220, 234], [123, 166, 198], [42, 95, 142], [4, 32, 63]],
};

function palette(theme) {
  const stops = PALETTES[theme], table = new Uint8Array(256 * 3);
  for (let i = 0; i < 256; i++) {
    const at = Math.pow(i / 255, 0.7) * (stops.length - 1), k = Math.min(stops.length - 2, Math.floor(at));
    for (let c = 0; c < 3; c++) table[3 * i + c] = stops[k][c] + (at - k) * (stops[k + 1][c] - stops[k][c]);
  }
  return table;
}

// The rows of a sonar painted into a square of pixels, each with the newest row that covers it.
export class Image {
  constructor(size) {
    this.size = size;
    this.canvas = document.createElement("canvas");
    this.canvas.width = this.canvas.height = size;
    this.context = this.canvas.getContext("2d");
    this.pixels = this.context.createImageData(size, size);
    this.rho = new Float32Array(size * size);
    const slot = new Int16Array(size * size).fill(-1), count = new Int32Array(SLOTS + 1);
    for (let y = 0; y < size; y++)
      for (let x = 0; x < size; x++) {
        const dx = (x + 0.5) / size - 0.5, dy = (y + 0.5) / size - 0.5, r = 2 * Math.hypot(dx, dy), i = y * size + x;
        if (r > 1) continue;
        this.rho[i] = r;
        slot[i] = Math.floor((((Math.atan2(dx, -dy) / TAU) * SLOTS + SLOTS) % SLOTS));
        count[slot[i] + 1]++;
      }
    for (let k = 0; k < SLOTS; k++) count[k + 1] += count[k];
    this.first = count.slice(); // of the pixels of a slot in this.at
    this.at = new Int32Array(count[SLOTS]);
    const fill = count.slice();
    for (let i = 0; i < slot.length; i++) if (slot[i] >= 0) this.at[fill[slot[i]]++] = i;
    this.clear();
  }

  clear() {
    this.cover = new Array(SLOTS).fill(null);
    this.pixels.data.fill(0);
  }

  // A row that came: the slots that it now covers.
  take(row) {
    const from = Math.floor(((row.azimuth - row.width / 2) / 360) * SLOTS), n = Math.max(1, Math.ceil((row.width / 360) * SLOTS));
    const changed = [];
    for (let k = 0; k < n; k++) {
      const slot = (((from + k) % SLOTS) + SLOTS) % SLOTS;
      if (this.cover[slot] && this.cover[slot].t > row.t) continue;
      this.cover[slot] = row;
      changed.push(slot);
    }
    return changed;
  }

  paint(slots, range, fade, table) {
    const data = this.pixels.data;
    for (const slot of slots) {
      const row = this.cover[slot];
      if (!row) continue;
      const scale = range / ((row.r1 - row.r0) || 1), start = row.r0 / ((row.r1 - row.r0) || 1), alpha = 255 * fade(row);
      for (let k = this.first[slot]; k < this.first[slot + 1]; k++) {
        const i = this.at[k], bin = Math.floor((this.rho[i] * scale - start) * row.bins.length);
        const inside = bin >= 0 && bin < row.bins.length, v = inside ? row.bins[bin] * 3 : 0;
        data[4 * i] = table[v];
        data[4 * i + 1] = table[v + 1];
        data[4 * i + 2] = table[v + 2];
        data[4 * i + 3] = inside ? alpha : 0;
      }
    }
    this.context.putImageData(this.pixels, 0, 0);
  }
}

export class Painter {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.image = new Image(560);
    this.restyle();
  }

  restyle() {
    const style = getComputedStyle(document.documentElement);
    this.colour = {};
    for (const name of ["ground", "panel", "line", "text", "muted", "accent", "blocked", "clear", "unknown", "disc", "echo", "echo-edge"])
      this.colour[name] = style.getPropertyValue("--" + name).trim();
    this.table = palette(document.documentElement.dataset.theme === "light" ? "light" : "dark");
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

  sector(from, to, r0, r1) {
    const g = this.context, c = this.side / 2;
    g.beginPath();
    g.arc(c, c, r1, rad(from), rad(to));
    g.arc(c, c, Math.max(0, r0), rad(to), rad(from), true);
    g.closePath();
  }

  // model: what is known now (app.js); everything is unknown when model.fresh is false.
  sonar(model) {
    const g = this.begin(), { u, c, outer, inner, disc } = this.geometry(), px = disc / model.range;
    const colour = this.colour;
    g.fillStyle = colour.disc;
    g.beginPath();
    g.arc(c, c, disc, 0, TAU);
    g.fill();
    if (model.fresh) {
      g.save();
      g.beginPath();
      g.arc(c, c, disc, 0, TAU);
      g.clip();
      g.imageSmoothingQuality = "high";
      g.drawImage(this.image.canvas, c - disc, c - disc, 2 * disc, 2 * disc);
      this.freeWater(model, px, disc);
      g.restore();
    }
    this.scale(model, px, disc);
    if (model.fresh) {
      this.echoes(model, px, disc);
      this.obstacles(model, px, disc);
      this.sweep(model, disc);
    }
    this.ring(model, inner, outer);
    this.selection(model, disc, outer);
    this.boat(c, c, 0, u);
    this.bearings(outer, u);
    if (model.heading !== null) this.north(-model.heading, outer, u);
  }

  // Where north is in the picture, which has the bow at the top.
  north(azimuth, outer, u) {
    const g = this.context, c = this.side / 2, r = outer + 12 * u, x = c + r * Math.cos(rad(azimuth)), y = c + r * Math.sin(rad(azimuth));
    g.beginPath();
    g.arc(x, y, 10 * u, 0, TAU);
    g.fillStyle = this.colour.accent;
    g.fill();
    g.font = `700 ${12 * u}px system-ui, sans-serif`;
    g.textAlign = "center";
    g.textBaseline = "middle";
    g.fillStyle = this.colour.ground;
    g.fillText("N", x, y);
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
      g.arc(this.side / 2, this.side / 2, r1, rad(s.azimuth_deg - s.width_deg / 2), rad(s.azimuth_deg + s.width_deg / 2));
      if (s.free_to_m * px < disc) g.stroke();
    }
    g.globalAlpha = 1;
  }

  scale(model, px, disc) {
    const g = this.context, c = this.side / 2, u = this.unit;
    const step = [0.25, 0.5, 1, 2, 5, 10, 20, 50].find((s) => model.range / s <= 5) || 100;
    g.font = `${11 * u}px system-ui, sans-serif`;
    g.textAlign = "left";
    g.textBaseline = "middle";
    for (let r = step; r < model.range * 0.999; r += step) {
      g.lineWidth = u;
      g.strokeStyle = this.colour.muted;
      g.globalAlpha = 0.35;
      g.beginPath();
      g.arc(c, c, r * px, 0, TAU);
      g.stroke();
      g.globalAlpha = 1;
      this.label(`${+r.toFixed(2)} m`, c + 3 * u, c - r * px, this.colour.muted);
    }
    if (model.near > 0) {
      g.lineWidth = u;
      g.setLineDash([3 * u, 3 * u]);
      g.strokeStyle = this.colour.muted;
      g.beginPath();
      g.arc(c, c, Math.min(model.near * px, disc), 0, TAU);
      g.stroke();
      g.setLineDash([]);
    }
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
        const a = rad(row.azimuth), x = c + r * Math.cos(a), y = c + r * Math.sin(a);
        g.globalAlpha = Math.max(0.15, model.fade(row));
        g.beginPath();
        g.arc(x, y, ((echo.marks ? 1.6 : 1.2) + 1.4 * echo.sure) * u, 0, TAU);
        if (echo.marks) {
          g.lineWidth = 1.3 * u;
          g.strokeStyle = this.colour.echo;
          g.stroke();
        } else {
          g.fillStyle = this.colour.echo;
          g.fill();
          g.lineWidth = 0.8 * u;
          g.strokeStyle = this.colour["echo-edge"];
          g.stroke();
        }
      }
    g.globalAlpha = 1;
  }

  obstacles(model, px, disc) {
    const g = this.context, c = this.side / 2, u = this.unit;
    for (const s of model.sectors) {
      if (!s.obstacle || s.range_m * px > disc) continue;
      const from = rad(s.azimuth_deg - s.width_deg / 2), to = rad(s.azimuth_deg + s.width_deg / 2);
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
    const g = this.context, c = this.side / 2, a = rad(model.newest.azimuth);
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
      g.fillStyle = s.state === "blocked" ? this.colour.blocked : s.state === "clear" ? this.colour.clear : this.hatch;
      g.fill();
      if (s.state === "unknown") {
        g.lineWidth = 0.7 * u;
        g.strokeStyle = this.colour.unknown;
        g.stroke();
      }
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

  bearings(outer, u) {
    const g = this.context, c = this.side / 2;
    g.textAlign = "center";
    g.textBaseline = "middle";
    for (let a = 0; a < 360; a += 30) {
      const main = a % 90 === 0, r = outer + 12 * u;
      g.font = `${main ? "600 " : ""}${11 * u}px system-ui, sans-serif`;
      g.fillStyle = main ? this.colour.text : this.colour.muted;
      g.fillText(String(a), c + r * Math.cos(rad(a)), c + r * Math.sin(rad(a)));
    }
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
    g.font = `600 ${12 * u}px system-ui, sans-serif`;
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
