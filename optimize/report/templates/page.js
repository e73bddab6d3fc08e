"use strict";

// Sliders. Without this script the two pictures stand side by side.
const pairs = [...document.querySelectorAll(".pair")];
const split = (value) => pairs.forEach((pair) => {
  pair.style.setProperty("--split", `${value}%`);
  pair.querySelector("input").value = value;
});
for (const pair of pairs) {
  const slider = document.createElement("input");
  Object.assign(slider, { type: "range", min: 0, max: 100, value: 50 });
  slider.setAttribute("aria-label", `${pair.querySelector("img").alt} left of, ${pair.dataset.second} right of`);
  slider.addEventListener("input", () => split(slider.value));
  const handle = document.createElement("i");
  pair.append(slider, handle);
  pair.classList.add("live");
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
  blink.setAttribute("aria-pressed", "false");
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

// Profile of one row of heights, chosen by the slider or on the pictures above.
const profile = document.getElementById("profile");
const ceiling = Number(profile.dataset.top);
const decode = (text) => new Int16Array(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
const lines = [...profile.querySelectorAll("path.row")].map((path) => ({
  path,
  values: decode(path.dataset.heights),
  ...Object.fromEntries(["rows", "cols", "size"].map((key) => [key, Number(path.dataset[key])])),
}));
const { rows, size } = lines[0];
const chooser = profile.querySelector(".chooser");
const input = chooser.querySelector("input");
const marks = [...document.querySelectorAll(".pick")].map((box) => box.appendChild(document.createElement("i")));

function draw(row) {
  input.value = row;
  const place = (row + 0.5) / rows;
  for (const line of lines) {
    const start = Math.floor(place * line.rows) * line.cols;
    const points = [];
    for (let j = 0; j < line.cols; j += 1) {
      points.push(`${(((j + 0.5) * line.size) / line.cols).toFixed(3)} ${(ceiling - line.values[start + j] / 1000).toFixed(3)}`);
    }
    line.path.setAttribute("d", `M${points.join("L")}`);
  }
  const y = size / 2 - place * size;
  chooser.querySelector("output").textContent = `y = ${y < 0 ? "\u2212" : "+"}${Math.abs(y).toFixed(2)} mm`;
  marks.forEach((mark) => { mark.style.top = `${100 * place}%`; });
}
input.addEventListener("input", () => draw(Number(input.value)));
for (const mark of marks) {
  const box = mark.parentElement;
  const pick = (event) => {
    const frame = box.getBoundingClientRect();
    draw(Math.min(rows - 1, Math.max(0, Math.floor((rows * (event.clientY - frame.top)) / frame.height))));
  };
  box.addEventListener("pointerdown", (event) => {
    event.preventDefault();
    box.setPointerCapture(event.pointerId);
    pick(event);
  });
  box.addEventListener("pointermove", (event) => box.hasPointerCapture(event.pointerId) && pick(event));
}
chooser.hidden = false;
draw(Number(input.value));

// A closed section cannot be opened on paper, so all are opened before printing.
addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((part) => { part.open = true; }));
