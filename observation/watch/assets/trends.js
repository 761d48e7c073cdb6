// Trends of chosen signals over the cycles, with sources and faults as bands behind them.

import { act, ask } from "/ask.js";
import { el, setText, shorten, valueText } from "/element.js";
import { goTo, state } from "/time.js";
import { bandPlugin } from "/bands.js";
import { bandLegend } from "/legend.js";

let run = null;
let plot = null;
let chosen = [];
let span = 500;
let asking = false;
let drawn = "";

const MAXIMUM_SIGNALS = 16;

const id = (name) => document.getElementById(name);

export function prepare(facts) {
  run = facts;
  const groups = run.programs.map((program) =>
    el("fieldset", {}, el("legend", {}, program.name),
      ["inputs", "outputs"].flatMap((kind) => program[kind].map((signal, index) => box(program, kind.slice(0, -1), signal, index)))));
  chosen = run.programs.flatMap((program) => program.outputs.slice(0, 2).map((_, index) => `${program.index}.output.${index}`)).slice(0, 6);
  id("view-trends").append(
    el("div", { class: "tools" },
      el("label", {}, "Length in cycles ", el("select", { id: "trend-span", change: (event) => { span = Number(event.target.value); refresh(); } },
        [100, 500, 2000, 10000].map((count) => el("option", { value: count, selected: count === span }, String(count))))),
      el("span", { id: "trend-words", class: "soft", role: "status" })),
    el("div", { id: "trend-plot", class: "plot", role: "img", "aria-label": "Trends of the chosen signals" }),
    bandLegend(),
    el("details", { class: "chooser" }, el("summary", {}, "Signals"), groups));
  for (const input of document.querySelectorAll("#view-trends input[type=checkbox]")) {
    input.checked = chosen.includes(input.value);
  }
  addEventListener("resize", redraw);
  addEventListener("theme", redraw);
}

function box(program, kind, signal, index) {
  const change = (event) => {
    chosen = chosen.filter((other) => other !== event.target.value);
    if (event.target.checked && chosen.length < MAXIMUM_SIGNALS) {
      chosen.push(event.target.value);
    }
    event.target.checked = chosen.includes(event.target.value);
    refresh();
  };
  return el("label", { class: "choice" }, el("input", { type: "checkbox", value: `${program.index}.${kind}.${index}`, change }), " ", signal.name);
}

export function enter() {
  drawn = "";
}

export function show() {
  refresh();
}

function redraw() {
  drawn = "";
  if (state()) {
    refresh();
  }
}

async function refresh() {
  const now = state();
  const to = Math.max(now.cycle, now.oldest);
  const from = Math.max(now.oldest, to - span + 1);
  const question = `signals=${chosen.join(",")}&from=${from}&to=${to}`;
  if (asking || question === drawn || id("view-trends").hidden) {
    return;
  }
  asking = true;
  drawn = question;
  const answer = await act(() => ask(`/api/trends?${question}`));
  asking = false;
  if (answer) {
    draw(answer);
  }
}

// Height of a lane of numbers, as a multiple of a lane of a BOOL.
const HIGH = 4;

// Each signal has a lane of its own, the first on top. A BOOL is at the bottom of it where it is 0 and above where it is 1; a number lies between its
// least and its greatest value, which the axis shows.
function lanesOf(signals) {
  const types = new Map(run.programs.flatMap((program) => ["input", "output"].flatMap((kind) => program[`${kind}s`].map((signal, index) => [`${program.index}.${kind}.${index}`, signal.type]))));
  let base = 0;
  const lanes = signals.map((signal, index) => {
    const isNumber = (types.get(chosen[index]) ?? "BOOL") !== "BOOL";
    const known = signal.runs.map(([, value]) => value).filter((value) => value !== null);
    const low = known.reduce((least, value) => Math.min(least, value), Infinity);
    const high = known.reduce((most, value) => Math.max(most, value), -Infinity);
    return { name: signal.name, isNumber, height: isNumber ? HIGH : 1, low: Number.isFinite(low) ? low : 0, high: Number.isFinite(high) ? high : 0 };
  });
  for (const lane of [...lanes].reverse()) {
    lane.base = base;
    base += lane.height;
  }
  return lanes;
}

// Where a value lies: a number that does not change in the middle of its lane.
function heightOf(lane, value) {
  if (!lane.isNumber) {
    return lane.base + 0.7 * value;
  }
  const share = lane.high > lane.low ? (value - lane.low) / (lane.high - lane.low) : 0.5;
  return lane.base + 0.2 + share * (lane.height - 0.7);
}

// Labels of a lane: the name, and the least and the greatest value.
function labelsOf(lane) {
  if (!lane.isNumber) {
    return [[lane.base + 0.35, shorten(lane.name, 18)]];
  }
  const name = [lane.base + lane.height / 2 - 0.15, shorten(lane.name, 18)];
  return lane.high > lane.low ? [[heightOf(lane, lane.low), valueText(lane.low)], name, [heightOf(lane, lane.high), valueText(lane.high)]] : [name];
}

function draw(answer) {
  const lanes = lanesOf(answer.signals);
  const height = lanes.reduce((sum, lane) => sum + lane.height, 0);
  const labels = lanes.flatMap(labelsOf).sort(([one], [other]) => one - other);
  const marks = new Set([answer.from, answer.to]);
  for (const signal of answer.signals) {
    for (const [cycle] of signal.runs) {
      marks.add(cycle);
    }
  }
  const cycles = [...marks].sort((a, b) => a - b);
  const values = answer.signals.map((signal) => sampled(signal.runs, cycles));
  const rows = values.map((row, index) => row.map((value) => (value === null ? null : heightOf(lanes[index], value))));
  const place = id("trend-plot");
  const dark = getComputedStyle(document.documentElement);
  const color = (name) => dark.getPropertyValue(name).trim();
  const series = answer.signals.map((signal, index) => ({
    label: signal.name,
    stroke: color(`--series-${index % 6}`),
    width: 2,
    paths: uPlot.paths.stepped({ align: 1 }),
    points: { show: false },
    value: (_, __, ___, at) => (at === null ? "" : valueText(values[index][at])),
  }));
  const bandRows = answer.sources.length;
  const axis = { stroke: color("--ink"), grid: { stroke: color("--line"), width: 1 }, ticks: { stroke: color("--line") } };
  const options = {
    width: place.clientWidth,
    height: Math.max(220, 26 * height + 18 * bandRows + 110),
    scales: { x: { time: false }, y: { range: [-0.3 - bandRows * 0.7, Math.max(height, 1)] } },
    axes: [
      { ...axis, label: "cycle", labelSize: 20, values: (_, values) => values.map((value) => (Number.isInteger(value) ? String(value) : "")) },
      { ...axis, size: 130, splits: () => labels.map(([at]) => at), values: () => labels.map(([, text]) => text), grid: { show: false } },
    ],
    series: [{ label: "cycle", value: (_, value) => (value === null ? "" : String(value)) }, ...series],
    plugins: [bandPlugin(answer, color)],
    cursor: { drag: { x: false, y: false }, bind: { dblclick: () => null } },
  };
  plot?.destroy();
  plot = new uPlot(options, [cycles, ...rows], place);
  plot.over.addEventListener("click", () => {
    if (plot.cursor.left >= 0) {
      goTo(plot.posToVal(plot.cursor.left, "x"));
    }
  });
  const seconds = ((answer.to - answer.from + 1) * run.period_us) / 1e6;
  setText(id("trend-words"), `cycles ${answer.from} to ${answer.to}, ${seconds.toFixed(1)} s; a click goes to the cycle`);
}

// The value of a run-length coded signal at each mark.
function sampled(runs, cycles) {
  let at = -1;
  return cycles.map((cycle) => {
    while (at + 1 < runs.length && runs[at + 1][0] <= cycle) {
      at += 1;
    }
    return at < 0 ? null : runs[at][1];
  });
}
