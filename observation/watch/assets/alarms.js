// Alarms: what each says, and what an operator does with it.

import { act, tell, toast } from "/ask.js";
import { SIGNS } from "/banner.js";
import { el, keyed, setText } from "/element.js";
import { complete, nameField, owner, reasonField } from "/who.js";
import { clockOf } from "/zone.js";

const SHELVE_MINUTES = 60;

export function card() {
  return el("section", { class: "card", "aria-labelledby": "alarms-title" },
    el("h2", { id: "alarms-title" }, "Alarms"),
    el("p", { id: "alarm-who", class: "who" }, el("label", {}, "Your name ", nameField("alarm-owner")), " ",
      el("button", { type: "button", id: "alarm-all", click: acknowledgeAll }, "Acknowledge all")),
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
    line.dataset.state = alarm.state;
    setText(line.querySelector(".alarm-sign"), SIGNS[alarm.state]);
    const before = alarm.since_before ? " or before" : "";
    setText(line.querySelector(".alarm-words"), alarm.what);
    const when = (at, cycle) => [clockOf(at, state.at), at ? `(cycle ${cycle})` : `cycle ${cycle}`].filter(Boolean).join(" ");
    const over = alarm.lasts ? null : `returned to normal ${when(alarm.over_at, alarm.over)}`;
    const facts = [alarm.who, alarm.priority, `since ${when(alarm.at, alarm.cycle)}${before}`, over, alarm.action];
    const seen = by ? `acknowledged by ${by}, ${when(alarm.acknowledged_at, alarm.acknowledged_in)}` : null;
    setText(line.querySelector(".alarm-by"), [...facts, seen].filter(Boolean).join(" · "));
    line.querySelector("button").hidden = Boolean(by);
  });
  const alarms = state.process_alarms;
  unseen = state.alarms.filter((alarm) => !alarm.acknowledged).map((alarm) => alarm.id);
  document.getElementById("alarm-who").hidden = alarms.length === 0 && unseen.length === 0;
  document.getElementById("alarm-all").hidden = unseen.length < 2;
  document.getElementById("signal-alarms").hidden = alarms.length === 0;
  keyed(document.querySelector("#signal-alarm-table tbody"), alarms, (alarm) => alarm.name, makeSignalAlarm, (row, alarm) => {
    const { shelved } = alarm;
    row.dataset.state = alarm.state;
    const words = shelved ? `shelved until ${clockOf(shelved.until_at, state.at) || `cycle ${shelved.until}`} by ${shelved.owner}: ${shelved.reason}` : alarm.state;
    setText(row.querySelector(".alarm-state"), words);
    setText(row.querySelector("button"), shelved ? "End shelving" : "Shelve");
  });
}

const hasName = () => complete(document.getElementById("alarm-owner"));

// The listed alarms that wait for a person.
let unseen = [];

const acknowledge = (alarms, what) => act(async () => {
  if (hasName()) {
    await tell("api/alarms/acknowledge", { alarms, owner: owner() });
    toast(`✓ ${what} acknowledged, by ${owner()}`);
  }
});

function acknowledgeAll() {
  acknowledge(unseen, `${unseen.length} alarms`);
}

function makeAlarm(alarm) {
  const seen = () => acknowledge([alarm.id], `${alarm.who}: alarm of cycle ${alarm.cycle}`);
  return el("li", {}, el("span", { class: "alarm-sign", "aria-hidden": "true" }), el("span", { class: "alarm-words" }), el("span", { class: "alarm-by" }),
    el("button", { type: "button", click: seen }, "Acknowledge"));
}

function makeSignalAlarm(alarm) {
  const button = el("button", { type: "button" }, "Shelve");
  const row = el("tr", { "data-alarm": alarm.name },
    el("td", {}, alarm.name, ": ", alarm.text), el("td", {}, alarm.priority), el("td", { class: "alarm-state" }),
    el("td", {}, `${alarm.program}.${alarm.signal}`), el("td", {}, alarm.action ?? ""), el("td", {}, button));
  button.addEventListener("click", () => ask(alarm.name, row, row.dataset.state === "shelved"));
  return row;
}

// The reason, and for shelving the time, in a row of the table.
function ask(name, row, ends) {
  if (row.querySelector("form")) {
    return;
  }
  const minutes = el("input", { type: "number", min: "1", max: "1440", value: String(SHELVE_MINUTES), required: "" });
  const reason = reasonField();
  const close = () => form.remove();
  const send = (event) => {
    event.preventDefault();
    if (hasName()) {
      const body = { name, owner: owner(), reason: reason.value };
      const done = ends ? tell("api/alarms/unshelve", body) : tell("api/alarms/shelve", { ...body, seconds: Math.round(Number(minutes.value) * 60) });
      act(async () => {
        await done;
        close();
        toast(`✓ ${name}: ${ends ? "shelving ended" : `shelved for ${minutes.value} min`}, by ${body.owner}`);
      });
    }
  };
  const form = el("form", { class: "shelve", submit: send },
    ends ? null : [el("label", {}, "Minutes ", minutes), " "], el("label", {}, "Reason ", reason), " ",
    el("button", { type: "submit" }, ends ? "End shelving" : "Shelve"), " ", el("button", { type: "button", click: close }, "Cancel"));
  row.lastElementChild.append(form);
  reason.focus();
}
