// The watch table: chosen signals with their values in the shown cycle.

import { addressOf, changed } from "/address.js";
import { act, ask } from "/ask.js";
import { el, keyed, setAttribute, setText } from "/element.js";
import { keep, kept } from "/kept.js";
import { asked as askedFor, chooser, find, fullName, load, textOf } from "/signals.js";
import { cycleParameter, isLive, state } from "/time.js";

const MAXIMUM_SIGNALS = 100;

// A live page asks at most so often, in milliseconds.
const PAUSE = 200;

let chosen = [];
let choice = null;
let asking = false;
let again = false;
// Answers to questions of before other points are dropped.
let generation = 0;
let later = 0;
let last = 0;

const id = (name) => document.getElementById(name);

export function prepare() {
  chosen = kept("watch") ?? [];
  choice = chooser("watch", (signal) => chosen.includes(signal), toggle);
  const heads = ["program", "signal", "kind", "type", "value", "address", "meaning", "action"];
  id("view-watch").append(
    el("section", { class: "card", "aria-labelledby": "watch-title" },
      el("h2", { id: "watch-title" }, "Watch table"),
      el("p", { id: "watch-words", class: "stamp soft", role: "status" }),
      el("div", { class: "wide", tabindex: "0", role: "region", "aria-label": "Table of the chosen signals" },
        el("table", { id: "watch-table" }, el("thead", {}, el("tr", {}, heads.map((head) => el("th", { scope: "col" }, head)))), el("tbody"))),
      el("p", { id: "watch-tools", class: "tools" },
        el("a", { id: "watch-trends" }, "Show them as trends"), " ",
        el("button", { id: "watch-clear", type: "button", click: () => choose([]) }, "Remove all"))),
    choice.element);
}

export const selection = () => ({ signals: chosen.join(",") });

export function select(wanted) {
  chosen = (wanted.signals ?? "").split(",").filter(Boolean).slice(0, MAXIMUM_SIGNALS);
  choice.show();
}

// Other points count: the same signals have other identifiers.
export function replacePoints(renamed) {
  chosen = renamed(chosen);
  generation += 1;
}

export async function enter() {
  // What this run does not have is left out.
  if (await load()) {
    chosen = chosen.filter(find);
  }
  choice.element.open ||= chosen.length === 0;
  choice.show();
  fill();
  refresh(true);
}

function toggle(signal) {
  choose(chosen.includes(signal) ? chosen.filter((other) => other !== signal) : [...chosen, signal].slice(0, MAXIMUM_SIGNALS));
}

// A person has chosen.
function choose(signals) {
  chosen = signals;
  keep("watch", chosen);
  changed();
  choice.show();
  fill();
  refresh(true);
}

export function show() {
  refresh(false);
}

async function refresh(now) {
  if (asking) {
    again = true;
    return;
  }
  if (!state() || chosen.length === 0) {
    return;
  }
  if (!chosen.every(find)) {
    if (!now) {
      enter();
    }
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
  do {
    again = false;
    last = performance.now();
    const asked = [...chosen];
    const before = generation;
    const names = asked.map(askedFor);
    const answer = await act(() => ask(`api/values?signals=${encodeURIComponent(names.join(","))}&${cycleParameter()}`));
    if (answer && before === generation) {
      const unknown = asked.filter((_, place) => answer.unknown.includes(names[place]));
      fill(new Map(asked.map((signal, place) => [signal, answer.values[place]])), answer.cycle, unknown);
    }
  } while (again && !isLive());
  asking = false;
}

function fill(values, cycle, unknown = []) {
  const hasSome = chosen.length > 0;
  id("watch-tools").hidden = !hasSome;
  setAttribute(id("watch-trends"), "href", addressOf("trends", { signals: chosen.slice(0, 16).join(",") }));
  setText(id("watch-words"), !hasSome ? "No signal is chosen." : cycle === undefined ? "" : `cycle ${cycle}; memory, timers, counters and variables after its scan`);
  keyed(document.querySelector("#watch-table tbody"), chosen.map(find).filter(Boolean), (signal) => signal.id, makeRow, (row, signal) => {
    if (!values?.has(signal.id)) {
      return;
    }
    const force = forceOf(signal);
    const value = values.get(signal.id);
    // A forced output is driven with the forced value.
    const text = unknown.includes(signal.id) ? "no such signal"
      : textOf(signal, force && signal.kind === "output" ? force.value : value);
    setText(row.querySelector(".watch-value"), text);
    setText(row.querySelector(".watch-forced"), force ? ` F forced by ${force.owner}, ${force.left_s} s left` : "");
    setAttribute(row, "data-value", text);
  });
}

function forceOf(signal) {
  const forces = state().programs[signal.program]?.forced ?? [];
  return forces.find((force) => `${signal.program}.${force.kind}.${force.index}` === signal.id);
}

function makeRow(signal) {
  return el("tr", { "data-signal": signal.id },
    el("td", {}, fullName(signal).slice(0, -signal.name.length - 1)), el("th", { scope: "row" }, signal.name), el("td", {}, signal.kind), el("td", {}, signal.type),
    el("td", {}, el("span", { class: "watch-value" }, "?"), el("span", { class: "watch-forced bad" })),
    el("td", {}, signal.address ?? ""), el("td", { class: "soft" }, signal.description ?? ""),
    el("td", {}, el("button", { type: "button", class: "link", "aria-label": `Remove ${fullName(signal)}`, click: () => toggle(signal.id) }, "Remove")));
}
