// Drives every view of a page with Chromium, takes pictures, and fails where something is not as it has to be.
//
//   node tests/page/browser.mjs http://127.0.0.1:7480/ PICTURES [PROCESS [AXE.min.js]]
//
// The page may command a laboratory of the press cell. With the process of its server, this is suspended for some seconds. With the file of axe-core, each view is checked for accessibility too.

import { accessible, answer, call, change, click, evaluate, more, open, picture, problems, run, scheme, size, text, until } from "./chromium.mjs";

const [server, axe] = more;

const member = (name) => `g.member[data-name="${name}"]`;
const stateOf = (name) => `document.querySelector('${member(name)}')?.dataset.state`;
const lampOf = (program) => `[...document.querySelectorAll(":is(#protection-list, #protected-list) li")].find((line) => /[ ,]${program}[,:]/.test(line.textContent) || line.textContent.includes("all 2 programs"))?.dataset.protection`;
const command = async (name, what) => {
  await click(member(name));
  // A dialog that was opened while the values were old is opened again.
  await until(what, `document.querySelector("[data-command=${what}]")?.disabled === false || (document.getElementById("command").close(), document.querySelector('${member(name)}').dispatchEvent(new MouseEvent("click", { bubbles: true })), false)`);
  await answer();
  await click(`[data-command=${what}]`);
  await until("it is done", "!document.getElementById('command').open");
};

async function drive() {
  await until("everybody", `['robot', 'press', 'understudy'].every((name) => document.querySelector('g.member[data-name="' + name + '"]')?.dataset.state === 'publishing')`);
  await scheme("light");
  await until("a margin", `${text("#redundancy-words")}.includes("any one of")`);

  // The tour: three steps beside the view, by keyboard or mouse, and not again.
  const tour = (part) => `document.querySelector("#tour ${part}")`;
  await until("the tour", `${tour(".tour-step")}?.textContent === "1 of 3"`);
  await picture("tour");
  await accessible("tour", axe);
  const before = await evaluate("document.activeElement === document.body");
  if (!before) {
    problems.push("the tour took the focus without being asked for");
  }
  await click("[data-tour=next]");
  await click("[data-tour=next]");
  await until("its last step", `${tour(".tour-step")}.textContent === "3 of 3" && document.querySelectorAll(".member.tour-target").length === 3`);
  await click("[data-tour=next]");
  await until("its end", `document.getElementById("tour") === null && document.querySelector(".tour-target") === null`);
  await call("Page.reload");
  await until("everybody again", `${stateOf("robot")} === "publishing"`);
  if (await evaluate(`document.getElementById("tour") !== null`)) {
    problems.push("a tour that was ended came back");
  }
  await click("#tour-start");
  await until("the tour that was asked for", `document.activeElement?.dataset.tour === "next"`);
  await evaluate(`document.activeElement.dispatchEvent(new KeyboardEvent("keydown", { key: "Escape", bubbles: true }))`);
  await until("its end by a key", `document.getElementById("tour") === null && document.activeElement?.id === "tour-start"`);
  await until("a margin again", `${text("#redundancy-words")}.includes("any one of")`);
  await picture("cluster");
  await accessible("cluster", axe);

  // A kill: the outputs move on, and the margin shrinks.
  await click(member("robot"));
  await until("the dialog", "document.getElementById('command').open");
  await picture("command");
  await accessible("command", axe);
  await answer();
  await click("[data-command=kill]");
  await until("its end", `${stateOf("robot")} === "killed"`);
  await until("a smaller margin", `${text("#redundancy-words")}.includes("1 of 2 failures")`);
  await until("restored outputs", `document.querySelector(".picture-frame .flow[data-source=reconstructed]") !== null`);
  await picture("killed");
  await scheme("dark");
  await until("the dark", "document.documentElement.dataset.theme === 'dark'");
  await picture("killed-dark");
  await accessible("killed, dark", axe);
  await scheme("light");

  await until("a lost protection", `${lampOf("robot")} === "unprotected" && ${text("#protection-list")}.includes("robot is killed")`);

  // Why is an output as it is?
  // Asked again where this was a cycle in which a host that stands still held the outputs.
  const asked = `document.querySelector(".signal[data-kind=output]").dispatchEvent(new MouseEvent("click", { bubbles: true }))`;
  await until("an answer", `(${asked}, new Promise((resolve) => setTimeout(resolve, 1000)).then(() => !document.getElementById("why").hidden && ${text("#why")}.includes("Lineage")))`);
  await picture("why");
  await accessible("why", axe);
  await click("#why .drawer-head button");

  // A button that cannot act says why.
  await click(member("robot"));
  await until("a reason", `document.querySelector("[data-command=kill]")?.disabled && ${text("#command .actions")}.includes("cannot: it is down")`);
  await answer();
  await click("[data-command=restart]");
  await until("its return", `${stateOf("robot")} === "publishing"`);

  // A state that is lost: the understudy is cut off, then the controller is killed, then the understudy comes back with an old state.
  await until("protection", `${lampOf("robot")} === "protected" && ${lampOf("press")} === "protected"`);
  await command("understudy", "isolate");
  await until("a lost protection", `${lampOf("robot")} === "unprotected"`);
  await command("robot", "kill");
  await until("its end", `${stateOf("robot")} === "killed"`);
  await command("understudy", "rejoin");
  await until("the question", `${lampOf("robot")} === "lost" && document.querySelector("[data-choice=newest]").offsetParent !== null`);
  await picture("lost");
  await accessible("lost", axe);
  await click("[data-choice=newest]");
  await until("what it does", `${text("#command")}.includes("The plant has moved on since")`);
  await picture("choice");
  await accessible("choice", axe);
  await answer();
  await click("#confirm-choice");
  await until("an older state that goes on", `${lampOf("robot")} !== "lost" && document.querySelector(".picture-frame .flow[data-source=reconstructed]") !== null`);
  await command("robot", "restart");
  await until("its return", `${stateOf("robot")} === "publishing" && ${lampOf("robot")} === "protected"`);

  // A server that is suspended: its last values are old, and are shown so.
  if (server) {
    process.kill(Number(server), "SIGSTOP");
    try {
      await until("old values", `document.body.hasAttribute("data-stale") && ${text("#stale")}.includes("no message from the server for")`);
      await picture("suspended");
      const opacity = await evaluate("Number(getComputedStyle(document.querySelector('main')).opacity)");
      if (opacity > 0.6) {
        problems.push(`old values look as new ones: ${opacity}`);
      }
      await click(member("robot"));
      await until("a reason", `document.querySelector("[data-command=kill]").disabled && ${text("#command .obstacle")}.includes("no message")`);
      await evaluate("document.getElementById('command').close()");
    } finally {
      process.kill(Number(server), "SIGCONT");
    }
    await until("the present", `!document.body.hasAttribute("data-stale") && document.body.dataset.when === "live"`);
  }

  // Force an output, and take it back.
  await click(member("robot-io"));
  await evaluate("document.getElementById('force-signal').value = 'output 0'");
  await answer();
  await click("[data-command=force]");
  await until("a forced output", `${text(".signal-forced:not(:empty)")}.includes("forced by")`);
  await picture("forced");
  await click(member("robot-io"));
  await until("what can be taken back", `document.querySelector("[data-command=unforce]") !== null`);
  await answer();
  await click("[data-command=unforce]");
  await until("a free output", `document.querySelector(".signal-forced:not(:empty)") === null`);

  await open("ladder");
  await until("a ladder with power", `document.querySelector("#ladder-picture svg .live") !== null && ${text("#ladder-stamp")}.includes("as evaluated")`);
  await until("a cross-reference", `document.querySelectorAll("#ladder-cross tbody tr").length > 3`);
  await picture("ladder");
  await accessible("ladder", axe);
  // Why, by keyboard: Tab comes to a name, the arrow keys to the next one, whatever is drawn anew meanwhile.
  const press = (key) => evaluate(`document.activeElement.dispatchEvent(new KeyboardEvent("keydown", { key: "${key}", bubbles: true, cancelable: true }))`);
  const focused = `(document.activeElement?.getAttribute("aria-label") ?? "")`;
  await evaluate(`document.querySelector('#ladder-picture text.name[tabindex="0"]').focus()`);
  const first = await evaluate(focused);
  await press("ArrowRight");
  await until("the next name", `${focused} !== ${JSON.stringify(first)} && ${focused}.startsWith("Why ")`);
  await press("Enter");
  await until("an answer by keyboard", `document.querySelector("#why:not([hidden]) h2")?.textContent.startsWith("Why is ")`);
  await click("#why button");
  await evaluate("(() => { const palette = document.getElementById('ladder-palette'); palette.value = 'tia'; palette.dispatchEvent(new Event('change')); })()");
  await scheme("dark");
  await picture("ladder-tia-dark");
  await accessible("ladder, dark", axe);
  await scheme("light");
  await evaluate("(() => { const choose = document.getElementById('ladder-program'); choose.value = [...choose.options].at(-1).value; choose.dispatchEvent(new Event('change')); })()");
  await until("the sum", `${text("#ladder-stamp")}.includes("the sum of")`);
  await picture("sum");
  await accessible("sum", axe);

  await open("trends");
  await until("trends", `document.querySelector("#trend-plot canvas") !== null`);
  await picture("trends");
  await accessible("trends", axe);

  await open("events");
  await until("events", `${text("#event-table tbody")}.includes("killed")`);
  await until("an alarm", `document.querySelectorAll("#alarm-list li").length > 0`);
  await change("#alarm-owner", "anna");
  await click("#alarm-list li[data-state=unacknowledged] button, #alarm-list li[data-state=returned] button");
  await until("its acknowledgement", `${text("#alarm-list")}.includes("acknowledged by")`);
  await picture("events");
  await accessible("events", axe);

  await open("compare");
  await until("a comparison", `${text("#view-compare")}.includes("Compare")`);
  await picture("compare");
  await accessible("compare", axe);

  // Replay: back to the cycle of the kill.
  await open("events");
  await evaluate(`[...document.querySelectorAll("#event-table tr")].find((row) => row.textContent.includes("killed")).querySelector("button").click()`);
  await open("cluster");
  await until("the replay", "document.getElementById('live').getAttribute('aria-pressed') === 'false'");
  await click("#forth");
  await click("#forth");
  await click("#forth");
  await until("the past", `${stateOf("robot")} === "killed"`);
  await picture("replay");
  await click("#live");

  await size(390, 844, true);
  await until("live again", `${stateOf("robot")} === "publishing"`);
  for (const view of ["cluster", "ladder", "trends", "events"]) {
    await open(view);
    await until(view, `!document.getElementById("view-${view}").hidden`);
    await new Promise((resolve) => setTimeout(resolve, 800));
    await picture(`phone-${view}`);
    const wide = await evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth");
    if (wide > 1) {
      problems.push(`phone ${view}: ${wide} pixels too wide`);
    }
  }
  await accessible("phone", axe);
}

run(drive);
