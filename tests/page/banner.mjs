// The alarm banner: in sight at every place of the page, red only for what waits for a person, calm when it is acknowledged, and a return to normal is seen.

import { evaluate, open, picture, problems, run, scheme, size, text, until } from "./chromium.mjs";

const sees = (found, expected) => {
  if (!found) {
    problems.push(expected);
  }
};
const post = (path, body) => evaluate(`fetch(${JSON.stringify(path)}, { method: "POST", headers: { "content-type": "application/json", "x-understudy": "1" }, body: JSON.stringify(${JSON.stringify(body)}) }).then((answer) => answer.status)`);
const command = async (name) => sees((await post("/api/command", { member: "understudy", command: { command: name }, owner: "anna", reason: "a test" })) === 200, `the command ${name} is refused`);
const acknowledge = async () => {
  const alarms = await evaluate(`fetch("/api/state").then((answer) => answer.json()).then((state) => state.alarms.filter((alarm) => !alarm.acknowledged).map((alarm) => alarm.id))`);
  sees((await post("/api/alarms/acknowledge", { alarms, owner: "anna" })) === 200, "the acknowledgement is refused");
};
const banner = (state, words) => until(`a banner ${state}`, `document.getElementById("alarm-banner").dataset.state === "${state}" && ${text("#alarm-banner")}.includes(${JSON.stringify(words)})`);
const colour = (selector) => evaluate(`getComputedStyle(document.querySelector("${selector}")).color`);
const colourOf = (name) => evaluate(`(() => { const probe = document.createElement("i"); probe.style.color = "var(--${name})"; document.body.append(probe); const { color } = getComputedStyle(probe); probe.remove(); return color; })()`);

// Scrolls to the end of the page; the banner, the status and the count are in the window, and nothing lies over them.
async function inSight(where) {
  await evaluate("scrollTo(0, document.body.scrollHeight)");
  const covered = await evaluate(`["alarm-banner", "status", "alarm-count"].filter((id) => {
    const element = document.getElementById(id);
    const { left, top, width, height } = element.getBoundingClientRect();
    const over = document.elementFromPoint(left + Math.min(width, 40) / 2, top + height / 2);
    return top < 0 || !element.contains(over);
  })`);
  sees(await evaluate("scrollY > 50"), `${where}: the page does not scroll`);
  sees(covered.length === 0, `${where}: ${covered.join(" and ")} out of sight`);
  // A heading that is scrolled to is below what is sticky.
  const hidden = await evaluate(`(() => { const title = document.getElementById("counts-title"); title.scrollIntoView(); const { left, top, height } = title.getBoundingClientRect();
    return top > 0 && !title.contains(document.elementFromPoint(left + 5, top + height / 2)); })()`);
  sees(!hidden, `${where}: a heading that is scrolled to is hidden by the head`);
  await evaluate("scrollTo(0, document.body.scrollHeight)");
}

run(async () => {
  await until("a healthy cluster", `${text("#protection-words")} === "all 2 programs are protected"`);
  await evaluate(`localStorage.setItem("tour", "done"); document.querySelector("[data-tour=skip]")?.click()`);
  await banner("none", "No open alarms");

  await command("kill");
  await banner("unacknowledged", "⚠ robot, press: not protected, because understudy is killed · since");
  for (const [width, height, mobile] of [[1360, 700, false], [390, 844, true], [800, 480, false]]) {
    await size(width, height, mobile);
    for (const look of ["light", "dark"]) {
      await scheme(look);
      await until(look, `document.documentElement.dataset.theme === "${look}"`);
      await inSight(`${width} px, ${look}`);
      await picture(`banner-${width}-${look}`);
      sees((await colour("#alarm-banner")) === (await colourOf("bad")), `${look}: an alarm that waits is not red`);
    }
  }
  await size(1360, 700, false);
  await acknowledge();
  await banner("acknowledged", "acknowledged by anna");
  for (const part of ["#alarm-banner", "#alarm-count"]) {
    const [shown, red] = [await colour(part), await colourOf("bad")];
    sees(shown !== red, `an acknowledged alarm is red in ${part}`);
  }
  sees((await colour("#alarm-banner")) === (await colourOf("soft")), "an acknowledged alarm is not calm");
  sees((await evaluate(text("#alarm-count"))) === "✓ 1 alarm, acknowledged", "the count does not say that the alarm is acknowledged");
  await inSight("acknowledged");
  await picture("banner-acknowledged");

  // It returns to normal after its acknowledgement: the list is empty, and the banner says so for a while.
  await command("restart");
  await banner("normal", "✓ returned to normal");
  sees(await evaluate(`document.getElementById("alarm-count").hidden`), "an alarm that is over and acknowledged is counted");
  await picture("banner-normal");

  // It returns to normal without an acknowledgement: it remains until a person has seen it.
  await command("kill");
  await banner("unacknowledged", "because understudy is killed · since");
  await command("restart");
  await banner("returned", "not acknowledged");
  for (const part of ["#alarm-banner", "#alarm-count"]) {
    sees((await colour(part)) === (await colourOf("ink")), `an alarm that has returned to normal is red in ${part}`);
  }
  await open("events");
  await until("its line", `document.querySelector("#alarm-list [data-state=returned] .alarm-by")?.textContent.includes("returned to normal")`);
  await picture("banner-returned");
  await acknowledge();
  await banner("normal", "returned to normal");
});
