// Trends as files: a table of values and a picture.

import { el } from "/element.js";
import { stamp } from "/zone.js";

function save(name, blob) {
  const link = el("a", { href: URL.createObjectURL(blob), download: name });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

const cell = (value) => {
  const text = value === null || value === undefined ? "" : String(value);
  return /[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
};

// A row for each cycle (RFC 4180): the time from the origin of the run, the time of day where it is known, the values, and the source of the outputs of each program. What is not known is empty.
export function csvOf(answer, headOf, periodUs, atOf) {
  const steps = answer.signals.map((signal) => reader(signal.runs));
  const sources = answer.sources.map((band) => (cycle) => band.runs.find(([from, to]) => from <= cycle && cycle <= to)?.[2]);
  const head = ["cycle", "time_s", "time_of_day", ...answer.signals.map(headOf), ...answer.sources.map((band) => `source of ${band.name}`)];
  const rows = [head];
  for (let cycle = answer.from; cycle <= answer.to; cycle += 1) {
    rows.push([cycle, (cycle * periodUs) / 1e6, atOf(cycle) && stamp(atOf(cycle)), ...steps.map((step) => step(cycle)), ...sources.map((source) => source(cycle))]);
  }
  return `${rows.map((row) => row.map(cell).join(",")).join("\r\n")}\r\n`;
}

// A row for each column of a trend of many cycles, with the least and the greatest value of each signal in its cycles.
export function csvOfColumns(answer, headOf, periodUs, atOf) {
  const heads = answer.signals.flatMap((signal, index) => [`least ${headOf(signal, index)}`, `greatest ${headOf(signal, index)}`]);
  const rows = [["cycle", "time_s", "time_of_day", ...heads]];
  for (let cycle = answer.from, place = 0; cycle <= answer.to; cycle += answer.column, place += 1) {
    const values = answer.signals.flatMap((signal) => signal.columns[place] ?? [null, null]);
    rows.push([cycle, (cycle * periodUs) / 1e6, atOf(cycle) && stamp(atOf(cycle)), ...values]);
  }
  return `${rows.map((row) => row.map(cell).join(",")).join("\r\n")}\r\n`;
}

// The value of a run-length coded signal in ascending cycles.
export function reader(runs) {
  let at = -1;
  return (cycle) => {
    while (at + 1 < runs.length && runs[at + 1][0] <= cycle) {
      at += 1;
    }
    return at < 0 ? null : runs[at][1];
  };
}

export function saveCsv(name, text) {
  save(`${name}.csv`, new Blob([text], { type: "text/csv" }));
}

// The plot on the paper of the page, with a title above it.
export function savePng(name, canvas, title, paper, ink) {
  const head = 30 * devicePixelRatio;
  const picture = el("canvas", { width: canvas.width, height: canvas.height + head });
  const context = picture.getContext("2d");
  context.fillStyle = paper;
  context.fillRect(0, 0, picture.width, picture.height);
  context.fillStyle = ink;
  context.font = `${14 * devicePixelRatio}px system-ui, sans-serif`;
  context.fillText(title, 10 * devicePixelRatio, 20 * devicePixelRatio);
  context.drawImage(canvas, 0, head);
  return new Promise((resolve) => picture.toBlob((blob) => {
    save(`${name}.png`, blob);
    resolve(blob.size);
  }, "image/png"));
}
