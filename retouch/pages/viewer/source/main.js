// Makes every `figure.viewer` of a page alive. Without this script, or without WebGL, its still picture stays.
import { loaded } from "./meshes.js";
import { View } from "./scene.js";

const STEP = 6;
const SHORTEST_PIXELS = 46;

/** The longest bar of 1, 2 or 5 times a power of ten, mm, that is not much wider than SHORTEST_PIXELS. */
function scaleBar(bar, pixelsPerMm) {
  const power = 10 ** Math.floor(Math.log10(SHORTEST_PIXELS / pixelsPerMm));
  const length = power * [1, 2, 5, 10].find((factor) => factor * power * pixelsPerMm >= SHORTEST_PIXELS);
  bar.style.width = `${length * pixelsPerMm}px`;
  bar.textContent = length < 1 ? `${Math.round(1000 * length)} µm` : `${length} mm`;
}

function enliven(figure, view) {
  const find = (name) => figure.querySelector(name);
  const [stage, bar, swipe, lamp] = [".stage", ".scale-bar", ".swipe input", ".lamp"].map(find);
  let waiting = false, drag = null;
  const pointers = new Map();

  const draw = () => {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      const { clientWidth: width, clientHeight: height } = stage;
      const split = swipe ? swipe.value / 100 : 1;
      if (!width || !height) return;
      view.draw(width, height, split);
      scaleBar(bar, view.pixelsPerMm);
      stage.style.setProperty("--split", `${100 * split}%`);
      figure.querySelectorAll(".stage > .tag").forEach((tag, k) => { tag.hidden = split === k; });
      figure.dataset.camera = [view.azimuth, view.elevation, view.zoom].map((value) => value.toFixed(2)).join(" ");
      figure.dataset.lampAt = [view.lampAzimuth, view.lampElevation].map((value) => value.toFixed(2)).join(" ");
    });
  };
  const zoom = (factor) => {
    view.zoom = Math.min(40, Math.max(0.4, view.zoom * factor));
    draw();
  };
  const shine = (on) => lamp.setAttribute("aria-pressed", on);
  const shines = () => lamp.getAttribute("aria-pressed") === "true";
  const show = (value) => {
    swipe.value = value;
    figure.querySelectorAll("[data-split]").forEach((button) => button.setAttribute("aria-pressed", button.dataset.split === String(value)));
    draw();
  };

  lamp.addEventListener("click", () => shine(!shines()));
  find(".reset").addEventListener("click", () => { view.reset(); draw(); });
  figure.querySelectorAll("[data-split]").forEach((button) => button.addEventListener("click", () => show(button.dataset.split)));
  swipe?.addEventListener("input", () => show(swipe.value));
  figure.querySelectorAll("[data-layer]").forEach((button) => button.addEventListener("click", () => {
    figure.querySelectorAll("[data-layer]").forEach((other) => other.setAttribute("aria-pressed", other === button));
    figure.querySelectorAll("[data-legend]").forEach((legend) => { legend.hidden = legend.dataset.legend !== button.dataset.layer; });
    view.paint(button.dataset.layer);
    draw();
  }));
  view.paint(find("[data-layer][aria-pressed=true]")?.dataset.layer);

  stage.addEventListener("pointerdown", (event) => {
    if (event.target === swipe) return;
    stage.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, event);
    const box = stage.getBoundingClientRect();
    const onEdge = swipe && Math.abs(event.clientX - box.left - (swipe.value / 100) * box.width) < 22;
    const grip = onEdge && Math.abs(event.clientY - box.top - box.height / 2) < 30;
    drag = grip ? "swipe" : event.button === 2 || event.altKey ? "move" : event.shiftKey || shines() ? "lamp" : "turn";
  });
  stage.addEventListener("pointermove", (event) => {
    const last = pointers.get(event.pointerId);
    if (!last) return;
    const [right, down] = [event.clientX - last.clientX, event.clientY - last.clientY];
    const box = stage.getBoundingClientRect(), turn = 220 / Math.min(box.width, box.height);
    if (pointers.size > 1) {
      const [other] = [...pointers.values()].filter((pointer) => pointer.pointerId !== event.pointerId);
      const apart = (pointer) => Math.hypot(pointer.clientX - other.clientX, pointer.clientY - other.clientY);
      view.move(right / 2, down / 2);
      zoom(apart(event) / Math.max(1, apart(last)));
    } else if (drag === "swipe") show(Math.min(100, Math.max(0, (100 * (event.clientX - box.left)) / box.width)));
    else if (drag === "move") view.move(right, down);
    else if (drag === "lamp") view.light(0.6 * turn * right, -0.6 * turn * down);
    else view.turn(turn * right, turn * down);
    pointers.set(event.pointerId, event);
    draw();
  });
  for (const end of ["pointerup", "pointercancel"]) stage.addEventListener(end, (event) => pointers.delete(event.pointerId));
  stage.addEventListener("contextmenu", (event) => event.preventDefault());
  // A page that is scrolled past the object is not to stop there: the wheel zooms once the object is chosen.
  stage.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && document.activeElement !== stage) return;
    event.preventDefault();
    zoom(Math.exp(-0.0015 * event.deltaY * (event.ctrlKey ? 6 : 1)));
  }, { passive: false });
  stage.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target !== stage) return;
    const ways = { ArrowLeft: [-STEP, 0], ArrowRight: [STEP, 0], ArrowUp: [0, -STEP], ArrowDown: [0, STEP] };
    const [right, down] = ways[event.key] ?? [0, 0];
    if (right || down) event.shiftKey || shines() ? view.light(right, -down) : view.turn(right, down);
    else if (event.key === "+" || event.key === "=") zoom(1.2);
    else if (event.key === "-") zoom(1 / 1.2);
    else if (event.key === "0") view.reset();
    else if (event.key.toLowerCase() === "l") shine(!shines());
    else if (event.key.toLowerCase() === "b" && swipe) show(swipe.value > 50 ? 0 : 100);
    else return;
    event.preventDefault();
    draw();
  });
  new ResizeObserver(draw).observe(stage);
  draw();
}

async function start(figure) {
  const canvas = document.createElement("canvas");
  const still = (sentence) => {
    canvas.remove();
    figure.classList.remove("live");
    figure.querySelector(".still-note").textContent = sentence;
    figure.dataset.state = "still";
  };
  if (!canvas.getContext("webgl2") || !("DecompressionStream" in window)) {
    still("This browser draws nothing in three dimensions (WebGL 2 is missing or switched off), so this is a still picture.");
    return;
  }
  const meshes = [];
  for (const mesh of JSON.parse(figure.querySelector("script").textContent)) meshes.push(await loaded(mesh, meshes[0]));
  // The context that was asked for above is of the canvas that is thrown away, so that three.js sets its own.
  const own = document.createElement("canvas");
  own.addEventListener("webglcontextlost", () => { own.remove(); still("The graphics card has dropped this picture; load the page again to turn it."); });
  figure.querySelector(".stage").prepend(own);
  figure.classList.add("live");
  figure.querySelector(".stage").tabIndex = 0;
  enliven(figure, new View(own, meshes));
  figure.dataset.state = "live";
}

document.querySelectorAll("figure.viewer").forEach((figure) => start(figure).catch((error) => {
  figure.classList.remove("live");
  figure.dataset.state = "still";
  console.error(error);
}));
