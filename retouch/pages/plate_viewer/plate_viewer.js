// A plate, before and after, under one lamp that moves: a component of a page, in plain WebGL 2 or, where that is missing
// or the graphics card drops the picture, on a 2-D canvas, which shows the same from straight above.
//
//     const view = new PlateView(element, { heights, rows, cols, size_mm, after, ... });
//
// The element becomes the stage: it is to be positioned and to have a size.
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
// Properties: lamp, tilt, swipe, mode; tilts, whether plates can be tilted, which a 2-D canvas cannot: there the tilt stays
// 0, 0, and what would tilt moves the lamp; ready, a promise that is kept when the sky over the last heights, whose shade in
// the hollows is found while the page goes on, is known. Events of the element, which bubble, with these as `detail`:
//     plate-lamp { azimuth, elevation }, plate-tilt { right, down }, plate-swipe { percent }, plate-lost {}
//     the last once the graphics card has dropped the picture, and the 2-D canvas has taken its place
// Pointer: a drag moves the lamp, which stands under the pointer: the middle of the stage is straight above, its rim
// the horizon; shift or the right button tilts; the edge is dragged by its grip. Keys of the stage: arrows for the
// lamp, shift and arrows to tilt, B for the other plate, 0 to reset.
"use strict";

const PlateView = (() => {
  const LOWEST = 5, MOST_TILT = 60, STEP = 5;
  /** Longest time for which the page stands still while the sky is looked for, ms. */
  const SLICE = 12;
  /** How long heights stay the same before the sky over them is looked for, ms: a slider changes them more often. */
  const SETTLED = 250;
  /** Time without a new picture after which one is drawn with care, ms. */
  const CALM = 150;
  /** Thickness of the plate below its lowest point, as a part of its width. */
  const BASE = 0.06;

  const radians = (degrees) => (degrees * Math.PI) / 180;
  const clamped = (value, low, high) => Math.min(high, Math.max(low, Number(value) || 0));

  class PlateView {
    constructor(element, options) {
      this.element = element;
      this.screen = PlateScreens.open(() => this.lose());
      const { lamp = {}, albedo = 0.5, ambient = 0.25, exposure = 1, names = ["before", "after"] } = options;
      const { azimuth = 135, elevation = 35, strength = 1 } = lamp;
      this.start = { azimuth, elevation };
      this.names = names;
      this.mode = "lamp";
      this.listening = new AbortController();
      this.furnish();
      this.setMaterial({ albedo, ambient, exposure, strength });
      this.setHeights(options.heights, options.after ?? null, options);
      this.reset();
      this.obey();
      this.resized = new ResizeObserver(() => this.draw());
      this.resized.observe(element);
    }

    get tilts() {
      return this.screen.tilts;
    }

    // What is shown

    setHeights(heights, after = null, { rows = this.rows, cols = this.cols, size_mm = this.size_mm, repeats } = {}) {
      if (!(rows > 1 && cols > 1 && size_mm > 0)) throw new Error("rows, cols and size_mm: not the size of a plate");
      for (const each of after ? [heights, after] : [heights])
        if (each?.length !== rows * cols) throw new Error(`heights: ${each?.length} values, not ${rows * cols}`);
      const size = { rows, cols, size_mm, repeats: repeats ?? this.repeats ?? [false, false] };
      const plates = [heights, after].filter(Boolean).map((each, k) => plateOf(each, size, this.plates?.[k]));
      this.plates?.forEach((plate) => this.screen.drop(plate));
      plates.forEach((plate) => this.screen.take(plate));
      Object.assign(this, size, { plates });
      const [lows, highs] = ["low", "high"].map((end) => plates.map(({ field }) => field[end]));
      [this.low, this.high] = [Math.min(...lows), Math.max(...highs)];
      this.edge.hidden = this.swiper.hidden = plates.length < 2;
      this.relight();
      this.ready = this.hideSky(plates);
    }

    /** Finds what each relief hides of the sky, in slices between which the page lives. */
    async hideSky(plates) {
      await new Promise((done) => setTimeout(done, SETTLED));
      if (this.gone || this.plates !== plates) return;
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
      [right, down] = [right, down].map((degrees) => (this.tilts ? clamped(degrees, -MOST_TILT, MOST_TILT) : 0));
      this.tilt = { right, down };
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
      return this.screen.pixels();
    }

    destroy() {
      cancelAnimationFrame(this.frame);
      clearTimeout(this.calm);
      this.gone = true;
      this.listening.abort();
      this.resized.disconnect();
      this.screen.release();
      this.element.replaceChildren();
    }

    /** Goes on without the graphics card. */
    lose() {
      if (this.gone) return;
      const { canvas } = this.screen;
      this.screen = PlateScreens.plain();
      this.plates.forEach((plate) => this.screen.take(plate));
      canvas.replaceWith(this.screen.canvas);
      this.setTilt(0, 0);
      this.tell("lost", {});
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
        this.paint(true);
        clearTimeout(this.calm);
        this.calm = setTimeout(() => { if (this.tilted) this.paint(); }, CALM);
      });
    }

    get tilted() {
      return this.tilt.right !== 0 || this.tilt.down !== 0;
    }

    /** Draws now; hastily, when a next picture may follow at once. */
    paint(hasty = false) {
      const { screen, plates, size_mm, rows, cols, lamp, tilt, albedo, strength, ambient, exposure } = this;
      if (this.gone || screen.lost || !lamp || !tilt) return;
      const { canvas, densest } = screen, box = this.element.getBoundingClientRect(), dense = Math.min(devicePixelRatio || 1, densest);
      const [width, height] = [box.width, box.height].map((side) => Math.max(1, Math.round(side * dense)));
      if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
      const turn = this.turn(), toward = this.toward(turn), split = Math.round((this.swipe / 100) * width);
      const spans = plates.length < 2 ? [[0, width]] : [[0, split], [split, width]];
      const parts = plates.map((plate, k) => ({ plate, from: spans[k][0], to: spans[k][1] })).filter(({ from, to }) => to > from);
      for (const { plate } of parts) {
        if (!plate.stale) continue;
        plate.field.lit(toward, strength, ambient);
        screen.relit(plate);
        plate.stale = false;
      }
      const { base, pivot } = this.depth(), aslant = Math.hypot(tilt.right, tilt.down), size = [size_mm, (size_mm * rows) / cols];
      const { scale, middle } = fitted(turn, size.map((side) => side / 2), [base - pivot, this.high - pivot], [width, height]);
      // From straight above the plate fills the stage, as it fills the pictures of the page.
      const room = scale * (1 - 0.06 * Math.min(1, aslant / 20));
      screen.show(parts, {
        width, height, turn, tilted: this.tilted, hasty, scale: room, middle, size, base, pivot,
        toward, albedo, strength, ambient, exposure,
      });
      this.placeLamp(box);
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
      this.element.append(this.screen.canvas, this.edge, this.sun, this.swiper);
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
        drag = grip ? "swipe" : this.tilts && (this.mode === "tilt") !== other ? "tilt" : "lamp";
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
    }

    key(event) {
      if (event.ctrlKey || event.metaKey || event.altKey || event.target !== this.element) return;
      const ways = { ArrowLeft: [-STEP, 0], ArrowRight: [STEP, 0], ArrowUp: [0, STEP], ArrowDown: [0, -STEP] };
      const way = ways[event.key];
      if (way && event.shiftKey && this.tilts) this.setTilt(this.tilt.right + way[0], this.tilt.down - way[1]);
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

  /** A plate and its light, which is stale until it is found; `last` is the plate whose place it takes. */
  function plateOf(heights, { rows, cols, size_mm, repeats }, last) {
    const field = new PlateLight.Field(heights, rows, cols, size_mm, repeats);
    // Heights that replace others mostly differ little: until their own is known they have the others' sky.
    if (last?.field.rows === rows && last.field.cols === cols) field.see(last.field.visible);
    return { field, stale: true };
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

  return PlateView;
})();
