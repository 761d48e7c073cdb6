//! An online change of the program: this remote I/O makes the change mark, because only it makes the history.

use std::sync::Arc;

use understudy_cycle::{ChangeOrder, Fallback, OnlineChange, Output};
use understudy_wire::{
    ChangeName, ConfigurationHash, Configurations, Header, Holding, OrderRefusal, ProgramHash,
    StationId, StationSet, Time,
};

use super::RemoteIo;
use super::actuation::Execution;
use crate::event::Event;
use crate::history::History;

/// What this remote I/O does in an online change.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub(super) struct Replacing {
    /// The program that the change wants; a change mark that becomes void is made again.
    wanted: Option<ProgramHash>,
    /// Stations that have loaded the change, as their newest frames say.
    prepared: StationSet,
    trial: Trial,
}

/// Whether a fault of the new program takes the change back by itself.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
enum Trial {
    /// It does not.
    #[default]
    None,
    /// It does.
    Running {
        /// The program before.
        from: ProgramHash,
        /// The newest sample and this number of further ones belong to the trial, counted from 1.
        left: u32,
        /// Whether the program was seen running, so that a fault is one of the new program and not of the one before.
        runs: bool,
    },
    /// It has.
    TakenBack,
}

impl Replacing {
    /// The program that takes the next sample of this history, where that changes, and whether the sample resets the program. A sample that does both
    /// releases a program that a fault has stopped ([`understudy_cycle::Conversion::release`]); a release by the operator is a sample of its own.
    pub(super) fn next(
        &self,
        history: &History,
        execution: Execution,
    ) -> (Option<ProgramHash>, bool) {
        let is_restarting = execution == Execution::Restarting;
        let is_possible = !is_restarting && !history.is_full_of_changes();
        let change = self.wanted.filter(|wanted| is_possible && history.program() != Some(*wanted));
        let takes_back = change.is_some() && self.trial == Trial::TakenBack;
        (change, is_restarting || takes_back && execution == Execution::Stopped)
    }

    /// A sample was taken that no change mark made one of another program.
    fn sampled(&mut self) {
        if let Trial::Running { left, .. } = &mut self.trial {
            *left -= 1;
            if *left == 0 {
                self.trial = Trial::None;
            }
        }
    }

    /// The outputs of a program that is not stopped were proved.
    pub(super) fn runs(&mut self) {
        if let Trial::Running { runs, .. } = &mut self.trial {
            *runs = true;
        }
    }
}

impl RemoteIo {
    /// It had loaded a change before it was started, with these configurations; before [`Self::noting`]. Without effect where the change is not of
    /// its configuration. It begins with the settings of the configuration that it had.
    #[must_use]
    pub fn changed(mut self, change: &Arc<OnlineChange>, configurations: Configurations) -> Self {
        let restored = self.member.restore_change(Arc::clone(change), configurations);
        if restored.is_ok() {
            self.take_fallback(change, configurations.own);
            if let Some(program) = change.program_in(configurations.own, self.settings.program) {
                self.lay_out_by(change, program.hash);
            }
            if configurations.prepared.is_none() {
                self.adopt(change, configurations.own);
            }
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
        self.arbiter.knowledge.run().and_then(|run| run.history.program())
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
            self.replacing.prepared.insert(station);
        } else {
            self.replacing.prepared.remove(station);
        }
    }

    /// Learns of which program the history is that was adopted: a station that runs the configuration of this remote I/O, and has loaded no other one, holds
    /// a state of the program in it.
    pub(super) fn learn_program(&mut self, header: &Header, holdings: &[Holding]) {
        let runs = header.configuration == self.configurations().own && header.prepared.is_none();
        let Some(holding) = Holding::of(holdings, self.settings.program).filter(|_| runs) else {
            return;
        };
        let own = self.hash();
        if let Some(run) = self.arbiter.knowledge.run_mut() {
            run.history.learn(own, holding.lineage);
        }
    }

    /// Moves an online change on.
    pub(super) fn take_change(&mut self, now: Time, order: &ChangeOrder) {
        if let ChangeOrder::Switch(change, to) = order {
            let outcome = self.may_switch(*change, *to);
            if outcome.is_ok() && self.replacing.wanted != Some(*to) {
                self.replacing.wanted = Some(*to);
                self.replacing.trial = Trial::None;
            }
            return self.member.put(Output::Obeyed(outcome));
        }
        if let ChangeOrder::Prepare(change) = order
            && self.has_left_behind(change)
        {
            return self.member.put(Output::Obeyed(Err(OrderRefusal::IsOver)));
        }
        if let Some(refusal) = self.refusal_of_trial(order) {
            return self.member.put(Output::Obeyed(Err(refusal)));
        }
        let may_forget = self.has_history_of_own();
        let before = self.member.changing().change().cloned();
        self.member.take_change(now, order, may_forget);
        let changing = self.member.changing();
        let own = changing.configurations().own;
        let (after, is_over) = (changing.change().cloned(), changing.change().is_none());
        if let Some(change) = after.or(before.clone()) {
            self.take_fallback(&change, own);
        }
        if let (Some(change), true) = (before, is_over) {
            if let Some(program) = change.program_in(own, self.settings.program) {
                self.lay_out_by(&change, program.hash);
            }
            self.adopt(&change, own);
            self.replacing = Replacing::default();
        }
    }

    /// Whether its history is one of the program of its configuration alone. So is that of a program that the change does not replace, also where this
    /// remote I/O was restarted and does not know of which program the history is that it has adopted.
    fn has_history_of_own(&self) -> bool {
        let change = self.member.changing().change();
        if change.is_some_and(|change| change.of(self.settings.program).is_none()) {
            return true;
        }
        let own = self.hash();
        self.arbiter.knowledge.run().is_none_or(|run| run.history.is_of(own))
    }

    /// A program that is on trial is not accepted yet, and one that was taken back is not accepted at all.
    fn refusal_of_trial(&self, order: &ChangeOrder) -> Option<OrderRefusal> {
        let (ChangeOrder::Run(name, configuration) | ChangeOrder::Forget(name, configuration)) =
            order
        else {
            return None;
        };
        let change = self.member.changing().change().filter(|change| change.name() == *name)?;
        let accepted = change.program_in(*configuration, self.settings.program)?.hash;
        let Replacing { wanted, trial, .. } = self.replacing;
        // The trial begins with the change mark.
        let is_ahead = wanted == Some(accepted)
            && self.running().is_some_and(|running| running != accepted)
            && self.is_tried(accepted);
        match trial {
            Trial::Running { from, .. } if accepted != from => Some(OrderRefusal::StillNeeded),
            Trial::TakenBack if wanted != Some(accepted) => Some(OrderRefusal::TakenBack),
            _ if is_ahead => Some(OrderRefusal::StillNeeded),
            _ => None,
        }
    }

    /// Whether a program that a change mark brings is on trial. What the program of its own configuration does is no matter of the change.
    fn is_tried(&self, program: ProgramHash) -> bool {
        program != self.hash()
            && self.layout_of(program).is_some_and(|layout| layout.stop.is_some())
            && self.settings.fallback.trial_cycles > 0
    }

    /// A sample was taken, for the program `change` where that is another one than `from`.
    pub(super) fn note_change(&mut self, from: Option<ProgramHash>, change: Option<ProgramHash>) {
        let Some(to) = change else {
            return self.replacing.sampled();
        };
        let left = self.settings.fallback.trial_cycles;
        let is_tried = self.actuation.execution == Execution::Running && self.is_tried(to);
        if let Some(from) = from.filter(|_| is_tried) {
            self.replacing.trial = Trial::Running { from, left, runs: self.actuation.missed == 0 };
        }
    }

    /// A fault has stopped the program: where that is the new one of an online change, and on trial, the change is taken back with the next sample.
    pub(super) fn take_back(&mut self) {
        let Trial::Running { from: to, runs: true, .. } = self.replacing.trial else {
            return;
        };
        let can_follow = self.arbiter.holders.stations().any(|station| {
            self.arbiter.holders.is_living(station) && self.replacing.prepared.contains(station)
        });
        let (Some(from), true) = (self.running(), can_follow) else {
            return;
        };
        if Some(from) == self.replacing.wanted {
            self.replacing.wanted = Some(to);
            self.replacing.trial = Trial::TakenBack;
            let moment = self.moment();
            self.report(Event::ChangeTakenBack { moment, from, to });
        }
    }

    /// Whether a change was accepted: its history is one of the new program, and nothing else is loaded. What is over cannot be cancelled.
    fn has_left_behind(&self, change: &OnlineChange) -> bool {
        let changing = self.member.changing();
        let own = self.hash();
        let runs = self.arbiter.knowledge.run().is_some_and(|run| run.history.is_of(own));
        runs && changing.change().is_none() && changing.configurations().own == change.after
    }

    /// Takes the program of one of the configurations of a change for its own.
    pub(super) fn adopt(&mut self, change: &OnlineChange, own: ConfigurationHash) {
        if let Some(program) = change.program_in(own, self.settings.program) {
            self.settings.hash = program.hash;
        }
    }

    /// Takes the settings of its own configuration, one of those of a change. Outputs that are fail-safe go on from where they are: along the new
    /// ramps, to the new values.
    fn take_fallback(&mut self, change: &OnlineChange, own: ConfigurationHash) {
        let program = self.settings.program;
        if let Some(changed) = change.fallback_in(own, program) {
            self.take_settings(change.fitted((changed, own), program, self.laid_out));
        }
    }

    /// Takes settings for the points that count.
    pub(super) fn take_settings(&mut self, fallback: Fallback) {
        if fallback == self.settings.fallback {
            return;
        }
        self.actuation.take_settings(&fallback);
        // Modules next to those of the other one are released at the end.
        if !self.has_own_modules() {
            self.member.put(Output::EndWith(fallback.fail_safe.clone()));
        }
        self.settings.fallback = fallback;
    }

    /// Whether the history may change to a program: no station that computes it now would be silent from then on.
    fn may_switch(&self, name: ChangeName, to: ProgramHash) -> Result<(), OrderRefusal> {
        let is_changed = self.member.changing().has_loaded(name) && self.is_loaded(to);
        if !is_changed {
            return Err(OrderRefusal::NotPrepared);
        }
        let run = self.arbiter.knowledge.run().ok_or(OrderRefusal::NotRunning)?;
        // There is nothing to change, and the stations may have ended the change.
        if run.history.is_of(to) {
            return Ok(());
        }
        let living: StationSet = self
            .arbiter
            .holders
            .stations()
            .filter(|station| self.arbiter.holders.is_living(*station))
            .collect();
        let stations = living.without(self.replacing.prepared);
        if stations.is_empty() {
            Ok(())
        } else {
            Err(OrderRefusal::StationsNotPrepared { stations })
        }
    }
}
