// Events in order, with cycle and cause, and alarms, which an operator acknowledges.

import * as alarms from "/alarms.js";
import { act, ask } from "/ask.js";
import { el, keyed } from "/element.js";
import { goTo, isLive, state as stateNow } from "/time.js";

let run = null;
let filter = "";
let asked = "";

export function prepare(facts) {
  run = facts;
  document.getElementById("view-events").append(
    alarms.card(),
    el("section", { class: "card", "aria-labelledby": "events-title" },
      el("h2", { id: "events-title" }, "Events"),
      el("label", {}, "Find ", el("input", { id: "event-find", type: "search", input: (event) => { filter = event.target.value; asked = ""; refresh(isLive() ? undefined : stateNow()?.cycle); } })),
      el("div", { class: "wide", tabindex: "0", role: "region", "aria-label": "Table of events" },
        el("table", { id: "event-table" },
          el("thead", {}, el("tr", {}, ["cycle", "member", "event"].map((head) => el("th", { scope: "col" }, head)))),
          el("tbody")))),
  );
}

export function show(state, live) {
  alarms.show(state);
  const now = live ? `${state.event_count}/${filter}` : `until ${state.cycle}/${filter}`;
  if (now !== asked) {
    asked = now;
    refresh(live ? undefined : state.cycle);
  }
}

let asking = false;

async function refresh(cycle) {
  if (asking) {
    return;
  }
  asking = true;
  const until = cycle === undefined ? "" : `&until=${cycle}`;
  const answer = await act(() => ask(`/api/events?limit=200&find=${encodeURIComponent(filter)}${until}`));
  asking = false;
  if (!answer) {
    return;
  }
  keyed(
    document.querySelector("#event-table tbody"),
    answer.events,
    (event) => event.id,
    (event) => el("tr", { "data-kind": event.kind },
      el("td", {}, el("button", { class: "link", type: "button", click: () => goTo(event.cycle) }, String(event.cycle))),
      el("td", {}, event.who),
      el("td", {}, event.what, event.cause ? el("span", { class: "soft" }, ` (${event.cause})`) : "")),
  );
}
