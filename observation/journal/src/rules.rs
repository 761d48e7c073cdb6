//! The rules that every reader of the journal shares: the account that judges a run, the outlook, and all views.

use serde::{Deserialize, Serialize};
use understudy_remote_io::Missing;
use understudy_simulator::Action;
use understudy_wire::Source;

/// State of a member's process, as the journal tells it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Process {
    /// It runs.
    Running,
    /// It was suspended (SIGSTOP).
    Suspended,
    /// It was killed.
    Killed,
    /// It ended unexpectedly.
    Ended,
}

impl Process {
    /// The state after an action of a scenario or an operator; nothing for an action that does not concern the process.
    pub fn after(action: Action) -> Option<Self> {
        match action {
            Action::Crash => Some(Self::Killed),
            Action::Stop => Some(Self::Suspended),
            Action::Continue
            | Action::Restart
            | Action::RestartInEpoch { .. }
            | Action::RestartMisconfigured
            | Action::RestartWrongProgram => Some(Self::Running),
            _ => None,
        }
    }

    /// Whether the process executes.
    pub fn is_running(self) -> bool {
        self == Self::Running
    }

    /// Why its member does nothing, after the name of the member; nothing where it runs.
    pub fn absence(self) -> Option<&'static str> {
        match self {
            Self::Running => None,
            Self::Suspended => Some("is suspended"),
            Self::Killed => Some("is killed"),
            Self::Ended => Some("ended unexpectedly"),
        }
    }

    /// Whether there is no process.
    pub fn is_down(self) -> bool {
        matches!(self, Self::Killed | Self::Ended)
    }
}

/// Whether outputs of this source were proved in their cycle. A deadline with another source is a missed cycle.
pub fn is_provable(source: Source) -> bool {
    matches!(source, Source::Direct | Source::Reconstructed)
}

/// Whether a program has no provable output for a reason that no station can remove.
pub fn is_blocked(missing: Missing) -> bool {
    match missing {
        Missing::BadQuality
        | Missing::NoHistory
        | Missing::StateLost
        | Missing::NotReleased
        | Missing::ValueFault
        | Missing::ProgramFault
        | Missing::TooLate => true,
        Missing::NoCycle
        | Missing::NotSynchronised
        | Missing::TwoErasures
        | Missing::SecondFailure => false,
    }
}

/// Deadlines of a program by the source of the applied outputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct SourceCounts {
    /// Outputs received from the controller.
    pub direct: u64,
    /// Outputs reconstructed from a parity word.
    pub reconstructed: u64,
    /// The last provable outputs.
    pub held: u64,
    /// The configured values.
    pub fail_safe: u64,
}

impl SourceCounts {
    /// Counts deadlines with this source.
    pub fn add(&mut self, source: Source, deadlines: u64) {
        let count = self.of_mut(source);
        *count = count.saturating_add(deadlines);
    }

    /// The deadlines with this source.
    pub fn of(&self, source: Source) -> u64 {
        let mut counts = *self;
        *counts.of_mut(source)
    }

    /// The deadlines that are counted here and not in `earlier`.
    pub fn since(mut self, earlier: Self) -> Self {
        for source in SOURCES {
            let count = self.of_mut(source);
            *count = count.saturating_sub(earlier.of(source));
        }
        self
    }

    fn of_mut(&mut self, source: Source) -> &mut u64 {
        match source {
            Source::Direct => &mut self.direct,
            Source::Reconstructed => &mut self.reconstructed,
            Source::Held => &mut self.held,
            Source::FailSafe => &mut self.fail_safe,
        }
    }
}

const SOURCES: [Source; 4] =
    [Source::Direct, Source::Reconstructed, Source::Held, Source::FailSafe];
