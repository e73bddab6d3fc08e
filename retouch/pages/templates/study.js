
// Sorting. A click on a heading sorts by the values of its column, a second click the other way.
function sortBy(heading) {
  const table = heading.closest("table");
  const descending = heading.getAttribute("aria-sort") === "ascending";
  const place = [...heading.parentElement.children].indexOf(heading);
  const value = (row) => row.children[place]?.dataset.value ?? "";
  const body = table.tBodies[0];
  body.querySelectorAll("tr.opened").forEach(closed);
  const rows = [...body.rows];
  rows.sort((one, other) => {
    const [first, second] = [value(one), value(other)];
    if ((first === "") !== (second === "")) return first === "" ? 1 : -1;
    const [a, b] = [Number(first), Number(second)];
    const order = Number.isNaN(a) || Number.isNaN(b) ? first.localeCompare(second) : a - b;
    return descending ? -order : order;
  });
  table.querySelectorAll("th[aria-sort]").forEach((other) => other.setAttribute("aria-sort", "none"));
  heading.setAttribute("aria-sort", descending ? "descending" : "ascending");
  body.append(...rows);
  rows.forEach((row) => row.querySelector("button")?.setAttribute("aria-expanded", "false"));
}
for (const heading of document.querySelectorAll("table.rows th[aria-sort]")) {
  heading.querySelector("button").addEventListener("click", () => sortBy(heading));
}

// Rows. A click opens a row: its pictures, which lie in its run directory, its plates, and every number.
const details = JSON.parse(document.getElementById("details").textContent);
const make = (name, properties, ...children) => {
  const element = Object.assign(document.createElement(name), properties);
  element.append(...children);
  return element;
};
function pictures(row) {
  return row.pictures.map((name) => {
    const side = (when) => make("div", { className: "side" },
      make("img", { src: `${row.folder}/renders/${encodeURIComponent(name)}-${when}.png`, alt: `${name}, ${when}` }),
      make("span", { className: "tag", textContent: when }));
    const pair = make("div", { className: "pair" }, side("before"), side("after"));
    pair.dataset.second = "after";
    enliven(pair);
    return make("figure", {}, make("figcaption", { className: "name", textContent: name }), pair);
  });
}
const plates = JSON.parse(document.getElementById("plates").textContent);
function underALamp(key) {
  const plate = plates.rows[key];
  if (!plate || !PlateFigures.able) return [];
  const figure = document.getElementById("plate-figure").content.firstElementChild.cloneNode(true);
  figure.querySelector(".note").textContent = plate.note;
  // It is drawn once it stands in the page.
  setTimeout(() => {
    PlateFigures.instead(() => {
      figure.plateView?.destroy();
      figure.remove();
    });
    PlateFigures.start(figure, { ...plate, ...plates.options, heights: plate.heights.map((place) => plates.fields[place]) });
  });
  return [figure];
}
function closed(details) {
  if (details.querySelector(".plate-figure")) PlateFigures.instead(() => {});
  details.remove();
}
function opened(row, columns, key) {
  const content = make("div", { className: "details" });
  if (row.pictures.length) content.append(make("div", { className: "lights" }, ...pictures(row)));
  else content.append(make("p", { className: "aside", textContent: "The run directory of this row is not beside the page, so there are no pictures." }));
  content.append(...underALamp(key));
  const numbers = Object.entries(row.numbers).map(([key, value]) =>
    make("tr", {}, make("th", { scope: "row", textContent: key }), make("td", { textContent: value })));
  content.append(make("details", {}, make("summary", { textContent: "All numbers of this row" }),
    make("div", { className: "scroll" }, make("table", { className: "record" }, make("tbody", {}, ...numbers)))));
  return make("tr", { className: "opened" }, make("td", { colSpan: columns }, content));
}
for (const row of document.querySelectorAll("table.rows tbody tr[data-key]")) {
  const button = row.querySelector("button");
  row.addEventListener("click", (event) => {
    if (event.target.closest("a")) return;
    const open = button.getAttribute("aria-expanded") === "true";
    button.setAttribute("aria-expanded", String(!open));
    if (open) closed(row.nextElementSibling);
    else row.after(opened(details[row.dataset.key], row.children.length, row.dataset.key));
  });
}
