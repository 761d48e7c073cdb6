// Alarms: what each says, and what an operator does with it.

import { act, tell } from "/ask.js";
import { el, keyed, setText } from "/element.js";
import { owner } from "/commands.js";

const SHELVE_MINUTES = 60;

export function card() {
  return el("section", { class: "card", "aria-labelledby": "alarms-title" },
    el("h2", { id: "alarms-title" }, "Alarms"),
    el("ul", { id: "alarm-list", class: "plain" }), el("p", { id: "no-alarm" }, "none"),
    el("div", { id: "signal-alarms", hidden: "" },
      el("h3", {}, "Alarms on signals"),
      el("div", { class: "wide", tabindex: "0", role: "region", "aria-label": "Table of the alarms on signals" },
        el("table", { id: "signal-alarm-table" },
          el("thead", {}, el("tr", {}, ["alarm", "priority", "state", "signal", "action", "shelving"].map((head) => el("th", { scope: "col" }, head)))),
          el("tbody")))));
}

export function show(state) {
  document.getElementById("no-alarm").hidden = state.alarms.length > 0;
  keyed(document.getElementById("alarm-list"), state.alarms, (alarm) => alarm.id, makeAlarm, (line, alarm) => {
    const by = alarm.acknowledged;
    line.dataset.open = String(!by);
    const priority = alarm.priority ? ` (${alarm.priority})` : "";
    const before = alarm.since_before ? " or before" : "";
    setText(line.querySelector(".alarm-words"), `cycle ${alarm.cycle}${before}: ${alarm.who}${priority}: ${alarm.what}${alarm.lasts ? "" : " (over)"}`);
    setText(line.querySelector(".alarm-by"), by ? `acknowledged by ${by} in cycle ${alarm.acknowledged_in}` : alarm.action ?? "");
    line.querySelector("button").hidden = Boolean(by);
  });
  const alarms = state.process_alarms;
  document.getElementById("signal-alarms").hidden = alarms.length === 0;
  keyed(document.querySelector("#signal-alarm-table tbody"), alarms, (alarm) => alarm.name, makeSignalAlarm, (row, alarm) => {
    const { shelved } = alarm;
    row.dataset.state = alarm.state;
    const words = shelved ? `shelved until cycle ${shelved.until} by ${shelved.owner}: ${shelved.reason}` : alarm.state;
    setText(row.querySelector(".alarm-state"), words);
    setText(row.querySelector("button"), shelved ? "End shelving" : "Shelve");
  });
}

function makeAlarm(alarm) {
  const acknowledge = () => act(() => tell(`/api/alarms/${alarm.id}/acknowledge`, { owner: owner() }));
  return el("li", {}, el("span", { "aria-hidden": "true" }, "⚠ "), el("span", { class: "alarm-words" }), " ", el("span", { class: "alarm-by" }), " ",
    el("button", { type: "button", click: acknowledge }, "Acknowledge"));
}

function makeSignalAlarm(alarm) {
  const button = el("button", { type: "button" }, "Shelve");
  const row = el("tr", { "data-alarm": alarm.name },
    el("td", {}, alarm.name, ": ", alarm.text), el("td", {}, alarm.priority), el("td", { class: "alarm-state" }),
    el("td", {}, `${alarm.program}.${alarm.signal}`), el("td", {}, alarm.action ?? ""), el("td", {}, button));
  button.addEventListener("click", () => (row.dataset.state === "shelved" ? unshelve(alarm.name) : ask(alarm.name, row)));
  return row;
}

const unshelve = (name) => act(() => tell("/api/alarms/unshelve", { name, owner: owner(), reason: "on the page" }));

// Time and reason, in a row of the table.
function ask(name, row) {
  if (row.querySelector("form")) {
    return;
  }
  const minutes = el("input", { type: "number", min: "1", max: "1440", value: String(SHELVE_MINUTES), required: "" });
  const reason = el("input", { type: "text", maxlength: "120", required: "" });
  const close = () => form.remove();
  const send = async (event) => {
    event.preventDefault();
    const body = { name, seconds: Math.round(Number(minutes.value) * 60), owner: owner(), reason: reason.value };
    if (await act(() => tell("/api/alarms/shelve", body))) {
      close();
    }
  };
  const form = el("form", { class: "shelve", submit: send },
    el("label", {}, "Minutes ", minutes), " ", el("label", {}, "Reason ", reason), " ",
    el("button", { type: "submit" }, "Shelve"), " ", el("button", { type: "button", click: close }, "Cancel"));
  row.lastElementChild.append(form);
  reason.focus();
}
