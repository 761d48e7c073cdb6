//! A rehearsal of an online change: the new program computes what it would have done with the samples of a run, and touches nothing.
//!
//! The new program begins with the state of the old one, converted as in the change, and goes on with its own. Every few scans it begins so anew, because the
//! plant does not follow it. An output that differs *at once* does so from the state of the old program in this very cycle; any other one differs by
//! what the new program did in the scans before.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;
use understudy_cluster::Card;
use understudy_cycle::{PointPlace, ProgramChange};
use understudy_executable::{Scratch, declared};
use understudy_typed::{Point, Points};
use understudy_wire::{Image, Lineage};

use crate::history::{Sampled, Step};
use crate::value::{named_text, point_text};

/// What the new program of one controller would have done.
#[derive(Debug)]
pub struct Rehearsal {
    change: ProgramChange,
    inputs: Points,
    outputs: Points,
    renew_after: u32,
    scratch: Scratch,
    running: Option<Running>,
    /// The newest cycle that was taken.
    newest: Option<i64>,
    found: Rehearsed,
}

/// The new program while it runs.
#[derive(Debug)]
struct Running {
    state: Vec<u64>,
    /// What the old program has taken in.
    after: Lineage,
    /// Scans since it took the state of the old one over.
    scans: u32,
}

/// The outcome for one program.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Rehearsed {
    /// The controller.
    pub program: String,
    /// Cycles that were rehearsed.
    pub cycles: u64,
    /// Those in which an output is another one.
    pub differing: u64,
    /// The first of them.
    pub first: Option<FirstDifference>,
    /// The outputs that differ, by name.
    pub outputs: BTreeMap<String, OutputDifference>,
    /// The outputs that are compared: those that both programs have, by the names of the old one.
    pub compared: Vec<String>,
    /// The outputs that only one of the two programs has, or that have another type.
    pub not_compared: Vec<String>,
}

/// The first cycle in which an output differs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct FirstDifference {
    /// The cycle, from the origin of the run.
    pub cycle: i64,
    /// Scans since the new program took the state of the old one over.
    pub scans: u32,
    /// The inputs of the cycle.
    pub inputs: String,
    /// The outputs of the old program that differ.
    pub before: String,
    /// The same of the new program.
    pub now: String,
}

/// How often an output differs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, JsonSchema)]
pub struct OutputDifference {
    /// Cycles.
    pub cycles: u64,
    /// Those in which it differs from the state of the old program in this cycle, too.
    pub at_once: u64,
}

impl Rehearsal {
    /// Of a program that an online change replaces; it takes the state of the old program over every `renew_after` scans. The points are those of the old
    /// program; `not_compared` are the outputs that the two programs do not have in common.
    pub fn new(
        name: &str,
        change: ProgramChange,
        ((inputs, outputs), not_compared): ((Points, Points), Vec<String>),
        renew_after: u32,
    ) -> Self {
        let points = change.points.as_deref();
        let is_common = |output: &&Point| {
            let place = PointPlace::of(output);
            points.is_none_or(|points| points.forward().output(place).is_some())
        };
        let compared = declared(&outputs).filter(is_common).map(|output| output.name.clone());
        let compared = compared.collect();
        Self {
            change,
            inputs,
            outputs,
            renew_after: renew_after.max(1),
            scratch: Scratch::default(),
            running: None,
            newest: None,
            found: Rehearsed {
                program: name.to_owned(),
                compared,
                not_compared,
                ..Rehearsed::default()
            },
        }
    }

    /// What was found up to now.
    pub fn found(&self) -> &Rehearsed {
        &self.found
    }

    /// Takes the steps of the old program behind those that it has taken, and none of another one; a gap in them begins anew.
    pub fn take<'s>(&mut self, steps: impl Iterator<Item = &'s Step>) {
        for step in steps.filter(|step| !step.void) {
            if self.newest.is_some_and(|newest| step.cycle <= newest) {
                continue;
            }
            let is_of_old = |it: &&Sampled| it.program == self.change.before.hash;
            if let Some(sampled) = step.sampled.as_ref().filter(is_of_old) {
                self.newest = Some(step.cycle);
                self.scan(step.cycle, sampled);
            }
        }
    }

    fn scan(&mut self, cycle: i64, sampled: &Sampled) {
        let goes_on =
            |running: &Running| running.after == sampled.before && running.scans < self.renew_after;
        let mut running = match self.running.take().filter(goes_on) {
            Some(running) => running,
            None => Running {
                state: self.change.forward.convert(sampled.state.words()),
                after: sampled.before,
                scans: 0,
            },
        };
        let outputs = self.step(&mut running.state, sampled);
        self.compare(cycle, running.scans, sampled, &outputs);
        running.after = sampled.after;
        running.scans += 1;
        self.running = Some(running);
    }

    /// The outputs of the new program from a state of its own, at the places of the old one; an input that only the new one has keeps its initial value.
    fn step(&mut self, state: &mut [u64], sampled: &Sampled) -> Image {
        let points = self.change.points.as_deref();
        let inputs =
            points.map(|points| points.forward().inputs(&sampled.inputs, &points.after.initial()));
        let inputs = inputs.as_ref().unwrap_or(&sampled.inputs);
        let executable = &self.change.after.executable;
        let mut outputs = Image::zero(executable.output_count());
        executable.step(&mut self.scratch, state, inputs.words(), outputs.words_mut());
        // An output that only one of the two programs has is not compared.
        match points {
            Some(points) => points.back().outputs(&outputs, &sampled.outputs),
            None => outputs,
        }
    }

    fn compare(&mut self, cycle: i64, scans: u32, sampled: &Sampled, outputs: &Image) {
        self.found.cycles += 1;
        if *outputs == sampled.outputs {
            return;
        }
        let mut state = self.change.forward.convert(sampled.state.words());
        let from_here = self.step(&mut state, sampled);
        let value = |image: &Image, point: &Point| point.get(image.words());
        let differs =
            |image: &Image, point: &Point| value(image, point) != value(&sampled.outputs, point);
        let differing: Vec<&Point> =
            self.outputs.iter().filter(|point| differs(outputs, point)).collect();
        self.found.differing += 1;
        for point in &differing {
            let counted = self.found.outputs.entry(point.name.clone()).or_default();
            counted.cycles += 1;
            counted.at_once += u64::from(differs(&from_here, point));
        }
        if self.found.first.is_none() {
            let text = |image: &Image| {
                let texts = differing
                    .iter()
                    .map(|point| format!("{} = {}", point.name, point_text(point, image)));
                texts.collect::<Vec<String>>().join(", ")
            };
            self.found.first = Some(FirstDifference {
                cycle,
                scans,
                inputs: named_text(&self.inputs, &sampled.inputs, |_| Card::default()),
                before: text(&sampled.outputs),
                now: text(outputs),
            });
        }
    }
}

impl Rehearsed {
    /// For a terminal.
    pub fn to_text(&self) -> String {
        let Self { program, cycles, differing, .. } = self;
        let others = match &self.not_compared[..] {
            [] => String::new(),
            names => format!("  not compared: {}\n", names.join(", ")),
        };
        let Some(first) = &self.first else {
            let equal = match (&self.compared[..], &self.not_compared[..]) {
                (_, []) => "all outputs are equal".to_owned(),
                ([], _) => "no output is compared".to_owned(),
                (names, _) => format!("equal in {}", names.join(", ")),
            };
            return format!("{program}: {cycles} cycles rehearsed, {equal}\n{others}");
        };
        let mut text = format!(
            "{program}: {cycles} cycles rehearsed, other outputs in {differing}\n{others}  first in cycle {}, {} scans after the new program took the state over\n    old: {}\n    new: {}\n    inputs: {}\n",
            first.cycle, first.scans, first.before, first.now, first.inputs
        );
        for (name, OutputDifference { cycles, at_once }) in &self.outputs {
            text += &format!(
                "  {name}: {cycles} cycles, in {at_once} of them from the state of the old program\n"
            );
        }
        text
    }
}
