// The overview of a finished run of 24 programs: robot-4 has crashed in cycle 60, an understudy in cycle 120, and press-9 in cycle 180.

import { click, evaluate, open, picture, problems, run, scheme, size, text, until } from "./chromium.mjs";
import { redPixels } from "./pixels.mjs";

const sees = (found, expected) => {
  if (!found) {
    problems.push(expected);
  }
};
const tiles = (level) => `[...document.querySelectorAll('.tile${level ? `[data-level="${level}"]` : ""}')].map((tile) => tile.dataset.program)`;
const words = (program) => `document.querySelector('.tile[data-program="${program}"]')?.getAttribute("aria-label") ?? ""`;
const understudies = `[...document.querySelectorAll(".understudy")].map((chip) => chip.textContent).join(" ")`;

run(async () => {
  await open("cluster?cycle=40");
  await size(1360, 900, false);
  await until("a normal cluster", `${text("#overview-words")} === "all 24 programs normal"`);
  await evaluate(`localStorage.setItem("tour", "seen"); document.querySelector("[data-tour=skip]")?.click()`);
  sees((await evaluate(`${tiles()}.length`)) === 24, "a program has no tile");
  for (const look of ["light", "dark"]) {
    await scheme(look);
    await until(look, `document.documentElement.dataset.theme === "${look}"`);
    await picture(`overview-normal-${look}`);
    const red = await redPixels();
    sees(red.length === 0, `a normal cluster has ${red.length} red pixels, the first at ${red[0]} (${look})`);
  }
  sees(await evaluate(`(() => { const { bottom } = document.querySelector("#overview").getBoundingClientRect(); return bottom < innerHeight; })()`), "24 programs do not fit into the window");

  await open("cluster?cycle=100");
  await until("a crash", `${text("#overview-words")} === "23 of 24 programs normal"`);
  sees((await evaluate(words("robot-4"))).includes("controller killed; outputs reconstructed from understudy"), `robot-4 is ${await evaluate(words("robot-4"))}`);
  await open("cluster?cycle=230");
  await until("a second crash", `${text("#overview-words")} === "22 of 24 programs normal"`);
  sees((await evaluate(words("press-9"))) === "press-9: controller killed; not protected; outputs reconstructed from understudy-robot", `press-9 is ${await evaluate(words("press-9"))}`);
  sees((await evaluate(understudies)).includes("● understudy-robot: publishing ✕ understudy-press: killed"), `the understudies are ${await evaluate(understudies)}`);

  // Only what is not normal: in the tiles, the deadlines and the signals. The address has it.
  const wanted = await evaluate(`[...document.querySelectorAll('.tile:not([data-level="normal"])')].map((tile) => tile.dataset.program).join()`);
  await click("#only-not-normal");
  await until("what is not normal", `${tiles()}.join() === "${wanted}" && ${tiles("normal")}.length === 0`);
  sees((await evaluate(`[...document.querySelectorAll("#counts-table tbody tr")].map((row) => row.dataset.key).join()`)) === wanted, "the deadlines are of other programs");
  sees((await evaluate(`[...document.querySelectorAll("#signals-list details")].map((row) => row.dataset.program).join()`)) === wanted, "the signals are of other programs");
  await until("its address", `location.hash.includes("only=1")`);
  await click('.tile[data-program="press-9"]');
  await until("its picture", `document.querySelector('.picture g.member[data-name="press-9"]') !== null && document.querySelector('.picture g.member[data-name="robot-4"]') === null`);
  sees(await evaluate(`["understudy-robot", "understudy-press"].every((name) => document.querySelector('.picture g.member[data-name="' + name + '"]'))`), "the picture of a program has no understudy");
  await until("its address", `location.hash.includes("program=9")`);
  await picture("overview-only");

  // The understudies are in sight at every place.
  for (const [width, mobile] of [[1360, false], [390, true]]) {
    await size(width, 844, mobile);
    await click("#only-not-normal");
    await until("a size", `innerWidth === ${width}`);
    for (const look of ["light", "dark"]) {
      await scheme(look);
      await until(look, `document.documentElement.dataset.theme === "${look}"`);
      await evaluate("scrollTo(0, 600)");
      await until("understudies in sight", `[...document.querySelectorAll(".understudy")].every((chip) => { const { left, top, width, height } = chip.getBoundingClientRect(); return chip.contains(document.elementFromPoint(left + width / 2, top + height / 2)); })`);
      await picture(`overview-${width}-${look}`);
    }
    await evaluate("scrollTo(0, 0)");
    await picture(`overview-top-${width}`);
  }
  sees(await evaluate("document.documentElement.scrollWidth <= innerWidth"), "the page is wider than a narrow window");

  // A link shows the same to another person.
  await open("cluster?cycle=230&program=4&only=1");
  await until("what the link has", `document.getElementById("only-not-normal").checked && document.querySelector('.tile[data-program="robot-4"]').getAttribute("aria-pressed") === "true"`);
});
