// The alarm banner at the head of the page: the alarm that needs a response first, in every view and at every place of it.

import { setAttribute, setText } from "/element.js";
import { clockOf } from "/zone.js";

// How long a return to normal of an acknowledged alarm stays in the banner.
const RETURN_SHOWN_S = 60;

// A sign for each state of an alarm: its colour says it a second time.
export const SIGNS = { unacknowledged: "⚠", acknowledged: "✓", returned: "↩", normal: "✓" };

let periodUs = 0;

export function prepare(run) {
  periodUs = run.period_us;
  document.getElementById("alarm-count").addEventListener("click", () => (location.hash = "events"));
  // What is scrolled to by its address or by the keyboard is not hidden behind the head.
  const measure = () => {
    const style = document.documentElement.style;
    style.setProperty("--strip", `${document.getElementById("strip").offsetHeight}px`);
    const sticky = ["head", "strip", "timebar"].map((id) => document.getElementById(id)).filter((part) => getComputedStyle(part).position === "sticky");
    style.setProperty("--head", `${sticky.reduce((height, part) => height + part.offsetHeight, 0)}px`);
  };
  const observer = new ResizeObserver(measure);
  for (const id of ["strip", "timebar", "views"]) {
    observer.observe(document.getElementById(id));
  }
}

const when = (at, cycle, now) => clockOf(at, now) || `cycle ${cycle}`;

// A return to normal that no alarm of the list asks a person for, as long as it is new.
const isNewReturn = (alarm, state) => alarm.state === "normal" && (state.cycle - alarm.over) * periodUs <= RETURN_SHOWN_S * 1_000_000;

// The alarm that is shown, with its words: those come first that wait for a person.
function shown(state) {
  const alarm = ["unacknowledged", "returned", "acknowledged"].map((wanted) => state.alarms.find((alarm) => alarm.state === wanted)).find(Boolean)
    ?? state.alarms.filter((alarm) => isNewReturn(alarm, state)).sort((one, other) => other.over - one.over)[0];
  if (!alarm) {
    return ["none", state.past ? "" : "No open alarms"];
  }
  const over = `returned to normal ${when(alarm.over_at, alarm.over, state.at)}`;
  const since = `since ${when(alarm.at, alarm.cycle, state.at)}`;
  const what = alarm.what.includes(alarm.who) ? alarm.what : `${alarm.who}: ${alarm.what}`;
  const words = {
    unacknowledged: `${what} · ${since}`,
    returned: `${over}, not acknowledged · ${what}`,
    acknowledged: `${what} · ${since}, acknowledged by ${alarm.acknowledged}`,
    normal: `${over} · ${what}`,
  };
  return [alarm.state, `${SIGNS[alarm.state]} ${words[alarm.state]}`];
}

export function show(state) {
  const open = state.open_alarms;
  const waiting = state.unacknowledged_alarms;
  const button = document.getElementById("alarm-count");
  button.hidden = open === 0;
  const count = open === 1 ? "1 alarm" : `${open} alarms`;
  const seen = waiting === 0 ? ", acknowledged" : waiting < open ? `, ${waiting} not acknowledged` : "";
  setText(button, state.past ? `⚠ at least ${count}` : `${waiting > 0 ? "⚠" : "✓"} ${count}${seen}`);
  const [level, words] = shown(state);
  setAttribute(button, "data-state", level);
  const place = document.getElementById("alarm-banner");
  setAttribute(place, "data-state", level);
  setAttribute(place, "title", words);
  setText(place, words);
}
