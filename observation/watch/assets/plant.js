// The page of a plant: asked once a second. What is not confirmed for three seconds is marked as the past.

import { ask } from "./ask.js";
import { el } from "./element.js";

const AGAIN_MS = 1000;
const STALE_MS = 3000;
const SIGNS = { complete: "✓", reduced: "△", unprotected: "✗", "not-observed": "?", asleep: "✓", waking: "△", serving: "△", "not-received": "✗" };
const GOOD = ["complete", "asleep"];

const id = (name) => document.getElementById(name);

let confirmed = performance.now();

const state = (word) => el("td", { class: GOOD.includes(word) ? "good" : "bad", "data-state": word }, `${SIGNS[word] ?? "?"} ${word.replace("-", " ")}`);

function survives(count) {
  if (count === null) {
    return "not known";
  }
  return count === 0 ? "none" : `any ${count} station${count === 1 ? "" : "s"}`;
}

function show(plant) {
  const cell = (label, text) => el("td", { "data-label": label }, text);
  const names = (list) => (list.length === 0 ? "–" : list.join(", "));
  id("alarms").replaceChildren(...(plant.alarms.length === 0
    ? [el("li", { class: "soft" }, "No alarm")]
    : plant.alarms.map((alarm) => el("li", { class: "bad", "data-alarm": alarm.alarm }, `✗ ${alarm.text}`))));
  id("groups").replaceChildren(...plant.groups.map((group) => el("tr", { "data-group": group.name },
    el("th", { scope: "row" }, group.state === "not-observed" ? group.name : el("a", { href: `group/${group.name}/` }, group.name)), state(group.state), cell("Remaining redundancy", survives(group.survives)), cell("Failed", names(group.failed)), cell("Spare", names(group.spares)), cell("Reason", group.reason ?? "–"))));
  id("spares").replaceChildren(...plant.spares.map((spare) => el("tr", { "data-spare": spare.name },
    el("th", { scope: "row" }, spare.name), state(spare.state), cell("Group", spare.group ?? "–"))));
  const lacking = plant.groups.filter((group) => group.state === "unprotected" || group.state === "not-observed");
  id("status").textContent = lacking.length === 0 ? "all groups are protected" : `not protected, or not observed: ${lacking.map((group) => group.name).join(", ")}`;
  id("status").classList.toggle("lost", lacking.length > 0);
}

function mark(problem) {
  const age = performance.now() - confirmed;
  const isStale = age > STALE_MS;
  id("stale").hidden = !isStale;
  document.body.toggleAttribute("data-stale", isStale);
  if (isStale) {
    id("stale").textContent = `This is the past: nothing was received for ${Math.round(age / 1000)} s${problem ? ` (${problem})` : ""}`;
  }
}

let problem = "";

async function look() {
  try {
    show(await ask("api/plant"));
    confirmed = performance.now();
    problem = "";
  } catch (error) {
    problem = error.message;
  }
  setTimeout(look, AGAIN_MS);
}

setInterval(() => mark(problem), 500);
look();
