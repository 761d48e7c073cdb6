//! Places of the parts of a chart: a column for each branch, from top to bottom.
//!
//! A branch that comes to a step which another branch of the same divergence comes to as well ends in a convergence above it; one that
//! comes to a step that has its place ends in a jump.

mod merge;

use std::collections::HashSet;

use super::Chart;
use crate::{CHARACTER, Place, Point, width};

/// Height of a step.
const STEP: i64 = 30;
/// Between two parts of a column.
const GAP: i64 = 22;
/// Between two columns.
const COLUMN: i64 = 36;
/// The left and upper edge of all.
const MARGIN: i64 = 20;
/// Between a step and its actions, and between a transition and its condition.
const ASIDE: i64 = 16;
/// Height of an action.
const ACTION: i64 = 22;
/// Width of a transition.
const BAR: i64 = 20;
/// How far the bar of a divergence or convergence reaches beyond its branches.
const BEYOND: i64 = 10;

/// What a part of the drawing is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// A step.
    Step(usize),
    /// The actions of a step.
    Actions(usize),
    /// A transition; its condition is to the right.
    Transition(usize),
    /// A jump to a step.
    Jump(usize),
    /// One of its branches is taken.
    SelectionDivergence,
    /// The end of such branches.
    SelectionConvergence,
    /// All of its branches are taken.
    SimultaneousDivergence,
    /// The end of such branches.
    SimultaneousConvergence,
}

/// A part of the drawing.
#[derive(Debug, Clone)]
pub struct ChartObject {
    /// What it is.
    pub part: Part,
    /// Its outline.
    pub place: Place,
    /// What leads into it, by input.
    pub inputs: Vec<Link>,
    /// How many lines lead out of it.
    pub outputs: usize,
}

/// A line into a part.
#[derive(Debug, Clone)]
pub struct Link {
    /// The object that it comes from.
    pub from: usize,
    /// Which of the lines out of that object.
    pub output: usize,
    /// Corners of the line, from its begin to its end.
    pub points: Vec<Point>,
}

/// Where the parts of a chart are.
#[derive(Debug, Clone, Default)]
pub struct ChartPlan {
    /// In the order in which they were placed.
    pub objects: Vec<ChartObject>,
    /// The right edge.
    pub right: i64,
    /// The lower edge.
    pub bottom: i64,
}

/// Places a chart below `top`. Divergences within divergences are followed by recursion: the caller bounds the number of steps.
pub fn lay_out(chart: &Chart, top: i64) -> ChartPlan {
    let mut layout = Layout::new(chart);
    let mut left = MARGIN;
    let mut waiting = Band::at(MARGIN, top);
    let initial = (0..chart.steps.len()).filter(|step| chart.steps[*step].is_initial);
    let roots: Vec<usize> = initial.chain(0..chart.steps.len()).collect();
    for step in roots {
        if !layout.placed.contains(&step) {
            let band = layout.run(None, step, left, top);
            let band = layout.merge(vec![band]);
            left = band.right + COLUMN;
            waiting.right = waiting.right.max(band.right);
            waiting.bottom = waiting.bottom.max(band.bottom);
            waiting.ends.extend(band.ends);
        }
    }
    let last = layout.merge(vec![waiting]);
    ChartPlan { objects: layout.objects, right: last.right, bottom: last.bottom }
}

/// A line that leads down from a part and does not end yet.
#[derive(Debug, Clone, Copy)]
struct Open {
    object: usize,
    output: usize,
    at: Point,
}

/// What a line leads to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Goal {
    Step(usize),
    /// A transition that leaves several steps.
    Join(usize),
}

#[derive(Debug, Clone, Copy)]
struct End {
    open: Open,
    goal: Goal,
}

/// A part of the drawing with all that is in its columns.
#[derive(Debug, Clone)]
struct Band {
    left: i64,
    right: i64,
    bottom: i64,
    ends: Vec<End>,
}

impl Band {
    fn at(left: i64, bottom: i64) -> Self {
        Self { left, right: left, bottom, ends: Vec::new() }
    }
}

/// A divergence whose branches are being placed.
#[derive(Debug, Default)]
struct Around {
    /// The first steps of the branches that have no place yet.
    later: Vec<usize>,
    /// Steps that branches wait for.
    awaited: HashSet<usize>,
}

struct Layout<'c> {
    chart: &'c Chart,
    objects: Vec<ChartObject>,
    /// Steps that have a place.
    placed: HashSet<usize>,
    /// The divergences around the branch that is being placed, the innermost last.
    around: Vec<Around>,
    /// The transitions that leave each step.
    leaving: Vec<Vec<usize>>,
    /// How many transitions enter each step.
    entering: Vec<usize>,
    /// Width of all steps.
    step: i64,
}

impl<'c> Layout<'c> {
    fn new(chart: &'c Chart) -> Self {
        let count = chart.steps.len();
        let (mut leaving, mut entering) = (vec![Vec::new(); count], vec![0; count]);
        for (place, transition) in chart.transitions.iter().enumerate() {
            for &step in &transition.from {
                leaving[step].push(place);
            }
            for &step in &transition.to {
                entering[step] += 1;
            }
        }
        let names = chart.steps.iter().map(|step| width(&step.name)).max();
        Self {
            chart,
            objects: Vec::new(),
            placed: HashSet::new(),
            around: Vec::new(),
            leaving,
            entering,
            step: (names.unwrap_or(0) + 3 * CHARACTER).max(64) / 2 * 2,
        }
    }

    fn axis(&self, left: i64) -> i64 {
        left + self.step / 2
    }

    fn add(&mut self, part: Part, place: Place, from: &[Open], outputs: usize) -> usize {
        let links = from.iter().map(|open| {
            let x = match part {
                // A bar is as wide as its branches.
                Part::SelectionConvergence | Part::SimultaneousConvergence => open.at.x,
                _ => place.middle(),
            };
            let end = Point { x, y: place.y };
            let mut points = vec![open.at];
            if open.at.x != x {
                let y = place.y - GAP / 2;
                points.push(Point { x: open.at.x, y });
                points.push(Point { x, y });
            }
            points.push(end);
            Link { from: open.object, output: open.output, points }
        });
        let inputs = links.collect();
        self.objects.push(ChartObject { part, place, inputs, outputs });
        self.objects.len() - 1
    }

    fn below(&self, object: usize) -> Open {
        let place = self.objects[object].place;
        Open { object, output: 0, at: Point { x: place.middle(), y: place.bottom() } }
    }

    /// Places a step and what is behind it, as far as it leads on.
    fn run(&mut self, mut open: Option<Open>, mut step: usize, left: i64, mut y: i64) -> Band {
        let mut band = Band::at(left, y);
        loop {
            let object = self.step(open, step, &mut band, y);
            let leaving = self.leaving[step].clone();
            let below = self.below(object);
            y = band.bottom + GAP;
            let next = match leaving.as_slice() {
                [] => return band,
                [only] => self.leave(below, *only, &mut band, y),
                _ => {
                    let branch = |layout: &mut Self, open, left, y, at: usize| {
                        let mut band = Band::at(left, y);
                        match layout.leave(open, leaving[at], &mut band, y) {
                            Some((open, step)) => {
                                let y = band.bottom + GAP;
                                joined(band, layout.run(Some(open), step, left, y))
                            }
                            None => band,
                        }
                    };
                    let part = Part::SelectionDivergence;
                    let to = |at: &usize| self.chart.transitions[*at].to.clone();
                    let firsts = leaving.iter().map(to).collect();
                    let inner = self.diverge(part, below, (left, y), firsts, branch);
                    return joined(band, self.merge(inner));
                }
            };
            let Some((from, next)) = next else {
                return band;
            };
            (open, step) = (Some(from), next);
            y = band.bottom + GAP;
        }
    }

    /// A step with its actions.
    fn step(&mut self, open: Option<Open>, step: usize, band: &mut Band, y: i64) -> usize {
        self.placed.insert(step);
        let place = Place { x: band.left, y, width: self.step, height: STEP };
        let open: Vec<Open> = open.into_iter().collect();
        let object = self.add(Part::Step(step), place, &open, 1);
        band.right = band.right.max(place.right());
        band.bottom = place.bottom();
        let actions = &self.chart.steps[step].actions;
        let widest = actions.iter().map(|(when, what)| {
            let when = width(when).max(3 * CHARACTER);
            when + width(what) + 4 * CHARACTER
        });
        if let Some(width) = widest.max() {
            let aside = Place {
                x: place.right() + ASIDE,
                y: y + (STEP - ACTION) / 2,
                width,
                height: ACTION * i64::try_from(actions.len()).unwrap_or(1),
            };
            let at = Point { x: place.right(), y: y + STEP / 2 };
            let end = Point { x: aside.x, y: at.y };
            self.objects.push(ChartObject {
                part: Part::Actions(step),
                place: aside,
                inputs: vec![Link { from: object, output: 1, points: vec![at, end] }],
                outputs: 0,
            });
            band.right = band.right.max(aside.right());
            band.bottom = band.bottom.max(aside.bottom());
        }
        object
    }

    /// Places a transition that leaves a step; one that leaves several waits for the others. The step that is next in this column.
    fn leave(
        &mut self,
        open: Open,
        transition: usize,
        band: &mut Band,
        y: i64,
    ) -> Option<(Open, usize)> {
        if self.chart.transitions[transition].from.len() > 1 {
            let goal = Goal::Join(transition);
            band.ends.push(End { open, goal });
            band.right = band.right.max(band.left + self.step);
            return None;
        }
        self.transition(&[open], transition, band, y)
    }

    fn transition(
        &mut self,
        from: &[Open],
        transition: usize,
        band: &mut Band,
        y: i64,
    ) -> Option<(Open, usize)> {
        let axis = self.axis(band.left);
        let place = Place { x: axis - BAR / 2, y, width: BAR, height: 4 };
        let object = self.add(Part::Transition(transition), place, from, 1);
        let shown = &self.chart.transitions[transition];
        let label = place.right() + ASIDE + width(&shown.condition);
        band.right = band.right.max(label).max(band.left + self.step);
        band.bottom = place.bottom();
        let below = self.below(object);
        let y = band.bottom + GAP;
        match shown.to.as_slice() {
            [] => None,
            [only] => self.enter(below, *only, band, y),
            several => {
                let several = several.to_vec();
                let branch = |layout: &mut Self, open, left, y, at: usize| {
                    let mut band = Band::at(left, y);
                    match layout.enter(open, several[at], &mut band, y) {
                        Some((open, step)) => joined(band, layout.run(Some(open), step, left, y)),
                        None => band,
                    }
                };
                let part = Part::SimultaneousDivergence;
                let firsts = several.iter().map(|step| vec![*step]).collect();
                let inner = self.diverge(part, below, (band.left, y), firsts, branch);
                let inner = self.merge(inner);
                *band = joined(band.clone(), inner);
                None
            }
        }
    }

    /// The step, where it is to be placed in this column; a jump to one that has its place.
    fn enter(&mut self, open: Open, step: usize, band: &mut Band, y: i64) -> Option<(Open, usize)> {
        if self.placed.contains(&step) {
            self.jump(open, step, band, y);
            return None;
        }
        if self.entering[step] > 1 && self.is_awaited(step) {
            let goal = Goal::Step(step);
            band.ends.push(End { open, goal });
            band.right = band.right.max(band.left + self.step);
            return None;
        }
        Some((open, step))
    }

    fn jump(&mut self, open: Open, step: usize, band: &mut Band, y: i64) {
        let width = width(&self.chart.steps[step].name) + 2 * CHARACTER;
        let place = Place { x: open.at.x - width / 2, y, width, height: 20 };
        self.add(Part::Jump(step), place, &[open], 0);
        band.right = band.right.max(place.right());
        band.bottom = band.bottom.max(place.bottom());
    }

    /// The bar of a divergence, and its branches next to each other.
    fn diverge(
        &mut self,
        part: Part,
        from: Open,
        (left, y): (i64, i64),
        firsts: Vec<Vec<usize>>,
        branch: impl Fn(&mut Self, Open, i64, i64, usize) -> Band,
    ) -> Vec<Band> {
        let count = firsts.len();
        let height = if part == Part::SelectionDivergence { 2 } else { 6 };
        let place = Place { x: self.axis(left) - BEYOND, y, width: 2 * BEYOND, height };
        let object = self.add(part, place, &[from], count);
        let bar = &mut self.objects[object];
        // It is entered at its left end, where the column is.
        for link in &mut bar.inputs {
            link.points = vec![from.at, Point { x: from.at.x, y }];
        }
        let mut bands = Vec::with_capacity(count);
        let mut left = left;
        self.around.push(Around::default());
        for output in 0..count {
            if let Some(around) = self.around.last_mut() {
                around.later = firsts[output + 1..].concat();
            }
            let at = Point { x: self.axis(left), y: place.bottom() };
            let open = Open { object, output, at };
            let band = branch(self, open, left, place.bottom() + GAP, output);
            self.objects[object].place.width = at.x + BEYOND - place.x;
            left = band.right + COLUMN;
            bands.push(band);
        }
        self.around.pop();
        bands
    }
}

/// What is behind a band belongs to it.
fn joined(before: Band, behind: Band) -> Band {
    let mut ends = before.ends;
    ends.extend(behind.ends);
    Band {
        left: before.left.min(behind.left),
        right: before.right.max(behind.right),
        bottom: before.bottom.max(behind.bottom),
        ends,
    }
}
