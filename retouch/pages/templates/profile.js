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
