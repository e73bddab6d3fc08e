// A brush over the relief: the part of it that is to feel different. By the pointer, or by arrows and the space bar.
export default {
  template: `
    <div class="brush" tabindex="0" role="application" @keydown="key" @pointerdown="begin" @pointermove="hover"
      aria-label="Brush: arrows move, Space paints, plus and minus change its size, E erases">
      <canvas ref="relief"></canvas>
      <canvas ref="mask" class="mask"></canvas>
      <i class="ring" :style="ring"></i>
    </div>`,
  props: { heights: String, mask: String, size: { type: Number, default: 0.12 }, erase: Boolean, cleared: Number },
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
    restore() {
      const picture = new Image();
      picture.onload = () => {
        const context = this.$refs.mask.getContext("2d");
        context.drawImage(picture, 0, 0, this.cols, this.rows);
        const pixels = context.getImageData(0, 0, this.cols, this.rows);
        for (let k = 0; k < pixels.data.length; k += 4) pixels.data[k + 3] = pixels.data[k] > 127 ? 255 : 0;
        context.putImageData(pixels, 0, 0);
        Object.assign(context, { globalCompositeOperation: "source-in", fillStyle: this.colour() });
        context.fillRect(0, 0, this.cols, this.rows);
      };
      picture.src = this.mask;
    },
    colour() { return getComputedStyle(this.$el).getPropertyValue("--accent"); },
    wipe() {
      this.$refs.mask.getContext("2d").clearRect(0, 0, this.cols, this.rows);
    },
    place(event) {
      const box = this.$el.getBoundingClientRect();
      return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
    },
    hover(event) { this.at = this.place(event); },
    paint(from, to, erase) {
      const context = this.$refs.mask.getContext("2d");
      context.globalCompositeOperation = erase ? "destination-out" : "source-over";
      Object.assign(context, { lineCap: "round", lineWidth: 2 * this.radius * this.cols, strokeStyle: this.colour() });
      context.beginPath();
      context.moveTo(from[0] * this.cols, from[1] * this.rows);
      context.lineTo(to[0] * this.cols + 0.01, to[1] * this.rows);
      context.stroke();
    },
    begin(event) {
      if (event.button !== 0) return;
      this.$el.setPointerCapture(event.pointerId);
      let from = this.place(event);
      const move = (now) => {
        const to = this.place(now);
        this.paint(from, to, this.erase);
        from = to;
      };
      move(event);
      this.$el.addEventListener("pointermove", move);
      this.$el.addEventListener("pointerup", () => {
        this.$el.removeEventListener("pointermove", move);
        this.told();
      }, { once: true });
    },
    key(event) {
      const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
      const within = (share) => Math.min(1, Math.max(0, share));
      if (step) this.at = this.at.map((share, axis) => within(share + 0.03 * step[axis]));
      else if (event.key === " ") this.paint(this.at, this.at, this.erase);
      else if (event.key === "e") this.paint(this.at, this.at, true);
      else if (event.key === "+") this.own = Math.min(0.6, 2.4 * this.radius);
      else if (event.key === "-") this.own = Math.max(0.02, 1.6 * this.radius);
      else return;
      event.preventDefault();
      clearTimeout(this.timer);
      if (!step) this.timer = setTimeout(this.told, 300);
    },
    told() {
      const flat = document.createElement("canvas");
      Object.assign(flat, { width: this.cols, height: this.rows });
      const context = flat.getContext("2d");
      context.drawImage(this.$refs.mask, 0, 0);
      for (const [way, colour] of [["source-in", "#fff"], ["destination-over", "#000"]]) {
        Object.assign(context, { globalCompositeOperation: way, fillStyle: colour });
        context.fillRect(0, 0, this.cols, this.rows);
      }
      this.$emit("painted", flat.toDataURL("image/png"));
    },
  },
};
