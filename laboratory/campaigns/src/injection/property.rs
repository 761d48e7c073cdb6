//! What a campaign hunts for: a run in which the property does not hold.

use serde::{Deserialize, Serialize};
use understudy_remote_io::Event as RemoteIoEvent;
use understudy_simulator::Record;
use understudy_wire::Source;

use understudy_scenarios::Expectation;

/// Cycles at the end of a run in which nothing is injected, where protection has to be back by the end.
pub(super) const RECOVERY_CYCLES: u64 = 100;

/// What must not come about.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default, Serialize, Deserialize,
)]
#[serde(rename_all = "kebab-case")]
pub enum Property {
    /// An output that is neither true, nor the last true one in its time, nor fail-safe. Must never be, whatever is injected.
    #[default]
    Wrong,
    /// A cycle with held outputs.
    Held,
    /// A cycle with fail-safe outputs.
    FailSafe,
    /// A station, a remote I/O or an understudy that is not synchronised again 100 cycles after the last fault.
    Unprotected,
}

impl Property {
    /// As the command line and tables write it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Wrong => "wrong",
            Self::Held => "held",
            Self::FailSafe => "fail-safe",
            Self::Unprotected => "unprotected",
        }
    }

    /// The expectation that a run fails where the property is violated.
    pub(super) fn expectation(self) -> Expectation {
        let none = Some(0);
        match self {
            Self::Wrong => Expectation::default(),
            Self::Held => Expectation { held: none, ..Expectation::default() },
            Self::FailSafe => Expectation { fail_safe: none, ..Expectation::default() },
            Self::Unprotected => Expectation { protected: true, ..Expectation::default() },
        }
    }

    /// What a record of a remote I/O says against it, in words; whether protection is back is seen at the end.
    pub(super) fn violated_by(self, record: &Record<'_>) -> Option<String> {
        match (self, record) {
            (Self::Wrong, Record::Violation(violation)) => Some(violation.to_string()),
            (Self::Held, Record::RemoteIo(event)) => applied(event, Source::Held),
            (Self::FailSafe, Record::RemoteIo(event)) => applied(event, Source::FailSafe),
            _ => None,
        }
    }
}

fn applied(event: &RemoteIoEvent, wanted: Source) -> Option<String> {
    match event {
        RemoteIoEvent::Applied { moment, outputs, source, missing, .. } if *source == wanted => {
            let why = missing.map_or(String::new(), |missing| format!(" ({missing:?})"));
            Some(format!("applied {outputs} in cycle {moment}{why}"))
        }
        _ => None,
    }
}
