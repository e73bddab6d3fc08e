// A square over a picture: which part of it is taken, and in it what a tile repeats. Dragged by the pointer, or
// moved by the keys.
export default {
  template: `
    <div class="crop-box" ref="box" @pointerdown="begin">
      <img :src="picture" alt="the picture" draggable="false" @load="sized">
      <svg v-if="width" class="crop-shade" :viewBox="'0 0 ' + width + ' ' + height" preserveAspectRatio="none" aria-hidden="true">
        <path fill-rule="evenodd" :d="shade"></path>
        <rect v-if="tile && !own" class="crop-tile" :x="tile[0]" :y="tile[1]" :width="tile[2]" :height="tile[2]"></rect>
      </svg>
      <div class="crop-square" tabindex="0" role="slider" aria-label="part of the picture that is taken"
        aria-valuemin="0" :aria-valuemax="Math.min(width, height)" :aria-valuenow="square.side" :aria-valuetext="text"
        :style="place" @keydown="key" data-part="move">
        <i v-for="corner in ['nw', 'ne', 'sw', 'se']" :class="corner" :data-part="corner"></i>
      </div>
    </div>`,
  props: { picture: String, width: Number, height: Number, crop: Array, tile: Array },
  data: () => ({ own: null }),
  computed: {
    square() {
      if (this.own) return this.own;
      if (this.crop) return { x: this.crop[0], y: this.crop[1], side: this.crop[2] };
      const side = Math.min(this.width, this.height);
      return { x: Math.floor((this.width - side) / 2), y: Math.floor((this.height - side) / 2), side };
    },
    shade() {
      const { x, y, side } = this.square;
      return `M0 0h${this.width}v${this.height}h${-this.width}z M${x} ${y}v${side}h${side}v${-side}z`;
    },
    place() {
      const { x, y, side } = this.square, share = (of, whole) => `${(100 * of) / whole}%`;
      return {
        left: share(x, this.width), top: share(y, this.height),
        width: share(side, this.width), height: share(side, this.height),
      };
    },
    text() {
      const { x, y, side } = this.square;
      return `${side} pixels a side, from ${x}, ${y}`;
    },
  },
  watch: { crop() { this.own = null; }, picture() { this.own = null; } },
  methods: {
    sized() { this.$forceUpdate(); },
    bounded(x, y, side) {
      const whole = Math.min(this.width, this.height);
      side = Math.round(Math.min(whole, Math.max(Math.min(16, whole), side)));
      return {
        x: Math.round(Math.min(this.width - side, Math.max(0, x))),
        y: Math.round(Math.min(this.height - side, Math.max(0, y))),
        side,
      };
    },
    at(event) {
      const box = this.$refs.box.getBoundingClientRect();
      return [
        ((event.clientX - box.left) / box.width) * this.width,
        ((event.clientY - box.top) / box.height) * this.height,
      ];
    },
    begin(event) {
      if (event.button !== 0) return;
      event.preventDefault();
      const part = event.target.dataset.part || "new", [x, y] = this.at(event), first = { ...this.square };
      const grip = { nw: [1, 1], ne: [0, 1], sw: [1, 0], se: [0, 0] }[part];
      this.$refs.box.setPointerCapture(event.pointerId);
      const move = (now) => {
        const [u, v] = this.at(now);
        if (part === "move") this.own = this.bounded(first.x + u - x, first.y + v - y, first.side);
        else {
          // The corner across stays where it is.
          const [left, top] = grip || [0, 0];
          const ax = grip ? first.x + left * first.side : x, ay = grip ? first.y + top * first.side : y;
          const side = Math.max(Math.abs(u - ax), Math.abs(v - ay));
          this.own = this.bounded(u < ax ? ax - side : ax, v < ay ? ay - side : ay, side);
        }
      };
      const end = () => {
        this.$refs.box.removeEventListener("pointermove", move);
        this.send();
      };
      this.$refs.box.addEventListener("pointermove", move);
      this.$refs.box.addEventListener("pointerup", end, { once: true });
      this.$el.querySelector(".crop-square").focus({ preventScroll: true });
    },
    key(event) {
      const step = Math.max(1, Math.round(Math.min(this.width, this.height) / 50)), { x, y, side } = this.square;
      const [dx, dy] = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key] || [0, 0];
      if (!dx && !dy) return;
      event.preventDefault();
      this.own = event.shiftKey
        ? this.bounded(x, y, side + step * (dx - dy))
        : this.bounded(x + step * dx, y + step * dy, side);
      clearTimeout(this.timer);
      this.timer = setTimeout(this.send, 250);
    },
    send() {
      if (!this.own) return;
      const { x, y, side } = this.own;
      this.$emit("crop", [x, y, side, side]);
    },
  },
};
