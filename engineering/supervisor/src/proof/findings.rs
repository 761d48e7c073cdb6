//! What can be said before a ladder is generated: where a PLC that scans could not follow the supervisor.
//!
//! The conditions are those of Ramadge and Wonham (controllability, nonblocking), of Dietrich, Malik, Wonham and Brandin,
//! "Implementation considerations in supervisory control" (confluence, bounded response, nonblocking under control), and of
//! Fabian and Hellgren (avalanche, simultaneous events). All are decided on the closed loop: the automata synchronised.

mod closed_loop;
mod conditions;
mod signals;

use self::closed_loop::ClosedLoop;
use super::verdict::ProofError;
use crate::ladder::{InputOutputMap, Modules, OneEvent, Partition, avalanche_events};
use crate::petri::{ExplorationError, Net, buffers};
use crate::{Automaton, AutomatonError, Label, State};

/// What a finding is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum FindingKind {
    /// A supervisor forbids an uncontrollable event that its plant can generate.
    Controllability,
    /// A state from which no marked state can be reached.
    Blocking,
    /// Two commands of which the one that is generated first makes a difference.
    Choice,
    /// Commands without end.
    Response,
    /// A state from which a PLC that generates every command at once does not come to rest in a marked state.
    BlockingUnderControl,
    /// A command that can be generated while its signal is on, so that it has no edge.
    LatchedAgain,
    /// A ladder that processes one event in a scan.
    OneEvent,
    /// An event on successive transitions.
    Avalanche,
    /// Two events whose order, which one scan cannot see, makes a difference.
    Simultaneity,
}

/// How bad a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum FindingSeverity {
    /// The ladder keeps the specification, and may do other than was meant.
    Warning,
    /// No ladder can keep it.
    Error,
}

/// Something to know before a ladder is generated.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// What about.
    pub kind: FindingKind,
    /// How bad.
    pub severity: FindingSeverity,
    /// One sentence with the reason.
    pub message: String,
    /// States of the closed loop concerned; of many the first.
    pub states: Vec<State>,
    /// Events concerned.
    pub events: Vec<Label>,
    /// The shortest run to the first state.
    pub run: Vec<Label>,
}

impl Finding {
    /// Stable code for people.
    pub fn code(&self) -> &'static str {
        match self.kind {
            FindingKind::Controllability => "U0881",
            FindingKind::Blocking => "U0882",
            FindingKind::Choice => "U0883",
            FindingKind::Response => "U0884",
            FindingKind::BlockingUnderControl => "U0885",
            FindingKind::LatchedAgain => "U0876",
            FindingKind::OneEvent => "U0877",
            FindingKind::Avalanche => "U0886",
            FindingKind::Simultaneity => "U0887",
        }
    }
}

/// All findings about `modules`, by kind; with a map also those about its signals.
///
/// # Errors
/// An unsuitable map, or more than 2,000,000 states together.
pub fn findings(
    modules: &Modules,
    map: Option<&InputOutputMap>,
) -> Result<Vec<Finding>, ProofError> {
    let closed = ClosedLoop::of(modules)?;
    let partition = map.map(|map| Partition::new(map, modules)).transpose();
    let partition = partition.map_err(ProofError::Partition)?;
    let one_event = map.and_then(|map| map.one_event.as_ref());
    let mut found = closed.controllability.clone();
    found.extend(closed.blocking());
    found.extend(closed.choices());
    found.extend(closed.response());
    found.extend(closed.blocking_under_control());
    if let (Some(map), Some(partition)) = (map, &partition) {
        found.extend(closed.latched_again(modules, map, partition));
        found.extend(closed.pulsed_again(map, partition));
    }
    let queue = partition.as_ref().map(Partition::queue).unwrap_or_default();
    found.extend(one_event.and_then(|one_event| closed.one_event(one_event, queue)));
    found.extend(avalanche(modules, map.is_some()));
    if one_event != Some(&OneEvent::Assumed) {
        found.extend(closed.simultaneity(queue));
    }
    Ok(found)
}

/// Events on successive transitions. A command has a bit only in a net or beside other automata; a supervisor alone generates it
/// once in a scan.
fn avalanche(modules: &Modules, has_map: bool) -> Vec<Finding> {
    let is_alone = has_map && modules.len() == 1;
    let findings = modules.all().flat_map(|automaton| {
        let (commands, seen): (Vec<Label>, Vec<Label>) = avalanche_events(automaton)
            .into_iter()
            .partition(|label| is_alone && label.is_controllable());
        [(seen, false), (commands, true)].map(|(events, are_commands)| {
            let names =
                events.iter().map(|&label| format!("`{}`", automaton.alphabet().name(label)));
            let names: Vec<String> = names.collect();
            let (stand, bits) = match names.len() {
                0 => return None,
                1 => ("stands", "its bit is"),
                _ => ("stand", "each bit is"),
            };
            let measure = if are_commands {
                "a scan generates at most one command".to_owned()
            } else {
                format!("{bits} reset by the rung that uses it")
            };
            Some(Finding {
                kind: FindingKind::Avalanche,
                severity: FindingSeverity::Warning,
                message: format!(
                    "in `{}` {} {stand} on successive transitions; {measure}",
                    automaton.name(),
                    names.join(", ")
                ),
                states: Vec::new(),
                events,
                run: Vec::new(),
            })
        })
    });
    findings.flatten().collect()
}

/// All findings about `supervisors` of a net, whose places are the plants; nothing about a net without supervisors.
///
/// # Errors
/// A net without bounds within `limit` markings, or more than 2,000,000 states together.
pub fn hybrid_findings(
    net: &Net,
    supervisors: &[Automaton],
    limit: usize,
) -> Result<Vec<Finding>, HybridFindingsError> {
    if supervisors.is_empty() {
        return Ok(Vec::new());
    }
    let bounds = net.explore(limit)?.bounds();
    let plants = buffers(net, &bounds)?;
    let modules = Modules { supervisors, plants: &plants };
    Ok(findings(&modules, None)?)
}

/// Why there are no findings about a net.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum HybridFindingsError {
    /// The net has no bounds.
    #[error(transparent)]
    Bounds(#[from] ExplorationError),
    /// Two transitions of one event move a place differently.
    #[error(transparent)]
    Buffers(#[from] AutomatonError),
    /// The closed loop is too large.
    #[error(transparent)]
    ClosedLoop(#[from] ProofError),
}

impl HybridFindingsError {
    /// Stable code for people.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Bounds(error) => error.code(),
            Self::Buffers(error) => error.code(),
            Self::ClosedLoop(error) => error.code(),
        }
    }
}
