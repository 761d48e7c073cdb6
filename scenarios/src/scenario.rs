//! What a scenario says: the faults, when they strike, and what must come of it.
//!
//! Cycles are counted from the *origin*: the first cycle in which every plant is driven directly, every station is heard and
//! every understudy speaks for all programs. So the same file means the same on a slow host, a fast one and in the simulator.

use std::collections::BTreeMap;
use std::num::NonZeroU64;
use std::ops::Range;

use serde::Serialize;
use understudy_cluster::value_text;
use understudy_journal::{Members, NamedSignal};
use understudy_simulator::{Action, Disturbance, Fault, Network, SpareTimes};
use understudy_wire::{Member, PointValue, ProgramId, SignalPlace, Source};

/// A scenario whose names belong to a cluster.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Scenario {
    /// For people.
    pub title: String,
    /// How many cycles are run and judged from the origin on.
    pub cycles: u64,
    /// What all chance of a simulated run comes from, where the command line does not say.
    pub seed: Option<u64>,
    /// Cycles for which a station must be flagged before the spares of the cluster wake by their rule; they retire when the cluster has been complete
    /// for as many. Nothing where only steps start them. Only the simulator does that.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spare_after: Option<u32>,
    /// What is done to whom, in the order of its times.
    pub steps: Vec<Fault>,
    /// Faults of the network; only the simulator has them.
    pub network: Option<Network>,
    /// The cycles in which it has them; nothing for the whole run, coming into step included. Only the simulator can do that.
    pub network_cycles: Option<Range<u64>>,
    /// What must come of it.
    pub expect: Expectation,
}

/// The experiment of section V.B, `table-two.toml`.
pub const TABLE_TWO: &str = include_str!("../table-two.toml");

impl Scenario {
    /// What a simulated network is, and when.
    pub fn disturbance(&self) -> Option<Disturbance> {
        Some(Disturbance { network: self.network?, cycles: self.network_cycles.clone() })
    }

    /// When spares wake and retire by their rule.
    pub fn spare_times(&self) -> Option<SpareTimes> {
        let spare_after = self.spare_after?;
        Some(SpareTimes { spare_after, retire_after: spare_after })
    }

    /// Whether it does nothing to the cluster and expects nothing of it: a cluster that merely runs.
    pub fn asks_for_nothing(&self) -> bool {
        self.steps.is_empty() && self.network.is_none() && self.expect == Expectation::default()
    }

    /// The same with `cycles` cycles in place of its own; steps and expectations that they do not reach are left out, and so
    /// are counts of finished parts and protection at the end, which belong to the whole.
    #[must_use]
    pub fn shortened(mut self, cycles: Option<u64>) -> Self {
        let Some(cycles) = cycles else {
            return self;
        };
        if cycles < self.cycles {
            self.steps.retain(|step| step.at_cycle < cycles);
            self.expect.during.retain(|during| during.from < cycles);
            for during in &mut self.expect.during {
                during.to = during.to.min(cycles);
            }
            self.expect.finished.clear();
            self.expect.protected = false;
        }
        self.cycles = cycles;
        self
    }

    /// The same in 1/`divisor` of its cycles: every step and every expectation comes that much earlier, and a plant has to finish that
    /// much fewer parts.
    #[must_use]
    pub fn compressed(mut self, divisor: NonZeroU64) -> Self {
        let earlier = |cycle: &mut u64| *cycle /= divisor;
        earlier(&mut self.cycles);
        self.steps.iter_mut().for_each(|step| earlier(&mut step.at_cycle));
        for during in &mut self.expect.during {
            earlier(&mut during.from);
            earlier(&mut during.to);
        }
        self.expect.finished.values_mut().for_each(earlier);
        if divisor.get() > 1 {
            self.title += &format!(", in 1/{divisor} of its cycles");
        }
        self
    }
}

/// Every action as scenario files write it, in the order in which they are explained.
pub const ACTIONS: [&str; 26] = [
    "crash",
    "restart",
    "restart-misconfigured",
    "restart-wrong-program",
    "restart-in-epoch",
    "stop",
    "continue",
    "slow",
    "release",
    "cold-start",
    "accept-state",
    "write",
    "set",
    "cut",
    "heal",
    "unplug",
    "plug",
    "delay",
    "corrupt",
    "replay",
    "forge",
    "flip-state",
    "flip-sample",
    "flip-word",
    "stick-input",
    "free-input",
];

/// An action as scenario files write it.
pub fn action_word(action: Action) -> &'static str {
    action.word()
}

/// An action with its numbers and names, as tables write it.
pub fn action_text(member: Member, action: Action, members: &Members) -> String {
    let word = action_word(action);
    match action {
        Action::Write { input, value } => match written(member, (input, value), members) {
            Some((name, value)) => format!("{word} {name} := {value}"),
            None => word.to_owned(),
        },
        Action::Set { input, value } => match set(member, input, members) {
            Some(signal) => format!("{word} {} := {}", signal.name, set_value(signal, value)),
            None => word.to_owned(),
        },
        Action::StickInput { input, value } => match set(member, input, members) {
            Some(signal) => format!("{word} {} at {value}", signal.name),
            None => word.to_owned(),
        },
        Action::Unset { input } | Action::FreeInput { input } => {
            match set(member, input, members) {
                Some(signal) => format!("{word} {}", signal.name),
                None => word.to_owned(),
            }
        }
        Action::Cut { to } | Action::Heal { to } => format!("{word} to {}", members.name(to)),
        Action::Unplug { network } | Action::Plug { network } => {
            format!("{word} {network}")
        }
        Action::Delay { to, by } => format!("{word} to {} by {by:?}", members.name(to)),
        Action::RestartInEpoch { epoch } => format!("{word} {epoch}"),
        Action::Slow { by } => format!("{word} by {by:?}"),
        Action::Corrupt { frames } => format!("{word} {frames} frames"),
        Action::Replay { age } => format!("{word} of {age} frames ago"),
        Action::FlipState { program, bit } => format!("{word} bit {bit} of program {}", program.0),
        Action::FlipSample { bit, frames } | Action::FlipWord { bit, frames } => {
            format!("{word} bit {bit} in {frames} frames")
        }
        _ => word.to_owned(),
    }
}

/// The input that an operator writes, and the value, as scenario files write them.
pub(crate) fn written(
    member: Member,
    (input, value): (u16, PointValue),
    members: &Members,
) -> Option<(String, String)> {
    let Member::RemoteIo(program) = member else {
        return None;
    };
    let mut inputs = members.operator_inputs(program);
    let named = inputs.find(|named| named.input.place.bit == input)?;
    Some((named.name.clone(), value_text(&named.declared, value.stored())))
}

/// The input that a step sets, by its first bit.
pub(crate) fn set(member: Member, input: u16, members: &Members) -> Option<&NamedSignal> {
    members.signal(member.sampled_program()?, SignalPlace::Input(input))
}

/// A value as scenario files write it.
pub(crate) fn set_value(signal: &NamedSignal, value: PointValue) -> String {
    value_text(&signal.declared, value.stored())
}

/// What must come of a run. Counts are over all remote I/Os, from the origin to the last cycle.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Expectation {
    /// Wrong outputs applied, at most; 0 where the file says nothing.
    pub wrong: u64,
    /// Cycles with held outputs, at most. Those that a stall of the host explains are counted apart.
    pub held: Option<u64>,
    /// Cycles with fail-safe outputs, at most.
    pub fail_safe: Option<u64>,
    /// Cycles in which no remote I/O of a program passed its deadline, at most.
    pub missed: Option<u64>,
    /// Plant faults of all plants, at most.
    pub plant_faults: Option<u64>,
    /// Whether everybody must be synchronised at the end: each plant driven directly, and every station heard.
    pub protected: bool,
    /// Plants that must stay functional throughout.
    pub functional: Vec<ProgramId>,
    /// Parts that a plant must have finished, at least.
    pub finished: BTreeMap<ProgramId, u64>,
    /// What must be applied in a range of cycles.
    pub during: Vec<During>,
}

/// What a remote I/O must apply in every cycle of a range.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct During {
    /// The first cycle of the range.
    pub from: u64,
    /// The first cycle after the range.
    pub to: u64,
    /// Whose outputs.
    pub remote_io: ProgramId,
    /// Any of these.
    pub sources: Vec<Source>,
}
