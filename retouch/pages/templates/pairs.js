"use strict";

// Sliders. Without this script the two pictures stand side by side.
const pairs = [];
const split = (value) => pairs.forEach((pair) => {
  pair.style.setProperty("--split", `${value}%`);
  pair.querySelector("input").value = value;
});
function enliven(pair) {
  const slider = document.createElement("input");
  Object.assign(slider, { type: "range", min: 0, max: 100, value: 50 });
  slider.setAttribute("aria-label", `${pair.querySelector("img").alt} left of, ${pair.dataset.second} right of`);
  slider.addEventListener("input", () => split(slider.value));
  const handle = document.createElement("i");
  pair.append(slider, handle);
  pair.classList.add("live");
  pairs.push(pair);
  const follow = (event) => {
    const box = pair.getBoundingClientRect();
    split(Math.min(100, Math.max(0, (100 * (event.clientX - box.left)) / box.width)));
  };
  pair.addEventListener("pointerdown", (event) => {
    event.preventDefault();
    slider.focus({ preventScroll: true });
    pair.setPointerCapture(event.pointerId);
    stopBlinking();
    follow(event);
  });
  pair.addEventListener("pointermove", (event) => pair.hasPointerCapture(event.pointerId) && follow(event));
}

// Blinking shows small changes that a comparison side by side hides. Readers who prefer reduced motion get
// one flip a click.
const blink = document.getElementById("blink");
const calm = matchMedia("(prefers-reduced-motion: reduce)");
let timer = 0;
let shown = 0;
const flip = () => split((shown = 100 - shown));
function stopBlinking() {
  clearInterval(timer);
  timer = 0;
  blink?.setAttribute("aria-pressed", "false");
}
function toggleBlinking() {
  if (timer) {
    stopBlinking();
    split(50);
    return;
  }
  flip();
  if (calm.matches) return;
  timer = setInterval(flip, 700);
  blink.setAttribute("aria-pressed", "true");
}
if (blink) {
  blink.parentElement.hidden = false;
  blink.addEventListener("click", toggleBlinking);
  addEventListener("keydown", (event) => {
    if (event.key.toLowerCase() === "b" && !(event.ctrlKey || event.altKey || event.metaKey)) toggleBlinking();
  });
}
document.querySelectorAll(".pair").forEach(enliven);

// A closed section cannot be opened on paper, so all are opened before printing.
addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((part) => { part.open = true; }));
