//! Which living stations hold which state of one program: the controller of the program and every understudy.
//!
//! Living means heard in the last few cycles, speaking or asking to join.

use understudy_wire::{Holding, Image, ProgramId, Recalled, StationId, StationSet};

/// One entry for each station that can hold the program's state.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Witnesses {
    entries: Vec<Witness>,
    living_for: u32,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct Witness {
    station: StationId,
    holding: Option<Holding>,
    /// What it recalls of this remote I/O's last sample.
    recalled: Option<Recalled>,
    /// Cycles since it was heard; `u32::MAX` for never.
    silent: u32,
}

impl Witnesses {
    /// For `program` in a cluster of `controllers` and `stations`; one who is silent for `living_for` cycles lives no more.
    pub(crate) fn new(
        program: ProgramId,
        controllers: usize,
        stations: usize,
        living_for: u32,
    ) -> Self {
        let own = StationId(program.0);
        let understudies = (controllers as u8..stations as u8).map(StationId);
        let entries = [own]
            .into_iter()
            .chain(understudies)
            .map(|station| Witness {
                station,
                holding: None,
                recalled: None,
                silent: u32::MAX,
            })
            .collect();
        Self {
            entries,
            living_for,
        }
    }

    /// A station has said what it holds of this program, and what it recalls of its last sample.
    pub(crate) fn note(
        &mut self,
        station: StationId,
        holding: Option<&Holding>,
        recalled: Option<&Recalled>,
    ) {
        if let Some(entry) = self
            .entries
            .iter_mut()
            .find(|entry| entry.station == station)
        {
            entry.holding = holding.copied();
            if recalled.is_some() {
                entry.recalled = recalled.cloned();
            }
            entry.silent = 0;
        }
    }

    /// Ends a cycle.
    pub(crate) fn close_cycle(&mut self) {
        for entry in &mut self.entries {
            entry.silent = entry.silent.saturating_add(1);
        }
    }

    /// Whether anybody lives who could hold the state.
    pub(crate) fn anybody(&self) -> bool {
        self.entries.iter().any(|entry| self.lives(entry))
    }

    /// Whether all who could hold the state live.
    pub(crate) fn everybody(&self) -> bool {
        self.entries.iter().all(|entry| self.lives(entry))
    }

    /// Whom this remote I/O had excluded, as any living station recalls it.
    pub(crate) fn excluded(&self) -> StationSet {
        let living = self.entries.iter().filter(|entry| self.lives(entry));
        let recalled = living.filter_map(|entry| entry.recalled.as_ref());
        recalled.fold(StationSet::EMPTY, |all, one| all.or(one.excluded))
    }

    /// u(i) of the last sample, as `station` recalls it.
    pub(crate) fn inputs(&self, station: StationId) -> Option<&Image> {
        let entry = self.entries.iter().find(|entry| entry.station == station)?;
        entry.recalled.as_ref().map(|recalled| &recalled.inputs)
    }

    /// What the living hold.
    pub(crate) fn holdings(&self) -> impl Iterator<Item = (StationId, &Holding)> + Clone {
        self.entries
            .iter()
            .filter(|entry| self.lives(entry))
            .filter_map(|entry| Some((entry.station, entry.holding.as_ref()?)))
    }

    /// Those who hold the state that was stepped last, where they hold different ones: nobody can say which the plant has seen.
    pub(crate) fn disputed(&self) -> Option<StationSet> {
        let (_, newest) = self.newest()?;
        let equal = self
            .holdings()
            .filter(|(_, other)| other.stepped == newest.stepped);
        let differ = equal
            .clone()
            .any(|(_, other)| other.lineage != newest.lineage);
        differ.then(|| equal.map(|(station, _)| station).collect())
    }

    /// The state that was stepped last. A later sample is a newer history, because only one remote I/O makes samples.
    pub(crate) fn newest(&self) -> Option<(StationId, &Holding)> {
        // The first of equals: the controller before the understudies.
        self.holdings().reduce(|best, other| {
            if other.1.stepped > best.1.stepped {
                other
            } else {
                best
            }
        })
    }

    fn lives(&self, entry: &Witness) -> bool {
        entry.silent <= self.living_for
    }
}
