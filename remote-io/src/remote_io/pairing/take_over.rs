//! When one of two remote I/Os of a program takes over, and when it gives the outputs to the other one.

use understudy_wire::{Part, Time};

use super::super::arbiter::Question;
use super::super::{Deadline, RemoteIo};
use super::{FIRST_LOSS_TIME, IDLE_PATIENCE, LOSS_PATIENCE, LOSS_TIME, Pairing, Report};
use crate::event::{AskReason, Event};

impl RemoteIo {
    /// A cycle has begun: asks the other one for the promise that it does not begin.
    pub(in crate::remote_io) fn begin_pair_cycle(&mut self, now: Time) {
        if self.is_author() && !self.may_sample() && !self.may_drive() {
            self.step_aside(now);
        }
        let asks = |pairing: &Pairing| pairing.part != Part::Follower || pairing.is_first();
        if self.pairing.as_ref().is_some_and(asks) {
            self.send_pair();
        }
    }

    /// A deadline is over: counts it, reports to the other one, and begins to take over.
    pub(in crate::remote_io) fn end_pair_deadline(&mut self, now: Time) {
        let is_sensed = self.is_sensed();
        let Some(pairing) = &mut self.pairing else {
            return;
        };
        let after = pairing.settings.take_over_after;
        let moment = self.member.moment();
        let is_idle = matches!(self.deadline, Deadline::Passed { idle: 1.. });
        pairing.receives_stations = !is_idle && pairing.reports.iter().any(Report::is_received);
        // Without a cycle no station has followed anything since.
        let followed = pairing.followed.filter(|_| !is_idle);
        let is_followed = followed.is_some_and(|(followed, _)| followed == moment);
        pairing.idle = match pairing.part {
            Part::TakingOver | Part::Author if !is_followed => pairing.idle.saturating_add(1),
            _ => 0,
        };
        // What the operator has chosen waits for the field device.
        if !is_sensed && pairing.followed.is_none() {
            pairing.since.0 = now;
        }
        let patience = after.saturating_mul(IDLE_PATIENCE);
        let is_idle = pairing.idle > patience.max(self.settings.agreement.listen_cycles * 8);
        let period = self.settings.agreement.schedule.period();
        let least = if pairing.partner.is_known { LOSS_TIME } else { FIRST_LOSS_TIME };
        let patience = least.max(period * after.saturating_mul(LOSS_PATIENCE));
        let loses = !pairing.partner.is_lost && now.since(pairing.partner.at) > patience;
        pairing.partner.is_lost |= loses;
        if loses {
            let theirs = pairing.theirs.as_ref();
            let lack = theirs.and_then(|theirs| pairing.lack(theirs)).unwrap_or_default();
            self.report(Event::PartnerLost { moment, lack });
        }
        self.hand_over(now, is_idle);
        self.begin_to_take_over(now);
        self.follow_outputs(now);
        self.send_pair();
    }

    /// The outputs are given to the other one where the field device of this one does not answer, or no station follows it; at once where this one receives
    /// no station and the other one does, which a direct link tells.
    fn hand_over(&mut self, now: Time, is_idle: bool) {
        let can_take_over = |pairing: &Pairing| {
            let reported =
                pairing.theirs.as_ref().filter(|theirs| theirs.able && theirs.receives_stations);
            reported.is_some() && self.is_promised(pairing)
        };
        let has_partner = self.pairing.as_ref().is_some_and(can_take_over);
        let is_cut_off = |pairing: &Pairing| {
            !pairing.receives_stations && pairing.idle > pairing.settings.take_over_after
        };
        let is_cut_off = self.pairing.as_ref().is_some_and(is_cut_off);
        if !(is_idle || is_cut_off) || !has_partner || self.arbiter.question.is_some() {
            return;
        }
        if let Some(pairing) = &mut self.pairing {
            pairing.able = false;
        }
        match self.is_author() {
            true => self.step_aside(now),
            false => self.follow_again(now),
        }
    }

    fn begin_to_take_over(&mut self, now: Time) {
        let Some(pairing) = &self.pairing else {
            return;
        };
        let waits = self.period() * pairing.settings.take_over_after - self.period() / 4;
        let is_silent = now.since(pairing.heard_at) >= waits;
        if pairing.part == Part::Author || !is_silent {
            return;
        }
        let may = self.is_promised(pairing)
            || self.unfollowed_for(pairing, Report::lacked_for_now)
                >= pairing.settings.take_over_after;
        let is_taking_over = pairing.part == Part::TakingOver;
        let Some(pairing) = &mut self.pairing else {
            return;
        };
        let receives = pairing.receives_stations;
        match (may, is_taking_over) {
            (true, false) => {
                pairing.part = Part::TakingOver;
                pairing.idle = 0;
                pairing.refused = 0;
                // Those that were missing have come, so the question is over: what they hold decides.
                if std::mem::take(&mut pairing.asks) {
                    self.become_answered(None);
                }
                self.connect_field();
                self.report_part();
            }
            (true, true) => pairing.refused = 0,
            (false, _) => {
                // Where a station follows the author, no decision is needed who that is.
                let is_followed = pairing.reports.iter().any(|it| it.lacks == Some(false));
                let more = pairing.refused.saturating_add(u32::from(receives));
                pairing.refused = if is_followed { 0 } else { more };
                let refused = pairing.refused;
                self.ask_who_begins(refused);
            }
        }
    }

    /// Stations are received, but one that is not might follow an author that is not received either: the operator decides. The two are not started at one
    /// time, so the other one has its time to come first.
    fn ask_who_begins(&mut self, refused: u32) {
        let patience = self.settings.agreement.listen_cycles.saturating_mul(5);
        let gone = self.arbiter.holders.gone_after().max(patience);
        let Some(pairing) = &mut self.pairing else {
            return;
        };
        let is_awaited = !pairing.partner.is_known && !pairing.partner.is_lost;
        if refused <= gone || is_awaited || self.arbiter.question.is_some() {
            return;
        }
        pairing.asks = true;
        let (moment, applied) = (self.moment(), self.newest_applied());
        let newest = self.arbiter.holders.newest().map(|(from, holding)| (from, holding.stepped));
        let (holder, newest) = newest.unzip();
        let (asks, reason) = (true, AskReason::Unreceived);
        let inputs = None;
        let event = Event::StateLost { moment, applied, newest, holder, asks, reason, inputs };
        self.become_asking(Question::StateLost { told: newest, newest }, event);
    }
}
