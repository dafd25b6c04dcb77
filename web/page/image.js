// SPDX-License-Identifier: MIT
// The sonar's image as a square of pixels: echo strengths by direction and range.

const TAU = 2 * Math.PI;
const SLOTS = 720; // directions of the image, half a degree each
// From quiet to loud, by theme; grey and amber are light on dark ground and dark on light ground.
const PALETTES = {
  dark: { page: [[7, 12, 16], [23, 69, 107], [95, 128, 135], [201, 182, 96], [255, 243, 176]], grey: [[10, 10, 10], [255, 255, 255]], amber: [[12, 6, 2], [96, 44, 8], [190, 104, 20], [244, 180, 70], [255, 244, 206]] },
  night: { page: [[6, 0, 0], [56, 8, 4], [112, 20, 10], [190, 48, 24], [255, 110, 70]] },
  light: { page: [[255, 255, 255], [201, 220, 234], [123, 166, 198], [42, 95, 142], [4, 32, 63]], grey: [[255, 255, 255], [0, 0, 0]], amber: [[255, 253, 246], [250, 210, 140], [206, 122, 30], [110, 52, 8], [30, 12, 0]] },
};
const PIVOT = 0.3; // what keeps its colour whatever the contrast is

// The night palette stays red, whatever is chosen: eyes are used to the dark.
const stopsOf = (theme, chosen) => PALETTES[theme][chosen] || PALETTES[theme].page;

// A share of full scale to a place between the first colour and the last; contrast: each step doubles the difference.
function shadeOf(share, contrast) {
  return Math.min(1, Math.max(0, PIVOT + (Math.pow(share, 0.7) - PIVOT) * Math.pow(2, contrast)));
}

// For the style sheet, as the picture has it. look: {palette, contrast}.
export function gradient(theme, look) {
  const table = palette(theme, look);
  return `linear-gradient(90deg, ${Array.from({ length: 9 }, (_, k) => `rgb(${table.slice(3 * Math.round(k * 31.875), 3 * Math.round(k * 31.875) + 3).join()})`).join(", ")})`;
}

export function palette(theme, look) {
  const stops = stopsOf(theme, look.palette), table = new Uint8Array(256 * 3);
  for (let i = 0; i < 256; i++) {
    const at = shadeOf(i / 255, look.contrast) * (stops.length - 1), k = Math.min(stops.length - 2, Math.floor(at));
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
