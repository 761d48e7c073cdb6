//! What each station is, from what is said of it.
//!
//! ```text
//!   (not started) ─► joining ─► shadow ─► speaking ◄──► silent ─► flagged
//!                        ▲                    │  killed, stopped, ended, refused: by whoever runs it, or by the others
//!                        └────── started again ┘
//! ```

use serde::{Deserialize, Serialize};
use understudy_journal::Action;
use understudy_wire::{ProgramSet, StationSet};

/// In one word.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    Hash,
    PartialOrd,
    Ord,
    Serialize,
    Deserialize,
    schemars::JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum StationState {
    /// Nothing has been heard of it yet.
    NotStarted,
    /// It takes its turns.
    Speaking,
    /// It runs, and was not heard in the last cycles.
    Silent,
    /// It has been silent for too long, θ = 1: its slot is closed.
    Flagged,
    /// It listens, and asks for the states that it lacks.
    Joining,
    /// It has a state, and computes along without speaking.
    Shadow,
    /// It runs another configuration, and its frames are dropped.
    Refused,
    /// Its process stands still.
    Stopped,
    /// Its process was killed.
    Killed,
    /// Its process has ended, unasked.
    Ended,
}

impl StationState {
    /// As tables write it.
    pub fn word(self) -> &'static str {
        match self {
            Self::NotStarted => "not started",
            Self::Speaking => "speaking",
            Self::Silent => "silent",
            Self::Flagged => "flagged",
            Self::Joining => "joining",
            Self::Shadow => "shadow",
            Self::Refused => "refused",
            Self::Stopped => "stopped",
            Self::Killed => "killed",
            Self::Ended => "ended",
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Process {
    #[default]
    Unknown,
    Running,
    StandsStill,
    Killed,
    Ended,
}

/// One station.
#[derive(Debug, Clone, Default)]
pub(crate) struct StationTrack {
    process: Process,
    /// The newest cycle in which a remote I/O heard it, and by whom.
    heard: Option<i64>,
    /// The programs that its last words were over, as long as it lives.
    pub(crate) covers: ProgramSet,
    joining: bool,
    shadow: ProgramSet,
    /// Who has closed its slot.
    flagged_by: StationSet,
    flagged_by_remote_ios: ProgramSet,
    refused: bool,
    /// Programs whose remote I/O has found its state faulty.
    pub(crate) excluded: ProgramSet,
    /// What was last done to it, for causes.
    pub(crate) done: Option<(String, i64)>,
}

impl StationTrack {
    pub(crate) fn started(&mut self) {
        let flags = (self.flagged_by, self.flagged_by_remote_ios);
        let heard = self.heard;
        *self = Self {
            process: Process::Running,
            joining: true,
            flagged_by: flags.0,
            flagged_by_remote_ios: flags.1,
            heard,
            ..Self::default()
        };
    }

    pub(crate) fn fault(&mut self, action: Action, cycle: i64, text: String) {
        match action {
            Action::Crash => {
                self.process = Process::Killed;
                self.covers = ProgramSet::EMPTY;
            }
            Action::Stop => self.process = Process::StandsStill,
            Action::Continue => self.process = Process::Running,
            Action::Restart | Action::RestartInEpoch { .. } | Action::RestartMisconfigured => {
                self.started();
            }
            _ => {}
        }
        self.done = Some((text, cycle));
    }

    pub(crate) fn ended(&mut self, cycle: i64, text: String) {
        self.process = Process::Ended;
        self.covers = ProgramSet::EMPTY;
        self.done = Some((text, cycle));
    }

    pub(crate) fn ready(&mut self) {
        if !matches!(self.process, Process::Killed | Process::Ended) {
            self.process = Process::Running;
        }
    }

    /// It says so itself. What a killed one has said before may be read after its end.
    pub(crate) fn published(&mut self, covers: ProgramSet) {
        if matches!(self.process, Process::Killed | Process::Ended) {
            return;
        }
        self.ready();
        self.covers = covers;
        self.joining = false;
        self.shadow = self.shadow.without(covers);
        self.refused = false;
    }

    pub(crate) fn joins(&mut self) {
        self.ready();
        self.joining = true;
    }

    /// It has a state: from somebody, then it computes in shadow first.
    pub(crate) fn adopted(&mut self, program: understudy_wire::ProgramId, given: bool) {
        self.ready();
        if given {
            self.shadow.insert(program);
        }
    }

    pub(crate) fn synchronised(&mut self, program: understudy_wire::ProgramId) {
        self.shadow.remove(program);
    }

    pub(crate) fn heard(&mut self, cycle: i64) {
        self.heard = Some(self.heard.map_or(cycle, |heard| heard.max(cycle)));
        self.refused = false;
    }

    pub(crate) fn shift(&mut self, by: i64) {
        self.heard = self.heard.map(|heard| heard.saturating_add(by));
        if let Some((_, cycle)) = &mut self.done {
            *cycle = cycle.saturating_add(by);
        }
    }

    pub(crate) fn refused(&mut self) {
        self.refused = true;
    }

    pub(crate) fn flagged_by_station(&mut self, by: understudy_wire::StationId, flagged: bool) {
        if flagged {
            self.flagged_by.insert(by);
        } else {
            self.flagged_by.remove(by);
        }
    }

    pub(crate) fn flagged_by_remote_io(&mut self, by: understudy_wire::ProgramId, flagged: bool) {
        if flagged {
            self.flagged_by_remote_ios.insert(by);
        } else {
            self.flagged_by_remote_ios.remove(by);
        }
    }

    /// By a remote I/O: what stations say of each other ends with themselves.
    pub(crate) fn is_flagged(&self) -> bool {
        !self.flagged_by_remote_ios.is_empty()
    }

    /// When the newest deadline is `latest`; one that was heard up to `slack` cycles before it is still speaking, for one remote I/O
    /// may be a cycle ahead of the one that told of it.
    pub(crate) fn state(&self, latest: Option<i64>, slack: i64) -> StationState {
        match self.process {
            Process::Killed => return StationState::Killed,
            Process::StandsStill => return StationState::Stopped,
            Process::Ended => return StationState::Ended,
            Process::Unknown | Process::Running => {}
        }
        if self.refused {
            return StationState::Refused;
        }
        if let (Some(heard), Some(latest)) = (self.heard, latest)
            && heard.saturating_add(slack) >= latest
        {
            return StationState::Speaking;
        }
        if !self.shadow.is_empty() {
            StationState::Shadow
        } else if self.joining {
            StationState::Joining
        } else if self.is_flagged() && self.heard.is_some() {
            StationState::Flagged
        } else if self.heard.is_none() && self.process == Process::Unknown {
            StationState::NotStarted
        } else if self.heard.is_none() {
            StationState::Joining
        } else {
            StationState::Silent
        }
    }
}
