//! The shape of every member: a pure state machine with time as an argument.
//!
//! Feed it with [`Machine::handle_input`], then drain it with [`Machine::poll_output`] until it has nothing more to say, then
//! wait until [`Machine::wakeup`] or the next input. The same machine runs on real clocks and networks, in the simulator
//! and under a model checker.

use std::sync::Arc;

use understudy_wire::{Force, Frame, Image, SignalPlace, StateChoice, Time};

/// What a member is told.
#[derive(Debug, Clone, Copy)]
pub enum Input<'a> {
    /// The time that it asked for has come.
    Wakeup,
    /// A frame that was decoded; duplicates, late ones and those of other clusters included.
    Frame(&'a Arc<Frame>),
    /// What the sensors of a remote I/O see now; ignored by everybody else.
    Field(&'a Image),
    /// What the sensors of a remote I/O see is not known; ignored by everybody else.
    FieldLost,
    /// The operator releases the outputs of a program that was started cold; ignored by all but its remote I/O.
    Release,
    /// The operator chooses the state that a program continues from; ignored by all but its remote I/O.
    Choose(StateChoice),
    /// The operator puts a value in the place of a signal; ignored by all but its remote I/O.
    Force(&'a Force),
    /// The operator takes it back.
    Unforce(SignalPlace),
}

/// What a member says.
#[derive(Debug, Clone)]
pub enum Output<Event> {
    /// A frame for all who are concerned by its kind.
    Send(Arc<Frame>),
    /// What a remote I/O drives now.
    Drive(Image),
    /// Something for the journal.
    Report(Event),
}

/// A member.
pub trait Machine {
    /// What it reports.
    type Event;

    /// Takes one input at `now`, which never runs backwards.
    fn handle_input(&mut self, now: Time, input: Input<'_>);

    /// The next thing that it says; `None` when it waits.
    fn poll_output(&mut self) -> Option<Output<Self::Event>>;

    /// When it wants [`Input::Wakeup`] at the latest.
    fn wakeup(&self) -> Time;
}
