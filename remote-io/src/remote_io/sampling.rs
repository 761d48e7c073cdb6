//! The arbiter's side: what is added to the history of the program in each cycle.

use understudy_wire::{Body, Sample, Step, Time, WriteId};

use super::RemoteIo;
use super::actuation::{Applied, Execution};
use super::arbiter::Authority;
use super::inputs::{SampledInputs, Sampling};
use crate::event::Event;

impl RemoteIo {
    /// Takes u(i)(t) and sends it. Where the sensors are not known no sample is sent, so that no station steps the
    /// program: it continues from its state when the sensors are known again.
    pub(super) fn sample(&mut self, now: Time) {
        if self.arbiter.knowledge.run().is_none() || !self.may_sample() {
            return;
        }
        let Some(sensors) = self.read_field() else {
            return;
        };
        let moment = self.moment();
        self.sampled_at = now;
        let own = self.hash();
        let floor = self.arbiter.knowledge.floor();
        let Some(run) = self.arbiter.knowledge.run_mut() else {
            return;
        };
        let history = &mut run.history;
        let places = self
            .arbiter
            .holders
            .holdings()
            .filter_map(|(_, holding)| history.place(holding.lineage));
        let living = places.fold(None, |range: Option<(usize, usize)>, place| {
            let (oldest, newest) = range.unwrap_or((place, place));
            Some((oldest.min(place), newest.max(place)))
        });
        let before = self.inputs.writing.in_history(history);
        let void = history.make_room(living, floor.map(|floor| floor.lineage));
        let is_lost =
            |id: WriteId| before.iter().any(|(it, place)| *it == id && !history.keeps(*place));
        let mut void_writes =
            self.inputs.writing.lose(&self.layout.operator_inputs, moment, is_lost);
        let before_change = history.program();
        let (change, resets) = self.replacing.next(history, self.actuation.execution);
        let version = change.or(before_change).unwrap_or(own);
        let is_laid_out = self.lay_out(version);
        let sensors =
            if is_laid_out { self.inputs.sensors.clone().unwrap_or(sensors) } else { sensors };
        let newest = self.arbiter.knowledge.run().and_then(|run| run.history.newest());
        let newest = newest.and_then(|inputs| self.by_these_points(inputs, before_change));
        let version = self.named(Some(version));

        let Some(run) = self.arbiter.knowledge.run_mut() else {
            return;
        };
        let history = &mut run.history;
        let operator_inputs = &self.layout.operator_inputs;
        let applied = self.actuation.applied.as_ref();
        let fail_safe = &self.settings.fallback.fail_safe;
        let SampledInputs { inputs, mut unforced, diagnosed, validity } =
            self.inputs.sample(Sampling {
                moment,
                layout: &self.layout,
                sensors,
                diagnosis: self.settings.diagnosis.as_deref(),
                driven: (
                    applied.map_or(fail_safe, |applied| &applied.outputs),
                    applied.is_some_and(Applied::is_proved),
                ),
                newest: newest.as_ref().or(history.newest()),
                resets,
            });
        if resets && self.layout.stop.is_some() {
            self.actuation.note_reset();
        }
        history.push(Step { change, inputs: inputs.clone() });
        run.sampled = true;

        let forced = |input| self.inputs.forcing.refuses_write(input, now);
        void_writes.extend(self.inputs.writing.sampled(operator_inputs, moment, history, &forced));
        self.inputs.writing.put_forced(operator_inputs, &forced, &mut unforced);
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
            excluded: self.arbiter.trust.excluded(),
            gone: self.arbiter.holders.gone(),
            drives: self.arbiter.authority == Authority::Proof
                && !self.arbiter.trust.suspects()
                && self.actuation.execution == Execution::Running,
            writes: self.inputs.writing.ids(),
            pulses: self.inputs.writing.pulses(operator_inputs),
            unforced: (unforced != inputs).then_some(unforced),
            version,
        });
        if let Some(failed) = diagnosed {
            self.report(Event::Diagnosed { moment, failed });
        }
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
