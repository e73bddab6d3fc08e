// The answers of the experiment. Each answer, and each answer that is taken back, is an act, which has a number in
// the book of its person and question. An act is written once and never changed: twice in this browser, and to disk
// where `retouch answers --serve` serves the page. So copies are merged by union, and windows keep one another's acts.
const plan = JSON.parse(document.getElementById("plan").textContent);
const NAME = "retouch-experiment";
const GROUP = "-"; // stands in the place of a person for acts of the group: tables that were saved, its begin
const MOST_SENT = 200; // acts of one request
const FULL = "The storage of this browser is full, or its window is private";
const BROKEN = "This browser keeps nothing for this page: its storage is switched off, private or broken";
const books = Object.create(null); // acts by "digest/group/person/question" and number
const faults = {}; // sentences for the person, by place
let group = "0";
let folder = ""; // of the server; empty where nothing but the browser keeps answers
let waiting = []; // acts that the server has not written yet
let sending = false;

const prefixOf = (person, question) => `${plan.digest}/${group}/${person}/${question}`;
const bookOf = (person, question) => (books[prefixOf(person, question)] ??= []);
const isAct = (act) => typeof act?.key === "string" && Number.isInteger(act.trial) && Array.isArray(act.rows);

// Acts of a book that are answers and were not taken back, by trial; the first answer to a trial counts.
function standing(book) {
  const answers = [];
  for (const act of Object.values(book)) {
    if (act.answer === null) delete answers[act.trial];
    else answers[act.trial] ??= act;
  }
  return answers;
}
const answersOf = (person, question) => standing(bookOf(person, question));
const doneOf = (person, question) => Object.keys(answersOf(person, question)).length;
const nextOf = (person, question) => {
  const answers = answersOf(person, question);
  return plan.trials[question][person].findIndex((_, trial) => !(trial in answers));
};

// CSV, as the tables of the plan beside this page.
const cell = (value) => /[",\r\n]/.test(value) ? `"${String(value).replaceAll('"', '""')}"` : String(value);
function rowsOf(person, question, trial, answer) {
  if (answer === null) return [];
  const labels = plan.trials[question][person][trial].map((place) => plan.labels[place]);
  const begin = [person, trial + 1];
  if (question === "sorts") return answer.map((place, order) => [...begin, `trial ${trial + 1}`, order + 1, plan.labels[place]]);
  if (question === "magnitudes") return [[...begin, ...labels, answer]];
  return [[...begin, ...labels, question === "same" ? (answer === 0 ? "yes" : "no") : labels[answer]]];
}
function csv(question, answers) {
  const [person, ...others] = plan.headings[question] ?? ["person"];
  const rows = answers.flatMap((act) => act.rows);
  return rows.length ? [[person, "trial", ...others], ...rows].map((row) => row.map(cell).join(",")).join("\r\n") + "\r\n" : "";
}
const csvOf = (question) => csv(question, plan.people.flatMap((person) => answersOf(person, question)));

function download(name, text) {
  if (!text) return;
  const address = URL.createObjectURL(new Blob([text], { type: "text/csv" }));
  Object.assign(document.createElement("a"), { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 10000);
}
const actsOf = (question) => plan.people.reduce((sum, person) => sum + bookOf(person, question).length, 0);
const unsaved = (question) => (!folder || waiting.length > 0)
  && actsOf(question) > Math.max(0, ...Object.values(bookOf(GROUP, question)).map((act) => act.trial));
function save(question) {
  download(`answers-${question}.csv`, csvOf(question));
  if (unsaved(question)) keep(GROUP, question, actsOf(question), null);
}

// Sentences on what went wrong.
function complain() {
  const reason = folder && !faults.server ? "" : faults.database ?? faults.local;
  const lost = faults.database && faults.local ? "answers are lost when the page is closed" : "answers are kept once, not twice";
  const lines = [faults.window, faults.server, faults.damaged, reason && `${reason}: ${lost}. Save them (S).`];
  const line = document.getElementById("storage");
  line.textContent = lines.filter(Boolean).join(" ");
  line.hidden = !line.textContent;
}
function failed(place, error) {
  faults[place] = error?.name === "QuotaExceededError" ? FULL : BROKEN;
  complain();
}
async function overtaken() {
  faults.window = "Another window has gone on here: its answers are shown, and the last answer of this window was not taken.";
  await load();
  redraw();
}

// The copies in this browser. A database that does not open is given up, as some private windows never answer.
const database = new Promise((done, fail) => {
  setTimeout(fail, 10000, new Error("no answer"));
  const opening = indexedDB.open(NAME, 1);
  opening.onupgradeneeded = () => opening.result.createObjectStore("acts", { keyPath: "key" });
  opening.onsuccess = () => done(opening.result);
  opening.onerror = () => fail(opening.error);
});
const transact = async (mode, work) => {
  const transaction = (await database).transaction("acts", mode, { durability: "strict" });
  const request = work(transaction.objectStore("acts"));
  // A page that is left at once ends what is not committed.
  transaction.commit();
  return new Promise((done, fail) => {
    transaction.oncomplete = () => done(request.result);
    transaction.onabort = () => fail(request.error ?? transaction.error);
  });
};
function parsed(text) {
  try { return JSON.parse(text); } catch { return null; }
}
const localTexts = (separator) => Object.entries(localStorage).filter(([key]) => key.startsWith(NAME + separator));

async function readServer() {
  if (location.protocol === "file:") return [];
  const answer = await fetch("acts").catch(() => null);
  if (!answer?.ok) return [];
  const there = await answer.json();
  if (there.digest !== plan.digest) location.reload();
  ({ group, folder } = there);
  return there.acts.map(([person, question, number, trial, answer]) => (
    { key: `${NAME}/${prefixOf(person, question)}/${number}`, trial, answer, rows: rowsOf(person, question, trial, answer) }));
}

// Puts all copies together; where two differ under one number, the server's counts first, then the database's.
async function load() {
  const inDatabase = await transact("readonly", (acts) => acts.getAll()).catch((error) => { failed("database", error); return []; });
  const onServer = await readServer();
  let inLocal = [];
  try { inLocal = localTexts("/").map(([, text]) => parsed(text)); } catch (error) { failed("local", error); }
  for (const act of [...inLocal, ...inDatabase, ...onServer]) {
    const [, prefix, number] = (isAct(act) && act.key.match(/^[^/]+\/(.+)\/(\d+)$/)) || [];
    if (prefix) (books[prefix] ??= [])[number] = act;
    else faults.damaged = "Some of what this browser kept is damaged and was left out.";
  }
  const groups = Object.keys(books).map((prefix) => prefix.split("/")).filter(([digest]) => digest === plan.digest);
  if (!folder) group = groups.map(([, name]) => name).sort().at(-1) ?? "0";
  const written = new Set(onServer.map((act) => act.key));
  const own = plan.people.flatMap((person) => questions.flatMap((question) => Object.values(bookOf(person, question))));
  waiting = folder ? own.filter((act) => !written.has(act.key)) : [];
  send();
  complain();
}

function keep(person, question, trial, answer) {
  const key = `${NAME}/${prefixOf(person, question)}/${bookOf(person, question).length}`;
  const act = { key, trial, answer, rows: rowsOf(person, question, trial, answer) };
  try {
    if (isAct(parsed(localStorage.getItem(key)))) return overtaken();
    localStorage.setItem(key, JSON.stringify(act));
  } catch (error) { failed("local", error); }
  bookOf(person, question).push(act);
  if (folder && person !== GROUP) {
    waiting.push(act);
    send();
  }
  return transact("readwrite", (acts) => acts.add(act))
    .catch((error) => (error?.name === "ConstraintError" ? overtaken() : failed("database", error)));
}

async function post(to, content) {
  const body = JSON.stringify({ digest: plan.digest, group, ...content });
  const answer = await fetch(to, { method: "POST", keepalive: true, body });
  if (!answer.ok && answer.status !== 409) throw new Error(await answer.text());
  return answer.ok;
}
async function send() {
  if (sending || !waiting.length) return;
  sending = true;
  const batch = waiting.slice(0, MOST_SENT);
  const named = batch.map(({ key, trial, answer }) => [...key.split("/").slice(3, 5), Number(key.split("/")[5]), trial, answer]);
  try {
    const taken = await post("acts", { acts: named });
    faults.server = "";
    if (taken) waiting = waiting.filter((act) => !batch.includes(act));
    else await overtaken();
    setTimeout(send);
  } catch (error) {
    faults.server = `The server did not write the last answers (${error.message}); they are in this browser until it does.`;
    setTimeout(send, 5000);
  }
  sending = false;
  complain();
}

// Answers of other plans and of earlier groups that this browser keeps: name and text of each table.
function earlier() {
  const tables = {};
  for (const prefix of Object.keys(books).sort()) {
    const [digest, name, person, question] = prefix.split("/");
    const answers = Object.values(standing(books[prefix]));
    if (person === GROUP || !answers.length || (digest === plan.digest && name === group)) continue;
    (tables[`answers-${question}-${digest}-${name.replaceAll(/\W/g, "")}.csv`] ??= [question]).push(...answers);
  }
  const found = Object.entries(tables).map(([name, [question, ...answers]]) => [name, csv(question, answers), answers.length]);
  // Pages of former versions kept all answers of a plan under one key, without labels.
  try {
    for (const [key, text] of localTexts("-")) found.push([`${key}.json`, text, (text.match(/\d+(?=[,\]])/g) ?? []).length]);
  } catch (error) { failed("local", error); }
  return found.filter(([, , count]) => count);
}

async function anew() {
  if (waiting.length || !confirm("Save the tables and begin anew? The answers so far stay kept, as those of an earlier group.")) return;
  questions.forEach(save);
  const now = new Date().toISOString();
  try {
    if (folder) await post("group", {});
    else group = now > group ? now : `${group}0`;
    await keep(GROUP, "begun", 0, null);
    await load();
  } catch (error) {
    faults.server = `The server did not begin anew (${error.message}).`;
    complain();
  }
  menu();
}
addEventListener("storage", async ({ key }) => {
  if (!key?.startsWith(`${NAME}/${plan.digest}/`)) return;
  await load();
  if (redraw === menu) menu();
});
addEventListener("beforeunload", (event) => {
  if (questions.some(unsaved)) event.preventDefault();
});
