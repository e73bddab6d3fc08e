// Roughness on a scale of the textures that come with Retouch.
export default {
  template: `
    <figure class="texture-scale" role="img" :aria-label="label">
      <div class="scale-axis">
        <span v-for="one in marks" :key="one.name" class="scale-mark" :style="{ left: one.left }"></span>
        <span v-for="one in marks.filter((each) => each.label)" :key="one.name + ' name'" class="scale-name"
          :style="{ left: one.left, bottom: one.bottom }">{{ one.name }}</span>
        <span v-if="target" class="scale-target" :style="{ left: at(target) }"></span>
        <span v-if="value" class="scale-value" :style="{ left: at(value) }"></span>
      </div>
    </figure>`,
  props: { scale: { type: Object, default: () => ({}) }, value: Number, target: Number },
  computed: {
    ends() {
      const all = [...Object.values(this.scale), this.value, this.target].filter((one) => one > 0);
      return all.length ? [Math.log(Math.min(...all)) - 0.1, Math.log(Math.max(...all)) + 0.1] : [-4, -2];
    },
    marks() {
      // Names stand in rows, each where no earlier one is in its way.
      const ends = [-Infinity, -Infinity, -Infinity, -Infinity];
      return Object.entries(this.scale).map(([name, value]) => {
        const percent = this.percent(value), half = 0.95 * name.length;
        const row = ends.findIndex((end) => percent - half > end);
        if (row >= 0) ends[row] = percent + half + 1;
        return { name, left: `${percent}%`, bottom: `${10 + 13 * row}px`, label: row >= 0 };
      });
    },
    label() {
      const names = Object.entries(this.scale);
      const smoother = names.filter(([, value]) => value <= this.value).pop();
      const rougher = names.find(([, value]) => value > this.value);
      return `roughness between ${smoother ? smoother[0] : "nothing"} and ${rougher ? rougher[0] : "nothing"}`;
    },
  },
  methods: {
    percent(value) {
      const [low, high] = this.ends;
      return (100 * (Math.log(value) - low)) / (high - low);
    },
    at(value) { return `${this.percent(value)}%`; },
  },
};
