// Light on a height field: where a parallel lamp shines, and how much of an even sky each sample sees.
//
// Both follow `visual.fast`: the heights are those of its triangles, the shadows those of its sweep. Arrays are flat,
// row by row; row 0 lies at +y, column 0 at -x. `repeats` is [y, x]: whether the field goes on as itself there.
"use strict";

const PlateLight = (() => {
  const OUTSIDE = -1e9;
  const AZIMUTHS = 16;
  /** Periods of a tile from which shadows come in, at most. */
  const MOST_PERIODS = 3;

  /** Where rows and columns of samples begin, with one more on each side: the outermost, or the neighbours'. */
  function ring(rows, cols, [wrapsY, wrapsX]) {
    const within = (k, n, wraps) => (wraps ? (k + n) % n : Math.min(n - 1, Math.max(0, k)));
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
    const before = wraps ? Math.min(MOST_PERIODS * period, Math.ceil(rise / Math.max(drop, 1e-9)) + 1) : 0;
    const columns = before + along, ends = [-slope * before, -slope * (columns - 1)];
    const first = Math.floor(Math.min(...ends)) - 1, last = Math.ceil(across - 1 + Math.max(...ends)) + 1;
    const start = (k) => {
      const place = right < 0 ? k - before : columns - 1 - k;
      return (k < before ? ((place % period) + period) % period : place) * (turned ? cols : 1);
    };
    return {
      across, slope, step, drop, before, columns, first, start,
      lines: last - first + 2, stride: turned ? 1 : cols, wrapsAcross: repeats[turned ? 1 : 0],
    };
  }

  /** Heights at which the lines of a sweep cross column k; OUTSIDE beyond the field. */
  function crossed(values, { across, slope, first, start, lines, stride, wrapsAcross }, k, into) {
    const shift = Math.floor(slope * k), part = slope * k - shift, origin = start(k), period = across - 1;
    for (let line = 0; line < lines; line += 1) {
      let row = line + first + shift;
      if (wrapsAcross) row = ((row % period) + period) % period;
      const inside = row >= 0 && (row < period || (row === period && part === 0));
      if (!inside) { into[line] = OUTSIDE; continue; }
      const at = origin + row * stride;
      into[line] = part === 0 ? values[at] : values[at] + part * (values[at + stride] - values[at]);
    }
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
    const highest = new Float64Array(lines).fill(OUTSIDE), line = new Float64Array(lines);
    for (let k = 0; k < columns; k += 1) {
      const back = Math.floor(-slope * k), part = -slope * k - back, lowered = k * drop;
      if (k >= before) {
        const origin = start(k);
        for (let i = 0, l = back - first; i < across; i += 1, l += 1) {
          const at = origin + i * stride;
          into[at] = Math.min(9, fine[at] + lowered - highest[l] - part * (highest[l + 1] - highest[l]));
        }
      }
      crossed(fine, sweep, k, line);
      for (let l = 0; l < lines; l += 1) if (line[l] + lowered > highest[l]) highest[l] = line[l] + lowered;
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

  /** Irradiance, over that of a level face, from one azimuth above elevation h of a face with normal (a, up). */
  function fromAzimuth(a, up, tangent) {
    const h = Math.atan(tangent), cosine = Math.cos(h), sine = Math.sin(h);
    return a * (Math.PI / 2 - h - sine * cosine) + up * cosine * cosine;
  }

  /** Share (rows, cols) of the light of an even sky, less what is below a face's own plane, that reaches each sample. */
  function skyVisibility(heights, rows, cols, pitch, repeats) {
    const count = rows * cols, seen = new Float32Array(count), whole = new Float32Array(count);
    // One more row and column, those of the neighbours, so that a period is one less than the size.
    const [down, right] = [rows + (repeats[0] ? 1 : 0), cols + (repeats[1] ? 1 : 0)];
    const field = new Float64Array(down * right);
    for (let i = 0; i < down; i += 1)
      for (let j = 0; j < right; j += 1) field[i * right + j] = heights[(i % rows) * cols + (j % cols)];
    const slopes = centralSlopes(heights, rows, cols, pitch, repeats);
    let [low, high] = [Infinity, -Infinity];
    for (const z of heights) { low = Math.min(low, z); high = Math.max(high, z); }
    for (let n = 0; n < AZIMUTHS; n += 1) {
      const azimuth = (2 * Math.PI * (n + 0.5)) / AZIMUTHS, [x, y] = [Math.cos(azimuth), Math.sin(azimuth)];
      // A halo of a rise at 6 degrees: what stands lower takes a hundredth of the sky at most.
      const sweep = course(down, right, pitch, [x, y, 0.1], repeats, high - low);
      const { across, slope, step, before, columns, first, start, lines, stride } = sweep;
      const hulls = new Hulls(lines, columns), line = new Float64Array(lines);
      for (let k = 0; k < columns; k += 1) {
        const back = Math.floor(-slope * k), part = -slope * k - back;
        for (let i = 0, l = back - first; k >= before && i < across; i += 1, l += 1) {
          const at = start(k) + i * stride, row = (at / right) | 0, col = at - row * right;
          if (row >= rows || col >= cols) continue;
          const own = row * cols + col, z = field[at];
          const rise = (1 - part) * hulls.rise(l, k, z) + part * hulls.rise(l + 1, k, z);
          const [a, up] = [-x * slopes[2 * own] - y * slopes[2 * own + 1], 1];
          const plane = Math.max(0, -a);
          seen[own] += fromAzimuth(a, up, Math.max(plane, rise / step));
          whole[own] += fromAzimuth(a, up, plane);
        }
        crossed(field, sweep, k, line);
        for (let l = 0; l < lines; l += 1) hulls.add(l, k, line[l]);
      }
    }
    return seen.map((value, k) => value / whole[k]);
  }

  /** Slopes dz/dx and dz/dy at each sample, one after the other. */
  function centralSlopes(heights, rows, cols, pitch, repeats) {
    const result = new Float32Array(2 * rows * cols), { down, right } = ring(rows, cols, repeats);
    for (let i = 0, k = 0; i < rows; i += 1) {
      for (let j = 0; j < cols; j += 1) {
        result[k++] = (heights[down[i + 1] + right[j + 2]] - heights[down[i + 1] + right[j]]) / (2 * pitch);
        result[k++] = (heights[down[i] + right[j + 1]] - heights[down[i + 2] + right[j + 1]]) / (2 * pitch);
      }
    }
    return result;
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
      this.sky = quarterSky(this.faces, skyVisibility(heights, rows, cols, pitch, repeats), rows, cols);
      this.radiance = new Float32Array(4 * rows * cols);
    }

    /**
     * Radiance (2 rows, 2 cols) of a white matte surface, on quarters of samples: the mean of two triangles.
     *
     * toward: unit vector toward the lamp; strength: radiance that faces the lamp; ambient: of the even sky.
     */
    lit(toward, strength, ambient) {
      const { rows, cols, fine, clear, faces, facing, sky, radiance } = this, wide = 2 * cols + 1;
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
          radiance[k] = light;
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
    const result = new Float32Array(4 * rows * cols);
    for (let i = 0, k = 0; i < 2 * rows; i += 1) {
      for (let j = 0; j < 2 * cols; j += 1, k += 1) {
        const cell = 2 * (((i + 1) >> 1) * (cols + 1) + ((j + 1) >> 1));
        const upper = (i | j) & 1 ? cell : cell + 1, lower = i & j & 1 ? cell : cell + 1;
        result[k] = visible[(i >> 1) * cols + (j >> 1)] * (0.5 + 0.25 * (faces[3 * upper + 2] + faces[3 * lower + 2]));
      }
    }
    return result;
  }

  return { Field };
})();
