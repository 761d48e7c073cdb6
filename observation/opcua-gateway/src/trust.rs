//! Trust in a value: the OPC UA status code of every value.
//!
//! | the run | what is now (signals, states, margin) | what is counted |
//! |---|---|---|
//! | its journal is still being read | Bad_WaitingForInitialData | Bad_WaitingForInitialData |
//! | has not begun | Bad_WaitingForInitialData | Good |
//! | is live | as below | Good |
//! | has no record or no new cycle for 2 s and 20 cycles | Bad_NoCommunication | Uncertain_NoCommunicationLastUsableValue |
//! | has ended | Uncertain_NoCommunicationLastUsableValue, unless it was bad | Good |
//!
//! An output is Good where it is direct or reconstructed, which is the same value; the variable `Source` names it. Held
//! is Uncertain_LastUsableValue, fail-safe Bad_DeviceFailure, forced Good_LocalOverride.

use opcua::types::StatusCode;
use understudy_gateway::{Feed, Observation};
use understudy_view::{ProgramSnapshot, Snapshot};

/// Values of `Server/ServiceLevel`, in the ranges of OPC UA part 4: 1 no data, 2 to 199 degraded, 200 to 255 healthy.
pub(crate) mod level {
    /// The run is current, and every program is protected.
    pub(crate) const PROTECTED: u8 = 255;
    /// A program is not protected, or its protection is not reported yet. All values are the present.
    pub(crate) const UNPROTECTED: u8 = 200;
    /// The records of a member are not received.
    pub(crate) const NOT_RECEIVED: u8 = 150;
    /// A program has no provable outputs.
    pub(crate) const WITHOUT_OUTPUTS: u8 = 100;
    /// The run has ended: the values are the last ones.
    pub(crate) const ENDED: u8 = 10;
    /// The journal is still being read, or the run has not begun or is not current.
    pub(crate) const NO_DATA: u8 = 1;
}

/// The level of service of `seen`; nothing where the journal is still being read.
pub(crate) fn service_level(seen: Option<(&Observation, Feed)>) -> u8 {
    match seen {
        None | Some((_, Feed::Waiting | Feed::Silent)) => level::NO_DATA,
        Some((_, Feed::Ended)) => level::ENDED,
        Some((observation, Feed::Live)) => level_of(&observation.snapshot),
    }
}

fn level_of(snapshot: &Snapshot) -> u8 {
    let has_outputs = |program: &ProgramSnapshot| {
        let is_stopped = program.fault.is_some() || program.lost.is_some();
        outputs(program).is_good() && !is_stopped && !program.awaits_release
    };
    let is_protected = |program: &ProgramSnapshot| {
        let protection = program.protection.as_ref();
        protection.is_some_and(|protection| protection.protected)
    };
    let programs = &snapshot.programs;
    if !programs.iter().all(has_outputs) {
        level::WITHOUT_OUTPUTS
    } else if snapshot.links().any(|(_, link)| link.detached) {
        level::NOT_RECEIVED
    } else if !programs.iter().all(is_protected) {
        level::UNPROTECTED
    } else {
        level::PROTECTED
    }
}

/// Of something that is so now, `own` if it is heard of.
pub(crate) fn present(feed: Feed, own: StatusCode) -> StatusCode {
    match feed {
        Feed::Waiting => StatusCode::BadWaitingForInitialData,
        Feed::Live => own,
        Feed::Silent => StatusCode::BadNoCommunication,
        Feed::Ended if own.is_bad() => own,
        Feed::Ended => StatusCode::UncertainNoCommunicationLastUsableValue,
    }
}

/// Of something that was counted.
pub(crate) fn counted(feed: Feed) -> StatusCode {
    match feed {
        Feed::Silent => StatusCode::UncertainNoCommunicationLastUsableValue,
        Feed::Waiting | Feed::Live | Feed::Ended => StatusCode::Good,
    }
}

/// Of the outputs of a program.
pub(crate) fn outputs(program: &ProgramSnapshot) -> StatusCode {
    match program.source {
        Some("direct" | "reconstructed") => StatusCode::Good,
        Some("held") => StatusCode::UncertainLastUsableValue,
        Some(_) => StatusCode::BadDeviceFailure,
        None => StatusCode::BadWaitingForInitialData,
    }
}

/// Of one of its outputs.
pub(crate) fn output(program: &ProgramSnapshot, name: &str) -> StatusCode {
    if is_forced(program, name) { StatusCode::GoodLocalOverride } else { outputs(program) }
}

/// Of an input whose channel `has_failed`: the program is given its last good value then.
pub(crate) fn input(program: &ProgramSnapshot, name: &str, has_failed: bool) -> StatusCode {
    if is_forced(program, name) {
        StatusCode::GoodLocalOverride
    } else if has_failed {
        StatusCode::UncertainLastUsableValue
    } else {
        StatusCode::Good
    }
}

/// Of its state, which does not advance without provable outputs.
pub(crate) fn state(program: &ProgramSnapshot) -> StatusCode {
    if outputs(program).is_good() { StatusCode::Good } else { StatusCode::UncertainLastUsableValue }
}

fn is_forced(program: &ProgramSnapshot, name: &str) -> bool {
    let forced = program.forced.iter();
    forced.filter_map(|force| force.split_once(" = ")).any(|(signal, _)| signal == name)
}
