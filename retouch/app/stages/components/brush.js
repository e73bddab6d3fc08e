// A brush over the relief: how far each part of it is to go to another feel. By the pointer, or by arrows and the
// space bar. The alpha of the mask is the share of the way, from 0 to 1; a stroke sets it to the strength of the brush.
export default {
  template: `
    <div class="brush" tabindex="0" role="application" @keydown="key" @pointerdown="begin" @pointermove="hover"
      aria-label="Brush: arrows move, Space paints, plus and minus change its size, E erases">
      <canvas ref="relief"></canvas>
      <canvas ref="mask" class="mask"></canvas>
      <i class="ring" :style="ring"></i>
    </div>`,
  props: {
    heights: String, mask: String, size: { type: Number, default: 0.12 }, strength: { type: Number, default: 1 },
    soft: Boolean, erase: Boolean, cleared: Number, answered: { type: Number, default: 0 },
  },
  data: () => ({ at: [0.5, 0.5], own: null, rows: 0, cols: 0 }),
  computed: {
    radius() { return (this.own || this.size) / 2; },
    ring() {
      const [u, v] = this.at, percent = (share) => `${100 * share}%`;
      return { left: percent(u), top: percent(v), width: percent(2 * this.radius) };
    },
  },
  watch: {
    heights() { this.load(); },
    size() { this.own = null; },
    // Another mask, by an undo or another window; not before the server has answered to all strokes of this one.
    mask() { if (!this.pending() && this.rows) this.restore(); },
    answered() { if (!this.pending() && this.rows) this.restore(); },
    cleared() { this.wipe(); },
  },
  mounted() { this.load(); },
  methods: {
    async load() {
      if (!this.heights) return;
      const address = this.heights, answer = await fetch(address);
      if (!answer.ok || address !== this.heights || !this.$refs.relief) return;
      const { rows, cols, size_mm } = JSON.parse(answer.headers.get("x-form"));
      const heights = new Float32Array(await answer.arrayBuffer());
      if (!this.$refs.relief) return;
      this.shade(heights, rows, cols, size_mm / cols);
      if (this.rows === rows && this.cols === cols) return;
      Object.assign(this, { rows, cols });
      Object.assign(this.$refs.mask, { width: cols, height: rows });
      if (this.mask) this.restore();
    },
    shade(heights, rows, cols, pitch) {
      const canvas = Object.assign(this.$refs.relief, { width: cols, height: rows });
      const context = canvas.getContext("2d"), picture = context.createImageData(cols, rows);
      for (let i = 0; i < rows; i += 1)
        for (let j = 0; j < cols; j += 1) {
          const z = (di, dj) => heights[Math.min(rows - 1, Math.max(0, i + di)) * cols + Math.min(cols - 1, Math.max(0, j + dj))];
          const dx = (z(0, 1) - z(0, -1)) / (2 * pitch), dy = (z(-1, 0) - z(1, 0)) / (2 * pitch);
          const light = Math.max(0, (0.5 * dx - 0.5 * dy + 0.7) / Math.hypot(dx, dy, 1));
          picture.data.set([1, 1, 1].map(() => 60 + 180 * light).concat(255), 4 * (i * cols + j));
        }
      context.putImageData(picture, 0, 0);
    },
    /** Whether a stroke is under way, or on its way to the server. */
    pending() { return Boolean(this.stroking || this.timer || (this.sent || 0) > this.answered); },
    restore() {
      if (!this.mask) return this.wipe();
      const picture = new Image(), address = this.mask;
      picture.onload = () => {
        if (this.pending() || address !== this.mask || !this.$refs.mask) return;
        const context = this.context("copy");
        context.drawImage(picture, 0, 0, this.cols, this.rows);
        const pixels = context.getImageData(0, 0, this.cols, this.rows);
        for (let k = 0; k < pixels.data.length; k += 4) pixels.data[k + 3] = pixels.data[k];
        context.putImageData(pixels, 0, 0);
        this.fill(this.context("source-in"), this.colour());
      };
      picture.src = address;
    },
    /** The mask's context, with nothing left of what was set before. */
    context(way) {
      const context = this.$refs.mask.getContext("2d", { willReadFrequently: true });
      return Object.assign(context, { globalCompositeOperation: way, globalAlpha: 1 });
    },
    fill(context, colour) {
      Object.assign(context, { fillStyle: colour });
      context.fillRect(0, 0, this.cols, this.rows);
    },
    colour() { return getComputedStyle(this.$el).getPropertyValue("--accent").trim(); },
    wipe() {
      this.context("source-over").clearRect(0, 0, this.cols, this.rows);
    },
    place(event) {
      const box = this.$el.getBoundingClientRect();
      return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
    },
    hover(event) { this.at = this.place(event); },
    paint(from, to, erase) {
      if (this.soft) return this.spray(from, to, erase);
      const draw = (way, alpha) => {
        const context = Object.assign(this.context(way), { globalAlpha: alpha, strokeStyle: this.colour() });
        Object.assign(context, { lineCap: "round", lineWidth: 2 * this.radius * this.cols });
        context.beginPath();
        context.moveTo(from[0] * this.cols, from[1] * this.rows);
        context.lineTo(to[0] * this.cols + 0.01, to[1] * this.rows);
        context.stroke();
      };
      this.set(draw, erase);
    },
    /** Discs that fade to their rim, a quarter of the radius apart along the way, however many moves it has. */
    spray(from, to, erase) {
      const radius = this.radius * this.cols, [x, y] = [(to[0] - from[0]) * this.cols, (to[1] - from[1]) * this.rows];
      const length = Math.hypot(x, y), apart = 0.25 * radius;
      let next = apart - this.since;
      for (; next <= length; next += apart) {
        const part = length ? next / length : 0;
        const at = [from[0] * this.cols + x * part, from[1] * this.rows + y * part];
        this.set((way, alpha) => {
          const context = Object.assign(this.context(way), { globalAlpha: alpha });
          const fade = context.createRadialGradient(...at, 0, ...at, radius), colour = this.colour();
          fade.addColorStop(0, colour);
          fade.addColorStop(1, `${colour}00`);
          context.fillStyle = fade;
          context.fillRect(at[0] - radius, at[1] - radius, 2 * radius, 2 * radius);
        }, erase);
      }
      this.since = length - (next - apart);
    },
    /** The next disc lies where the stroke begins. */
    lift() { this.since = 0.25 * this.radius * this.cols; },
    /** What was there gives way, and the strength takes its place: a (1 - c) + s c under a cover c. */
    set(draw, erase) {
      draw("destination-out", 1);
      if (!erase) draw("lighter", this.strength);
    },
    begin(event) {
      if (event.button !== 0) return;
      this.$el.setPointerCapture(event.pointerId);
      this.stroking = true;
      this.lift();
      let from = this.place(event);
      const move = (now) => {
        const to = this.place(now);
        this.paint(from, to, this.erase);
        from = to;
      };
      move(event);
      const over = new AbortController(), { signal } = over;
      const end = () => {
        over.abort();
        this.stroking = false;
        this.send();
      };
      this.$el.addEventListener("pointermove", move, { signal });
      for (const name of ["pointerup", "pointercancel"]) this.$el.addEventListener(name, end, { signal });
    },
    key(event) {
      const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
      const within = (share) => Math.min(1, Math.max(0, share));
      if (step) this.at = this.at.map((share, axis) => within(share + 0.03 * step[axis]));
      else if (event.key === " ") this.dab(this.erase);
      else if (event.key === "e") this.dab(true);
      else if (event.key === "+") this.own = Math.min(0.6, 2.4 * this.radius);
      else if (event.key === "-") this.own = Math.max(0.02, 1.6 * this.radius);
      else return;
      event.preventDefault();
    },
    /** A dab where the ring is; several in a row are sent together. */
    dab(erase) {
      this.lift();
      this.paint(this.at, this.at, erase);
      clearTimeout(this.timer);
      this.timer = setTimeout(this.send, 300);
    },
    send() {
      clearTimeout(this.timer);
      this.timer = null;
      this.sent = (this.sent || 0) + 1;
      const flat = document.createElement("canvas");
      Object.assign(flat, { width: this.cols, height: this.rows });
      const context = flat.getContext("2d");
      context.drawImage(this.$refs.mask, 0, 0);
      for (const [way, colour] of [["source-in", "#fff"], ["destination-over", "#000"]]) {
        context.globalCompositeOperation = way;
        this.fill(context, colour);
      }
      this.$emit("painted", { mask: flat.toDataURL("image/png"), number: this.sent });
    },
  },
};
