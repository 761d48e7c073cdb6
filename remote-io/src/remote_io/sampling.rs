//! The arbiter's side: from which history the program goes on, and what is added to it in each cycle.

use std::sync::Arc;

use understudy_wire::{Body, Moment, Output, Sample, Time};

use super::{Phase, RemoteIo};
use crate::event::Event;
use crate::history::History;
use crate::settings::Release;

impl RemoteIo {
    /// Listens until it is known who holds which state; notices when nobody is on this history any more.
    pub(super) fn find_history(&mut self, moment: Moment) {
        let listen_cycles = self.settings.agreement.listen_cycles;
        match &mut self.phase {
            Phase::Running {
                history,
                unfollowed,
                ..
            } => {
                let mut holdings = self.witnesses.holdings();
                let followed =
                    holdings.any(|(_, holding)| history.place(holding.lineage).is_some());
                *unfollowed = if followed || !self.witnesses.anybody() {
                    0
                } else {
                    *unfollowed + 1
                };
                if *unfollowed > listen_cycles {
                    self.phase = Phase::LISTENING;
                }
            }
            Phase::Listening { cycles, disputed } => {
                *cycles += u32::from(self.witnesses.anybody());
                // One who could hold the state and is not there gets longer: it may be the only one that does.
                let patience = if self.witnesses.everybody() { 1 } else { 5 };
                // A history without a sample is one that nobody can follow.
                if *cycles < listen_cycles * patience || self.field_lost {
                    return;
                }
                match self.witnesses.disputed() {
                    None => self.start(moment),
                    Some(stations) if !std::mem::replace(disputed, true) => {
                        self.report(Event::Disputed { moment, stations });
                    }
                    Some(_) => {}
                }
            }
        }
    }

    /// Starts to sample: from the newest state that lives, or cold.
    pub(super) fn start(&mut self, moment: Moment) {
        let capacity = self.settings.agreement.history;
        let newest = self
            .witnesses
            .newest()
            .map(|(station, holding)| (station, *holding));
        let history = match newest {
            Some((from, holding)) => {
                let lineage = holding.lineage;
                self.report(Event::AdoptedLineage {
                    moment,
                    lineage,
                    from,
                });
                History::from(holding.born, lineage, capacity)
            }
            None => {
                let awaits_release = self.settings.release == Release::Operator;
                self.released = !awaits_release;
                self.last_true = None;
                self.report(Event::StartedCold {
                    born: moment,
                    awaits_release,
                });
                History::genesis(self.settings.hash, moment, capacity)
            }
        };
        self.phase = Phase::Running {
            history,
            sampled: false,
            unfollowed: 0,
        };
    }

    /// Takes u(i)(t) and says it. Where it is not known nothing is said, so that nobody steps the program: it goes on from
    /// its state when the sensors can be seen again.
    pub(super) fn sample(&mut self, now: Time) {
        if self.field_lost {
            return;
        }
        let moment = self.moment();
        let inputs = self.forcing.inputs(&self.field);
        let Phase::Running {
            history, sampled, ..
        } = &mut self.phase
        else {
            return;
        };
        let living = self
            .witnesses
            .holdings()
            .filter_map(|(_, holding)| history.place(holding.lineage))
            .max();
        let void = history.push(&inputs, living);
        *sampled = true;
        let base = history.base();
        let body = Body::Sample(Sample {
            born: history.born(),
            base,
            before: history.before(),
            after: history.head(),
            history: history.samples(),
            applied: self.applied.clone(),
            excluded: self.trust.excluded(),
        });
        if void > 0 {
            self.report(Event::Voided {
                moment,
                samples: void,
                lineage: base,
            });
        }
        self.report(Event::Sampled { moment, inputs });
        let frame = Arc::new(self.frame(body));
        self.outbox.push_back(Output::Send(Arc::clone(&frame)));
        self.copies
            .sent(now, &frame, &self.settings.agreement.schedule);
    }
}
