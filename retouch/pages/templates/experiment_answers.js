// The answers of the experiment. Each answer, and each answer that is taken back, is an act, which has a number in
// the book of its person and question. An act is written once and never changed: twice in this browser, and to disk
// where `retouch answers --serve` serves the page. So copies are merged by union, and windows keep one another's acts.
const plan = JSON.parse(document.getElementById("plan").textContent);
const NAME = "retouch-experiment";
const GROUP = "-"; // stands in the place of a person for acts of the group: its begin, and tables that were saved
const MOST_SENT = 200; // acts of one request
const books = Object.create(null); // acts by "digest/group/person/question" and number
const faults = {}; // sentences for the person, by kind
let group = "0";
let folder = ""; // of the server; empty where nothing but the browser keeps answers
let written = new Set(); // keys of acts that the server has on disk
let sending = false;

const ownPrefix = () => `${plan.digest}/${group}/`;
const bookOf = (person, question) => (books[`${ownPrefix()}${person}/${question}`] ??= []);
const isAct = (act) => typeof act?.key === "string" && Number.isInteger(act.trial) && act.rows?.every?.(Array.isArray);
function parsed(text) {
  try { return JSON.parse(text); } catch { return null; }
}

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
function nextOf(person, question) {
  const answers = answersOf(person, question);
  return plan.trials[question][person].findIndex((_, trial) => !(trial in answers));
}

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
  const [person, ...others] = plan.headings[question];
  const rows = [[person, "trial", ...others], ...answers.flatMap((act) => act.rows)];
  return answers.length ? rows.map((row) => row.map(cell).join(",")).join("\r\n") + "\r\n" : "";
}
const csvOf = (question) => csv(question, plan.people.flatMap((person) => Object.values(answersOf(person, question))));
function download(name, text) {
  if (!text) return;
  const address = URL.createObjectURL(new Blob([text], { type: "text/csv" }));
  Object.assign(document.createElement("a"), { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 10000);
}

// The act of a saved table has the number of acts before it in the place of a trial.
const actsOf = (question) => plan.people.flatMap((person) => Object.values(bookOf(person, question))).length;
const unsaved = (question) => (!folder || waiting().length > 0)
  && actsOf(question) > Math.max(0, ...Object.values(bookOf(GROUP, question)).map((act) => act.trial));
function save(question) {
  download(`answers-${question}.csv`, csvOf(question));
  if (unsaved(question)) keep(GROUP, question, actsOf(question), null);
}

function complain(kind, sentence) {
  faults[kind] = sentence;
  const line = document.getElementById("storage");
  line.textContent = Object.values(faults).filter(Boolean).join(" ");
  line.hidden = !line.textContent;
}
function notKept(error) {
  const reason = error?.name === "QuotaExceededError" ? "full, or its window is private" : "switched off, private or broken";
  if (!folder) complain("storage", `The storage of this browser is ${reason}. Save the answers (S) before you close the page.`);
}
async function overtaken() {
  complain("window", "Another window has gone on here: its answers are shown, and the last answer of this window was not taken.");
  await load();
  redraw();
}

// A database that does not open is given up, as those of some private windows never answer.
const database = new Promise((done, fail) => {
  setTimeout(fail, 10000);
  const opening = indexedDB.open(NAME, 1);
  opening.onupgradeneeded = () => opening.result.createObjectStore("acts", { keyPath: "key" });
  opening.onsuccess = () => done(opening.result);
  opening.onerror = () => fail(opening.error);
});
async function transact(mode, work) {
  const transaction = (await database).transaction("acts", mode, { durability: "strict" });
  const request = work(transaction.objectStore("acts"));
  transaction.commit(); // A page that is left at once gives up what is not committed.
  return new Promise((done, fail) => {
    transaction.oncomplete = () => done(request.result);
    transaction.onabort = () => fail(request.error ?? transaction.error);
  });
}
const localTexts = (separator) => Object.entries(localStorage).filter(([key]) => key.startsWith(NAME + separator));

async function readServer() {
  const answer = location.protocol === "file:" ? null : await fetch(`acts${location.search}`).catch(() => null);
  if (!answer?.ok) return [];
  const there = await answer.json();
  if (there.digest !== plan.digest) location.reload();
  ({ group, folder } = there);
  const acts = there.acts.map(([person, question, number, trial, answer]) => (
    { key: `${NAME}/${ownPrefix()}${person}/${question}/${number}`, trial, answer, rows: rowsOf(person, question, trial, answer) }));
  written = new Set(acts.map((act) => act.key));
  return acts;
}

// Puts all copies together; where two differ under one number, the server's counts first, then the database's.
async function load() {
  const onServer = await readServer();
  const inDatabase = await transact("readonly", (acts) => acts.getAll()).catch((error) => { notKept(error); return []; });
  let inLocal = [];
  try { inLocal = localTexts("/").map(([, text]) => parsed(text)); } catch (error) { notKept(error); }
  for (const act of [...inLocal, ...inDatabase, ...onServer]) {
    const [, prefix, number] = (isAct(act) && act.key.match(/^[^/]+\/(.+)\/(\d+)$/)) || [];
    if (prefix) (books[prefix] ??= [])[number] = act;
    else complain("damage", "Some of what this browser kept is damaged and was left out.");
  }
  const groups = Object.keys(books).map((prefix) => prefix.split("/")).filter(([digest]) => digest === plan.digest);
  if (!folder) group = groups.map(([, name]) => name).sort().at(-1) ?? "0";
  send();
}

function keep(person, question, trial, answer) {
  const book = bookOf(person, question);
  const act = { key: `${NAME}/${ownPrefix()}${person}/${question}/${book.length}`, trial, answer, rows: rowsOf(person, question, trial, answer) };
  try {
    if (isAct(parsed(localStorage.getItem(act.key)))) return overtaken();
    localStorage.setItem(act.key, JSON.stringify(act));
  } catch (error) { notKept(error); }
  book.push(act);
  send();
  const all = Object.values(books).flat();
  return transact("readwrite", (acts) => acts.add(act))
    .then(() => transact("readonly", (acts) => acts.count()))
    // Somebody has cleared what the browser keeps of this page, which still has all of it.
    .then((count) => count < all.length && transact("readwrite", (acts) => all.map((one) => acts.put(one)).at(-1)))
    .catch((error) => (error?.name === "ConstraintError" ? overtaken() : notKept(error)));
}

// Acts that are not on the disk of the server yet.
const waiting = () => (folder ? Object.values(books).flat() : []).filter(({ key }) => (
  key.startsWith(`${NAME}/${ownPrefix()}`) && key.split("/")[3] !== GROUP && !written.has(key)));
async function post(content) {
  const body = JSON.stringify({ digest: plan.digest, group, ...content });
  const answer = await fetch(`acts${location.search}`, { method: "POST", keepalive: true, body });
  if (answer.status === 409) await overtaken();
  else if (!answer.ok) complain("server", `The server says: ${await answer.text()}`);
  return answer.status;
}
async function send() {
  const batch = waiting().slice(0, MOST_SENT);
  if (sending || !batch.length) return;
  sending = true;
  const named = batch.map(({ key, trial, answer }) => [...key.split("/").slice(3, 5), Number(key.split("/")[5]), trial, answer]);
  const status = await post({ acts: named }).catch(() => 0);
  // What the server takes for no answer (400) is not sent again.
  if ([200, 400].includes(status)) batch.forEach(({ key }) => written.add(key));
  if (status === 200) complain("server", "");
  if (!status) complain("server", "The server does not answer; the last answers are in this browser alone. Run retouch answers SET --serve again.");
  sending = false;
  setTimeout(send, status === 200 ? 0 : 5000);
}

// Answers of other plans and of earlier groups that this browser keeps: name, text and number of each table.
function earlier() {
  const tables = {};
  for (const prefix of Object.keys(books).filter((prefix) => !prefix.startsWith(ownPrefix())).sort()) {
    const [digest, name, person, question] = prefix.split("/");
    if (person !== GROUP && question in plan.headings) (tables[`answers-${question}-${digest}-${name.replaceAll(/\W/g, "")}.csv`] ??= [question]).push(...Object.values(standing(books[prefix])));
  }
  const found = Object.entries(tables).map(([name, [question, ...answers]]) => [name, csv(question, answers), answers.length]);
  // Pages of former versions kept all answers of a plan under one key, without labels.
  try {
    for (const [key, text] of localTexts("-")) found.push([`${key}.json`, text, (text.match(/\d+(?=[,\]])/g) ?? []).length]);
  } catch (error) { notKept(error); }
  return found.filter(([, , count]) => count);
}

async function anew() {
  if (waiting().length || !confirm("Save the tables and begin anew? The answers so far stay kept, as those of an earlier group.")) return;
  questions.forEach(save);
  const now = new Date().toISOString();
  if (folder) await post({ begin: true }).catch(() => complain("server", "The server does not answer."));
  else {
    group = now > group ? now : `${group}0`;
    await keep(GROUP, "begun", 0, null);
  }
  await load();
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
