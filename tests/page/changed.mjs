// An online change: the page shows where its members are, and the text and the variables of the program that runs.

import { execFileSync } from "node:child_process";

import { evaluate, more, open, run, text, until } from "./chromium.mjs";

const [binary, directory, after] = more;
const step = (name) => execFileSync(binary, ["change", directory, after, name]);
const includes = (selector, words) => `${text(selector)}.includes(${JSON.stringify(words)})`;

run(async () => {
  await until("a live page", includes("#status", "live"));
  await evaluate(`localStorage.setItem("tour", "done"); document.querySelector("[data-tour=skip]")?.click()`);
  await until("no change", `document.getElementById("online-change").hidden`);
  await open("ladder");
  await until("the old program", includes("#view-ladder", "count := count + 1;"));
  step("prepare");
  await until("prepared members", includes("#online-change", "counter runs the old program; prepared: counter, understudy, counter-io"));
  step("switch");
  await until("the new program", includes("#view-ladder", "count := count + 10;"));
  await until("its variables", includes("#ladder-cross", "added"));
  await until("the switch", includes("#online-change", "counter runs the new program"));
  step("accept");
  await until("the end of the change", `document.getElementById("online-change").hidden`);
});
