//! The arbiter's side: from which history the program goes on, and what is added to it in each cycle.

use std::sync::Arc;

use understudy_wire::{Body, Moment, Output, Sample, Source, StationId, Time};

use super::{Phase, RemoteIo};
use crate::channel;
use crate::diagnosis::Sight;
use crate::event::Event;
use crate::history::History;
use crate::settings::Release;
use crate::trust::Trust;

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
        self.remember(moment, newest.map(|(station, _)| station));
        self.phase = Phase::Running {
            history,
            sampled: false,
            unfollowed: 0,
        };
    }

    /// After a restart: takes up from what the stations recall.
    fn remember(&mut self, moment: Moment, from: Option<StationId>) {
        if !std::mem::take(&mut self.forgetful) {
            return;
        }
        if let Some(inputs) = from.and_then(|station| self.witnesses.inputs(station)) {
            self.diagnosing.recall(inputs);
            self.field = inputs.clone();
        }
        let stations = self.witnesses.excluded();
        if !self.pardons && !stations.is_empty() {
            self.trust = Trust::excluding(stations);
            self.report(Event::RecalledExclusion { moment, stations });
        }
    }

    /// What the program sees from now on, by what the sensors show and what the diagnosis finds of it.
    fn see(&mut self, moment: Moment) {
        let mut shown = self.sensors.clone();
        let mut unsteady = None;
        if let Some(diagnosis) = &self.settings.diagnosis {
            let applied = self.applied.as_ref();
            let outputs = applied.map_or(&self.settings.fail_safe, |applied| &applied.outputs);
            let sight = Sight {
                sensors: &self.sensors,
                driven: &self.forcing.outputs(outputs),
                is_true: applied.is_some_and(|applied| {
                    matches!(applied.source, Source::Direct | Source::Reconstructed)
                }),
            };
            let found = self.diagnosing.scan(diagnosis, sight);
            for status in (0..shown.width()).filter(|&place| found.failed.get(place)) {
                shown.set(status, true);
            }
            unsteady = Some(found.unsteady);
            if self.diagnosed != found.failed {
                self.diagnosed = found.failed.clone();
                let failed = found.failed;
                self.report(Event::Diagnosed { moment, failed });
            }
        }
        let channels = &self.settings.channels;
        self.field = channel::seen(channels, &self.field, &shown, unsteady.as_ref());
    }

    /// Takes u(i)(t) and says it. Where it is not known nothing is said, so that nobody steps the program: it goes on from
    /// its state when the sensors can be seen again.
    pub(super) fn sample(&mut self, now: Time) {
        if self.field_lost {
            return;
        }
        let moment = self.moment();
        if matches!(self.phase, Phase::Running { .. }) {
            self.see(moment);
        }
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
        let (born, before) = (history.born(), history.before());
        let body = Body::Sample(Sample {
            born,
            base,
            before,
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
        self.report(Event::Sampled {
            moment,
            inputs,
            born,
            before,
        });
        let frame = Arc::new(self.frame(body));
        self.outbox.push_back(Output::Send(Arc::clone(&frame)));
        self.copies
            .sent(now, &frame, &self.settings.agreement.schedule);
    }
}
