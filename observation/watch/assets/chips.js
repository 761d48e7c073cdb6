// A choice of some of several names, each with the number of things that have it. None chosen means all.

import { el, keyed, setAttribute, setText } from "/element.js";

export function chips(label, change, words = (name) => name) {
  const element = el("div", { class: "chips", role: "group", "aria-label": label });
  let chosen = new Set();
  const press = (name) => {
    if (!chosen.delete(name)) {
      chosen.add(name);
    }
    change();
  };
  const show = (counts) => {
    // A name that was chosen stays, also where nothing has it any more.
    const names = [...new Set([...Object.keys(counts), ...chosen])];
    keyed(element, names, (name) => name,
      (name) => el("button", { type: "button", class: "chip", "data-name": name, click: () => press(name) }),
      (button, name) => {
        setText(button, `${words(name)} ${counts[name] ?? 0}`);
        setAttribute(button, "aria-pressed", String(chosen.has(name)));
      });
  };
  return {
    element,
    show,
    chosen: () => [...chosen],
    choose: (names) => {
      chosen = new Set(names);
    },
  };
}

// Chips that are folded away; the summary has what is chosen.
export function folded(label, change) {
  const inner = chips(label, change);
  const summary = el("summary");
  const element = el("details", { class: "filter" }, summary, inner.element);
  const show = (counts) => {
    const chosen = inner.chosen();
    setText(summary, `${label}: ${chosen.length === 0 ? "all" : chosen.join(", ")}`);
    inner.show(counts);
  };
  return { ...inner, element, show };
}
