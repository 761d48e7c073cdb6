// The page of a plant: in both groups a controller has crashed, and no spare reports. Each group links to its page.

import { evaluate, picture, problems, run, scheme, size, text, until } from "./chromium.mjs";

const sees = (found, expected) => {
  if (!found) {
    problems.push(expected);
  }
};
const state = (group) => `(document.querySelector('[data-group="${group}"] [data-state]')?.dataset.state ?? "")`;

run(async () => {
  await size(1360, 900, false);
  await until("both groups", `["line-1", "line-2"].every((name) => document.querySelector('[data-group="' + name + '"] [data-state="unprotected"]'))`);
  for (const group of ["line-1", "line-2"]) {
    sees((await evaluate(text("#alarms"))).includes(`${group} is UNPROTECTED (failed: robot)`), `the alarms do not name ${group}: ${await evaluate(text("#alarms"))}`);
  }
  sees((await evaluate(text("#status"))).includes("line-1, line-2"), `the status is ${await evaluate(text("#status"))}`);
  sees(await evaluate(`document.querySelector('[data-spare="spare-1"] [data-state="not-received"]') !== null`), "a spare that does not report seems to wait");
  for (const [width, mobile] of [[1360, false], [390, true]]) {
    await size(width, 844, mobile);
    for (const look of ["light", "dark"]) {
      await scheme(look);
      await until(look, `document.documentElement.dataset.theme === "${look}"`);
      await picture(`plant-${width}-${look}`);
    }
    sees(await evaluate("document.documentElement.scrollWidth <= innerWidth"), `the page is wider than a window of ${width} pixels`);
    sees(await evaluate(`[...document.querySelectorAll(".card")].every((card) => card.scrollWidth <= card.clientWidth + 1)`), `a table is wider than its card at ${width} pixels`);
    sees(await evaluate(`[...document.querySelectorAll("td, th, li")].every((cell) => cell.scrollWidth <= cell.clientWidth + 1)`), `a cell is cut off at ${width} pixels`);
  }
  // The page of a group is that of its run, and read-only.
  await evaluate(`document.querySelector('[data-group="line-2"] a').click()`);
  await until("the page of the group", `location.pathname === "/group/line-2/" && document.querySelector(".picture g.member") !== null`);
  await until("the crash there", `document.querySelector(".picture g.member[data-name=robot]")?.textContent.includes("killed")`);
  await picture("plant-group");
  await evaluate('location.assign("/")');
  await until("the plant again", `location.pathname === "/" && ${state("line-2")} === "unprotected"`);
});
