// The cluster: states of the members, source of the outputs of each plant, and remaining redundancy.

import { changed } from "/address.js";
import { broken, el, keyed, setText, setAttribute, valueText } from "/element.js";
import { signalLegend, sourceLegend, stateLegend } from "/legend.js";
import * as overview from "/overview.js";
import { STATES, makePicture } from "/picture.js";
import { continueWords, openChoice, openMember } from "/commands.js";
import { textOf } from "/signals.js";
import { SOURCES } from "/sources.js";
import * as time from "/time.js";
import { openWhy } from "/why.js";
import { clockOf } from "/zone.js";

// States that are common; the others need no explanation.
const LEGEND_STATES = ["publishing", "not-received", "flagged", "joining", "shadow-mode", "suspended", "killed"];

let run = null;
let place = null;
let picture = null;
let large = false;
// The program whose picture is drawn; null for all.
let drawn = null;

export function prepare(facts) {
  run = facts;
  large = overview.isLarge(run);
  drawn = large ? 0 : null;
  picture = makePicture(run, openMember, drawn);
  addEventListener("resize", () => {
    if (picture.isOther()) {
      draw(drawn);
      again();
    }
  });
  const table = (id, heads) =>
    el("table", { id }, el("thead", {}, el("tr", {}, heads.map((head) => el("th", { scope: "col" }, head)))), el("tbody"));
  const card = (id, heading, ...content) =>
    el("section", { id: `${id}-card`, class: "card", "aria-labelledby": `${id}-title` }, el("h2", { id: `${id}-title` }, heading), content);
  const folded = (id, words, ...content) => el("details", { id }, el("summary", { class: "soft" }, words), content);
  place = document.getElementById("view-cluster");
  place.classList.toggle("large", large);
  place.append(
    ...(large ? overview.prepare(run, choose, again) : []),
    el("div", { class: "picture-frame", tabindex: "0", role: "region", "aria-label": "Picture of the cluster" }, picture.element),
    folded("cluster-legend", "Legend", el("div", { class: "legends" }, sourceLegend(), stateLegend(LEGEND_STATES.map((name) => STATES[name])))),
    el("div", { class: "cards" },
      card("protection", "Protection", el("p", { id: "protection-words", class: "verdict" }),
        folded("protection-details", "protected programs", el("ul", { id: "protected-list", class: "plain soft" })), el("ul", { id: "protection-list", class: "plain" })),
      card("redundancy", "Remaining redundancy", el("p", { id: "redundancy-words", class: "verdict" }), folded("redundancy-details", "each further failure", el("ul", { id: "redundancy-list", class: "plain" }))),
      card("timing", "Cycle", el("dl", { id: "timing-list" })),
      card("counts", "Deadlines by source of the outputs", el("div", { class: "wide", tabindex: "0", role: "region", "aria-label": "Table of deadlines by source" }, table("counts-table", ["program", ...["direct", "reconstructed", "held", "fail-safe"].map((source) => `${SOURCES[source].sign} ${SOURCES[source].words}`)]))),
      card("signals", "Inputs and outputs", signalLegend(), el("div", { id: "signals-list" })),
    ),
  );
}

export const selection = () => (large ? overview.selection() : {});
export const select = (wanted) => large && overview.select(wanted);

// Draws the picture of one program, or of all.
function draw(program) {
  const before = picture.element;
  drawn = program;
  picture = makePicture(run, openMember, program);
  before.replaceWith(picture.element);
}

// A large cluster has the picture of one program, with the understudies.
function choose(program) {
  draw(program);
  const { name } = run.programs[program];
  for (const details of document.querySelectorAll("#signals-list details")) {
    details.open = details.dataset.program === name;
  }
}

// Shows another choice of the same cycle.
function again() {
  if (time.state()) {
    show(time.state());
    changed();
  }
}

export function show(state) {
  const programs = large ? overview.show(state) : state.programs;
  picture.show(state);
  protection(state.programs);
  redundancy(state.redundancy);
  timing(state);
  counts(programs);
  signals(programs);
}

// A lamp for each program: whether the failure of one station would be masked, and the choices of the operator where its state is lost.
function protection(programs) {
  const look = ({ protection, protection_words: words, lost }) => {
    if (lost) {
      return ["lost", "✗", lost.words];
    }
    if (!protection) {
      return ["unknown", "?", words];
    }
    if (protection.protected) {
      return ["protected", "●", protection.words];
    }
    const { since, since_at: at, lacking } = protection;
    const when = at ? `${clockOf(at, time.state()?.at)} (cycle ${since})` : `cycle ${since}`;
    return ["unprotected", "⚠", [`NOT protected since ${when}`, lacking.map(({ text }) => text).join(", ")].filter(Boolean).join(": ")];
  };
  const isProtected = ({ protection, lost }) => protection?.protected && !lost;
  const sound = programs.filter(isProtected);
  const all = programs.length === 1 ? "the program is protected" : `all ${programs.length} programs are protected`;
  const words = document.getElementById("protection-words");
  setText(words, sound.length === programs.length ? all : `${sound.length} of ${programs.length} programs ${sound.length === 1 ? "is" : "are"} protected`);
  setAttribute(words, "data-level", sound.length === programs.length ? "all" : "some");
  document.getElementById("protection-details").hidden = sound.length === 0;
  keyed(document.getElementById("protected-list"), sound, (program) => program.name, (program) => el("li", { "data-protection": "protected" }, "● ", broken(program.name), ": protected"), () => {});
  // One cause is one line, with the programs that it concerns; a lost state asks for an answer of its own.
  const groups = new Map();
  for (const program of programs.filter((program) => !isProtected(program))) {
    const [level, sign, words] = look(program);
    const key = program.lost ? `lost ${program.name}` : words;
    const group = groups.get(key) ?? groups.set(key, { key, level, sign, words, programs: [], first: program }).get(key);
    group.programs.push(program.name);
  }
  keyed(
    document.getElementById("protection-list"),
    [...groups.values()],
    ({ key }) => key,
    ({ first: { index } }) => {
      const remote = run.programs[index].remote_io;
      const cold = el("button", { type: "button", "data-choice": "cold", click: () => openChoice(remote, "cold") }, "Cold start …");
      const newest = el("button", { type: "button", "data-choice": "newest", click: () => openChoice(remote, "newest") });
      return el("li", {}, el("span", { class: "protection-words" }), el("div", { class: "choices", hidden: true }, cold, " ", newest));
    },
    (line, { level, sign, words, programs: names, first: program }) => {
      setAttribute(line, "data-protection", level);
      const whom = names.length > 1 && names.length === programs.length ? `all ${names.length} programs` : names.join(", ");
      setText(line.querySelector(".protection-words"), `${sign} ${whom}: ${words}`);
      const asks = Boolean(program.lost?.asks) && !run.commands.why;
      line.querySelector(".choices").hidden = !asks;
      if (asks) {
        const newest = line.querySelector("[data-choice=newest]");
        newest.hidden = program.lost.newest === null;
        setText(newest, `${continueWords(program.lost)} …`);
      }
    },
  );
}

function redundancy(remaining) {
  const words = document.getElementById("redundancy-words");
  setText(words, remaining.words);
  setAttribute(words, "data-level", remaining.level);
  const item = (failure) => (failure.masked ? `✓ ${failure.names.join(" and ")}: masked` : `✗ ${failure.names.join(" and ")}: ${failure.why}`);
  keyed(
    document.getElementById("redundancy-list"),
    remaining.failures,
    (failure) => failure.names.join("+"),
    () => el("li"),
    (line, failure) => {
      setText(line, item(failure));
      setAttribute(line, "data-masked", String(failure.masked));
    },
  );
}

function timing(state) {
  const micro = (value) => (value === null || value === undefined ? "not known" : Math.abs(value) >= 1000 ? `${(value / 1000).toFixed(2)} ms` : `${value} µs`);
  const { timing } = state;
  const times = ({ p50_ns, p999_ns, maximum_ns }) => [p50_ns, p999_ns, maximum_ns].map((ns) => (ns / 1e6).toFixed(2)).join(" / ") + " ms";
  const lines = [
    ["period", micro(run.period_us)],
    ["last cycle time", micro(timing.cycle_us)],
    ["deadline", micro(run.deadline_us)],
    ["last turn before the deadline", micro(timing.margin_us)],
    ["its least in the newest cycles", timing.least_of > 0 ? `${micro(timing.least_margin_us)} of ${timing.least_of}` : "not known"],
    ["cycle master", state.cycle_master ?? "none"],
    ["sample to output, p50 / p99.9 / max", timing.slowest ? times(timing.slowest.sample_to_output) : "not known"],
    ["late wake-ups, p50 / p99.9 / max", timing.slowest ? times(timing.slowest.wakeups) : "not known"],
    ["slowest remote I/O", timing.slowest?.name ?? "not known"],
    ["host stalls", timing.stalls === 1 ? "1 stall" : `${timing.stalls} stalls`],
  ];
  keyed(
    document.getElementById("timing-list"),
    lines,
    ([name]) => name,
    ([name]) => el("div", {}, el("dt", {}, name), el("dd")),
    (line, [, value]) => setText(line.lastChild, value),
  );
}

function counts(programs) {
  const body = document.querySelector("#counts-table tbody");
  keyed(
    body,
    programs,
    (program) => program.name,
    (program) => el("tr", {}, el("th", { scope: "row" }, broken(program.name)), el("td"), el("td"), el("td"), el("td")),
    (row, { counts, source }) => {
      const numbers = [counts.direct, counts.reconstructed, counts.held, counts.fail_safe];
      numbers.forEach((number, index) => setText(row.children[index + 1], String(number)));
      setAttribute(row.lastChild, "data-failed", String(source === "fail-safe"));
    },
  );
}

function signals(programs) {
  keyed(
    document.getElementById("signals-list"),
    programs,
    (program) => `${program.name} ${program.points}`,
    (program) => {
      const facts = run.programs[program.index];
      const line = (signal, kind, index) =>
        el("button", { type: "button", class: "signal", "data-kind": kind, "data-index": index, click: () => pick(program.index, kind, index) },
          el("span", { class: signal.type === "BOOL" ? "lamp" : "lamp-room", "aria-hidden": "true" }), el("span", { class: "signal-name", title: signal.description }, broken(signal.name)), el("span", { class: "signal-value" }), el("span", { class: "signal-forced" }));
      return el("details", { open: !large, "data-program": program.name },
        el("summary", {}, program.name, " ", el("span", { class: "source-words" })),
        el("div", { class: "signal-columns" },
          el("div", {}, el("h3", {}, "inputs"), facts.inputs.map((signal, index) => line(signal, "input", index))),
          el("div", {}, el("h3", {}, "outputs"), facts.outputs.map((signal, index) => line(signal, "output", index)))));
    },
    (details, program) => {
      const source = SOURCES[program.source] ?? SOURCES.unknown;
      setText(details.querySelector(".source-words"), `${source.sign} ${source.words}${program.word_of ? ` from a parity word of ${program.word_of}` : ""}${program.fault ? `: ${program.fault}` : ""}`);
      for (const button of details.querySelectorAll(".signal")) {
        const { kind, index } = button.dataset;
        const values = kind === "input" ? program.input_values : program.output_values;
        const forced = program.forced.find((force) => force.kind === kind && String(force.index) === index);
        const signal = run.programs[program.index][`${kind}s`][index];
        const shown = forced && kind === "output" ? forced.value : values?.[index];
        const value = valueText(shown, signal.type);
        setText(button.querySelector(".signal-value"), textOf(signal, shown));
        setText(button.querySelector(".signal-forced"), forced ? `forced by ${forced.owner}, ${forced.left_s} s left` : "");
        setAttribute(button, "data-value", value);
      }
    },
  );
}

function pick(program, kind, index) {
  if (kind === "output") {
    openWhy(program, index);
  } else {
    openMember({ kind: "remote-io", program }, { kind, index });
  }
}
