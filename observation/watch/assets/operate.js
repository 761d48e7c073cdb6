// Operator inputs: a panel for each program, made from the declarations of the cluster file. A control shows the value as the program samples it;
// the answer to a write, or the reason why it cannot be written, is next to it.

import { tell } from "/ask.js";
import { el, setAttribute, setText, valueText } from "/element.js";
import { obstacle } from "/commands.js";
import { makeReads } from "/reads.js";
import { complete, nameField, owner, reasonField } from "/who.js";

let run = null;
let reads = null;
let panels = [];

const id = (name) => document.getElementById(name);

export const has = (facts) => facts.programs.some((program) => program.inputs.some((input) => input.operator || input.from));

export function replacePoints() {
  id("view-operate").replaceChildren();
  prepare(run);
}

export function prepare(facts) {
  run = facts;
  const place = id("view-operate");
  panels = run.programs.filter((program) => program.inputs.some((input) => input.operator)).map(makePanel);
  const name = nameField("operate-owner");
  const reason = reasonField("operate-reason");
  place.append(el("p", { id: "operate-obstacle", class: "obstacle", role: "status", hidden: true }));
  if (panels.length > 0) {
    place.append(
      el("p", { class: "who" }, el("label", {}, "Your name ", name), " ", el("label", {}, "Reason ", reason)),
      el("div", { class: "cards" }, panels.map((panel) => panel.element)));
  }
  reads = makeReads(run);
  if (reads) {
    place.append(reads.element);
  }
  if (panels.length === 0 && !reads) {
    place.append(el("p", {}, "The cluster file declares no operator inputs and no signals between programs."));
  }
}

export function show(state) {
  const because = obstacle(run.commands.write_why);
  const words = id("operate-obstacle");
  words.hidden = !because || panels.length === 0;
  setText(words, because ? `Inputs cannot be written: ${because}` : "");
  for (const panel of panels) {
    panel.show(state, because);
  }
  reads?.show(state);
}

// A remote I/O that answers no write.
const isDown = (member) => member.down || member.state === "suspended";

// The panel of a program.
function makePanel(program) {
  const title = `operate-${program.index}`;
  const why = el("p", { id: `${title}-why`, class: "obstacle", role: "status", hidden: true });
  const inputs = program.inputs.map((input, index) => ({ input, index })).filter(({ input }) => input.operator);
  const controls = inputs.map(({ input, index }) => makeControl(program, input, index));
  const element = el("section", { class: "card", "aria-labelledby": title, "data-program": program.name },
    el("h2", { id: title }, program.name, " ", el("span", { class: "soft" }, program.remote_io)), why,
    el("ul", { class: "plain controls" }, controls.map((control) => control.element)));
  const show = (state, because) => {
    const own = state.members.find((member) => member.name === program.remote_io);
    const down = own && isDown(own) ? `${program.remote_io} is ${own.state}` : null;
    why.hidden = Boolean(because) || !down;
    setText(why, down ? `Inputs cannot be written: ${down}` : "");
    const values = state.programs[program.index].input_values;
    const described = because ? "operate-obstacle" : down ? why.id : null;
    controls.forEach((control) => control.show(values?.[control.index], because ?? down, described));
  };
  return { element, show };
}

const isTime = (input) => input.type === "TIME";
// A time is typed in milliseconds; the process image has nanoseconds.
const scale = (input) => (isTime(input) ? 1e6 : 1);
const unitOf = (input) => input.unit ?? (isTime(input) ? "ms" : "");
const numberText = (input, value, decimals) => valueText(typeof value === "number" ? value / scale(input) : value, undefined, decimals);
const withUnit = (input, text) => `${text} ${unitOf(input)}`.trim();
// The value of a request as it is shown.
const wordsOf = (input, text) => (input.type === "BOOL" ? (text === "true" ? "1" : "0") : withUnit(input, text.replace(/ms$/, "")));
const MOMENTS = ["DATE", "TIME_OF_DAY", "DATE_AND_TIME"];
const isWhole = (input) => !["REAL", "LREAL", "TIME"].includes(input.type);

// A control: what it writes is decided by its kind; value, answer and confirmation are the same for all.
function makeControl(program, input, index) {
  const key = `operate-${program.index}-${index}`;
  const { title, confirm, kind } = input.operator;
  const value = el("span", { class: "control-value" }, "?");
  const lamp = input.type === "BOOL" ? el("span", { class: "lamp", "aria-hidden": "true" }) : null;
  const answer = el("p", { id: `${key}-answer`, class: "control-answer", role: "status" });
  const why = el("p", { id: `${key}-why`, class: "soft control-why", hidden: true });
  const asks = el("p", { class: "control-asks", hidden: true });
  const parts = { key, program, input, title, sampled: undefined, obstacle: null, busy: false };

  const say = (level, text) => {
    setAttribute(answer, "data-level", level);
    setText(answer, text);
  };
  const send = async (text) => {
    parts.busy = true;
    say("busy", "… write under way");
    refresh();
    try {
      const command = { command: "write", input: input.name, value: text };
      const body = { member: program.remote_io, command, owner: owner(), reason: id("operate-reason").value, points: program.points };
      const done = await tell("api/command", body);
      const cycle = done.run_cycle ?? done.cycle;
      say("done", `✓ ${kind === "pulse" ? "" : `${wordsOf(input, text)} `}in effect since cycle ${cycle}`);
      setter.written?.();
    } catch (error) {
      say("refused", `✗ ${error.message}`);
    }
    parts.busy = false;
    refresh();
  };
  const write = (text) => {
    if (parts.busy) {
      return;
    }
    if (!complete(id("operate-owner"), id("operate-reason"))) {
      say("refused", "✗ not written: enter your name and the reason above");
      return;
    }
    if (!confirm) {
      send(text);
      return;
    }
    const leave = (after) => () => {
      asks.hidden = true;
      after?.();
      setter.focus();
    };
    const yes = el("button", { type: "button", class: "confirm", click: leave(() => send(text)) }, "Confirm");
    asks.replaceChildren(`Write ${title} = ${wordsOf(input, text)}? `, yes, " ", el("button", { type: "button", click: leave() }, "Cancel"));
    asks.onkeydown = (event) => event.key === "Escape" && leave()();
    asks.hidden = false;
    say("", "");
    yes.focus();
  };
  const setter = (kind === "pulse" ? makePulse : kind === "level" ? makeLevel : input.values ? makeChoice : MOMENTS.includes(input.type) ? makeMoment : makeSetpoint)(parts, write, say);
  const refresh = () => {
    const shown = kind === "setpoint" ? withUnit(input, numberText(input, parts.sampled, input.decimals)) : valueText(parts.sampled);
    setText(value, `${shown}${parts.busy ? " …" : ""}`);
    if (lamp) {
      setAttribute(lamp, "data-on", valueText(parts.sampled));
    }
    if (parts.obstacle) {
      asks.hidden = true;
    }
    // While a write is under way its control keeps the focus.
    for (const target of setter.targets) {
      setAttribute(target, "aria-disabled", String(parts.busy));
    }
    setter.show(Boolean(parts.obstacle));
  };
  const element = el("li", { class: "control", "data-input": input.name, "data-kind": kind },
    el("div", { class: "control-row" },
      // A button has its title itself.
      kind === "pulse" ? null : el("span", { id: `${key}-title`, class: "control-title" }, title),
      setter.element, el("span", { class: "control-now" }, lamp, value)),
    asks, why, answer);
  const show = (sampled, because, described) => {
    parts.sampled = sampled;
    const own = because ? null : input.operator.why;
    parts.obstacle = because ?? own;
    why.hidden = !own;
    setText(why, own ? `cannot be written: ${own}` : "");
    for (const target of setter.targets) {
      setAttribute(target, "aria-describedby", [described ?? (own ? why.id : null), answer.id].filter(Boolean).join(" "));
      setAttribute(target, "title", parts.obstacle ? `cannot be written: ${parts.obstacle}` : input.description ?? "");
    }
    refresh();
  };
  return { element, index, show };
}

function makePulse({ title }, write) {
  const button = el("button", { type: "button", class: "pulse", click: () => write("true") }, title);
  return { element: el("div", { class: "control-setter" }, button), targets: [button], focus: () => button.focus(), show: (blocked) => { button.disabled = blocked; } };
}

function makeLevel(parts, write) {
  const button = el("button", { type: "button", class: "switch", role: "switch", "aria-checked": "false", "aria-labelledby": `${parts.key}-title`, click: () => write(String(!parts.sampled)) },
    el("span", { class: "switch-track", "aria-hidden": "true" }, el("span", { class: "switch-knob" })), " ", el("span", { class: "switch-words" }));
  const show = (blocked) => {
    button.disabled = blocked || parts.sampled === undefined || parts.sampled === null;
    setAttribute(button, "aria-checked", String(parts.sampled === true));
    setText(button.lastChild, { true: "on", false: "off" }[parts.sampled] ?? "?");
  };
  return { element: el("div", { class: "control-setter" }, button), targets: [button], focus: () => button.focus(), show };
}

// The values of an enumeration within the limits, in the order of their numbers.
function makeChoice(parts, write) {
  const { key, input } = parts;
  const numbers = Object.entries(input.values).map(([number, name]) => [Number(number), name]);
  const [low, high] = [input.operator.low, input.operator.high].map((name) => numbers.find(([, known]) => known === name)?.[0]);
  const allowed = numbers.filter(([number]) => number >= low && number <= high).sort(([one], [other]) => one - other);
  const list = el("select", { class: "entry", "aria-labelledby": `${key}-title` }, allowed.map(([, name]) => el("option", { value: name }, name)));
  return makeField(parts, write, list, "");
}

// A date or a time of day, as it is shown.
function makeMoment(parts, write) {
  const { low, high } = parts.input.operator;
  const entry = el("input", { type: "text", class: "entry moment", size: "20", autocomplete: "off", "aria-labelledby": `${parts.key}-title` });
  return makeField(parts, write, entry, `from ${low} to ${high}`);
}

// A list or a text with a button. While a person chooses or types, it does not follow the sampled value.
function makeField(parts, write, field, limits) {
  let isTouched = false;
  let isBlocked = true;
  const button = el("button", { type: "submit" }, "Write");
  const form = el("form", { class: "control-setter", novalidate: true, submit: (event) => {
    event.preventDefault();
    if (!button.disabled) {
      write(field.value.trim());
    }
  }, input: () => { isTouched = true; refresh(); } }, field, button, el("span", { class: "soft" }, limits));
  const refresh = () => {
    if (!isTouched && field.value !== (parts.sampled ?? "")) {
      field.value = parts.sampled ?? "";
    }
    field.disabled = isBlocked;
    button.disabled = isBlocked || field.value.trim() === "";
  };
  const show = (blocked) => {
    isBlocked = blocked;
    refresh();
  };
  return { element: form, targets: [field, button], focus: () => field.focus(), show, written: () => { isTouched = false; } };
}

// An entry and a slider between the limits. While a person types, the entry does not follow the sampled value.
function makeSetpoint(parts, write, say) {
  const { key, input } = parts;
  const low = input.operator.low / scale(input);
  const high = input.operator.high / scale(input);
  const span = high - low;
  const step = isWhole(input) ? Math.max(1, Math.round(span / 1000)) : 10 ** Math.floor(Math.log10(span / 100 || 1));
  let typed = false;
  const mend = () => {
    typed = false;
    say("", "");
    refresh();
  };
  const problem = () => {
    const value = Number(entry.value);
    if (entry.value.trim() === "" || !Number.isFinite(value)) {
      return "enter a number";
    }
    if (isWhole(input) && !Number.isInteger(value)) {
      return "enter a whole number";
    }
    const limits = `from ${valueText(low)} to ${withUnit(input, valueText(high))}`;
    return value < low || value > high ? `${entry.value} is outside the limits ${limits}` : null;
  };
  const changed = () => {
    typed = true;
    const wrong = problem();
    say(wrong ? "refused" : "", wrong ? `✗ ${wrong}` : "");
    refresh();
  };
  const entry = el("input", { type: "number", class: "entry", step: "any", min: low, max: high, autocomplete: "off", "aria-labelledby": `${key}-title ${key}-unit`, input: () => { slider.value = entry.value; changed(); } });
  const slider = el("input", { type: "range", min: low, max: high, step, "aria-labelledby": `${key}-title`, input: () => { entry.value = valueText(Number(slider.value)); changed(); } });
  const button = el("button", { type: "submit" }, "Write");
  const form = el("form", { class: "control-setter", novalidate: true, submit: (event) => {
    event.preventDefault();
    if (!button.disabled) {
      write(isTime(input) ? `${entry.value}ms` : entry.value);
    }
  }, keydown: (event) => event.key === "Escape" && typed && mend() },
    entry, el("span", { id: `${key}-unit`, class: "soft" }, unitOf(input)), button,
    el("div", { class: "slider" }, el("span", { class: "soft" }, valueText(low)), slider, el("span", { class: "soft" }, valueText(high))));
  let isBlocked = true;
  const refresh = () => {
    if (!typed && parts.sampled !== undefined && parts.sampled !== null && document.activeElement !== slider) {
      const text = numberText(input, parts.sampled);
      if (entry.value !== text) {
        entry.value = text;
        slider.value = text;
      }
    }
    const wrong = typed && problem();
    setAttribute(entry, "aria-invalid", String(Boolean(wrong)));
    setAttribute(slider, "aria-valuetext", withUnit(input, entry.value));
    entry.disabled = isBlocked;
    slider.disabled = isBlocked;
    button.disabled = isBlocked || Boolean(wrong) || entry.value === "";
  };
  const show = (blocked) => {
    isBlocked = blocked;
    refresh();
  };
  return { element: form, targets: [entry, slider, button], focus: () => entry.focus(), show, written: () => { typed = false; } };
}

