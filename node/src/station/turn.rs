//! The turns: those that were received, and the time at which this station publishes its own.

use std::time::Duration;

use smallvec::SmallVec;
use understudy_cycle::Turns;
use understudy_wire::{
    Holding, Moment, ProgramSet, Segment, StationId, StationSet, Time, Turn, Word,
};

use super::{ControllerTurn, Station, Token, place_of, replica_mut};
use crate::event::Event;
use crate::replica::{Replica, Standing};
use crate::words;

/// Time between two reports of the states that a station holds.
pub const STATES_EVERY: Duration = Duration::from_secs(2);

impl Station {
    pub(super) fn receive_turn(&mut self, station: StationId, turn: &Turn) {
        if !self.member.attendance.receive_turn(station) {
            return;
        }
        // Turns of most controllers do not come here: the others say who published.
        if !self.is_understudy() {
            self.member.attendance.attest(turn.heard);
        }
        let own_program = station.controlled();
        let understudy = self.settings.agreement.schedule.is_understudy(station);
        for word in &turn.words {
            if !understudy
                && word.mask == ProgramSet::only(own_program)
                && let Some(own) = Holding::of(&turn.holdings, own_program)
            {
                self.cycle.controller_turns.push(ControllerTurn {
                    program: own_program,
                    lineage: own.lineage,
                    digest: own.digest,
                    outputs: word.sum.clone(),
                });
            }
            if station < self.own() {
                self.cycle.others_have = self.cycle.others_have.or(word.mask);
            }
        }
        self.take_recalled(&turn.recalled);
        self.receive_holdings(station, &turn.holdings, &turn.recalled);
        self.compare(station, &turn.holdings);
    }

    /// Equal lineages mean equal states; digests that differ nevertheless show a value fault.
    pub(super) fn compare(&mut self, station: StationId, holdings: &[Holding]) {
        let moment = self.member.moment();
        for theirs in holdings {
            let Some(replica) = replica_mut(&mut self.replicas, theirs.program) else {
                continue;
            };
            let differs = replica
                .holding()
                .is_some_and(|ours| ours.lineage == theirs.lineage && ours.digest != theirs.digest);
            if !differs {
                continue;
            }
            if matches!(replica.standing(), Standing::Shadow(_)) {
                replica.discard();
            }
            self.cycle.differs.push((theirs.program, station));
            if !self.differed.contains(&(theirs.program, station)) {
                self.member.report(Event::DigestDiffers {
                    moment,
                    program: theirs.program,
                    station,
                });
            }
        }
    }

    /// Programs whose controllers have published the outputs that this station computes for them, in this cycle.
    fn confirmed(&self) -> ProgramSet {
        let equal = self.cycle.controller_turns.iter().filter(|turn| {
            self.replica(turn.program).is_some_and(|replica| {
                replica.outputs() == &turn.outputs
                    && replica.holding().is_some_and(|ours| {
                        ours.lineage == turn.lineage && ours.digest == turn.digest
                    })
            })
        });
        equal.map(|turn| turn.program).collect()
    }

    /// Publishes when this station has the token and knows its outputs, and at the last call the outputs that it knows.
    pub(super) fn publish_if_due(&mut self, now: Time) {
        if self.cycle.token == Token::Passed || !self.publishes() {
            return;
        }
        let Some(moment) = self.member.clock.moment() else {
            return;
        };
        let due = self.publishes_by(moment);
        let early =
            self.has_token() && self.knows_all_outputs(moment) && self.relay.has_what_others_lack();
        if now >= due || early {
            self.publish(now, moment);
        }
    }

    /// Whether all stations that it waits for have published; see [`Turns`].
    pub(super) fn has_token(&self) -> bool {
        let schedule = &self.settings.agreement.schedule;
        let controllers = StationSet::first(schedule.controllers());
        let before = StationSet::first(self.own().index());
        let waited_for = before.without(self.member.flagged());
        let missing = waited_for.without(self.member.published());
        match (self.is_understudy(), schedule.turns()) {
            (true, Turns::Token) => missing.is_empty(),
            (true, Turns::Parallel) => missing.and(controllers).is_empty(),
            (false, Turns::Parallel) if self.received_understudy() => true,
            (false, _) => {
                let predecessor = waited_for.iter().last();
                predecessor.is_none_or(|predecessor| !missing.contains(predecessor))
            }
        }
    }

    /// Whether an understudy told it in the last cycle who published.
    fn received_understudy(&self) -> bool {
        let schedule = &self.settings.agreement.schedule;
        let controllers = StationSet::first(schedule.controllers());
        let understudies = StationSet::first(schedule.stations()).without(controllers);
        self.member.attendance.published_last(understudies)
    }

    pub(super) fn knows_all_outputs(&self, moment: Moment) -> bool {
        self.replicas
            .iter()
            .filter(|replica| replica.standing() == Standing::Proven)
            .all(|replica| replica.is_current(moment))
    }

    /// Reports the states that it holds, every [`STATES_EVERY`]; a state of several segments is too long for a record.
    fn report_states(&mut self, moment: Moment) {
        let period = self.settings.agreement.schedule.period();
        let cycles = STATES_EVERY.as_nanos() / period.as_nanos().max(1);
        if u128::from(moment.cycle.0) % cycles.max(1) + 1 < cycles {
            return;
        }
        for place in 0..self.replicas.len() {
            let replica = &self.replicas[place];
            let state = replica.state().filter(|(_, state)| {
                replica.may_publish(moment) && Segment::count(state.width()) == 1
            });
            if let Some((lineage, state)) = state {
                let (program, of) = (replica.id(), replica.last_step().program);
                let (of, state) = (Some(of), state.clone());
                self.report(Event::Holds { moment, program, of, lineage, state });
            }
        }
    }

    pub(super) fn publish(&mut self, now: Time, moment: Moment) {
        self.cycle.token = Token::Passed;
        let words = self.words(moment);
        self.report(Event::Published { moment, words: words.clone() });
        self.report_states(moment);
        let turn = Turn {
            heard: self.member.published(),
            holdings: self.holdings(),
            words,
            recalled: self.recalled(moment),
            lacks: self.lacks(),
            relayed: Vec::new(),
        };
        let body = self.with_relayed(turn);
        self.member.send_cyclic(now, body);
    }

    fn words(&mut self, moment: Moment) -> SmallVec<[Word; 2]> {
        let known = self.replicas.iter().filter(|it| it.may_publish(moment));
        let agreement = &self.settings.agreement;
        if !self.is_understudy() {
            return known
                .flat_map(|replica| words::of_controller(replica.id(), replica.outputs()))
                .collect();
        }
        let all = ProgramSet::first(agreement.schedule.controllers());
        let known = known.map(Replica::id).collect();
        let masks = words::masks_of_understudy(agreement.mode, all, known, self.confirmed());
        let replicas = &self.replicas;
        let outputs_of = |program| {
            let place = place_of(replicas, program)?;
            Some(replicas[place].outputs())
        };
        let is_first = |replica: &Replica| {
            replica.last_step().program == self.settings.programs[replica.id().index()].hash
        };
        // It is generated from the programs that this station started with.
        let generated = self.settings.generated.as_ref();
        let generated = generated.filter(|_| self.replicas.iter().all(is_first));
        let word_of = |mask| match generated {
            None => understudy_parity::sum(mask, outputs_of),
            Some(generated) => {
                let steps = self.replicas.iter().map(Replica::last_step);
                let sum = generated.outputs(&mut self.scratch, steps)?;
                Some(Word { mask, sum })
            }
        };
        masks.into_iter().filter_map(word_of).collect()
    }

    pub(super) fn publishes_at(&self) -> Option<Time> {
        let moment = self.member.clock.moment()?;
        let may = self.cycle.token == Token::Awaited && self.publishes();
        may.then(|| self.publishes_by(moment))
    }

    fn publishes_by(&self, moment: Moment) -> Time {
        let schedule = &self.settings.agreement.schedule;
        self.member.clock.anchor()
            + if self.knows_all_outputs(moment) {
                schedule.slot(self.own())
            } else {
                schedule.last_call()
            }
    }
}
