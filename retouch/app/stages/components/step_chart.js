// The steps of a run: roughness on its way to the target, and the change of the pictures.
export default {
  template: `
    <svg class="step-chart" :viewBox="'0 0 ' + wide + ' 120'" role="img" :aria-label="label" preserveAspectRatio="none">
      <line v-if="target" x1="0" :x2="wide" :y1="y(target)" :y2="y(target)" class="limit"></line>
      <polyline :points="points" class="curve"></polyline>
      <circle v-for="(value, k) in values" :key="k" :cx="x(k)" :cy="y(value)" r="2.4" class="dot"></circle>
    </svg>`,
  props: { values: { type: Array, default: () => [] }, target: Number, name: String },
  data: () => ({ wide: 320 }),
  computed: {
    ends() {
      const all = [...this.values, this.target].filter((one) => typeof one === "number");
      const low = Math.min(...all), high = Math.max(...all), room = Math.max(1e-9, 0.12 * (high - low));
      return [low - room, high + room];
    },
    points() { return this.values.map((value, k) => `${this.x(k)},${this.y(value)}`).join(" "); },
    label() { return `${this.name}: ${this.values.length} steps, now ${(this.values.at(-1) || 0).toPrecision(3)}`; },
  },
  methods: {
    x(k) { return 6 + ((this.wide - 12) * k) / Math.max(4, this.values.length - 1); },
    y(value) { const [low, high] = this.ends; return 116 - (112 * (value - low)) / (high - low); },
  },
};
