// Why an output is as it is: the chain of contacts that made it so, and where it was restored, what proved it.

import { act, ask } from "/ask.js";
import { bit, el } from "/element.js";
import { SOURCES } from "/sources.js";
import { cycleParameter, goTo } from "/time.js";

export function prepare() {
  addEventListener("keydown", (event) => {
    if (event.key === "Escape") {
      document.getElementById("why").hidden = true;
    }
  });
}

export async function openWhy(program, output) {
  const answer = await act(() => ask(`/api/why/${program}/${output}?${cycleParameter()}`));
  if (!answer) {
    return;
  }
  const drawer = document.getElementById("why");
  const before = document.activeElement;
  const hide = () => {
    drawer.hidden = true;
    before?.focus?.();
  };
  const close = el("button", { type: "button", click: hide }, "Close");
  drawer.replaceChildren(
    el("div", { class: "drawer-head" }, el("h2", {}, `Why is ${answer.signal} ${bit(answer.value)}?`), close),
    el("p", { class: "soft" }, `${answer.program}, cycle ${answer.cycle}; driven by ${answer.remote_io}`),
    ...source(answer).map((line) => el("p", {}, line)),
    answer.because ? el("ul", { class: "cause" }, tree(answer.because)) : el("p", {}, "No rung made it so."),
    el("p", {}, el("a", { href: `#ladder/${program}/${encodeURIComponent(answer.signal)}`, click: () => (drawer.hidden = true) }, "Show it in the ladder")),
  );
  drawer.hidden = false;
  close.focus();
}

// Where the value came from, and what proves it: equation (12) with its numbers.
function source(answer) {
  const lines = [`It is ${SOURCES[answer.source]?.words ?? "not decided yet"}${answer.missing ? `: ${answer.missing}` : ""}.`];
  if (answer.scanned !== null && answer.scanned !== answer.value) {
    lines.push(`Its own scan says ${bit(answer.scanned)}.`);
  }
  const { restored } = answer;
  if (restored) {
    const others = restored.others.map((other) => `${other.outputs} (${other.said_by})`);
    lines.push(
      `${restored.silent.join(" and ") || "Nobody"} was silent. ${restored.word_of} said the sum of ${restored.members.join(" ⊕ ")}:`,
      el("code", {}, [`${restored.word} (${restored.word_of})`, ...others].join(" ⊕ "), ` = ${restored.sum}`),
      `Lineage ${restored.lineage}: ${restored.proved ? "the sum is what the samples lead to." : "the sum is NOT what the samples lead to."}`,
    );
  }
  return lines;
}

function tree(reason) {
  const line = [
    el("button", { class: "link", type: "button", click: () => goTo(reason.cycle) }, `cycle ${reason.cycle}`),
    ` ${reason.signal} = ${bit(reason.value)}`,
    reason.rung ? `, rung ${reason.rung}${reason.title ? ` “${reason.title}”` : ""}` : "",
    `: ${reason.text}`];
  const deeper = reason.because?.length ? el("ul", { class: "cause" }, reason.because.map(tree)) : null;
  return el("li", {}, line, deeper);
}
