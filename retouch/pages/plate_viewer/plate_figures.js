// Plates of a page: every `figure.plate-figure` becomes alive, and every `.plate-spot` once its button is pressed.
// Without this script, or without WebGL 2, figures stay hidden and spots stay pictures.
"use strict";

const PlateFigures = (() => {
  /** Heights of `figure.py`: base64 of zlib of byte planes of differences down the columns of differences along rows. */
  async function unpacked({ data, low, step }, { rows, cols }) {
    const bytes = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0));
    const inflated = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    const planes = new Uint8Array(await new Response(inflated).arrayBuffer()), count = rows * cols;
    const steps = Uint16Array.from({ length: count }, (_, k) => planes[k] | (planes[count + k] << 8));
    for (let k = cols; k < count; k += 1) steps[k] += steps[k - cols];
    for (let k = 0; k < count; k += 1) if (k % cols) steps[k] += steps[k - 1];
    return Float32Array.from(steps, (value) => low + step * value);
  }

  async function viewed(element, data) {
    const [heights, after] = await Promise.all(data.heights.map((each) => unpacked(each, data)));
    return new PlateView(element, { ...data, heights, after });
  }

  const able = "DecompressionStream" in window && Boolean(document.createElement("canvas").getContext("webgl2"));
  const read = (holder) => JSON.parse(holder.querySelector("script").textContent);

  /** Makes a figure alive with these data; it is hidden again where that fails. */
  async function start(figure, data = read(figure)) {
    figure.dataset.state = "still";
    if (!able) return;
    const find = (name) => figure.querySelector(name), sliders = [find(".azimuth"), find(".elevation")];
    const each = (name, act) => figure.querySelectorAll(`[data-${name}]`).forEach((button) => act(button, button.dataset[name]));
    const press = (name, value) => each(name, (button, own) => button.setAttribute("aria-pressed", String(own === String(value))));
    find(".plate-stage").style.setProperty("--aspect", `${data.cols} / ${data.rows}`);
    figure.addEventListener("plate-lamp", ({ detail }) => {
      [detail.azimuth, detail.elevation].forEach((degrees, k) => {
        sliders[k].value = Math.round(degrees);
        sliders[k].nextElementSibling.textContent = `${Math.round(degrees)}\u00b0`;
      });
      press("lamp", data.lamps.findIndex((lamp) => Math.abs(lamp.azimuth - detail.azimuth) + Math.abs(lamp.elevation - detail.elevation) < 1e-6));
    });
    figure.addEventListener("plate-swipe", ({ detail: { percent } }) => {
      press("swipe", percent);
      figure.querySelectorAll(".tag").forEach((tag, k) => { tag.hidden = percent === (k ? 100 : 0); });
    });
    // The plate is drawn on a 2-D canvas then, which does not tilt.
    figure.addEventListener("plate-lost", () => each("mode", (button) => { button.disabled = true; }));
    figure.hidden = false;
    try {
      const view = figure.plateView = await viewed(find(".plate-view"), data);
      if (!figure.isConnected) return view.destroy();
      const shine = ({ azimuth, elevation, strength, ambient }) => { view.setMaterial({ strength, ambient }); view.setLamp(azimuth, elevation); };
      for (const slider of sliders) slider.addEventListener("input", () => view.setLamp(sliders[0].value, sliders[1].value));
      each("lamp", (button, place) => button.addEventListener("click", () => shine(data.lamps[place])));
      each("swipe", (button, percent) => button.addEventListener("click", () => view.setSwipe(percent)));
      each("mode", (button, mode) => button.addEventListener("click", () => { view.setMode(mode); press("mode", mode); }));
      find(".reset").addEventListener("click", () => { view.reset(); shine(data.lamp); });
      figure.dataset.state = "live";
    } catch (fault) {
      figure.hidden = true;
      console.error(fault);
    }
  }

  // Browsers keep few pictures of the graphics card at once: of spots and of rows of a study one is alive at a time.
  let put = () => {};
  /** Puts away what was alive before; `away` is called once another one takes this one's place. */
  function instead(away) {
    put();
    put = away;
  }

  function open(spot) {
    const button = spot.querySelector(".plate-open"), element = spot.querySelector(".plate-view");
    const words = button.textContent;
    const close = () => {
      button.textContent = words;
      spot.plateView?.destroy();
      spot.plateView = null;
      element.hidden = true;
      button.setAttribute("aria-pressed", "false");
    };
    button.hidden = false;
    button.addEventListener("click", async () => {
      if (!element.hidden) { instead(() => {}); return; }
      instead(close);
      element.hidden = false;
      button.textContent = "Show the picture";
      button.setAttribute("aria-pressed", "true");
      const view = await viewed(element, read(spot));
      if (element.hidden) view.destroy();
      else spot.plateView = view;
    });
  }

  document.querySelectorAll("figure.plate-figure").forEach((figure) => start(figure));
  if (able) document.querySelectorAll(".plate-spot").forEach(open);
  return { able, start, instead };
})();
