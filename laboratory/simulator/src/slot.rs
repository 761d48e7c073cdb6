//! The place of one member: running, stopped, or crashed.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use understudy_cycle::{Input, Machine};
use understudy_wire::{Frame, Time};

/// Frames that wait for a stopped member, at most, as in a socket's buffer; later ones are lost.
const WAITING_FRAMES: usize = 256;

pub(crate) const NEVER: Time = Time(u64::MAX);

#[derive(Debug, Clone, Hash)]
pub(crate) struct Slot<M> {
    machine: Option<M>,
    stopped: bool,
    waiting: VecDeque<Arc<Frame>>,
    slow: Duration,
    due: Time,
}

impl<M: Machine> Slot<M> {
    pub(crate) fn new(machine: M) -> Self {
        Self {
            due: machine.wakeup(),
            machine: Some(machine),
            stopped: false,
            waiting: VecDeque::new(),
            slow: Duration::ZERO,
        }
    }

    /// When it is woken, as it wants since its last input; never while it is stopped or crashed.
    pub(crate) fn due(&self) -> Time {
        self.due
    }

    /// Gives an input to a running member. True if it took it.
    pub(crate) fn give(&mut self, now: Time, input: Input<'_>) -> bool {
        if self.stopped {
            if let Input::Frame(frame) = input
                && self.waiting.len() < WAITING_FRAMES
            {
                self.waiting.push_back(Arc::clone(frame));
            }
            return false;
        }
        let Some(machine) = &mut self.machine else {
            return false;
        };
        machine.handle_input(now, input);
        self.due = machine.wakeup() + self.slow;
        true
    }

    /// The member, where it is neither stopped nor crashed.
    pub(crate) fn running(&self) -> Option<&M> {
        self.machine.as_ref().filter(|_| !self.stopped)
    }

    pub(crate) fn machine(&mut self) -> Option<&mut M> {
        self.machine.as_mut()
    }

    fn settle(&mut self) {
        self.due = match &self.machine {
            Some(machine) if !self.stopped => machine.wakeup() + self.slow,
            _ => NEVER,
        };
    }

    pub(crate) fn crash(&mut self) {
        self.machine = None;
        self.stopped = false;
        self.waiting.clear();
        self.settle();
    }

    /// Starts again; one on a slow host stays slow.
    pub(crate) fn restart(&mut self, machine: M) {
        let slow = self.slow;
        *self = Self::new(machine);
        self.slow_down(slow);
    }

    /// From now on it is woken so much later than it asks for.
    pub(crate) fn slow_down(&mut self, by: Duration) {
        self.slow = by;
        self.settle();
    }

    pub(crate) fn stop(&mut self) {
        self.stopped = self.machine.is_some();
        self.settle();
    }

    /// Goes on; answers with the frames that waited.
    pub(crate) fn go_on(&mut self) -> VecDeque<Arc<Frame>> {
        self.stopped = false;
        self.settle();
        std::mem::take(&mut self.waiting)
    }
}
