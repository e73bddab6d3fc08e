// The experiment: a menu of people and questions, then one trial after the other. Each trial has two screens:
// the first names the plates to lay out, the second asks and names none.
const plan = JSON.parse(document.getElementById("plan").textContent);
const stage = document.getElementById("stage");
const KEY = `retouch-experiment-${plan.digest}`;
const ASKED = {
  rougher: { name: "Which is rougher?", ask: "Which plate feels rougher?", first: "the first", second: "the second" },
  colder: { name: "Which is colder?", ask: "Which plate feels colder?", first: "the first", second: "the second" },
  same: { name: "Same or different? (by sight)", ask: "Do the two plates look like the same texture?", first: "same", second: "different" },
  sorts: { name: "Sorting", ask: "Sort the plates from the smoothest to the roughest." },
  magnitudes: { name: "How rough?", ask: "How rough is the plate? Any number above 0; twice as rough, twice the number." },
};
const questions = Object.keys(ASKED).filter((question) => question in plan.trials);
const LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ".split("");

let kept = {};
try {
  kept = JSON.parse(localStorage.getItem(KEY) ?? "{}");
  localStorage.setItem(KEY, JSON.stringify(kept));
} catch (error) {
  document.getElementById("storage").hidden = false;
}
function keep() {
  try {
    localStorage.setItem(KEY, JSON.stringify(kept));
  } catch (error) {
    document.getElementById("storage").hidden = false;
  }
}

const make = (name, properties = {}, ...children) => {
  const element = Object.assign(document.createElement(name), properties);
  element.append(...children);
  return element;
};
const answersOf = (person, question) => ((kept[person] ??= {})[question] ??= []);

// CSV, as the tables of the plan beside this page.
const cell = (value) => /[",\r\n]/.test(value) ? `"${String(value).replaceAll('"', '""')}"` : String(value);
function rowsOf(question, person) {
  return answersOf(person, question).flatMap((answer, index) => {
    const labels = plan.trials[question][person][index].map((place) => plan.labels[place]);
    const begin = [person, index + 1];
    if (question === "sorts") {
      const name = `trial ${index + 1}`;
      return answer.map((place, order) => [...begin, name, order + 1, plan.labels[place]]);
    }
    if (question === "magnitudes") return [[...begin, ...labels, answer]];
    const told = question === "same" ? (answer === 0 ? "yes" : "no") : labels[answer];
    return [[...begin, ...labels, told]];
  });
}
function csvOf(question) {
  const [person, ...others] = plan.headings[question];
  const rows = plan.people.flatMap((name) => rowsOf(question, name));
  if (!rows.length) return "";
  return [[person, "trial", ...others], ...rows].map((row) => row.map(cell).join(",")).join("\r\n") + "\r\n";
}
function save() {
  for (const question of questions) {
    const text = csvOf(question);
    if (!text) continue;
    const address = URL.createObjectURL(new Blob([text], { type: "text/csv" }));
    make("a", { href: address, download: `answers-${question}.csv` }).click();
    setTimeout(() => URL.revokeObjectURL(address), 10000);
  }
}

// The screen and what its keys do.
let press = () => {};
function show(keys, ...children) {
  stage.replaceChildren(...children);
  press = keys;
  (stage.querySelector("input, button.next") ?? stage.querySelector("button"))?.focus();
}
document.addEventListener("keydown", (event) => {
  if (!event.ctrlKey && !event.altKey && !event.metaKey && !event.repeat) press(event);
});
const button = (text, act, more = {}) => make("button", { type: "button", textContent: text, onclick: act, ...more });

function menu() {
  const table = make("table", { className: "menu" });
  table.append(make("thead", {}, make("tr", {}, make("th", { scope: "col", textContent: "person" }),
    ...questions.map((question) => make("th", { scope: "col", textContent: ASKED[question].name })))));
  const body = table.createTBody();
  for (const person of plan.people) {
    const row = body.insertRow();
    row.append(make("th", { scope: "row", textContent: person }));
    for (const question of questions) {
      const done = answersOf(person, question).length;
      const all = plan.trials[question][person].length;
      const state = done === all ? "done" : `${done} of ${all}`;
      const label = `${person}: ${ASKED[question].name} ${state}`;
      const start = button(state, () => trial(person, question), { ariaLabel: label });
      if (done && done < all) start.classList.add("next");
      row.append(make("td", {}, start));
    }
  }
  const buttons = () => [...stage.querySelectorAll("button")];
  show((event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1, ArrowDown: questions.length, ArrowUp: -questions.length }[event.key];
    const each = buttons();
    const now = each.indexOf(document.activeElement);
    if (step && now >= 0) {
      event.preventDefault();
      each[Math.min(each.length - 1, Math.max(0, now + step))].focus();
    }
    if (event.key.toLowerCase() === "s") save();
  }, make("p", { textContent: "Choose a person and a question with the arrow keys, and press Enter. S saves all answers." }),
  make("div", { className: "scroll sideways" }, table), make("p", {}, button("Save all answers (S)", save)));
}

function heading(person, question, index) {
  const all = plan.trials[question][person].length;
  const bar = make("progress", { max: all, value: index, ariaLabel: "trials done" });
  return make("p", { className: "where" }, `${person} · ${ASKED[question].name} · trial ${index + 1} of ${all}`, bar);
}

function trial(person, question) {
  const answers = answersOf(person, question);
  const trials = plan.trials[question][person];
  const index = answers.length;
  if (index >= trials.length) return finished(person, question);
  const places = trials[index];
  const label = (place) => plan.labels[place];
  const what = question === "sorts"
    ? make("ol", { className: "row" }, ...places.map((place, k) => make("li", {}, make("b", { textContent: LETTERS[k % 26] }), ` ${label(place)}`)))
    : make("ol", { className: "lay" }, ...places.map((place, k) => make("li", {},
      make("small", { textContent: places.length > 1 ? ["first", "second"][k] : "the plate" }), make("b", { textContent: label(place) }))));
  const words = question === "sorts" ? "Lay these plates out in this order:" : places.length > 1 ? "Lay these two plates out:" : "Lay this plate out:";
  const on = () => ask(person, question);
  show((event) => {
    if (event.key === "Escape") return menu();
    if (event.key === "Backspace") { event.preventDefault(); return back(person, question); }
  }, heading(person, question, index), make("p", { textContent: words }), what,
  make("p", {}, button("Ready (Enter)", on, { className: "next" })));
}

function back(person, question) {
  const answers = answersOf(person, question);
  if (answers.length) {
    answers.pop();
    keep();
  }
  trial(person, question);
}

function take(person, question, answer) {
  answersOf(person, question).push(answer);
  keep();
  trial(person, question);
}

function ask(person, question) {
  const places = plan.trials[question][person][answersOf(person, question).length];
  const asked = ASKED[question];
  const head = heading(person, question, answersOf(person, question).length);
  const words = make("p", { className: "ask", textContent: asked.ask });
  if (asked.first) {
    const choose = (k) => () => take(person, question, k);
    show((event) => {
      if (["1", "ArrowLeft"].includes(event.key)) return take(person, question, 0);
      if (["2", "ArrowRight"].includes(event.key)) return take(person, question, 1);
      if (["Backspace", "Escape"].includes(event.key)) { event.preventDefault(); trial(person, question); }
    }, head, words, make("p", { className: "choice" },
      button(`1  ${asked.first}`, choose(0)), button(`2  ${asked.second}`, choose(1))));
    document.activeElement.blur();
    return;
  }
  const input = make("input", { autocomplete: "off", spellcheck: false, inputMode: question === "sorts" ? "text" : "decimal", ariaLabel: asked.ask });
  const fault = make("p", { className: "fault", role: "alert" });
  const accept = () => {
    const answer = question === "sorts" ? sorted(input.value, places) : rated(input.value);
    if (answer === null) {
      fault.textContent = question === "sorts"
        ? `Type each letter from A to ${LETTERS[places.length - 1]} once, the smoothest first.` : "A number above 0, please.";
      return;
    }
    take(person, question, answer);
  };
  const hint = question === "sorts" ? `The letters A to ${LETTERS[places.length - 1]}, the smoothest first; then Enter:` : "The number, then Enter:";
  show((event) => {
    if (event.key === "Enter") { event.preventDefault(); accept(); }
    if (event.key === "Escape" || (event.key === "Backspace" && !input.value)) { event.preventDefault(); trial(person, question); }
  }, head, words, make("p", { textContent: hint }), make("p", {}, input), fault);
}

function sorted(text, places) {
  const order = [...text.toUpperCase()].filter((letter) => /[A-Z]/.test(letter)).map((letter) => LETTERS.indexOf(letter));
  const whole = order.length === places.length && new Set(order).size === places.length && Math.max(...order) < places.length;
  return whole ? order.map((k) => places[k]) : null;
}

function rated(text) {
  const number = Number(text.trim().replace(",", "."));
  return text.trim() && Number.isFinite(number) && number > 0 ? number : null;
}

function finished(person, question) {
  show((event) => {
    if (event.key.toLowerCase() === "s") save();
    if (event.key === "Escape") menu();
    if (event.key === "Backspace") { event.preventDefault(); back(person, question); }
  }, make("p", { className: "ask", textContent: "Thank you. All trials are done." }),
  make("p", {}, button("Back to the list (Enter)", menu, { className: "next" }), button("Save all answers (S)", save)));
}

menu();
