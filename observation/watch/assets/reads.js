// Who reads whom: a column for each program, and an arrow for each signal from the program that computes it to the one that reads it.

import { el, setAttribute, setText, shorten, svg } from "/element.js";
import { textOf } from "/signals.js";

// Two programs fit on a telephone.
const WIDTH = 110;
const GAP = 98;
const MARGIN = 6;
const BOX = 34;
const ROW = 46;
const TOP = 8;
const LETTER = 6.4;

export function makeReads(run) {
  const signals = run.programs.flatMap((reader) =>
    reader.inputs.flatMap((input, index) => (input.from ? [{ reader, input, index, from: run.programs[input.from.program] }] : [])));
  if (signals.length === 0) {
    return null;
  }
  const columns = run.programs.filter((program) => signals.some(({ reader, from }) => reader === program || from === program));
  const center = (program) => MARGIN + columns.indexOf(program) * (WIDTH + GAP) + WIDTH / 2;
  const width = columns.length * (WIDTH + GAP) - GAP + 2 * MARGIN;
  const height = TOP + BOX + signals.length * ROW + 22;
  const lines = columns.map((program) => svg("line", { class: "lifeline", x1: center(program), x2: center(program), y1: TOP + BOX, y2: height - 6 }));
  const boxes = columns.map((program) => svg("g", {}, svg("title", {}, program.name),
    svg("rect", { x: center(program) - WIDTH / 2, y: TOP, width: WIDTH, height: BOX, rx: 5 }),
    svg("text", { class: "name", x: center(program), y: TOP + 22, "text-anchor": "middle" }, shorten(program.name, 12))));
  const arrows = signals.map((signal, row) => makeArrow(signal, center(signal.from), center(signal.reader), TOP + BOX + (row + 1) * ROW));
  const picture = svg("svg", { class: "picture reads", viewBox: `0 0 ${width} ${height}`, width, height, role: "img", "aria-labelledby": "reads-title", "aria-describedby": "reads-list" }, lines, boxes, arrows.map((arrow) => arrow.element));
  const items = signals.map(() => el("li"));
  const element = el("section", { class: "card", "aria-labelledby": "reads-title" },
    el("h2", { id: "reads-title" }, "Signals between programs"),
    el("div", { class: "picture-frame", tabindex: "0", role: "region", "aria-label": "Picture of the signals between programs" }, picture),
    el("p", { class: "soft" }, "Solid: the signal is valid. Dashed: it is not, and the default value is sampled."),
    el("ul", { id: "reads-list", class: "plain" }, items));
  const show = (state) => signals.forEach((signal, row) => {
    const own = state.programs[signal.reader.index];
    const valid = own.signals.find(({ input }) => input === signal.index)?.valid ?? null;
    const value = textOf(signal.input, own.input_values?.[signal.index]);
    const words = valid === null ? "validity not known" : valid ? "valid" : "not valid: default value";
    arrows[row].show(value, valid);
    setAttribute(items[row], "data-valid", String(valid));
    setText(items[row], `${signal.reader.name} reads ${signal.from.name}.${signal.input.from.output} as ${signal.input.name} = ${value}, ${words}`);
  });
  return { element, show };
}

function makeArrow({ input, from, reader }, x1, x2, y) {
  const way = Math.sign(x2 - x1) || 1;
  const name = input.from.output === input.name ? input.name : `${input.from.output} → ${input.name}`;
  const letters = Math.floor(Math.abs(x2 - x1) / LETTER) - 2;
  const words = svg("text", { class: "arrow-words", x: (x1 + x2) / 2, y: y - 8, "text-anchor": "middle" });
  const tip = x2 - way * 3;
  const element = svg("g", { class: "arrow", "data-signal": `${from.name}.${input.from.output}>${reader.name}.${input.name}` },
    svg("line", { x1: x1 + way * 3, x2: tip - way * 8, y1: y, y2: y }),
    svg("path", { d: `M ${tip} ${y} l ${-way * 11} -5 v 10 z` }), words);
  const show = (value, valid) => {
    setAttribute(element, "data-valid", String(valid));
    const end = ` = ${value}`;
    setText(words, `${shorten(name, Math.max(6, letters - end.length))}${end}`);
  };
  return { element, show };
}
