//! Properties of a program by several methods, the cheap ones first:
//!
//! ```text
//! very few states of each part   timers that begin each other: few of many states, and large diagrams;
//!                                more while each scan finds no more of them than the one before
//! few states listed one by one   only here where the diagrams of single functions are large, otherwise below
//! diagrams of few nodes          most properties of most ladders, with runs that show why
//! runs of a few scans            invariants of large programs that break soon
//! induction over few scans       invariants, however large the program is
//! few states listed one by one   programs in steps: few of many states can be reached
//! diagrams of more nodes, more states, diagrams of as many nodes as allowed
//! induction over many scans
//! ```
//!
//! A method sees what those before it left undecided.

use std::fmt;
use std::ops::RangeInclusive;

use understudy_logic::bdd::BddError;

use super::part::Part;
use super::{Answer, Bounds, Subject};
use crate::effort::{Stopped, Work};
use crate::explicit::{Explicit, ExplicitError, Extent, MAXIMUM_INPUTS};
use crate::induction::{Depth, Induction, invariant, prove_always, search};
use crate::symbolic::{Checker, Cone, Resolved, Verdict, has_small_functions, rows};

/// Nodes of the first and the second try.
const NODES: [usize; 2] = [1 << 17, 1 << 20];
/// Parts of a program that may be too large before diagrams of that many nodes are given up.
const REFUSED: u32 = 3;
/// Parts whose states are listed first: their registers, their inputs, and the share of the states that count as few. Of fewer registers diagrams are small.
const REGISTERS: RangeInclusive<usize> = 16..=64;
const INPUTS: usize = 4;
const SHARE: usize = 64;
/// The share that is listed while each scan finds as many states as the one before.
const STEADY: usize = 5;
/// The search of short runs: registers from which on a property needs it, the scans of its runs, operations of all scans together, and steps for all properties.
const LARGE: usize = 30;
const SOON: u32 = 40;
const OPERATIONS: usize = 2_000_000;
const SOON_STEPS: u64 = 50_000;
/// The first induction: its scans, and the steps of each search.
const FEW_SCANS: u32 = 2;
const FEW_STEPS: u64 = 200_000;

/// Why a property was not decided, and what was proved of it all the same.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Undecided {
    /// What was in the way of decision diagrams; nothing where no run keeps the assumptions and fairness conditions.
    pub why: Option<Stopped>,
    /// No run of up to this number of scans violates it.
    pub unbroken: Option<u32>,
    /// None of this number of states nearest to the start violates it.
    pub listed: Option<usize>,
}

impl fmt::Display for Undecided {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.why {
            Some(why) => write!(formatter, "{why}")?,
            None => write!(formatter, "no run keeps the assumptions and the fairness conditions")?,
        }
        match self.unbroken {
            Some(1) => write!(formatter, "; the first scan does not break it")?,
            Some(scans) => write!(formatter, "; no run of up to {scans} scans breaks it")?,
            None => {}
        }
        if let Some(states) = self.listed {
            write!(formatter, "; none of the {states} states nearest to the start breaks it")?;
        }
        Ok(())
    }
}

/// Properties on their way to an answer.
pub(super) struct Stages<'s, 'b> {
    pub(super) subject: &'s Subject,
    pub(super) properties: &'s [Resolved],
    pub(super) fair: Vec<Resolved>,
    pub(super) bounds: Bounds<'b>,
    pub(super) answered: &'s mut dyn FnMut(usize, &Answer),
    answers: Vec<Option<Answer>>,
    so_far: Vec<Undecided>,
    over: bool,
}

impl<'s, 'b> Stages<'s, 'b> {
    pub(super) fn new(
        subject: &'s Subject,
        properties: &'s [Resolved],
        fair: Vec<Resolved>,
        bounds: Bounds<'b>,
        answered: &'s mut dyn FnMut(usize, &Answer),
    ) -> Self {
        let nothing = Undecided {
            why: Some(Stopped::Diagrams(BddError::TooManyNodes { limit: bounds.nodes })),
            unbroken: None,
            listed: None,
        };
        Self {
            subject,
            properties,
            fair,
            bounds,
            answered,
            answers: vec![None; properties.len()],
            so_far: vec![nothing; properties.len()],
            over: false,
        }
    }

    pub(super) fn run(mut self) -> Vec<Answer> {
        let [few, more] = NODES;
        let all = self.bounds.nodes;
        let few_states = Explicit::few(self.subject.reduced()).min(self.bounds.states);
        self.list_parts();
        let is_listed_first = self.has_large_functions();
        let mut listed = if is_listed_first { self.list(few_states) } else { None };
        self.diagrams(few.min(all));
        self.search();
        self.induction(FEW_SCANS.min(self.bounds.scans), FEW_STEPS);
        if !is_listed_first {
            listed = self.list(few_states);
        }
        if all > few {
            self.diagrams(more.min(all));
        }
        if matches!(listed, Some(ExplicitError::States { .. })) && self.bounds.states > few_states {
            self.list(self.bounds.states);
        }
        if all > more {
            self.diagrams(all);
        }
        self.induction(self.bounds.scans, u64::MAX);
        self.leave();
        self.answers.into_iter().flatten().collect()
    }

    fn left(&self) -> Vec<usize> {
        let places = self.answers.iter().enumerate();
        let open = places.filter(|(_, answer)| answer.is_none() && !self.over);
        open.map(|(place, _)| place).collect()
    }

    fn answer(&mut self, place: usize, answer: Answer) {
        (self.answered)(place, &answer);
        self.answers[place] = Some(answer);
    }

    /// Whether it can be listed, and is known to be too much for small diagrams.
    fn has_large_functions(&self) -> bool {
        let (circuit, left) = (self.subject.reduced(), self.left());
        let can_be_listed = self.fair.is_empty() && circuit.inputs().len() <= MAXIMUM_INPUTS;
        let asked = left.iter().map(|&place| &self.properties[place]);
        can_be_listed && !left.is_empty() && !has_small_functions(circuit, asked, self.bounds.go_on)
    }

    /// With few nodes the order of variables changes early, and not at the bound.
    fn diagrams(&mut self, nodes: usize) {
        let circuit = self.subject.reduced();
        let go_on = self.bounds.go_on;
        let mut checker = Checker::new(circuit, self.fair.clone(), nodes).while_wanted(go_on);
        if nodes <= NODES[0] {
            checker = checker.reordered_early();
        }
        let mut failures = 0;
        for place in self.left() {
            match checker.check(&self.properties[place]) {
                Ok(Verdict::Holds(trace)) => self.answer(place, Answer::Holds(trace)),
                Ok(Verdict::Fails(trace)) => self.answer(place, Answer::Fails(trace)),
                Err(Stopped::Time) => {
                    self.so_far[place].why = Some(Stopped::Time);
                    self.over = true;
                    return;
                }
                Err(stopped) => {
                    self.so_far[place].why = Some(stopped);
                    failures += 1;
                    if failures >= REFUSED && nodes < self.bounds.nodes {
                        return;
                    }
                }
            }
        }
    }

    /// Each property by a list of the states of what it depends on: few of them, or more while a scan more finds no more of them.
    fn list_parts(&mut self) {
        if !self.fair.is_empty() {
            return;
        }
        let whole = self.subject.reduced();
        let mut larger = 0;
        for (cone, places) in self.cones() {
            let registers = cone.registers().count();
            let inputs = cone.variables.len() - registers;
            let is_listed = REGISTERS.contains(&registers) && inputs <= INPUTS;
            if !is_listed || larger >= REFUSED {
                continue;
            }
            let part = Part::of(whole, &cone);
            let few = Explicit::few(&part.circuit).min(self.bounds.states);
            let extent = Extent::of(few / SHARE).while_steady(few / STEADY);
            let go_on = self.bounds.go_on;
            let (listed, error) = Explicit::explore(&part.circuit, extent, go_on, &mut |_| {});
            match error {
                None => {}
                Some(ExplicitError::Time { .. }) => {
                    self.over = true;
                    return;
                }
                Some(_) => {
                    larger += 1;
                    continue;
                }
            }
            let asked = places.iter().map(|&place| part.property(&self.properties[place]));
            let answers = listed.check(&asked.collect::<Vec<_>>());
            for (place, (holds, run)) in places.into_iter().zip(answers) {
                let cone = Cone::of(whole, [&self.properties[place]]);
                let trace = run.map(|run| rows(whole, &cone, part.run_of_whole(run)));
                let answer = if holds { Answer::Holds(trace) } else { Answer::Fails(trace) };
                self.answer(place, answer);
            }
        }
    }

    /// The properties that are left, together where they depend on the same registers and inputs.
    fn cones(&self) -> Vec<(Cone, Vec<usize>)> {
        let mut cones: Vec<(Cone, Vec<usize>)> = Vec::new();
        for place in self.left() {
            let cone = Cone::of(self.subject.reduced(), [&self.properties[place]]);
            match cones.iter_mut().find(|(known, _)| known.variables == cone.variables) {
                Some((known, places)) => {
                    known.signals.extend(cone.signals);
                    places.push(place);
                }
                None => cones.push((cone, vec![place])),
            }
        }
        cones
    }

    /// Invariants that break within a few scans: large diagrams and lists take long to find what a run of few scans shows.
    fn search(&mut self) {
        if !self.fair.is_empty() {
            return;
        }
        let circuit = self.subject.reduced();
        let left = self.left();
        let steps = SOON_STEPS / left.len().max(1) as u64;
        for place in left {
            let Some(kept) = invariant(&self.properties[place]) else {
                continue;
            };
            let cone = Cone::of(circuit, [kept]);
            let registers = cone.registers().map(|place| &circuit.registers()[place as usize]);
            let registers: Vec<_> = registers.collect();
            if registers.len() < LARGE {
                continue;
            }
            let next: Vec<_> = registers.iter().map(|register| register.next).collect();
            let operations = circuit.graph().reached(&next).into_iter().filter(|is| *is).count();
            let scans = (OPERATIONS / operations.max(1)).min(SOON as usize) as u32;
            let depth = Depth { scans, steps, go_on: self.bounds.go_on };
            match search(circuit, kept, depth) {
                Some(Induction::Fails(trace)) => self.answer(place, Answer::Fails(Some(trace))),
                Some(Induction::Undecided(scans)) if scans > 0 => {
                    self.so_far[place].unbroken = Some(scans);
                }
                _ => {}
            }
            if !(depth.go_on)(Work::Scans(0)) {
                self.so_far[place].why = Some(Stopped::Time);
                self.over = true;
                return;
            }
        }
    }

    /// Invariants. Induction knows no fairness: what it proves of all runs holds of the fair ones, and its counterexample may be unfair.
    fn induction(&mut self, scans: u32, steps: u64) {
        let depth = Depth { scans, steps, go_on: self.bounds.go_on };
        for place in self.left() {
            let Some(kept) = invariant(&self.properties[place]) else {
                continue;
            };
            match prove_always(self.subject.reduced(), kept, depth) {
                Some(Induction::Holds(_)) => self.answer(place, Answer::Holds(None)),
                Some(Induction::Fails(trace)) if self.fair.is_empty() => {
                    self.answer(place, Answer::Fails(Some(trace)));
                }
                Some(Induction::Undecided(scans)) if scans > 0 => {
                    let known = &mut self.so_far[place].unbroken;
                    *known = Some(known.unwrap_or(0).max(scans));
                }
                _ => {}
            }
            if !(depth.go_on)(Work::Scans(0)) {
                self.so_far[place].why = Some(Stopped::Time);
                self.over = true;
                return;
            }
        }
    }

    /// All properties by one list of states, which is kept for the next questions.
    fn list(&mut self, bound: usize) -> Option<ExplicitError> {
        let left = self.left();
        if left.is_empty() || !self.fair.is_empty() {
            return None;
        }
        let circuit = self.subject.reduced();
        if self.subject.listed.get().is_none() {
            let extent = Extent::of(bound);
            let (listed, error) =
                Explicit::explore(circuit, extent, self.bounds.go_on, &mut |_| {});
            if let Some(error) = error {
                self.broken_nearby(&listed, &left);
                if matches!(error, ExplicitError::Time { .. }) {
                    self.over = true;
                }
                return Some(error);
            }
            // Nobody else can have made it meanwhile.
            let _ = self.subject.listed.set(listed);
        }
        let listed = self.subject.listed.get()?;
        let asked: Vec<Resolved> =
            left.iter().map(|&place| self.properties[place].clone()).collect();
        for ((place, property), (holds, run)) in
            left.into_iter().zip(&asked).zip(listed.check(&asked))
        {
            let trace = run.map(|run| rows(circuit, &Cone::of(circuit, [property]), run));
            let answer = if holds { Answer::Holds(trace) } else { Answer::Fails(trace) };
            self.answer(place, answer);
        }
        None
    }

    /// What a list that was not ended says: of invariants whether they are broken in it.
    fn broken_nearby(&mut self, listed: &Explicit, left: &[usize]) {
        let invariants = left.iter().copied();
        let invariants: Vec<(usize, Resolved)> = invariants
            .filter_map(|place| Some((place, invariant(&self.properties[place])?.clone())))
            .collect();
        let kept: Vec<Resolved> = invariants.iter().map(|(_, kept)| kept.clone()).collect();
        let circuit = self.subject.reduced();
        for ((place, kept), broken) in invariants.into_iter().zip(listed.broken(&kept)) {
            match broken {
                Some(run) => {
                    let trace = rows(circuit, &Cone::of(circuit, [&kept]), run);
                    self.answer(place, Answer::Fails(Some(trace)));
                }
                None if listed.ended() > 0 => self.so_far[place].listed = Some(listed.ended()),
                None => {}
            }
        }
    }

    /// What is left stays undecided.
    fn leave(&mut self) {
        for place in 0..self.answers.len() {
            if self.answers[place].is_none() {
                if self.over {
                    self.so_far[place].why = Some(Stopped::Time);
                }
                let answer = Answer::Undecided(self.so_far[place].clone());
                self.answer(place, answer);
            }
        }
    }
}
