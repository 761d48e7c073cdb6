//! The deadline: something is driven at every one, and only what is true, held, or fail-safe.

use understudy_cycle::{Output, ValueFault};
use understudy_wire::{Image, Moment, StationSet, Time};

use super::actuation::{Applied, Execution};
use super::arbiter::{Authority, Question};
use super::knowledge::Run;
use super::{Deadline, RemoteIo};
use crate::event::{Event, Missing};
use crate::history::History;
use crate::selection::{Received, Selection};
use crate::trust::Accusation;

impl RemoteIo {
    /// The deadline of a cycle that was started. Turns that were received are discarded if it comes a period late.
    pub(super) fn decide(&mut self, now: Time) {
        let late = now.since(self.decides_at()) > self.settings.agreement.schedule.period();
        self.note_lateness(now);
        self.deadline = Deadline::Passed { idle: 0 };
        let received = Received {
            turns: &self.turns,
            controllers: self.settings.agreement.schedule.controllers(),
            mode: self.settings.agreement.mode,
        };
        let settings = &self.settings;
        let width = settings.fallback.fail_safe.width();
        let mut accusation = None;
        let (selection, sampled) = match self.arbiter.knowledge.run() {
            None => (Selection::Missing(Missing::NoHistory), None),
            Some(Run { sampled: false, .. }) if !self.is_sensed() => {
                (Selection::Missing(Missing::BadQuality), None)
            }
            Some(Run { sampled: false, .. }) => (Selection::Missing(Missing::NoCycle), None),
            Some(Run { history, .. }) if late => {
                let sampled = self.field_sampled(history);
                (Selection::Missing(Missing::TooLate), Some(sampled))
            }
            Some(Run { history, .. }) => {
                let (truth, answer) = (history.head(), settings.fallback.value_fault);
                let (selected, found) = received.select(
                    settings.program,
                    truth,
                    width,
                    &mut self.arbiter.trust,
                    answer,
                );
                accusation = found;
                let selection = match self.arbiter.authority {
                    Authority::Proof => selected,
                    Authority::Operator => Selection::Missing(Missing::NotReleased),
                };
                (selection, Some(self.field_sampled(history)))
            }
        };
        let selection = self.unless_stopped(selection);
        let moment = self.moment();
        if let Some(Accusation { accused, located }) = accusation {
            self.report(Event::ValueFault {
                moment,
                accused,
                located,
                answer: self.settings.fallback.value_fault,
            });
        }
        self.report_differences(moment);
        let doubted = matches!(selection, Selection::Missing(Missing::ValueFault));
        if doubted && self.settings.fallback.value_fault == ValueFault::FailSafe {
            self.become_doubtful();
        }
        // What remote I/Os of other programs would discard as well.
        if late {
            self.miss_signals();
        } else {
            self.take_signals();
        }
        self.apply(selection, sampled, self.member.published());
        self.watch_protection();
        self.end_pair_deadline(now);
    }

    /// Periods that have passed since the deadline which is decided now.
    pub(super) fn periods_late(&self, now: Time) -> u32 {
        let period = self.settings.agreement.schedule.period();
        let passed = now.since(self.decides_at()).as_nanos() / period.as_nanos();
        u32::try_from(passed).unwrap_or(u32::MAX)
    }

    /// A remote I/O that was suspended for longer than outputs are held has missed these deadlines: what it proved before is not held any more.
    /// Fewer missed deadlines are counted by the frames of their cycles, which have waited meanwhile.
    pub(super) fn note_lateness(&mut self, now: Time) {
        let passed = self.periods_late(now);
        if passed >= self.settings.fallback.hold_cycles {
            self.actuation.missed = self.actuation.missed.max(passed);
        }
    }

    /// Outputs that the stations have proved and that a stopped program gives: they are those before its fault, and only held as such.
    fn unless_stopped(&mut self, selection: Selection) -> Selection {
        let (Some(stop), Selection::Direct(outputs) | Selection::Reconstructed(outputs, _)) =
            (self.layout.stop, &selection)
        else {
            return selection;
        };
        let is_stopped = outputs.get(stop.stopped);
        self.actuation.note_execution(is_stopped);
        if !is_stopped {
            self.replacing.runs();
            return selection;
        }
        let moment = self.moment();
        let void = self.inputs.writing.not_executed(&self.layout.operator_inputs, moment);
        self.report_void(&void);
        self.take_back();
        Selection::Missing(Missing::ProgramFault)
    }

    pub(super) fn received(&self) -> Received<'_> {
        Received {
            turns: &self.turns,
            controllers: self.settings.agreement.schedule.controllers(),
            mode: self.settings.agreement.mode,
        }
    }

    /// Reports words and states of any program that do not agree, when they begin to differ.
    fn report_differences(&mut self, moment: Moment) {
        let syndromes: Vec<_> = self.received().syndromes().collect();
        let states = self.received().digest_differences();
        let before = std::mem::take(&mut self.differed);
        for (syndrome, accused) in syndromes {
            self.differed.push((None, accused));
            if !before.contains(&(None, accused)) {
                self.report(Event::Syndrome { moment, syndrome, accused });
            }
        }
        for (program, accused) in states {
            self.differed.push((Some(program), accused));
            if !before.contains(&(Some(program), accused)) {
                self.report(Event::DigestDiffers { moment, program, accused });
            }
        }
    }

    /// u(i)(t), which the sensors may have left since.
    pub(super) fn field_sampled(&self, history: &History) -> Image {
        history.newest().cloned().unwrap_or_else(|| self.inputs.field.clone())
    }

    /// Applies the outputs of a deadline, of a cycle in which these stations were received.
    pub(super) fn apply(
        &mut self,
        selection: Selection,
        sampled: Option<Image>,
        heard: StationSet,
    ) {
        if !self.may_drive() {
            return;
        }
        let selection = match (selection, self.arbiter.question) {
            (
                Selection::Missing(Missing::NotSynchronised | Missing::NoHistory),
                Some(Question::StateLost { .. }),
            ) => Selection::Missing(Missing::StateLost),
            (selection, _) => selection,
        };
        let (applied, word_of) = self.actuation.apply(selection, &self.settings.fallback);
        let Applied { source, outputs, missing } = applied.clone();
        let moment = self.moment();
        if missing.is_none() {
            self.arbiter.knowledge.applied(moment);
            self.note_applied(moment);
            self.report_in_effect(moment);
        } else {
            self.note_not_applied(moment);
        }
        let mut driven = self.inputs.forcing.outputs(&outputs);
        if let Some(stop) = self.layout.stop {
            driven.set(stop.stopped, self.actuation.execution != Execution::Running);
        }
        let outputs_of_modules = self.divide(&driven);
        self.member.put(Output::Drive {
            outputs: outputs_of_modules,
            sampled: missing.is_none().then_some(self.sampled_at),
        });
        self.report(Event::Applied {
            moment,
            sampled,
            driven: Some(driven).filter(|driven| *driven != outputs),
            outputs,
            source,
            word_of,
            missing,
            points: self.named(Some(self.laid_out)),
            heard,
        });
    }

    /// The next deadline: of this cycle, or of one that no station has started in time.
    pub(super) fn decides_at(&self) -> Time {
        let schedule = &self.settings.agreement.schedule;
        let deadline = self.member.clock.anchor() + schedule.deadline();
        match self.deadline {
            Deadline::Ahead => deadline,
            Deadline::Passed { idle } => {
                deadline + schedule.period() * (idle + 1) + schedule.grace()
            }
        }
    }
}
