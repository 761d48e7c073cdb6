// Events in order, with cycle and cause, and alarms, which an operator acknowledges.

import { act, ask, tell } from "/ask.js";
import { el, keyed, setText } from "/element.js";
import { goTo, isLive, state as stateNow } from "/time.js";
import { owner } from "/commands.js";

let run = null;
let filter = "";
let asked = "";

export function prepare(facts) {
  run = facts;
  document.getElementById("view-events").append(
    el("section", { class: "card", "aria-labelledby": "alarms-title" }, el("h2", { id: "alarms-title" }, "Alarms"), el("ul", { id: "alarm-list", class: "plain" }), el("p", { id: "no-alarm" }, "none")),
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
  const list = document.getElementById("alarm-list");
  document.getElementById("no-alarm").hidden = state.alarms.length > 0;
  keyed(list, state.alarms, (alarm) => alarm.id, makeAlarm, (line, alarm) => {
    const by = alarm.acknowledged;
    line.dataset.open = String(!by);
    setText(line.querySelector(".alarm-words"), `cycle ${alarm.cycle}: ${alarm.who}: ${alarm.what}${alarm.lasts ? "" : " (over)"}`);
    setText(line.querySelector(".alarm-by"), by ? `acknowledged by ${by} in cycle ${alarm.acknowledged_in}` : "");
    line.querySelector("button").hidden = Boolean(by);
  });
  const now = live ? `${state.event_count}/${filter}` : `until ${state.cycle}/${filter}`;
  if (now !== asked) {
    asked = now;
    refresh(live ? undefined : state.cycle);
  }
}

function makeAlarm(alarm) {
  const acknowledge = () => act(() => tell(`/api/alarms/${alarm.id}/acknowledge`, { owner: owner() }));
  return el("li", {}, el("span", { "aria-hidden": "true" }, "⚠ "), el("span", { class: "alarm-words" }), " ", el("span", { class: "alarm-by" }), " ",
    el("button", { type: "button", click: acknowledge }, "Acknowledge"));
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
