//! The shape of every member: a pure state machine with time as an argument.
//!
//! Feed it with [`Machine::handle_input`], then drain it with [`Machine::poll_output`] until it has no more outputs,
//! then wait until [`Machine::wakeup`] or the next input. The same machine runs on real clocks and networks, in the
//! simulator and under a model checker.

use std::sync::Arc;
use std::time::Duration;

use crate::change::ChangeOrder;

use understudy_wire::{
    ConfigurationHash, Configurations, Force, Frame, Image, OrderRefusal, ProgramHash, Retained,
    StateChoice, Time, Unforce, Write, WriteAnswer,
};

/// An input of a member.
#[derive(Debug, Clone, Copy)]
pub enum Input<'a> {
    /// The time that it asked for has come.
    Wakeup,
    /// A frame that was decoded; duplicates, late ones and those of other clusters included.
    Frame(&'a Arc<Frame>),
    /// An input that only a remote I/O takes; stations and plants ignore it.
    RemoteIo(RemoteIoInput<'a>),
    /// An engineer moves an online change on.
    Change(&'a ChangeOrder),
}

/// An input of a remote I/O, from its field equipment or from the operator.
#[derive(Debug, Clone, Copy)]
pub enum RemoteIoInput<'a> {
    /// Current values of its sensors.
    Field(&'a Image),
    /// From here on the device is read by the points of this version of the program, as [`Output::LayOut`] asks.
    Points(ProgramHash),
    /// The values of its sensors are not known.
    FieldLost,
    /// The values of its sensors are old, and those of the other remote I/O of its program count alone, where that one has modules and is received.
    FieldStale,
    /// The operator releases the outputs of a program that was started cold.
    Release,
    /// The operator chooses the state that a program continues from.
    Choose(StateChoice),
    /// The operator forces a signal.
    Force(&'a Force),
    /// The operator removes a force.
    Unforce(&'a Unforce),
    /// An operator writes a value.
    Write(&'a Write),
}

/// An output of a member.
#[derive(Debug, Clone)]
pub enum Output<Event> {
    /// A frame for all members that take its kind.
    Send(Arc<Frame>),
    /// Outputs that a remote I/O drives from now on.
    Drive {
        /// The outputs.
        outputs: Image,
        /// When the sample was taken that they are proved for; none where they are held or fail-safe.
        sampled: Option<Time>,
    },
    /// Outputs that the modules of a remote I/O drive next to those of the author, which drives the same: what the author has sent, or 0 where they are
    /// released.
    Follow(Image),
    /// The points of this version of the program count from now on: the device is read and driven by them, and outputs that only the version before has
    /// get their fail-safe values.
    LayOut(ProgramHash),
    /// Whether the remote I/O is to be connected to its field; one that has no second one is from its start on.
    Connect(bool),
    /// Outputs that the device of a remote I/O is left with where the process ends in order; until the first of these, those that it was started with.
    EndWith(Image),
    /// An event for the journal.
    Report(Event),
    /// A record for the disk, for the time after a power failure.
    Retain(Box<Retained>),
    /// The answer to a write.
    Answer(WriteAnswer),
    /// What became of the release, the choice, the force, the end of a force or the step of an online change that was given last; once for each.
    Obeyed(Result<(), OrderRefusal>),
}

/// A majority of stations with another configuration, against a member that does not take part yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Outvoted {
    /// The configuration of this member.
    pub ours: ConfigurationHash,
    /// The other configuration.
    pub theirs: ConfigurationHash,
    /// Stations with the configuration of this member; it is counted if it is a station.
    pub stations: u32,
    /// Stations with the other one.
    pub others: u32,
}

/// A member.
pub trait Machine {
    /// An event that it reports.
    type Event;

    /// Takes one input at `now`, which never runs backwards.
    fn handle_input(&mut self, now: Time, input: Input<'_>);

    /// The next output; `None` when it waits.
    fn poll_output(&mut self) -> Option<Output<Self::Event>>;

    /// When it wants [`Input::Wakeup`] at the latest.
    fn wakeup(&self) -> Time;

    /// The configuration that it runs, and the one that it has loaded beside it; nothing of what is no member of a cluster.
    fn configurations(&self) -> Option<Configurations> {
        None
    }

    /// The majority against this member, whose process should end then.
    fn outvoted(&self) -> Option<Outvoted> {
        None
    }

    /// End of the turn window of the current cycle, in which a member with a core of its own waits actively; a time that has passed where there is none.
    fn turn_window(&self) -> Time {
        Time::default()
    }

    /// How long a frame that arrives now may wait for others, so that they are taken together; never past [`Self::wakeup`], before which all that
    /// has arrived is taken.
    fn patience(&self) -> Duration {
        Duration::ZERO
    }
}
