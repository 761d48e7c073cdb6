//! A ladder that finds failed channels by what the plant can do: *stuck* and *implausible by the model*.
//!
//! It follows the states of S in which the plant may be (`m`), with the world of [`crate::proof`]: an event happens only where the
//! outputs in force let it, ω only where the ladder has made it. What all of these rule out is no event: the channel is failed.
//!
//! ```text
//! implausible   a change that happens in no state where the plant may be, or one that is gone before it was steady
//! stuck         the plant must have left the only state where it may be: the channels that would have shown it
//! repaired      it moves again, and then shows for a while, without another move, what one of the states shows; so many
//!               times only, then the operator releases it
//! ```
//!
//! As long as a channel is failed its events are unseen, and nothing is called stuck: time alone says less then. Where the ladder
//! loses its way (a plant outside of the model) it accuses nobody, and begins again from "anywhere".
//!
//! The remote I/O scans it before each sample; the names of its signals are those that it gives them.

mod rungs;

use std::time::Duration;

use understudy_ladder::{
    Block, BlockKind, Coil, CoilKind, Contact, ContactKind, Element, Name, Program, Signal,
};

use crate::controller::Controller;
use crate::module_two::MAXIMUM_RUNGS;
use crate::relation::{Relation, Row};
use crate::timing::Timing;

/// How patient it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Patience {
    /// A change is believed when it has lasted so long.
    pub steady: Duration,
    /// Outputs let an event happen for so long after they have changed.
    pub grace: Duration,
    /// An event may come so much later than the model's latest.
    pub late: Duration,
    /// Time without changes before a failed channel is accepted again.
    pub quiet: Duration,
    /// Number of automatic repairs; afterwards the operator must release the channel.
    pub repairs: u16,
}

/// What it is made from.
#[derive(Clone, Copy)]
pub(crate) struct Ground<'a> {
    pub(crate) controller: &'a Controller,
    pub(crate) relation: &'a Relation,
    pub(crate) timing: &'a Timing,
    /// The inputs that it watches.
    pub(crate) channels: &'a [usize],
    pub(crate) period: Duration,
    pub(crate) patience: Patience,
}

/// Writes the ladder.
///
/// # Errors
/// The number of rungs, where it is more than [`MAXIMUM_RUNGS`].
pub(crate) fn diagnose(name: &str, ground: Ground<'_>) -> Result<Program, usize> {
    let states = ground.controller.states().len();
    // at, old, gone, next, may be, and what it takes to count them; the rest does not grow with the states.
    let rungs = states * 8;
    if rungs > MAXIMUM_RUNGS {
        return Err(rungs);
    }
    let mut writer = Writer::new(name, ground);
    writer.prepare();
    writer.look();
    writer.follow();
    writer.accuse();
    writer.settle();
    Ok(writer.program)
}

/// The name of a signal of one channel.
fn of(channel: &str, what: &str) -> Name {
    Name::from(format!("{channel}.{what}"))
}

struct Writer<'a> {
    ground: Ground<'a>,
    program: Program,
    /// Every row of Λ once, by its place the number of its bit.
    rows: Vec<Row>,
}

fn contact(name: &Name, value: bool) -> Element {
    Element::Contact(Contact {
        kind: if value {
            ContactKind::NormallyOpen
        } else {
            ContactKind::NormallyClosed
        },
        operand: name.clone(),
    })
}

fn on(name: &Name) -> Element {
    contact(name, true)
}

fn off(name: &Name) -> Element {
    contact(name, false)
}

/// Passes when one of `branches` does; there is one at least.
fn any(mut branches: Vec<Vec<Element>>) -> Vec<Element> {
    match branches.len() {
        0 | 1 => branches.pop().unwrap_or_default(),
        _ => vec![Element::Branches(branches)],
    }
}

fn coil(kind: CoilKind, target: &Name) -> Coil {
    Coil {
        kind,
        target: target.clone(),
    }
}

fn block(name: Name, kind: BlockKind) -> Element {
    Element::Block(Block {
        name,
        kind,
        pins: Vec::new(),
    })
}

impl<'a> Writer<'a> {
    fn new(name: &str, ground: Ground<'a>) -> Self {
        let mut rows: Vec<Row> = Vec::new();
        for state in 0..ground.controller.states().len() {
            for event in ground.controller.signals.events() {
                let unknown = ground.relation.rows(state, event).iter();
                let unknown: Vec<Row> =
                    unknown.filter(|row| !rows.contains(row)).cloned().collect();
                rows.extend(unknown);
            }
        }
        let program = Program {
            name: Name::from(format!("{name}_diagnosis")),
            comments: vec![
                format!(
                    "Finds failed input channels of {name} by what its plant can do. Written by `understudy reconfigure`;"
                ),
                "scanned by the remote I/O before each sample, see docs/reference/reconfiguration.md.".into(),
            ],
            ..Program::default()
        };
        let mut writer = Self {
            ground,
            program,
            rows,
        };
        writer.declare();
        writer
    }

    fn declare(&mut self) {
        let signals = &self.ground.controller.signals;
        let input = |name: Name, text: &str| Signal {
            description: (!text.is_empty()).then(|| text.to_owned()),
            ..Signal::new(name)
        };
        let memory = |name: Name, text: &str| Signal {
            initial: Some(false),
            ..input(name, text)
        };
        let channels = self.channels();
        let inputs = signals.inputs.iter();
        let mut declared: Vec<Signal> = inputs
            .map(|name| input(Name::from(name.clone()), "as the device shows it"))
            .chain(
                signals
                    .outputs
                    .iter()
                    .map(|name| input(Name::from(name.clone()), "as it was driven")),
            )
            .collect();
        let mut outputs = Vec::new();
        let mut bits = Vec::new();
        for channel in &channels {
            declared.push(input(of(channel, "failed"), "reported by the device"));
            declared.push(input(of(channel, "recalled"), "failed before a restart"));
            outputs.push(memory(of(channel, "diagnosed"), "it is failed"));
            outputs.push(memory(of(channel, "unsteady"), "not yet accepted"));
            bits.push(memory(of(channel, "out"), "failed, by device or diagnosis"));
            bits.push(memory(of(channel, "last"), "value in the previous scan"));
            bits.push(memory(
                of(channel, "moves"),
                "value changed since the previous scan",
            ));
            bits.push(memory(of(channel, "seen"), "last accepted value"));
            bits.push(memory(
                of(channel, "differs"),
                "value differs from the accepted one",
            ));
            bits.push(memory(of(channel, "accepted"), "which has lasted"));
            bits.push(memory(
                of(channel, "waits"),
                "changed value, not yet stable",
            ));
            bits.push(memory(
                of(channel, "gone"),
                "changed value that was not stable",
            ));
            bits.push(memory(
                of(channel, "explains"),
                "assuming that it has failed, the plant is in the model",
            ));
            bits.push(memory(of(channel, "accused"), ""));
            bits.push(memory(
                of(channel, "moved"),
                "it has changed since it was diagnosed as failed",
            ));
            bits.push(memory(
                of(channel, "fits"),
                "value is possible for the plant",
            ));
            bits.push(memory(
                of(channel, "spent"),
                "repaired too often to be accepted automatically",
            ));
            bits.push(memory(of(channel, "mended"), ""));
        }
        for name in self.unwatched() {
            bits.push(memory(of(&name, "last"), "value in the previous scan"));
        }
        declared.push(input(
            Name::from("diagnosis.driven"),
            "neither held nor fail-safe",
        ));
        declared.push(input(
            Name::from("diagnosis.release"),
            "the operator has released",
        ));
        for (name, text) in [
            ("diagnosis.started", "a previous scan exists"),
            ("diagnosis.out", "a channel is failed"),
            ("diagnosis.change", "an input is seen to have changed"),
            ("diagnosis.possible", "the plant has a possible state"),
            ("diagnosis.anywhere", "the plant may be in any state"),
            ("diagnosis.lost", "no state explained the previous scan"),
            ("diagnosis.one", "the plant may be in one state at least"),
            ("diagnosis.two", "and in another"),
            ("diagnosis.tracked", "which was concluded, not supposed"),
            (
                "diagnosis.followed",
                "the plant was in one state, and the outputs were its own",
            ),
        ] {
            bits.push(memory(Name::from(name), text));
        }
        for number in 0..self.rows.len() {
            bits.push(memory(self.row(number), &self.rows[number].text()));
        }
        for state in 0..self.ground.controller.states().len() {
            let name = self.ground.controller.state_name(state);
            bits.push(memory(self.bit("m", state), &name));
            for what in ["at", "left", "n"] {
                bits.push(memory(self.bit(what, state), ""));
            }
            if self.ground.timing.longest_stay[state].is_some() {
                bits.push(memory(self.bit("old", state), ""));
            }
        }
        self.program.inputs = declared;
        self.program.outputs = outputs;
        self.program.memory = bits;
    }

    /// Names of the watched channels.
    fn channels(&self) -> Vec<String> {
        let inputs = &self.ground.controller.signals.inputs;
        let channels = self.ground.channels.iter();
        channels.map(|&channel| inputs[channel].clone()).collect()
    }

    /// Names of the other inputs.
    fn unwatched(&self) -> Vec<String> {
        let inputs = self.ground.controller.signals.inputs.iter().enumerate();
        let others = inputs.filter(|(place, _)| !self.ground.channels.contains(place));
        others.map(|(_, name)| name.clone()).collect()
    }

    /// `m.4`: by what it says, of which state.
    fn bit(&self, what: &str, state: usize) -> Name {
        Name::from(format!("{what}.{}", Controller::number(state)))
    }

    fn row(&self, number: usize) -> Name {
        Name::from(format!("row.{}", number + 1))
    }

    fn states(&self) -> std::ops::Range<usize> {
        0..self.ground.controller.states().len()
    }
}
