//! The arbiter's side: what is added to the history of the program in each cycle.

use understudy_wire::{Body, Image, Moment, Sample, Source, Step, Time, WriteId};

use super::{Authority, Execution, RemoteIo};
use crate::diagnosis::Observation;
use crate::event::Event;

impl RemoteIo {
    /// The inputs that the program reads from now on, from the sensors and the findings of the diagnosis.
    fn see(&mut self, moment: Moment, sensors: Image) {
        let mut shown = sensors;
        let mut unsteady = None;
        if let Some(diagnosis) = &self.settings.diagnosis {
            let applied = self.applied.as_ref();
            let outputs =
                applied.map_or(&self.settings.fallback.fail_safe, |applied| &applied.outputs);
            let observation = Observation {
                sensors: &shown,
                driven: &self.forcing.outputs(outputs),
                is_true: applied.is_some_and(|applied| {
                    matches!(applied.source, Source::Direct | Source::Reconstructed)
                }),
            };
            let found = self.diagnosing.scan(diagnosis, observation);
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
        self.field = self.layout.seen(&self.field, &shown, unsteady.as_ref());
    }

    /// Takes u(i)(t) and sends it. Where the sensors are not known no sample is sent, so that no station steps the
    /// program: it continues from its state when the sensors are known again.
    pub(super) fn sample(&mut self, now: Time) {
        if self.knowledge.run().is_none() || !self.may_sample() {
            return;
        }
        let Some(sensors) = self.read_field() else {
            return;
        };
        let moment = self.moment();
        self.sampled_at = now;
        let own = self.hash();
        let floor = self.knowledge.floor();
        let Some(run) = self.knowledge.run_mut() else {
            return;
        };
        let history = &mut run.history;
        let places =
            self.holders.holdings().filter_map(|(_, holding)| history.place(holding.lineage));
        let living = places.fold(None, |range: Option<(usize, usize)>, place| {
            let (oldest, newest) = range.unwrap_or((place, place));
            Some((oldest.min(place), newest.max(place)))
        });
        let before = self.writing.in_history(history);
        let void = history.make_room(living, floor.map(|floor| floor.lineage));
        let is_lost =
            |id: WriteId| before.iter().any(|(it, place)| *it == id && !history.keeps(*place));
        let mut void_writes = self.writing.lose(&self.layout.operator_inputs, moment, is_lost);
        let before_change = history.program();
        let (change, resets) = self.replacing.next(history, self.program);
        let version = change.or(before_change).unwrap_or(own);
        let is_laid_out = self.lay_out(version);
        let sensors = if is_laid_out { self.sensors.clone().unwrap_or(sensors) } else { sensors };
        self.see(moment, sensors);
        let newest = self.knowledge.run().and_then(|run| run.history.newest());
        let newest = newest.and_then(|inputs| self.by_these_points(inputs, before_change));
        let version = self.named(Some(version));

        let Some(run) = self.knowledge.run_mut() else {
            return;
        };
        let history = &mut run.history;
        let operator_inputs = &self.layout.operator_inputs;
        let mut unforced = self.field.clone();
        self.writing.put(operator_inputs, newest.as_ref().or(history.newest()), &mut unforced);
        let validity = self.signals.put(&self.layout.signals, moment, &mut unforced);
        let mut inputs = self.forcing.inputs(unforced.clone());
        if let Some(stop) = self.layout.stop
            && resets
        {
            inputs.set(stop.reset, true);
            unforced.set(stop.reset, true);
            self.program = Execution::Stopped;
        }
        history.push(Step { change, inputs: inputs.clone() });
        run.sampled = true;

        let forced = |input| self.forcing.refuses_write(input, now);
        void_writes.extend(self.writing.sampled(operator_inputs, moment, history, &forced));
        self.writing.put_forced(operator_inputs, &forced, &mut unforced);
        let base = history.base();
        let (born, before, after) = (history.born(), history.before(), history.head());
        let samples = history.samples();
        let noted = self.noting.is_on().then(|| unforced.clone());
        let body = Body::Sample(Sample {
            born,
            base,
            before,
            after,
            history: samples,
            applied: floor.map(|floor| floor.moment),
            excluded: self.trust.excluded(),
            gone: self.holders.gone(),
            drives: self.authority == Authority::Proof
                && !self.trust.suspects()
                && self.program == Execution::Running,
            writes: self.writing.ids(),
            pulses: self.writing.pulses(operator_inputs),
            unforced: (unforced != inputs).then_some(unforced),
            version,
        });
        if void > 0 {
            self.report(Event::Voided { moment, samples: void, lineage: base });
        }
        if let Some(noted) = noted {
            self.prepare_note(moment, after, noted);
        }
        self.note_change(before_change, change);
        if let Some(to) = change {
            self.report(Event::ProgramChanged { moment, from: before_change, to });
        }
        self.note_own_sample();
        self.report(Event::Sampled { moment, inputs, born, before, change });
        self.report_void(&void_writes);
        self.report_validity(&validity);
        self.member.send_cyclic(now, body);
    }
}
