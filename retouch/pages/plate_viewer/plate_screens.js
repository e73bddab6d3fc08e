// Where plates are drawn: by WebGL 2 from any side, or by a 2-D canvas from straight above.
//
// `PlateScreens.open(lost)` gives the better one of those that there are, and calls `lost` if the graphics card drops its
// picture; `PlateScreens.plain()` gives a 2-D canvas. What `PlateView` uses of both:
//     canvas               the element
//     tilts                whether plates are shown aslant
//     densest              most pixels of the picture to a pixel of the page
//     lost                 whether nothing is drawn any more
//     take(plate), drop(plate)   a plate, whose heights and radiance are those of `plate.field`, comes and goes
//     relit(plate)         the radiance of a plate is another one
//     show(parts, frame)   draws each { plate, from, to } in its columns of pixels
//     pixels()             as those of `PlateView`, right after `show`
//     release()            gives back what is held
// A frame holds width and height, pixels; turn, rows of the rotation from the plate to the viewer; tilted, whether it turns
// anything; hasty, whether another frame may follow at once; scale, pixels a mm, and middle, mm, of what is seen; size, x and
// y, base and pivot of the plate, mm; toward, to the lamp; albedo, strength, ambient and exposure.
"use strict";

const PlateScreens = (() => {
  /** Cells of the tilted plate along its longer side, and of one that moves: they take the time where the processor draws. */
  const CELLS = 160, HASTY_CELLS = 96;
  /** Steps of radiance for which a 2-D canvas knows colours: near black, one is a tenth of a step of the colour. */
  const SHADES = 1 << 15;

  const HEAD = "#version 300 es\nprecision highp float; precision highp int; precision highp sampler2D;\n";
  /** The plate as a grid whose outermost vertices lie at its foot, so that it has walls. */
  const PLATE = `${HEAD}
    uniform sampler2D fine;
    uniform mat3 turn;
    uniform ivec2 cells;
    uniform vec2 size, fit, middle;
    uniform float base, pivot;
    out vec2 place;
    out vec3 solid;
    out float foot;
    void main() {
      ivec2 own = ivec2(gl_VertexID % (cells.x + 3), gl_VertexID / (cells.x + 3)) - 1;
      ivec2 inside = clamp(own, ivec2(0), cells);
      foot = own == inside ? 0.0 : 1.0;
      place = vec2(inside) / vec2(cells);
      vec2 texel = place * vec2(textureSize(fine, 0) - 1);
      ivec2 first = min(ivec2(texel), textureSize(fine, 0) - 2);
      vec2 part = texel - vec2(first);
      float z = mix(mix(texelFetch(fine, first, 0).r, texelFetch(fine, first + ivec2(1, 0), 0).r, part.x),
                    mix(texelFetch(fine, first + ivec2(0, 1), 0).r, texelFetch(fine, first + 1, 0).r, part.x), part.y);
      solid = vec3((place.x - 0.5) * size.x, (0.5 - place.y) * size.y, foot > 0.0 ? base : z);
      vec3 seen = turn * (solid - vec3(0.0, 0.0, pivot));
      gl_Position = vec4((seen.xy - middle) * fit, -seen.z * 0.5 / (size.x + size.y), 1.0);
    }`;
  const SHOWN = `${HEAD}
    uniform sampler2D lit;
    uniform vec3 toward, albedo;
    uniform float strength, ambient, exposure;
    in vec2 place;
    in vec3 solid;
    in float foot;
    out vec4 colour;
    vec3 srgb(vec3 v) {
      return mix(12.92 * v, 1.055 * pow(v, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, v));
    }
    void main() {
      vec2 corners = vec2(textureSize(lit, 0));
      float radiance = texture(lit, (place * (corners - 1.0) + 0.5) / corners).r;
      if (foot > 0.0) {
        vec3 normal = normalize(cross(dFdx(solid), dFdy(solid)));
        radiance = strength * max(0.0, dot(normal, toward)) + 0.5 * ambient;
      }
      colour = vec4(srgb(min(albedo * exposure * radiance, 1.0)), 1.0);
    }`;

  /** The graphics card, or the processor in its place. */
  class WebGLScreen {
    constructor(canvas, gl, lost) {
      Object.assign(this, { canvas, gl, tilts: true, densest: 2, held: new Map() });
      canvas.addEventListener("webglcontextlost", lost);
      this.shown = program(gl, PLATE, SHOWN);
      this.flat = grid(gl, 1, 1);
      this.grids = new Map();
    }

    get lost() {
      return this.gl.isContextLost();
    }

    take(plate) {
      const { gl } = this, { rows, cols, fine, radiance } = plate.field, size = [2 * cols + 1, 2 * rows + 1];
      this.held.set(plate, {
        fine: numbers(gl, gl.R32F, size, fine, gl.NEAREST), lit: numbers(gl, gl.R16F, size, radiance, gl.LINEAR), size,
      });
    }

    drop(plate) {
      const { fine, lit } = this.held.get(plate);
      for (const each of [fine, lit]) this.gl.deleteTexture(each);
      this.held.delete(plate);
    }

    relit(plate) {
      const { gl } = this, { lit, size } = this.held.get(plate);
      gl.bindTexture(gl.TEXTURE_2D, lit);
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, ...size, gl.RED, gl.FLOAT, plate.field.radiance);
    }

    show(parts, frame) {
      const { gl } = this, { width, height } = frame;
      gl.bindFramebuffer(gl.FRAMEBUFFER, null);
      gl.viewport(0, 0, width, height);
      gl.disable(gl.SCISSOR_TEST);
      gl.clearColor(0, 0, 0, 0);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      gl.enable(gl.SCISSOR_TEST);
      gl.enable(gl.DEPTH_TEST);
      gl.enable(gl.CULL_FACE);
      for (const { plate, from, to } of parts) {
        gl.scissor(from, 0, to - from, height);
        this.showOne(plate, frame);
      }
    }

    showOne(plate, frame) {
      const { gl, shown } = this, { fine, lit } = this.held.get(plate), { width, height, scale } = frame;
      gl.useProgram(shown.program);
      bind(gl, shown, "fine", fine, 0);
      bind(gl, shown, "lit", lit, 1);
      for (const name of ["toward", "albedo"]) gl.uniform3fv(shown.at(name), frame[name]);
      for (const name of ["size", "middle"]) gl.uniform2fv(shown.at(name), frame[name]);
      for (const name of ["strength", "ambient", "exposure", "base", "pivot"]) gl.uniform1f(shown.at(name), frame[name]);
      gl.uniformMatrix3fv(shown.at("turn"), true, frame.turn.flat());
      gl.uniform2f(shown.at("fit"), (2 * scale) / width, (2 * scale) / height);
      // From straight above, two triangles show the same.
      const { cells, buffer, count } = frame.tilted ? this.gridOf(plate.field, frame.hasty) : this.flat;
      gl.uniform2i(shown.at("cells"), ...cells);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
      gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 0);
    }

    /** The grid for a field of so many samples; of each kind the last one is kept. */
    gridOf({ rows, cols }, hasty) {
      const few = Math.min(1, (hasty ? HASTY_CELLS : CELLS) / Math.max(rows, cols));
      const cells = [cols, rows].map((side) => Math.max(2, Math.round(side * few))), last = this.grids.get(hasty);
      if (last?.cells.join() === cells.join()) return last;
      if (last) this.gl.deleteBuffer(last.buffer);
      this.grids.set(hasty, grid(this.gl, ...cells));
      return this.grids.get(hasty);
    }

    pixels() {
      const { gl, canvas } = this, { width, height } = canvas, data = new Uint8ClampedArray(4 * width * height);
      gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(data.buffer));
      const upright = new Uint8ClampedArray(data.length);
      for (let row = 0; row < height; row += 1)
        upright.set(data.subarray(4 * width * row, 4 * width * (row + 1)), 4 * width * (height - 1 - row));
      return { width, height, data: upright };
    }

    release() {
      this.gl.getExtension("WEBGL_lose_context")?.loseContext();
    }
  }

  /** A 2-D canvas, for browsers without WebGL 2: the same picture from straight above, a pixel at a time. */
  class CanvasScreen {
    constructor() {
      this.canvas = document.createElement("canvas");
      // All of the picture is written by the processor, so that it had better lie in its memory.
      this.context = this.canvas.getContext("2d", { willReadFrequently: true });
      // Each pixel takes time, and between the samples of a plate there is little to see: one for each of the page does.
      Object.assign(this, { tilts: false, densest: 1, lost: false });
    }

    // The radiance is read where it was found.
    take() {}
    drop() {}
    relit() {}

    show(parts, { width, height, scale, size, albedo, exposure }) {
      if (this.image?.width !== width || this.image?.height !== height) this.image = this.context.createImageData(width, height);
      const { data } = this.image, [wide, tall] = size.map((side) => scale * side);
      const [red, green, blue] = albedo.map((each) => each * exposure * (SHADES - 1));
      data.fill(0);
      for (const { plate: { field }, from, to } of parts) {
        const { radiance, rows, cols } = field, row = 2 * cols + 1;
        const across = between(2 * cols, width, wide, from, to), down = between(2 * rows, height, tall, 0, height);
        for (let i = 0; i < down.count; i += 1) {
          const upper = row * down.texel[i], v = down.part[i];
          for (let j = 0, at = 4 * (width * (down.first + i) + across.first); j < across.count; j += 1, at += 4) {
            const k = upper + across.texel[j], u = across.part[j];
            const above = radiance[k] + u * (radiance[k + 1] - radiance[k]);
            const below = radiance[k + row] + u * (radiance[k + row + 1] - radiance[k + row]);
            const light = above + v * (below - above);
            data[at] = shades[Math.min(SHADES - 1, red * light + 0.5) | 0];
            data[at + 1] = shades[Math.min(SHADES - 1, green * light + 0.5) | 0];
            data[at + 2] = shades[Math.min(SHADES - 1, blue * light + 0.5) | 0];
            data[at + 3] = 255;
          }
        }
      }
      this.context.putImageData(this.image, 0, 0);
    }

    pixels() {
      const { width, height } = this.canvas;
      return { width, height, data: this.context.getImageData(0, 0, width, height).data };
    }

    release() {}
  }

  /** The sRGB curve: bytes of so many steps from black to white. */
  const shades = Uint8ClampedArray.from({ length: SHADES }, (_, k) => {
    const v = k / (SHADES - 1);
    return 255 * (v < 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055);
  });

  /**
   * Which of the pixels from `from` to `to` lie on a plate that takes the middle `length` of `side` pixels, and between
   * which of its texels, `last` + 1 from edge to edge, the middles of these pixels are.
   */
  function between(last, side, length, from, to) {
    const start = 0.5 * (side - length), first = Math.max(from, Math.ceil(start - 0.5));
    const count = Math.max(0, Math.min(to, Math.ceil(start + length - 0.5)) - first);
    const places = Float64Array.from({ length: count }, (_, k) => (last * (first + k + 0.5 - start)) / length);
    const texel = Int32Array.from(places, (place) => Math.min(last - 1, Math.max(0, Math.floor(place))));
    return { first, count, texel, part: places.map((place, k) => place - texel[k]) };
  }

  /** Triangles of a grid of cells with one more ring of vertices, those of the foot. */
  function grid(gl, across, down) {
    const wide = across + 3, indices = [], buffer = gl.createBuffer();
    for (let i = 0; i < down + 2; i += 1) {
      for (let j = 0; j < across + 2; j += 1) {
        const k = i * wide + j;
        indices.push(k, k + wide, k + 1, k + 1, k + wide, k + wide + 1);
      }
    }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(indices), gl.STATIC_DRAW);
    return { cells: [across, down], buffer, count: indices.length };
  }

  /** A texture of one number a texel. */
  function numbers(gl, format, [wide, tall], values, filter) {
    const texture = gl.createTexture(), set = (name, value) => gl.texParameteri(gl.TEXTURE_2D, name, value);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage2D(gl.TEXTURE_2D, 0, format, wide, tall, 0, gl.RED, gl.FLOAT, values);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) set(name, filter);
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) set(name, gl.CLAMP_TO_EDGE);
    return texture;
  }

  function bind(gl, { at }, name, texture, unit) {
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.uniform1i(at(name), unit);
  }

  function program(gl, vertex, fragment) {
    const made = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS) && !gl.isContextLost())
      throw new Error(gl.getAttachedShaders(made).map((each) => gl.getShaderInfoLog(each)).join("\n") || gl.getProgramInfoLog(made));
    const places = new Map();
    const at = (name) => {
      if (!places.has(name)) places.set(name, gl.getUniformLocation(made, name));
      return places.get(name);
    };
    return { program: made, at };
  }

  function open(lost) {
    const canvas = document.createElement("canvas"), gl = canvas.getContext("webgl2", { antialias: true, alpha: true });
    return gl && !gl.isContextLost() ? new WebGLScreen(canvas, gl, lost) : plain();
  }

  const plain = () => new CanvasScreen();

  return { open, plain };
})();
