//! Result of a proof: the extent of the exploration, or the shortest run to a forbidden scan.

use std::fmt;

use understudy_ladder::LowerError;
use understudy_text::Diagnostic;

use crate::Label;

/// What a proof has found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// Every scan does what the automata allow.
    Proved(Proof),
    /// A scan does not.
    Refuted(Box<Counterexample>),
}

/// Extent of the exploration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Proof {
    /// States of the ladder with its inputs' last values.
    pub states: usize,
    /// Scans: states times what may happen in each.
    pub scans: u64,
    /// States of the automata together, the one before the start not counted.
    pub joint_states: usize,
    /// Events that have moved or commanded something.
    pub events: Vec<Label>,
}

/// The shortest run (in scans) to a scan that the automata do not allow.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Counterexample {
    /// The scans before it.
    pub scans: Vec<ScanRecord>,
    /// It.
    pub last: ScanRecord,
    /// What is wrong with it.
    pub deviation: Deviation,
    /// What would have been right: events and command in order, and the states that they lead to.
    pub allowed: Vec<(Vec<String>, Vec<String>)>,
}

/// One scan in words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScanRecord {
    /// Inputs that are 1.
    pub inputs: Vec<String>,
    /// Events that occur.
    pub events: Vec<String>,
    /// Signals of commands that are 1 after it.
    pub outputs: Vec<String>,
    /// State bits that are 1 after it.
    pub states: Vec<String>,
}

/// How a scan departs from the automata.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Deviation {
    /// No state bit of an automaton is on.
    StateLost {
        /// The automaton.
        automaton: String,
    },
    /// Several are.
    StateDoubled {
        /// The automaton.
        automaton: String,
    },
    /// Several signals of one switch are on.
    SwitchDoubled {
        /// The signals.
        signals: Vec<String>,
    },
    /// Forbidden states or commands.
    NotAllowed,
    /// A supervisor has no transition for an uncontrollable event that the plants can generate: it is not controllable.
    Uncontrollable {
        /// The supervisor.
        automaton: String,
        /// The event.
        event: String,
    },
}

impl fmt::Display for Counterexample {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_scans(formatter, self.scans.iter().chain([&self.last]))?;
        match &self.deviation {
            Deviation::StateLost { automaton } => {
                writeln!(formatter, "no state of {automaton} is on")?;
            }
            Deviation::StateDoubled { automaton } => {
                writeln!(formatter, "two states of {automaton} are on")?;
            }
            Deviation::SwitchDoubled { signals } => {
                writeln!(formatter, "{} are on together", signals.join(" and "))?;
            }
            Deviation::NotAllowed => writeln!(formatter, "the automata do not allow that")?,
            Deviation::Uncontrollable { automaton, event } => {
                writeln!(formatter, "{automaton} would have to forbid {event}, and cannot")?;
            }
        }
        for (word, states) in &self.allowed {
            let word = if word.is_empty() { "nothing".into() } else { word.join(" then ") };
            writeln!(formatter, "allowed: {word}, in {}", states.join(" "))?;
        }
        Ok(())
    }
}

/// A line for each scan.
pub(super) fn write_scans<'s>(
    formatter: &mut fmt::Formatter<'_>,
    scans: impl IntoIterator<Item = &'s ScanRecord>,
) -> fmt::Result {
    let or_none = |names: &[String]| {
        if names.is_empty() { "-".to_owned() } else { names.join(" ") }
    };
    for (number, record) in (1..).zip(scans) {
        writeln!(
            formatter,
            "scan {number}: events {}, outputs {}, in {}",
            or_none(&record.events),
            or_none(&record.outputs),
            or_none(&record.states)
        )?;
    }
    Ok(())
}

/// Why there is no verdict.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ProofError {
    /// The map does not fit the automata.
    #[error("U0871: the map does not fit the automata ({} findings)", .0.len())]
    Partition(Vec<Diagnostic>),
    /// The ladder does not become a circuit.
    #[error("{code}: {0}", code = .0.code_or("U0872"))]
    Lower(#[from] LowerError),
    /// A bit that the correspondence names is not in the ladder, or does not outlast a scan.
    #[error("U0873: `{name}` is no bit of the ladder that lasts from scan to scan")]
    NoBit {
        /// Its name.
        name: String,
    },
    /// More states than the settings allow.
    #[error(
        "U0874: more than {limit} states of the ladder with its inputs; raise the limit, or prove with fewer inputs that keep their value"
    )]
    TooLarge {
        /// The limit.
        limit: usize,
    },
}

impl ProofError {
    /// Stable code for people.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Partition(_) => "U0871",
            Self::Lower(error) => error.code_or("U0872"),
            Self::NoBit { .. } => "U0873",
            Self::TooLarge { .. } => "U0874",
        }
    }
}
