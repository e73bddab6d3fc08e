// A relief under a lamp that the pointer moves: `PlateView` of the offline pages, fed from the app's server.
//
// before, after  addresses of heights (float32, with their form in headers); after may be empty
// lamp           { azimuth, elevation } that several views share
// swipe          where the edge between both stands, percent
// tools          whether buttons say what dragging moves
// blink          whether both take turns
export default {
  template: `
    <figure class="relief-view">
      <div ref="stage" class="relief-stage"></div>
      <div v-if="tools && lit" class="relief-tools" role="group" aria-label="the view">
        <template v-if="tilts">
          <button v-for="(words, one) in { lamp: 'Move the lamp', tilt: 'Tilt the plate' }" :key="one" type="button"
            :aria-pressed="String(mode === one)" @click="choose(one)">{{ words }}</button>
        </template>
        <button type="button" @click="reset">Reset</button>
      </div>
      <p v-if="fault" class="relief-fault" role="status">{{ fault }}</p>
    </figure>`,
  props: {
    before: { type: String, default: "" },
    after: { type: String, default: "" },
    names: { type: Array, default: () => ["original", "result"] },
    lamp: { type: Object, default: () => ({ azimuth: 135, elevation: 35 }) },
    tilt: { type: Object, default: () => ({ right: 0, down: 0 }) },
    swipe: { type: Number, default: 50 },
    tools: { type: Boolean, default: true },
    blink: Boolean,
  },
  data: () => ({ fault: "", mode: "lamp", lit: false, tilts: false }),
  mounted() {
    this.loading = 0;
    this.$refs.stage.addEventListener("plate-lamp", (event) => this.send("lamp", event.detail));
    this.$refs.stage.addEventListener("plate-tilt", (event) => this.send("tilt", event.detail));
    this.$refs.stage.addEventListener("plate-lost", () => { this.tilts = false; });
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
      if (own && !this.moving() && (own.azimuth !== now.azimuth || own.elevation !== now.elevation))
        this.quietly(() => this.view.setLamp(now.azimuth, now.elevation));
    },
    tilt(now) {
      const own = this.view && this.view.tilt;
      if (own && !this.moving() && (own.right !== now.right || own.down !== now.down))
        this.quietly(() => this.view.setTilt(now.right, now.down));
    },
    swipe(now) { if (this.view) this.view.setSwipe(now); },
    blink(now) { if (!now && this.view) this.view.setSwipe(this.swipe); },
  },
  methods: {
    reset() { this.view.reset(); },
    choose(mode) {
      this.mode = mode;
      this.view.setMode(mode);
    },
    /** Whether a hand is moving this view: what other views say of lamp and tilt is then old. */
    moving() { return performance.now() - (this.moved || -Infinity) < 500; },
    /** Move the view without sending the server what it said itself. */
    quietly(move) {
      this.quiet = true;
      try { move(); } finally { this.quiet = false; }
    },
    send(name, detail) {
      if (this.quiet) return;
      this.moved = performance.now();
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
        this.quietly(() => {
          this.view = new PlateView(this.$refs.stage, {
            heights, rows, cols, size_mm, repeats, after, names: this.names,
            lamp: { azimuth: 135, elevation: 35, strength: 1.25 }, ambient: 0.25, albedo: 0.58,
          });
          this.view.setMode(this.mode);
          this.view.setSwipe(this.swipe);
          this.view.setLamp(this.lamp.azimuth, this.lamp.elevation);
          this.view.setTilt(this.tilt.right, this.tilt.down);
        });
      }
      [this.lit, this.tilts] = [true, this.view.tilts];
      this.hasAfter = Boolean(after);
      this.$refs.stage.dataset.shown = `${this.before} ${this.after}`;
    },
  },
};
