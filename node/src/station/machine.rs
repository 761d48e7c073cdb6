//! A station as a state machine: inputs with a time go in, outputs come out.

use understudy_cycle::{Input, Machine, Output, Outvoted};
use understudy_wire::{Configurations, Time};

use super::Station;
use crate::event::Event;

impl Machine for Station {
    type Event = Event;

    fn handle_input(&mut self, now: Time, input: Input<'_>) {
        self.member.note_time(now);
        match input {
            Input::Wakeup => self.wake(now),
            Input::Frame(frame) => self.receive(now, frame),
            Input::Change(order) => self.take_change(now, order),
            Input::RemoteIo(_) => {}
        }
        self.member.wake_at(self.next_wakeup());
    }

    fn poll_output(&mut self) -> Option<Output<Event>> {
        self.member.poll_output()
    }

    fn wakeup(&self) -> Time {
        self.member.wakeup()
    }

    fn configurations(&self) -> Option<Configurations> {
        Some(self.configurations())
    }

    fn outvoted(&self) -> Option<Outvoted> {
        self.member.outvoted()
    }

    fn turn_window(&self) -> Time {
        self.member.turn_window()
    }
}
