// A relief under a lamp that the pointer moves: `PlateView` of the offline pages, fed from the app's server.
//
// before, after  addresses of heights (float32, with their form in headers); after may be empty
// lamp           { azimuth, elevation } that several views share
// swipe          where the edge between both stands, percent
// mode           what dragging moves: "lamp" or "tilt"
// blink          whether both take turns
export default {
  template: `
    <figure class="relief-view">
      <div ref="stage" class="relief-stage"></div>
      <p v-if="fault" class="relief-fault" role="status">{{ fault }}</p>
    </figure>`,
  props: {
    before: { type: String, default: "" },
    after: { type: String, default: "" },
    names: { type: Array, default: () => ["original", "result"] },
    lamp: { type: Object, default: () => ({ azimuth: 135, elevation: 35 }) },
    tilt: { type: Object, default: () => ({ right: 0, down: 0 }) },
    swipe: { type: Number, default: 50 },
    mode: { type: String, default: "lamp" },
    blink: Boolean,
  },
  data: () => ({ fault: "" }),
  mounted() {
    this.loading = 0;
    this.$refs.stage.addEventListener("plate-lamp", (event) => this.tell("lamp", event.detail));
    this.$refs.stage.addEventListener("plate-tilt", (event) => this.tell("tilt", event.detail));
    this.load();
    this.blinking = setInterval(() => {
      if (!this.blink || !this.view) return;
      this.second = !this.second;
      this.view.setSwipe(this.second ? 0 : 100);
    }, 600);
  },
  beforeUnmount() {
    clearInterval(this.blinking);
    this.loading = -1;
    if (this.view) this.view.destroy();
  },
  watch: {
    before() { this.load(); },
    after() { this.load(); },
    lamp(now) {
      const own = this.view && this.view.lamp;
      if (own && (own.azimuth !== now.azimuth || own.elevation !== now.elevation))
        this.quietly(() => this.view.setLamp(now.azimuth, now.elevation));
    },
    tilt(now) {
      const own = this.view && this.view.tilt;
      if (own && (own.right !== now.right || own.down !== now.down))
        this.quietly(() => this.view.setTilt(now.right, now.down));
    },
    swipe(now) { if (this.view) this.view.setSwipe(now); },
    blink(now) { if (!now && this.view) this.view.setSwipe(this.swipe); },
    mode(now) { if (this.view) this.view.setMode(now); },
  },
  methods: {
    /** Move the view without telling the server what it said itself. */
    quietly(move) {
      this.quiet = true;
      move();
      this.quiet = false;
    },
    tell(name, detail) {
      if (this.quiet) return;
      this.$emit(`${name}-now`, detail);
      // The server hears of the last position only, ten times a second.
      this.waiting = { ...this.waiting, [name]: detail };
      if (this.timer) return;
      this.timer = setTimeout(() => {
        this.timer = null;
        for (const [one, value] of Object.entries(this.waiting)) this.$emit(one, value);
        this.waiting = {};
      }, 100);
    },
    async heights(address) {
      if (!address) return null;
      const answer = await fetch(address);
      if (!answer.ok) throw new Error(await answer.text());
      const form = JSON.parse(answer.headers.get("x-form"));
      return { ...form, heights: new Float32Array(await answer.arrayBuffer()) };
    },
    async load() {
      if (!this.before) return;
      const turn = (this.loading += 1);
      try {
        const [one, other] = await Promise.all([this.heights(this.before), this.heights(this.after)]);
        if (turn !== this.loading) return;
        this.show(one, other);
        this.fault = "";
      } catch (error) {
        if (turn === this.loading) this.fault = String(error.message || error);
      }
    },
    show(one, other) {
      const { heights, rows, cols, size_mm, repeats } = one;
      const after = other && other.rows === rows && other.cols === cols ? other.heights : null;
      if (this.view && Boolean(this.hasAfter) === Boolean(after)) {
        this.view.setHeights(heights, after, { rows, cols, size_mm, repeats });
      } else {
        if (this.view) this.view.destroy();
        this.view = null;
        this.$refs.stage.replaceChildren();
        this.view = new PlateView(this.$refs.stage, {
          heights, rows, cols, size_mm, repeats, after, names: this.names,
          lamp: { ...this.lamp, strength: 1.5 }, ambient: 0.35, albedo: 0.62,
        });
        this.view.setMode(this.mode);
        this.view.setSwipe(this.swipe);
        this.quietly(() => this.view.setTilt(this.tilt.right, this.tilt.down));
      }
      this.hasAfter = Boolean(after);
      this.$refs.stage.dataset.shown = `${this.before} ${this.after}`;
    },
  },
};
