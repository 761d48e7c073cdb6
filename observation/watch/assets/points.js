// The points of each program by which the shown cycle is named: an online change may replace them. Nothing is shown by the points of another cycle.

import { act, ask } from "/ask.js";

// Versions of points that are remembered, at most.
const REMEMBERED = 32;

const known = new Map();
let asking = false;

const key = (index, version) => `${index} ${version}`;

function remember(facts) {
  if (known.size >= REMEMBERED) {
    known.delete(known.keys().next().value);
  }
  known.set(key(facts.index, facts.points), facts);
}

const others = (run, state) => state.programs.filter((program) => program.points !== run.programs[program.index].points);

export const fit = (run, state) => others(run, state).length === 0;

// Makes the facts of the run those of a state, from the server where they are not remembered; `then` is called when they are.
export async function follow(run, state, then) {
  if (asking) {
    return;
  }
  asking = true;
  run.programs.forEach((facts) => known.has(key(facts.index, facts.points)) || remember({ ...facts }));
  let isComplete = true;
  for (const { index, points } of others(run, state)) {
    const facts = known.get(key(index, points)) ?? (await act(() => ask(`api/points/${index}?cycle=${state.cycle}`)));
    isComplete &&= facts?.points === points;
    if (facts?.points === points) {
      remember(facts);
      Object.assign(run.programs[index], facts);
    }
  }
  asking = false;
  if (isComplete) {
    then();
  }
}
