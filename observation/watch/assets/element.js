// Elements of the page. Text is always text: nothing that comes from a run is read as markup.

const SVG = "http://www.w3.org/2000/svg";

export const el = (name, attributes = {}, ...children) =>
  fill(document.createElement(name), attributes, children);

export const svg = (name, attributes = {}, ...children) =>
  fill(document.createElementNS(SVG, name), attributes, children);

function fill(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === null || value === false) {
      continue;
    }
    if (typeof value === "function") {
      element.addEventListener(name, value);
    } else {
      element.setAttribute(name, value === true ? "" : value);
    }
  }
  element.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined));
  return element;
}

// A name of at most so many letters: names of one plant often begin alike, and many end alike, so the middle goes.
export function shorten(name, most) {
  if (name.length <= most) {
    return name;
  }
  const end = Math.floor((most - 1) / 2);
  return `${name.slice(0, most - 1 - end)}…${name.slice(-end)}`;
}

// A name that is broken behind its dots and underscores, and not in the middle of a word.
export const broken = (name) => name.split(/(?<=[._])/).flatMap((part, place) => (place === 0 ? [part] : [el("wbr"), part]));

// Sets only what differs, so that focus, selection and scrolling stay.
export function setText(element, text) {
  if (element.textContent !== text) {
    element.textContent = text;
  }
}

export function setAttribute(element, name, value) {
  if (element.getAttribute(name) !== value) {
    element.setAttribute(name, value);
  }
}

// One element for each item by its key, made once and shown anew.
export function keyed(parent, items, keyOf, make, show) {
  const known = new Map([...parent.children].map((child) => [child.dataset.key, child]));
  let before = null;
  for (const item of items) {
    const key = String(keyOf(item));
    let child = known.get(key);
    known.delete(key);
    if (!child) {
      child = make(item);
      child.dataset.key = key;
    }
    const place = before ? before.nextSibling : parent.firstChild;
    if (place !== child) {
      parent.insertBefore(child, place);
    }
    show?.(child, item);
    before = child;
  }
  for (const gone of known.values()) {
    gone.remove();
  }
}

// Types whose values are nanoseconds.
const TIMES = new Set(["TIME", "DATE", "TIME_OF_DAY", "DATE_AND_TIME"]);

const UNITS = [["d", 86_400_000_000_000], ["h", 3_600_000_000_000], ["m", 60_000_000_000], ["s", 1_000_000_000], ["ms", 1_000_000], ["us", 1_000], ["ns", 1]];

// A duration in nanoseconds as the terminal writes it: `2s20ms`.
function durationText(nanoseconds) {
  let rest = Math.round(Math.abs(nanoseconds));
  let text = "";
  for (const [unit, length] of UNITS) {
    const count = Math.floor(rest / length);
    text += count ? `${count}${unit}` : "";
    rest -= count * length;
  }
  return `${nanoseconds < 0 ? "-" : ""}${text || "0ms"}`;
}

// A number with its decimals; one that rounds to 0 has no sign.
const rounded = (value, decimals) => value.toFixed(decimals).replace(/^-(0\.?0*)$/, "$1");

// A value as people read it: a BOOL as 0 or 1, a number with the decimals of its card, or with at most seven digits.
export function valueText(value, type, decimals) {
  if (TIMES.has(type) && typeof value === "number") {
    return durationText(value);
  }
  if (typeof value === "boolean") {
    return value ? "1" : "0";
  }
  if (typeof value === "number") {
    return decimals !== undefined ? rounded(value, decimals) : Number.isInteger(value) ? String(value) : String(Number(value.toPrecision(7)));
  }
  return value === null || value === undefined ? "?" : String(value);
}
