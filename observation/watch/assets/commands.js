// Commands to members. The reason is shown next to a button that is disabled.

import { tell, toast } from "/ask.js";
import { el, setText, valueText } from "/element.js";
import { isLive, stale, state } from "/time.js";
import { complete, nameField, owner, reasonField } from "/who.js";

let run = null;

export function prepare(facts) {
  run = facts;
  document.getElementById("command").addEventListener("click", (event) => {
    if (event.target.id === "command") {
      event.target.close();
    }
  });
}

// Reason why no command can be given now, if there is one.
export function obstacle(forbidden = run.commands.why) {
  if (forbidden) {
    return forbidden;
  }
  if (!isLive()) {
    return "this is a replay: go live to command";
  }
  if (state()?.finished) {
    return "the run has ended";
  }
  if (run.commands.after_scenario && !state()?.scenario_over) {
    return "the scenario is still running: commands are taken after it";
  }
  return stale();
}

const DOWN = "it is down";
const UP = "it is running";

// The actions, each with the reason why it is impossible now, if there is one, and what is done by it.
function actions(member) {
  const { down } = member;
  const still = member.state === "suspended";
  const all = [
    ["kill", "Kill", "as kill -9", down ? DOWN : null, "killed"],
    ["restart", "Start again", "", down ? null : UP, "started again"],
    ["stop", "Suspend", "as SIGSTOP", down ? DOWN : still ? "it is suspended already" : null, "suspended"],
    ["continue", "Resume", "as SIGCONT", down ? DOWN : still ? null : "it is not suspended", "resumed"],
  ];
  if (member.kind !== "plant") {
    const cut = member.cut;
    all.push(["isolate", "Cut off", "from all other members", cut ? "it is cut off already" : null, "cut off from all other members"]);
    all.push(["rejoin", "Connect again", "", cut ? null : "it is not cut off", "connected again"]);
  }
  if (member.kind === "remote-io") {
    all.push(["release", "Release", "its outputs, and the stations that it excluded", down ? DOWN : null, "released"]);
  }
  return all;
}

function find(wanted) {
  const members = state()?.members ?? [];
  if (wanted.name) {
    return members.find((member) => member.name === wanted.name);
  }
  return members.find((member) => member.kind === wanted.kind && member.program === wanted.program);
}

// Fields for owner and reason of a command to a member, and a function that gives it and says what was done.
function giver(member) {
  const dialog = document.getElementById("command");
  const who = nameField("command-owner");
  const reason = reasonField("command-reason");
  const answer = el("p", { id: "command-answer", class: "bad", role: "alert" });
  let busy = false;
  const give = async (command, done) => {
    if (busy || !complete(who, reason)) {
      return;
    }
    busy = true;
    setText(answer, "");
    try {
      // A signal is named by its place: that of these points.
      const points = command.signal ? member.points : undefined;
      await tell("api/command", { member: member.name, command, owner: owner(), reason: reason.value, points });
      dialog.close();
      toast(`✓ ${member.name}: ${done}, by ${owner()} at cycle ${state().newest}`);
    } catch (error) {
      setText(answer, `✗ ${error.message}`);
    }
    busy = false;
  };
  const asked = [el("p", { class: "who" }, el("label", {}, "Your name ", who), " ", el("label", {}, "Reason ", reason)), answer];
  return { asked, give };
}

function open(content) {
  const dialog = document.getElementById("command");
  dialog.replaceChildren(...content.flat().filter(Boolean));
  dialog.showModal();
}

export function openMember(wanted, signal) {
  const member = find(wanted);
  if (!member) {
    return;
  }
  const because = obstacle();
  const { asked, give } = giver({ ...member, points: run.programs[member.program]?.points });
  const button = ([name, words, meaning, why, done]) => {
    const reasonWhy = because ?? run.commands.impossible[name] ?? why;
    return el("li", {},
      el("button", { type: "button", disabled: Boolean(reasonWhy), "data-command": name, click: () => give({ command: name }, done) }, words),
      " ", el("span", { class: "soft" }, reasonWhy ? `cannot: ${reasonWhy}` : meaning));
  };
  open([
    el("h2", { id: "command-title" }, member.name),
    el("p", {}, `${member.kind}: ${member.state}${member.note ? `, ${member.note}` : ""}`),
    because ? el("p", { class: "obstacle" }, because) : null,
    asked,
    el("ul", { class: "plain actions" }, actions(member).map(button)),
    member.kind === "remote-io" ? forcing(member, signal, because, give) : null,
    el("form", { method: "dialog" }, el("button", { type: "submit" }, "Close")),
  ]);
}

export const continueWords = (lost) =>
  `Continue from cycle ${lost.newest}, ${lost.age_cycles === null ? "age unknown" : `${lost.age_cycles} cycles old`}`;

// The operator's choice where the state of a program is lost: its effect is shown, and it has to be confirmed.
export function openChoice(name, which) {
  const member = find({ name });
  const lost = member && state().programs[member.program].lost;
  if (!lost) {
    return;
  }
  const because = obstacle() ?? run.commands.impossible.choose ?? (member.down ? DOWN : null);
  const { asked, give } = giver(member);
  const cold = which === "cold";
  const command = { command: "choose", choice: cold ? "cold" : { newest: { cycle: lost.newest } } };
  const warning = cold
    ? "The program starts from its initial state: counters, steps and timers are reset. The plant is not moved."
    : `Counters, steps and timers of the program have the values of cycle ${lost.newest}. The plant has moved on since.`;
  open([
    el("h2", { id: "command-title" }, `${name}: ${cold ? "Cold start" : continueWords(lost)}`),
    el("p", {}, lost.words),
    el("p", {}, `${warning} Compare the state of the plant with the program first.`),
    because ? el("p", { class: "obstacle" }, `cannot: ${because}`) : null,
    asked,
    el("p", {}, el("button", { type: "button", id: "confirm-choice", disabled: Boolean(because), click: () => give(command, cold ? "cold start" : `continues from cycle ${lost.newest}`) }, cold ? "Start cold" : "Continue")),
    el("form", { method: "dialog" }, el("button", { type: "submit" }, "Cancel")),
  ]);
}

// A form for forces. A number is typed as in `understudy operate force`; the server checks its type and range.
function forcing(member, signal, because, give) {
  const facts = run.programs[member.program];
  const option = (kind) => (item, index) =>
    el("option", { value: `${kind} ${index}`, selected: signal?.kind === kind && signal?.index === index }, `${kind} ${item.name}`);
  const which = el("select", { id: "force-signal", change: () => fit() }, facts.inputs.map(option("input")), facts.outputs.map(option("output")));
  const bit = el("select", { id: "force-value", "aria-label": "Value" }, el("option", { value: "1" }, "1"), el("option", { value: "0" }, "0"));
  const number = el("input", { id: "force-number", type: "text", size: "12", autocomplete: "off", "aria-label": "Value", "aria-describedby": "force-type", input: () => fit() });
  const type = el("span", { id: "force-type", class: "soft" });
  const seconds = el("input", { id: "force-seconds", type: "number", min: "1", max: "3600", value: "60" });
  const chosen = () => {
    const [kind, index] = which.value.split(" ");
    return { kind, point: facts[`${kind}s`][Number(index)] };
  };
  const place = () => {
    const { kind, point } = chosen();
    return { [kind]: point.bit };
  };
  const down = because ?? (member.down ? DOWN : null);
  const force = el("button", { type: "button", "data-command": "force", click: () => {
    const { kind, point } = chosen();
    const value = number.hidden ? bit.value : number.value;
    give({ command: "force", signal: place(), value, seconds: Number(seconds.value) }, `${kind} ${point.name} forced to ${value} for ${seconds.value} s`);
  } }, "Force");
  const fit = () => {
    const { point } = chosen();
    number.hidden = point.type === "BOOL";
    bit.hidden = !number.hidden;
    setText(type, number.hidden ? "" : `${point.type}${point.unit ? `, ${point.unit}` : ""}${point.type === "TIME" ? ", such as 1.5s" : ""}${point.values ? `: ${Object.values(point.values).join(", ")}` : ""}`);
    force.disabled = Boolean(down) || (!number.hidden && number.value.trim() === "");
  };
  fit();
  const forces = state().programs[member.program].forced;
  const nameOf = (held) => facts[`${held.kind}s`][held.index]?.name ?? `at bit ${held.bit}`;
  const held = forces.map((force) =>
    el("li", {}, `${force.kind} ${nameOf(force)} = ${valueText(force.value, facts[`${force.kind}s`][force.index]?.type)}, by ${force.owner}, ${force.left_s} s left: ${force.reason} `,
      el("button", { type: "button", disabled: Boolean(down), "data-command": "unforce", click: () => give({ command: "unforce", signal: { [force.kind]: force.bit } }, `force of ${force.kind} ${nameOf(force)} taken back`) }, "Take back")));
  return el("fieldset", {},
    el("legend", {}, "Force a signal"),
    el("label", {}, "Signal ", which), " ", el("span", { class: "force-value" }, "Value ", bit, number, " ", type), " ", el("label", {}, "for seconds ", seconds), " ",
    force,
    down ? el("span", { class: "soft" }, ` cannot: ${down}`) : null,
    el("ul", { class: "plain" }, held));
}
