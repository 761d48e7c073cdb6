//! What the model knows of one cycle: who published for what, which station was received by whom, and what followed from it.
//!
//! The newest complete cycle is the present. It is shown with what was done to the processes and links of members since, and with no later report of a
//! member: what is shown of a cycle stays true when the lines of all members are there.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use understudy_journal::is_blocked;
use understudy_remote_io::Missing;
use understudy_wire::{Member, Moment, ProgramId, ProgramSet, StationId, StationSet, Word};

use super::Model;
use super::standing::Standing;
use crate::history::Step;
use crate::margin::{Holders, Margin};
use crate::station::StationState;

/// Cycles of which the received stations are kept next to the histories, besides those that may not be complete.
const RECENT: usize = 64;

/// The stations that were received in the newest cycles, by any remote I/O.
#[derive(Debug, Clone)]
pub(super) struct Received {
    cycles: BTreeMap<i64, StationSet>,
    most: usize,
}

impl Received {
    /// Of so many cycles that may not be complete.
    pub(super) fn new(incomplete: usize) -> Self {
        Self { cycles: BTreeMap::new(), most: incomplete.saturating_add(RECENT) }
    }

    /// The first cycle from `from` on in which a station was received.
    pub(super) fn first_of(&self, station: StationId, from: i64) -> Option<i64> {
        let mut cycles = self.cycles.range(from..);
        cycles.find(|(_, received)| received.contains(station)).map(|(cycle, _)| *cycle)
    }

    pub(super) fn note(&mut self, cycle: i64, heard: StationSet) {
        let received = self.cycles.entry(cycle).or_insert(StationSet::EMPTY);
        *received = received.or(heard);
        if self.cycles.len() > self.most {
            self.cycles.pop_first();
        }
    }

    fn at(&self, cycle: i64) -> Option<StationSet> {
        let oldest = *self.cycles.first_key_value()?.0;
        let received = self.cycles.get(&cycle).copied();
        received.or((oldest <= cycle).then_some(StationSet::EMPTY))
    }

    pub(super) fn shift(&mut self, by: i64) {
        let cycles = std::mem::take(&mut self.cycles).into_iter();
        self.cycles =
            cycles.map(|(cycle, received)| (cycle.saturating_add(by), received)).collect();
    }
}

/// The remaining redundancy that was calculated last: it changes only when a member comes or goes.
#[derive(Debug, Default)]
pub(super) struct LastMargin(Mutex<Option<(Holders, Arc<Margin>)>>);

impl Clone for LastMargin {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl LastMargin {
    fn of(&self, holders: Holders) -> Arc<Margin> {
        let mut last = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((of, margin)) = last.as_ref()
            && *of == holders
        {
            return Arc::clone(margin);
        }
        let margin = Arc::new(holders.margin());
        *last = Some((holders, Arc::clone(&margin)));
        margin
    }
}

impl Model {
    /// Ids of the programs.
    pub fn program_ids(&self) -> impl Iterator<Item = ProgramId> + use<> {
        (0..self.programs.len()).map(|index| ProgramId(index as u8))
    }

    /// Ids of the stations, by rank.
    pub fn station_ids(&self) -> impl Iterator<Item = StationId> + use<> {
        (0..self.cluster.agreement().schedule.stations()).map(|rank| StationId(rank as u8))
    }

    /// The newest complete cycle: every member that reports has reported it.
    pub fn newest(&self) -> Option<i64> {
        self.reports.complete()
    }

    /// Cycles after the newest complete one of which a part is known already.
    pub fn behind(&self) -> u64 {
        let ahead = self.reports.furthest().zip(self.newest());
        ahead.map_or(0, |(furthest, newest)| u64::try_from(furthest - newest).unwrap_or(0))
    }

    /// The oldest cycle that is remembered; cycles before the origin are not shown.
    pub fn oldest(&self) -> Option<i64> {
        let oldest =
            self.histories.iter().filter_map(|history| Some(history.steps().front()?.cycle));
        // Without a remote I/O there is the present alone.
        Some(oldest.max().or_else(|| self.newest())?.max(0))
    }

    /// The standing in a cycle, for the newest with what was done to the members since.
    pub(crate) fn standing(&self, cycle: i64) -> Cow<'_, Standing> {
        match self.newest() {
            Some(newest) if cycle < newest => self.changes.at(cycle),
            Some(newest) if !self.finished => self.changes.present(newest),
            _ => Cow::Borrowed(self.changes.now()),
        }
    }

    /// Whether signals of other programs were valid in the sample of a cycle, by the first bit of their inputs; those that the remote I/O has
    /// reported. Later reports are not part of it, also not of the newest cycle.
    pub(crate) fn validity(&self, program: ProgramId, cycle: i64) -> BTreeMap<u16, bool> {
        let remote_io = self.cluster.remote_ios().get(program.index());
        if remote_io.is_none_or(|remote_io| remote_io.signals().next().is_none()) {
            return BTreeMap::new();
        }
        let standing = self.changes.at(cycle);
        let own = standing.program(program);
        own.map_or_else(BTreeMap::new, |own| own.validity.clone())
    }

    /// The stations that any remote I/O received in a cycle.
    pub(crate) fn received(&self, cycle: i64) -> StationSet {
        self.received.at(cycle).unwrap_or_else(|| {
            let heard = self.program_ids().filter_map(|program| {
                let step = self.deadline(program, cycle)?;
                Some(step.driven.as_ref()?.heard)
            });
            heard.fold(StationSet::EMPTY, StationSet::or)
        })
    }

    /// The step of a program in a cycle, where its deadline was reported.
    pub(crate) fn deadline(&self, program: ProgramId, cycle: i64) -> Option<&Step> {
        let step = self.history(program)?.at(cycle)?;
        step.driven.is_some().then_some(step)
    }

    /// Cycles since the last deadline that a remote I/O has reported, where it does not report any more.
    pub(crate) fn silent_cycles(
        &self,
        standing: &Standing,
        program: ProgramId,
        cycle: Option<i64>,
    ) -> Option<u64> {
        let cycle = cycle.filter(|_| !standing.reports(Member::RemoteIo(program)))?;
        let mut steps = self.history(program)?.steps().iter().rev();
        let last = steps.find(|step| step.driven.is_some() && step.cycle <= cycle);
        // Where the journal was not read from its first record, the deadlines before are counted.
        let counted = self.programs.get(program.index())?.tally.deadlines();
        let counted = counted.map(|deadlines| deadlines.until - 1).filter(|last| *last <= cycle);
        let last = last.map(|step| step.cycle).or(counted)?;
        u64::try_from(cycle - last).ok()
    }

    /// The state of a station in a cycle.
    pub(crate) fn station_state_in(
        &self,
        standing: &Standing,
        station: StationId,
        cycle: Option<i64>,
    ) -> StationState {
        let received = cycle.is_some_and(|cycle| self.received(cycle).contains(station));
        let own = standing.station(station).cloned().unwrap_or_default();
        own.state(standing.process(Member::Station(station)), received)
    }

    /// The moments that a cycle has at the remote I/Os, the newest first. A deadline without a cycle has the moment of the last one.
    fn moments(&self, cycle: i64) -> Vec<Moment> {
        let steps = self.program_ids().filter_map(|program| self.history(program)?.at(cycle));
        let mut moments: Vec<Moment> =
            steps.filter(|step| has_begun(step)).map(|step| step.moment).collect();
        moments.sort_by(|one, other| other.cmp(one));
        moments.dedup();
        moments
    }

    /// The parity words that a station sent in a cycle.
    pub(crate) fn words(&self, station: StationId, cycle: i64) -> impl Iterator<Item = &Word> {
        let mut turns = self.moments(cycle).into_iter().filter_map(move |moment| {
            let mut turns = self.sent_turns(moment).iter();
            turns.find(|turn| turn.station == station)
        });
        turns.next().into_iter().flat_map(|turn| turn.words.iter())
    }

    /// The programs that a station published for in a cycle, or in the one before it: a single frame may be lost.
    pub(crate) fn covers(&self, station: StationId, cycle: i64) -> ProgramSet {
        let of = |cycle| {
            let masks = self.words(station, cycle).map(|word| word.mask);
            masks.fold(ProgramSet::EMPTY, ProgramSet::or)
        };
        let own = of(cycle);
        if own.is_empty() { of(cycle.saturating_sub(1)) } else { own }
    }

    /// The station that starts the cycles: the first by rank that has started some, and publishes.
    pub(crate) fn cycle_master(&self, standing: &Standing, cycle: i64) -> Option<StationId> {
        standing.cycle_masters().find(|&station| {
            let state = self.station_state_in(standing, station, Some(cycle));
            let member = Member::Station(station);
            state == StationState::Publishing && !self.is_isolated(standing, member)
        })
    }

    /// Whether no member receives the frames of this one.
    pub(crate) fn is_isolated(&self, standing: &Standing, member: Member) -> bool {
        let stations = self.station_ids().count();
        // Remote I/Os send nothing to each other.
        let others = match member {
            Member::Station(_) => stations - 1 + self.programs.len(),
            _ => stations,
        };
        standing.cut_from(member).count() >= others
    }

    /// The members that are alive, and the states that they hold: input of the remaining redundancy.
    pub fn holders(&self) -> Holders {
        let cycle = self.newest().unwrap_or(0);
        self.holders_in(&self.standing(cycle), cycle)
    }

    pub(crate) fn margin_in(&self, standing: &Standing, cycle: i64) -> Arc<Margin> {
        self.last_margin.of(self.holders_in(standing, cycle))
    }

    fn holders_in(&self, standing: &Standing, cycle: i64) -> Holders {
        let heard: Vec<StationSet> = self
            .program_ids()
            .map(|program| {
                let cycles = [cycle.saturating_sub(1), cycle];
                let deadlines = cycles.map(|cycle| self.deadline(program, cycle));
                let driven = deadlines.into_iter().flatten();
                let heard = driven.filter_map(|step| Some(step.driven.as_ref()?.heard));
                heard.fold(StationSet::EMPTY, StationSet::or)
            })
            .collect();
        let received = heard.iter().fold(StationSet::EMPTY, |all, heard| all.or(*heard));
        let holds = self.station_ids().map(|station| {
            let process = standing.process(Member::Station(station));
            if received.contains(station) && process.is_none_or(|process| process.is_running()) {
                let excluded = standing.excluded_from(station);
                self.covers(station, cycle).without(excluded)
            } else {
                ProgramSet::EMPTY
            }
        });
        let excluded = self
            .program_ids()
            .map(|program| standing.program(program).map_or(StationSet::EMPTY, |own| own.excluded));
        let blocked =
            self.program_ids().filter(|&program| self.is_blocked(standing, program, cycle));
        Holders {
            mode: self.cluster.agreement().mode,
            widths: self
                .program_ids()
                .zip(self.cluster.controllers())
                .map(|(program, first)| self.points_at(program, Some(cycle)).unwrap_or(first))
                .map(|controller| controller.interface.outputs.width())
                .collect(),
            holds: holds.collect(),
            heard,
            excluded: excluded.collect(),
            blocked: blocked.collect(),
        }
    }

    /// Whether a program has no provable output for a reason that no station can remove.
    fn is_blocked(&self, standing: &Standing, program: ProgramId, cycle: i64) -> bool {
        let deadline = self.deadline(program, cycle);
        match deadline.and_then(|step| step.driven.as_ref()) {
            Some(driven) if !standing.is_down(standing.driver(program)) => {
                driven.missing.is_some_and(is_blocked)
            }
            _ => true,
        }
    }
}

/// Whether a station started the cycle.
pub(crate) fn has_begun(step: &Step) -> bool {
    let missing = step.driven.as_ref().and_then(|driven| driven.missing);
    missing != Some(Missing::NoCycle)
}
