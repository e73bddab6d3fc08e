// Light on a height field: where a parallel lamp shines, and how much of an even sky each sample sees.
//
// Both follow `visual.fast`: the heights are those of its triangles, the shadows those of its sweep. Arrays are flat,
// row by row; row 0 lies at +y, column 0 at -x. `repeats` is [y, x]: whether the field goes on as itself there.
"use strict";

const PlateLight = (() => {
  const OUTSIDE = -1e9;
  /** Directions in which horizons are looked for. */
  const AZIMUTHS = 8;
  // What of a tile's neighbours counts, as in `visual.geometry.halo`, so that sweeps begin where those of the fast look do:
  // factor of the rise, least samples, and tangent of the lowest horizon for light from the sky.
  const MARGIN = 1.25, FEWEST = 2, LEAST_TANGENT = 0.5;

  const modulo = (k, n) => ((k % n) + n) % n;

  /** Where rows and columns of samples begin, with one more on each side: the outermost, or the neighbours'. */
  function ring(rows, cols, [wrapsY, wrapsX]) {
    const within = (k, n, wraps) => (wraps ? modulo(k, n) : Math.min(n - 1, Math.max(0, k)));
    return {
      down: Int32Array.from({ length: rows + 2 }, (_, i) => cols * within(i - 1, rows, wrapsY)),
      right: Int32Array.from({ length: cols + 2 }, (_, j) => within(j - 1, cols, wrapsX)),
    };
  }

  /** Heights (2 rows + 1, 2 cols + 1) at the corners of quarters of samples; sample (i, j) is at (2i + 1, 2j + 1). */
  function refined(heights, rows, cols, repeats) {
    const { down, right } = ring(rows, cols, repeats);
    const wide = 2 * cols + 1, fine = new Float32Array((2 * rows + 1) * wide);
    for (let i = 0; i <= 2 * rows; i += 1) {
      const upper = down[(i + 1) >> 1], lower = down[(i + 2) >> 1];
      for (let j = 0; j <= 2 * cols; j += 1) {
        // Even and even: the middle of a cell, on the diagonal from the upper right to the lower left.
        const left = right[(j + 1) >> 1], other = right[(j + 2) >> 1];
        fine[i * wide + j] = 0.5 * (heights[upper + other] + heights[lower + left]);
      }
    }
    return fine;
  }

  /** How a sweep away from a lamp crosses a grid: columns along the sweep, and lines that run beside each other. */
  function course(rows, cols, spacing, toward, repeats, rise) {
    let [right, down] = [toward[0], -toward[1]];
    const turned = Math.abs(right) < Math.abs(down);
    const [along, across] = turned ? [rows, cols] : [cols, rows];
    if (turned) [right, down] = [down, right];
    const slope = -down / Math.abs(right), step = Math.hypot(1, slope) * spacing;
    const drop = (toward[2] / Math.hypot(toward[0], toward[1])) * step;
    const period = along - 1, wraps = repeats[turned ? 0 : 1];
    const before = wraps ? Math.min(period, 2 * Math.max(FEWEST, Math.ceil((MARGIN * rise) / Math.max(2 * drop, 1e-9)) + 1)) : 0;
    const columns = before + along, ends = [-slope * before, -slope * (columns - 1)];
    // Lines a period apart cross the same heights, so that of those one is enough.
    const wrapsAcross = repeats[turned ? 1 : 0], first = wrapsAcross ? 0 : Math.floor(Math.min(...ends)) - 1;
    const lines = wrapsAcross ? across - 1 : Math.ceil(across - 1 + Math.max(...ends)) - first + 3;
    const start = (k) => {
      const place = right < 0 ? k - before : columns - 1 - k;
      return (k < before ? modulo(place, period) : place) * (turned ? cols : 1);
    };
    return {
      across, slope, step, drop, before, columns, first, start,
      lines, stride: turned ? 1 : cols, wrapsAcross,
    };
  }

  /** Heights at which the lines of a sweep cross column k; OUTSIDE beyond the field. */
  function crossed(values, { across, slope, first, start, lines, stride, wrapsAcross }, k, into) {
    const shift = Math.floor(slope * k), part = slope * k - shift, period = across - 1;
    const between = (at) => values[at] + part * (values[at + stride] - values[at]);
    if (wrapsAcross) {
      const origin = start(k), end = origin + period * stride;
      for (let line = 0, at = origin + modulo(shift, period) * stride; line < lines; line += 1) {
        into[line] = between(at);
        at += stride;
        if (at === end) at = origin;
      }
      return;
    }
    into.fill(OUTSIDE);
    const least = Math.max(0, -first - shift), most = Math.min(lines, period - first - shift);
    for (let line = least, at = start(k) + (line + first + shift) * stride; line < most; line += 1, at += stride) into[line] = between(at);
    // The last row has none behind it, and needs none where a line meets it.
    if (part === 0 && most >= 0 && most < lines) into[most] = values[start(k) + period * stride];
  }

  /**
   * Clearance (like `fine`), mm: how far a corner lies above the shadow there; positive in the light.
   *
   *     q(s) = z(s) + s tan e,   clearance(s) = q(s) - largest q(s') nearer to the lamp
   */
  function clearance(fine, rows, cols, spacing, toward, repeats, rise, into) {
    if (toward[2] <= 0) return into.fill(-1);
    if (Math.hypot(toward[0], toward[1]) < 1e-6) return into.fill(1);
    const sweep = course(rows, cols, spacing, toward, repeats, rise);
    const { across, slope, drop, before, columns, first, start, lines, stride } = sweep;
    // One more, the first again, for what lies between the last line and the first of a tile.
    const highest = new Float64Array(lines + 1).fill(OUTSIDE), line = new Float64Array(lines);
    for (let k = 0; k < columns; k += 1) {
      const back = Math.floor(-slope * k), part = -slope * k - back, lowered = k * drop;
      if (k >= before) {
        const origin = start(k);
        for (let i = 0, at = origin, l = modulo(back - first, lines); i < across; i += 1, at += stride) {
          into[at] = fine[at] + lowered - highest[l] - part * (highest[l + 1] - highest[l]);
          l += 1;
          if (l === lines) l = 0;
        }
      }
      crossed(fine, sweep, k, line);
      for (let l = 0; l < lines; l += 1) if (line[l] + lowered > highest[l]) highest[l] = line[l] + lowered;
      highest[lines] = highest[0];
    }
    return into;
  }

  /** Upper hulls of what lies behind on each line of a sweep: the points that a horizon can be. */
  class Hulls {
    constructor(lines, columns) {
      this.columns = columns;
      this.count = new Int32Array(lines);
      this.place = new Int32Array(lines * columns);
      this.height = new Float64Array(lines * columns);
    }

    add(line, place, height) {
      if (height <= OUTSIDE) return;
      const base = line * this.columns, { place: x, height: z } = this;
      let n = this.count[line];
      while (n > 1) {
        const a = base + n - 2, b = base + n - 1;
        if ((z[b] - z[a]) * (place - x[a]) > (height - z[a]) * (x[b] - x[a])) break;
        n -= 1;
      }
      x[base + n] = place;
      z[base + n] = height;
      this.count[line] = n + 1;
    }

    /** The steepest rise from a point beyond all others to one of them, a column; at least 0. */
    rise(line, place, height) {
      const base = line * this.columns;
      let last = -Infinity;
      // Seen from beyond, the rises to the points of an upper hull grow up to one point and fall from there on.
      for (let k = base + this.count[line] - 1; k >= base; k -= 1) {
        const rise = (this.height[k] - height) / (place - this.place[k]);
        if (rise < last) break;
        last = rise;
      }
      return Math.max(0, last);
    }
  }

  /** Irradiance of a face with normal (a, 1) from one azimuth, above a tangent of elevation, up to a factor. */
  function fromAzimuth(a, tangent) {
    const cosineSquared = 1 / (1 + tangent * tangent);
    return a * (Math.PI / 2 - Math.atan(tangent) - tangent * cosineSquared) + cosineSquared;
  }

  /**
   * Share (rows, cols) of an even sky's light, less what is below a face's own plane, that reaches each point of a field.
   *
   * A generator that yields now and then and returns the share, so that a page need not stand still meanwhile.
   */
  function* skyVisibility(field, rows, cols, pitch, repeats, rise) {
    const seen = new Float32Array(rows * cols), whole = new Float32Array(rows * cols);
    const beside = (k, n, wraps) => (wraps ? (k + n - 1) % (n - 1) : Math.min(n - 1, Math.max(0, k)));
    for (let n = 0; n < AZIMUTHS; n += 1) {
      const azimuth = (2 * Math.PI * (n + 0.5)) / AZIMUTHS, [x, y] = [Math.cos(azimuth), Math.sin(azimuth)];
      const sweep = course(rows, cols, pitch, [x, y, LEAST_TANGENT], repeats, rise);
      const { across, slope, step, before, columns, first, start, lines, stride } = sweep;
      const hulls = new Hulls(lines, columns), line = new Float64Array(lines);
      for (let k = 0; k < columns; k += 1) {
        const back = Math.floor(-slope * k), part = -slope * k - back, origin = start(k);
        for (let i = 0, l = modulo(back - first, lines); k >= before && i < across; i += 1, l = (l + 1) % lines) {
          const at = origin + i * stride, z = field[at], row = stride === 1 ? (origin / cols) | 0 : i, col = at - row * cols;
          const dx = field[row * cols + beside(col + 1, cols, repeats[1])] - field[row * cols + beside(col - 1, cols, repeats[1])];
          const dy = field[beside(row - 1, rows, repeats[0]) * cols + col] - field[beside(row + 1, rows, repeats[0]) * cols + col];
          const a = (-x * dx - y * dy) / (2 * pitch), plane = Math.max(0, -a), open = fromAzimuth(a, plane);
          const tangent = ((1 - part) * hulls.rise(l, k, z) + part * hulls.rise((l + 1) % lines, k, z)) / step;
          whole[at] += open;
          seen[at] += tangent > plane ? fromAzimuth(a, tangent) : open;
        }
        crossed(field, sweep, k, line);
        for (let l = 0; l < lines; l += 1) hulls.add(l, k, line[l]);
        if (k % 32 === 0) yield;
      }
    }
    return seen.map((value, k) => value / whole[k]);
  }

  /** A height field with what no lamp changes. */
  class Field {
    /** Heights (rows * cols), mm, on a plate of this width; Error if one of them is not finite. */
    constructor(heights, rows, cols, width, repeats) {
      [this.low, this.high] = [Infinity, -Infinity];
      for (const z of heights) { this.low = Math.min(this.low, z); this.high = Math.max(this.high, z); }
      if (!heights.every(Number.isFinite)) throw new Error("heights: not every value is finite");
      const pitch = width / cols;
      Object.assign(this, { rows, cols, repeats, spacing: 0.5 * pitch });
      this.fine = refined(heights, rows, cols, repeats);
      this.clear = new Float32Array(this.fine.length);
      this.faces = faceNormals(heights, rows, cols, pitch, repeats);
      this.facing = new Float32Array(this.faces.length / 3);
      this.see(new Float32Array(this.fine.length).fill(1));
      this.quarters = new Float32Array(4 * rows * cols);
      this.radiance = new Float32Array(this.fine.length);
    }

    /** Finds what the relief hides of the sky, in steps: a generator, at whose end the light takes it into account. */
    *hideSky() {
      const { fine, rows, cols, spacing, repeats } = this;
      this.see(yield* skyVisibility(fine, 2 * rows + 1, 2 * cols + 1, spacing, repeats, this.high - this.low));
    }

    /** Takes the share of the sky that is seen from each corner, such as that of heights which differ little. */
    see(visible) {
      this.visible = visible;
      this.sky = quarterSky(this.faces, visible, this.rows, this.cols);
    }

    /**
     * Radiance (2 rows + 1, 2 cols + 1) of a white matte surface at the corners of quarters of samples, each the mean
     * over the square of a sample's size around it: at samples, the pixels of the fast look.
     *
     * toward: unit vector toward the lamp; strength: radiance that faces the lamp; ambient: of the even sky.
     */
    lit(toward, strength, ambient) {
      const { rows, cols, fine, clear, faces, facing, sky, quarters } = this, wide = 2 * cols + 1;
      clearance(fine, 2 * rows + 1, wide, this.spacing, toward, this.repeats, this.high - this.low, clear);
      for (let k = 0, f = 0; k < facing.length; k += 1, f += 3)
        facing[k] = Math.max(0, 0.5 * strength * (faces[f] * toward[0] + faces[f + 1] * toward[1] + faces[f + 2] * toward[2]));
      for (let i = 0, k = 0; i < 2 * rows; i += 1) {
        for (let j = 0, at = i * wide; j < 2 * cols; j += 1, k += 1, at += 1) {
          // The quarter above and left of a sample lies on one face of its cell, that below and right on the other.
          const cell = 2 * (((i + 1) >> 1) * (cols + 1) + ((j + 1) >> 1));
          const upper = facing[(i | j) & 1 ? cell : cell + 1], lower = facing[i & j & 1 ? cell : cell + 1];
          const a = clear[at], b = clear[at + 1], c = clear[at + wide], d = clear[at + wide + 1];
          let light = ambient * sky[k];
          if (upper > 0) light += upper * litShare(a, b, c);
          if (lower > 0) light += lower * litShare(d, b, c);
          quarters[k] = light;
        }
      }
      return this.blurred();
    }

    /** Means of the four quarters around each corner; beyond a side that ends, of those within. */
    blurred() {
      const { quarters, radiance, rows, cols, repeats } = this, [tall, wide] = [2 * rows, 2 * cols];
      const beyond = (k, n, wraps) => (wraps ? (k + n) % n : Math.min(n - 1, Math.max(0, k)));
      for (let i = 0, k = 0; i <= tall; i += 1) {
        const [above, below] = [wide * beyond(i - 1, tall, repeats[0]), wide * beyond(i, tall, repeats[0])];
        for (let j = 0; j <= wide; j += 1, k += 1) {
          const left = j ? j - 1 : beyond(-1, wide, repeats[1]), right = j < wide ? j : beyond(wide, wide, repeats[1]);
          radiance[k] = 0.25 * (quarters[above + left] + quarters[above + right] + quarters[below + left] + quarters[below + right]);
        }
      }
      return radiance;
    }
  }

  /** The share of a triangle on which a linear function with these values at its corners is positive. */
  function litShare(a, b, c) {
    if (a > 0 && b > 0 && c > 0) return 1;
    if (a <= 0 && b <= 0 && c <= 0) return 0;
    const high = Math.max(a, b, c), low = Math.min(a, b, c), middle = Math.max(Math.min(a, b), Math.min(Math.max(a, b), c));
    return middle > 0 ? 1 - (low * low) / ((middle - low) * (high - low)) : (high * high) / ((high - middle) * (high - low));
  }

  /** Unit normals of the faces of all cells (rows + 1, cols + 1): of each the upper left one, then the lower right one. */
  function faceNormals(heights, rows, cols, pitch, repeats) {
    const normals = new Float32Array(6 * (rows + 1) * (cols + 1)), { down, right } = ring(rows, cols, repeats);
    let at = 0;
    const put = (dx, dy) => {
      const length = Math.hypot(dx, dy, pitch);
      normals[at++] = -dx / length;
      normals[at++] = -dy / length;
      normals[at++] = pitch / length;
    };
    for (let i = 0; i <= rows; i += 1) {
      for (let j = 0; j <= cols; j += 1) {
        const a = heights[down[i] + right[j]], b = heights[down[i] + right[j + 1]];
        const c = heights[down[i + 1] + right[j]], d = heights[down[i + 1] + right[j + 1]];
        put(b - a, a - c);
        put(d - c, b - d);
      }
    }
    return normals;
  }

  /** Light (2 rows, 2 cols) of an even sky on quarters of samples, over that of a level plate that sees all of it. */
  function quarterSky(faces, visible, rows, cols) {
    const result = new Float32Array(4 * rows * cols), wide = 2 * cols + 1;
    for (let i = 0, k = 0; i < 2 * rows; i += 1) {
      for (let j = 0; j < 2 * cols; j += 1, k += 1) {
        const at = i * wide + j, mean = 0.25 * (visible[at] + visible[at + 1] + visible[at + wide] + visible[at + wide + 1]);
        const cell = 2 * (((i + 1) >> 1) * (cols + 1) + ((j + 1) >> 1));
        const upper = (i | j) & 1 ? cell : cell + 1, lower = i & j & 1 ? cell : cell + 1;
        result[k] = mean * (0.5 + 0.25 * (faces[3 * upper + 2] + faces[3 * lower + 2]));
      }
    }
    return result;
  }

  return { Field };
})();
