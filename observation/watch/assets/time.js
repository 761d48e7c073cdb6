// The cycle that the page shows: the newest one, or a chosen one.
//
// Views register with `onState`. There is one stream from the server, which is followed only while the page is live; a past cycle is
// requested once, and late answers are dropped.

import { act, ask } from "/ask.js";
import { el, setText } from "/element.js";
import { keep, kept } from "/kept.js";

// Older values are stale: the server sends an event at least twice a second.
const STALE_MS = 2000;
const STALE_CYCLES = 20;

const listeners = new Set();
let live = true;
let newest = null;
let shown = null;
let wanted = null;
let asking = false;
let range = null;

// The cycle that an address asks for, before the first state has come.
let opening = null;

// A replay: where it began, when, and how fast.
let playing = null;
let period = 1;
let speed = 1;
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10, 50];
const TICK_MS = 40;
// A replay of a live run that is started at its newest cycle begins so long before it.
const BACK_MS = 10_000;

// Of the last event from the server: when it came by two clocks, of which one may stand still and the other be set; what was read of the
// journal, where it is being read; and how old the newest record was.
let heard = { date: Date.now(), clock: performance.now() };
let reading = null;
let age = 0;
let patience = STALE_MS;

function hear() {
  heard = { date: Date.now(), clock: performance.now() };
}

// Reason why the shown values are stale; nothing for the present and for a chosen cycle.
export function stale() {
  if (!live || shown?.finished) {
    return null;
  }
  const silent = Math.max(Date.now() - heard.date, performance.now() - heard.clock);
  const seconds = (ms) => `${Math.floor(ms / 1000)} s`;
  if (silent > STALE_MS) {
    return `no message from the server for ${seconds(silent)}: the values below are old`;
  }
  if (reading !== null) {
    return `reading the journal: ${reading} %; the present state is not known yet`;
  }
  if (shown && age > patience) {
    return `the run has written no record for ${seconds(age + silent)}: the values below are old`;
  }
  return null;
}

export const onState = (listener) => listeners.add(listener);
export const state = () => shown;
export const isLive = () => live;

// A parameter for the server's questions: every view shows the same cycle, also of a live run.
export const cycleParameter = () => (shown ? `cycle=${shown.cycle}` : "");

function show(next) {
  shown = next;
  for (const listener of listeners) {
    listener(shown, live);
  }
  const scrub = document.getElementById("scrub");
  const [first, last] = range ?? [0, 0];
  scrub.min = first;
  scrub.max = last;
  if (document.activeElement !== document.getElementById("cycle")) {
    document.getElementById("cycle").value = shown.cycle;
  }
  scrub.value = shown.cycle;
  scrub.setAttribute("aria-valuetext", `cycle ${shown.cycle}`);
  const button = document.getElementById("live");
  button.setAttribute("aria-pressed", String(live));
  setText(button, shown.finished ? "End" : "Live");
}

function take(next) {
  if (!next) {
    return;
  }
  newest = next;
  // What the server does not remember it reads from the journal again.
  range = [Math.min(0, next.oldest), next.newest];
  const status = document.getElementById("status");
  status.classList.remove("lost");
  if (opening !== null) {
    const cycle = opening;
    opening = null;
    goTo(cycle);
  } else if (live) {
    show(next);
  } else {
    document.getElementById("scrub").max = next.newest;
  }
}

// Shows a cycle as soon as it is known which there are.
export function openAt(cycle) {
  if (newest) {
    goTo(cycle);
  } else {
    live = false;
    opening = cycle;
  }
}

export function goLive() {
  stop();
  live = true;
  wanted = null;
  opening = null;
  if (newest) {
    show(newest);
  }
}

// Shows a cycle; a replay continues from there.
export function goTo(cycle) {
  const number = seek(cycle);
  if (playing) {
    playing = { ...playing, from: number, at: performance.now() };
  }
}

function seek(cycle) {
  const [first, last] = range ?? [0, 0];
  const number = Math.min(Math.max(Math.round(Number(cycle)) || 0, first), last);
  live = false;
  wanted = number;
  fetchWanted();
  return number;
}

async function fetchWanted() {
  if (asking) {
    return;
  }
  asking = true;
  while (wanted !== null) {
    const cycle = wanted;
    const next = await act(() => ask(`api/state?cycle=${cycle}`));
    if (wanted === cycle) {
      wanted = null;
    }
    if (next && !live) {
      show(next);
    }
  }
  asking = false;
}

function stop() {
  clearInterval(playing?.timer);
  playing = null;
  document.getElementById("play").textContent = "Play";
}

// From the cycle that is shown. At its end a finished run begins again, and a live one is replayed from some seconds ago.
function play() {
  if (playing) {
    stop();
    return;
  }
  if (!range || !shown) {
    return;
  }
  document.getElementById("play").textContent = "Pause";
  const [first, last] = range;
  const atEnd = live || shown.cycle >= last;
  const back = shown.finished ? first : last - Math.round(BACK_MS / period);
  const from = seek(atEnd ? back : (wanted ?? shown.cycle));
  playing = { from, at: performance.now(), timer: setInterval(tick, TICK_MS) };
}

// By the clock: where the server is slower than the replay, cycles are left out.
function tick() {
  const cycle = playing.from + Math.floor(((performance.now() - playing.at) * speed) / period);
  if (cycle < range[1]) {
    if (cycle > (wanted ?? shown.cycle)) {
      seek(cycle);
    }
  } else if (shown.cycle < range[1]) {
    seek(range[1]);
  } else {
    stop();
    if (!newest.finished) {
      goLive();
    }
  }
}

function choose(next) {
  speed = next;
  keep("speed", speed);
  if (playing) {
    playing = { ...playing, from: wanted ?? shown.cycle, at: performance.now() };
  }
}

function step(by) {
  stop();
  goTo((wanted ?? shown?.cycle ?? 0) + by);
}

export function start(run) {
  period = run.period_us / 1000;
  const speeds = document.getElementById("speed");
  speed = SPEEDS.find((known) => known === kept("speed")) ?? 1;
  speeds.append(...SPEEDS.map((known) => el("option", { value: known, selected: known === speed }, `× ${known}`)));
  patience = Math.max(STALE_MS, (STALE_CYCLES * run.period_us) / 1000);
  const on = (id, event, work) => document.getElementById(id).addEventListener(event, work);
  on("live", "click", goLive);
  on("back", "click", () => step(-1));
  on("forth", "click", () => step(1));
  on("play", "click", play);
  on("speed", "change", (event) => choose(Number(event.target.value)));
  on("scrub", "input", (event) => goTo(event.target.value));
  on("cycle", "change", (event) => goTo(event.target.value));
  addEventListener("keydown", (event) => {
    if (event.target.closest?.("input, select, textarea, dialog") || event.altKey || event.ctrlKey) {
      return;
    }
    if (event.key === "ArrowLeft") {
      step(-1);
    } else if (event.key === "ArrowRight") {
      step(1);
    }
  });
  follow();
}

function follow() {
  const stream = new EventSource("api/live");
  stream.addEventListener("state", (event) => {
    hear();
    reading = null;
    const next = JSON.parse(event.data);
    age = next?.age_ms ?? 0;
    take(next);
  });
  stream.addEventListener("pulse", (event) => {
    hear();
    reading = null;
    age = Number(event.data);
  });
  stream.addEventListener("reading", (event) => {
    hear();
    reading = Number(event.data);
  });
  // A browser calls again by itself, but not where it was answered by an error.
  stream.addEventListener("error", () => {
    const status = document.getElementById("status");
    status.classList.add("lost");
    status.textContent = shown?.finished ? "the server of the page has ended" : "no connection to the server; reconnecting";
    if (stream.readyState === EventSource.CLOSED) {
      setTimeout(follow, 3000);
    }
  });
}
