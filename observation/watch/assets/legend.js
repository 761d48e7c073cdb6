// Legends of signs, lines and colours, drawn with the styles of the views.

import { el, svg } from "/element.js";
import { SOURCES } from "/sources.js";

const item = (mark, words) => el("li", {}, mark, " ", words);
const list = (heading, items) => el("div", { class: "legend" }, el("strong", { class: "soft" }, heading), el("ul", { class: "plain", "aria-label": heading }, items));

const flow = (source) =>
  svg("svg", { class: "picture", width: 34, height: 10, "aria-hidden": "true" }, svg("line", { class: "flow", "data-source": source, x1: 0, x2: 34, y1: 5, y2: 5 }));

const MEANINGS = {
  direct: "from the controller",
  reconstructed: "from a parity word of an understudy",
  held: "last provable values",
  "fail-safe": "configured values",
};

export const sourceLegend = () =>
  list("Source of the outputs", Object.entries(MEANINGS).map(([source, words]) => item(flow(source), `${SOURCES[source].sign} ${SOURCES[source].words}: ${words}`)));

export const stateLegend = (states) =>
  list("States", states.map((look) => item(el("b", { "aria-hidden": "true" }, look.sign), look.words)));

export const signalLegend = () =>
  list("Signals", [
    item(el("span", { class: "lamp", "data-on": "1", "aria-hidden": "true" }), "1, on"),
    item(el("span", { class: "lamp", "aria-hidden": "true" }), "0, off"),
    el("li", {}, "F: forced"),
    el("li", {}, "click an output to see why it has its value"),
  ]);

export const bandLegend = () => {
  const patterns = { direct: "plain", reconstructed: "slanted lines", held: "dots", "fail-safe": "filled" };
  const band = (source) => el("span", { class: "band", "data-source": source, "aria-hidden": "true" });
  const items = Object.entries(patterns).map(([source, words]) => item(band(source), `${SOURCES[source].sign} ${SOURCES[source].words} (${words})`));
  return list("Bands: source of the outputs of each remote I/O", [...items, item(el("span", { class: "fault", "aria-hidden": "true" }), "a fault or a command")]);
};

export const ladderLegend = () => {
  const line = (kind) => svg("svg", { class: "ladder-line ladder", width: 34, height: 10, "aria-hidden": "true" }, svg("line", { class: kind, x1: 0, x2: 34, y1: 5, y2: 5 }));
  return list("Lines and values", [
    item(line("live"), "power flows"),
    item(line("wire"), "no power"),
    item(el("span", { class: "closed-contact", "aria-hidden": "true" }), "closed contact"),
    el("li", {}, "1 and 0 next to a name: its value in the cycle shown above"),
    el("li", {}, "F: forced"),
    el("li", {}, "click an output to see why it has its value"),
  ]);
};
