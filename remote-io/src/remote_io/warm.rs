//! The start after a power failure: from what the stations and this remote I/O have kept on disk.
//!
//! ```text
//!   no living station holds a state, and a retained one is
//!     at or behind the newest applied sample, or of
//!     a later start of which nothing was applied ─ warm: the initial state with the retentive values
//!     before it, or it is not known ───────────── the state is lost: see `StaleState`
//!   no station has retained one, though outputs
//!     of the program were applied ─────────────── the state is lost
//! ```
//!
//! A retained state may be of the program before this one, where stations have taken over its values. The note of that program tells then whether
//! the state is behind what was applied; where values were dropped, the operator is asked in every case.
//!
//! The history of a warm start begins with a lineage that names the retained state, so a station that has this state follows
//! it without being asked, and any other one takes a state over as always.

use understudy_cycle::{Output, Restart};
use understudy_wire::{
    Configurations, Image, Kept, Lineage, Moment, Note, ProgramHash, Recalled, Retained,
    SamplesReceived, StationId, StationSet,
};

use super::recovery::Verdict;
use super::{Knowledge, RemoteIo};
use crate::event::{AskReason, Event, OldInputs};
use crate::history::History;

/// What a remote I/O notes on disk, and what it has found there.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub(super) struct Noting {
    is_on: bool,
    /// The number of the next note.
    number: u64,
    /// The newest note of an earlier life.
    found: Option<Note>,
    /// Whether there may have been another one, which cannot be read.
    is_damaged: bool,
    /// Of the newest sample, for the case that outputs of it are applied.
    next: Option<Note>,
    /// The newest note, of this life or of an earlier one.
    last: Option<Note>,
    /// Start of the history that is sampled, while no output of that is applied.
    begun: Option<Moment>,
}

impl Noting {
    /// Whether notes are made.
    pub(super) fn is_on(&self) -> bool {
        self.is_on
    }
}

impl RemoteIo {
    /// Notes the newest sample whose outputs it applies ([`Output::Retain`]); `found` is what it has noted before it was started, where that can be
    /// read, and `is_damaged` tells where it cannot, and values that were kept may be lost without it.
    #[must_use]
    pub fn noting(mut self, found: Option<Note>, is_damaged: bool) -> Self {
        let number = found.as_ref().map_or(0, |note| note.number.saturating_add(1));
        let cluster = self.settings.agreement.cluster;
        let found = found.filter(|note| {
            note.cluster == cluster && note.recalled.program == self.settings.program
        });
        let fits = |note: &Note| self.has_width(&note.recalled.inputs, Some(note.hash));
        let found = found.filter(|note| !self.is_loaded(note.hash) || fits(note));
        // The device was driven by its points until then.
        if let Some(hash) = found.as_ref().map(|note| note.hash)
            && self.is_loaded(hash)
        {
            self.lay_out(hash);
        }
        let last = found.clone();
        self.noting =
            Noting { is_on: true, number, found, is_damaged, next: None, last, begun: None };
        self
    }

    /// What it noted of this program before it was started.
    fn noted(&self) -> Option<&Note> {
        self.noting.found.as_ref().filter(|note| self.is_loaded(note.hash))
    }

    fn noted_of(&self, program: ProgramHash) -> Option<&Note> {
        self.noting.found.as_ref().filter(|note| note.hash == program)
    }

    /// The newest applied output of the program before this one, of an earlier life.
    pub(super) fn applied_of_another(&self) -> Option<Moment> {
        let found = self.noting.found.as_ref().filter(|note| !self.is_loaded(note.hash));
        found.and_then(Note::applied)
    }

    /// Start of the history that was begun last, where no output of it was applied: no state of it is behind the plant. Of an earlier life, the
    /// other one of two remote I/Os may have applied some.
    fn begun(&self) -> Option<Moment> {
        let is_alone = self.arbiter.knowledge.floor().is_none() && self.pairing.is_none();
        let found = self.noting.found.as_ref().filter(|_| is_alone);
        self.noting.begun.or_else(|| found?.begun)
    }

    /// It samples a history that begins, or continues one from the state of a station.
    pub(super) fn note_begin(&mut self, begun: Option<Moment>) {
        self.noting.begun = begun.filter(|_| self.noting.is_on);
    }

    /// The newest applied output of a program, and the lineage after its sample.
    fn newest_applied_of(&self, program: ProgramHash) -> Option<(Moment, Lineage)> {
        match self.arbiter.knowledge.floor() {
            Some(floor) if self.is_loaded(program) => Some((floor.moment, floor.lineage)),
            // Outputs of this program were applied since those of any other one.
            Some(_) => None,
            None => {
                let note = self.noted_of(program)?;
                Some((note.applied()?, note.lineage))
            }
        }
    }

    /// The cycle of the newest applied output, of an earlier life too.
    pub(super) fn newest_applied(&self) -> Option<Moment> {
        let floor = self.arbiter.knowledge.floor().map(|floor| floor.moment);
        let paired = self.pairing.as_ref().and_then(|pairing| pairing.applied());
        floor.max(self.noted().and_then(Note::applied)).max(paired)
    }

    /// The newest applied output whose state a cold start loses. A program that retains nothing loses nothing with the power of the whole plant.
    pub(super) fn lost_by_cold_start(&self) -> Option<Moment> {
        let floor = self.arbiter.knowledge.floor().map(|floor| floor.moment);
        // Where a cold start is configured, it is what was asked for.
        let keeps = self.settings.fallback.restart.is_some_and(|restart| restart != Restart::Cold);
        floor.or(self.newest_applied().filter(|_| keeps))
    }

    /// Whether it ran another configuration before it was started.
    pub(super) fn has_another_configuration(&self) -> bool {
        let Configurations { own, prepared } = self.member.changing().configurations();
        let found = self.noting.found.as_ref();
        self.arbiter.knowledge.floor().is_none()
            && found.is_some_and(|note| {
                note.configuration != own && prepared != Some(note.configuration)
            })
    }

    /// Prepares the note of a sample.
    pub(super) fn prepare_note(&mut self, moment: Moment, after: Lineage, inputs: Image) {
        let agreement = &self.settings.agreement;
        self.noting.next = Some(Note {
            cluster: agreement.cluster,
            configuration: self.member.changing().configurations().own,
            hash: self.running().unwrap_or(self.hash()),
            is_retentive: self.settings.fallback.restart.is_some(),
            number: self.noting.number,
            lineage: after,
            begun: None,
            recalled: Recalled {
                program: self.settings.program,
                sampled: moment,
                received: SamplesReceived::Later,
                applied: Some(moment),
                excluded: self.arbiter.trust.excluded(),
                accounted_for: StationSet::EMPTY,
                writes: self.inputs.writing.ids(),
                pulses: self.inputs.writing.pulses(&self.layout.operator_inputs),
                inputs,
                version: self.named(Some(self.laid_out)),
            },
        });
    }

    /// Outputs of the sample of `moment` are applied.
    pub(super) fn note_applied(&mut self, moment: Moment) {
        self.noting.begun = None;
        if let Some(note) = self.sampled_note(moment) {
            self.keep_note(note);
        }
    }

    /// No output of the sample of `moment` is applied. That is noted while none of its history was: what stations keep of such a history is not
    /// behind the plant, although they keep it after the newest applied output.
    pub(super) fn note_not_applied(&mut self, moment: Moment) {
        let Some(begun) = self.noting.begun else {
            return;
        };
        let Some(sampled) = self.sampled_note(moment) else {
            return;
        };
        let number = sampled.number;
        let last = self.noting.last.as_ref();
        let note = match last {
            // Nothing was ever applied.
            None => {
                let recalled = Recalled { applied: None, ..sampled.recalled };
                Note { begun: Some(begun), recalled, ..sampled }
            }
            Some(last)
                if last.hash == sampled.hash && last.configuration == sampled.configuration =>
            {
                let excluded = last.recalled.excluded.or(sampled.recalled.excluded);
                let applied = last.applied();
                let recalled = Recalled { applied, excluded, ..sampled.recalled };
                Note { number, begun: Some(begun), recalled, ..last.clone() }
            }
            // Inputs and numbers of stations are those of the program and the configuration before.
            Some(last) => Note { number, begun: Some(begun), ..last.clone() },
        };
        self.keep_note(note);
    }

    /// The prepared note, where it is of this sample.
    fn sampled_note(&mut self, moment: Moment) -> Option<Note> {
        self.noting.next.take().filter(|note| note.recalled.sampled == moment)
    }

    fn keep_note(&mut self, note: Note) {
        self.noting.number = note.number.saturating_add(1);
        self.noting.last = Some(note.clone());
        self.member.put(Output::Retain(Box::new(Retained::Note(note))));
    }

    /// The newest retained state, but for those of stations that were excluded, with its station.
    pub(super) fn newest_retained(&self) -> Option<(StationId, &Kept)> {
        let applied = self.newest_applied().or_else(|| self.applied_of_another());
        let epoch = self.begun().or(applied).map(|moment| moment.epoch);
        self.arbiter.holders.newest_retained(self.noted_exclusions(), epoch)
    }

    /// Stations that were excluded when the power failed. In another configuration, their numbers may be those of other stations.
    fn noted_exclusions(&self) -> StationSet {
        let found = self.noting.found.as_ref().filter(|_| !self.has_unknown_exclusions());
        found.map_or(StationSet::EMPTY, |note| note.recalled.excluded)
    }

    /// Whether stations were excluded in another configuration: what they have kept is not told from what others have.
    fn has_unknown_exclusions(&self) -> bool {
        let configuration = self.settings.agreement.configuration;
        let found = self.noting.found.as_ref().filter(|note| note.configuration != configuration);
        found.is_some_and(|note| !note.recalled.excluded.is_empty())
    }

    /// What the retained states of the stations allow, where no living station holds a state.
    pub(super) fn warm_verdict(&self) -> Verdict {
        let Some(restart) = self.settings.fallback.restart else {
            // What the program before has kept is not given up without a question.
            let was_retentive = self.noting.found.as_ref().is_some_and(|note| note.is_retentive);
            let may_lose = self.noting.is_damaged || was_retentive;
            return if may_lose { Verdict::Lost } else { Verdict::Cold };
        };
        let excluded = self.noted_exclusions();
        let retained = self.newest_retained();
        // What this program or the one before it has left behind may be with a station that comes later.
        let is_awaited = self.newest_applied().is_some()
            || self.noting.found.as_ref().is_some_and(|note| note.is_retentive);
        match (restart, retained) {
            (Restart::Cold, _) => Verdict::Cold,
            (_, None) if is_awaited || self.noting.is_damaged => Verdict::Lost,
            (_, None) => Verdict::Cold,
            (Restart::Operator, Some((from, kept))) => Verdict::Stale(from, kept.holding),
            (Restart::Warm, Some((from, kept))) => {
                match self.arbiter.holders.disputed_retained(excluded, kept) {
                    _ if self.is_before_applied(kept) => Verdict::Stale(from, kept.holding),
                    Some(stations) if !self.is_newest_applied(kept) => Verdict::Disputed(stations),
                    _ => Verdict::Warm(from, *kept),
                }
            }
        }
    }

    /// Why the program does not go on by itself from the newest state that stations hold or have kept.
    pub(super) fn reason_to_ask(&self) -> AskReason {
        let retained = self.newest_retained().filter(|_| self.arbiter.holders.newest().is_none());
        match (retained, self.settings.fallback.restart) {
            (Some((_, kept)), _) if !kept.is_whole => AskReason::NotWhole,
            (Some((_, kept)), Some(Restart::Operator)) if !self.is_before_applied(kept) => {
                AskReason::Configured
            }
            _ => AskReason::Doubt,
        }
    }

    /// Whether a state is that after the newest applied sample.
    fn is_newest_applied(&self, kept: &Kept) -> bool {
        let applied = self.newest_applied_of(kept.of);
        applied.is_some_and(|(_, lineage)| lineage == kept.holding.lineage)
    }

    /// Whether outputs of a newer state may have been applied, or values are not in it that were kept. Moments of two epochs have no order here: the
    /// one that is founded after a power failure is earlier where the wall clock was set back.
    fn is_before_applied(&self, kept: &Kept) -> bool {
        let state = &kept.holding;
        // Without a note of its program, it is not known what was applied.
        let is_known = kept.is_whole && !self.has_unknown_exclusions();
        let recalled = self.arbiter.holders.newest_recalled();
        if !is_known || recalled.is_some_and(|recalled| recalled > state.stepped) {
            return true;
        }
        if self.begun() == Some(state.born) {
            return false;
        }
        let Some((applied, _)) = self.newest_applied_of(kept.of) else {
            return true;
        };
        let (newest, stepped) = (applied.cycle, state.stepped.cycle);
        applied.epoch != state.stepped.epoch
            || stepped < newest
            || stepped == newest && !self.is_newest_applied(kept)
    }

    /// Starts to sample from the initial state with the retentive values of a retained one.
    pub(super) fn start_warm(&mut self, moment: Moment, (from, kept): (StationId, Kept)) {
        let awaits_release = self.become_started();
        let applied = self.newest_applied_of(kept.of).map(|(applied, _)| applied);
        let stepped = kept.holding.stepped;
        let lost = applied.filter(|applied| applied.epoch == stepped.epoch);
        let lost = lost.map(|applied| applied.cycle.0.saturating_sub(stepped.cycle.0));
        let lost = if self.begun() == Some(kept.holding.born) { Some(0) } else { lost };
        let inputs = self.old_inputs(stepped);
        self.report(Event::StartedWarm {
            born: moment,
            from,
            retained: stepped,
            lost,
            inputs,
            awaits_release,
        });
        // A station has taken over the values of any other program into that of its configuration.
        let program = if self.is_loaded(kept.of) { kept.of } else { self.hash() };
        let start = Lineage::warm(program, moment, kept.holding.lineage);
        let capacity = self.settings.agreement.history;
        let history = History::from(moment, (Some(program), start), capacity);
        self.sample_from(moment, history, None);
    }

    /// What retained operator inputs have after a start from a state that was stepped with the sample of `stepped`, where that may be another value than in
    /// that sample: this remote I/O takes their values from its newest note. The sample after the note was not applied as far as that tells, so no write
    /// was answered that is in it.
    pub(super) fn old_inputs(&self, stepped: Moment) -> Option<OldInputs> {
        let retains = self.layout.operator_inputs.iter().any(|input| input.retains);
        if !retains || !self.is_first_start() {
            return None;
        }
        let sampled = self.usable_note().map(|(note, _)| note.recalled.sampled);
        match sampled {
            None => Some(OldInputs::Initial),
            Some(sampled) => {
                let is_of_it =
                    sampled.epoch == stepped.epoch && sampled.cycle.0 + 1 >= stepped.cycle.0;
                (!is_of_it).then_some(OldInputs::Of(sampled))
            }
        }
    }

    /// Whether no history has been sampled in this life: the operator inputs have no values yet.
    pub(super) fn is_first_start(&self) -> bool {
        matches!(self.arbiter.knowledge, Knowledge::Listening { .. })
    }

    /// The newest note that has the inputs of its program, with the version of the program whose points these are, where a change replaces them.
    fn usable_note(&self) -> Option<(&Note, Option<ProgramHash>)> {
        let note = self.noting.last.as_ref()?;
        // Values of another program were taken over to the points of a version that is loaded.
        let version = match self.is_loaded(note.hash) {
            true => Some(note.hash),
            false => note.recalled.version,
        };
        let version = self.named(version);
        let is_known = version.is_some() || !self.replaces_points();
        (is_known && self.has_width(&note.recalled.inputs, version)).then_some((note, version))
    }

    /// At the first start of this life, warm or cold: takes up the operator inputs that keep their values over a power failure, and the writes that
    /// were in effect.
    pub(super) fn take_up_writes(&mut self) {
        let noted = self.usable_note().map(|(note, version)| {
            self.recalled_by_these_points(Recalled { version, ..note.recalled.clone() })
        });
        if let Some(recalled) = noted {
            self.inputs.writing.start(&self.layout.operator_inputs, &recalled);
        }
    }
}
