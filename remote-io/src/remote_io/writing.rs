//! Values that operators write, from the request to the answer.
//!
//! ```text
//!   request ──► checked ──► part of the next sample ──► an output with it is applied ──► in effect
//!                  │                   └── its samples become void, and it is over ──► no effect
//!                  └── refused
//! ```
//!
//! Invariant *One effect*: values and identifiers travel in the same samples, so that stations recall both or neither;
//! a write that is repeated under its identifier is answered, and not taken again.

mod sessions;

use std::time::Duration;

use smallvec::SmallVec;
use understudy_cycle::Output;
use understudy_wire::{
    Image, MAXIMUM_PULSES, Moment, Pulse, Recalled, Write, WriteAnswer, WriteId, WriteOutcome,
    WriteRefusal,
};

use self::sessions::{Progress, Session, Sessions};
use super::{Applied, RemoteIo};
use crate::event::Event;
use crate::history::History;
use crate::source::{OperatorInput, OperatorInputKind, ValueMismatch};

/// Time after which a session that does not write is forgotten; a caller asks again for half of it.
const REMEMBERED_FOR: Duration = Duration::from_secs(60);

/// Operator inputs with their values, and the writes that they come from.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct Writing {
    /// One for each operator input of the settings.
    values: Vec<Written>,
    sessions: Sessions,
}

/// Value of an operator input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Written {
    stored: u64,
    /// Samples until the value ends: of a pulse, the one after it included; of a signal of another group.
    left: u32,
    /// The write that it comes from.
    by: WriteId,
    /// Whether a sample has the value.
    is_sampled: bool,
}

/// What became of a write.
enum Taking {
    /// It becomes part of the next sample.
    New,
    /// It was taken before, and its outcome is not known yet.
    Pending,
    /// It was taken before, and is in effect.
    InEffect(Moment),
}

impl Writing {
    pub(super) fn new(inputs: &[OperatorInput]) -> Self {
        let values = inputs.iter().map(|input| Written {
            stored: input.initial,
            left: 0,
            by: WriteId::default(),
            is_sampled: true,
        });
        Self { values: values.collect(), sessions: Sessions::default() }
    }

    /// What is known of a write that was taken before under its identifier.
    fn known(
        &self,
        inputs: &[OperatorInput],
        write: &Write,
    ) -> Option<Result<Taking, WriteRefusal>> {
        let session = self.sessions.get(write.id.session).filter(|it| it.id == write.id)?;
        let is_same = session.value.is_none_or(|value| value == write.value)
            && session.input.is_none_or(|input| inputs[input].place.bit == write.input);
        Some(match session.progress {
            _ if !is_same => Err(WriteRefusal::Order { expected: write.id.number + 1 }),
            Progress::InEffect { since } => Ok(Taking::InEffect(since)),
            Progress::Taken | Progress::Sampled { .. } => Ok(Taking::Pending),
        })
    }

    /// Checks a new write and takes it.
    fn take(&mut self, inputs: &[OperatorInput], write: &Write) -> Result<Taking, WriteRefusal> {
        let id = write.id;
        let before = self.sessions.get(id.session);
        let last = before.map_or(0, |session| session.id.number);
        let at = inputs.iter().position(|input| input.place.bit == write.input);
        let at = at.ok_or(WriteRefusal::NotWritable)?;
        let input = &inputs[at];
        input.check(write.value).map_err(|mismatch| match mismatch {
            ValueMismatch::Type => WriteRefusal::Type,
            ValueMismatch::Limits => WriteRefusal::Limits,
        })?;
        if write.role < input.role {
            let required = input.role;
            return Err(WriteRefusal::Role { required });
        }
        if last.checked_add(1) != Some(id.number) {
            let expected = last.saturating_add(1);
            return Err(WriteRefusal::Order { expected });
        }
        let is_undecided = before.is_some_and(|session| !session.is_decided());
        let is_pressed =
            matches!(input.kind, OperatorInputKind::Pulse(_)) && self.values[at].left > 0;
        if is_undecided || !self.values[at].is_sampled || is_pressed {
            return Err(WriteRefusal::Busy);
        }
        self.sessions.put(Session::taken(write, at))?;
        let stored = write.value.stored();
        self.values[at] =
            Written { stored, left: input.samples(stored), by: id, is_sampled: false };
        Ok(Taking::New)
    }

    /// Puts the values into u(i).
    pub(super) fn put(&self, inputs: &[OperatorInput], image: &mut Image) {
        for (input, written) in inputs.iter().zip(&self.values) {
            input.place.set(image, written.stored);
            if let Some(valid) = input.valid() {
                image.set(usize::from(valid), written.left > 0);
            }
        }
    }

    /// The newest writes that a sample carries, one for each session.
    pub(super) fn ids(&self) -> SmallVec<[WriteId; 1]> {
        self.sessions.ids()
    }

    /// Pulses that are not over after the newest sample.
    pub(super) fn pulses(&self, inputs: &[OperatorInput]) -> SmallVec<[Pulse; 1]> {
        let values = inputs.iter().zip(&self.values);
        let pulses = values.filter(|(input, written)| {
            matches!(input.kind, OperatorInputKind::Pulse(_)) && written.left > 0
        });
        let mut pulses: SmallVec<[Pulse; 1]> = pulses
            .map(|(input, written)| Pulse { input: input.place.bit, left: written.left })
            .collect();
        pulses.sort_unstable_by_key(|pulse| pulse.input);
        pulses.truncate(MAXIMUM_PULSES);
        pulses
    }

    /// Writes in samples of `history`: those that become void can be found afterwards.
    pub(super) fn in_history(&self, history: &History) -> SmallVec<[WriteId; 1]> {
        let sampled = self.sessions.iter().filter(|session| match session.progress {
            Progress::Sampled { after, .. } => history.place(after).is_some(),
            Progress::Taken | Progress::InEffect { .. } => false,
        });
        sampled.map(|session| session.id).collect()
    }

    /// The sample of `moment` has the values; writes `before` it that are no longer in the history became void. Pulses
    /// advance. Answers with the writes that have no effect.
    pub(super) fn sampled(
        &mut self,
        inputs: &[OperatorInput],
        moment: Moment,
        history: &History,
        before: &[WriteId],
    ) -> SmallVec<[WriteId; 1]> {
        let after = history.head();
        let now = Progress::Sampled { first: moment, after };
        let mut void = SmallVec::new();
        for session in self.sessions.iter_mut() {
            let is_void = match session.progress {
                Progress::Taken => {
                    session.progress = now;
                    false
                }
                Progress::Sampled { after, .. } => {
                    before.contains(&session.id) && history.place(after).is_none()
                }
                Progress::InEffect { .. } => false,
            };
            if !is_void {
                continue;
            }
            // A value that still holds is in this sample.
            let still = session.input.is_none_or(|input| {
                let written = &self.values[input];
                written.by == session.id && !written.is_over(&inputs[input])
            });
            if still {
                session.progress = now;
            } else {
                void.push(session.id);
            }
        }
        self.sessions.drop_void(&void, moment);
        for (input, written) in inputs.iter().zip(&mut self.values) {
            written.is_sampled = true;
            if written.left > 0 {
                written.left -= 1;
                match input.kind {
                    // The last sample of a pulse is FALSE, so that the next one is seen.
                    OperatorInputKind::Pulse(_) if written.left <= 1 => written.stored = 0,
                    OperatorInputKind::Group { .. } if written.left == 0 => {
                        written.stored = input.initial;
                    }
                    _ => {}
                }
            }
        }
        void
    }

    /// The program continues from another history: values that hold are sampled again. Answers with the writes that have
    /// no effect.
    pub(super) fn history_replaced(
        &mut self,
        inputs: &[OperatorInput],
        moment: Moment,
    ) -> SmallVec<[WriteId; 1]> {
        let mut void = SmallVec::new();
        for session in self.sessions.iter_mut() {
            if !matches!(session.progress, Progress::Sampled { .. }) {
                continue;
            }
            session.progress = Progress::Taken;
            let is_over = session.input.is_some_and(|input| {
                let written = &self.values[input];
                written.by != session.id || written.is_over(&inputs[input])
            });
            if is_over {
                void.push(session.id);
            }
        }
        self.sessions.drop_void(&void, moment);
        void
    }

    /// Outputs of the sample of `moment` were applied. Answers with the writes that are in effect by it, and since when.
    pub(super) fn applied(&mut self, moment: Moment) -> SmallVec<[(WriteId, Moment); 1]> {
        let mut effective = SmallVec::new();
        for session in self.sessions.iter_mut() {
            if let Progress::Sampled { first, .. } = session.progress
                && first <= moment
            {
                session.progress = Progress::InEffect { since: first };
                // What stations recall was in effect before the restart, unless its caller still asks.
                if session.has_caller() {
                    effective.push((session.id, first));
                }
            }
        }
        effective
    }

    /// Ends a cycle.
    pub(super) fn close_cycle(&mut self) {
        self.sessions.close_cycle();
    }

    /// After a restart: values, writes and pulses as stations recall them of a sample, to which the adopted state adds
    /// `missed` samples at most; `None` where their number is not known. A pulse lasts for the samples that are left of
    /// it, so that the program sees one pulse that is not longer than it is declared. A signal of another group is not
    /// valid until it is written again.
    pub(super) fn recall(
        &mut self,
        inputs: &[OperatorInput],
        recalled: &Recalled,
        missed: Option<u32>,
    ) {
        for (input, written) in inputs.iter().zip(&mut self.values) {
            let of_input = |pulse: &&Pulse| pulse.input == input.place.bit;
            let stored = input.place.get(&recalled.inputs);
            let (stored, left) = match input.kind {
                OperatorInputKind::Group { .. } => (input.initial, 0),
                OperatorInputKind::Pulse(_) => {
                    let left = recalled.pulses.iter().find(of_input).map_or(0, |pulse| pulse.left);
                    // The FALSE after a pulse is sampled in any case.
                    let end = left.min(1).max(u32::from(stored != 0));
                    let left = left.saturating_sub(missed.unwrap_or(left)).max(end);
                    (u64::from(left > 1), left)
                }
                OperatorInputKind::Level | OperatorInputKind::Setpoint { .. } => (stored, 0),
            };
            *written = Written { stored, left, by: WriteId::default(), is_sampled: true };
        }
        self.sessions = Sessions::recalled(recalled.writes.iter().copied());
    }
}

impl Written {
    /// Whether the value ended by itself.
    fn is_over(&self, input: &OperatorInput) -> bool {
        match input.kind {
            OperatorInputKind::Pulse(_) => self.stored == 0,
            OperatorInputKind::Group { .. } => self.left == 0,
            OperatorInputKind::Level | OperatorInputKind::Setpoint { .. } => false,
        }
    }
}

impl OperatorInput {
    /// Samples until a written value ends: those of a pulse, and the FALSE after it.
    fn samples(&self, stored: u64) -> u32 {
        match self.kind {
            OperatorInputKind::Pulse(samples) if stored != 0 => samples.saturating_add(1),
            OperatorInputKind::Group { stale_after, .. } => stale_after.max(1),
            _ => 0,
        }
    }

    /// Bit of u(i) that is TRUE while a value of another group holds.
    pub fn valid(&self) -> Option<u16> {
        match self.kind {
            OperatorInputKind::Group { valid, .. } => valid,
            _ => None,
        }
    }
}

impl RemoteIo {
    /// Takes a write, or answers it.
    pub(super) fn write(&mut self, write: &Write) {
        let moment = self.moment();
        let period = self.settings.agreement.schedule.period().as_nanos().max(1);
        let memory = u32::try_from(REMEMBERED_FOR.as_nanos().div_ceil(period));
        self.writing.sessions.forget(memory.unwrap_or(u32::MAX));
        let runs = self.knowledge.run().is_some()
            && self.sensors.is_some()
            && self.question.is_none()
            && !self.applied.as_ref().is_some_and(Applied::is_of_no_station);
        let inputs = &self.settings.operator_inputs;
        let taken = match self.writing.known(inputs, write) {
            Some(known) => known,
            None if runs => self.writing.take(inputs, write),
            None => Err(WriteRefusal::NotRunning),
        };
        match taken {
            Ok(Taking::New) => self.report(Event::Written { moment, write: write.clone() }),
            Ok(Taking::Pending) => self.writing.sessions.asked_again(write),
            Ok(Taking::InEffect(since)) => {
                let id = write.id;
                self.report(Event::WriteInEffect { moment, id, since });
                self.answer(id, WriteOutcome::InEffect { since });
            }
            Err(refusal) => {
                self.report(Event::WriteRefused { moment, write: write.clone(), refusal });
                self.answer(write.id, WriteOutcome::Refused { refusal });
            }
        }
    }

    /// Answers writes whose samples became void.
    pub(super) fn report_void(&mut self, writes: &[WriteId]) {
        let moment = self.moment();
        for &id in writes {
            let refusal = WriteRefusal::Void;
            self.report(Event::WriteVoid { moment, id });
            self.answer(id, WriteOutcome::Refused { refusal });
        }
    }

    /// Answers writes of which outputs were applied.
    pub(super) fn report_in_effect(&mut self, moment: Moment) {
        for (id, since) in self.writing.applied(moment) {
            self.report(Event::WriteInEffect { moment, id, since });
            self.answer(id, WriteOutcome::InEffect { since });
        }
    }

    fn answer(&mut self, id: WriteId, outcome: WriteOutcome) {
        self.member.put(Output::Answer(WriteAnswer { id, outcome }));
    }
}
