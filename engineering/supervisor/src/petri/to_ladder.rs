//! A net as a ladder, and the hybrid controller: a net with supervisors that follow and inhibit it.
//!
//! Steps 7 to 9 of section 3. The order of the rungs: timers; what begins anew in each scan; edges; then each transition of
//! the net, *with the supervisors' rungs for its event directly below it*; counters; actions. So the supervisors have seen
//! every event before the next transition asks them, and none arrives after its rung was passed (in the print the supervisor
//! stands between the uncontrollable and the controllable transitions, whose events it sees one scan late).
//!
//! Invariants: a transition fires at most once in a scan; a token does not pass two transitions on one edge of a signal, nor
//! a place with an action, in one scan; a delay begins anew after each firing.

mod declare;
mod rungs;

use std::collections::{BTreeMap, BTreeSet};

use understudy_ladder::{Name, Program};
use understudy_text::{Diagnostic, has_errors};

use super::explore::ExplorationError;
use super::net::Net;
use super::tokens::Tokens;
use crate::Automaton;
use crate::ladder::Names;

/// Why there is no ladder of a net.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum HybridError {
    /// The net has no bounds, or too many markings to know them.
    #[error(transparent)]
    Bounds(#[from] ExplorationError),
    /// A supervisor has no state: nothing keeps the specification.
    #[error("U0897: the supervisor `{name}` has no state")]
    EmptySupervisor {
        /// Its name.
        name: String,
    },
    /// A supervisor knows an event that no transition of the net has.
    #[error(
        "U0898: the supervisor `{supervisor}` knows {event}, and no transition of the net is that event"
    )]
    UnknownEvent {
        /// The supervisor.
        supervisor: String,
        /// The event.
        event: String,
    },
    /// A signal name is invalid in a ladder, or is both input and output.
    #[error("U0899: the ladder of the net has errors: {}", .0.iter().map(|found| found.message.as_str()).collect::<Vec<_>>().join("; "))]
    Invalid(Vec<Diagnostic>),
}

impl HybridError {
    /// Stable code for people.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Bounds(error) => error.code(),
            Self::EmptySupervisor { .. } => "U0897",
            Self::UnknownEvent { .. } => "U0898",
            Self::Invalid(_) => "U0899",
        }
    }
}

/// The ladder of a net and its supervisors.
#[derive(Debug, Clone)]
pub struct HybridLadder {
    /// The program.
    pub program: Program,
    /// For each place its bits: the k-th is 1 while there are at least k tokens. Empty for a place that is a counter.
    pub places: Vec<Vec<Name>>,
    /// For each place the counter that it is; none for one that is bits.
    pub counters: Vec<Option<Name>>,
    /// The bit of each state of each supervisor.
    pub states: Vec<Vec<Name>>,
    /// For each transition the bit that is 1 in the scan in which it fires.
    pub fires: Vec<Name>,
    /// For each transition the timer of its delay, if it has one.
    pub timers: Vec<Option<Name>>,
}

/// Makes the ladder of `net` and `supervisors`, if any. At most `limit` markings are explored for its bounds.
///
/// # Errors
/// See [`HybridError`].
pub fn to_ladder(
    net: &Net,
    supervisors: &[Automaton],
    limit: usize,
) -> Result<HybridLadder, HybridError> {
    let bounds = net.explore(limit)?.bounds();
    check_events(net, supervisors)?;
    let ladder = Maker::new(net, supervisors, &bounds).make();
    let mut found = understudy_ladder::check(&ladder.program);
    if has_errors(&found) {
        found.retain(|found| found.severity == understudy_text::Severity::Error);
        return Err(HybridError::Invalid(found));
    }
    Ok(ladder)
}

/// Whether each supervisor has a state, and the net each of its events.
pub(super) fn check_events(net: &Net, supervisors: &[Automaton]) -> Result<(), HybridError> {
    for supervisor in supervisors {
        let name = supervisor.name().to_owned();
        if supervisor.is_empty() {
            return Err(HybridError::EmptySupervisor { name });
        }
        let known: BTreeSet<_> = net.transitions().iter().filter_map(|t| t.label).collect();
        if let Some(label) = supervisor.alphabet().labels().find(|label| !known.contains(label)) {
            return Err(HybridError::UnknownEvent {
                supervisor: name,
                event: supervisor.alphabet().name(label),
            });
        }
    }
    Ok(())
}

struct Maker<'a> {
    net: &'a Net,
    supervisors: &'a [Automaton],
    names: Names,
    program: Program,
    tokens: Vec<Tokens>,
    fires: Vec<Name>,
    states: Vec<Vec<Name>>,
    /// The bit of each edge that a condition asks for.
    edges: BTreeMap<(String, bool), Name>,
    /// For a place through which a token must not pass in one scan, the bit that is 1 in the scan in which one has come.
    fresh: BTreeMap<usize, Name>,
    /// For a transition with a delay: its timer, and the bit that is 1 from its firing until the timer has seen it.
    delays: BTreeMap<usize, (Name, Name)>,
    /// Bits of events that a supervisor in a self-loop leaves on.
    left: Vec<Name>,
}
