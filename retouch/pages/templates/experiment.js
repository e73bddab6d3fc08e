// The experiment: a menu of people and questions, then one trial after the other. Each trial has two screens:
// the first names the plates to lay out, the second asks and names none.
const stage = document.getElementById("stage");
const ASKED = {
  rougher: { name: "Which is rougher?", ask: "Which plate feels rougher?", first: "the first", second: "the second" },
  colder: { name: "Which is colder?", ask: "Which plate feels colder?", first: "the first", second: "the second" },
  same: { name: "Same or different? (by sight)", ask: "Do the two plates look like the same texture?", first: "same", second: "different" },
  sorts: { name: "Sorting", ask: "Sort the plates from the smoothest to the roughest." },
  magnitudes: { name: "How rough?", ask: "How rough is the plate? Any number above 0; twice as rough, twice the number." },
};
const questions = Object.keys(ASKED).filter((question) => question in plan.trials);
const LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ".split("");

const make = (name, properties = {}, ...children) => {
  const element = Object.assign(document.createElement(name), properties);
  element.append(...children);
  return element;
};

// The screen and what its keys do.
let press = () => {};
let redraw = menu;
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
  redraw = menu;
  const other = earlier();
  const kept = plan.people.flatMap((person) => questions.flatMap((question) => Object.values(answersOf(person, question)))).length;
  const saveAll = () => questions.forEach(save);
  const saveEarlier = () => other.forEach(([name, text]) => download(name, text));
  const table = make("table", { className: "menu" });
  table.append(make("thead", {}, make("tr", {}, make("th", { scope: "col", textContent: "person" }),
    ...questions.map((question) => make("th", { scope: "col", textContent: ASKED[question].name })))));
  const body = table.createTBody();
  for (const person of plan.people) {
    const row = body.insertRow();
    row.append(make("th", { scope: "row", textContent: person }));
    for (const question of questions) {
      const done = doneOf(person, question);
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
    ({ s: saveAll, e: saveEarlier, n: anew })[event.key.toLowerCase()]?.();
  }, make("p", { textContent: "Choose a person and a question with the arrow keys, and press Enter." }),
  make("p", { className: "kept", textContent: `Answers kept in ${folder || "this browser"}: ${kept}` }),
  make("div", { className: "scroll sideways" }, table),
  make("p", {}, button("Save all answers (S)", saveAll), ...(kept ? [button("Begin anew for the next group (N)", anew)] : [])),
  ...(other.length ? [make("p", { className: "kept", textContent: `Answers of other plans or earlier groups in this browser: ${other.reduce((sum, table) => sum + table[2], 0)}` }),
    make("p", {}, button("Save these (E)", saveEarlier))] : []));
}

function heading(person, question, index) {
  const all = plan.trials[question][person].length;
  const bar = make("progress", { max: all, value: index, ariaLabel: "trials done" });
  return make("p", { className: "where" }, `${person} · ${ASKED[question].name} · trial ${index + 1} of ${all}`, bar);
}

function trial(person, question) {
  redraw = () => trial(person, question);
  const index = nextOf(person, question);
  if (index < 0) return finished(person, question);
  const places = plan.trials[question][person][index];
  const label = (place) => plan.labels[place];
  const what = question === "sorts"
    ? make("ol", { className: "row" }, ...places.map((place, k) => make("li", {}, make("b", { textContent: LETTERS[k % 26] }), ` ${label(place)}`)))
    : make("ol", { className: "lay" }, ...places.map((place, k) => make("li", {},
      make("small", { textContent: places.length > 1 ? ["first", "second"][k] : "the plate" }), make("b", { textContent: label(place) }))));
  const words = question === "sorts" ? "Lay these plates out in this order:" : places.length > 1 ? "Lay these two plates out:" : "Lay this plate out:";
  const on = () => ask(person, question, index);
  show((event) => {
    if (event.key === "Escape") return menu();
    if (event.key === "Backspace") { event.preventDefault(); return back(person, question); }
  }, heading(person, question, index), make("p", { textContent: words }), what,
  make("p", {}, button("Ready (Enter)", on, { className: "next" })));
}

function back(person, question) {
  const last = Object.values(answersOf(person, question)).at(-1);
  if (last) keep(person, question, last.trial, null);
  trial(person, question);
}

function take(person, question, index, answer) {
  // Another window may have answered this trial while it was on the screen.
  if (nextOf(person, question) !== index) return overtaken();
  complain("window", "");
  keep(person, question, index, answer);
  trial(person, question);
}

function ask(person, question, index) {
  const places = plan.trials[question][person][index];
  const asked = ASKED[question];
  const head = heading(person, question, index);
  const words = make("p", { className: "ask", textContent: asked.ask });
  if (asked.first) {
    const choose = (k) => () => take(person, question, index, k);
    show((event) => {
      if (["1", "ArrowLeft"].includes(event.key)) return take(person, question, index, 0);
      if (["2", "ArrowRight"].includes(event.key)) return take(person, question, index, 1);
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
        ? `Type each letter from A to ${LETTERS[places.length - 1]} once, the smoothest first.` : "A plain number above 0, such as 2.5 or 1000, without separators of thousands, please.";
      return;
    }
    take(person, question, index, answer);
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

// A group of three digits behind a comma or a point may be thousands, so it counts as neither.
function rated(text) {
  const typed = text.trim();
  const number = /^(\d+|\d*[.,]\d+)$/.test(typed) && !/^[1-9]\d{0,2}[.,]\d{3}$/.test(typed) ? Number(typed.replace(",", ".")) : 0;
  return number > 0 && number < 1e100 ? number : null;
}

function finished(person, question) {
  const saving = () => { save(question); trial(person, question); };
  const open = unsaved(question) && (!folder || faults.server);
  const file = `answers-${question}.csv`;
  const place = open ? `The answers are in this browser alone: press Enter to save ${file}.` : folder ? `The answers are in ${folder}/${file}.` : `The answers are saved as ${file}.`;
  const buttons = [button("Back to the list (Escape)", menu), button("Save the table (S)", saving)];
  if (open) buttons.reverse();
  buttons[0].classList.add("next");
  show((event) => {
    if (event.key.toLowerCase() === "s") saving();
    if (event.key === "Escape") menu();
    if (event.key === "Backspace") { event.preventDefault(); back(person, question); }
  }, make("p", { className: "ask", textContent: "Thank you. All trials are done." }),
  make("p", { className: "kept", textContent: place }),
  make("p", {}, ...buttons));
}

const ready = load().then(menu);
