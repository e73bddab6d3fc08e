// A plate, before and after, under one lamp that moves: a component of a page, in plain WebGL 2.
//
//     const view = new PlateView(element, { heights, rows, cols, size_mm, after, ... });
//
// The element becomes the stage: it is to be positioned and to have a size. Throws an Error without WebGL 2.
// Options, the first four needed:
//     heights     Float32Array (rows * cols), mm, row 0 at +y, column 0 at -x
//     rows, cols  samples
//     size_mm     width of the plate; samples are square
//     after       heights of a second plate of the same size, right of an edge; null for one plate alone
//     repeats     [y, x]: whether the plate is a tile, into which shadows come from its neighbours; [false, false]
//     albedo      reflectance of the matte surface, a number or [red, green, blue]; 0.5
//     lamp        { azimuth, elevation, strength }: degrees counter-clockwise from +x, degrees above the plate, and
//                 the radiance of a white matte plate that faces the lamp; 135, 35, 1
//     ambient     radiance of the even sky, in the same unit; 0.25
//     exposure    factor of the radiance before the sRGB curve; 1
//     names       of the plates, for those who do not see them; ["before", "after"]
// Methods; what they set is drawn with the next frame:
//     setHeights(heights, after = null, { rows, cols, size_mm, repeats } = {})
//     setLamp(azimuth, elevation)   degrees; the elevation is kept from 5 to 90
//     setTilt(right, down)          degrees by which the plate is turned from facing the viewer, -60 to 60 each
//     setSwipe(percent)             where the edge stands: 0 shows the second plate alone, 100 the first
//     setMaterial({ albedo, ambient, exposure, strength })   those that are given
//     setMode("lamp" or "tilt")     what dragging moves; with shift the other one
//     reset()                       lamp, tilt and edge as at the start
//     pixels()                      { width, height, data } of the picture now, RGBA bytes, the first row on top
//     destroy()                     gives the graphics card back and empties the element
// Properties: lamp, tilt, swipe, mode; ready, a promise that is kept when the sky over the last heights, whose shade in
// the hollows is found while the page goes on, is known. Events of the element, which bubble, with these as `detail`:
//     plate-lamp { azimuth, elevation }, plate-tilt { right, down }, plate-swipe { percent }, plate-lost {}
// Pointer: a drag moves the lamp, which stands under the pointer: the middle of the stage is straight above, its rim
// the horizon; shift or the right button tilts; the edge is dragged by its grip. Keys of the stage: arrows for the
// lamp, shift and arrows to tilt, B for the other plate, 0 to reset.
"use strict";

const PlateView = (() => {
  const LOWEST = 5, MOST_TILT = 60, STEP = 5;
  /** Cells of the tilted plate along its longer side. */
  const CELLS = 160;
  /** Longest time for which the page stands still while the sky is looked for, ms. */
  const SLICE = 12;
  /** Thickness of the plate below its lowest point, as a part of its width. */
  const BASE = 0.06;

  const radians = (degrees) => (degrees * Math.PI) / 180;
  const clamped = (value, low, high) => Math.min(high, Math.max(low, Number(value) || 0));

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

  class PlateView {
    constructor(element, options) {
      this.element = element;
      this.canvas = document.createElement("canvas");
      const gl = this.canvas.getContext("webgl2", { antialias: true, alpha: true });
      if (!gl) throw new Error("WebGL 2 is missing or switched off");
      this.gl = gl;
      const { lamp = {}, albedo = 0.5, ambient = 0.25, exposure = 1, names = ["before", "after"] } = options;
      const { azimuth = 135, elevation = 35, strength = 1 } = lamp;
      this.start = { azimuth, elevation };
      this.names = names;
      this.mode = "lamp";
      this.shown = program(gl, PLATE, SHOWN);
      this.flat = grid(gl, 1, 1);
      this.listening = new AbortController();
      this.furnish();
      this.setMaterial({ albedo, ambient, exposure, strength });
      this.setHeights(options.heights, options.after ?? null, options);
      this.reset();
      this.obey();
      this.resized = new ResizeObserver(() => this.draw());
      this.resized.observe(element);
    }

    // What is shown

    setHeights(heights, after = null, { rows = this.rows, cols = this.cols, size_mm = this.size_mm, repeats } = {}) {
      if (!(rows > 1 && cols > 1 && size_mm > 0)) throw new Error("rows, cols and size_mm: not the size of a plate");
      for (const each of after ? [heights, after] : [heights])
        if (each?.length !== rows * cols) throw new Error(`heights: ${each?.length} values, not ${rows * cols}`);
      const size = { rows, cols, size_mm, repeats: repeats ?? this.repeats ?? [false, false] };
      const plates = [heights, after].filter(Boolean).map((each, k) => new Plate(this.gl, each, size, this.plates?.[k]));
      this.plates?.forEach((plate) => plate.remove());
      Object.assign(this, size, { plates });
      const [lows, highs] = ["low", "high"].map((end) => plates.map(({ field }) => field[end]));
      [this.low, this.high] = [Math.min(...lows), Math.max(...highs)];
      const few = Math.min(1, CELLS / Math.max(rows, cols)), cells = [cols, rows].map((side) => Math.max(2, Math.round(side * few)));
      if (this.grid?.cells.join() !== cells.join()) {
        if (this.grid) this.gl.deleteBuffer(this.grid.buffer);
        this.grid = grid(this.gl, ...cells);
      }
      this.edge.hidden = this.swiper.hidden = plates.length < 2;
      this.relight();
      this.ready = this.hideSky(plates);
    }

    /** Finds what each relief hides of the sky, in slices between which the page lives. */
    async hideSky(plates) {
      let since = performance.now();
      for (const { field } of plates) {
        for (const _ of field.hideSky()) {
          if (performance.now() - since < SLICE) continue;
          await new Promise((done) => setTimeout(done));
          if (this.gone || this.plates !== plates) return;
          since = performance.now();
        }
      }
      this.relight();
    }

    setMaterial({ albedo = this.albedo, strength = this.strength, ambient = this.ambient, exposure = this.exposure }) {
      this.albedo = Array.isArray(albedo) ? albedo.map(Number) : [1, 1, 1].map(() => Number(albedo));
      [this.strength, this.ambient, this.exposure] = [strength, ambient, exposure].map(Number);
      this.relight();
    }

    setLamp(azimuth, elevation) {
      this.lamp = { azimuth: (((Number(azimuth) || 0) % 360) + 360) % 360, elevation: clamped(elevation, LOWEST, 90) };
      this.relight();
      this.tell("lamp", this.lamp);
    }

    setTilt(right, down) {
      this.tilt = { right: clamped(right, -MOST_TILT, MOST_TILT), down: clamped(down, -MOST_TILT, MOST_TILT) };
      this.relight();
      this.tell("tilt", this.tilt);
    }

    setSwipe(percent) {
      this.swipe = clamped(percent, 0, 100);
      this.swiper.value = this.swipe;
      this.element.style.setProperty("--split", `${this.swipe}%`);
      this.draw();
      this.tell("swipe", { percent: this.swipe });
    }

    setMode(mode) {
      this.mode = mode === "tilt" ? "tilt" : "lamp";
    }

    reset() {
      this.setTilt(0, 0);
      this.setLamp(this.start.azimuth, this.start.elevation);
      this.setSwipe(50);
    }

    pixels() {
      this.paint();
      const { gl, canvas } = this, { width, height } = canvas, data = new Uint8ClampedArray(4 * width * height);
      gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(data.buffer));
      const upright = new Uint8ClampedArray(data.length);
      for (let row = 0; row < height; row += 1)
        upright.set(data.subarray(4 * width * row, 4 * width * (row + 1)), 4 * width * (height - 1 - row));
      return { width, height, data: upright };
    }

    destroy() {
      cancelAnimationFrame(this.frame);
      this.gone = true;
      this.listening.abort();
      this.resized.disconnect();
      this.gl.getExtension("WEBGL_lose_context")?.loseContext();
      this.element.replaceChildren();
    }

    // Drawing

    relight() {
      this.plates?.forEach((plate) => { plate.stale = true; });
      this.draw();
    }

    draw() {
      if (this.frame || this.gone) return;
      this.frame = requestAnimationFrame(() => {
        this.frame = 0;
        this.paint();
      });
    }

    /** Draws now. */
    paint() {
      const { gl, canvas, plates } = this;
      if (this.gone || gl.isContextLost() || !this.lamp || !this.tilt) return;
      const box = this.element.getBoundingClientRect(), dense = Math.min(devicePixelRatio || 1, 2);
      const [width, height] = [box.width, box.height].map((side) => Math.max(1, Math.round(side * dense)));
      if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
      const turn = this.turn(), toward = this.toward(turn), split = Math.round((this.swipe / 100) * width);
      const spans = plates.length < 2 ? [[0, width]] : [[0, split], [split, width]];
      const seen = plates.filter((_, k) => spans[k][1] > spans[k][0]);
      for (const plate of seen) plate.light(toward, this.strength, this.ambient);
      gl.bindFramebuffer(gl.FRAMEBUFFER, null);
      gl.viewport(0, 0, width, height);
      gl.disable(gl.SCISSOR_TEST);
      gl.clearColor(0, 0, 0, 0);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      gl.enable(gl.SCISSOR_TEST);
      gl.enable(gl.DEPTH_TEST);
      gl.enable(gl.CULL_FACE);
      plates.forEach((plate, k) => {
        const [from, to] = spans[k];
        if (to <= from) return;
        gl.scissor(from, 0, to - from, height);
        this.show(plate, turn, toward, [width, height]);
      });
      this.placeLamp(box);
    }

    show(plate, turn, toward, [width, height]) {
      const { gl, shown, size_mm, rows, cols } = this, deep = (size_mm * rows) / cols;
      const { base, pivot } = this.depth(), aslant = Math.hypot(this.tilt.right, this.tilt.down);
      const { scale, middle } = fitted(turn, [size_mm / 2, deep / 2], [base - pivot, this.high - pivot], [width, height]);
      // From straight above the plate fills the stage, as it fills the pictures of the page.
      const room = scale * (1 - 0.06 * Math.min(1, aslant / 20));
      gl.useProgram(shown.program);
      bind(gl, shown, "fine", plate.fine, 0);
      bind(gl, shown, "lit", plate.lit, 1);
      gl.uniform3fv(shown.at("toward"), toward);
      gl.uniform3fv(shown.at("albedo"), this.albedo);
      for (const name of ["strength", "ambient", "exposure"]) gl.uniform1f(shown.at(name), this[name]);
      gl.uniformMatrix3fv(shown.at("turn"), true, turn.flat());
      // From straight above, two triangles show the same.
      const { cells, buffer, count } = aslant > 0 ? this.grid : this.flat;
      gl.uniform2i(shown.at("cells"), ...cells);
      gl.uniform2f(shown.at("size"), size_mm, deep);
      gl.uniform2f(shown.at("fit"), (2 * room) / width, (2 * room) / height);
      gl.uniform2fv(shown.at("middle"), middle);
      gl.uniform1f(shown.at("base"), base);
      gl.uniform1f(shown.at("pivot"), pivot);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
      gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 0);
    }

    /** Heights of the foot of the plates and of the point about which they turn, mm. */
    depth() {
      const base = this.low - BASE * this.size_mm;
      return { base, pivot: 0.5 * (base + this.high) };
    }

    /** Rows of the rotation from the plate to the viewer. */
    turn() {
      const [a, b] = [radians(this.tilt.right), radians(this.tilt.down)];
      const [ca, sa, cb, sb] = [Math.cos(a), Math.sin(a), Math.cos(b), Math.sin(b)];
      return [[ca, 0, sa], [sa * sb, cb, -ca * sb], [-sa * cb, sb, ca * cb]];
    }

    /** Unit vector toward the lamp, which stays in the room, seen from the plate. */
    toward(turn) {
      const [a, e] = [radians(this.lamp.azimuth), radians(this.lamp.elevation)];
      const room = [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)];
      return [0, 1, 2].map((k) => turn[0][k] * room[0] + turn[1][k] * room[1] + turn[2][k] * room[2]);
    }

    // Hands

    furnish() {
      const make = (name, properties) => Object.assign(document.createElement(name), properties);
      this.edge = make("i", { className: "plate-edge" });
      this.sun = make("i", { className: "plate-lamp" });
      this.swiper = make("input", { type: "range", min: 0, max: 100, step: 1, className: "plate-swipe" });
      this.swiper.setAttribute("aria-label", `${this.names[0]} left of, ${this.names[1]} right of`);
      this.element.append(this.canvas, this.edge, this.sun, this.swiper);
      this.element.tabIndex = 0;
    }

    placeLamp(box) {
      const [a, e] = [radians(this.lamp.azimuth), radians(this.lamp.elevation)], reach = 0.5 * Math.min(box.width, box.height);
      this.sun.style.left = `${0.5 * box.width + reach * Math.cos(e) * Math.cos(a)}px`;
      this.sun.style.top = `${0.5 * box.height - reach * Math.cos(e) * Math.sin(a)}px`;
    }

    lampTo(event) {
      const box = this.element.getBoundingClientRect(), reach = 0.5 * Math.min(box.width, box.height);
      const [x, y] = [(event.clientX - box.left - box.width / 2) / reach, (box.top + box.height / 2 - event.clientY) / reach];
      this.setLamp((Math.atan2(y, x) * 180) / Math.PI, (Math.acos(Math.min(1, Math.hypot(x, y))) * 180) / Math.PI);
    }

    obey() {
      const { element } = this, { signal } = this.listening, listen = (kind, act) => element.addEventListener(kind, act, { signal });
      let drag = null, last = null;
      listen("pointerdown", (event) => {
        if (drag) return;
        const box = element.getBoundingClientRect(), from = event.clientX - box.left - (this.swipe / 100) * box.width;
        const grip = this.plates.length > 1 && Math.abs(from) < 20 && Math.abs(event.clientY - box.top - box.height / 2) < 26;
        const other = event.shiftKey || event.button === 2;
        drag = grip ? "swipe" : (this.mode === "tilt") !== other ? "tilt" : "lamp";
        last = event;
        event.preventDefault();
        element.setPointerCapture(event.pointerId);
        element.focus({ preventScroll: true });
        if (drag === "lamp") this.lampTo(event);
      });
      listen("pointermove", (event) => {
        if (!drag || event.pointerId !== last.pointerId) return;
        const box = element.getBoundingClientRect(), turn = 120 / Math.min(box.width, box.height);
        if (drag === "swipe") this.setSwipe((100 * (event.clientX - box.left)) / box.width);
        else if (drag === "lamp") this.lampTo(event);
        else this.setTilt(this.tilt.right + turn * (event.clientX - last.clientX), this.tilt.down + turn * (event.clientY - last.clientY));
        last = event;
      });
      for (const end of ["pointerup", "pointercancel"]) listen(end, (event) => { if (event.pointerId === last?.pointerId) drag = null; });
      listen("contextmenu", (event) => event.preventDefault());
      listen("keydown", (event) => this.key(event));
      this.swiper.addEventListener("input", () => this.setSwipe(this.swiper.value), { signal });
      this.canvas.addEventListener("webglcontextlost", () => { if (!this.gone) this.tell("lost", {}); }, { signal });
    }

    key(event) {
      if (event.ctrlKey || event.metaKey || event.altKey || event.target !== this.element) return;
      const ways = { ArrowLeft: [-STEP, 0], ArrowRight: [STEP, 0], ArrowUp: [0, STEP], ArrowDown: [0, -STEP] };
      const way = ways[event.key];
      if (way && event.shiftKey) this.setTilt(this.tilt.right + way[0], this.tilt.down - way[1]);
      // To the right is clockwise seen from above, as the hand of a clock goes.
      else if (way) this.setLamp(this.lamp.azimuth - way[0], this.lamp.elevation + way[1]);
      else if (event.key === "0") this.reset();
      else if (event.key.toLowerCase() === "b" && this.plates.length > 1) this.setSwipe(this.swipe > 50 ? 0 : 100);
      else return;
      event.preventDefault();
      event.stopPropagation();
    }

    tell(what, detail) {
      this.element.dispatchEvent(new CustomEvent(`plate-${what}`, { bubbles: true, detail }));
    }
  }

  /** One plate on the graphics card: its heights and its light, at the corners of quarters of its samples. */
  class Plate {
    constructor(gl, heights, { rows, cols, size_mm, repeats }, last) {
      this.gl = gl;
      this.field = new PlateLight.Field(heights, rows, cols, size_mm, repeats);
      // Heights that replace others mostly differ little: until their own is known they have the others' sky.
      if (last?.field.rows === rows && last.field.cols === cols) this.field.see(last.field.visible);
      this.size = [2 * cols + 1, 2 * rows + 1];
      this.fine = numbers(gl, gl.R32F, this.size, this.field.fine, gl.NEAREST);
      this.lit = numbers(gl, gl.R16F, this.size, this.field.radiance, gl.LINEAR);
      this.stale = true;
    }

    light(toward, strength, ambient) {
      if (!this.stale) return;
      const { gl, size } = this;
      gl.bindTexture(gl.TEXTURE_2D, this.lit);
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, ...size, gl.RED, gl.FLOAT, this.field.lit(toward, strength, ambient));
      this.stale = false;
    }

    remove() {
      for (const each of [this.fine, this.lit]) this.gl.deleteTexture(each);
    }
  }

  /** Scale, pixels a mm, and middle at which a turned box of these half sides and heights fits a stage. */
  function fitted(turn, [x, y], heights, [width, height]) {
    const ends = [0, 1].map((axis) => {
      const reach = Math.abs(turn[axis][0]) * x + Math.abs(turn[axis][1]) * y, deep = heights.map((z) => turn[axis][2] * z);
      return [Math.min(...deep) - reach, Math.max(...deep) + reach];
    });
    const [across, up] = ends.map(([low, high]) => high - low);
    return { scale: Math.min(width / across, height / up), middle: ends.map(([low, high]) => 0.5 * (low + high)) };
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

  return PlateView;
})();
