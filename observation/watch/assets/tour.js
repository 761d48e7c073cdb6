// A tour of three steps over the first view. It does not block the page. A browser that was opened by a link to a view, or that has ended or
// skipped the tour, shows it only on request (button with the question mark).

import { el, setText } from "/element.js";

const KEY = "tour";

const STEPS = [
  {
    target: ".picture-frame",
    title: "The hardware, and the source of each output",
    words: "Stations above the network, remote I/Os and plants below it. The line into a remote I/O shows the source of its outputs: solid for direct outputs of its own controller, dashed for outputs reconstructed from the parity word of an understudy.",
  },
  {
    target: "#protection-card, #redundancy-card",
    title: "Remaining redundancy",
    words: "A program is protected while the failure of one station would be masked. The list shows the effect of the failure of each station.",
  },
  {
    target: ".member[data-kind=controller], .member[data-kind=understudy], .timebar",
    title: "Try it",
    words: "",
  },
];

let step = 0;
let card = null;
let mayCommand = false;

export function prepare(run) {
  mayCommand = !run.commands.why;
  document.getElementById("tour-start").addEventListener("click", () => show(0));
  addEventListener("keydown", (event) => {
    if (event.key === "Escape" && card && !document.querySelector("dialog[open]")) {
      end();
    }
  });
  // A link shows what it names, to a first visitor too. The tour was not requested, so the focus stays.
  if (localStorage.getItem(KEY) !== "seen" && !location.hash) {
    show(0, false);
  }
}

const lastWords = () =>
  `${mayCommand ? "Click a station and kill it: the outputs continue." : "Click a station to see its state; this page is read-only."} Click an output to see why it has its value. The bar below the tabs selects any cycle.`;

function show(number, focus = true) {
  step = number;
  location.hash = "cluster";
  card ??= make();
  const { title, words } = STEPS[step];
  setText(card.querySelector("h2"), title);
  setText(card.querySelector(".tour-words"), words || lastWords());
  setText(card.querySelector(".tour-step"), `${step + 1} of ${STEPS.length}`);
  card.querySelector("[data-tour=back]").disabled = step === 0;
  setText(card.querySelector("[data-tour=next]"), step === STEPS.length - 1 ? "Done" : "Next");
  mark();
  if (focus) {
    card.querySelector("[data-tour=next]").focus({ preventScroll: true });
  }
}

function mark() {
  for (const old of document.querySelectorAll(".tour-target")) {
    old.classList.remove("tour-target");
  }
  if (card) {
    const found = [...document.querySelectorAll(STEPS[step].target)];
    found.forEach((element) => element.classList.add("tour-target"));
    const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    found[0]?.scrollIntoView({ block: "nearest", behavior: still ? "auto" : "smooth" });
  }
}

function end() {
  localStorage.setItem(KEY, "seen");
  const hadFocus = card.contains(document.activeElement);
  card.remove();
  card = null;
  mark();
  if (hadFocus) {
    document.getElementById("tour-start").focus();
  }
}

function make() {
  const button = (name, words, click) => el("button", { type: "button", "data-tour": name, click }, words);
  const made = el("section", { id: "tour", class: "tour", "aria-labelledby": "tour-title" },
    el("h2", { id: "tour-title" }),
    el("p", { class: "tour-words", "aria-live": "polite" }),
    el("p", { class: "tour-buttons" },
      el("span", { class: "tour-step soft" }),
      button("skip", "Skip", end),
      button("back", "Back", () => show(step - 1)),
      button("next", "Next", () => (step === STEPS.length - 1 ? end() : show(step + 1)))));
  document.body.append(made);
  return made;
}
