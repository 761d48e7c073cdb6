//! Who may authorise outputs: what is known of the history, what the operator is asked, who releases proven outputs, and which stations are believed.
//!
//! All transitions are here, the functions `become_…`, and each reports its event or says who does. The states and what leads from one to the other are
//! drawn in `docs/pictures/remote-io.dot`.

use understudy_cycle::Release;
use understudy_wire::{Moment, StationId, StationSet, Time};

use super::RemoteIo;
use super::knowledge::{Floor, Knowledge};
use crate::event::Event;
use crate::history::History;
use crate::holders::Holders;
use crate::trust::Trust;

/// The knowledge of a remote I/O, and what it makes of it.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct Arbiter {
    pub(super) holders: Holders,
    pub(super) knowledge: Knowledge,
    /// What the operator is asked.
    pub(super) question: Option<Question>,
    pub(super) authority: Authority,
    pub(super) trust: Trust,
    /// When a cycle was counted last in which the history was looked for.
    pub(super) looked: Time,
}

/// Who authorises the outputs that are proven.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Authority {
    /// The proof itself: they are applied.
    Proof,
    /// The operator: they are withheld until the release, after a start or a value fault.
    Operator,
}

/// What the operator is asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Question {
    /// Which of several states of one cycle the program continues from.
    Disputed,
    /// Whether the program continues from a stale state, or cold.
    StateLost {
        /// The newest one, as it was reported.
        told: Option<Moment>,
        /// The newest one in the last cycle.
        newest: Option<Moment>,
    },
    /// Whether the program starts cold, although members of the cluster have another configuration.
    ConfigurationDisputed,
}

impl Arbiter {
    /// It has just started: it knows nothing, asks nothing, and believes every station.
    pub(super) fn new(now: Time, holders: Holders) -> Self {
        Self {
            holders,
            knowledge: Knowledge::default(),
            question: None,
            authority: Authority::Proof,
            trust: Trust::default(),
            looked: now,
        }
    }

    /// Proven outputs are applied by themselves, or wait for a release: as the state that it continues from was released or not.
    pub(super) fn become_authorised(&mut self, by_proof: bool) {
        self.authority = if by_proof { Authority::Proof } else { Authority::Operator };
    }

    /// Whether the operator has something to release.
    pub(super) fn awaits_release(&self) -> bool {
        self.authority == Authority::Operator || !self.trust.is_complete()
    }
}

impl RemoteIo {
    /// It asks the operator, and reports that with `event`, once for each question.
    pub(super) fn become_asking(&mut self, question: Question, event: Event) {
        if self.arbiter.question.replace(question) != Some(question) {
            self.report(event);
        }
    }

    /// What it asks needs no answer any more: the state is there again, at the station `from`, or where the other remote I/O of the program has it.
    pub(super) fn become_answered(&mut self, from: Option<StationId>) {
        if self.arbiter.question.take().is_some() {
            let moment = self.moment();
            self.report(Event::StateRecovered { moment, from });
        }
    }

    /// The program starts anew, cold or warm: proven outputs wait for a release where the settings say so, and those of before are not held. Whether they
    /// wait; the event of the start says so.
    pub(super) fn become_started(&mut self) -> bool {
        let awaits_release = self.settings.fallback.release == Release::Operator;
        self.arbiter.become_authorised(!awaits_release);
        self.actuation.forget_proved();
        awaits_release
    }

    /// Stations have proved different outputs, and none is known to be right: the operator has to release them. The event of the value fault says so.
    pub(super) fn become_doubtful(&mut self) {
        self.arbiter.authority = Authority::Operator;
        self.actuation.forget_proved();
    }

    /// The operator releases the outputs, and all stations that were excluded.
    pub(super) fn become_released(&mut self) {
        self.arbiter.knowledge.pardon();
        if self.arbiter.awaits_release() {
            self.arbiter.authority = Authority::Proof;
            self.arbiter.trust.release();
            self.report(Event::Released { moment: self.moment() });
        }
    }

    /// These stations were found faulty before this remote I/O was restarted, as the others recall.
    pub(super) fn become_distrustful(&mut self, moment: Moment, stations: StationSet) {
        self.arbiter.trust = Trust::excluding(stations);
        self.report(Event::RecalledExclusion { moment, stations });
    }

    /// It samples a history from now on, from an adopted state or cold: the event of the start says so, and ends every question.
    pub(super) fn become_running(&mut self, history: History, adopted: Option<Floor>) {
        self.arbiter.question = None;
        self.arbiter.knowledge.start(history, adopted);
    }

    /// The other remote I/O has the program from now on: this one knows no more than when it started.
    pub(super) fn become_listening(&mut self) {
        self.become_answered(None);
        self.arbiter.knowledge = Knowledge::default();
        self.arbiter.trust = Trust::default();
    }
}
