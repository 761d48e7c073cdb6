//! Timers that are called under a condition, or more than once in an execution.
//!
//! A timer of compiled code keeps the moment of its start and looks at the clock when it is called: where it is not called, its
//! output stays, and the time goes on. A timer of a ladder counts scans and must see each of them. So such a timer becomes
//! a *clock*, a block that every scan passes, and bits that its calls write:
//!
//! ```text
//! IF a THEN … pause(IN := x, PT := T#3s); … END_IF;
//!
//! held := a;
//! IF held THEN … pause.started := x; END_IF;
//! pause.clock(IN := pause.started, PT := T#3s);
//! IF held THEN pause.Q := pause.clock.Q; … END_IF;
//! ```
//!
//! Invariants: a clock acts once in a scan, behind the assignment of `started` and before that of `Q`; where no call is executed, `started`
//! says what IN was at the last one. A pulse runs on whatever IN becomes, so the `started` of a TP stays until the pulse is over.
//!
//! On each path through the text there may be one call that lets the clock run. Before and behind it a TON may be stopped
//! (`IN := FALSE`) any number of times: it then has two clocks and changes to the other when it is stopped, which has been idle
//! for the whole of the scan before. With several values of PT there is a clock for each; what is over stays over.

use std::collections::{BTreeMap, BTreeSet, HashSet, VecDeque};
use std::ops::Range;
use std::time::Duration;

use understudy_ladder::BlockKind;
use understudy_text::Diagnostic;

use super::bounds::Interval;
use super::program::{Action, Cell, Kind, Resolved, Role, Step, Timer, Truth, walk};

/// The most different times of one timer.
const MAXIMUM_TIMES: usize = 16;

/// Puts clocks and assignments in the place of the calls of all timers; `intervals` grow with the cells.
pub(super) fn place(resolved: &mut Resolved, intervals: &mut Vec<Interval>) -> Vec<Diagnostic> {
    let timers = std::mem::take(&mut resolved.timers);
    if timers.is_empty() {
        return Vec::new();
    }
    let mut placing = Placing {
        plans: BTreeMap::new(),
        cells: std::mem::take(&mut resolved.cells),
        names: std::mem::take(&mut resolved.names),
        diagnostics: Vec::new(),
    };
    let steps = std::mem::take(&mut resolved.steps);
    let calls = placing.count(&steps, &timers);
    for (timer, calls) in calls {
        placing.plan(timer, &timers[timer], &calls);
    }
    for piece in placing.flat(steps) {
        placing.finish(piece, &mut resolved.steps);
    }
    resolved.cells = placing.cells;
    resolved.names = placing.names;
    intervals.resize(resolved.cells.len(), Interval::just(0));
    placing.diagnostics
}

/// The calls of one timer.
#[derive(Debug, Clone, Default)]
struct Calls {
    /// On one path at most: those that let the clock run.
    running: usize,
    /// On one path at most: all.
    all: usize,
    /// As calls give them.
    presets: BTreeSet<Duration>,
    /// A call without a time.
    untimed: bool,
    /// Of a call.
    span: Range<usize>,
}

/// By timer.
type Counted = BTreeMap<usize, Calls>;

/// A clock for one time: a block, or two of which one is idle.
#[derive(Debug, Clone)]
struct Clock {
    preset: Duration,
    /// Names of blocks, and the cells of their outputs.
    blocks: Vec<(String, usize)>,
}

/// How a timer is placed.
#[derive(Debug, Clone)]
struct Plan {
    word: &'static str,
    started: usize,
    output: usize,
    clocks: Vec<Clock>,
    /// The cell that says that the second block runs, where there are two.
    second: Option<usize>,
}

/// A part of a flat list: a step without clocks, or the turn of a timer's clocks.
enum Piece {
    Step(Step),
    Clocks(usize, Range<usize>),
}

struct Placing {
    plans: BTreeMap<usize, Plan>,
    cells: Vec<Cell>,
    names: HashSet<String>,
    diagnostics: Vec<Diagnostic>,
}

fn is_stop(word: &str, wire: &Truth) -> bool {
    word == "TON" && matches!(wire, Truth::Constant(false))
}

fn has_timers(steps: &[Step]) -> bool {
    let mut found = false;
    walk(steps, &mut |step| found |= matches!(step.action, Action::Timer { .. }));
    found
}

impl Placing {
    fn error(&mut self, code: &'static str, message: String, span: Range<usize>, help: &str) {
        let finding = Diagnostic::error(code, message, span);
        self.diagnostics.push(finding.with_help(help));
    }

    /// The calls of each timer, on the longest path, whatever conditions say.
    fn count(&mut self, steps: &[Step], timers: &[Timer]) -> Counted {
        let mut sum = Counted::new();
        for step in steps {
            let found = match &step.action {
                Action::Timer { timer, wire, preset } => {
                    let stops = is_stop(timers[*timer].word, wire);
                    let calls = Calls {
                        running: usize::from(!stops),
                        all: 1,
                        presets: preset.iter().copied().collect(),
                        untimed: preset.is_none() && !stops,
                        span: step.span.clone(),
                    };
                    Counted::from([(*timer, calls)])
                }
                Action::If(branches, otherwise) => {
                    let bodies = branches.iter().map(|(_, branch)| branch);
                    let mut longest = Counted::new();
                    for body in bodies.chain([otherwise]) {
                        for (timer, calls) in self.count(body, timers) {
                            let known = longest.entry(timer).or_default();
                            known.running = known.running.max(calls.running);
                            known.all = known.all.max(calls.all);
                            known.join(calls);
                        }
                    }
                    longest
                }
                Action::SetTruth(..) | Action::SetNumber(..) | Action::Block { .. } => continue,
            };
            for (timer, calls) in found {
                let known = sum.entry(timer).or_default();
                if known.running == 1 && calls.running > 0 {
                    let Timer { word, name, .. } = &timers[timer];
                    let message = format!(
                        "the {word} `{name}` may be called more than once in one execution"
                    );
                    let help = "call it in the branches of one IF or CASE, or once with the condition in its IN; a TON may also be called with IN := FALSE";
                    self.error("U1050", message, calls.span.clone(), help);
                }
                known.running += calls.running;
                known.all += calls.all;
                known.join(calls);
            }
        }
        sum
    }

    fn plan(&mut self, number: usize, timer: &Timer, calls: &Calls) {
        let Timer { name, word, .. } = timer;
        let times = calls.presets.len();
        if times > 1 && (*word == "TP" || calls.untimed || times > MAXIMUM_TIMES) {
            let message =
                format!("the time PT of the {word} `{name}` is not the same in every call");
            let help = format!(
                "a TON or a TOF may have up to {MAXIMUM_TIMES} times, if every call gives one; a TP has one"
            );
            self.error("U1045", message, calls.span.clone(), &help);
        }
        if times == 0 && calls.untimed {
            let message = format!("the {word} `{name}` is called without its time PT");
            self.error("U1049", message, calls.span.clone(), "such as PT := T#3s");
        }
        // Only where it is called again can a stop fall into the scan of another call.
        let is_double = calls.all > 1 && calls.running > 0;
        let second = is_double.then(|| self.bit(&format!("{name}.second"), Role::Memory));
        let mut clocks = Vec::new();
        // What is only stopped needs no clock.
        for &preset in calls.presets.iter().filter(|_| calls.running > 0) {
            let blocks = (0..if is_double { 2 } else { 1 }).map(|_| {
                let block = self.unique(&format!("{name}.clock"));
                let output = self.bit(&format!("{block}.Q"), Role::Pin);
                (block, output)
            });
            let blocks = blocks.collect();
            clocks.push(Clock { preset, blocks });
        }
        let plan = Plan { word, started: timer.started, output: timer.output, clocks, second };
        self.plans.insert(number, plan);
    }

    fn unique(&mut self, wanted: &str) -> String {
        let mut name = wanted.to_owned();
        let mut count = 1;
        while !self.names.insert(name.clone()) {
            count += 1;
            name = format!("{wanted}_{count}");
        }
        name
    }

    fn bit(&mut self, wanted: &str, role: Role) -> usize {
        let name = self.unique(wanted);
        self.cells.push(Cell {
            name,
            kind: Kind::Truth,
            role,
            initial: 0,
            is_seen: false,
            is_given: false,
            address: None,
            description: None,
        });
        self.cells.len() - 1
    }

    /// A list in which clocks stand outside of all choices.
    fn flat(&mut self, steps: Vec<Step>) -> Vec<Piece> {
        let mut pieces = Vec::new();
        for step in steps {
            match step.action {
                Action::Timer { timer, wire, preset } => {
                    self.call(timer, wire, preset, &step.span, step.comments, &mut pieces)
                }
                Action::If(branches, otherwise)
                    if has_timers(&otherwise)
                        || branches.iter().any(|(_, branch)| has_timers(branch)) =>
                {
                    let (conditions, bodies): (Vec<Truth>, Vec<Vec<Step>>) =
                        branches.into_iter().unzip();
                    let bodies = bodies.into_iter().chain([otherwise]);
                    let bodies = bodies.map(|body| self.flat(body).into()).collect();
                    self.choice(conditions, bodies, &step.span, step.comments, &mut pieces);
                }
                _ => pieces.push(Piece::Step(step)),
            }
        }
        pieces
    }

    /// A call: what it writes, with the turn of the clocks between where it lets them run.
    fn call(
        &mut self,
        timer: usize,
        wire: Truth,
        preset: Option<Duration>,
        span: &Range<usize>,
        comments: Vec<String>,
        pieces: &mut Vec<Piece>,
    ) {
        let Some(plan) = self.plans.get(&timer) else {
            return;
        };
        let (started, output) = (Truth::Cell(plan.started), Truth::Cell(plan.output));
        let mut comments = Some(comments);
        let mut set = |cell, value| {
            Piece::Step(Step {
                action: Action::SetTruth(cell, value),
                span: span.clone(),
                comments: comments.take().unwrap_or_default(),
            })
        };
        if is_stop(plan.word, &wire) && (plan.second.is_some() || plan.clocks.is_empty()) {
            if let Some(second) = plan.second {
                let other = Truth::Odd(vec![Truth::Cell(second), started]);
                pieces.push(set(second, other));
            }
            pieces.push(set(plan.started, Truth::Constant(false)));
            pieces.push(set(plan.output, Truth::Constant(false)));
            return;
        }
        let chosen = plan.clocks.iter().find(|clock| Some(clock.preset) == preset);
        let chosen = chosen.or(plan.clocks.first());
        let over = chosen.map_or(&[][..], |clock| &clock.blocks).iter();
        let over = Truth::Any(over.map(|(_, pin)| Truth::Cell(*pin)).collect());
        let value = match plan.word {
            _ if plan.clocks.len() <= 1 => over,
            // What was over stays over while its time changes.
            "TON" => Truth::Any(vec![over, Truth::All(vec![started, output])]),
            _ => Truth::All(vec![over, Truth::Any(vec![started, output])]),
        };
        pieces.push(set(plan.started, wire));
        pieces.push(Piece::Clocks(timer, span.clone()));
        pieces.push(set(plan.output, value));
    }

    /// A choice whose bodies (the last is that of ELSE) have clocks: it is made once, held, and asked again behind each turn of a clock.
    fn choice(
        &mut self,
        conditions: Vec<Truth>,
        mut bodies: Vec<VecDeque<Piece>>,
        span: &Range<usize>,
        comments: Vec<String>,
        pieces: &mut Vec<Piece>,
    ) {
        let mut comments = Some(comments);
        let mut step = |action| {
            Piece::Step(Step {
                action,
                span: span.clone(),
                comments: comments.take().unwrap_or_default(),
            })
        };
        let mut waiting: BTreeMap<usize, usize> = BTreeMap::new();
        for piece in bodies.iter().flatten() {
            if let Piece::Clocks(timer, _) = piece {
                *waiting.entry(*timer).or_default() += 1;
            }
        }
        let mut held = conditions;
        if !waiting.is_empty() {
            let mut before: Vec<Truth> = Vec::new();
            for condition in &mut held {
                let cell = self.bit("held", Role::Passing);
                let mut parts = vec![condition.clone()];
                parts.extend(before.iter().cloned().map(|held| Truth::Not(Box::new(held))));
                pieces.push(step(Action::SetTruth(cell, Truth::All(parts))));
                *condition = Truth::Cell(cell);
                before.push(Truth::Cell(cell));
            }
        }
        loop {
            let mut segments = Vec::new();
            for body in &mut bodies {
                let mut segment = Vec::new();
                while let Some(Piece::Step(_)) = body.front() {
                    if let Some(Piece::Step(step)) = body.pop_front() {
                        segment.push(step);
                    }
                }
                segments.push(segment);
            }
            if segments.iter().any(|segment| !segment.is_empty()) {
                let otherwise = segments.pop().unwrap_or_default();
                let branches = held.iter().cloned().zip(segments).collect();
                pieces.push(step(Action::If(branches, otherwise)));
            }
            // Now every body begins with a clock, or is done.
            let mut fronts: BTreeMap<usize, (usize, Range<usize>)> = BTreeMap::new();
            for body in &bodies {
                if let Some(Piece::Clocks(timer, span)) = body.front() {
                    fronts.entry(*timer).or_insert((0, span.clone())).0 += 1;
                }
            }
            let Some((_, (_, place))) = fronts.first_key_value() else {
                return;
            };
            let place = place.clone();
            let next =
                fronts.into_iter().find(|(timer, (count, _))| waiting.get(timer) == Some(count));
            let Some((next, (_, span))) = next else {
                let message =
                    "the timers of these branches are called in different orders".to_owned();
                self.error("U1050", message, place, "call them in the same order in every branch");
                return;
            };
            for body in &mut bodies {
                if matches!(body.front(), Some(Piece::Clocks(timer, _)) if *timer == next) {
                    body.pop_front();
                }
            }
            pieces.push(Piece::Clocks(next, span));
        }
    }

    /// The steps of a piece on the outermost list.
    fn finish(&mut self, piece: Piece, steps: &mut Vec<Step>) {
        let (timer, span) = match piece {
            Piece::Step(step) => {
                steps.push(step);
                return;
            }
            Piece::Clocks(timer, span) => (timer, span),
        };
        let Some(plan) = self.plans.get(&timer) else {
            return;
        };
        let mut push = |action| {
            steps.push(Step { action, span: span.clone(), comments: Vec::new() });
        };
        let started = || Truth::Cell(plan.started);
        for clock in &plan.clocks {
            let kind = match plan.word {
                "TON" => BlockKind::Ton(clock.preset),
                "TOF" => BlockKind::Tof(clock.preset),
                _ => BlockKind::Tp(clock.preset),
            };
            for (place, (name, _)) in clock.blocks.iter().enumerate() {
                let wire = match plan.second.map(Truth::Cell) {
                    None => started(),
                    Some(second) if place == 0 => {
                        Truth::All(vec![started(), Truth::Not(Box::new(second))])
                    }
                    Some(second) => Truth::All(vec![started(), second]),
                };
                push(Action::Block { name: name.clone(), kind, wire, feeds: Vec::new() });
            }
            if let ("TP", [(_, pin)]) = (plan.word, clock.blocks.as_slice()) {
                let runs = Truth::Any(vec![started(), Truth::Cell(*pin)]);
                push(Action::SetTruth(plan.started, runs));
            }
        }
    }
}

impl Calls {
    fn join(&mut self, other: Self) {
        self.presets.extend(other.presets);
        self.untimed |= other.untimed;
        self.span = other.span;
    }
}
