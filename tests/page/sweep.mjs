// Checks each view with axe-core, on a desk and on a phone, light and dark, while all is well and after a controller was killed and an output forced.
//
//   node tests/page/sweep.mjs http://127.0.0.1:7480/ PICTURES AXE.min.js
//
// The page may command a laboratory whose remote I/O are named NAME-io, as in the examples press-cell and two-shuttles. Its first controller is killed.

import { accessible, answer, change, click, evaluate, more, open, picture, run, scheme, size, text, until } from "./chromium.mjs";

const [axe] = more;
const SIZES = [
  [1360, 1000, false],
  [390, 844, true],
];
const THEMES = ["light", "dark"];
const members = "[...document.querySelectorAll('g.member')]";

async function check(name) {
  for (const [width, height, mobile] of SIZES) {
    await size(width, height, mobile);
    for (const theme of THEMES) {
      await scheme(theme);
      await until(theme, `document.documentElement.dataset.theme === '${theme}'`);
      // Colours change gradually.
      await until("colours that stay", "document.getAnimations().every((animation) => animation.effect.getTiming().iterations === Infinity || animation.playState === 'finished')");
      // Old values are pale on purpose, with less contrast than axe-core wants.
      await until("present values", "!document.body.hasAttribute('data-stale')");
      await picture(`${name}-${width}-${theme}`);
      await accessible(`${name}, ${width} pixels, ${theme}`, axe);
    }
  }
  await size(...SIZES[0]);
}

async function views(state) {
  const tabs = await evaluate("[...document.querySelectorAll('a[id^=tab-]')].filter((tab) => !tab.hidden).map((tab) => tab.id.slice(4))");
  for (const view of tabs) {
    await open(view);
    await until(view, `!document.getElementById("view-${view}").hidden`);
    await new Promise((resolve) => setTimeout(resolve, 600));
    await check(`${view}-${state}`);
  }
}

async function dialog(member, name) {
  await open("cluster");
  await click(member);
  await until("the dialog", "document.getElementById('command').open");
  await check(name);
}

async function drive() {
  await until("everybody", `${members}.length > 2 && ${members}.every((member) => !["killed", "lost"].includes(member.dataset.state))`);
  await until("a margin", `${text("#redundancy-words")}.includes("any one of")`);
  await until("the tour", "document.querySelector('[data-tour=next]') !== null");
  await check("tour");
  await evaluate("localStorage.setItem('tour', 'seen'), document.querySelector('[data-tour=skip]')?.click()");
  await views("well");

  const name = await evaluate("fetch('/api/state').then((answer) => answer.json()).then((state) => state.members.find((member) => member.kind === 'controller').name)");
  const killed = `g.member[data-name="${name}"]`;
  await dialog(`g.member[data-name="${name}-io"]`, "force");
  await change("#force-signal", "output 0");
  await change("#force-number", "0");
  await answer();
  await click("[data-command=force]");
  await until("a message", `!document.getElementById('command').open`);
  await dialog(killed, "command");
  await answer();
  await click("[data-command=kill]");
  await until("its end", `document.querySelector('${killed}').dataset.state === "killed"`);
  await dialog(killed, "command-killed");
  await evaluate("document.getElementById('command').close()");
  await views("killed");

  await open("cluster");
  const asked = `document.querySelector(".signal[data-kind=output]").dispatchEvent(new MouseEvent("click", { bubbles: true }))`;
  await until("an answer", `(${asked}, new Promise((resolve) => setTimeout(resolve, 1000)).then(() => !document.getElementById("why").hidden && ${text("#why")}.includes("Lineage")))`);
  await check("why");
  await click("#why .drawer-head button");
  await click("#back");
  await until("a replay", "document.body.dataset.when === 'replay'");
  await check("replay");
}

run(drive);
