// The signals of all programs: inputs, outputs, and what is in their states. Each has an identifier such as `0.input.3` or `1.state.pressing`.

import { act, ask } from "/ask.js";
import { el, keyed, setText, valueText } from "/element.js";

// Signals in a list, at most; a search finds the others.
const LISTED = 120;

let all = [];
let byId = new Map();
let loading = null;
let programs = [];

export function prepare(run) {
  programs = run.programs.map((program) => program.name);
  take(run.programs.flatMap((program) =>
    ["input", "output"].flatMap((kind) =>
      program[`${kind}s`].map((signal, index) => ({ ...signal, id: `${program.index}.${kind}.${index}`, program: program.index, kind })))));
}

const isPoint = (signal) => signal.kind === "input" || signal.kind === "output";

// Other points count. Identifiers of signals become those of the same names; a signal that is gone has none.
export function replacePoints(run) {
  const before = byId;
  all = all.filter((signal) => !isPoint(signal));
  prepare(run);
  return (ids) =>
    ids.map((id) => {
      const old = before.get(id);
      return old && isPoint(old) ? all.find((signal) => signal.program === old.program && signal.kind === old.kind && signal.name === old.name)?.id : id;
    }).filter(Boolean);
}

// A signal as the server is asked for it: by its name, whatever its number is by then.
export function asked(id) {
  const signal = byId.get(id);
  return signal && isPoint(signal) ? `${signal.program}.${signal.kind}.${signal.name.replaceAll(",", ";")}` : id;
}

function take(signals) {
  all = [...all, ...signals].sort((one, other) => one.program - other.program);
  byId = new Map(all.map((signal) => [signal.id, signal]));
}

// The signals in the states are asked for once, when a view needs them; says whether they are known. After a failure, a view may ask again a
// second later.
export function load() {
  loading ??= act(() => ask("api/signals")).then((signals) => {
    if (signals) {
      take(signals);
    } else {
      setTimeout(() => { loading = null; }, 1000);
    }
    return Boolean(signals);
  });
  return loading;
}

// The programs that run have other variables.
export function forget() {
  all = all.filter(isPoint);
  loading = null;
}

export const find = (id) => byId.get(id);

export const fullName = (signal) => `${programs[signal.program]}.${signal.name}`;

// A value of a signal as its card says: with its decimals and its unit.
export function textOf(signal, value) {
  const text = valueText(value, signal.type, signal.decimals);
  return signal.unit && typeof value === "number" ? `${text} ${signal.unit}` : text;
}

// A list of all signals with a search; `isChosen` and `toggle` take an identifier.
export function chooser(name, isChosen, toggle) {
  let words = "";
  const list = el("div", { class: "choices-list", role: "group", "aria-label": "Signals" });
  const more = el("p", { class: "soft", role: "status" });
  const search = el("input", { id: `${name}-search`, type: "search", input: (event) => { words = event.target.value.trim().toLowerCase(); show(); } });
  const element = el("details", { class: "chooser card" }, el("summary", {}, "Choose signals"), el("p", {}, el("label", {}, "Find ", search)), list, more);
  element.addEventListener("toggle", async () => {
    if (element.open) {
      await load();
      show();
    }
  });
  const matches = (signal) => [fullName(signal), signal.kind, signal.type, signal.address ?? "", signal.description ?? "", signal.group ?? ""].some((text) => text.toLowerCase().includes(words));
  function show() {
    const found = all.filter(matches);
    keyed(list, found.slice(0, LISTED), (signal) => signal.id,
      (signal) => el("label", { class: "choice" },
        el("input", { type: "checkbox", value: signal.id, change: () => { toggle(signal.id); show(); } }),
        ` ${fullName(signal)} `, el("span", { class: "soft" }, [signal.kind, signal.group].filter(Boolean).join(", "))),
      (label, signal) => { label.firstChild.checked = isChosen(signal.id); });
    setText(more, found.length > LISTED ? `${LISTED} of ${found.length} signals: search for the others` : found.length === 0 ? "no signal" : "");
  }
  show();
  return { element, show };
}
