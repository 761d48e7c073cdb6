//! What is done to a member, and when.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use understudy_wire::{
    Force, MAXIMUM_FORCE_SECONDS, Member, PointValue, PointsHash, ProgramHash, ProgramId, Role,
    SignalPlace, StateChoice, Via, Write, WriteId,
};

/// One thing done to one member.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Fault {
    /// The cycle, counted from the first in which everybody was synchronised.
    pub at_cycle: u64,
    /// Where in that cycle, from 0 (its start) to below 1 (the start of the next).
    pub phase: f64,
    /// To whom.
    pub member: Member,
    /// What.
    pub action: Action,
}

/// A step of an online change, at one member.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ChangeStep {
    /// It loads the other programs.
    Prepare,
    /// The program of this remote I/O becomes the new one.
    Switch,
    /// The program of this remote I/O becomes the old one again.
    SwitchBack,
    /// The new configuration is its own.
    Accept,
    /// The old configuration is its own again.
    TakeBack,
    /// The change is over: it forgets the old configuration.
    Forget,
    /// The change is over, and was taken back: it forgets the new configuration.
    ForgetNew,
}

/// What can be done to a member. What does not concern a member (a state that it does not hold) does nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Action {
    /// It is gone, with all that it knew (kill -9).
    Crash,
    /// It starts again, knowing only what its disk has.
    Restart,
    /// It starts again on a host whose wall clock has jumped: the epoch that it founds where nobody is there is this one.
    RestartInEpoch {
        /// The epoch.
        epoch: u64,
    },
    /// It starts again with a configuration of its own, as after a wrong download: it and all others refuse each other.
    RestartMisconfigured,
    /// It starts again with a configuration that names another program: members that are restarted so have one and the same, and admit each
    /// other.
    RestartWrongProgram,
    /// It stands still, and frames wait for it (SIGSTOP).
    Stop,
    /// It goes on (SIGCONT).
    Continue,
    /// Whatever it is told, and every time that it asked for, reaches it so much later from now on; zero ends this.
    Slow {
        /// At most a second.
        by: Duration,
    },
    /// The operator releases the outputs of a remote I/O after a cold start or a value fault, and the stations that it
    /// has excluded.
    Release,
    /// An engineer takes a step of the online change of the cluster; nothing where there is none.
    Change {
        /// Which.
        step: ChangeStep,
    },
    /// The operator chooses the state that the program of a remote I/O continues from, where it is lost.
    Choose {
        /// Which.
        choice: StateChoice,
    },
    /// An operator writes a value to an input of the program of a remote I/O.
    Write {
        /// Input, by its first bit in u(i), counted from 0.
        input: u16,
        /// Value.
        value: PointValue,
    },
    /// An input of the program of a remote I/O is sampled with a value in place of its own, for an hour at most.
    Set {
        /// Input, by its first bit in u(i), counted from 0.
        input: u16,
        /// Value.
        value: PointValue,
    },
    /// An input of the program of a remote I/O is sampled from the field again.
    Unset {
        /// Input, by its first bit in u(i), counted from 0.
        input: u16,
    },
    /// An input module of a remote I/O shows a fixed value of an input from now on, whatever the remote I/O does.
    StickInput {
        /// Input, by its first bit in u(i), counted from 0.
        input: u16,
        /// What it shows.
        value: bool,
    },
    /// That input module shows the true value again.
    FreeInput {
        /// Input, by its first bit in u(i), counted from 0.
        input: u16,
    },
    /// Its frames reach one other member no more. A full cut is one each way; a partition is one for each pair.
    Cut {
        /// Who hears it no more.
        to: Member,
    },
    /// Its frames reach that member again.
    Heal {
        /// Who hears it again.
        to: Member,
    },
    /// The cable between it and one of two networks, or the direct link to the other remote I/O of its program, is pulled: over that one it sends and
    /// receives nothing more. Where all are unplugged from a network, that network has failed.
    Unplug {
        /// Which.
        network: Via,
    },
    /// That cable is plugged in again.
    Plug {
        /// Which.
        network: Via,
    },
    /// Its frames reach one other member so much later from now on, and are overtaken by later ones of others; zero ends this.
    Delay {
        /// Who hears it later.
        to: Member,
        /// By this.
        by: Duration,
    },
    /// Bits of its next frames flip on their way.
    Corrupt {
        /// So many frames.
        frames: u16,
    },
    /// A frame that it sent earlier comes to everybody once more.
    Replay {
        /// So many frames ago; 1 is its last one.
        age: u16,
    },
    /// A stranger says its last frame again in its name, with other outputs or inputs, and without its key.
    Forge,
    /// One bit of x(i) flips in the memory of a station.
    FlipState {
        /// i.
        program: ProgramId,
        /// Counted round the width of x(i).
        bit: u16,
    },
    /// One bit of u(i) flips: in what a remote I/O sends, behind its own back, or in what one station takes in.
    FlipSample {
        /// Counted round the width of u(i).
        bit: u16,
        /// In so many frames, copies counted.
        frames: u16,
    },
    /// One bit of the first word that a station says flips on its way out of a sound state.
    FlipWord {
        /// Counted round the width of the word.
        bit: u16,
        /// In so many frames, copies counted.
        frames: u16,
    },
}

impl Fault {
    /// The request of a [`Action::Write`] by a person who knows these points: each step writes in a session of its own.
    pub fn write(&self, points: Option<PointsHash>) -> Option<Write> {
        let Action::Write { input, value } = self.action else {
            return None;
        };
        let step = format!("{self:?}");
        Some(Write {
            id: WriteId { session: ProgramHash::of(step.as_bytes()).0, number: 1 },
            input,
            value,
            role: Role::Engineer,
            owner: "scenario".to_owned(),
            reason: format!("step at cycle {}", self.at_cycle),
            points,
        })
    }
}

impl Action {
    /// The force of a [`Self::Set`] by a person who knows these points.
    pub fn force(self, points: Option<PointsHash>) -> Option<Force> {
        let Self::Set { input, value } = self else {
            return None;
        };
        Some(Force {
            signal: SignalPlace::Input(input),
            value,
            seconds: MAXIMUM_FORCE_SECONDS,
            owner: "scenario".to_owned(),
            reason: "step of the scenario".to_owned(),
            points,
        })
    }

    /// Its kind in one word, as journals and scenario files write it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Crash => "crash",
            Self::Restart => "restart",
            Self::RestartInEpoch { .. } => "restart-in-epoch",
            Self::RestartMisconfigured => "restart-misconfigured",
            Self::RestartWrongProgram => "restart-wrong-program",
            Self::Stop => "stop",
            Self::Continue => "continue",
            Self::Slow { .. } => "slow",
            Self::Release | Self::Unset { .. } => "release",
            Self::Change { .. } => "change",
            Self::Choose { choice: StateChoice::Cold } => "cold-start",
            Self::Choose { .. } => "accept-state",
            Self::Write { .. } => "write",
            Self::Set { .. } => "set",
            Self::StickInput { .. } => "stick-input",
            Self::FreeInput { .. } => "free-input",
            Self::Cut { .. } => "cut",
            Self::Heal { .. } => "heal",
            Self::Unplug { .. } => "unplug",
            Self::Plug { .. } => "plug",
            Self::Delay { .. } => "delay",
            Self::Corrupt { .. } => "corrupt",
            Self::Replay { .. } => "replay",
            Self::Forge => "forge",
            Self::FlipState { .. } => "flip-state",
            Self::FlipSample { .. } => "flip-sample",
            Self::FlipWord { .. } => "flip-word",
        }
    }
}
