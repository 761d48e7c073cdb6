//! Trust in a value: the OPC UA status code of every value.
//!
//! | the run | what is now (signals, states, margin) | what is counted |
//! |---|---|---|
//! | its journal is still being read | Bad_WaitingForInitialData | Bad_WaitingForInitialData |
//! | has not begun | Bad_WaitingForInitialData | Good |
//! | is live | as below | Good |
//! | is silent for 2 s and 20 cycles | Bad_NoCommunication | Uncertain_NoCommunicationLastUsableValue |
//! | has ended | Uncertain_NoCommunicationLastUsableValue, unless it was bad | Good |
//!
//! An output is Good where it is direct or reconstructed, which is the same value; the variable `Source` names it. Held
//! is Uncertain_LastUsableValue, fail-safe Bad_DeviceFailure, forced Good_LocalOverride.

use std::time::{Duration, Instant};

use opcua::types::StatusCode;
use understudy_gateway::Observation;
use understudy_view::{ProgramSnapshot, RunState};

/// Minimum time without records after which a run is silent.
const SILENCE: Duration = Duration::from_secs(2);

/// Minimum number of cycles for the same.
const SILENT_CYCLES: u32 = 20;

/// Whether records of the run arrive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Feed {
    Waiting,
    Live,
    Silent,
    Ended,
}

/// What comes of `seen` at `now`.
pub(crate) fn feed(seen: &Observation, now: Instant) -> Feed {
    let period = Duration::from_micros(seen.snapshot.period_us);
    match seen.snapshot.run {
        RunState::Finished | RunState::Interrupted => Feed::Ended,
        _ if now.duration_since(seen.heard) > SILENCE.max(period * SILENT_CYCLES) => Feed::Silent,
        RunState::Starting => Feed::Waiting,
        RunState::Running => Feed::Live,
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
    if is_forced(program, name) {
        StatusCode::GoodLocalOverride
    } else {
        outputs(program)
    }
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
    if outputs(program).is_good() {
        StatusCode::Good
    } else {
        StatusCode::UncertainLastUsableValue
    }
}

fn is_forced(program: &ProgramSnapshot, name: &str) -> bool {
    let forced = program.forced.iter();
    forced
        .filter_map(|force| force.split_once(" = "))
        .any(|(signal, _)| signal == name)
}
