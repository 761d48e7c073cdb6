//! An online change of the program: this remote I/O makes the change mark, because only it makes the history.

use std::sync::Arc;

use understudy_cycle::{ChangeOrder, OnlineChange, Output};
use understudy_wire::{
    ConfigurationHash, Configurations, Header, OrderRefusal, ProgramHash, StationId, StationSet,
    Time,
};

use super::RemoteIo;

impl RemoteIo {
    /// It had loaded a change before it was started, with these configurations; before [`Self::noting`]. Without effect where the change is not of
    /// its configuration.
    #[must_use]
    pub fn changed(mut self, change: &Arc<OnlineChange>, configurations: Configurations) -> Self {
        let restored = self.member.restore_change(Arc::clone(change), configurations);
        if restored.is_ok() && configurations.prepared.is_none() {
            self.adopt(change, configurations.own);
        }
        self
    }

    /// The configuration that it runs, and the one that it has loaded beside it; it refuses members with none of them.
    pub fn configurations(&self) -> Configurations {
        self.member.changing().configurations()
    }

    /// The hash of its program in the configuration that it runs.
    pub(super) fn hash(&self) -> ProgramHash {
        self.member.changing().hash_of(self.settings.program, self.settings.hash)
    }

    /// The program that took the newest sample; none where it is not known.
    pub(super) fn running(&self) -> Option<ProgramHash> {
        self.knowledge.run().and_then(|run| run.history.program())
    }

    /// Whether stations that have loaded what this remote I/O has can execute a program: that of its configuration or the other one of an online
    /// change.
    pub(super) fn is_loaded(&self, program: ProgramHash) -> bool {
        let change = self.member.changing().change();
        let changed = change.and_then(|change| change.of(self.settings.program));
        program == self.hash()
            || changed.is_some_and(|it| program == it.before.hash || program == it.after.hash)
    }

    /// Notes whether a station has loaded the change that this remote I/O has.
    pub(super) fn note_prepared(&mut self, station: StationId, header: &Header) {
        let Configurations { own, prepared } = self.member.changing().configurations();
        let theirs = [Some(header.configuration), header.prepared];
        if prepared.is_some() && theirs.contains(&Some(own)) && theirs.contains(&prepared) {
            self.prepared.insert(station);
        } else {
            self.prepared.remove(station);
        }
    }

    /// Moves an online change on.
    pub(super) fn take_change(&mut self, now: Time, order: &ChangeOrder) {
        if let ChangeOrder::Switch(to) = order {
            let outcome = self.may_switch(*to);
            if outcome.is_ok() {
                self.wanted = Some(*to);
            }
            return self.member.put(Output::Obeyed(outcome));
        }
        if let ChangeOrder::Prepare(change) = order
            && self.has_left_behind(change)
        {
            return self.member.put(Output::Obeyed(Err(OrderRefusal::IsOver)));
        }
        let own = self.hash();
        let may_forget = self.knowledge.run().is_none_or(|run| run.history.is_of(own));
        let before = self.member.changing().change().cloned();
        self.member.take_change(now, order, may_forget);
        let changing = self.member.changing();
        if let (Some(change), None) = (before, changing.change()) {
            let own = changing.configurations().own;
            self.adopt(&change, own);
            self.wanted = None;
            self.prepared = StationSet::EMPTY;
        }
    }

    /// Whether a change was accepted: its history is one of the new program, and nothing else is loaded. What is over cannot be cancelled.
    fn has_left_behind(&self, change: &OnlineChange) -> bool {
        let changing = self.member.changing();
        let own = self.hash();
        let runs = self.knowledge.run().is_some_and(|run| run.history.is_of(own));
        runs && changing.change().is_none() && changing.configurations().own == change.after
    }

    /// Takes the program of one of the configurations of a change for its own.
    pub(super) fn adopt(&mut self, change: &OnlineChange, own: ConfigurationHash) {
        if let Some(program) = change.program_in(own, self.settings.program) {
            self.settings.hash = program.hash;
        }
    }

    /// Whether the history may change to a program: no station that computes it now would be silent from then on.
    fn may_switch(&self, to: ProgramHash) -> Result<(), OrderRefusal> {
        let is_changed = self.member.changing().change().is_some() && self.is_loaded(to);
        if !is_changed {
            return Err(OrderRefusal::NotPrepared);
        }
        if self.knowledge.run().is_none() {
            return Err(OrderRefusal::NotRunning);
        }
        let living: StationSet =
            self.holders.stations().filter(|station| self.holders.is_living(*station)).collect();
        let stations = living.without(self.prepared);
        if stations.is_empty() {
            Ok(())
        } else {
            Err(OrderRefusal::StationsNotPrepared { stations })
        }
    }
}
