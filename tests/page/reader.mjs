// Reads a laboratory as an operator does: events by severity, all rungs, the watch table, trends as files, replay, and links that show the same.
//
//   node tests/page/reader.mjs http://127.0.0.1:7480/ PICTURES [AXE.min.js]
//
// The page may command a laboratory of the press cell whose robot has 90 more rungs, a timer `lap.time` and a counter `laps`.

import { accessible, answer, call, change, click, evaluate, more, open, picture, problems, run, scheme, size, text, until } from "./chromium.mjs";

const [axe] = more;

const check = (what, holds) => {
  if (!holds) {
    problems.push(what);
  }
};
const command = (member, name) => `fetch("/api/command", { method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify({ member: "${member}", command: { command: "${name}" }, owner: "anna", reason: "a test" }) }).then((answer) => answer.ok)`;
const shownCycle = "Number(document.getElementById('scrub').value)";
const hash = () => evaluate("location.hash");
const rows = (table) => `[...document.querySelectorAll("#${table} tbody tr")]`;

// The page as another person sees it, who has nothing but the link.
async function elsewhere(link) {
  await evaluate("localStorage.clear()");
  const page = await evaluate("location.origin");
  await call("Page.navigate", { url: "about:blank" });
  await call("Page.navigate", { url: `${page}/${link}` });
  await until("the page", "document.querySelector('g.member') !== null");
}

async function commands() {
  await open("cluster");
  await click('g.member[data-name="robot-io"]');
  await until("empty fields", `document.getElementById("command-owner")?.value === "" && document.getElementById("command-reason").value === ""`);
  await change("#force-signal", "output 4");
  await click("[data-command=force]");
  check("a command without a name was sent", await evaluate("document.getElementById('command').open && document.activeElement.id === 'command-owner'"));
  await answer("anna", "   ");
  await click("[data-command=force]");
  check("a command with a blank reason was sent", await evaluate("document.getElementById('command').open && document.activeElement.id === 'command-reason'"));
  await answer("anna", "to see it");
  await change("#force-seconds", "600");
  await click("[data-command=force]");
  await until("what was done", `${text("#toast")}.includes("robot-io: output grip forced to 1 for 600 s, by anna")`);
  // At the end of the page nothing of the view is behind the line with the message.
  const covered = await evaluate("(scrollTo(0, document.body.scrollHeight), document.querySelector('main').getBoundingClientRect().bottom - document.querySelector('.foot').getBoundingClientRect().top)");
  check(`the message covers ${covered} pixels`, covered <= 1);
  await picture("toast");
  await evaluate("scrollTo(0, 0)");
}

async function ladder() {
  await open("ladder?program=0");
  await until("the first page", `${text("#page-words")}.includes("rungs 1 to 40 of 104, page 1 of 3")`);
  await until("a force mark", `document.querySelectorAll(".forced-mark").length > 0 && ${text("#ladder-forced")}.includes("output grip = 1, forced by anna: to see it")`);
  await picture("ladder-forced");
  await accessible("ladder", axe);
  await click("#page-on");
  await until("the next page", `${text("#page-words")}.includes("rungs 41 to 80") && ${text("#ladder-picture svg")}.includes("extra_50")`);
  await until("its address", "location.hash.includes('page=2')");
  await change("#ladder-rung", "104");
  await until("the last rung", `${text("#page-words")}.includes("rungs 81 to 104") && ${text("#ladder-picture svg")}.includes("extra_90")`);
  await evaluate(`[...document.querySelectorAll("#ladder-cross button")].find((button) => button.textContent === "45").click()`);
  await until("a rung of the cross-reference", `${text("#page-words")}.includes("rungs 41 to 80")`);
  await change("#ladder-find", "extra_9");
  // extra_9 and extra_90, each with its coil, and the rung behind extra_9, which has its contact.
  await until("found rungs", `${text("#ladder-stamp")}.includes("3 of 104 rungs") && document.getElementById("ladder-pages").hidden`);
  await click("#back");
  await until("a replay", "document.body.dataset.when === 'replay' && /cycle=\\d+/.test(location.hash)");
  const link = await hash();
  await elsewhere(link);
  await until("the same rungs", `document.body.dataset.when === "replay" && ${text("#ladder-stamp")}.includes("3 of 104 rungs")`);
  await until("the same address", `location.hash === ${JSON.stringify(link)}`);
  await click("#live");
}

async function watch() {
  await open("watch");
  const signals = { "0.state.laps.CV": "robot.laps.CV", "0.state.lap.time.ET": "TIME", "0.state.holding": "gripper holds", "0.input.3": "arm_up", "1.output.0": "%QX0.0" };
  for (const [signal, words] of Object.entries(signals)) {
    await change("#watch-search", words);
    await until(signal, `document.querySelector('#view-watch input[value="${signal}"]') !== null`);
    await click(`#view-watch input[value="${signal}"]`);
  }
  await until("a counter that counts", `Number(document.querySelector('[data-signal="0.state.laps.CV"]')?.dataset.value) > 1`);
  await until("a timer that runs", `/^([1-9]\\d*s)?([1-9]\\d*ms)?$/.test(document.querySelector('[data-signal="0.state.lap.time.ET"]')?.dataset.value)`);
  await picture("watch");
  await accessible("watch", axe);
  await until("the address", `location.hash.includes("signals=0.state.laps.CV,0.state.lap.time.ET,0.state.holding,0.input.3,1.output.0")`);
  await call("Page.reload");
  await until("the same table", `${rows("watch-table")}.length === 5 && document.querySelector('[data-signal="0.state.holding"]').dataset.value !== undefined`);
  await click("#back");
  const ofCycle = `${text("#watch-words")}.startsWith("cycle " + (location.hash.match(/cycle=(\\d+)/)?.[1] ?? "?") + ";")`;
  await until("its address", `${ofCycle} && location.hash.includes("signals=0.state.laps.CV,0.state.lap.time.ET,0.state.holding,0.input.3,1.output.0")`);
  const [address, values] = await evaluate(`[location.hash, ${rows("watch-table")}.map((row) => row.dataset.value).join()]`);
  await elsewhere(address);
  await until("the same values", `${ofCycle} && ${rows("watch-table")}.map((row) => row.dataset.value).join() === ${JSON.stringify(values)}`);
  await click("#live");
}

async function trends() {
  await open("trends?signals=0.state.laps.CV,0.state.lap.time.ET,0.output.4&span=100");
  await until("trends", `document.querySelector("#trend-plot canvas") !== null && [...document.querySelectorAll(".u-legend .u-value")].some((value) => /\\dm?s/.test(value.textContent))`);
  await evaluate("(window.saved = [], window.make = URL.createObjectURL, URL.createObjectURL = (blob) => (saved.push(blob), make.call(URL, blob)))");
  await click("#trend-in");
  await until("a zoom", `${text("#trend-words")}.includes("zoomed") && /from=\\d+&to=\\d+/.test(location.hash)`);
  const [from, to] = (await hash()).match(/from=(\d+)&to=(\d+)/).slice(1).map(Number);
  await until("its cycles", `${text("#trend-words")}.includes("cycles ${from} to ${to},")`);
  await click("#trend-csv");
  await until("a table", "saved.length === 1");
  const lines = (await evaluate("saved[0].text()")).trimEnd().split("\r\n");
  check(`the head is ${lines[0]}`, lines[0] === "cycle,time_s,time_of_day,robot.laps.CV,robot.lap.time.ET in ns,robot.grip,source of robot,source of press");
  check(`${lines.length} lines of cycles ${from} to ${to}`, lines.length === to - from + 2);
  for (const line of [lines[1], lines.at(-1)]) {
    const [cycle, seconds, at, laps, time] = line.split(",");
    check(`${line} has no time of day`, /^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}(Z|[+-]\d\d:\d\d)$/.test(at));
    const values = await evaluate(`fetch("/api/values?signals=0.state.laps.CV,0.state.lap.time.ET&cycle=${cycle}").then((answer) => answer.json()).then(({ values }) => values.join())`);
    check(`${line}, but the values are ${values}`, values === `${laps},${time}` && Number(seconds) === (cycle * 50) / 1000);
  }
  await click("#trend-png");
  await until("a picture", "saved.length === 2");
  const png = await evaluate("saved[1].slice(1, 4).text().then((text) => `${text} ${saved[1].size > 5000}`)");
  check(`the picture is ${png}`, png === "PNG true");
  // Values at the cursor, which is at the shown cycle.
  await change("#cycle", String(from + 5));
  await until("the cycle at the cursor", `document.querySelector(".u-legend .u-value").textContent.split(" · ")[0] === "${from + 5}"`);
  await picture("trends-zoomed");
  await accessible("trends", axe);
  await until("its address", `location.hash.includes("cycle=${from + 5}&")`);
  const link = await hash();
  await elsewhere(link);
  await until("the same trends", `${text("#trend-words")}.includes("cycles ${from} to ${to},") && location.hash === ${JSON.stringify(link)}`);
  await evaluate(`document.getElementById("trend-plot").dispatchEvent(new KeyboardEvent("keydown", { key: "0", bubbles: true }))`);
  await until("no zoom", `!${text("#trend-words")}.includes("zoomed") && !location.hash.includes("from=")`);
  await click("#live");
}

async function replay() {
  await open("cluster");
  await change("#cycle", "20");
  await until("the cycle", `${shownCycle} === 20`);
  await change("#speed", "2");
  // Twice the speed of the run: 40 cycles of 50 ms in a second, from the cycle that is shown.
  const started = Date.now();
  await click("#play");
  await until("the replay", `${shownCycle} > 20`);
  check("it began elsewhere", (await evaluate(shownCycle)) < 20 + 40 + (40 * (Date.now() - started)) / 1000);
  await until("its end", `${shownCycle} >= 100`);
  const took = Date.now() - started;
  check(`80 cycles at twice the speed took ${took} ms`, took >= 1900);
  await click("#play");
  await until("a pause", `${text("#play")} === "Play"`);
  await click("#live");
  await until("live", "document.body.dataset.when === 'live'");
}

async function events() {
  // A member that was suspended is woken late.
  await evaluate(command("press", "stop"));
  await until("a flagged station", `fetch("/api/events?kinds=flagged").then((answer) => answer.json()).then(({ events }) => events.length > 0)`);
  await evaluate(command("press", "continue"));
  await open("events");
  await until("hidden events", `/^[1-9]\\d* of the host hidden:$/.test(${text("#event-host-words")})`);
  check("an event of the host is shown", await evaluate(`document.querySelector("#event-table [data-kind=stalled]") === null`));
  await picture("events");
  await accessible("events", axe);
  await click("#event-host-show");
  await until("them", `document.querySelector("#event-table [data-kind=stalled]") !== null`);
  await click("#event-host-show");
  await until("them hidden", `document.querySelector("#event-table [data-kind=stalled]") === null`);
  await click('#view-events .chips [data-name="warning"]');
  await until("warnings", `${rows("event-table")}.length > 0 && ${rows("event-table")}.every((row) => row.dataset.level === "warning" && row.cells[0].textContent === "⚠ warning")`);
  // The address follows a little later than the rows.
  await until("its address", "location.hash.includes('levels=warning')");
  await call("Page.reload");
  await until("warnings again", `${rows("event-table")}.length > 0 && ${rows("event-table")}.every((row) => row.dataset.level === "warning")`);
  const link = await hash();
  await elsewhere(link);
  await until("warnings elsewhere", `${rows("event-table")}.length > 0 && ${rows("event-table")}.every((row) => row.dataset.level === "warning")`);
  await click("#event-clear");
  await click('#view-events .filter [data-name="commanded"]');
  // Equal commands are one row: the same force three times.
  const force = command("robot-io", "release");
  for (let time = 0; time < 3; time += 1) {
    await evaluate(force);
  }
  await until("a folded row", `${rows("event-table")}.every((row) => row.dataset.kind === "commanded") && /× 3 since cycle \\d+/.test(${text("#event-table tbody")})`);
  await click("#event-fold");
  await until("all of them", `${rows("event-table")}.filter((row) => row.textContent.includes("release")).length === 3`);
  await click("#event-clear");
  await until("all events", `document.getElementById("event-fold").checked && ${rows("event-table")}.some((row) => row.dataset.kind !== "commanded")`);
}

async function drive() {
  await until("everybody", `['robot', 'press', 'understudy'].every((name) => document.querySelector('g.member[data-name="' + name + '"]')?.dataset.state === 'publishing')`);
  await evaluate("localStorage.setItem('tour', 'seen'), document.querySelector('[data-tour=skip]')?.click()");
  await scheme("light");
  await until("some cycles", `fetch("/api/state").then((answer) => answer.json()).then((state) => state.cycle > 120)`);
  await commands();
  await ladder();
  await watch();
  await trends();
  await replay();
  await events();

  await size(390, 844, true);
  await scheme("dark");
  await until("the dark", "document.documentElement.dataset.theme === 'dark'");
  for (const view of ["events", "ladder", "watch?signals=0.state.laps.CV,0.state.lap.time.ET", "trends"]) {
    await open(view);
    const name = view.split("?")[0];
    await until(view, `!document.getElementById("view-${name}").hidden`);
    await new Promise((resolve) => setTimeout(resolve, 800));
    await picture(`phone-${name}-dark`);
    const wide = await evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth");
    check(`phone ${view}: ${wide} pixels too wide`, wide <= 1);
    await accessible(`${name}, phone`, axe);
  }
}

run(drive);
