// Colours by what a person has to do: a healthy cluster has no red, and fail-safe outputs are the reddest thing on the page.

import { call, click, evaluate, picture, problems, run, scheme, size, text, until } from "./chromium.mjs";
import { redPixels } from "./pixels.mjs";

const member = (name) => `g.member[data-name="${name}"]`;
const stateOf = (name) => `document.querySelector('${member(name)}')?.dataset.state`;
const isHealthy = `['robot', 'press', 'understudy'].every((name) => document.querySelector('g.member[data-name="' + name + '"]')?.dataset.state === 'publishing')
  && document.querySelectorAll(".picture-frame .flow[data-source=direct]").length === 4 && ${text("#protection-words")} === "all 2 programs are protected"`;
const sees = (found, expected) => {
  if (!found) {
    problems.push(expected);
  }
};
const kill = (name) => evaluate(`fetch("/api/command", { method: "POST", headers: { "content-type": "application/json", "x-understudy": "1" },
  body: JSON.stringify({ member: "${name}", command: { command: "kill" }, owner: "anna", reason: "a test" }) }).then((answer) => answer.status)`);

// Where an element is in the picture.
const box = (selector) => evaluate(`(() => { const { left, right, top, bottom } = document.querySelector(${JSON.stringify(selector)}).getBoundingClientRect(); return { left, right, top, bottom }; })()`);
const within = (pixels, { left, right, top, bottom }) => pixels.filter(([x, y]) => x >= left && x <= right && y >= top && y <= bottom);

// A table never hides its last column, which is that of the fail-safe deadlines.
async function showsFailSafe(width) {
  const hides = await evaluate(`(() => { const wide = document.querySelector("#counts-card .wide"); return wide.scrollWidth - wide.clientWidth; })()`);
  sees(hides <= 1, `at ${width} px the table of deadlines hides ${hides} px`);
}

run(async () => {
  await until("a tour", `document.querySelector("[data-tour=skip]") !== null || document.getElementById("tour") !== null`);
  await click("#tour-start");
  await evaluate(`document.activeElement.dispatchEvent(new KeyboardEvent("keydown", { key: "Escape", bubbles: true }))`);
  await size(1360, 1300, false);
  for (const look of ["light", "dark"]) {
    await scheme(look);
    await until(look, `document.documentElement.dataset.theme === "${look}"`);
    await until("a healthy cluster", isHealthy);
    await picture(`calm-${look}`);
    const red = within(await redPixels(), await box("main"));
    // A stall of the host may have held outputs just then.
    sees(red.length === 0 || !(await evaluate(isHealthy)), `a healthy cluster has ${red.length} red pixels, the first at ${red[0]} (${look})`);
  }
  await scheme("light");
  await showsFailSafe(1360);
  await size(390, 1300, true);
  await new Promise((resolve) => setTimeout(resolve, 300));
  // The understudy is in sight without scrolling, whatever the width.
  await until("the understudy first", `document.querySelector('${member("understudy")} rect').getBoundingClientRect().right <= innerWidth`);
  await showsFailSafe(390);
  await size(1360, 1300, false);

  sees((await kill("understudy")) === 200, "the understudy is not killed");
  await until("its end", `${stateOf("understudy")} === "killed"`);
  sees((await kill("robot")) === 200, "the robot is not killed");
  await until("fail-safe outputs", `document.querySelector('${member("robot-io")}')?.dataset.source === "fail-safe"`);
  await until("an alarm", `!document.getElementById("alarm-count").hidden`);
  await call("Page.bringToFront");
  await picture("fail-safe");
  const red = await redPixels();
  const [remote, plant, failed, frame] = [await box(member("robot-io")), await box(member("arm")), await box(member("robot")), await box(".picture-frame")];
  const shown = within(red, frame);
  const marked = within(shown, { left: remote.left - 4, right: remote.right + 14, top: remote.top - 60, bottom: plant.bottom + 4 });
  sees(marked.length > 2000, `the fail-safe outputs have ${marked.length} red pixels`);
  sees(shown.length - marked.length === 0, `${shown.length - marked.length} red pixels of the picture belong to no fail-safe output`);
  sees(within(red, failed).length === 0, "a station that is killed is as red as what it means for the plant");
});
