// A program as a ladder with the power flow of the shown cycle, or as text with the values after its scan; for an understudy its parity words, with the outputs of their masks.

import { act, ask } from "/ask.js";
import { el, keyed, setAttribute, setText, valueText } from "/element.js";
import { cycleParameter, isLive, state } from "/time.js";
import { ladderLegend } from "/legend.js";
import { openWhy } from "/why.js";

let run = null;
let program = 0;
let find = "";
let names = "symbols";
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
      el("label", {}, "Find ", el("input", { id: "ladder-find", type: "search", input: (event) => { find = event.target.value.trim(); refresh(true); } })),
      el("label", {}, "Names ", el("select", { id: "ladder-names", change: (event) => { names = event.target.value; refresh(true); } },
        el("option", { value: "symbols" }, "symbols"), el("option", { value: "addresses" }, "addresses"))),
      el("label", {}, "Palette ", el("select", { id: "ladder-palette", change: (event) => palette(event.target.value) },
        el("option", { value: "understudy" }, "Understudy"), el("option", { value: "codesys" }, "CODESYS"), el("option", { value: "tia" }, "TIA"))),
    ),
    el("p", { id: "ladder-stamp", class: "stamp", role: "status" }),
    el("div", { id: "ladder-legend" }, ladderLegend()),
    el("div", { class: "ladder-columns" },
      el("div", { id: "ladder-picture", class: "wide", tabindex: "0", role: "region", "aria-label": "Ladder" }),
      el("section", { id: "ladder-cross", class: "card", "aria-label": "Cross-reference" })),
  );
  palette(localStorage.getItem("palette") ?? "understudy");
  id("ladder-palette").value = document.documentElement.dataset.palette;
  id("ladder-picture").addEventListener("click", pick);
}

function palette(name) {
  localStorage.setItem("palette", name);
  document.documentElement.dataset.palette = name;
}

// `#ladder/PROGRAM/SIGNAL` opens a program, and finds a signal in it.
export function enter([number, signal]) {
  if (number !== undefined) {
    program = Math.min(Number(number) || 0, run.programs.length - 1);
    find = signal ?? "";
    id("ladder-program").value = String(program);
    id("ladder-find").value = find;
  }
  cross();
  refresh(true);
}

function choose(event) {
  const { value } = event.target;
  program = value.startsWith("sum ") ? value.slice(4) : Number(value);
  cross();
  refresh(true);
}

export function show() {
  refresh(false);
}

async function refresh(now) {
  wanted = true;
  if (asking || (!now && isLive() && performance.now() - last < PAUSE)) {
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
  const question = `/api/ladder/${program}?names=${names}&find=${encodeURIComponent(find)}&${cycleParameter()}`;
  const answer = await act(() => ask(question));
  if (!answer || typeof program !== "number") {
    return;
  }
  setText(id("ladder-stamp"), answer.words);
  id("ladder-legend").hidden = Boolean(answer.lines);
  if (answer.lines) {
    showText(answer.lines);
  } else if (answer.svg !== shown) {
    shown = answer.svg;
    // The server draws it from the program, and escapes every name.
    id("ladder-picture").innerHTML = answer.svg;
  }
}

// A line for each line of the text; what was not executed is pale, and values are to the right of the text.
function showText(lines) {
  if (shown !== "text" || !id("ladder-picture").querySelector("table.program-text")) {
    shown = "text";
    const head = el("tr", {}, ["line", "statement", "values after the scan"].map((text) => el("th", { scope: "col" }, text)));
    id("ladder-picture").replaceChildren(el("table", { class: "program-text" }, el("thead", {}, head), el("tbody")));
  }
  keyed(
    id("ladder-picture").querySelector("tbody"),
    lines,
    (line) => `${program}:${line.line}`,
    (line) => el("tr", {}, el("th", { scope: "row" }, String(line.line)), el("td", {}, el("code")), el("td", { class: "values" })),
    (row, line) => {
      setAttribute(row, "data-executed", line.failed ? "failed" : String(line.executed));
      setText(row.querySelector("code"), line.text);
      keyed(
        row.querySelector(".values"),
        line.values,
        ([name]) => name,
        ([name]) => el("button", { type: "button", class: "link", click: () => askWhy(name) }),
        (button, [name, value]) => setText(button, `${name} = ${typeof value === "boolean" ? String(value).toUpperCase() : valueText(value)}`),
      );
    },
  );
}

function askWhy(name) {
  const index = run.programs[program].outputs.findIndex((output) => output.name.toLowerCase() === name.toLowerCase());
  openWhy(program, index >= 0 ? index : name);
}

// A click on the name of an output asks why.
function pick(event) {
  const label = event.target.closest?.("text.name");
  if (!label || typeof program !== "number") {
    return;
  }
  const name = label.firstChild?.nodeName === "title" ? label.childNodes[1]?.textContent : label.firstChild?.textContent;
  const { outputs } = run.programs[program];
  const index = outputs.findIndex((output) => output.name === name || output.address === name);
  if (index >= 0) {
    openWhy(program, index);
  }
}

async function cross() {
  const place = id("ladder-cross");
  if (typeof program !== "number") {
    place.replaceChildren();
    place.hidden = true;
    return;
  }
  place.hidden = false;
  const answer = await act(() => ask(`/api/cross-reference/${program}`));
  if (!answer) {
    return;
  }
  const rungs = (list) => list.map((rung) => rung + 1).join(", ");
  const row = (signal) =>
    el("tr", {},
      el("th", { scope: "row" }, el("button", { class: "link", type: "button", click: () => { find = signal.name; id("ladder-find").value = find; refresh(true); } }, signal.name)),
      el("td", {}, signal.address ?? ""), el("td", {}, rungs(signal.written)), el("td", {}, rungs(signal.read)), el("td", { class: "soft" }, signal.comment ?? ""));
  const head = ["signal", "address", `written in ${answer.place}`, `read in ${answer.place}`, "meaning"];
  place.replaceChildren(el("h2", {}, "Cross-reference"),
    el("div", { class: "wide", tabindex: "0", role: "region", "aria-label": "Cross-reference table" },
      el("table", {}, el("thead", {}, el("tr", {}, head.map((text) => el("th", { scope: "col" }, text)))), el("tbody", {}, answer.signals.map(row)))));
}

const sumOf = (word) => word.mask.join(" ⊕ ");

// y(N+1), element by element, with the outputs that it is the sum of.
function sum() {
  const now = state();
  const members = run.programs;
  const station = now.members.find((member) => member.name === program);
  const width = Math.max(...members.map((item) => item.outputs.length));
  const words = station?.parity_words ?? [];
  const areBits = members.every((item) => item.outputs.every((output) => output.type === "BOOL"));
  const column = (item, place) => {
    const output = item.outputs[place];
    const value = now.programs[item.index].published_values?.[place];
    return el("td", {}, output ? `${output.name} = ${valueText(value)}` : "");
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
