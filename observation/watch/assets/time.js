// The cycle that the page shows: the newest one, or a chosen one.
//
// Views register with `onState`. There is one stream from the server, which is followed only while the page is live; a past cycle is
// requested once, and late answers are dropped.

import { act, ask } from "/ask.js";

// Older values are stale: the server sends an event at least twice a second.
const STALE_MS = 2000;
const STALE_CYCLES = 20;

const listeners = new Set();
let live = true;
let newest = null;
let shown = null;
let wanted = null;
let asking = false;
let playing = 0;
let range = null;

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

// A parameter for the server's questions.
export const cycleParameter = () => (live || !shown ? "" : `cycle=${shown.cycle}`);

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
  button.textContent = shown.finished ? "End" : "Live";
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
  if (live) {
    show(next);
  } else {
    document.getElementById("scrub").max = next.newest;
  }
}

export function goLive() {
  stop();
  live = true;
  wanted = null;
  if (newest) {
    show(newest);
  }
}

export function goTo(cycle) {
  const [first, last] = range ?? [0, 0];
  const number = Math.min(Math.max(Math.round(Number(cycle)) || 0, first), last);
  live = false;
  wanted = number;
  return fetchWanted();
}

async function fetchWanted() {
  if (asking) {
    return;
  }
  asking = true;
  while (wanted !== null) {
    const cycle = wanted;
    const next = await act(() => ask(`/api/state?cycle=${cycle}`));
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
  clearInterval(playing);
  playing = 0;
  document.getElementById("play").textContent = "Play";
}

function play() {
  if (playing) {
    stop();
    return;
  }
  document.getElementById("play").textContent = "Pause";
  if (live || shown?.cycle >= range?.[1]) {
    goTo(range?.[0] ?? 0);
  }
  playing = setInterval(() => {
    if (shown && !asking) {
      if (shown.cycle >= range[1]) {
        stop();
      } else {
        goTo(shown.cycle + 1);
      }
    }
  }, 120);
}

function step(by) {
  stop();
  goTo((wanted ?? shown?.cycle ?? 0) + by);
}

export function start(run) {
  patience = Math.max(STALE_MS, (STALE_CYCLES * run.period_us) / 1000);
  const on = (id, event, work) => document.getElementById(id).addEventListener(event, work);
  on("live", "click", goLive);
  on("back", "click", () => step(-1));
  on("forth", "click", () => step(1));
  on("play", "click", play);
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
  const stream = new EventSource("/api/live");
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
