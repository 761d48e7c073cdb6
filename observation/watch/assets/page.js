// The page: its views, its head and its address.

import * as address from "/address.js";
import { act, ask, tell, toast } from "/ask.js";
import * as banner from "/banner.js";
import { setText } from "/element.js";
import * as kept from "/kept.js";
import * as points from "/points.js";
import * as signals from "/signals.js";
import * as time from "/time.js";
import * as cluster from "/cluster.js";
import * as operate from "/operate.js";
import * as ladder from "/ladder.js";
import * as watch from "/values.js";
import * as trends from "/trends.js";
import * as events from "/events.js";
import * as compare from "/compare.js";
import * as commands from "/commands.js";
import * as tour from "/tour.js";
import * as who from "/who.js";
import * as why from "/why.js";
import * as zone from "/zone.js";

const VIEWS = { cluster, operate, ladder, watch, trends, events, compare };

let current = "cluster";

// Shows what the address asks for. A view is given a selection only where the address has one.
function showWanted() {
  const { view, cycle, reason, selection } = address.wanted();
  current = view in VIEWS ? view : "cluster";
  for (const name of Object.keys(VIEWS)) {
    document.getElementById(`view-${name}`).hidden = name !== current;
    const tab = document.getElementById(`tab-${name}`);
    if (name === current) {
      tab.setAttribute("aria-current", "page");
    } else {
      tab.removeAttribute("aria-current");
    }
  }
  if (cycle === "live") {
    time.goLive();
  } else if (cycle !== null) {
    time.openAt(cycle);
  }
  if (Object.keys(selection).length > 0) {
    VIEWS[current].select?.(selection);
  }
  VIEWS[current].enter?.();
  if (reason) {
    why.select(reason);
  }
  if (time.state() && isShown(time.state())) {
    VIEWS[current].show(time.state(), time.isLive());
  }
  address.forget();
}

// The address of what is shown; nothing before there is anything.
function shownAddress() {
  const state = time.state();
  if (!state) {
    return "";
  }
  const cycle = time.isLive() ? "live" : state.cycle;
  return address.addressOf(current, { cycle, ...VIEWS[current].selection?.(), why: why.shown() });
}

let period = 0;

// Whether a state can be shown: the points of its cycle are known.
let isShown = () => false;

function head(state, live) {
  const when = !live ? "replay" : state.finished ? (state.interrupted ? "ended early" : "finished") : time.stale() ? "old" : "live";
  const at = state.at ? ` · ${zone.clockAndZone(state.at)}` : "";
  setText(document.getElementById("status"), `${when}${at} · cycle ${state.cycle} of ${state.newest} · period ${period} ms`);
  zone.showSwitch(state.at);
  const apart = document.getElementById("clocks-apart");
  apart.hidden = !state.clocks_apart;
  setText(apart, state.clocks_apart ? `Clocks of the cluster differ: ${state.clocks_apart}. Times of day are those of one remote I/O.` : "");
  document.body.dataset.when = when;
  banner.show(state);
}

// A long journal is begun near its end; what is before comes behind it.
function showPast({ past }) {
  const place = document.getElementById("past");
  place.hidden = !past;
  const words = past && `Events, trends, counts of late wake-ups and alarms before cycle ${past.from} are being read: ${past.percent} %`;
  setText(place, words ?? "");
}

// The scenario of a demo is over, and its cluster stays up: what a visitor can do now.
function scenarioOver(state, run) {
  const place = document.getElementById("scenario-over");
  place.hidden = !state.scenario_over || state.finished;
  const invitation = run.commands.why ? "" : " Kill a station yourself: click a station, then Kill.";
  setText(place, `The scenario is over (${state.scenario_over}).${invitation}`);
}

// An online change in progress. A program that is replaced by another one has other variables, and other lines or rungs.
let hashes = "";

function online({ change, programs }, live) {
  const place = document.getElementById("online-change");
  place.hidden = !change;
  setText(place, change ? `Online change: ${change}` : "");
  const running = programs.map((program) => program.hash).join(" ");
  if (live && hashes && running !== hashes) {
    signals.forget();
    VIEWS[current].enter?.();
  }
  hashes = live ? running : hashes;
}

// Stale values are greyed out, with the reason.
function showStale() {
  const why = time.stale();
  if (time.state() && Boolean(why) !== document.body.hasAttribute("data-stale")) {
    head(time.state(), time.isLive());
  }
  const place = document.getElementById("stale");
  place.hidden = !why;
  setText(place, why ? `⚠ ${why}` : "");
  document.body.toggleAttribute("data-stale", Boolean(why));
}

// The facts of the run are known as soon as its directory contains them.
async function facts() {
  for (;;) {
    try {
      return await ask("api/run");
    } catch (error) {
      setText(document.getElementById("status"), `waiting: ${error.message}`);
      await new Promise((resolve) => setTimeout(resolve, 1000));
    }
  }
}

async function begin() {
  const run = await facts();
  period = run.period_us / 1000;
  isShown = (state) => points.fit(run, state);
  setText(document.getElementById("title"), run.title || run.cluster);
  document.title = `${run.cluster} · Understudy`;
  const logOut = document.getElementById("log-out");
  logOut.hidden = !run.logged_in;
  logOut.addEventListener("click", () =>
    act(async () => {
      await tell("api/logout", {});
      location.assign("/login.html");
    }),
  );
  kept.prepare(run);
  signals.prepare(run);
  who.prepare(run);
  address.prepare(shownAddress);
  for (const part of [commands, why, ...Object.values(VIEWS)]) {
    part.prepare(run);
  }
  document.getElementById("tab-operate").hidden = !operate.has(run);
  banner.prepare(run);
  zone.prepare();
  // Other points count in the cycle that is to be shown: the views are made anew, with the same signals.
  const replaced = () => {
    const renamed = signals.replacePoints(run);
    for (const view of Object.values(VIEWS)) {
      view.replacePoints?.(renamed);
    }
    document.getElementById("tab-operate").hidden = !operate.has(run);
    VIEWS[current].enter?.();
    show(time.state(), time.isLive());
  };
  const show = (state, live) => {
    if (!points.fit(run, state)) {
      points.follow(run, state, replaced);
      return;
    }
    head(state, live);
    showPast(state);
    scenarioOver(state, run);
    online(state, live);
    VIEWS[current].show(state, live);
    why.show();
    showStale();
    address.changed();
  };
  time.onState(show);
  addEventListener("zone", () => time.state() && show(time.state(), time.isLive()));
  setInterval(showStale, 250);
  addEventListener("visibilitychange", showStale);
  addEventListener("hashchange", showWanted);
  showWanted();
  tour.prepare(run);
  time.start(run);
}

addEventListener("unhandledrejection", (event) => toast(String(event.reason?.message ?? event.reason)));
begin();
