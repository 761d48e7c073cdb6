//! What every member does in the same way: it admits frames, makes headers, knows its cycle, counts the stations that
//! it receives, repeats its cyclic frames, and notices when its host has suspended it.
//!
//! A plant is an [`Endpoint`]: it takes frames and sends frames. A station and a remote I/O are each a [`Participant`]
//! of the cycle.

use std::collections::VecDeque;
use std::hash::{Hash, Hasher};
use std::sync::Arc;
use std::time::Duration;

use understudy_wire::{
    Body, ConfigurationHash, Configurations, Frame, Header, Member, Moment, OrderRefusal,
    StationId, StationSet, Time,
};

use crate::agreement::Agreement;
use crate::attendance::{Attendance, Change};
use crate::change::{ChangeOrder, Changing, OnlineChange};
use crate::clock::{Arrival, CycleClock};
use crate::copies::Copies;
use crate::machine::{Output, Outvoted};
use crate::reception::{Admission, Reception};
use crate::waking::Waking;

/// A change in whether the frames of a member of this cluster are dropped, because it has another configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// They are dropped from now on.
    Begins {
        /// Member whose frames are dropped.
        member: Member,
        /// Its configuration.
        theirs: ConfigurationHash,
        /// Configuration of the member that reports.
        ours: ConfigurationHash,
    },
    /// None is received any more, or the member has this configuration now.
    Ends {
        /// Member whose frames were dropped.
        member: Member,
    },
}

/// A majority of stations with another configuration counts when it was received for this time without a break.
const OUTVOTED_AFTER: Duration = Duration::from_secs(2);

/// What stations and remote I/Os report in the same way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Notice {
    /// A station was not received for `flag_after` cycles: θ = 1.
    Flagged {
        /// Cycle that ends.
        moment: Moment,
        /// Station that is flagged.
        station: StationId,
    },
    /// A flagged station was received again: θ = 0.
    Cleared {
        /// Cycle that ends.
        moment: Moment,
        /// Station that was received.
        station: StationId,
    },
    /// This member does not take part yet, and more stations have one other configuration than have its own.
    Outvoted(Outvoted),
    /// The configuration that this member runs, and the one that it has loaded beside it, after an order of an online change.
    Configured(Configurations),
    /// The host woke this member too late to keep its times.
    Stalled {
        /// Current cycle.
        moment: Moment,
        /// Delay behind the time that the member had asked for.
        late: Duration,
    },
}

/// Frames in and out of one member.
#[derive(Debug, Clone)]
pub struct Endpoint<Event> {
    own: Member,
    agreement: Arc<Agreement>,
    changing: Changing,
    reception: Reception,
    outbox: VecDeque<Output<Event>>,
}

impl<Event: From<Refusal>> Endpoint<Event> {
    /// An endpoint of the member `own`.
    pub fn new(own: Member, agreement: &Arc<Agreement>) -> Self {
        Self {
            own,
            agreement: Arc::clone(agreement),
            changing: Changing::new(agreement.configuration),
            reception: Reception::new(own, agreement),
            outbox: VecDeque::new(),
        }
    }

    /// Whether a frame with this header counts that arrives at `now`; reports when the refusal of a member begins and ends.
    pub fn admits(&mut self, now: Time, header: &Header) -> bool {
        let member = header.sender;
        match self.reception.admit(now, header, self.changing.configurations()) {
            Admission::Admitted => true,
            Admission::AdmittedAgain => {
                self.report(Event::from(Refusal::Ends { member }));
                true
            }
            Admission::Dropped => false,
            Admission::Refused { theirs } => {
                let ours = self.changing.configurations().own;
                self.report(Event::from(Refusal::Begins { member, theirs, ours }));
                false
            }
        }
    }

    /// Takes an order of an online change, as [`Changing::take`] does, and answers it.
    pub fn take_change(&mut self, now: Time, order: &ChangeOrder, may_forget: bool) {
        let may_forget = may_forget && !self.reception.receives_other(now);
        let outcome = self.changing.take(order, may_forget);
        self.put(Output::Obeyed(outcome));
    }

    /// Starts with a change that it had loaded before, and with the configurations that it had then. A change of other configurations is left out:
    /// its refusal says so.
    ///
    /// # Errors
    /// As of [`Changing::take`].
    pub fn restore_change(
        &mut self,
        change: Arc<OnlineChange>,
        Configurations { own, prepared }: Configurations,
    ) -> Result<(), OrderRefusal> {
        let changing = &mut self.changing;
        let name = change.name();
        changing.take(&ChangeOrder::Prepare(change), true)?;
        changing.take(&ChangeOrder::Run(name, own), true)?;
        match prepared {
            Some(_) => Ok(()),
            None => changing.take(&ChangeOrder::Forget(name, own), true),
        }
    }

    /// What it knows of an online change.
    pub fn changing(&self) -> &Changing {
        &self.changing
    }

    /// Its configuration, and the one that it has loaded beside it.
    pub fn configurations(&self) -> Configurations {
        self.changing.configurations()
    }

    /// Reports the refusals that have ended by `now`.
    pub fn end_refusals(&mut self, now: Time) {
        while let Some(member) = self.reception.ended(now) {
            self.report(Event::from(Refusal::Ends { member }));
        }
    }

    /// A frame of this member.
    pub fn frame(&self, moment: Moment, alone: bool, body: Body) -> Frame {
        let Configurations { own, prepared } = self.changing.configurations();
        Frame {
            header: Header {
                cluster: self.agreement.cluster,
                configuration: own,
                prepared,
                moment,
                sender: self.own,
                alone,
            },
            body,
        }
    }

    /// Sends a frame.
    pub fn send(&mut self, moment: Moment, alone: bool, body: Body) -> Arc<Frame> {
        let frame = Arc::new(self.frame(moment, alone, body));
        self.put(Output::Send(Arc::clone(&frame)));
        frame
    }

    /// Reports an event.
    pub fn report(&mut self, event: Event) {
        self.put(Output::Report(event));
    }

    /// Appends an output.
    pub fn put(&mut self, output: Output<Event>) {
        self.outbox.push_back(output);
    }

    /// The oldest output that was not taken yet.
    pub fn poll_output(&mut self) -> Option<Output<Event>> {
        self.outbox.pop_front()
    }
}

/// A member that takes part in the cycle.
#[derive(Debug, Clone)]
pub struct Participant<Event> {
    endpoint: Endpoint<Event>,
    /// Its cycle and epoch.
    pub clock: CycleClock,
    /// Stations that it receives.
    pub attendance: Attendance,
    copies: Copies,
    waking: Waking,
    /// Since when more stations have one other configuration than have this one.
    outvoted_since: Option<Time>,
    outvoted: Option<Outvoted>,
}

impl<Event: From<Refusal> + From<Notice>> Participant<Event> {
    /// The member `own`, in no cycle yet and with all stations flagged.
    pub fn new(own: Member, agreement: &Arc<Agreement>) -> Self {
        Self {
            endpoint: Endpoint::new(own, agreement),
            clock: CycleClock::default(),
            attendance: Attendance::new(agreement.schedule.stations(), agreement.flag_after),
            copies: Copies::default(),
            waking: Waking::default(),
            outvoted_since: None,
            outvoted: None,
        }
    }

    /// What all members agree on.
    pub fn agreement(&self) -> &Agreement {
        &self.endpoint.agreement
    }

    /// The current cycle; the default before the first one.
    pub fn moment(&self) -> Moment {
        self.clock.moment().unwrap_or_default()
    }

    /// What it knows of an online change.
    pub fn changing(&self) -> &Changing {
        &self.endpoint.changing
    }

    /// Takes an order of an online change, as [`Changing::take`] does, and answers it.
    pub fn take_change(&mut self, now: Time, order: &ChangeOrder, may_forget: bool) {
        let before = self.changing().configurations();
        self.endpoint.take_change(now, order, may_forget);
        let configurations = self.changing().configurations();
        if configurations != before {
            self.report(Event::from(Notice::Configured(configurations)));
        }
    }

    /// As [`Endpoint::restore_change`]; reports with what it starts.
    ///
    /// # Errors
    /// As there.
    pub fn restore_change(
        &mut self,
        change: Arc<OnlineChange>,
        configurations: Configurations,
    ) -> Result<(), OrderRefusal> {
        self.endpoint.restore_change(change, configurations)?;
        self.report(Event::from(Notice::Configured(configurations)));
        Ok(())
    }

    /// As [`Endpoint::admits`].
    pub fn admits(&mut self, now: Time, header: &Header) -> bool {
        self.endpoint.admits(now, header)
    }

    /// The number of members of this cluster that are received and have another configuration.
    pub fn refused(&self) -> usize {
        self.endpoint.reception.refused()
    }

    /// The majority against this member, once it was reported.
    pub fn outvoted(&self) -> Option<Outvoted> {
        self.outvoted
    }

    /// Reports once that more stations with one other configuration than stations with this one were received for two seconds up to `now`.
    /// `stations` are those with this configuration; `is_new` says that this member does not take part yet: one that does is never outvoted, so
    /// that no member that starts with a wrong configuration can end one that works.
    pub fn count_votes(&mut self, now: Time, stations: usize, is_new: bool) {
        let most_common = self.endpoint.reception.most_common();
        let majority = most_common.filter(|(_, others)| is_new && *others > stations);
        let Some((theirs, others)) = majority else {
            self.outvoted_since = None;
            return;
        };
        let since = *self.outvoted_since.get_or_insert(now);
        if now.since(since) >= OUTVOTED_AFTER && self.outvoted.is_none() {
            let ours = self.changing().configurations().own;
            let (stations, others) = (stations as u32, others as u32);
            let outvoted = Outvoted { ours, theirs, stations, others };
            self.outvoted = Some(outvoted);
            self.report(Event::from(Notice::Outvoted(outvoted)));
        }
    }

    /// The cycle of a frame that comes at `now`; a frame that is not admitted is stale.
    pub fn arrival(&mut self, now: Time, frame: &Frame) -> Arrival {
        if !self.endpoint.admits(now, &frame.header) {
            return Arrival::Stale;
        }
        let period = self.agreement().schedule.period();
        self.clock.arrival(now, frame, period)
    }

    /// Ends the current cycle: reports the flags that change, and sends no more copies.
    pub fn close_cycle(&mut self) {
        let moment = self.moment();
        let endpoint = &mut self.endpoint;
        self.attendance.close_cycle(|change| {
            endpoint.report(Event::from(match change {
                Change::Flagged(station) => Notice::Flagged { moment, station },
                Change::Cleared(station) => Notice::Cleared { moment, station },
            }));
        });
        self.copies.clear();
    }

    /// Stations that published in this cycle.
    pub fn published(&self) -> StationSet {
        self.attendance.published()
    }

    /// Flagged stations: θ = 1.
    pub fn flagged(&self) -> StationSet {
        self.attendance.flagged()
    }

    /// A frame of the current cycle.
    pub fn frame(&self, body: Body) -> Frame {
        let alone = self.clock.alone();
        self.endpoint.frame(self.moment(), alone, body)
    }

    /// Sends a frame of the current cycle, once.
    pub fn send(&mut self, body: Body) -> Arc<Frame> {
        let (moment, alone) = (self.moment(), self.clock.alone());
        self.endpoint.send(moment, alone, body)
    }

    /// Sends a frame of the current cycle, with its copies.
    pub fn send_cyclic(&mut self, now: Time, body: Body) {
        let frame = self.send(body);
        let schedule = &self.endpoint.agreement.schedule;
        self.copies.sent(now, &frame, schedule);
    }

    /// Sends the copies that are due at `now`.
    pub fn send_copies(&mut self, now: Time) {
        let schedule = &self.endpoint.agreement.schedule;
        while let Some(frame) = self.copies.take_due(now, schedule) {
            self.endpoint.outbox.push_back(Output::Send(frame));
        }
    }

    /// Time of the next copy.
    pub fn copies_at(&self) -> Option<Time> {
        self.copies.wakeup()
    }

    /// Reports what has passed until an input at `now`: refusals that have ended, and that the host woke this member too late.
    pub fn note_time(&mut self, now: Time) {
        self.endpoint.end_refusals(now);
        if let Some(late) = self.waking.stall(now, &self.endpoint.agreement.schedule) {
            let moment = self.moment();
            self.report(Event::from(Notice::Stalled { moment, late }));
        }
    }

    /// Asks to be woken at `at`.
    pub fn wake_at(&mut self, at: Time) {
        self.waking.ask(at);
    }

    /// End of the turn window of the current cycle: the deadline of the remote I/Os.
    pub fn turn_window(&self) -> Time {
        self.clock.anchor() + self.endpoint.agreement.schedule.deadline()
    }

    /// Time at which it asked to be woken.
    pub fn wakeup(&self) -> Time {
        self.waking.asked()
    }

    /// Reports an event.
    pub fn report(&mut self, event: Event) {
        self.endpoint.report(event);
    }

    /// Appends an output.
    pub fn put(&mut self, output: Output<Event>) {
        self.endpoint.put(output);
    }

    /// The oldest output that was not taken yet.
    pub fn poll_output(&mut self) -> Option<Output<Event>> {
        self.endpoint.poll_output()
    }
}

/// Two participants of equal configurations that are drained and hash alike behave alike.
impl<Event> Hash for Participant<Event> {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        let Self {
            endpoint: Endpoint { own: _, agreement: _, changing, reception, outbox: _ },
            clock,
            attendance,
            copies,
            waking,
            outvoted_since,
            outvoted,
        } = self;
        (changing, reception, clock, attendance, copies, waking).hash(hasher);
        (outvoted_since, outvoted).hash(hasher);
    }
}
