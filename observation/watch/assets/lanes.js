// The lanes of a trend: where each signal lies, its labels, its limits, and the ticks of the axis of time.

import { shorten, valueText } from "/element.js";

// Height of a lane of numbers, and of the one that several share, as a multiple of a lane of a BOOL.
const HIGH = 4;
const SHARED = 8;

// Where the scale of a signal is: in a lane of its own, or on the left or the right of the lane that all with such a scale share.
export const SCALES = ["own", "left", "right"];

// The ends of a scale: the range of the cards where there is one, and whatever values and limits are beyond it. A value that does not change has room
// around it.
function scaleOf(members) {
  const all = members.flatMap(({ signal, card }) => [
    ...signal.columns.flatMap((column) => column ?? []), ...signal.runs.map(([, value]) => value).filter((value) => value !== null),
    ...signal.limits, ...(card.low === undefined ? [] : [card.low, card.high]), ...Object.keys(card.values ?? {}).map(Number)]);
  const low = all.reduce((least, value) => Math.min(least, value), Infinity);
  const high = all.reduce((most, value) => Math.max(most, value), -Infinity);
  if (!Number.isFinite(low)) {
    return { low: 0, high: 0 };
  }
  const room = low < high ? 0 : Math.abs(low) * 0.1 || 1;
  const whole = members.every(({ card }) => !["REAL", "LREAL", "TIME"].includes(card.type));
  return { low: low - (whole ? Math.ceil(room) : room), high: high + (whole ? Math.ceil(room) : room) };
}

// The lane of each signal, the first on top. A BOOL is at the bottom of its lane where it is 0 and above where it is 1; a number lies between the ends of
// its scale, which the axis shows. `cardOf` gives what is known of a signal, `scaleOfIndex` one of SCALES.
export function lanesOf(signals, cardOf, scaleOfIndex) {
  const members = signals.map((signal, index) => {
    const card = cardOf(index) ?? {};
    const isNumber = (card.type ?? "BOOL") !== "BOOL";
    return { signal: isNumber ? signal : { ...signal, limits: [] }, card, isNumber, scale: isNumber ? scaleOfIndex(index) : "own" };
  });
  const scales = new Map(["left", "right"].map((scale) => [scale, scaleOf(members.filter((member) => member.scale === scale))]));
  const lanes = members.map(({ signal, card, isNumber, scale }) => ({
    name: card.unit ? `${signal.name}, ${card.unit}` : signal.name, type: card.type, values: card.values, decimals: card.decimals, unit: card.unit,
    isNumber, scale, limits: signal.limits, height: scale !== "own" ? SHARED : isNumber ? HIGH : 1,
    ...(scales.get(scale) ?? scaleOf([{ signal, card }])),
  }));
  let base = 0;
  for (const lane of lanes.filter(({ scale }) => scale === "own").reverse()) {
    lane.base = base;
    base += lane.height;
  }
  lanes.filter(({ scale }) => scale !== "own").forEach((lane) => { lane.base = base; });
  return lanes;
}

// The height of all lanes.
export const heightOfAll = (lanes) => Math.max(0, ...lanes.map((lane) => lane.base + lane.height));

// Where a value lies: a number that does not change in the middle of its lane.
export function heightOf(lane, value) {
  if (!lane.isNumber) {
    return lane.base + 0.7 * value;
  }
  const share = lane.high > lane.low ? (value - lane.low) / (lane.high - lane.low) : 0.5;
  return lane.base + 0.2 + share * (lane.height - 0.7);
}

// A value in words: that of an enumeration by its name.
export const laneText = (value, lane) => lane.values?.[value] ?? valueText(value, lane.type, lane.decimals);

// A value with its unit.
export const unitText = (value, lane) => (lane.unit ? `${laneText(value, lane)} ${lane.unit}` : laneText(value, lane));

// A number of the axis, with its decimals or with as many digits as a person compares.
function axisText(value, lane) {
  const isLong = typeof value === "number" && !Number.isInteger(value) && lane.decimals === undefined;
  return laneText(isLong ? Number(value.toPrecision(4)) : value, lane);
}

// Labels of one side of the plot: of a lane of its own the name between the ends of its scale; of the shared lane the ends and the middle of the scale of
// that side, with the names of its signals.
export function labelsOf(lanes, side, most) {
  const value = (lane, at) => [heightOf(lane, at), axisText(at, lane)];
  const own = side === "left" ? lanes.filter(({ scale }) => scale === "own") : [];
  const labels = own.flatMap((lane) => {
    const name = shorten(lane.name, most);
    return lane.isNumber ? [value(lane, lane.low), [lane.base + lane.height / 2 - 0.15, name], value(lane, lane.high)] : [[lane.base + 0.35, name]];
  });
  const shared = lanes.filter(({ scale }) => scale === side);
  if (shared.length > 0) {
    const [first] = shared;
    const middle = (first.low + first.high) / 2;
    const rooms = shared.slice(0, 4).map((lane, place) => [first.base + first.height - 1.6 - place * 0.7, shorten(lane.name, most)]);
    labels.push(value(first, first.low), ...(Number.isInteger(middle) || !isWhole(first) ? [value(first, middle)] : []), ...rooms, value(first, first.high));
  }
  return labels.sort(([one], [other]) => one - other);
}

const isWhole = ({ type }) => !["REAL", "LREAL", "TIME"].includes(type);

const SECOND = 1000;
const STEPS = [1, 2, 5, 10, 20, 50, 100, 200, 500, ...[1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 10_800, 21_600, 43_200, 86_400, 172_800, 604_800].map((seconds) => seconds * SECOND)];

// Milliseconds between two ticks that are at least `space` pixels apart, for a range of `length` milliseconds on `width` pixels.
export function tickStep(length, width, space) {
  const least = length / Math.max(width / space, 1);
  return STEPS.find((step) => step >= least) ?? STEPS.at(-1);
}

// The cycles of the ticks from one cycle to another, at round times of day in the shown zone; of a run without a clock, at round times from its origin.
export function ticks(from, to, step, periodMs, millisecondsOf) {
  const begin = millisecondsOf(from);
  const found = [];
  for (let at = Math.ceil(begin / step) * step; found.length < 100; at += step) {
    const cycle = Math.round(from + (at - begin) / periodMs);
    if (cycle > to) {
      break;
    }
    found.push(cycle);
  }
  return found;
}
