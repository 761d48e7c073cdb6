//! The start after a power failure: from what the stations and this remote I/O have kept on disk.
//!
//! ```text
//!   no living station holds a state, and a retained one is
//!     at or behind the newest applied sample ──── warm: the initial state with the retentive values
//!     before it, or it is not known ───────────── the state is lost: see `StaleState`
//!   no station has retained one, though outputs
//!     of the program were applied ─────────────── the state is lost
//! ```
//!
//! The history of a warm start begins with a lineage that names the retained state, so a station that has this state follows
//! it without being asked, and any other one takes a state over as always.

use understudy_cycle::Output;
use understudy_wire::{
    Holding, Image, Lineage, Moment, Note, Recalled, Retained, SamplesReceived, StationId,
    StationSet,
};

use super::recovery::Verdict;
use super::{Authority, RemoteIo};
use crate::event::Event;
use crate::history::History;
use crate::settings::{Release, Restart};

/// What a remote I/O notes on disk, and what it has found there.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub(super) struct Noting {
    is_on: bool,
    /// The number of the next note.
    number: u64,
    /// The newest note of an earlier life.
    found: Option<Note>,
    /// Whether there was one that cannot be read.
    is_damaged: bool,
    /// Of the newest sample, for the case that outputs of it are applied.
    next: Option<Note>,
}

impl Noting {
    /// Whether notes are made.
    pub(super) fn is_on(&self) -> bool {
        self.is_on
    }
}

impl RemoteIo {
    /// Notes the newest sample whose outputs it applies ([`Output::Retain`]); `found` is what it has noted before it was started, where that can be
    /// read, and `is_damaged` tells where it cannot.
    #[must_use]
    pub fn noting(mut self, found: Option<Note>, is_damaged: bool) -> Self {
        let number = found.as_ref().map_or(0, |note| note.number.saturating_add(1));
        let cluster = self.settings.agreement.cluster;
        let width = self.settings.undriven.width();
        let found = found.filter(|note| {
            note.cluster == cluster && note.recalled.program == self.settings.program
        });
        let fits = |note: &Note| note.recalled.inputs.width() == width;
        let found = found.filter(|note| note.hash != self.settings.hash || fits(note));
        self.noting = Noting { is_on: true, number, found, is_damaged, next: None };
        self
    }

    /// What it noted of this program before it was started.
    fn noted(&self) -> Option<&Note> {
        self.noting.found.as_ref().filter(|note| note.hash == self.settings.hash)
    }

    /// The cycle of the newest applied output, of an earlier life too.
    pub(super) fn newest_applied(&self) -> Option<Moment> {
        let floor = self.knowledge.floor().map(|floor| floor.moment);
        floor.max(self.noted().map(Note::applied))
    }

    /// The newest applied output whose state a cold start loses. A program that retains nothing loses nothing with the power of the whole plant.
    pub(super) fn lost_by_cold_start(&self) -> Option<Moment> {
        let floor = self.knowledge.floor().map(|floor| floor.moment);
        // Where a cold start is configured, it is what was asked for.
        let keeps = self.settings.restart.is_some_and(|restart| restart != Restart::Cold);
        floor.or(self.newest_applied().filter(|_| keeps))
    }

    /// Whether it ran another configuration before it was started.
    pub(super) fn has_another_configuration(&self) -> bool {
        let configuration = self.settings.agreement.configuration;
        let found = self.noting.found.as_ref();
        self.knowledge.floor().is_none()
            && found.is_some_and(|note| note.configuration != configuration)
    }

    /// Prepares the note of a sample.
    pub(super) fn prepare_note(&mut self, moment: Moment, after: Lineage, inputs: Image) {
        let agreement = &self.settings.agreement;
        self.noting.next = Some(Note {
            cluster: agreement.cluster,
            configuration: agreement.configuration,
            hash: self.settings.hash,
            number: self.noting.number,
            lineage: after,
            recalled: Recalled {
                program: self.settings.program,
                sampled: moment,
                received: SamplesReceived::Later,
                applied: Some(moment),
                excluded: self.trust.excluded(),
                accounted_for: StationSet::EMPTY,
                writes: self.writing.ids(),
                pulses: self.writing.pulses(&self.settings.operator_inputs),
                inputs,
            },
        });
    }

    /// Outputs of the sample of `moment` are applied.
    pub(super) fn note_applied(&mut self, moment: Moment) {
        if let Some(note) = self.noting.next.take().filter(|note| note.applied() == moment) {
            self.noting.number += 1;
            self.member.put(Output::Retain(Retained::Note(note)));
        }
    }

    /// The newest retained state, but for those of stations that were excluded, with its station.
    pub(super) fn newest_retained(&self) -> Option<(StationId, &Holding)> {
        let epoch = self.newest_applied().map(|applied| applied.epoch);
        self.holders.newest_retained(self.noted_exclusions(), epoch)
    }

    fn noted_exclusions(&self) -> StationSet {
        self.noted().map_or(StationSet::EMPTY, |note| note.recalled.excluded)
    }

    /// What the retained states of the stations allow, where no living station holds a state.
    pub(super) fn warm_verdict(&self) -> Verdict {
        let Some(restart) = self.settings.restart else {
            return Verdict::Cold;
        };
        let excluded = self.noted_exclusions();
        let retained = self.newest_retained();
        match (restart, retained) {
            (Restart::Cold, _) => Verdict::Cold,
            (_, None) if self.newest_applied().is_some() || self.noting.is_damaged => Verdict::Lost,
            (_, None) => Verdict::Cold,
            (Restart::Operator, Some((from, retained))) => Verdict::Stale(from, *retained),
            (Restart::Warm, Some((from, retained))) => {
                match self.holders.disputed_retained(excluded, retained) {
                    _ if self.is_before_applied(retained) => Verdict::Stale(from, *retained),
                    Some(stations) if !self.is_newest_applied(retained) => {
                        Verdict::Disputed(stations)
                    }
                    _ => Verdict::Warm(from, *retained),
                }
            }
        }
    }

    /// Whether a state is that after the newest applied sample.
    fn is_newest_applied(&self, state: &Holding) -> bool {
        let floor = self.knowledge.floor().map(|floor| floor.lineage);
        floor.or(self.noted().map(|note| note.lineage)) == Some(state.lineage)
    }

    /// Whether outputs of a newer state may have been applied. Moments of two epochs have no order here: the one that is founded after a power failure
    /// is earlier where the wall clock was set back.
    fn is_before_applied(&self, state: &Holding) -> bool {
        // Without a note of this program, it is not known what was applied.
        let Some(applied) = self.newest_applied() else {
            return true;
        };
        if self.holders.newest_recalled().is_some_and(|recalled| recalled > state.stepped) {
            return true;
        }
        let (newest, stepped) = (applied.cycle, state.stepped.cycle);
        applied.epoch != state.stepped.epoch
            || stepped < newest
            || stepped == newest && !self.is_newest_applied(state)
    }

    /// Starts to sample from the initial state with the retentive values of a retained one.
    pub(super) fn start_warm(&mut self, moment: Moment, (from, retained): (StationId, Holding)) {
        let awaits_release = self.settings.release == Release::Operator;
        self.authority = if awaits_release { Authority::Operator } else { Authority::Proof };
        self.last_true = None;
        let applied = self.newest_applied();
        let stepped = retained.stepped;
        let lost = applied.filter(|applied| applied.epoch == stepped.epoch);
        let lost = lost.map(|applied| applied.cycle.0.saturating_sub(stepped.cycle.0));
        self.report(Event::StartedWarm {
            born: moment,
            from,
            retained: stepped,
            lost,
            awaits_release,
        });
        let start = Lineage::warm(self.settings.hash, moment, retained.lineage);
        let history = History::from(moment, start, self.settings.agreement.history);
        let note = self.noted().cloned();
        self.sample_from(moment, history, None);
        if let Some(note) = note {
            self.writing.start_warm(&self.settings.operator_inputs, &note.recalled);
        }
    }
}
