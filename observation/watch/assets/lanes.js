// The lanes of a trend: where each signal lies, its labels, its limits, and the ticks of the axis of time.

import { shorten, valueText } from "/element.js";

// Height of a lane of numbers, as a multiple of a lane of a BOOL.
const HIGH = 4;

// The least and the greatest known value of a signal, with its limits.
function extremes(signal, isNumber) {
  const columns = signal.columns.flatMap((column) => column ?? []);
  const runs = signal.runs.map(([, value]) => value).filter((value) => value !== null);
  const all = [...columns, ...runs, ...(isNumber ? signal.limits : [])];
  const low = all.reduce((least, value) => Math.min(least, value), Infinity);
  const high = all.reduce((most, value) => Math.max(most, value), -Infinity);
  return Number.isFinite(low) ? { low, high } : { low: 0, high: 0 };
}

// Each signal has a lane of its own, the first on top. A BOOL is at the bottom of it where it is 0 and above where it is 1; a number lies between its
// least and its greatest value, which the axis shows.
export function lanesOf(signals, signalOf, unitOf) {
  let base = 0;
  const lanes = signals.map((signal, index) => {
    const { type = "BOOL", values } = signalOf(index) ?? {};
    const isNumber = type !== "BOOL";
    const unit = unitOf(index);
    return { name: unit ? `${signal.name}, ${unit}` : signal.name, type, values, isNumber, height: isNumber ? HIGH : 1, limits: isNumber ? signal.limits : [], ...extremes(signal, isNumber) };
  });
  for (const lane of [...lanes].reverse()) {
    lane.base = base;
    base += lane.height;
  }
  return lanes;
}

// Where a value lies: a number that does not change in the middle of its lane.
export function heightOf(lane, value) {
  if (!lane.isNumber) {
    return lane.base + 0.7 * value;
  }
  const share = lane.high > lane.low ? (value - lane.low) / (lane.high - lane.low) : 0.5;
  return lane.base + 0.2 + share * (lane.height - 0.7);
}

// A value in words: that of an enumeration by its name.
export const laneText = (value, lane) => lane.values?.[value] ?? valueText(value, lane.type);

// A number of the axis, with as many digits as a person compares.
function axisText(value, lane) {
  const isLong = typeof value === "number" && !Number.isInteger(value);
  return laneText(isLong ? Number(value.toPrecision(4)) : value, lane);
}

// Labels of a lane: the name, and the least and the greatest value; of one that does not change its value.
export function labelsOf(lane, most) {
  const name = shorten(lane.name, most);
  if (!lane.isNumber) {
    return [[lane.base + 0.35, name]];
  }
  const middle = lane.base + lane.height / 2 - 0.15;
  const value = (at) => [heightOf(lane, at), axisText(at, lane)];
  return lane.high > lane.low ? [value(lane.low), [middle, name], value(lane.high)] : [value(lane.low), [middle + 1, name]];
}

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
