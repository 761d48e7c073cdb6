// Comparison with another run: the first cycle with a difference, and the differences.

import { changed } from "/address.js";
import { act, ask } from "/ask.js";
import { el } from "/element.js";
import { goTo } from "/time.js";

// The other run of the answer that is shown, and of one that an address asks for.
let compared = "";
let wanted = "";

export function prepare(run) {
  const choice = el("select", { id: "compare-with" }, run.others.map((name) => el("option", { value: name }, name)));
  const button = el("button", { type: "button", id: "compare-go", disabled: run.others.length === 0, click: () => compare(choice.value) }, "Compare");
  document.getElementById("view-compare").append(
    el("section", { class: "card", "aria-labelledby": "compare-title" },
      el("h2", { id: "compare-title" }, "Compare with another run"),
      run.others.length
        ? el("p", {}, el("label", {}, "Run ", choice), " ", button)
        : el("p", {}, "There is no other run in the same directory."),
      el("div", { id: "compare-answer" })),
  );
}

export const selection = () => ({ with: compared });

export function select(keys) {
  wanted = keys.with ?? "";
}

export function show() {
  if (wanted && wanted !== compared) {
    document.getElementById("compare-with").value = wanted;
    compare(wanted);
  }
  wanted = "";
}

async function compare(name) {
  compared = name;
  changed();
  const place = document.getElementById("compare-answer");
  place.replaceChildren(el("p", { role: "status" }, "reading both runs"));
  const answer = await act(() => ask(`api/compare?with=${encodeURIComponent(name)}`));
  if (!answer) {
    compared = "";
    changed();
    place.replaceChildren();
    return;
  }
  const rows = answer.differences.map((line) =>
    el("tr", {},
      el("td", {}, line.cycle === null ? "" : el("button", { class: "link", type: "button", click: () => goTo(line.cycle) }, String(line.cycle))),
      el("td", {}, line.what), el("td", {}, line.here), el("td", {}, line.there)));
  place.replaceChildren(
    el("p", { class: "verdict" }, answer.words),
    rows.length
      ? el("div", { class: "wide", tabindex: "0", role: "region", "aria-label": "Differences" }, el("table", {},
          el("thead", {}, el("tr", {}, ["cycle", "difference", "this run", name].map((head) => el("th", { scope: "col" }, head)))),
          el("tbody", {}, rows)))
      : el("p", {}, "no differences"),
  );
}
