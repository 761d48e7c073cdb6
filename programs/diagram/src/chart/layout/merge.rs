//! Where the branches of a divergence end.

use std::collections::{HashMap, HashSet};

use super::{BEYOND, Band, COLUMN, End, GAP, Goal, Layout, Open, Part, joined};
use crate::Place;

impl Layout<'_> {
    /// Whether other branches of the divergence lead to a step too.
    pub(super) fn is_awaited(&mut self, step: usize) -> bool {
        let Some(around) = self.around.last_mut() else {
            return false;
        };
        let mut seen = HashSet::new();
        let mut waiting = around.later.clone();
        let mut is_awaited = around.awaited.contains(&step);
        while let Some(next) = waiting.pop() {
            is_awaited |= next == step;
            if !self.placed.contains(&next) && seen.insert(next) {
                let behind = self.leaving[next].iter();
                waiting.extend(behind.flat_map(|at| &self.chart.transitions[*at].to));
            }
        }
        if is_awaited {
            around.awaited.insert(step);
        }
        is_awaited
    }

    /// Ends branches: in steps of their own, in jumps, in convergences. What is left waits for branches elsewhere.
    pub(super) fn merge(&mut self, mut bands: Vec<Band>) -> Band {
        loop {
            if self.end_alone(&mut bands) {
                continue;
            }
            let Some(goal) = self.common(&bands) else {
                break;
            };
            let band = self.converge(&mut bands, goal);
            bands.push(band);
        }
        let all = bands.into_iter().reduce(joined);
        all.unwrap_or_else(|| Band::at(0, 0))
    }

    /// Ends one branch in a jump, or goes on with it where it alone comes to a step; whether there was one.
    fn end_alone(&mut self, bands: &mut [Band]) -> bool {
        let counts = counts(bands);
        let right = bands.iter().map(|band| band.right).max().unwrap_or(0);
        let bottom = bands.iter().map(|band| band.bottom).max().unwrap_or(0);
        // Where branches come together in several steps, one of these is behind a convergence, and the others are entered once.
        let mut ends = bands.iter().flat_map(|band| &band.ends);
        let is_common = |goal: &Goal| match goal {
            Goal::Step(step) => counts[goal] > 1 && !self.placed.contains(step),
            Goal::Join(_) => false,
        };
        let common = ends.find(|end| is_common(&end.goal)).map(|end| end.goal);
        for band in bands.iter_mut() {
            for at in 0..band.ends.len() {
                let End { open, goal } = band.ends[at];
                let Goal::Step(step) = goal else { continue };
                if Some(goal) == common {
                    continue;
                }
                band.ends.remove(at);
                // A column that others are next to cannot become wider: the step has one of its own, elsewhere.
                let is_straight = band.ends.is_empty()
                    && band.right == right
                    && self.axis(band.left) == open.at.x;
                if self.placed.contains(&step) || !is_straight {
                    self.jump(open, step, band, bottom + GAP);
                    return true;
                }
                let (left, y) = (band.left, band.bottom + GAP);
                let behind = self.run(Some(open), step, left, y);
                *band = joined(band.clone(), behind);
                return true;
            }
        }
        false
    }

    /// What all that lead to it have come to.
    fn common(&self, bands: &[Band]) -> Option<Goal> {
        let counts = counts(bands);
        let ends = bands.iter().flat_map(|band| &band.ends);
        let mut goals = ends.map(|end| end.goal);
        goals.find(|goal| match goal {
            Goal::Step(_) => counts[goal] > 1,
            Goal::Join(transition) => {
                counts[goal] == self.chart.transitions[*transition].from.len()
            }
        })
    }

    /// A convergence of all that lead to a goal, and what is behind it.
    fn converge(&mut self, bands: &mut [Band], goal: Goal) -> Band {
        let mut opens: Vec<Open> = Vec::new();
        for band in bands.iter_mut() {
            band.ends.retain(|end| {
                if end.goal == goal {
                    opens.push(end.open);
                }
                end.goal != goal
            });
        }
        opens.sort_by_key(|open| open.at.x);
        let waits = bands.iter().any(|band| !band.ends.is_empty());
        let right = bands.iter().map(|band| band.right).max().unwrap_or(0);
        let bottom = bands.iter().map(|band| band.bottom).max().unwrap_or(0);
        let (first, last) = (opens[0].at.x, opens[opens.len() - 1].at.x);
        let (part, height) = match goal {
            Goal::Step(_) => (Part::SelectionConvergence, 2),
            Goal::Join(_) => (Part::SimultaneousConvergence, 6),
        };
        let place =
            Place { x: first - BEYOND, y: bottom + GAP, width: last - first + 2 * BEYOND, height };
        let object = self.add(part, place, &opens, 1);
        // What waits leads down next to what comes now.
        let left = match waits {
            true => right + COLUMN,
            false => first - self.step / 2,
        };
        let mut below = self.below(object);
        below.at.x = if waits { last } else { first };
        let y = place.bottom() + GAP;
        let mut band = Band::at(left, place.bottom());
        let next = match goal {
            Goal::Step(step) => Some((below, step)),
            Goal::Join(transition) => self.transition(&[below], transition, &mut band, y),
        };
        match next {
            Some((open, step)) => {
                let y = match goal {
                    Goal::Step(_) => y,
                    Goal::Join(_) => band.bottom + GAP,
                };
                joined(band, self.run(Some(open), step, left, y))
            }
            None => band,
        }
    }
}

/// How many lines lead to each goal.
fn counts(bands: &[Band]) -> HashMap<Goal, usize> {
    let mut counts = HashMap::new();
    for end in bands.iter().flat_map(|band| &band.ends) {
        *counts.entry(end.goal).or_default() += 1;
    }
    counts
}
