// Trends of chosen signals over the cycles, with sources and faults as bands behind them.

import { changed } from "/address.js";
import { act, ask, toast } from "/ask.js";
import { csvOf, csvOfColumns, reader, saveCsv, savePng } from "/download.js";
import { el, keyed, setText } from "/element.js";
import { keep, kept } from "/kept.js";
import { asked, chooser, find, fullName, load } from "/signals.js";
import { goTo, isLive, state } from "/time.js";
import { bandPlugin, limitPlugin } from "/bands.js";
import { SCALES, heightOf, heightOfAll, labelsOf, lanesOf, tickStep, ticks, unitText } from "/lanes.js";
import { bandLegend } from "/legend.js";
import { clock, clockAndZone, clockOf, dayOf, local, timeOf } from "/zone.js";

let run = null;
let plot = null;
let choice = null;
let chosen = [];
// The scales of signals, by identifier, of those that have none of their own.
let scales = {};
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
// Answers to questions of before other points are dropped.
let generation = 0;
let dragging = false;
let dragged = false;

const MAXIMUM_SIGNALS = 16;
const LEAST_SPAN = 5;
const SHORT_SPANS = [100, 500, 2000, 10_000];

// Longer ones by their seconds.
const LONG_SPANS = [[600, "10 min"], [3600, "1 h"], [28_800, "8 h"], [86_400, "1 day"], [604_800, "7 days"]];
let spans = [];

// Alarms that are listed below the plot, at most.
const LISTED_ALARMS = 12;

// A range that has moved by less than a column is asked for again after this time at the latest, in milliseconds.
const LONGEST_PAUSE = 10_000;

// A live page asks at most so often, in milliseconds.
const PAUSE = 400;

const id = (name) => document.getElementById(name);

export function prepare(facts) {
  run = facts;
  const seconds = (cycles) => (cycles * run.period_us) / 1e6;
  const short = SHORT_SPANS.map((cycles) => [cycles, `${cycles} cycles, ${seconds(cycles)} s`]);
  const long = LONG_SPANS.map(([length, words]) => [Math.round((length * 1e6) / run.period_us), words]);
  spans = [...short, ...long.filter(([cycles]) => cycles > SHORT_SPANS.at(-1))];
  chosen = run.programs.flatMap((program) => program.outputs.slice(0, 2).map((_, index) => `${program.index}.output.${index}`)).slice(0, 6);
  apply(kept("trends") ?? {});
  choice = chooser("trend", (signal) => chosen.includes(signal), toggle);
  const button = (name, words, click) => el("button", { id: `trend-${name}`, type: "button", click }, words);
  id("view-trends").append(
    el("div", { class: "tools" },
      el("label", {}, "Length ", el("select", { id: "trend-span", change: (event) => { span = Number(event.target.value); zoom = null; picked(); } },
        spans.map(([count, words]) => el("option", { value: count }, words)))),
      el("span", { class: "chips", role: "group", "aria-label": "Zoom" }, button("in", "Zoom in", () => scale(0.5)), button("out", "Zoom out", () => scale(2)), button("earlier", "Earlier", () => pan(-0.5)), button("later", "Later", () => pan(0.5)), button("all", "No zoom", unzoom)),
      el("span", { class: "chips", role: "group", "aria-label": "Save" }, button("csv", "Save CSV", csv), button("png", "Save PNG", png))),
    el("p", { id: "trend-words", class: "stamp soft", role: "status" }),
    el("div", { id: "trend-plot", class: "plot", tabindex: "0", role: "group", "aria-label": "Trends of the chosen signals; plus and minus zoom, 0 ends it", keydown: key }),
    bandLegend(),
    el("fieldset", { id: "trend-scales", class: "tools", hidden: true }, el("legend", {}, "Scales")),
    el("section", { id: "trend-alarms-card", class: "card", "aria-labelledby": "trend-alarms-title", hidden: true },
      el("h2", { id: "trend-alarms-title" }, "Alarms in these cycles"), el("ul", { id: "trend-alarms", class: "plain" })),
    choice.element);
  addEventListener("resize", redraw);
  addEventListener("theme", redraw);
  addEventListener("zone", redraw);
  addEventListener("pointerup", () => setTimeout(() => { dragging = false; }));
  addEventListener("pointercancel", () => { dragging = false; });
}

// What is chosen, as an address has it.
export function selection() {
  return { signals: chosen.join(","), scales: scalesText() || undefined, span, from: zoom?.from, to: zoom?.to };
}

export function select(wanted) {
  apply(wanted);
  choice.show();
}

function apply(wanted) {
  if (wanted.signals !== undefined) {
    chosen = wanted.signals.split(",").filter(Boolean).slice(0, MAXIMUM_SIGNALS);
  }
  if (wanted.signals !== undefined || wanted.scales !== undefined) {
    scales = Object.fromEntries((wanted.scales ?? "").split(",").map((text) => text.split(":")).filter(([, scale]) => SCALES.includes(scale)));
  }
  span = spans.find(([known]) => known === Number(wanted.span))?.[0] ?? span;
  const [from, to] = [Number(wanted.from), Number(wanted.to)];
  const isRange = wanted.from !== undefined && Number.isInteger(from) && Number.isInteger(to) && from < to;
  zoom = isRange ? { from, to } : null;
}

// `0.output.1:left,1.input.0:right`
const scalesText = () => chosen.filter((signal) => scales[signal]).map((signal) => `${signal}:${scales[signal]}`).join(",");

function setScale(signal, scale) {
  scales = { ...scales, [signal]: scale === "own" ? undefined : scale };
  picked();
  redraw();
}

// A choice of the scale for each number, where there are two.
function showScales() {
  const numbers = chosen.map(find).filter((signal) => signal && signal.type !== "BOOL");
  id("trend-scales").hidden = numbers.length < 2;
  const choices = [["own", "of its own"], ["left", "left"], ["right", "right"]];
  const line = (signal) => el("label", {}, `${fullName(signal)} `,
    el("select", { "data-signal": signal.id, change: (event) => setScale(signal.id, event.target.value) }, choices.map(([value, words]) => el("option", { value }, words))), " ");
  const place = id("trend-scales");
  if (!place.querySelector("div")) {
    place.append(el("div", { class: "tools" }));
  }
  keyed(place.querySelector("div"), numbers, (signal) => signal.id, line, (label, signal) => { label.querySelector("select").value = scales[signal.id] ?? "own"; });
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
  keep("trends", { signals: chosen.join(","), scales: scalesText(), span });
  changed();
  refresh(true);
}

// Other points count: the same signals have other identifiers.
export function replacePoints(renamed) {
  scales = Object.fromEntries(Object.entries(scales).flatMap(([signal, scale]) => renamed([signal]).map((name) => [name, scale])));
  chosen = renamed(chosen);
  generation += 1;
  answer = null;
  drawn = "";
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
  const to = Math.max(isLive() ? now.cycle : Math.min(now.newest, now.cycle + Math.floor(span / 2)), firstCycle());
  return { from: Math.max(firstCycle(), to - span + 1), to };
}

// The server remembers the values of old cycles as columns, further back than their details.
const firstCycle = () => Math.min(0, state().oldest);

// Zooms around the shown cycle, or around the middle.
function scale(factor) {
  const { from, to } = range();
  const length = Math.min(Math.max(Math.round((to - from) * factor), LEAST_SPAN), state().newest - firstCycle());
  const { cycle } = state();
  const middle = !isLive() && from <= cycle && cycle <= to ? cycle : Math.round((from + to) / 2);
  zoomTo(middle - Math.floor(length / 2), length);
}

function pan(share) {
  const { from, to } = range();
  zoomTo(from + Math.round((to - from) * share), to - from);
}

function zoomTo(from, length) {
  const { newest } = state();
  const first = Math.max(Math.min(from, newest - length), firstCycle());
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
  const question = `signals=${encodeURIComponent(chosen.map(asked).join(","))}&from=${from}&to=${to}`;
  if (question === drawn) {
    point();
    return;
  }
  if (asking) {
    again = true;
    return;
  }
  const ofColumn = answer?.column ? Math.min((answer.column * run.period_us) / 1000, LONGEST_PAUSE) : 0;
  const pause = !now && isLive() ? Math.max(PAUSE, ofColumn) - (performance.now() - last) : 0;
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
  const before = generation;
  const found = await act(() => ask(`api/trends?${question}`));
  asking = false;
  if (found && !dragging && before === generation) {
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

// The unit of a signal, where the cluster file has it.
const unitOf = (index) => find(answer.ids[index])?.unit ?? "";

const nameOfFile = () => `${run.cluster}-trends-${answer.from}-${answer.to}`;

function csv() {
  if (answer) {
    const unit = (index) => (find(answer.ids[index])?.type === "TIME" ? " in ns" : unitOf(index) ? ` in ${unitOf(index)}` : "");
    const write = answer.column ? csvOfColumns : csvOf;
    saveCsv(nameOfFile(), write(answer, (signal, index) => `${signal.name}${unit(index)}`, run.period_us, atOf));
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

// The rows of a plot: the cycles, and the values of each signal at them. A column has two points, its least and its greatest value, so that a plot of
// hours shows every peak.
function rowsOf(lanes) {
  const { from, to, column, signals } = answer;
  if (!column) {
    const cycles = Array.from({ length: to - from + 1 }, (_, place) => from + place);
    return { cycles, values: signals.map((signal) => cycles.map(reader(signal.runs))) };
  }
  const count = Math.ceil((to - from + 1) / column);
  const cycles = Array.from({ length: 2 * count }, (_, place) => from + Math.floor((place * column) / 2));
  const values = signals.map((signal) => cycles.map((_, place) => signal.columns[place >> 1]?.[place & 1] ?? null));
  return { cycles, values };
}

// The value at a point of the plot, in words.
function wordsAt(lane, signal, values, place) {
  const range = answer.column ? signal.columns[place >> 1] : null;
  if (range && range[0] !== range[1]) {
    return `${unitText(range[0], lane)} … ${unitText(range[1], lane)}`;
  }
  return values[place] === null ? "not known" : unitText(values[place], lane);
}

// The ticks of the axis of time, with their words: round times of day, and the cycle as the second scale.
function timeAxis(width) {
  const { from, to } = answer;
  const periodMs = run.period_us / 1000;
  const first = atOf(from);
  const step = tickStep((to - from) * periodMs, width, 110);
  const splits = ticks(from, to, step, periodMs, (cycle) => (first ? local(atOf(cycle)) : cycle * periodMs));
  // A cycle begins up to a period before or after a round time.
  const words = (cycle) => {
    const at = first && new Date(atOf(cycle).getTime() + (step < 1000 ? 0 : 500));
    return at ? [step < 86_400_000 ? clock(at, step < 1000) : dayOf(at), cycle].join("\n") : `${cycle}`;
  };
  const days = first && [...new Set([dayOf(first), dayOf(atOf(to))])].join(" to ");
  const label = first ? `${days}, time of day (${clockAndZone(first).split(" ")[1]}), cycle` : "cycle";
  return { label, splits: () => splits, values: () => splits.map(words), labelSize: 20, size: first ? 62 : 50 };
}

function draw() {
  const place = id("trend-plot");
  const lanes = lanesOf(answer.signals, (index) => find(answer.ids[index]), (index) => scales[answer.ids[index]] ?? "own");
  const height = heightOfAll(lanes);
  const letters = place.clientWidth < 700 ? 16 : 30;
  const [labels, rightLabels] = ["left", "right"].map((side) => labelsOf(lanes, side, letters));
  const widthOf = (texts) => Math.max(...texts.map((text) => text.length), 8) * 7 + 22;
  const left = widthOf([...labels.map(([, text]) => text), ...answer.sources.map(({ name }) => name.slice(0, 18))]);
  const right = rightLabels.length > 0 ? widthOf(rightLabels.map(([, text]) => text)) : 0;
  const { cycles, values } = rowsOf(lanes);
  const rows = values.map((row, index) => row.map((value) => (value === null ? null : heightOf(lanes[index], value))));
  const dark = getComputedStyle(document.documentElement);
  const color = (name) => dark.getPropertyValue(name).trim();
  const series = answer.signals.map((signal, index) => ({
    label: signal.name,
    stroke: color(`--series-${index % 6}`),
    dash: index < 6 ? undefined : index < 12 ? [8, 3] : [2, 3],
    width: answer.column ? 1 : 2,
    paths: uPlot.paths.stepped({ align: 1 }),
    points: { show: false },
    value: (_, __, ___, at) => (at === null ? "" : wordsAt(lanes[index], signal, values[index], at)),
  }));
  const bands = [...answer.sources, ...alarmBand()];
  const bandRows = bands.length;
  // The lanes use the height of the window, as far as they are not too high to compare.
  const room = Math.max(360, innerHeight - place.getBoundingClientRect().top - scrollY - 18 * bandRows - 190);
  const unit = Math.min(Math.max(Math.floor(room / Math.max(height, 1)), 26), 80);
  const axis = { stroke: color("--ink"), grid: { stroke: color("--line"), width: 1 }, ticks: { stroke: color("--line") } };
  const options = {
    width: place.clientWidth,
    height: Math.max(220, unit * height + 18 * bandRows + 110),
    scales: { x: { time: false }, y: { range: [-0.3 - bandRows * 0.7, Math.max(height, 1)] } },
    axes: [
      { ...axis, ...timeAxis(place.clientWidth - left - right) },
      { ...axis, size: left, splits: () => labels.map(([at]) => at), values: () => labels.map(([, text]) => text), grid: { show: false } },
      ...(right > 0 ? [{ ...axis, side: 1, size: right, splits: () => rightLabels.map(([at]) => at), values: () => rightLabels.map(([, text]) => text), grid: { show: false } }] : []),
    ],
    series: [{ label: "cycle", value: (_, value) => (value === null ? "" : [value, clock(atOf(value), true)].filter((part) => part !== "").join(" · ")) }, ...series],
    plugins: [bandPlugin({ ...answer, sources: bands }, color), limitPlugin(lanes, color)],
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
  const columns = answer.column ? `; the least and the greatest value of every ${answer.column} cycles` : "";
  setText(id("trend-words"), `cycles ${answer.from} to ${answer.to}, ${lengthText(seconds)}${zoom ? ", zoomed" : ""}${columns}${missing(cycles, values)}; a click goes to the cycle, dragging zooms`);
  showAlarms();
  showScales();
}

const lengthText = (seconds) => (seconds < 600 ? `${seconds.toFixed(1)} s` : seconds < 36_000 ? `${(seconds / 60).toFixed(0)} min` : `${(seconds / 3600).toFixed(1)} h`);

// What is not drawn, in words.
function missing(cycles, values) {
  const isState = (index) => !["input", "output"].includes(find(answer.ids[index])?.kind);
  const recomputed = answer.ids.some((_, index) => isState(index));
  const points = values.filter((_, index) => !isState(index));
  const first = points.length === 0 ? 0 : Math.min(...points.map((row) => row.findIndex((value) => value !== null)).map((place) => (place < 0 ? cycles.length : place)));
  const words = [];
  if (first > 0) {
    words.push(first === cycles.length ? "no value of these cycles is known" : `before cycle ${cycles[first]} no value is known`);
  }
  if (recomputed) {
    words.push(answer.column ? "memory, timers and variables are drawn for up to 20000 cycles" : "memory, timers and variables are drawn for the newest 2000 cycles");
  }
  return words.map((part) => `; ${part}`).join("");
}

// The alarms of these cycles, as one more band.
function alarmBand() {
  if (answer.alarms.length === 0) {
    return [];
  }
  return [{ name: "alarms", runs: answer.alarms.map(({ cycle, over }) => [Math.max(cycle, answer.from), Math.min(over ?? answer.to, answer.to), "alarm"]) }];
}

function showAlarms() {
  const newest = [...answer.alarms].reverse().slice(0, LISTED_ALARMS);
  id("trend-alarms-card").hidden = newest.length === 0;
  keyed(id("trend-alarms"), newest, ({ cycle, name, words }) => `${cycle} ${name} ${words}`,
    ({ cycle }) => el("li", {}, el("button", { type: "button", class: "link", click: () => goTo(cycle) }), " ", el("span")),
    (line, { cycle, over, name, words }) => {
      const at = (of) => [clockOf(atOf(of), atOf(answer.to)), `cycle ${of}`].filter(Boolean).join(", ");
      setText(line.firstChild, at(cycle));
      setText(line.lastChild, `${name}: ${words}${over === null ? "" : `; over ${at(over)}`}`);
    });
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
