// The cluster as a picture: stations above, the network, remote I/Os and plants below, and a line for each source of outputs.
//
// Words and signs carry the meaning as well as colours.

import { setAttribute, setText, shorten, svg } from "/element.js";
import { SOURCES } from "/sources.js";

export const STATES = {
  publishing: { sign: "●", words: "publishing" },
  "not-received": { sign: "○", words: "not received" },
  flagged: { sign: "⚑", words: "flagged" },
  joining: { sign: "↻", words: "joining" },
  "shadow-mode": { sign: "◐", words: "shadow mode" },
  refused: { sign: "✗", words: "refused" },
  suspended: { sign: "‖", words: "suspended" },
  killed: { sign: "✕", words: "killed" },
  ended: { sign: "✕", words: "ended" },
  standby: { sign: "…", words: "standby" },
  "not-started": { sign: "…", words: "not started" },
  "state-lost": { sign: "✗", words: "state lost" },
  "awaits-release": { sign: "⚠", words: "awaits release" },
  serving: { sign: "●", words: "serving" },
  listening: { sign: "◌", words: "listening" },
  "not-reporting": { sign: "✕", words: "not reporting" },
  moving: { sign: "●", words: "moving" },
};

// Limits of the width of a box, which follows the longest name.
const NARROWEST = 168;
const WIDEST = 208;
const LETTER = 8;
const GAP = 22;
const BOX = { height: 62 };
const ROWS = { station: 14, bus: 112, remote: 152, plant: 262 };

// The picture of the cluster, or of one program of it with its controller and all understudies. Where it is wider than the page, the understudies come
// first: all programs depend on them.
export function makePicture(run, pick, only = null) {
  const shown = run.programs.filter((program) => only === null || program.index === only);
  const isUnderstudy = (station) => station.role !== "controller";
  const own = run.stations.filter((station) => only === null || isUnderstudy(station) || station.program === only);
  const names = [...own.map((station) => station.name), ...shown.flatMap((program) => [program.remote_io, program.plant ?? ""])];
  const longest = Math.max(...names.map((name) => name.length));
  const WIDTH = Math.round(Math.min(WIDEST, Math.max(NARROWEST, longest * LETTER + 24)));
  const letters = Math.floor((WIDTH - 24) / LETTER);
  const fits = () => Math.max(own.length, shown.length) * (WIDTH + GAP) + GAP <= innerWidth;
  const isNarrow = !fits();
  const shownStations = isNarrow ? [...own.filter(isUnderstudy), ...own.filter((station) => !isUnderstudy(station))] : own;
  const shift = isNarrow ? own.filter(isUnderstudy).length : 0;
  const columns = Math.max(shownStations.length, shown.length + shift);
  const width = columns * (WIDTH + GAP) + GAP;
  const height = (shown.some((program) => program.plant) ? ROWS.plant : ROWS.remote) + BOX.height + 14;
  const left = (column) => GAP + column * (WIDTH + GAP);
  const lines = svg("g", { class: "flows" });
  const boxes = new Map();
  const box = (name, kind, column, top, member) => {
    const made = makeBox(name, kind, left(column), top, WIDTH, letters, () => pick(member));
    boxes.set(name, made);
    return made.element;
  };
  const stations = shownStations.map((station, column) =>
    box(station.name, station.role, column, ROWS.station, { kind: "station", name: station.name, program: station.program }));
  const remotes = shown.map((program, column) =>
    box(program.remote_io, "remote I/O", column + shift, ROWS.remote, { kind: "remote-io", name: program.remote_io, program: program.index }));
  const plants = shown.flatMap((program, column) =>
    program.plant ? [box(program.plant, "plant", column + shift, ROWS.plant, { kind: "plant", name: program.plant, program: program.index })] : []);
  const bus = svg("g", { class: "bus" },
    svg("line", { x1: GAP / 2, x2: width - GAP / 2, y1: ROWS.bus, y2: ROWS.bus }),
    svg("text", { x: width - GAP / 2, y: ROWS.bus - 7, "text-anchor": "end" }, "network"));
  const drops = shownStations.map((_, column) => drop(left(column) + WIDTH / 2, ROWS.station + BOX.height, ROWS.bus));
  const element = svg("svg", { class: "picture", viewBox: `0 0 ${width} ${height}`, width, height, role: "group", "aria-label": "Stations, remote I/Os and plants" },
    bus, drops, lines, stations, remotes, plants);
  const flows = new Map(shown.map((program, column) => [program.index, makeFlow(lines, left(column + shift) + WIDTH / 2, Math.floor(letters * 0.7), Boolean(program.plant))]));
  // Whether the window has changed so that another order is the right one.
  const isOther = () => fits() === isNarrow;
  return { element, isOther, show: (state) => showAll(run, boxes, flows, state) };
}

const drop = (x, from, to) => svg("line", { class: "drop", x1: x, x2: x, y1: from, y2: to });

function makeBox(name, kind, x, y, width, letters, pick) {
  const state = svg("text", { class: "state", x: x + 12, y: y + 38 });
  const note = svg("text", { class: "note", x: x + 12, y: y + 54 });
  const element = svg("g", {
    class: "member", tabindex: "0", role: "button", "data-name": name, "data-kind": kind, click: pick,
    keydown: (event) => {
      if (event.key === "Enter" || event.key === " ") {
        event.preventDefault();
        pick();
      }
    },
  },
    svg("title", {}, name),
    svg("rect", { x, y, width, height: BOX.height, rx: kind === "plant" ? 22 : 5 }),
    svg("text", { class: "name", x: x + 12, y: y + 20 }, shorten(name, letters)),
    state, note);
  return { element, state, note, kind };
}

function makeFlow(parent, x, letters, hasPlant) {
  const down = svg("line", { class: "flow", x1: x, x2: x, y1: ROWS.bus, y2: ROWS.remote });
  const words = svg("text", { class: "flow-words", x: x + 8, y: ROWS.bus + 18 });
  const whose = svg("text", { class: "flow-words", x: x + 8, y: ROWS.bus + 33 });
  const out = svg("line", { class: "flow", x1: x, x2: x, y1: ROWS.remote + BOX.height, y2: ROWS.plant });
  const outWords = svg("text", { class: "flow-words", x: x + 8, y: ROWS.plant - 18 });
  parent.append(down, words, whose);
  if (hasPlant) {
    parent.append(out, outWords);
  }
  return { down, words, whose, letters, out, outWords };
}

function showAll(run, boxes, flows, state) {
  for (const member of state.members) {
    const box = boxes.get(member.name);
    if (box) {
      showBox(box, member);
    }
  }
  state.programs.filter((program) => flows.has(program.index)).forEach((program) => {
    const { index } = program;
    // What a program drives has the mark of its source: nothing is shown as sound below fail-safe outputs.
    for (const name of [run.programs[index].remote_io, run.programs[index].plant]) {
      const box = boxes.get(name);
      if (box) {
        setAttribute(box.element, "data-source", program.source);
        if (program.source === "fail-safe" && ["serving", "moving"].includes(box.element.dataset.state)) {
          setText(box.state, `${SOURCES["fail-safe"].sign} fail-safe outputs`);
        }
      }
    }
    const { down, words, whose, letters, out, outWords } = flows.get(index);
    const source = SOURCES[program.source] ?? SOURCES.unknown;
    for (const line of [down, out]) {
      setAttribute(line, "data-source", program.source);
    }
    const by = program.source === "reconstructed" && program.word_of;
    setAttribute(words, "data-source", program.source);
    setText(words, `${source.sign} ${source.words}${by ? " from" : ""}`);
    setText(whose, by ? shorten(by, letters * 2) : "");
    setText(outWords, program.forced.some((force) => force.kind === "output") ? "⚠ forced" : "");
  });
}

function showBox(box, member) {
  const look = STATES[member.state] ?? { sign: "?", words: member.state };
  setAttribute(box.element, "data-state", member.state);
  setText(box.state, `${look.sign} ${look.words}`);
  setText(box.note, member.note || (member.is_cycle_master ? `${box.kind}, cycle master` : box.kind));
}
