// Writes operator inputs of the example two-shuttles in the view Operate, takes pictures, and fails where something is not as it has to be.
//
//   node tests/page/operate.mjs http://127.0.0.1:7480/ PICTURES [AXE.min.js]
//
// The page may command a laboratory of two-shuttles that nobody has written to yet.

import { accessible, answer as asked, change, click, evaluate, more, open, picture, problems, run, scheme, size, text, until } from "./chromium.mjs";

const [axe] = more;

const control = (program, input) => `[data-program=${program}] [data-input=${input}]`;
const answer = (program, input) => text(`${control(program, input)} .control-answer`);
const value = (program, input) => text(`${control(program, input)} .control-value`);
const state = "fetch('/api/state').then((answer) => answer.json())";
const output = async (program, name) => {
  const facts = `fetch('/api/run').then((answer) => answer.json()).then((run) => run.programs[${program}].outputs.findIndex((output) => output.name === ${JSON.stringify(name)}))`;
  return `Promise.all([${state}, ${facts}]).then(([state, index]) => state.programs[${program}].output_values[index])`;
};
const type = (selector, words) => evaluate(`(() => { const entry = document.querySelector(${JSON.stringify(selector)}); entry.value = ${JSON.stringify(words)}; entry.dispatchEvent(new Event("input", { bubbles: true })); })()`);

async function drive() {
  await until("the tab", "document.getElementById('tab-operate')?.hidden === false");
  await evaluate("localStorage.setItem('tour', 'seen'), document.querySelector('[data-tour=skip]')?.click()");
  await scheme("light");
  await size(1360, 1000, false);
  await open("operate");
  await until("a control that can be used", `document.querySelector("${control("left", "start")} button")?.disabled === false`);
  await until("the sampled speed", `${value("left", "speed")} === "100 mm/s"`);

  // Cycles are counted from the origin.
  await until("the origin", `fetch("/api/events?find=origin").then((answer) => answer.json()).then(({ events }) => events.length > 0)`);
  const shown = await evaluate(`${state}.then((state) => state.cycle)`);
  await until("a newer state", `${state}.then((state) => state.cycle !== ${shown})`);

  // Start: the output of the program changes, and the answer has the cycle of the write.
  const running = await output(0, "running");
  if ((await evaluate(running)) !== false) {
    problems.push("the shuttle ran before it was started");
  }
  const before = await evaluate(`${state}.then((state) => state.cycle)`);
  await click(`${control("left", "start")} button`);
  await until("the question for a name", `${answer("left", "start")}.includes("enter your name and the reason") && document.activeElement.id === "operate-owner"`);
  await change("#operate-owner", "anna");
  await change("#operate-reason", "a test");
  await click(`${control("left", "start")} button`);
  await until("the answer", `/in effect since cycle \\d+/.test(${answer("left", "start")})`);
  const cycle = Number(await evaluate(`${answer("left", "start")}.match(/cycle (\\d+)/)[1]`));
  await until("a shuttle that runs", `${running}.then((value) => value === true)`);
  const now = await evaluate(`${state}.then((state) => state.cycle)`);
  if (!(cycle >= before && cycle <= now)) {
    problems.push(`the write is in effect since cycle ${cycle}, not between ${before} and ${now}`);
  }

  // A number outside the limits is reported before it is sent, and cannot be sent.
  const speed = control("left", "speed");
  await type(`${speed} .entry`, "250");
  await until("the limits", `${answer("left", "speed")}.includes("outside the limits from 0 to 200 mm/s") && document.querySelector("${speed} button").disabled`);
  await picture("operate-limits");
  await type(`${speed} .entry`, "180");
  await evaluate(`document.querySelector("${speed} form").requestSubmit()`);
  await until("the speed", `${answer("left", "speed")}.includes("180 mm/s in effect since cycle") && ${value("left", "speed")} === "180 mm/s"`);

  // An input with a confirmation.
  const automatic = control("left", "automatic");
  await click(`${automatic} button`);
  await until("the question", `document.querySelector("${automatic} .control-asks").hidden === false && document.activeElement?.textContent === "Confirm"`);
  await picture("operate-confirm");
  await accessible("operate", axe);
  await click(`${automatic} .confirm`);
  await until("the mode", `${value("left", "automatic")} === "0" && document.querySelector("${automatic} [role=switch]").getAttribute("aria-checked") === "false"`);

  // A cycle of the past takes no write.
  await click("#back");
  await until("the reason", `${text("#operate-obstacle")}.includes("this is a replay: go live to command") && document.querySelector("${control("left", "start")} button").disabled`);
  await click("#live");
  await until("a control again", `document.querySelector("${control("left", "start")} button").disabled === false`);

  // Who reads whom.
  await until("valid signals", `document.querySelectorAll(".arrow[data-valid=true]").length === 3`);
  await until("the list", `${text("#reads-list")}.includes("right reads left.grant as granted = ")`);
  await picture("operate");
  await scheme("dark");
  await until("the dark", "document.documentElement.dataset.theme === 'dark'");
  await picture("operate-dark");
  await accessible("operate, dark", axe);

  // A remote I/O that is down takes no write, and its own signals are not known; the other reads the default values.
  const command = (member, name) => `fetch("/api/command", { method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify({ member: "${member}", command: { command: "${name}" }, owner: "anna", reason: "a test" }) }).then((answer) => answer.ok)`;
  await until("its end", command("right-io", "kill"));
  await until("the reason", `${text("[data-program=right] .obstacle")}.includes("right-io is killed") && document.querySelector("${control("right", "start")} button").disabled`);
  await until("default values", `document.querySelectorAll(".arrow[data-valid=false]").length === 2`);
  await picture("operate-down-dark");
  await scheme("light");
  await until("the light", "document.documentElement.dataset.theme === 'light'");
  await size(390, 844, true);
  await picture("operate-phone-down");
  await until("its return", command("right-io", "restart"));
  await until("a control again", `document.querySelector("${control("right", "start")} button").disabled === false`);
  await picture("operate-phone");
  await scheme("dark");
  await until("the dark", "document.documentElement.dataset.theme === 'dark'");
  await picture("operate-phone-dark");
  const wide = await evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth");
  if (wide > 1) {
    problems.push(`phone: ${wide} pixels too wide`);
  }
  await evaluate("document.getElementById('reads-title').scrollIntoView()");
  await picture("operate-phone-reads");
  await accessible("operate, phone", axe);

  // A number is forced.
  await size(1360, 1000, false);
  await scheme("light");
  await open("cluster");
  await click('g.member[data-name="left-io"]');
  await evaluate(`(() => { const which = document.getElementById("force-signal"); which.value = [...which.options].find((option) => option.textContent === "input speed").value; which.dispatchEvent(new Event("change")); })()`);
  await type("#force-number", "12.5");
  await picture("force");
  await asked();
  await click("[data-command=force]");
  await until("a forced number", `${text(".signal-forced:not(:empty)")}.includes("forced by") && ${text('.signal[data-kind=input][data-value="12.5"]')}.includes("speed")`);
  await click('g.member[data-name="left-io"]');
  await until("what can be taken back", `${text("#command fieldset ul")}.includes("input speed = 12.5")`);
  await asked();
  await click("[data-command=unforce]");
  await until("a free input", `document.querySelector(".signal-forced:not(:empty)") === null`);
}

run(drive);
