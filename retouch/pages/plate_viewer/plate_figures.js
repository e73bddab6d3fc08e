// Makes every `figure.plate-figure` of a page alive. Without this script, or without WebGL 2, they stay hidden.
{
  /** Heights of `figure.py`: base64 of zlib of byte planes of differences down the columns of differences along rows. */
  async function unpacked(text, { rows, cols, low, step }) {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const inflated = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    const planes = new Uint8Array(await new Response(inflated).arrayBuffer()), count = rows * cols;
    const steps = Uint16Array.from({ length: count }, (_, k) => planes[k] | (planes[count + k] << 8));
    for (let k = cols; k < count; k += 1) steps[k] += steps[k - cols];
    for (let k = 0; k < count; k += 1) if (k % cols) steps[k] += steps[k - 1];
    return Float32Array.from(steps, (value) => low + step * value);
  }

  const rounded = (degrees) => `${Math.round(degrees)}°`;

  async function start(figure) {
    const data = JSON.parse(figure.querySelector("script").textContent);
    const [heights, after] = await Promise.all(data.heights.map((each) => unpacked(each, data)));
    const stage = figure.querySelector(".plate-stage"), element = figure.querySelector(".plate-view");
    const each = (name, act) => figure.querySelectorAll(`[data-${name}]`).forEach((button) => act(button, button.dataset[name]));
    const press = (name, value) => each(name, (button, own) => button.setAttribute("aria-pressed", String(own === String(value))));
    const tags = figure.querySelectorAll(".tag"), [azimuth, elevation] = ["azimuth", "elevation"].map((name) => figure.querySelector(`.${name}`));
    stage.style.setProperty("--aspect", `${data.cols} / ${data.rows}`);
    figure.addEventListener("plate-lamp", ({ detail }) => {
      [azimuth.value, elevation.value] = [Math.round(detail.azimuth) % 360, Math.round(detail.elevation)];
      azimuth.nextElementSibling.textContent = rounded(azimuth.value);
      elevation.nextElementSibling.textContent = rounded(elevation.value);
      const near = (lamp) => Math.abs(lamp.azimuth - detail.azimuth) + Math.abs(lamp.elevation - detail.elevation) < 1e-6;
      press("lamp", data.lamps.findIndex(near));
    });
    figure.addEventListener("plate-swipe", ({ detail: { percent } }) => {
      press("swipe", percent);
      tags.forEach((tag, k) => { tag.hidden = percent === (k ? 100 : 0); });
    });
    figure.addEventListener("plate-lost", () => { figure.hidden = true; figure.dataset.state = "lost"; });
    figure.hidden = false;
    let view;
    try {
      view = new PlateView(element, { ...data, heights, after });
    } catch (fault) {
      figure.hidden = true;
      throw fault;
    }
    for (const slider of [azimuth, elevation]) slider.addEventListener("input", () => view.setLamp(azimuth.value, elevation.value));
    each("lamp", (button, place) => button.addEventListener("click", () => view.setLamp(data.lamps[place].azimuth, data.lamps[place].elevation)));
    each("swipe", (button, percent) => button.addEventListener("click", () => view.setSwipe(percent)));
    each("mode", (button, mode) => button.addEventListener("click", () => { view.setMode(mode); press("mode", mode); }));
    figure.querySelector(".reset").addEventListener("click", () => view.reset());
    figure.plateView = view;
    figure.dataset.state = "live";
  }

  const able = "DecompressionStream" in window && Boolean(document.createElement("canvas").getContext("webgl2"));
  document.querySelectorAll("figure.plate-figure").forEach((figure) => {
    if (!able) { figure.dataset.state = "still"; return; }
    start(figure).catch((fault) => { figure.dataset.state = "still"; console.error(fault); });
  });
}
