// Why an output has its value: the chain of contacts or statements that caused it; for a reconstructed output also its proof.

import { addressOf, changed } from "/address.js";
import { act, ask } from "/ask.js";
import { el, valueText } from "/element.js";
import { SOURCES } from "/sources.js";
import { cycleParameter, goTo } from "/time.js";
import { clock, clockAndZone } from "/zone.js";

// What is shown, as an address has it: `PROGRAM/OUTPUT@CYCLE`.
let open = null;
let before = null;
// What an address asks for, before the run is known.
let wanted = null;

export function prepare() {
  addEventListener("keydown", (event) => {
    if (event.key === "Escape" && open) {
      hide();
    }
  });
}

export const shown = () => open;

export function select(text) {
  wanted = text;
}

// Opens what an address asks for.
export function show() {
  const found = /^(\d+)\/(.+)@(-?\d+)$/.exec(wanted ?? "");
  const isOpen = wanted === open;
  wanted = null;
  if (found && !isOpen) {
    const [, program, output, cycle] = found;
    explain(program, output, `cycle=${cycle}`, false);
  }
}

function hide() {
  document.getElementById("why").hidden = true;
  open = null;
  changed();
  before?.focus?.();
}

export const openWhy = (program, output) => explain(program, output, cycleParameter(), true);

async function explain(program, output, cycle, takesFocus) {
  const answer = await act(() => ask(`api/why/${program}/${encodeURIComponent(output)}?${cycle}`));
  if (!answer) {
    return;
  }
  const drawer = document.getElementById("why");
  open = `${program}/${output}@${answer.cycle}`;
  changed();
  if (takesFocus && !drawer.contains(document.activeElement)) {
    before = document.activeElement;
  }
  const close = el("button", { type: "button", click: hide }, "Close");
  drawer.replaceChildren(
    el("div", { class: "drawer-head" }, el("h2", {}, `Why is ${answer.signal} ${valueOf(answer, answer.value)}?`), close),
    el("p", { class: "soft" }, `${answer.program}, ${answer.at ? `${clockAndZone(answer.at)}, ` : ""}cycle ${answer.cycle}; remote I/O ${answer.remote_io}`),
    ...source(answer).map((line) => el("p", {}, line)),
    ...(answer.because ? [el("ul", { class: "cause" }, tree(answer.because))] : []),
    ...(answer.source === "fail-safe" && answer.ramp_to === undefined
      ? [el("p", {}, `${answer.forced ? "That" : "It"} is the configured fail-safe value: the program did not cause it.`)] : []),
    el("p", {}, el("a", { href: addressOf("ladder", { program, find: answer.signal }), click: hide }, "Show it in the program")),
  );
  drawer.hidden = false;
  if (takesFocus) {
    close.focus();
  }
}

// A value with its unit, and not rounded to its decimals: a comparison reads them all.
const valueOf = ({ type, unit }, value) => [valueText(value, type), unit].filter(Boolean).join(" ");

// Source of the value and its proof: equation (12) with its numbers.
function source(answer) {
  const lines = [];
  const { forced, kept_since: kept } = answer;
  if (forced) {
    lines.push(`Forced by ${forced.owner} since cycle ${forced.since}, for ${forced.seconds} s: ${forced.reason}.`);
  }
  if (kept !== undefined) {
    lines.push(`The remote I/O missed this deadline: the device kept the value of cycle ${kept}.`);
  } else {
    const it = forced ? `Without the force it would be ${valueOf(answer, forced.unforced)},` : "It is";
    lines.push(`${it} ${SOURCES[answer.source]?.words ?? "not known yet"}${answer.missing ? `: ${answer.missing}` : ""}.`);
  }
  if (answer.scanned !== null && answer.scanned !== answer.value) {
    lines.push(`The scan of the program yields ${valueOf(answer, answer.scanned)}.`);
  }
  const { reconstructed } = answer;
  if (reconstructed) {
    const others = reconstructed.others.map((other) => `${other.outputs} (${other.published_by})`);
    lines.push(
      `Not received: ${reconstructed.not_received.join(" and ") || "no station"}. Parity word of ${reconstructed.word_of} over ${reconstructed.mask.join(" ⊕ ")}:`,
      el("code", {}, [`${reconstructed.word} (${reconstructed.word_of})`, ...others].join(" ⊕ "), ` = ${reconstructed.sum}`),
      `Lineage ${reconstructed.lineage}: ${reconstructed.proved ? "the sum equals the outputs computed from the samples." : "the sum does NOT equal the outputs computed from the samples."}`,
    );
  }
  return lines;
}

function tree(reason) {
  const line = [
    el("button", { class: "link", type: "button", click: () => goTo(reason.cycle) }, `cycle ${reason.cycle}`), reason.at ? ` ${clock(reason.at, true)}` : "",
    ` ${reason.signal} = ${valueOf(reason, reason.value)}`,
    reason.rung ? `, rung ${reason.rung}${reason.title ? ` “${reason.title}”` : ""}` : "",
    reason.line ? [`, line ${reason.line} `, el("code", {}, reason.statement)] : null,
    `: ${reason.text}`];
  const deeper = reason.because?.length ? el("ul", { class: "cause" }, reason.because.map(tree)) : null;
  return el("li", {}, line, deeper);
}
