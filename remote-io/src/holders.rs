//! The states of one program that living stations hold: its controller and every understudy.
//!
//! A station is living if a turn or a join of it was received in the last few cycles.

use std::cmp::Reverse;

use understudy_cycle::Agreement;
use understudy_wire::{
    Epoch, Holding, Kept, Moment, ProgramHash, ProgramId, Recalled, SamplesReceived, StationId,
    StationSet,
};

/// One entry for each station that can hold the program's state.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Holders {
    entries: Vec<Holder>,
    living_for: u32,
    /// Cycles of silence after which a station cannot come back without a state from another one.
    gone_after: u32,
    /// Cycles since this remote I/O started.
    listened: u32,
    /// Stations that were gone before it started, as others recall, and not received since.
    recalled_gone: StationSet,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct Holder {
    station: StationId,
    holding: Option<Holding>,
    /// The state that it has kept over a power failure, while it holds none.
    retained: Option<Kept>,
    /// What it recalls of this remote I/O's last sample.
    recalled: Option<Recalled>,
    /// Cycles since it was received; `u32::MAX` for never.
    silent: u32,
    /// Cycles since any frame of it came, one that was too late for its cycle too; `u32::MAX` for never.
    unheard: u32,
    /// Cycles since a frame of it came with a state, or in time from a station that receives others, or a turn that names it among those that
    /// published; `u32::MAX` for never. A station that is cut off from this remote I/O follows the samples that others relay; a second process with
    /// its keys, to which no frame goes, holds no state and is alone, also where this remote I/O follows its cycles.
    absent: u32,
}

impl Holders {
    /// For `program` in a cluster of `agreement`; a station that is silent for `flag_after` cycles lives no more.
    pub(crate) fn new(program: ProgramId, agreement: &Agreement) -> Self {
        let schedule = &agreement.schedule;
        let (controllers, stations) = (schedule.controllers(), schedule.stations());
        let living_for = agreement.flag_after;
        let own = program.controller();
        let understudies = (controllers as u8..stations as u8).map(StationId);
        let entries = [own]
            .into_iter()
            .chain(understudies)
            .map(|station| Holder {
                station,
                holding: None,
                retained: None,
                recalled: None,
                silent: u32::MAX,
                unheard: u32::MAX,
                absent: u32::MAX,
            })
            .collect();
        Self {
            entries,
            living_for,
            gone_after: living_for + agreement.history as u32,
            listened: 0,
            recalled_gone: StationSet::EMPTY,
        }
    }

    /// Takes the state that a station holds of this program, what it recalls of the last sample, with the version of the program where that is
    /// known, and whether it is alone: it receives no other member.
    pub(crate) fn note(
        &mut self,
        station: StationId,
        holding: Option<&Holding>,
        recalled: Option<(&Recalled, Option<ProgramHash>)>,
        alone: bool,
    ) {
        if let Some(entry) = self.entries.iter_mut().find(|entry| entry.station == station) {
            entry.holding = holding.copied();
            if holding.is_some() {
                entry.retained = None;
            }
            // A station that has restarted recalls nothing of its earlier life.
            entry.recalled =
                recalled.map(|(recalled, version)| Recalled { version, ..recalled.clone() });
            entry.silent = 0;
            if holding.is_some() || !alone {
                entry.absent = 0;
                self.recalled_gone.remove(station);
            }
        }
    }

    /// Takes the state that a station has kept over a power failure, while it holds none.
    pub(crate) fn note_retained(&mut self, station: StationId, retained: Option<&Kept>) {
        if let Some(entry) = self.entries.iter_mut().find(|entry| entry.station == station) {
            entry.retained = retained.copied();
        }
    }

    /// Takes a sign of life: any frame, and the state that it names if it was too late for its cycle.
    pub(crate) fn hear(&mut self, station: StationId, holding: Option<&Holding>) {
        let living_for = self.living_for;
        let mut entries = self.entries.iter_mut();
        if let Some(entry) = entries.find(|entry| entry.station == station) {
            entry.unheard = 0;
            if holding.is_some() {
                entry.absent = 0;
                if entry.silent > living_for {
                    entry.holding = holding.copied();
                }
            }
        }
    }

    /// Takes the stations that another one says have published.
    pub(crate) fn hear_of(&mut self, stations: StationSet) {
        for entry in self.entries.iter_mut().filter(|entry| stations.contains(entry.station)) {
            entry.absent = 0;
        }
    }

    /// Whether a station that may hold a state gives signs of life, even if none is in time: a cold start would lose that state.
    pub(crate) fn may_hold(&self) -> bool {
        let mut entries = self.entries.iter();
        entries.any(|entry| entry.unheard <= self.living_for && entry.holding.is_some())
    }

    /// Ends a cycle.
    pub(crate) fn close_cycle(&mut self) {
        self.listened = self.listened.saturating_add(1);
        for entry in &mut self.entries {
            entry.silent = entry.silent.saturating_add(1);
            entry.unheard = entry.unheard.saturating_add(1);
            entry.absent = entry.absent.saturating_add(1);
        }
    }

    /// Stations that cannot come back without a state from another one.
    pub(crate) fn gone(&self) -> StationSet {
        let absent = self
            .entries
            .iter()
            .filter(|entry| self.listened > self.gone_after && entry.absent > self.gone_after);
        absent.map(|entry| entry.station).collect::<StationSet>().or(self.recalled_gone)
    }

    /// Whether no output can have been applied that came of a newer state than `holding`, as far as living stations
    /// recall: each station that could have proved one lives and has received samples in this life, or is accounted for
    /// by one that does, and none recalls a newer applied sample.
    ///
    /// What remains: a remote I/O and a station that were cut off together from all others, and lost their memory
    /// together.
    pub(crate) fn covers_all_applied(&self, holding: &Holding) -> bool {
        let recalling = || {
            let living = self.entries.iter().filter(|entry| self.lives(entry));
            living.filter_map(|entry| Some((entry.station, entry.recalled.as_ref()?)))
        };
        let accounted_for = self.accounted_for();
        let all = self.entries.iter();
        let newest = recalling().filter_map(|(_, recalled)| recalled.applied).max();
        all.map(|entry| entry.station).all(|station| accounted_for.contains(station))
            && newest.is_none_or(|applied| applied <= holding.stepped)
    }

    /// Stations that have received samples in this life, and those that they account for, as living stations recall.
    pub(crate) fn accounted_for(&self) -> StationSet {
        let living = self.entries.iter().filter(|entry| self.lives(entry));
        let recalling = living.filter_map(|entry| Some((entry.station, entry.recalled.as_ref()?)));
        let first_hand =
            recalling.filter(|(_, recalled)| recalled.received == SamplesReceived::Later);
        first_hand.fold(StationSet::EMPTY, |all, (station, recalled)| {
            all.or(StationSet::only(station)).or(recalled.accounted_for)
        })
    }

    /// Cycles of silence after which a station cannot come back without a state from another one.
    pub(crate) fn gone_after(&self) -> u32 {
        self.gone_after
    }

    /// Takes up which stations were gone before this remote I/O started.
    pub(crate) fn recall_gone(&mut self) {
        let living = self.entries.iter().filter(|entry| self.lives(entry));
        let recalled = living.filter_map(|entry| entry.recalled.as_ref());
        let gone = recalled.fold(StationSet::EMPTY, |gone, one| gone.or(one.accounted_for));
        let received = self.entries.iter().filter(|entry| entry.silent < u32::MAX);
        let received: StationSet = received.map(|entry| entry.station).collect();
        self.recalled_gone = gone.without(received);
    }

    /// Whether a station lives.
    pub(crate) fn is_living(&self, station: StationId) -> bool {
        let mut entries = self.entries.iter();
        entries.any(|entry| entry.station == station && self.lives(entry))
    }

    /// The stations that can hold the program's state: its controller, then the understudies.
    pub(crate) fn stations(&self) -> impl Iterator<Item = StationId> + '_ {
        self.entries.iter().map(|entry| entry.station)
    }

    /// Whether a station lives that could hold the state.
    pub(crate) fn any_living(&self) -> bool {
        self.entries.iter().any(|entry| self.lives(entry))
    }

    /// Stations that could hold the state and do not live.
    pub(crate) fn missing(&self) -> StationSet {
        let missing = self.entries.iter().filter(|entry| !self.lives(entry));
        missing.map(|entry| entry.station).collect()
    }

    /// Stations that this remote I/O had excluded, as living stations recall them.
    pub(crate) fn excluded(&self) -> StationSet {
        let living = self.entries.iter().filter(|entry| self.lives(entry));
        let recalled = living.filter_map(|entry| entry.recalled.as_ref());
        recalled.fold(StationSet::EMPTY, |all, one| all.or(one.excluded))
    }

    /// What living stations recall of the sample of `stepped`, which the state of `from` includes: of that sample, or of
    /// the first one after it, or else of the last one before it.
    pub(crate) fn recalled_at(&self, from: StationId, stepped: Moment) -> Option<&Recalled> {
        let living = self.entries.iter().filter(|entry| self.lives(entry));
        let recalled =
            living.filter_map(|entry| Some((entry.recalled.as_ref()?, entry.station == from)));
        let (recalled, _) = recalled.min_by_key(|(recalled, is_holder)| {
            let sampled = recalled.sampled;
            let is_before = sampled < stepped;
            (is_before, if is_before { Err(Reverse(sampled)) } else { Ok(sampled) }, !is_holder)
        })?;
        Some(recalled)
    }

    /// States that living stations hold.
    pub(crate) fn holdings(&self) -> impl Iterator<Item = (StationId, &Holding)> + Clone {
        self.entries
            .iter()
            .filter(|entry| self.lives(entry))
            .filter_map(|entry| Some((entry.station, entry.holding.as_ref()?)))
    }

    /// Stations that hold the state that was stepped last, where they hold different ones: it is not known which of
    /// them the applied outputs came from.
    pub(crate) fn disputed(&self) -> Option<StationSet> {
        let (_, newest) = self.newest()?;
        let equal = self.holdings().filter(|(_, other)| other.stepped == newest.stepped);
        let differ = equal.clone().any(|(_, other)| other.lineage != newest.lineage);
        differ.then(|| equal.map(|(station, _)| station).collect())
    }

    /// The state that was stepped last. A later sample is a newer history, because only one remote I/O makes samples.
    pub(crate) fn newest(&self) -> Option<(StationId, &Holding)> {
        // The first of equals: the controller before the understudies.
        self.holdings().reduce(
            |best, other| {
                if other.1.stepped > best.1.stepped { other } else { best }
            },
        )
    }

    /// States that living stations have retained, but for those of `excluded`.
    fn retained(&self, excluded: StationSet) -> impl Iterator<Item = (StationId, &Kept)> {
        self.entries
            .iter()
            .filter(move |entry| self.lives(entry) && !excluded.contains(entry.station))
            .filter_map(|entry| Some((entry.station, entry.retained.as_ref()?)))
    }

    /// The retained state that was stepped last; the first of equals. Those of `epoch`, where that is given, come before all others.
    pub(crate) fn newest_retained(
        &self,
        excluded: StationSet,
        epoch: Option<Epoch>,
    ) -> Option<(StationId, &Kept)> {
        let rank = |of: &Kept| {
            let stepped = of.holding.stepped;
            (epoch == Some(stepped.epoch), stepped)
        };
        self.retained(excluded)
            .reduce(|best, other| if rank(other.1) > rank(best.1) { other } else { best })
    }

    /// Stations that have retained the newest state, where they have different ones.
    pub(crate) fn disputed_retained(
        &self,
        excluded: StationSet,
        newest: &Kept,
    ) -> Option<StationSet> {
        let Holding { stepped, lineage, .. } = newest.holding;
        let equal = || self.retained(excluded).filter(|(_, it)| it.holding.stepped == stepped);
        let differ = equal().any(|(_, other)| other.holding.lineage != lineage);
        differ.then(|| equal().map(|(station, _)| station).collect())
    }

    /// The newest applied sample that living stations recall.
    pub(crate) fn newest_recalled(&self) -> Option<Moment> {
        let living = self.entries.iter().filter(|entry| self.lives(entry));
        living.filter_map(|entry| entry.recalled.as_ref()?.applied).max()
    }

    fn lives(&self, entry: &Holder) -> bool {
        entry.silent <= self.living_for
    }
}
