//! An online change: the programs of another configuration, loaded beside those that run.
//!
//! ```text
//!   running ── prepare ──► both loaded ── switch ──► remote I/O i marks its history: program i is the new one ── accept ──► running
//!      ▲                     │    ▲                      │       ▲                                                │
//!      └────── forget ───────┘    └──── switch back ─────┘       └───────────── take back the acceptance ─────────┘
//! ```
//!
//! A change mark is part of a sample, so of the lineage: a station that follows the sample converts its state, and one that has not loaded the new
//! program cannot follow and is silent. Members with a configuration in common admit each other's frames ([`understudy_wire::Configurations`]), so
//! it does not matter which of them accepts first.

use std::fmt::Debug;
use std::hash::{Hash, Hasher};
use std::sync::Arc;

use understudy_executable::Executable;
use understudy_wire::{
    ChangeName, ConfigurationHash, Configurations, OrderRefusal, PointsHash, ProgramHash, ProgramId,
};

use crate::fallback::Fallback;
use crate::layout::Layout;
use crate::passage::{Passage, PointsChange};

/// Compiled program of the cluster.
#[derive(Debug, Clone)]
pub struct Program {
    /// Hash of its canonical text.
    pub hash: ProgramHash,
    /// Its f and h, (1) and (2).
    pub executable: Executable,
}

/// A state of one program as the first state of another one.
pub trait Conversion: Debug + Send + Sync {
    /// The state for the packed `state`: a function of both programs and of the state, so all stations compute the same.
    fn convert(&self, state: &[u64]) -> Vec<u64>;

    /// Releases the program of a converted state that a fault has stopped, where `inputs`, those of the sample that changes the program, reset it: it
    /// goes on with the values of before the scan of the fault, and not with the initial ones.
    fn release(&self, state: &mut [u64], inputs: &[u64]);
}

/// One program that a change replaces, with the way there and back.
#[derive(Debug, Clone)]
pub struct ProgramChange {
    /// Which program.
    pub program: ProgramId,
    /// The program of the configuration before.
    pub before: Program,
    /// The program of the configuration after.
    pub after: Program,
    /// From a state of `before` to one of `after`.
    pub forward: Arc<dyn Conversion>,
    /// From a state of `after` to one of `before`.
    pub back: Arc<dyn Conversion>,
    /// What becomes of its points; `None` where both programs have the same ones. The change has the settings of its remote I/O too then.
    pub points: Option<Arc<PointsChange>>,
    /// What identifies the points of `before` and of `after` to who gives orders. Where these stay, values of an enumeration may have other names.
    pub known_by: [PointsHash; 2],
}

impl ProgramChange {
    /// What identifies the points of one of the two programs to who gives orders.
    pub fn known_by(&self, version: ProgramHash) -> Option<PointsHash> {
        let [before, after] = self.known_by;
        match version {
            _ if version == self.before.hash => Some(before),
            _ if version == self.after.hash => Some(after),
            _ => None,
        }
    }

    /// The way of the points from one of the two programs to the other one; nothing where they stay.
    fn passage(&self, from: ProgramHash, to: ProgramHash) -> Option<Passage<'_>> {
        let points = self.points.as_ref()?;
        match (self.before.hash, self.after.hash) {
            hashes if hashes == (from, to) => Some(points.forward()),
            hashes if hashes == (to, from) => Some(points.back()),
            _ => None,
        }
    }
}

/// What an online change replaces of the settings of one remote I/O. They count where that configuration is its own.
#[derive(Debug, Clone, PartialEq)]
pub struct FallbackChange {
    /// Its program.
    pub program: ProgramId,
    /// The settings of the configuration before.
    pub before: Fallback,
    /// The settings of the configuration after.
    pub after: Fallback,
}

/// What an online change replaces. Everything else of the two configurations is equal.
#[derive(Debug, Clone)]
pub struct OnlineChange {
    /// The configuration before.
    pub before: ConfigurationHash,
    /// The configuration after.
    pub after: ConfigurationHash,
    /// The programs that it replaces, in the order of the cluster.
    pub programs: Vec<ProgramChange>,
    /// The settings that it replaces, in the order of the cluster.
    pub fallbacks: Vec<FallbackChange>,
}

impl OnlineChange {
    /// The two configurations.
    pub fn name(&self) -> ChangeName {
        ChangeName { before: self.before, after: self.after }
    }

    /// What it does to a program; none where that stays.
    pub fn of(&self, program: ProgramId) -> Option<&ProgramChange> {
        self.programs.iter().find(|change| change.program == program)
    }

    /// The program in one of the two configurations; none where the change does not replace it.
    pub fn program_in(
        &self,
        configuration: ConfigurationHash,
        program: ProgramId,
    ) -> Option<&Program> {
        let of = self.of(program)?;
        Some(if configuration == self.after { &of.after } else { &of.before })
    }

    /// The way of the points of a program from one of its versions to another one; nothing where they stay.
    pub fn passage(
        &self,
        program: ProgramId,
        (from, to): (ProgramHash, ProgramHash),
    ) -> Option<Passage<'_>> {
        self.of(program)?.passage(from, to)
    }

    /// The layout of a version of a program; nothing where the change does not replace its points, or has no such version.
    pub fn layout(&self, program: ProgramId, version: ProgramHash) -> Option<&Arc<Layout>> {
        let changed = self.of(program)?;
        let points = changed.points.as_ref()?;
        match version {
            _ if version == changed.before.hash => Some(&points.before),
            _ if version == changed.after.hash => Some(&points.after),
            _ => None,
        }
    }

    /// Settings of a remote I/O, those of the configuration `of`, for the points of the version of its program that runs.
    pub fn fitted(
        &self,
        (own, of): (&Fallback, ConfigurationHash),
        program: ProgramId,
        running: ProgramHash,
    ) -> Fallback {
        let other = if of == self.after { self.before } else { self.after };
        let native = self.program_in(of, program).map(|program| program.hash);
        let passage = native.and_then(|native| self.passage(program, (native, running)));
        match (passage, self.fallback_in(other, program)) {
            (Some(passage), Some(theirs)) => passage.fallback(own, theirs),
            _ => own.clone(),
        }
    }

    /// The settings of a remote I/O in one of the two configurations; none where the change does not replace them.
    pub fn fallback_in(
        &self,
        configuration: ConfigurationHash,
        program: ProgramId,
    ) -> Option<&Fallback> {
        let of = self.fallbacks.iter().find(|change| change.program == program)?;
        Some(if configuration == self.after { &of.after } else { &of.before })
    }
}

/// The programs that one state machine can execute in the place of one program.
#[derive(Debug, Clone, Copy)]
pub struct Versions<'a> {
    /// That of the configuration with which the member started.
    first: &'a Program,
    change: Option<&'a ProgramChange>,
}

impl<'a> Versions<'a> {
    /// The program that a member started with, and the change that it has loaded.
    pub fn new(
        first: &'a Program,
        change: Option<&'a Arc<OnlineChange>>,
        program: ProgramId,
    ) -> Self {
        Self { first, change: change.and_then(|change| change.of(program)) }
    }

    /// Each once.
    pub fn all(self) -> impl Iterator<Item = &'a Program> {
        let changed = self.change.map(|change| [&change.before, &change.after]);
        let others = changed.into_iter().flatten();
        let first = self.first;
        std::iter::once(first).chain(others.filter(move |it| it.hash != first.hash))
    }

    /// The program with this hash.
    pub fn of(self, hash: ProgramHash) -> Option<&'a Program> {
        self.all().find(|program| program.hash == hash)
    }

    /// Whether u of one of them has this width in bits.
    pub fn has_inputs(self, width: usize) -> bool {
        self.all().any(|program| program.executable.input_count() == width)
    }

    /// The program with this hash, where a change replaces its points: the hash tells what its inputs are.
    pub fn named(self, hash: ProgramHash) -> Option<ProgramHash> {
        self.change.and_then(|change| change.points.as_ref()).map(|_| hash)
    }

    /// The first state of `to`, at a sample with these inputs, for the state of `from`; none where one of them is not loaded.
    pub fn convert(
        self,
        (from, to): (ProgramHash, ProgramHash),
        state: &[u64],
        inputs: &[u64],
    ) -> Option<Vec<u64>> {
        let change = self.change?;
        let conversion = match (change.before.hash, change.after.hash) {
            hashes if hashes == (from, to) => &change.forward,
            hashes if hashes == (to, from) => &change.back,
            _ => return None,
        };
        let mut state = conversion.convert(state);
        conversion.release(&mut state, inputs);
        Some(state)
    }
}

/// Two changes are equal that lead from one configuration to the same other one.
impl PartialEq for OnlineChange {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name()
    }
}

impl Eq for OnlineChange {}

/// An order that moves an online change on. Every member takes all but the switch, which is for remote I/Os.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ChangeOrder {
    /// The change is loaded: both its programs are known from now on.
    Prepare(Arc<OnlineChange>),
    /// In this change, the program of this remote I/O becomes the one with this hash, with the next sample.
    Switch(ChangeName, ProgramHash),
    /// This configuration, one of the two of the change, is the member's own from now on.
    Run(ChangeName, ConfigurationHash),
    /// The change is over: this configuration, which the member runs, is the only one from now on.
    Forget(ChangeName, ConfigurationHash),
}

/// What a member knows of an online change.
#[derive(Debug, Clone)]
pub struct Changing {
    own: ConfigurationHash,
    change: Option<Arc<OnlineChange>>,
}

impl Changing {
    /// A member that runs the configuration `own`, and has loaded no other one.
    pub fn new(own: ConfigurationHash) -> Self {
        Self { own, change: None }
    }

    /// Its configuration, and the one that it has loaded beside it.
    pub fn configurations(&self) -> Configurations {
        let prepared = self
            .change
            .as_ref()
            .map(|change| if change.before == self.own { change.after } else { change.before });
        Configurations { own: self.own, prepared }
    }

    /// Whether it has loaded this change.
    pub fn has_loaded(&self, name: ChangeName) -> bool {
        self.change.as_ref().is_some_and(|change| change.name() == name)
    }

    /// Whether it has loaded another change than this one: the programs that run may be those of that one.
    fn has_loaded_another(&self, name: ChangeName) -> bool {
        self.change.is_some() && !self.has_loaded(name)
    }

    /// The change that it has loaded.
    pub fn change(&self) -> Option<&Arc<OnlineChange>> {
        self.change.as_ref()
    }

    /// The hash that a program has in the member's own configuration; `first` is that of the configuration with which it started.
    pub fn hash_of(&self, program: ProgramId, first: ProgramHash) -> ProgramHash {
        let changed = self.change.as_ref().and_then(|it| it.program_in(self.own, program));
        changed.map_or(first, |changed| changed.hash)
    }

    /// Takes an order; `may_forget` says whether nothing needs the other configuration any more.
    ///
    /// # Errors
    /// Nothing changes, because of the refusal.
    pub fn take(&mut self, order: &ChangeOrder, may_forget: bool) -> Result<(), OrderRefusal> {
        match order {
            ChangeOrder::Prepare(change) => match &self.change {
                Some(known) if known == change => {}
                Some(_) => return Err(OrderRefusal::AnotherChange),
                None if change.before == self.own || change.after == self.own => {
                    self.change = Some(Arc::clone(change));
                }
                None => return Err(OrderRefusal::OtherConfiguration { own: self.own }),
            },
            ChangeOrder::Run(name, _) | ChangeOrder::Forget(name, _)
                if self.has_loaded_another(*name) =>
            {
                return Err(OrderRefusal::AnotherChange);
            }
            ChangeOrder::Run(_, configuration) if *configuration == self.own => {}
            ChangeOrder::Run(name, configuration) => {
                let is_known = self.has_loaded(*name) && name.has(*configuration);
                if !is_known {
                    return Err(OrderRefusal::NotPrepared);
                }
                self.own = *configuration;
            }
            ChangeOrder::Forget(_, kept) if *kept != self.own => {
                return Err(OrderRefusal::OtherConfiguration { own: self.own });
            }
            // That change is over here.
            ChangeOrder::Forget(name, _) if !self.has_loaded(*name) => {}
            ChangeOrder::Forget(..) if !may_forget => return Err(OrderRefusal::StillNeeded),
            ChangeOrder::Forget(..) => self.change = None,
            // A remote I/O makes change marks, and takes this order itself.
            ChangeOrder::Switch(..) => return Err(OrderRefusal::NotRunning),
        }
        Ok(())
    }
}

/// Of the two, only what frames and states depend on: the rest follows from the configurations.
impl Hash for Changing {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        self.configurations().hash(hasher);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: ConfigurationHash = ConfigurationHash(1);
    const TWO: ConfigurationHash = ConfigurationHash(2);
    const THREE: ConfigurationHash = ConfigurationHash(3);

    fn change(before: ConfigurationHash, after: ConfigurationHash) -> OnlineChange {
        OnlineChange { before, after, programs: Vec::new(), fallbacks: Vec::new() }
    }

    /// An engineer ends the change from 1 to 2 once more while the one from 2 to 3 is prepared, or accepted: nothing of the latter changes, and no member
    /// says that the change from 1 to 2 has ended as asked, since the programs of 3 may run.
    #[test]
    fn a_step_of_a_change_that_is_over_does_nothing_to_the_next_one() {
        let old = change(ONE, TWO).name();
        let next = change(TWO, THREE);
        for accepts in [false, true] {
            let mut changing = Changing::new(TWO);
            changing.take(&ChangeOrder::Prepare(Arc::new(next.clone())), true).expect("loaded");
            if accepts {
                changing.take(&ChangeOrder::Run(next.name(), THREE), true).expect("accepted");
            }
            let before = changing.configurations();
            for order in [
                ChangeOrder::Forget(old, TWO),
                ChangeOrder::Forget(old, ONE),
                ChangeOrder::Run(old, TWO),
                ChangeOrder::Run(old, ONE),
            ] {
                assert!(changing.take(&order, true).is_err(), "{order:?}");
                assert_eq!(changing.configurations(), before, "{order:?}");
            }
            let kept = if accepts { THREE } else { TWO };
            changing.take(&ChangeOrder::Forget(next.name(), kept), true).expect("it ends");
            // Then the first one is over as before, where its configuration runs.
            let again = changing.take(&ChangeOrder::Forget(old, TWO), true);
            assert_eq!(again.is_ok(), !accepts);
            assert_eq!(changing.configurations(), Configurations { own: kept, prepared: None });
        }
    }
}
