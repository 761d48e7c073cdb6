//! Signals that the operator has forced, each with its end.
//!
//! Invariant: at most one force for each bit, and none after its end.

use std::time::Duration;

use understudy_wire::{
    Force, Image, OrderRefusal, PointValue, SignalPlace, Time, Unforce, WriteRefusal,
};

use super::RemoteIo;
use crate::event::{Event, ForceEnd};

/// Forces in effect, by signal.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub(super) struct Forcing {
    active: Vec<Active>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Active {
    signal: SignalPlace,
    value: PointValue,
    until: Time,
}

impl Forcing {
    pub(super) fn put(&mut self, signal: SignalPlace, value: PointValue, until: Time) {
        self.remove(signal);
        self.active.push(Active { signal, value, until });
    }

    fn remove(&mut self, signal: SignalPlace) -> bool {
        let before = self.active.len();
        self.active.retain(|active| active.signal != signal);
        self.active.len() < before
    }

    /// Removes a force of another signal that has a bit of this one.
    fn remove_overlapping(&mut self, force: &Force) -> Option<SignalPlace> {
        let overlaps = |active: &Active| {
            let other = Force { signal: active.signal, value: active.value, ..force.clone() };
            active.signal != force.signal && other.overlaps(force)
        };
        let place = self.active.iter().position(overlaps)?;
        Some(self.active.remove(place).signal)
    }

    /// Removes a force whose time is over.
    fn take_expired(&mut self, now: Time) -> Option<SignalPlace> {
        let expired = self.active.iter().position(|active| active.until <= now)?;
        Some(self.active.remove(expired).signal)
    }

    /// Why no write of the input with this first bit can have an effect: the input is forced.
    pub(super) fn refuses_write(&self, input: u16, now: Time) -> Option<WriteRefusal> {
        let signal = SignalPlace::Input(input);
        let active = self.active.iter().find(|active| active.signal == signal)?;
        let seconds = active.until.since(now).as_nanos().div_ceil(1_000_000_000);
        Some(WriteRefusal::Forced { seconds: u32::try_from(seconds).unwrap_or(u32::MAX) })
    }

    /// u(i) with the forced values, as it is sampled.
    pub(super) fn inputs(&self, field: Image) -> Image {
        self.with(field, |signal| match signal {
            SignalPlace::Input(place) => Some(place),
            SignalPlace::Output(_) => None,
        })
    }

    /// y(i) with the forced values, as it is driven.
    pub(super) fn outputs(&self, applied: &Image) -> Image {
        self.with(applied.clone(), |signal| match signal {
            SignalPlace::Output(place) => Some(place),
            SignalPlace::Input(_) => None,
        })
    }

    fn with(&self, image: Image, place: impl Fn(SignalPlace) -> Option<u16>) -> Image {
        let mut forced = image;
        for active in &self.active {
            if let Some(place) = place(active.signal) {
                for (bit, value) in (usize::from(place)..).zip(active.value.bits()) {
                    forced.set(bit, value);
                }
            }
        }
        forced
    }
}

impl RemoteIo {
    /// Why a force cannot be done: every client forces a signal as a whole, to a value that the signal can have.
    fn force_refusal(&self, force: &Force) -> Option<OrderRefusal> {
        if !self.is_author() {
            return Some(OrderRefusal::NotAuthor);
        }
        if force.check().is_err() {
            return Some(OrderRefusal::Incomplete);
        }
        if !self.counts_by(force.points) {
            return Some(OrderRefusal::OtherPoints);
        }
        let points = match force.signal {
            SignalPlace::Input(_) => &self.layout.input_points,
            SignalPlace::Output(_) => &self.layout.output_points,
        };
        let Some(point) = points.iter().find(|point| point.bit == force.signal.first_bit()) else {
            return Some(OrderRefusal::NoSignal);
        };
        let (width, real) = (point.of.bits() as u16, point.of.is_real());
        (!point.takes(force.value)).then_some(OrderRefusal::Value { width, real })
    }

    /// Forces a signal, or refuses that.
    pub(super) fn force(&mut self, now: Time, force: &Force) {
        if let Some(refusal) = self.force_refusal(force) {
            let moment = self.moment();
            self.report(Event::ForceRefused { moment, force: force.clone(), refusal });
            return self.obeyed(Err(refusal));
        }
        // The operator sees one force for each bit.
        while let Some(signal) = self.inputs.forcing.remove_overlapping(force) {
            self.report_unforced(signal, ForceEnd::Operator);
        }
        let until = now + Duration::from_secs(u64::from(force.seconds));
        self.inputs.forcing.put(force.signal, force.value, until);
        self.report(Event::Forced { moment: self.moment(), force: force.clone() });
        self.obeyed(Ok(()));
    }

    /// Ends a force, or refuses that.
    pub(super) fn unforce(&mut self, &Unforce { signal, points }: &Unforce) {
        let refusal = match self.counts_by(points) {
            true if self.inputs.forcing.remove(signal) => {
                self.report_unforced(signal, ForceEnd::Operator);
                return self.obeyed(Ok(()));
            }
            true => OrderRefusal::NotForced,
            false => OrderRefusal::OtherPoints,
        };
        self.report(Event::UnforceRefused { moment: self.moment(), signal, refusal });
        self.obeyed(Err(refusal));
    }

    pub(super) fn end_forces(&mut self, now: Time) {
        while let Some(signal) = self.inputs.forcing.take_expired(now) {
            self.report_unforced(signal, ForceEnd::Time);
        }
    }

    /// Ends all forces, which are of this remote I/O and of the points that count.
    pub(super) fn end_all_forces(&mut self, by: ForceEnd) {
        for active in std::mem::take(&mut self.inputs.forcing).active {
            self.report_unforced(active.signal, by);
        }
    }

    fn report_unforced(&mut self, signal: SignalPlace, by: ForceEnd) {
        self.report(Event::Unforced { moment: self.moment(), signal, by });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn force(signal: SignalPlace, value: PointValue) -> Force {
        let (owner, reason) = ("anna".to_owned(), "a test".to_owned());
        Force { signal, value, seconds: 1, owner, reason, points: None }
    }

    #[test]
    fn a_number_is_forced_with_all_its_bits_and_alone() {
        let number = PointValue::Number { width: 32, stored: 0x4148_0000 };
        let place = SignalPlace::Output(32);
        let mut forcing = Forcing::default();
        forcing.put(SignalPlace::Output(0), true.into(), Time(1));
        forcing.put(place, number, Time(1));
        let driven = forcing.outputs(&Image::from_bits([true; 64]));
        assert_eq!(driven.words(), [0x4148_0000_FFFF_FFFF]);
        assert_eq!(forcing.inputs(Image::zero(64)), Image::zero(64));
        // A force of one of its bits ends it.
        let bit = force(SignalPlace::Output(63), true.into());
        assert_eq!(forcing.remove_overlapping(&bit), Some(place));
        assert_eq!(forcing.remove_overlapping(&bit), None);
        assert!(forcing.remove(SignalPlace::Output(0)));
    }
}
