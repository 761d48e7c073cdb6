// A program as a ladder with the power flow of the shown cycle; one with numbers as text, or as function blocks or a chart, with the values of its scan; for an understudy its parity words, with the outputs of their masks.

import { changed } from "/address.js";
import { act, ask, toast } from "/ask.js";
import { el, keyed, setAttribute, setText, svg, valueText } from "/element.js";
import { cycleParameter, isLive, state } from "/time.js";
import { ladderLegend } from "/legend.js";
import { openWhy } from "/why.js";

let run = null;
let program = 0;
let find = "";
let names = "symbols";
let view = "text";
// Pages of rungs; a rung that was asked for is shown once.
let page = 0;
let pages = 1;
let rung = null;
let later = 0;
// Counts the choices of a person: an answer to a question from before the last one is not shown.
let choices = 0;
let asking = false;
let wanted = false;
let shown = "";
let last = 0;

// A page that shows a ladder asks for a new picture at most so often, in milliseconds.
const PAUSE = 250;

const id = (name) => document.getElementById(name);

export function prepare(facts) {
  run = facts;
  const programs = run.programs.map((item, index) => el("option", { value: index }, item.name));
  const understudies = run.stations.filter((station) => station.role === "understudy");
  const sums = understudies.map((station) => el("option", { value: `sum ${station.name}` }, `${station.name} (sum)`));
  id("view-ladder").append(
    el("div", { class: "tools" },
      el("label", {}, "Program ", el("select", { id: "ladder-program", change: choose }, programs, sums)),
      el("label", {}, "Find ", el("input", { id: "ladder-find", type: "search", input: (event) => look(event.target.value.trim()) })),
      el("label", {}, "Names ", el("select", { id: "ladder-names", change: (event) => { names = event.target.value; chosen(); } },
        el("option", { value: "symbols" }, "symbols"), el("option", { value: "addresses" }, "addresses"))),
      el("label", { id: "ladder-view-label" }, "View ", el("select", { id: "ladder-view", change: (event) => { view = event.target.value; chosen(); } },
        el("option", { value: "text" }, "text"), el("option", { value: "drawing" }, "function blocks, chart"))),
      el("label", {}, "Palette ", el("select", { id: "ladder-palette", change: (event) => palette(event.target.value) },
        el("option", { value: "understudy" }, "Understudy"), el("option", { value: "codesys" }, "CODESYS"), el("option", { value: "tia" }, "TIA"))),
    ),
    el("p", { id: "ladder-stamp", class: "stamp", role: "status" }),
    el("p", { id: "ladder-forced", class: "bad", role: "status", hidden: true }),
    el("div", { id: "ladder-legend" }, ladderLegend()),
    el("nav", { id: "ladder-pages", class: "tools", "aria-label": "Pages of rungs", hidden: true },
      el("button", { id: "page-back", type: "button", click: () => turn(-1) }, "◀ Page"),
      el("span", { id: "page-words", role: "status" }),
      el("button", { id: "page-on", type: "button", click: () => turn(1) }, "Page ▶"),
      el("label", {}, "Go to rung ", el("input", { id: "ladder-rung", type: "number", min: "1", step: "1", change: (event) => goToRung(Number(event.target.value)) }))),
    el("div", { class: "ladder-columns" },
      el("div", { id: "ladder-picture", class: "wide", tabindex: "0", role: "region", "aria-label": "Ladder" }),
      el("section", { id: "ladder-cross", class: "card", "aria-label": "Cross-reference" })),
  );
  palette(localStorage.getItem("palette") ?? "understudy");
  id("ladder-palette").value = document.documentElement.dataset.palette;
  id("ladder-picture").addEventListener("click", pick);
  id("ladder-picture").addEventListener("keydown", key);
}

function palette(name) {
  localStorage.setItem("palette", name);
  document.documentElement.dataset.palette = name;
}

// What is chosen, as an address has it.
export function selection() {
  return { program, find, names: names === "symbols" ? "" : names, view: view === "text" ? "" : view, page: page > 0 ? page + 1 : "" };
}

// Takes a choice from an address: `program` is the number of a program, or the name of an understudy.
export function select(wanted) {
  const options = [...id("ladder-program").options].map((option) => option.value);
  const name = wanted.program ?? "0";
  const value = [name, `sum ${name}`].find((known) => options.includes(known)) ?? options[0];
  id("ladder-program").value = value;
  program = programOf(value);
  find = wanted.find ?? "";
  id("ladder-find").value = find;
  names = wanted.names === "addresses" ? "addresses" : "symbols";
  id("ladder-names").value = names;
  view = wanted.view === "drawing" ? "drawing" : "text";
  id("ladder-view").value = view;
  page = Math.max(0, (Number(wanted.page) || 1) - 1);
  rung = null;
  choices += 1;
}

export function enter() {
  cross();
  refresh(true);
}

const programOf = (value) => (value.startsWith("sum ") ? value.slice(4) : Number(value));

function choose(event) {
  program = programOf(event.target.value);
  page = 0;
  rung = null;
  cross();
  chosen();
}

function look(words) {
  find = words;
  id("ladder-find").value = words;
  page = 0;
  rung = null;
  chosen();
}

function turn(by) {
  page = Math.min(Math.max(page + by, 0), pages - 1);
  rung = null;
  id("ladder-picture").scrollTop = 0;
  chosen();
}

// A rung that the search has not found is shown without the search.
function goToRung(number) {
  if (Number.isInteger(number) && number > 0) {
    find = "";
    id("ladder-find").value = "";
    rung = number;
    chosen();
  }
}

function chosen() {
  choices += 1;
  changed();
  refresh(true);
}

export function show() {
  refresh(false);
}

async function refresh(now) {
  wanted = true;
  if (asking || !state()) {
    return;
  }
  const pause = !now && isLive() ? PAUSE - (performance.now() - last) : 0;
  if (pause > 0) {
    later ||= setTimeout(() => {
      later = 0;
      if (!id("view-ladder").hidden) {
        refresh(true);
      }
    }, pause);
    return;
  }
  asking = true;
  while (wanted) {
    wanted = false;
    last = performance.now();
    if (typeof program === "number") {
      await picture();
    } else {
      sum();
    }
  }
  asking = false;
}

async function picture() {
  const before = choices;
  const place = rung === null ? `page=${page}` : `rung=${rung}`;
  const question = `api/ladder/${program}?names=${names}&view=${view}&find=${encodeURIComponent(find)}&${place}&${cycleParameter()}`;
  const answer = await act(() => ask(question));
  if (!answer || choices !== before) {
    return;
  }
  setText(id("ladder-stamp"), answer.words);
  id("ladder-legend").hidden = !answer.rungs;
  id("ladder-view-label").hidden = Boolean(answer.rungs);
  const forced = forcesOf();
  showForced(forced);
  showPages(answer.rungs);
  if (answer.lines) {
    showText(answer.lines, forced);
    return;
  }
  const key = `${JSON.stringify(forced)}${answer.svg}`;
  if (key !== shown) {
    shown = key;
    const hadFocus = id("ladder-picture").contains(document.activeElement?.closest("text.name") ?? null);
    // The server draws it from the program, and escapes every name.
    id("ladder-picture").innerHTML = answer.svg;
    mark(forced);
    reach(hadFocus);
  }
  if (rung !== null) {
    const number = [...id("ladder-picture").querySelectorAll("text.soft")].find((label) => label.textContent === String(rung));
    number?.scrollIntoView({ block: "start" });
    rung = null;
  }
}

function showPages(rungs) {
  id("ladder-pages").hidden = !rungs || rungs.pages < 2;
  if (!rungs) {
    return;
  }
  if (page !== rungs.page) {
    page = rungs.page;
    changed();
  }
  pages = rungs.pages;
  const [first, last] = rungs.shown ?? [0, 0];
  setText(id("page-words"), `rungs ${first} to ${last} of ${rungs.count}, page ${page + 1} of ${pages}`);
  id("page-back").disabled = page === 0;
  id("page-on").disabled = page === pages - 1;
  id("ladder-rung").max = rungs.count;
}

// The forced signals of the program in the shown cycle.
function forcesOf() {
  const facts = run.programs[program];
  const forces = state().programs[program]?.forced ?? [];
  return forces.flatMap(({ kind, index, value, owner, reason }) => {
    const signal = facts[`${kind}s`][index];
    return signal ? [{ name: signal.name, address: signal.address, words: `${kind} ${signal.name} = ${valueText(value, signal.type)}, forced by ${owner}: ${reason}` }] : [];
  });
}

function showForced(forced) {
  const place = id("ladder-forced");
  place.hidden = forced.length === 0;
  setText(place, forced.length === 0 ? "" : `F: ${forced.map(({ words }) => words).join("; ")}`);
}

// The name on a label, without its meaning and its value.
const nameOn = (label) => (label.firstChild?.nodeName === "title" ? label.childNodes[1] : label.firstChild)?.textContent;

// A boxed F at each place of a forced signal.
function mark(forced) {
  for (const label of id("ladder-picture").querySelectorAll("text.name")) {
    const name = nameOn(label);
    const force = forced.find((force) => force.name === name || force.address === name);
    if (!force) {
      continue;
    }
    // Behind the name in a ladder, in front of it in a drawing.
    const length = Number(label.getAttribute("textLength"));
    const left = Number(label.getAttribute("x")) + (length > 0 ? length + 1 : -16);
    const top = Number(label.getAttribute("y")) - 13;
    label.classList.add("forced");
    label.after(svg("g", { class: "forced-mark" },
      svg("title", {}, force.words),
      svg("rect", { x: left, y: top, width: 10, height: 12, rx: 2 }),
      svg("text", { x: left + 5, y: top + 9.5, "text-anchor": "middle" }, "F")));
  }
}

// A line for each line of the text; what was not executed is pale, and values are to the right of the text.
function showText(lines, forced) {
  if (shown !== "text" || !id("ladder-picture").querySelector("table.program-text")) {
    shown = "text";
    const head = el("tr", {}, ["line", "statement", "values after the scan"].map((text) => el("th", { scope: "col" }, text)));
    id("ladder-picture").replaceChildren(el("table", { class: "program-text" }, el("thead", {}, head), el("tbody")));
  }
  keyed(
    id("ladder-picture").querySelector("tbody"),
    lines,
    (line) => `${program}:${line.line}`,
    (line) => el("tr", {}, el("th", { scope: "row" }, String(line.file_line ?? "")), el("td", {}, el("code")), el("td", { class: "values" })),
    (row, line) => {
      setAttribute(row, "data-executed", line.failed ? "failed" : String(line.executed));
      setText(row.querySelector("code"), line.text);
      keyed(
        row.querySelector(".values"),
        line.values,
        ({ name }) => name,
        ({ name }) => el("button", { type: "button", class: "link", click: () => askWhy(name) }),
        (button, { name, value, type }) => {
          const force = forced.find((force) => force.name.toLowerCase() === name.toLowerCase());
          setText(button, `${name} = ${typeof value === "boolean" ? String(value).toUpperCase() : valueText(value, type)}${force ? " F" : ""}`);
          button.classList.toggle("forced", Boolean(force));
          setAttribute(button, "title", force?.words ?? "");
        },
      );
    },
  );
}

// Names are reached by keyboard: Tab comes to one of them, and the arrow keys come to the others.
let reached = 0;

const isInput = (name) => run.programs[program].inputs.some((input) => input.name === name || input.address === name);

function reach(hadFocus) {
  if (typeof program !== "number") {
    return;
  }
  const labels = [...id("ladder-picture").querySelectorAll("text.name")].filter((label) => !isInput(nameOn(label)));
  reached = Math.min(reached, Math.max(labels.length - 1, 0));
  labels.forEach((label, place) => {
    label.setAttribute("tabindex", place === reached ? "0" : "-1");
    label.setAttribute("role", "button");
    label.setAttribute("aria-label", `Why ${nameOn(label)}?`);
  });
  if (hadFocus) {
    labels[reached]?.focus({ preventScroll: true });
  }
}

function key(event) {
  const label = event.target.closest?.("text.name");
  const by = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
  if (!label || !(by || event.key === "Enter" || event.key === " ")) {
    return;
  }
  event.preventDefault();
  // The arrow keys step through the cycles elsewhere.
  event.stopPropagation();
  if (!by) {
    pick(event);
    return;
  }
  const labels = [...id("ladder-picture").querySelectorAll("text.name[tabindex]")];
  reached = (labels.indexOf(label) + by + labels.length) % labels.length;
  labels.forEach((other, place) => other.setAttribute("tabindex", place === reached ? "0" : "-1"));
  labels[reached].focus();
}

function askWhy(name) {
  const index = run.programs[program].outputs.findIndex((output) => output.name.toLowerCase() === name.toLowerCase() || output.address === name);
  openWhy(program, index >= 0 ? index : name);
}

// A click on the name of an output or of a memory bit asks why; in a drawing, on that of any variable.
function pick(event) {
  const label = event.target.closest?.("text.name");
  if (!label || typeof program !== "number") {
    return;
  }
  const name = nameOn(label);
  if (isInput(name) && id("ladder-view-label").hidden) {
    toast(`${name} is an input: its remote I/O samples it`);
    return;
  }
  askWhy(name);
}

async function cross() {
  const place = id("ladder-cross");
  if (typeof program !== "number") {
    place.replaceChildren();
    place.hidden = true;
    return;
  }
  place.hidden = false;
  const answer = await act(() => ask(`api/cross-reference/${program}`));
  if (!answer) {
    return;
  }
  const numbers = (list) => list.map((place) => String(place + 1));
  const rungs = (list) => (answer.place === "rung" ? numbers(list).flatMap((number) => [el("button", { class: "link", type: "button", "aria-label": `Rung ${number}`, click: () => goToRung(Number(number)) }, number), " "]) : numbers(list).join(", "));
  const row = (signal) =>
    el("tr", {},
      el("th", { scope: "row" }, el("button", { class: "link", type: "button", click: () => look(signal.name) }, signal.name)),
      el("td", {}, signal.address ?? ""), el("td", {}, rungs(signal.written)), el("td", {}, rungs(signal.read)), el("td", { class: "soft" }, signal.description ?? ""));
  const head = ["signal", "address", `written in ${answer.place}`, `read in ${answer.place}`, "meaning"];
  place.replaceChildren(el("h2", {}, "Cross-reference"),
    el("div", { class: "wide", tabindex: "0", role: "region", "aria-label": "Cross-reference table" },
      el("table", {}, el("thead", {}, el("tr", {}, head.map((text) => el("th", { scope: "col" }, text)))), el("tbody", {}, answer.signals.map(row)))));
}

const sumOf = (word) => word.mask.join(" ⊕ ");

// y(N+1), element by element, with the outputs that it is the sum of.
function sum() {
  const now = state();
  showForced([]);
  showPages(null);
  const members = run.programs;
  const station = now.members.find((member) => member.name === program);
  const width = Math.max(...members.map((item) => item.outputs.length));
  const words = station?.parity_words ?? [];
  const areBits = members.every((item) => item.outputs.every((output) => output.type === "BOOL"));
  const column = (item, place) => {
    const output = item.outputs[place];
    const value = now.programs[item.index].published_values?.[place];
    return el("td", {}, output ? `${output.name} = ${valueText(value, output.type)}` : "");
  };
  const rows = [...Array(width).keys()].map((place) =>
    el("tr", {}, el("th", { scope: "row" }, `y${place + 1}`), members.map((item) => column(item, place)), words.map((word) => el("td", { class: "sum" }, areBits ? (word.sum[place] ?? "") : ""))));
  // A sum of numbers has no value of its own: its bits stand in one line.
  if (!areBits) {
    rows.push(el("tr", {}, el("th", { scope: "row" }, "bits"), members.map(() => el("td")), words.map((word) => el("td", { class: "sum" }, el("code", {}, word.sum)))));
  }
  const published = words.length === 0 ? "published no parity word" : `published ${words.map((word) => `the sum of ${sumOf(word)}`).join(" and ")}`;
  setText(id("ladder-stamp"), `cycle ${now.cycle}: ${program} ${published}`);
  shown = "";
  const heads = ["element", ...members.map((item) => item.name), ...words.map((word) => `parity word ${sumOf(word)}`)];
  id("ladder-picture").replaceChildren(
    el("table", {}, el("thead", {}, el("tr", {}, heads.map((head) => el("th", { scope: "col" }, head)))), el("tbody", {}, rows)));
}
