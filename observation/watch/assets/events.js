// Events in order, with severity, cycle and cause, and alarms, which an operator acknowledges.

import { changed } from "/address.js";
import * as alarms from "/alarms.js";
import { act, ask } from "/ask.js";
import { chips, folded } from "/chips.js";
import { el, keyed, setAttribute, setText } from "/element.js";
import { keep, kept } from "/kept.js";
import { goTo, isLive, state as stateNow } from "/time.js";
import { clock, clockOf } from "/zone.js";

const LEVELS = { alarm: "✗", warning: "⚠", notice: "•", info: "·" };

// Rows that are asked for at first, and the server's bound.
const ROWS = 200;
const MAXIMUM_ROWS = 1000;

// A live page asks at most so often, in milliseconds.
const PAUSE = 500;

let find = "";
let ofHost = false;
let folds = true;
let limit = ROWS;
let asked = "";
let last = 0;
let later = 0;

const level = (word) => `${LEVELS[word] ?? ""} ${word}`;
const levels = chips("Severity", filtered, level);
const kinds = folded("Kinds", filtered);
const members = folded("Members", filtered);
const id = (name) => document.getElementById(name);

export function prepare() {
  const table = el("table", { id: "event-table" },
    el("thead", {}, el("tr", {}, ["severity", "time", "cycle", "member", "event"].map((head) => el("th", { scope: "col", class: head === "time" ? "event-at" : null }, head)))),
    el("tbody"));
  addEventListener("zone", again);
  id("view-events").append(
    alarms.card(),
    el("section", { class: "card", "aria-labelledby": "events-title" },
      el("h2", { id: "events-title" }, "Events"),
      el("div", { class: "tools" },
        el("label", {}, "Find ", el("input", { id: "event-find", type: "search", input: (event) => { find = event.target.value.trim(); filtered(); } })),
        el("div", { class: "choice-row" }, "Only ", levels.element),
        el("label", {}, el("input", { id: "event-fold", type: "checkbox", change: (event) => { folds = event.target.checked; filtered(); } }), " fold repeated"),
        el("button", { id: "event-clear", type: "button", click: clear }, "No filter")),
      el("div", { class: "filters" }, kinds.element, members.element),
      el("p", { id: "event-host", class: "soft", role: "status" },
        el("span", { id: "event-host-words" }), " ", el("button", { id: "event-host-show", type: "button", class: "link", click: () => { ofHost = !ofHost; filtered(); } })),
      el("div", { class: "wide", tabindex: "0", role: "region", "aria-label": "Table of events" }, table),
      el("p", {}, el("span", { id: "event-rows", class: "soft", role: "status" }), " ",
        el("button", { id: "event-more", type: "button", hidden: true, click: () => { limit = MAXIMUM_ROWS; again(); } }, "Show more"))),
  );
  apply(kept("events") ?? {});
}

// The filter as texts, as an address has it.
export function selection() {
  return {
    find,
    levels: levels.chosen().join(","),
    kinds: kinds.chosen().join(","),
    members: members.chosen().join(","),
    host: ofHost ? "shown" : "hidden",
    fold: folds ? "" : "no",
  };
}

// Takes a filter from an address.
export function select(wanted) {
  apply(wanted);
  again();
}

function apply(wanted) {
  const list = (text) => (text ?? "").split(",").filter(Boolean);
  find = wanted.find ?? "";
  levels.choose(list(wanted.levels).filter((word) => word in LEVELS));
  kinds.choose(list(wanted.kinds));
  members.choose(list(wanted.members));
  ofHost = wanted.host === "shown";
  folds = wanted.fold !== "no";
  id("event-find").value = find;
  id("event-fold").checked = folds;
}

// A person has changed the filter.
function filtered() {
  keep("events", selection());
  limit = ROWS;
  changed();
  again();
}

function clear() {
  apply({});
  filtered();
}

function again() {
  asked = "";
  const now = stateNow();
  if (now) {
    show(now, isLive());
  }
}

export function show(state, live) {
  alarms.show(state);
  const from = state.past?.from ?? "the first";
  const now = live ? `${state.event_count} from ${from}` : `until ${state.cycle} from ${from}`;
  if (now === asked) {
    return;
  }
  const pause = asked !== "" && live ? PAUSE - (performance.now() - last) : 0;
  if (pause > 0) {
    later ||= setTimeout(() => {
      later = 0;
      show(stateNow(), isLive());
    }, pause);
    return;
  }
  asked = now;
  refresh(live ? undefined : state.cycle);
}

let asking = false;
let wanted = null;

// One question at a time; of those that come meanwhile the last.
async function refresh(cycle) {
  wanted = { cycle };
  if (asking) {
    return;
  }
  asking = true;
  while (wanted) {
    const { cycle } = wanted;
    wanted = null;
    last = performance.now();
    const keys = { ...selection(), limit, host: ofHost, fold: folds };
    if (cycle !== undefined) {
      keys.until = cycle;
    }
    const answer = await act(() => ask(`api/events?${new URLSearchParams(keys)}`));
    if (answer && !wanted) {
      fill(answer);
    }
  }
  asking = false;
}

function fill(answer) {
  const { hidden_of_host: hidden } = answer;
  levels.show(Object.fromEntries(Object.keys(LEVELS).map((word) => [word, answer.levels[word] ?? 0])));
  kinds.show(answer.kinds);
  members.show(answer.members);
  const host = id("event-host");
  host.hidden = hidden === 0 && !ofHost;
  setText(id("event-host-words"), ofHost ? "Late wake-ups by the host are shown:" : `${hidden} of the host hidden:`);
  setText(id("event-host-show"), ofHost ? "hide" : "show");
  const { length } = answer.events;
  setText(id("event-rows"), length < answer.rows ? `the newest ${length} of ${answer.rows} rows` : length === 0 ? "no event" : "");
  id("event-more").hidden = !(length < answer.rows && length < MAXIMUM_ROWS);
  id("event-table").toggleAttribute("data-timeless", answer.events.every((event) => !event.at));
  keyed(document.querySelector("#event-table tbody"), answer.events, (event) => event.id, makeRow, showRow);
}

function makeRow(event) {
  const row = el("tr", {},
    el("td", { class: "level" }),
    el("td", { class: "event-at" }),
    el("td", {}, el("button", { class: "link", type: "button", click: () => goTo(row.dataset.cycle) })),
    el("td", {}, event.who),
    el("td", {}, el("span", { class: "event-words" }), el("span", { class: "soft event-cause" }), el("span", { class: "event-count" })));
  return row;
}

function showRow(row, event) {
  const part = (name) => row.querySelector(name);
  setAttribute(row, "data-kind", event.kind);
  setAttribute(row, "data-level", event.level);
  setAttribute(row, "data-cycle", String(event.cycle));
  setText(part(".level"), level(event.level));
  setText(part(".event-at"), clockOf(event.at, stateNow()?.at));
  part(".event-at").title = event.at ? clock(event.at, true) : "";
  setText(part("button"), String(event.cycle));
  setText(part(".event-words"), event.what);
  setText(part(".event-cause"), event.cause ? ` (${event.cause})` : "");
  setText(part(".event-count"), event.count > 1 ? ` × ${event.count} since cycle ${event.first_cycle}` : "");
}
