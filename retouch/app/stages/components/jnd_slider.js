// How much rougher or smoother, in just-noticeable differences, over what that costs the look.
export default {
  template: `
    <div class="jnd-slider">
      <div class="jnd-readout">
        <output class="value">{{ signed(own) }}</output><span class="unit">JND</span>
        <span class="what">{{ words }}</span>
      </div>
      <svg class="jnd-cost" viewBox="0 0 240 64" preserveAspectRatio="none" aria-hidden="true">
        <template v-if="costs.length">
          <rect :x="x(-smoother)" y="0" :width="x(rougher) - x(-smoother)" height="64" class="kept"></rect>
          <line x1="0" x2="240" :y1="y(limit)" :y2="y(limit)" class="limit"></line>
          <polyline :points="curve" class="curve"></polyline>
        </template>
        <line :x1="x(own)" :x2="x(own)" y1="0" y2="64" class="now"></line>
      </svg>
      <input type="range" :min="-most" :max="most" step="0.1" :value="own" :aria-label="label"
        :aria-valuetext="signed(own) + ' just-noticeable differences. ' + costText" @input="slid">
      <div class="jnd-ends"><span>smoother</span><span>as it is</span><span>rougher</span></div>
      <p class="hint cost">{{ costText }}</p>
    </div>`,
  props: {
    value: Number, most: { type: Number, default: 6 }, label: { type: String, default: "change of the roughness" },
    costs: { type: Array, default: () => [] }, limit: { type: Number, default: 2 },
    smoother: { type: Number, default: 0 }, rougher: { type: Number, default: 0 }, waiting: String,
  },
  data() { return { own: this.value }; },
  watch: { value(now) { if (!this.timer) this.own = now; } },
  computed: {
    top() { return 1.6 * this.limit; },
    curve() { return this.costs.map(([jnd, cost]) => `${this.x(jnd)},${this.y(cost)}`).join(" "); },
    cost() {
      const after = this.costs.findIndex(([jnd]) => jnd >= this.own);
      if (after < 1) return after === 0 ? this.costs[0][1] : null;
      const [[a, low], [b, high]] = [this.costs[after - 1], this.costs[after]];
      return low + ((high - low) * (this.own - a)) / (b - a);
    },
    words() {
      if (Math.abs(this.own) < 0.05) return "as it is";
      return this.own > 0 ? "rougher than the original" : "smoother than the original";
    },
    costText() {
      if (this.cost === null || !this.costs.length) return this.waiting || "";
      const reach = `Up to ${this.rougher.toFixed(1)} JND rougher or ${this.smoother.toFixed(1)} smoother the look is kept.`;
      return `The pictures change by about ${this.cost.toFixed(1)} % of the mean picture. ${reach}`;
    },
  },
  methods: {
    x(jnd) { return (240 * (Math.min(this.most, Math.max(-this.most, jnd)) + this.most)) / (2 * this.most); },
    y(cost) { return 64 - (64 * Math.min(this.top, cost)) / this.top; },
    signed(jnd) { return (jnd > 0 ? "+" : jnd < 0 ? "−" : "") + Math.abs(jnd).toFixed(1); },
    slid(event) {
      this.own = Number(event.target.value);
      if (this.timer) return;
      // The first move at once, the last one surely.
      const sent = this.own;
      this.$emit("jnd", sent);
      this.timer = setTimeout(() => {
        this.timer = null;
        if (this.own !== sent) this.$emit("jnd", this.own);
      }, 100);
    },
  },
};
