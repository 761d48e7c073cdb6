// The overview of a cluster of many programs: one tile for each program with the states that matter, and the understudies always in sight.
//
// A program is normal while its controller publishes, its remote I/O serves, its outputs are direct and not forced, and the failure of one station would
// be masked. A normal tile has signs only; any other says in words what is not normal.

import { el, keyed, setAttribute, setText } from "/element.js";
import { openMember } from "/commands.js";
import { STATES } from "/picture.js";
import { SOURCES } from "/sources.js";

// Programs up to which the picture of the whole cluster is the overview.
const SMALL = 8;

export const isLarge = (run) => run.programs.length > SMALL;

// The parts of a tile, in the order of its signs.
const PARTS = ["controller", "remote I/O", "outputs", "protection"];

// States of members that need no words.
const SOUND = new Set(["publishing", "serving", "moving"]);
const CHANGING = new Set(["joining", "shadow-mode", "not-started", "standby", "listening", "awaits-release"]);

// Levels of a part, the worst first.
const LEVELS = ["bad", "degraded", "changing", "normal"];

let run = null;
let pick = null;
let chosen = 0;
let only = false;

// `choose` shows the picture of a program, and `change` the view anew.
export function prepare(facts, choose, change) {
  run = facts;
  pick = (program) => {
    chosen = program;
    choose(program);
    change();
  };
  const toggle = el("input", { type: "checkbox", id: "only-not-normal" });
  toggle.addEventListener("change", () => {
    only = toggle.checked;
    change();
  });
  return [
    el("div", { id: "overview-bar", class: "overview-bar" },
      el("span", { id: "overview-understudies", class: "chips", role: "group", "aria-label": "Understudies" }),
      el("span", { id: "overview-words", role: "status" }),
      el("label", {}, toggle, " only what is not normal")),
    el("section", { id: "overview", class: "card", "aria-labelledby": "overview-title" },
      el("h2", { id: "overview-title" }, "Programs"),
      el("p", { class: "soft" }, `The signs of a program: ${PARTS.join(", ")}. A click shows its picture.`),
      el("div", { id: "overview-tiles", class: "tiles" }),
      el("p", { id: "overview-none", hidden: true }, "Every program is normal.")),
  ];
}

// What the address has of the overview.
export const selection = () => ({ program: String(chosen), only: only ? "1" : "" });

export function select({ program, only: wanted }) {
  only = wanted === "1";
  document.getElementById("only-not-normal").checked = only;
  if (run.programs[program]) {
    pick(Number(program));
  }
}

// The level of a part, its sign, and words where it is not normal.
function memberPart(member, name) {
  const look = STATES[member?.state] ?? { sign: "?", words: member?.state ?? "not known" };
  if (SOUND.has(member?.state)) {
    // A station has a note where it is cut off or excluded.
    const isOdd = name === "controller" && member.note;
    return isOdd ? { level: "degraded", sign: "⚠", words: `${name} ${member.note}` } : { level: "normal", sign: look.sign };
  }
  const level = CHANGING.has(member?.state) ? "changing" : name === "remote I/O" || member?.state === "state-lost" ? "bad" : "degraded";
  return { level, sign: look.sign, words: `${name} ${look.words}` };
}

// The remote I/O, and behind it a simulated plant, which has no sign of its own.
function fieldPart(members, { remote_io: remote, plant }) {
  const part = memberPart(members.get(remote), "remote I/O");
  return part.level === "normal" && members.has(plant) ? { ...memberPart(members.get(plant), "plant"), sign: part.sign } : part;
}

function outputsPart(program) {
  const { sign, words } = SOURCES[program.source] ?? SOURCES.unknown;
  if (program.fault) {
    return { level: "bad", sign, words: program.fault };
  }
  const forced = program.forced.length > 0 ? "forced" : null;
  if (program.source === "direct") {
    return forced ? { level: "degraded", sign: "F", words: forced } : { level: "normal", sign };
  }
  const level = program.source === "fail-safe" ? "bad" : program.source === "reconstructed" ? "changing" : "degraded";
  const from = program.word_of ? ` from ${program.word_of}` : "";
  return { level, sign, words: [`outputs ${words}${from}`, forced].filter(Boolean).join(", ") };
}

function protectionPart({ lost, protection }) {
  if (lost) {
    return { level: "bad", sign: "✗", words: "state lost" };
  }
  if (!protection) {
    return { level: "degraded", sign: "?", words: "protection not known" };
  }
  return protection.protected ? { level: "normal", sign: "●" } : { level: "degraded", sign: "⚠", words: "not protected" };
}

function partsOf(state) {
  const members = new Map(state.members.map((member) => [member.name, member]));
  const controllers = new Map(run.stations.filter((station) => station.role === "controller").map((station) => [station.program, station.name]));
  return state.programs.map((program) => [
    memberPart(members.get(controllers.get(program.index)), "controller"),
    fieldPart(members, run.programs[program.index]),
    outputsPart(program),
    protectionPart(program),
  ]);
}

// Shows the tiles, and answers the programs that the rest of the view lists.
export function show(state) {
  const parts = partsOf(state);
  const isNormal = (program) => parts[program.index].every((part) => part.level === "normal");
  const listed = state.programs.filter((program) => !only || !isNormal(program));
  const normal = state.programs.filter(isNormal).length;
  const all = state.programs.length;
  setAttribute(document.getElementById("overview-tiles"), "data-only", String(only));
  setText(document.getElementById("overview-words"), normal === all ? `all ${all} programs normal` : `${normal} of ${all} programs normal`);
  document.getElementById("overview-none").hidden = listed.length > 0;
  keyed(document.getElementById("overview-tiles"), listed, (program) => program.name, makeTile, (tile, program) => {
    const own = parts[program.index];
    own.forEach(({ level, sign }, index) => {
      const cell = tile.children[index + 1];
      setText(cell, sign);
      setAttribute(cell, "data-level", level);
    });
    const worstFirst = LEVELS.flatMap((level) => own.filter((part) => part.level === level));
    const worst = worstFirst[0].level;
    setAttribute(tile, "data-level", worst);
    setAttribute(tile, "aria-pressed", String(program.index === chosen));
    const words = worstFirst.map((part) => part.words).filter(Boolean).join("; ");
    setText(tile.lastChild, words);
    setAttribute(tile, "aria-label", `${program.name}: ${words || "normal"}`);
  });
  keyed(document.getElementById("overview-understudies"), state.members.filter((member) => member.kind === "understudy"), (member) => member.name,
    ({ name }) => el("button", { type: "button", class: "chip understudy", click: () => openMember({ kind: "station", name, program: null }) }, el("span"), el("span", { class: "understudy-state" })),
    (chip, member) => {
      const look = STATES[member.state] ?? { sign: "?", words: member.state };
      setAttribute(chip, "data-level", SOUND.has(member.state) ? "normal" : CHANGING.has(member.state) ? "changing" : "degraded");
      setText(chip.firstChild, `${look.sign} ${member.name}`);
      setText(chip.lastChild, `: ${look.words}${member.note ? `, ${member.note}` : ""}`);
    });
  return listed;
}

function makeTile(program) {
  const signs = PARTS.map((part) => el("span", { class: "tile-sign", "data-part": part, title: part }));
  return el("button", { type: "button", class: "tile", "data-program": program.name, click: () => pick(program.index) },
    el("span", { class: "tile-name" }, program.name), signs, el("span", { class: "tile-words" }));
}
