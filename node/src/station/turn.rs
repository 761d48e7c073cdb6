//! The token: whose turns were heard, and when this station takes its own.

use std::time::Duration;

use smallvec::SmallVec;
use understudy_cycle::Mode;
use understudy_wire::{
    Holding, Moment, ProgramId, ProgramSet, StationId, StationSet, Time, Turn, Word,
};

use super::{Said, Station, Token};
use crate::event::Event;
use crate::replica::{Replica, Standing};
use crate::{generated, words};

/// How often a station says which states it holds.
const STATES_EVERY: Duration = Duration::from_secs(2);

impl Station {
    pub(super) fn hear_turn(&mut self, station: StationId, turn: &Turn) {
        if !self.member.attendance.heard(station) {
            return;
        }
        let own_program = ProgramId(station.0);
        let understudy = self.settings.agreement.schedule.is_understudy(station);
        for word in &turn.words {
            let mut holdings = turn.holdings.iter();
            if !understudy
                && word.mask == ProgramSet::only(own_program)
                && let Some(own) = holdings.find(|holding| holding.program == own_program)
            {
                self.cycle.said.push(Said {
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
        self.is_told(&turn.recalled);
        self.hear_claims(station, &turn.holdings, &turn.recalled);
        self.compare(station, &turn.holdings);
    }

    /// Equal lineages mean equal states; where the digests differ all the same, a value has been corrupted.
    pub(super) fn compare(&mut self, station: StationId, holdings: &[Holding]) {
        let moment = self.member.moment();
        for theirs in holdings {
            let Some(replica) = self
                .replicas
                .iter_mut()
                .find(|replica| replica.id() == theirs.program)
            else {
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

    /// Programs whose controllers have said in this cycle what this station would say of them.
    fn confirmed(&self) -> ProgramSet {
        let said = self.cycle.said.iter().filter(|said| {
            let replica = self.replicas.iter().find(|it| it.id() == said.program);
            replica.is_some_and(|replica| {
                replica.outputs() == &said.outputs
                    && replica.holding().is_some_and(|ours| {
                        ours.lineage == said.lineage && ours.digest == said.digest
                    })
            })
        });
        said.map(|said| said.program).collect()
    }

    /// It speaks when it has the token and knows its outputs, and at the last call whatever it knows.
    pub(super) fn speak_if_it_is_time(&mut self, now: Time) {
        let Some(moment) = self.member.clock.moment() else {
            return;
        };
        if self.cycle.token == Token::Passed || !self.speaks() {
            return;
        }
        let due = self.speaks_by(moment);
        let early =
            self.has_token() && self.knows_all_outputs(moment) && self.has_what_others_lack();
        if now >= due || early {
            self.speak(now, moment);
        }
    }

    /// Whether everybody whom it has to wait for has published: its predecessor, or for an understudy all before it.
    pub(super) fn has_token(&self) -> bool {
        let before = StationSet::first(self.own().index());
        let waited_for = before.without(self.member.flagged());
        let missing = waited_for.without(self.member.published());
        if self.is_understudy() {
            missing.is_empty()
        } else {
            let predecessor = waited_for.iter().last();
            predecessor.is_none_or(|predecessor| !missing.contains(predecessor))
        }
    }

    pub(super) fn knows_all_outputs(&self, moment: Moment) -> bool {
        self.replicas
            .iter()
            .filter(|replica| replica.standing() == Standing::Proven)
            .all(|replica| replica.is_current(moment))
    }

    /// Says what it holds, every [`STATES_EVERY`].
    fn report_states(&mut self, moment: Moment) {
        let period = self.settings.agreement.schedule.period();
        let cycles = STATES_EVERY.as_nanos() / period.as_nanos().max(1);
        if u128::from(moment.cycle.0) % cycles.max(1) + 1 < cycles {
            return;
        }
        for place in 0..self.replicas.len() {
            let replica = &self.replicas[place];
            if let Some((lineage, state)) = replica.state().filter(|_| replica.may_speak(moment)) {
                let event = Event::Holds {
                    moment,
                    program: replica.id(),
                    lineage,
                    state: state.clone(),
                };
                self.report(event);
            }
        }
    }

    pub(super) fn speak(&mut self, now: Time, moment: Moment) {
        self.cycle.token = Token::Passed;
        let words = self.words(moment);
        self.report(Event::Published {
            moment,
            words: words.clone(),
        });
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
        let known = self.replicas.iter().filter(|it| it.may_speak(moment));
        let agreement = &self.settings.agreement;
        if !self.is_understudy() {
            return known
                .flat_map(|replica| words::of_controller(replica.id(), replica.outputs()))
                .collect();
        }
        let all = ProgramSet::first(agreement.schedule.controllers());
        let known = known.map(Replica::id).collect();
        match (agreement.mode, &self.settings.generated) {
            (Mode::Full, _) => {
                words::of_understudy(Mode::Full, all, known, self.confirmed(), |program| {
                    let replica = self.replicas.iter().find(|replica| replica.id() == program);
                    replica.map(Replica::outputs)
                })
            }
            (Mode::Paper, Some(scan)) if known == all => {
                let steps = self.replicas.iter().map(Replica::last_step);
                let sum = generated::outputs(scan, &mut self.scratch, steps);
                sum.into_iter().map(|sum| Word { mask: all, sum }).collect()
            }
            (Mode::Paper, _) => SmallVec::new(),
        }
    }

    pub(super) fn speaks_at(&self) -> Option<Time> {
        let moment = self.member.clock.moment()?;
        let may = self.cycle.token == Token::Awaited && self.speaks();
        may.then(|| self.speaks_by(moment))
    }

    fn speaks_by(&self, moment: Moment) -> Time {
        let schedule = &self.settings.agreement.schedule;
        self.member.clock.anchor()
            + if self.knows_all_outputs(moment) {
                schedule.slot(self.own())
            } else {
                schedule.last_call()
            }
    }
}
