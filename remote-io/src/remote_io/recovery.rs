//! The state from which the program continues: after a restart of this remote I/O, or when no living station is on its
//! history.
//!
//! ```text
//!   no living station holds a state, and none that comes
//!   too late in each cycle ────────────────────────────── cold start
//!   the same, and as many members have another
//!   configuration as stations have this one ───────────── the operator chooses, whatever `release` says
//!   the same, and a station has retained one ───────────── warm start, or as for a state that is lost
//!   a state at the floor, or one that covers it ────────── adopted
//!   different states of one cycle after a restart ──────── the operator chooses (`release`)
//!   only states before the floor, or none that provably
//!   covers it after a restart ──────────────────────────── the state is lost: see `StaleState`
//! ```

use understudy_cycle::{Release, Restart, StaleState};
use understudy_wire::{
    Holding, Kept, Moment, OrderRefusal, StateChoice, StationId, StationSet, Time,
};

use super::RemoteIo;
use super::arbiter::{Authority, Question};
use super::knowledge::{Floor, Knowledge, Run};
use crate::event::Event;
use crate::history::History;

/// What the states of the living stations allow.
pub(super) enum Verdict {
    Cold,
    /// From a state that was kept over a power failure.
    Warm(StationId, Kept),
    Adopt(StationId, Holding),
    Disputed(StationSet),
    Stale(StationId, Holding),
    /// Outputs were applied, and no station holds a state or has kept one.
    Lost,
}

impl RemoteIo {
    /// Listens until the states of the stations are known; detects that no living station is on this history any more.
    pub(super) fn find_history(&mut self, now: Time, moment: Moment) {
        let listen_cycles = self.settings.agreement.listen_cycles;
        // Frames received while this remote I/O was suspended are read at once and count as one cycle: the stations may
        // have changed.
        let schedule = &self.settings.agreement.schedule;
        let unseen = now.since(self.arbiter.looked);
        let counted = schedule.took_time(unseen);
        // What it saw before it was suspended says nothing of the stations now: one that held the state may be back.
        let was_suspended = unseen >= schedule.period() * 2;
        if counted {
            self.arbiter.looked = now;
        }
        let mut follower = None;
        let waited = match &mut self.arbiter.knowledge {
            Knowledge::ColdStarted { run, .. } | Knowledge::Known { run, .. } => {
                let Run { history, unfollowed, .. } = run;
                let on_it = |holding: &Holding| history.place(holding.lineage).is_some();
                follower = self
                    .arbiter
                    .holders
                    .holdings()
                    .find_map(|(station, holding)| on_it(holding).then_some(station));
                let begins =
                    was_suspended || follower.is_some() || !self.arbiter.holders.any_living();
                *unfollowed =
                    if begins { 0 } else { unfollowed.saturating_add(u32::from(counted)) };
                unfollowed.saturating_sub(listen_cycles)
            }
            Knowledge::Listening { cycles, held, .. } => {
                let holds = self.arbiter.holders.newest().is_some();
                // The station that held a state may come back, or may have transferred it to another one.
                if *held && !holds {
                    *cycles = 0;
                }
                *held = holds;
                *cycles =
                    cycles.saturating_add(u32::from(counted && self.arbiter.holders.any_living()));
                *cycles
            }
        };
        if follower.is_some() {
            self.become_answered(follower);
        }
        // A history without a sample is one that no station can follow.
        if waited < listen_cycles || waited == 0 {
            return;
        }
        let verdict = self.verdict();
        let missing = self.arbiter.holders.missing();
        // The slot of a spare is empty in general: a proved state does not wait for it.
        let is_whole = match verdict {
            Verdict::Adopt(..) => {
                missing.without(self.settings.agreement.schedule.spare_slots()).is_empty()
            }
            _ => missing.is_empty(),
        };
        let unknown = self.arbiter.holders.holdings().find(|(_, holding)| !self.can_read(holding));
        let unknown = unknown.and_then(|(_, holding)| holding.version);
        self.miss_points(unknown);
        if unknown.is_some() {
            return;
        }
        // A missing station that could hold the state gets longer: it may be the only one that does.
        let patience = if is_whole { 1 } else { 5 };
        if waited < listen_cycles * patience || !self.may_begin(moment) || !self.is_sensed() {
            return;
        }
        if let Knowledge::Listening { unproved, .. } = &mut self.arbiter.knowledge {
            match verdict {
                Verdict::Stale(..) | Verdict::Lost => {
                    *unproved = unproved.saturating_add(u32::from(counted))
                }
                _ => *unproved = 0,
            }
            if (1..listen_cycles).contains(unproved) && self.arbiter.question.is_none() {
                return;
            }
        }
        match verdict {
            // The operator has been asked: a state that is not received for a moment is no reason to start cold.
            Verdict::Cold | Verdict::Lost if self.asks_for_lost_state() => {}
            // Nor is one whose station is received too late in each cycle.
            Verdict::Cold | Verdict::Warm(..) | Verdict::Lost
                if self.arbiter.holders.may_hold() => {}
            Verdict::Cold | Verdict::Warm(..) if self.may_have_the_wrong_program() => {
                let (stations, others) = (self.own_stations() as u32, self.member.refused() as u32);
                let asks = Event::ConfigurationDisputed { moment, stations, others };
                self.become_asking(Question::ConfigurationDisputed, asks);
            }
            Verdict::Cold => self.start_cold(moment, self.lost_by_cold_start()),
            Verdict::Warm(from, retained) => self.start_warm(moment, (from, retained)),
            Verdict::Lost => self.lose_state(moment, None),
            Verdict::Adopt(from, holding) => self.start(moment, (from, holding)),
            Verdict::Disputed(stations) => {
                self.become_asking(Question::Disputed, Event::Disputed { moment, stations });
            }
            Verdict::Stale(holder, holding) => {
                self.lose_state(moment, Some((holder, holding.stepped)))
            }
        }
    }

    /// Living stations with the configuration of this remote I/O, also those that have not joined yet.
    pub(super) fn own_stations(&self) -> usize {
        let all = StationSet::first(self.settings.agreement.schedule.stations());
        let living: StationSet = self
            .arbiter
            .holders
            .stations()
            .filter(|station| self.arbiter.holders.is_living(*station))
            .collect();
        all.without(self.member.flagged()).or(living).len()
    }

    /// Whether as many members of this cluster have another configuration as stations have this one: what starts cold then may be a wrong program
    /// next to the right one.
    fn may_have_the_wrong_program(&self) -> bool {
        let others = self.member.refused();
        others > 0 && (self.own_stations() <= others || self.has_another_configuration())
    }

    fn verdict(&self) -> Verdict {
        let Some((from, newest)) = self.arbiter.holders.newest() else {
            return self.warm_verdict();
        };
        let proved = match &self.arbiter.knowledge {
            Knowledge::Known { floor, .. } => {
                let mut holdings = self.arbiter.holders.holdings();
                return match holdings.find(|(_, holding)| holding.lineage == floor.lineage) {
                    Some((from, holding)) => Verdict::Adopt(from, *holding),
                    None => Verdict::Stale(from, *newest),
                };
            }
            Knowledge::Listening { .. } => {
                self.newest_applied().is_none_or(|applied| applied <= newest.stepped)
                    && self.arbiter.holders.covers_all_applied(newest)
            }
            // Outputs applied before the cold start are not known, and none was applied since.
            Knowledge::ColdStarted { run, .. } => newest.born == run.history.born(),
        };
        match self.arbiter.holders.disputed() {
            Some(stations) => Verdict::Disputed(stations),
            None if !proved => Verdict::Stale(from, *newest),
            None => Verdict::Adopt(from, *newest),
        }
    }

    fn asks_for_lost_state(&self) -> bool {
        matches!(self.arbiter.question, Some(Question::StateLost { .. }))
    }

    /// The state that the newest applied output came from is lost; `newest` is the newest one that a station has, held or retained. It is reported again
    /// where another one has become the newest, which the operator would choose; not while that changes from cycle to cycle, because another author
    /// drives the stations.
    fn lose_state(&mut self, moment: Moment, newest: Option<(StationId, Moment)>) {
        let (holder, newest) = newest.unzip();
        if let Some(Question::StateLost { told, newest: last }) = self.arbiter.question
            && (told == newest || last != newest)
        {
            self.arbiter.question = Some(Question::StateLost { told, newest });
            return;
        }
        let applied = self.newest_applied().or_else(|| self.applied_of_another());
        let asks = self.asks_for_lost_state()
            || self.settings.fallback.stale_state == StaleState::Operator
            || self.settings.fallback.restart == Some(Restart::Operator)
            || self.may_have_the_wrong_program();
        let reason = self.reason_to_ask();
        // Stations that hold a state recall the inputs of its last sample.
        let retained = newest.filter(|_| self.arbiter.holders.newest().is_none());
        let inputs = retained.and_then(|newest| self.old_inputs(newest));
        let event = Event::StateLost { moment, applied, newest, holder, asks, reason, inputs };
        self.become_asking(Question::StateLost { told: newest, newest }, event);
        if !asks {
            self.start_cold(moment, applied);
        }
    }

    /// Applies the operator's choice.
    pub(super) fn choose(&mut self, choice: StateChoice) {
        let moment = self.moment();
        let held = self.arbiter.holders.newest().map(|(from, newest)| (from, *newest));
        let retained = self.newest_retained().map(|(from, kept)| (from, *kept));
        let retained =
            retained.filter(|_| held.is_none() && self.settings.fallback.restart.is_some());
        let newest = held.or(retained.map(|(from, kept)| (from, kept.holding)));
        match (self.arbiter.question, choice, newest) {
            (
                Some(Question::StateLost { .. } | Question::ConfigurationDisputed),
                StateChoice::Cold,
                _,
            ) => self.start_cold(moment, None),
            (Some(_), StateChoice::Newest { .. }, Some((_, newest))) if !self.can_read(&newest) => {
                return self.refuse_choice(OrderRefusal::NotPrepared);
            }
            (Some(_), StateChoice::Newest { cycle }, Some((from, newest)))
                if cycle.is_none_or(|cycle| cycle == newest.stepped.cycle) =>
            {
                match retained {
                    Some(retained) => self.start_warm(moment, retained),
                    None => self.start(moment, (from, newest)),
                }
            }
            (question, ..) => {
                let refusal = match (question, newest) {
                    (None, _) => OrderRefusal::NoChoice,
                    (Some(_), None) => OrderRefusal::NoState,
                    (Some(_), Some((_, newest))) => {
                        OrderRefusal::OtherState { newest: newest.stepped }
                    }
                };
                return self.refuse_choice(refusal);
            }
        }
        self.obeyed(Ok(()));
    }

    /// The question stays.
    pub(super) fn refuse_choice(&mut self, refusal: OrderRefusal) {
        self.report(Event::ChoiceRefused { moment: self.moment(), refusal });
        self.obeyed(Err(refusal));
    }

    /// Starts to sample from the state of a station.
    fn start(&mut self, moment: Moment, (from, holding): (StationId, Holding)) {
        let lineage = holding.lineage;
        self.report(Event::AdoptedLineage { moment, lineage, from });
        let capacity = self.settings.agreement.history;
        let sent = self.pairing.as_ref().and_then(|pairing| pairing.received());
        // Proven outputs that the other remote I/O was not allowed to drive are not released by its failure.
        if self.settings.fallback.release == Release::Operator {
            let drives = match sent {
                Some(sample) => sample.drives,
                None => self.was_released(from, &holding),
            };
            self.arbiter.become_authorised(drives);
        }
        // With the samples that the other one has sent, a station that lacks some of them follows at once.
        let known = sent.and_then(|sample| History::received(sample, lineage, capacity));
        let history = known
            .unwrap_or_else(|| History::from(holding.born, (holding.version, lineage), capacity));
        self.sample_from(moment, history, Some((from, holding)));
    }

    /// Whether the operator has released the program since the start that a state comes from: an output of it was applied, as this remote I/O knows, has
    /// noted, or as the station recalls. A restart of this remote I/O releases nothing.
    fn was_released(&self, from: StationId, holding: &Holding) -> bool {
        if !matches!(self.arbiter.knowledge, Knowledge::Listening { .. }) {
            return self.arbiter.authority == Authority::Proof;
        }
        let recalled = self.arbiter.holders.recalled_at(from, holding.stepped);
        let applied = self.newest_applied().max(recalled.and_then(|recalled| recalled.applied));
        applied.is_some_and(|applied| applied >= holding.born)
    }

    /// Starts to sample from the initial state; with the newest applied output, where the state that it came from is lost and no person has chosen so.
    fn start_cold(&mut self, moment: Moment, lost: Option<Moment>) {
        let awaits_release = self.become_started();
        self.report(Event::StartedCold { born: moment, awaits_release, lost });
        let history = History::genesis(self.hash(), moment, self.settings.agreement.history);
        self.sample_from(moment, history, None);
    }

    pub(super) fn sample_from(
        &mut self,
        moment: Moment,
        history: History,
        state: Option<(StationId, Holding)>,
    ) {
        self.become_author(moment);
        self.lay_out(history.program().unwrap_or(self.hash()));
        self.protection.starts(state.is_none());
        if self.arbiter.knowledge.floor().is_none() {
            self.remember(moment, state);
        }
        let void = self.inputs.writing.lose(&self.layout.operator_inputs, moment, |_| true);
        self.report_void(&void);
        if state.is_none() && self.is_first_start() {
            self.take_up_writes();
        }
        self.note_begin(state.is_none().then_some(history.born()));
        let adopted =
            state.map(|(_, holding)| Floor { moment: holding.stepped, lineage: holding.lineage });
        self.become_running(history, adopted);
    }

    /// After a restart: restores what the stations recall.
    fn remember(&mut self, moment: Moment, state: Option<(StationId, Holding)>) {
        self.arbiter.holders.recall_gone();
        let recalled = state.and_then(|(from, holding)| {
            let recalled = self.arbiter.holders.recalled_at(from, holding.stepped)?;
            Some((recalled, holding.stepped))
        });
        if let Some((recalled, stepped)) = recalled {
            let recalled = &self.recalled_by_these_points(recalled.clone());
            self.inputs.diagnosing.recall(&recalled.inputs);
            self.inputs.field = recalled.inputs.clone();
            let missed = if stepped <= recalled.sampled {
                Some(0)
            } else if stepped.epoch == recalled.sampled.epoch {
                u32::try_from(stepped.cycle.0 - recalled.sampled.cycle.0).ok()
            } else {
                None
            };
            self.inputs.writing.recall(&self.layout.operator_inputs, recalled, missed);
        }
        let stations = self.arbiter.holders.excluded();
        if !self.arbiter.knowledge.pardons() && !stations.is_empty() {
            self.become_distrustful(moment, stations);
        }
    }
}
