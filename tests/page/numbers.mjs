// Looks at programs with numbers of the example heated-tank, as text and as function blocks, takes pictures, and fails where something is not as it has to be.
//
//   node tests/page/numbers.mjs http://127.0.0.1:7480/ PICTURES [AXE.min.js]

import { accessible, change, click, evaluate, more, open, picture, problems, run, scheme, size, text, until } from "./chromium.mjs";

const [axe] = more;

const shown = `fetch("/api/state").then((answer) => answer.json()).then((state) => state.cycle)`;

// The names and values that a drawing shows.
const labels = `[...document.querySelectorAll("#ladder-picture svg text")].map((label) => label.textContent)`;

async function textView() {
  await open("ladder?program=0");
  await until("its text", `document.querySelectorAll(".program-text tbody tr").length > 3`);
  await until("a statement that was executed", `document.querySelector('.program-text tr[data-executed="true"]') !== null`);
  await until("a real value", `/= -?\\d+\\.\\d/.test(${text(".program-text .values")} + document.querySelector(".program-text").textContent)`);
  // The program has the name of its input, which no line assigns.
  const uses = `fetch("/api/cross-reference/0").then((answer) => answer.json()).then(({ signals }) => signals.find(({ name }) => name === "level"))`;
  const level = await evaluate(uses);
  if (level.written.length !== 0 || level.read.length !== 3) {
    problems.push(`the cross-reference of level is ${JSON.stringify(level)}`);
  }
  await picture("numbers-text");
  await accessible("text", axe);
}

async function declarations() {
  await open("ladder?program=1");
  await until("the text of the other program", `document.querySelector(".program-text")?.textContent.includes("recipe : ARRAY")`);
  // Only declared names have values in a declaration: no type, and no part of an initial value.
  const line = (words) => `[...document.querySelectorAll(".program-text tbody tr")].find((row) => row.querySelector("code").textContent.includes(${JSON.stringify(words)})).querySelector(".values").textContent`;
  const beside = await evaluate(`[${line("recipe : ARRAY")}, ${line("temperature := 30.0")}, ${line("current : INT")}]`);
  if (beside[0] !== "" || beside[1] !== "" || !/^current = \d$/.test(beside[2])) {
    problems.push(`the values beside declarations are ${JSON.stringify(beside)}`);
  }
  // A TIME has its units, as in the terminal.
  await open("ladder?program=1&why=1/holding.PT@60");
  await until("a reason with a time", `/holding\\.PT = [1245]+s\\b/.test(document.querySelector("#why").textContent)`);
  await click("#why button");
  await open("ladder?program=0");
}

async function drawing() {
  await change("#ladder-view", "drawing");
  await until("a drawing", `document.querySelector("#ladder-picture svg") !== null && document.querySelector(".program-text") === null`);
  await until("values in it", `${labels}.some((words) => /-?\\d+\\.\\d/.test(words))`);
  await until("its address", `location.hash.includes("view=drawing")`);
  await picture("numbers-drawing");
  await accessible("drawing", axe);
  const before = await evaluate(`${labels}.join()`);
  await until("values that change", `${labels}.join() !== ${JSON.stringify(before)}`);
  await evaluate(`document.querySelector("#ladder-picture svg text.name").dispatchEvent(new MouseEvent("click", { bubbles: true }))`);
  await until("the reason", `document.querySelector("#why")?.textContent.length > 40 || location.hash.includes("why=")`);
  await picture("numbers-why");
}

// Values have the decimals and the unit of their cards, and numbers no lamp.
async function cards() {
  const value = (name) => `[...document.querySelectorAll(".signal")].find((row) => row.querySelector(".signal-name").textContent === ${JSON.stringify(name)})`;
  await open("cluster");
  await until("a value with its unit", `/^\\d+\\.\\d °C$/.test(${value("temperature")}?.querySelector(".signal-value").textContent ?? "")`);
  const lamps = await evaluate(`["temperature", "drain"].map((name) => [...document.querySelectorAll(".signal")].find((row) => row.querySelector(".signal-name").textContent === name).querySelectorAll(".lamp").length)`);
  if (lamps.join() !== "0,1") {
    problems.push(`the lamps of a number and a BOOL are ${lamps}`);
  }
  await open("watch?signals=1.input.0,0.output.1");
  await until("its unit in the table", `[...document.querySelectorAll(".watch-value")].some((cell) => cell.textContent.endsWith("°C"))`);
}

// Two numbers in one lane, each on a scale of its side, with the ranges of their cards.
async function scales() {
  await open("trends?signals=0.input.0,1.input.0,0.output.1&scales=0.input.0:left,1.input.0:right&span=100");
  await until("values with their units", `[...document.querySelectorAll(".u-legend .u-value")].some((value) => value.textContent.endsWith("°C"))`);
  const chosen = await evaluate(`[...document.querySelectorAll("#trend-scales select")].map((choice) => choice.value).join()`);
  if (chosen !== "left,right") {
    problems.push(`the scales are ${chosen}`);
  }
  const shared = await evaluate(`document.querySelector("#trend-plot .u-over").getBoundingClientRect().width`);
  await picture("numbers-scales");
  await accessible("scales", axe);
  await change('#trend-scales select[data-signal="1.input.0"]', "own");
  await until("its address without it", `!location.hash.includes("right") && location.hash.includes("0.input.0:left")`);
  await until("no scale at the right", `document.querySelector("#trend-plot .u-over").getBoundingClientRect().width > ${shared}`);
}

async function drive() {
  await evaluate("localStorage.setItem('tour', 'seen'), document.querySelector('[data-tour=skip]')?.click()");
  await scheme("light");
  await size(1360, 1000, false);
  await until("some cycles", `${shown}.then((cycle) => cycle > 60)`);
  await textView();
  await declarations();
  await drawing();
  await change("#ladder-view", "text");
  await until("the text again", `document.querySelectorAll(".program-text tbody tr").length > 3`);
  await cards();
  await scales();
}

run(drive);
