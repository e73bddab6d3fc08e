// A slider that sends its value while it is moved, a few times a second.
export default {
  template: `<input class="range" type="range" :min="min" :max="max" :step="step" :value="own" :aria-label="label"
    :aria-valuetext="own + ' ' + unit" @input="slid">`,
  props: { value: Number, min: Number, max: Number, step: Number, label: String, unit: { type: String, default: "" } },
  data() { return { own: this.value }; },
  watch: { value(now) { if (!this.timer) this.own = now; } },
  methods: {
    slid(event) {
      this.own = Number(event.target.value);
      if (this.timer) return;
      // The first move at once, the last one surely.
      const sent = this.own;
      this.$emit("slid", sent);
      this.timer = setTimeout(() => {
        this.timer = null;
        if (this.own !== sent) this.$emit("slid", this.own);
      }, 100);
    },
  },
};
