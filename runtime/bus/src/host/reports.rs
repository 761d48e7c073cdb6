//! What the process of a member reports, now and then.

use std::time::Duration;

use understudy_cycle::Machine;
use understudy_wire::Time;

use super::{Host, Round};
use crate::host_event::HostEvent;
use crate::journal::Noted;
use crate::link::Reopening;
use crate::retained::Retainer;

/// Frames that could not be sent and are not yet reported.
#[derive(Debug, Default)]
pub(super) struct Unsendable {
    count: u64,
    last: Option<String>,
}

impl Unsendable {
    pub(super) fn note(&mut self, reason: String) {
        self.count += 1;
        self.last = Some(reason);
    }

    pub(super) fn take(&mut self) -> Option<(u64, String)> {
        let last = self.last.take()?;
        Some((std::mem::take(&mut self.count), last))
    }
}

impl<M: Machine> Host<'_, M> {
    pub(super) fn report_reopenings(&mut self, now: Time) {
        while let Some(reopening) = self.link.reopening() {
            let Reopening { via: network, silence, peer, failure } = reopening;
            let silence_ms = u64::try_from(silence.as_millis()).unwrap_or(u64::MAX);
            let event = match failure {
                None => HostEvent::LinkReopened { network, silence_ms, peer },
                Some(reason) => HostEvent::LinkFailed { network, silence_ms, peer, reason },
            };
            self.sink.record(now, Noted::Host(event));
        }
    }

    pub(super) fn report_timing(&mut self, now: Time, is_last: bool, round: &mut Round) {
        if let Some(event) = round.timing.record(now, is_last) {
            self.sink.record(now, Noted::Host(event));
        }
    }

    pub(super) fn report_trouble(&mut self, now: Time, period: Duration, round: &mut Round) {
        for event in round.duplicates.over(now) {
            self.sink.record(now, Noted::Host(event));
        }
        for event in self.networks.as_mut().map(|it| it.judge(now)).into_iter().flatten() {
            self.sink.record(now, Noted::Host(event));
        }
        if let Some(begun) = self.guard.begin_life() {
            let event = match begun {
                Ok(life) => HostEvent::NewLife { life },
                Err(reason) => HostEvent::NoNewLife { reason },
            };
            self.sink.record(now, Noted::Host(event));
        }
        if let Some(change) = self.retainer.as_mut().and_then(Retainer::take_change) {
            let event = match change {
                Some(reason) => HostEvent::RetainFailed { reason },
                None => HostEvent::RetainRegained,
            };
            self.sink.record(now, Noted::Host(event));
        }
        if now.since(round.reported) < period {
            return;
        }
        let writes = self.orders.take_refused_writes();
        if writes > 0 {
            round.reported = now;
            self.sink.record(now, Noted::Host(HostEvent::RefusedWrites { writes }));
        }
        let unsendable = round.unsendable.take();
        if !round.refused.is_empty() || unsendable.is_some() {
            round.reported = now;
        }
        for event in round.refused.take() {
            self.sink.record(now, Noted::Host(event));
        }
        if let Some((frames, reason)) = unsendable {
            let event = HostEvent::UnsendableFrames { frames, reason };
            self.sink.record(now, Noted::Host(event));
        }
    }
}
