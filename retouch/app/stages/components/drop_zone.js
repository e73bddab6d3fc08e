// Pictures from the person's disk: dropped anywhere on the page, or chosen by a button.
export default {
  template: `
    <div class="drop-zone">
      <label class="button primary" tabindex="0" @keydown.enter.space.prevent="$refs.input.click()">
        {{ label }}
        <input ref="input" type="file" :accept="accept" tabindex="-1" class="unseen" @change="chosen">
      </label>
      <span class="hint" v-if="!sending">{{ hint }}</span>
      <span class="hint" role="status" v-else>
        <progress :value="share" max="1" aria-label="sending"></progress> {{ sending }}
      </span>
      <p class="fault" role="alert" v-if="fault">{{ fault }}</p>
      <div class="drop-cover" v-if="over" aria-hidden="true">Drop it here</div>
    </div>`,
  props: { accept: String, label: String, hint: String, address: String },
  data: () => ({ over: false, sending: "", share: 0, fault: "" }),
  mounted() {
    this.listeners = {
      dragover: (event) => { event.preventDefault(); this.over = true; },
      dragleave: (event) => { if (!event.relatedTarget) this.over = false; },
      drop: (event) => { event.preventDefault(); this.over = false; this.send(event.dataTransfer.files[0]); },
    };
    for (const [name, listener] of Object.entries(this.listeners)) window.addEventListener(name, listener);
  },
  beforeUnmount() {
    for (const [name, listener] of Object.entries(this.listeners)) window.removeEventListener(name, listener);
  },
  methods: {
    chosen() {
      this.send(this.$refs.input.files[0]);
      this.$refs.input.value = "";
    },
    send(file) {
      if (!file || this.sending) return;
      const request = new XMLHttpRequest();
      const ended = (fault) => { this.sending = ""; this.fault = fault; };
      this.fault = "";
      this.share = 0;
      this.sending = `reading ${file.name}`;
      request.upload.onprogress = ({ loaded, total }) => { this.share = total ? loaded / total : 0; };
      request.onload = () => {
        ended(request.status === 200 ? "" : request.responseText);
        if (request.status === 200) this.$emit("kept", JSON.parse(request.responseText));
      };
      request.onerror = () => ended("The app does not answer; it may have been closed.");
      request.open("POST", this.address);
      request.setRequestHeader("x-name", encodeURIComponent(file.name));
      request.send(file);
    },
  },
};
