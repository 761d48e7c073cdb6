// Trends of chosen signals over the cycles, with sources and faults as bands behind them.

import { changed } from "/address.js";
import { act, ask, toast } from "/ask.js";
import { csvOf, reader, saveCsv, savePng } from "/download.js";
import { el, setText, shorten, valueText } from "/element.js";
import { keep, kept } from "/kept.js";
import { chooser, find, load } from "/signals.js";
import { goTo, isLive, state } from "/time.js";
import { bandPlugin } from "/bands.js";
import { bandLegend } from "/legend.js";
import { clock, clockAndZone, timeOf } from "/zone.js";

let run = null;
let plot = null;
let choice = null;
let chosen = [];
let span = 500;
// The first and the last cycle, where they do not follow the newest cycle.
let zoom = null;
let answer = null;
let asking = false;
let again = false;
let drawn = "";
let last = 0;
let later = 0;
// A range is being dragged: the plot stays as it is.
let dragging = false;
let dragged = false;

const MAXIMUM_SIGNALS = 16;
const MAXIMUM_SPAN = 10_000;
const LEAST_SPAN = 5;
const SPANS = [100, 500, 2000, MAXIMUM_SPAN];

// A live page asks at most so often, in milliseconds.
const PAUSE = 400;

const id = (name) => document.getElementById(name);

export function prepare(facts) {
  run = facts;
  chosen = run.programs.flatMap((program) => program.outputs.slice(0, 2).map((_, index) => `${program.index}.output.${index}`)).slice(0, 6);
  apply(kept("trends") ?? {});
  choice = chooser("trend", (signal) => chosen.includes(signal), toggle);
  const button = (name, words, click) => el("button", { id: `trend-${name}`, type: "button", click }, words);
  id("view-trends").append(
    el("div", { class: "tools" },
      el("label", {}, "Length in cycles ", el("select", { id: "trend-span", change: (event) => { span = Number(event.target.value); zoom = null; picked(); } },
        SPANS.map((count) => el("option", { value: count }, String(count))))),
      el("span", { class: "chips", role: "group", "aria-label": "Zoom" }, button("in", "Zoom in", () => scale(0.5)), button("out", "Zoom out", () => scale(2)), button("earlier", "Earlier", () => pan(-0.5)), button("later", "Later", () => pan(0.5)), button("all", "No zoom", unzoom)),
      el("span", { class: "chips", role: "group", "aria-label": "Save" }, button("csv", "Save CSV", csv), button("png", "Save PNG", png))),
    el("p", { id: "trend-words", class: "stamp soft", role: "status" }),
    el("div", { id: "trend-plot", class: "plot", tabindex: "0", role: "group", "aria-label": "Trends of the chosen signals; plus and minus zoom, 0 ends it", keydown: key }),
    bandLegend(),
    choice.element);
  addEventListener("resize", redraw);
  addEventListener("theme", redraw);
  addEventListener("zone", redraw);
  addEventListener("pointerup", () => setTimeout(() => { dragging = false; }));
  addEventListener("pointercancel", () => { dragging = false; });
}

// What is chosen, as an address has it.
export function selection() {
  return { signals: chosen.join(","), span, from: zoom?.from, to: zoom?.to };
}

export function select(wanted) {
  apply(wanted);
  choice.show();
}

function apply(wanted) {
  if (wanted.signals !== undefined) {
    chosen = wanted.signals.split(",").filter(Boolean).slice(0, MAXIMUM_SIGNALS);
  }
  span = SPANS.find((known) => known === Number(wanted.span)) ?? span;
  const [from, to] = [Number(wanted.from), Number(wanted.to)];
  const isRange = wanted.from !== undefined && Number.isInteger(from) && Number.isInteger(to) && from < to && to - from < MAXIMUM_SPAN;
  zoom = isRange ? { from, to } : null;
}

function toggle(signal) {
  const without = chosen.filter((other) => other !== signal);
  if (without.length === chosen.length && chosen.length === MAXIMUM_SIGNALS) {
    toast(`A trend has at most ${MAXIMUM_SIGNALS} signals.`);
    return;
  }
  chosen = without.length < chosen.length ? without : [...chosen, signal];
  picked();
}

// A person has chosen.
function picked() {
  keep("trends", { signals: chosen.join(","), span });
  changed();
  refresh(true);
}

export async function enter() {
  drawn = "";
  // What this run does not have is left out.
  if (await load()) {
    chosen = chosen.filter(find);
  }
  id("trend-span").value = String(span);
  choice.show();
  refresh(true);
}

export function show() {
  refresh(false);
}

function redraw() {
  drawn = "";
  refresh(true);
}

// The cycles that are shown. They follow the newest cycle; of a chosen one they stay as they are while they have it.
function range() {
  const now = state();
  if (zoom) {
    return zoom;
  }
  const has = answer && answer.from <= now.cycle && now.cycle <= answer.to && answer.to - answer.from < span;
  if (!isLive() && has) {
    return answer;
  }
  const to = Math.max(isLive() ? now.cycle : Math.min(now.newest, now.cycle + Math.floor(span / 2)), now.oldest);
  return { from: Math.max(now.oldest, to - span + 1), to };
}

// Zooms around the shown cycle, or around the middle.
function scale(factor) {
  const { from, to } = range();
  const length = Math.min(Math.max(Math.round((to - from) * factor), LEAST_SPAN), MAXIMUM_SPAN - 1);
  const { cycle } = state();
  const middle = !isLive() && from <= cycle && cycle <= to ? cycle : Math.round((from + to) / 2);
  zoomTo(middle - Math.floor(length / 2), length);
}

function pan(share) {
  const { from, to } = range();
  zoomTo(from + Math.round((to - from) * share), to - from);
}

function zoomTo(from, length) {
  const { oldest, newest } = state();
  const first = Math.max(Math.min(from, newest - length), oldest);
  zoom = { from: first, to: Math.max(Math.min(first + length, newest), first + 1) };
  changed();
  refresh(true);
}

function unzoom() {
  zoom = null;
  answer = null;
  changed();
  refresh(true);
}

function key(event) {
  const act = { "+": () => scale(0.5), "=": () => scale(0.5), "-": () => scale(2), 0: unzoom }[event.key];
  if (act && !event.ctrlKey && !event.altKey && !event.metaKey) {
    event.preventDefault();
    act();
  }
}

async function refresh(now) {
  if (!state() || dragging || id("view-trends").hidden) {
    return;
  }
  if (!chosen.every(find)) {
    if (!now) {
      enter();
    }
    return;
  }
  const { from, to } = range();
  const question = `signals=${encodeURIComponent(chosen.join(","))}&from=${from}&to=${to}`;
  if (question === drawn) {
    point();
    return;
  }
  if (asking) {
    again = true;
    return;
  }
  const pause = !now && isLive() ? PAUSE - (performance.now() - last) : 0;
  if (pause > 0) {
    later ||= setTimeout(() => {
      later = 0;
      refresh(true);
    }, pause);
    return;
  }
  asking = true;
  last = performance.now();
  drawn = question;
  const ids = [...chosen];
  const found = await act(() => ask(`api/trends?${question}`));
  asking = false;
  if (found && !dragging) {
    answer = { ...found, ids };
    draw();
  } else {
    drawn = "";
  }
  if (again) {
    again = false;
    refresh(false);
  }
}

const atOf = (cycle) => timeOf(answer.times, cycle, run.period_us);

const nameOfFile = () => `${run.cluster}-trends-${answer.from}-${answer.to}`;

function csv() {
  if (answer) {
    const unit = (index) => (find(answer.ids[index])?.type === "TIME" ? " in ns" : "");
    saveCsv(nameOfFile(), csvOf(answer, (signal, index) => `${signal.name}${unit(index)}`, run.period_us, atOf));
    toast(`saved ${nameOfFile()}.csv`);
  }
}

async function png() {
  if (answer && plot) {
    const color = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
    await savePng(nameOfFile(), plot.ctx.canvas, `${run.title}, cycles ${answer.from} to ${answer.to}`, color("--card"), color("--ink"));
    toast(`saved ${nameOfFile()}.png`);
  }
}

// Height of a lane of numbers, as a multiple of a lane of a BOOL.
const HIGH = 4;

// Each signal has a lane of its own, the first on top. A BOOL is at the bottom of it where it is 0 and above where it is 1; a number lies between its
// least and its greatest value, which the axis shows.
function lanesOf(signals) {
  let base = 0;
  const lanes = signals.map((signal, index) => {
    const type = find(answer.ids[index])?.type ?? "BOOL";
    const isNumber = type !== "BOOL";
    const known = signal.runs.map(([, value]) => value).filter((value) => value !== null);
    const low = known.reduce((least, value) => Math.min(least, value), Infinity);
    const high = known.reduce((most, value) => Math.max(most, value), -Infinity);
    return { name: signal.name, type, isNumber, height: isNumber ? HIGH : 1, low: Number.isFinite(low) ? low : 0, high: Number.isFinite(high) ? high : 0 };
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
  return lane.high > lane.low ? [[heightOf(lane, lane.low), valueText(lane.low, lane.type)], name, [heightOf(lane, lane.high), valueText(lane.high, lane.type)]] : [name];
}

function draw() {
  const lanes = lanesOf(answer.signals);
  const height = lanes.reduce((sum, lane) => sum + lane.height, 0);
  const labels = lanes.flatMap(labelsOf).sort(([one], [other]) => one - other);
  // A point for each cycle, so that the values at the cursor are those of its cycle.
  const cycles = Array.from({ length: answer.to - answer.from + 1 }, (_, place) => answer.from + place);
  const values = answer.signals.map((signal) => cycles.map(reader(signal.runs)));
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
    value: (_, __, ___, at) => (at === null ? "" : valueText(values[index][at], lanes[index].type)),
  }));
  const bandRows = answer.sources.length;
  const axis = { stroke: color("--ink"), grid: { stroke: color("--line"), width: 1 }, ticks: { stroke: color("--line") } };
  const options = {
    width: place.clientWidth,
    height: Math.max(220, 26 * height + 18 * bandRows + 110),
    scales: { x: { time: false }, y: { range: [-0.3 - bandRows * 0.7, Math.max(height, 1)] } },
    axes: [
      { ...axis, label: atOf(answer.from) ? `time of day (${clockAndZone(atOf(answer.from)).split(" ")[1]}), cycle` : "cycle", labelSize: 20, size: atOf(answer.from) ? 62 : 50,
        space: 90, values: (_, values) => values.map((value) => (Number.isInteger(value) ? [clock(atOf(value), true), value].filter((part) => part !== "").join("\n") : "")) },
      { ...axis, size: 130, splits: () => labels.map(([at]) => at), values: () => labels.map(([, text]) => text), grid: { show: false } },
    ],
    series: [{ label: "cycle", value: (_, value) => (value === null ? "" : [value, clock(atOf(value), true)].filter((part) => part !== "").join(" · ")) }, ...series],
    plugins: [bandPlugin(answer, color)],
    cursor: { drag: { x: true, y: false, setScale: false }, bind: { dblclick: () => unzoom } },
    hooks: { setSelect: [selected] },
  };
  const pointer = plot && plot.cursor.left >= 0 ? { left: plot.cursor.left, top: plot.cursor.top } : null;
  plot?.destroy();
  plot = new uPlot(options, [cycles, ...rows], place);
  plot.over.addEventListener("pointerdown", () => { dragging = true; });
  plot.over.addEventListener("click", () => {
    if (dragged) {
      dragged = false;
    } else if (plot.cursor.left >= 0) {
      goTo(plot.posToVal(plot.cursor.left, "x"));
    }
  });
  if (pointer) {
    plot.setCursor(pointer);
  }
  // After the plot has drawn itself, which ends with an empty legend.
  setTimeout(point);
  const seconds = ((answer.to - answer.from + 1) * run.period_us) / 1e6;
  setText(id("trend-words"), `cycles ${answer.from} to ${answer.to}, ${seconds.toFixed(1)} s${zoom ? ", zoomed" : ""}; a click goes to the cycle, dragging zooms`);
}

// A range was dragged.
function selected(own) {
  const { left, width } = own.select;
  if (width < 3) {
    return;
  }
  dragged = true;
  dragging = false;
  const from = Math.floor(own.posToVal(left, "x"));
  const to = Math.ceil(own.posToVal(left + width, "x"));
  own.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
  zoomTo(from, Math.max(to - from, LEAST_SPAN));
}

// Without a pointer in the plot, the values below it are those of the shown cycle, which has the cursor.
function point() {
  if (!plot || plot.cursor.left >= 0 && plot.over.matches(":hover")) {
    return;
  }
  const { cycle } = state();
  const [cycles] = plot.data;
  if (isLive() || cycle < answer.from || cycle > answer.to) {
    plot.setLegend({ idx: cycles.length - 1 });
  } else {
    plot.setCursor({ left: plot.valToPos(cycle, "x"), top: 0 });
  }
}
