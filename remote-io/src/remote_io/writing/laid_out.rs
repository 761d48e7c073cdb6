//! Operator inputs of other points: an online change brings them with the program.

use understudy_cycle::{OperatorInput, OperatorInputKind, Passage};
use understudy_wire::{Image, Moment, WriteRefusal};

use super::sessions::Progress;
use super::{WithoutEffect, Writing};

impl Writing {
    /// The operator inputs are others from now on: those of `old` stay where the passage tells their place in `new`. One of the same kind keeps its value,
    /// within its limits, and its writes; one that operators did not write before begins with its newest value, where that is within its limits. Answers
    /// with the writes that have no effect.
    pub(in crate::remote_io) fn lay_out(
        &mut self,
        (old, new): (&[OperatorInput], &[OperatorInput]),
        moment: Moment,
        (passage, newest): (Passage<'_>, &Image),
    ) -> WithoutEffect {
        let before = std::mem::replace(&mut self.values, Self::new(new).values);
        let was_operated = |place| old.iter().any(|it| passage.input(it.place) == Some(place));
        let lasts =
            |kind| matches!(kind, OperatorInputKind::Level | OperatorInputKind::Setpoint { .. });
        for (input, written) in new.iter().zip(&mut self.values) {
            let value = input.place.get(newest);
            let stays = passage.has_input(input.place) && !was_operated(input.place);
            if stays && lasts(input.kind) && input.admits(value) {
                (written.stored, written.in_effect) = (value, value);
            }
        }
        let mut stay = vec![None; old.len()];
        for (place, (input, written)) in old.iter().zip(before).enumerate() {
            let to = passage.input(input.place);
            let found = new.iter().position(|other| {
                Some(other.place) == to
                    && other.is_of_kind(input)
                    && [written.stored, written.in_effect].iter().all(|it| other.admits(*it))
            });
            if let Some(found) = found {
                stay[place] = Some(found);
                self.values[found] = written;
            }
        }
        let mut void = WithoutEffect::new();
        for session in self.sessions.iter_mut() {
            let Some(input) = session.input else {
                continue;
            };
            session.input = stay[input];
            session.is_orphaned = session.input.is_none();
            if session.is_orphaned && session.progress == Progress::Taken {
                void.push((session.id, WriteRefusal::Void));
            }
        }
        self.sessions.drop_void(&void, moment);
        void
    }
}
