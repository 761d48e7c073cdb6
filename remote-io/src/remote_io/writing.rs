//! Values that operators write, from the request to the answer.
//!
//! ```text
//!   request ──► checked ──► part of the next sample ──► an output with it is applied ──► in effect
//!                  │                   └── its samples become void, or no program executes them, and it is over ──► no effect
//!                  ├── the next sample has a forced value ──► no effect
//!                  └── refused, also while the input is forced
//! ```
//!
//! Invariant *One effect*: values and identifiers travel in the same samples, so that stations recall both or neither;
//! a write that is repeated under its identifier is answered, and not taken again.

mod laid_out;
mod lost;
mod sessions;

use std::time::Duration;

use smallvec::SmallVec;
use understudy_cycle::Output;
use understudy_wire::{
    Image, MAXIMUM_PULSES, Moment, Pulse, Recalled, Time, Write, WriteAnswer, WriteId,
    WriteOutcome, WriteRefusal,
};

use self::sessions::{Progress, Session, Sessions};
use super::RemoteIo;
use super::actuation::{Applied, Execution};
use crate::event::Event;
use crate::history::History;
use understudy_cycle::{OperatorInput, OperatorInputKind, ValueMismatch};

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
    /// Newest value that is in effect: the one of a level or a setpoint where a force has replaced the newer ones.
    in_effect: u64,
}

/// Reason why a force keeps a write of an input out of the samples, by the first bit of the input; nothing where it is not forced.
pub(super) type Forced<'a> = &'a dyn Fn(u16) -> Option<WriteRefusal>;

/// Writes that have no effect, with the reason.
pub(super) type WithoutEffect = SmallVec<[(WriteId, WriteRefusal); 1]>;

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
            in_effect: input.initial,
        });
        Self { values: values.collect(), sessions: Sessions::default() }
    }

    /// What is known of a write that was taken before under its identifier. One that names its input by other points than those that `counts` is known by
    /// its identifier alone: the input may have moved since.
    fn known(
        &self,
        (inputs, counts): (&[OperatorInput], bool),
        write: &Write,
    ) -> Option<Result<Taking, WriteRefusal>> {
        let session = self.sessions.get(write.id.session).filter(|it| it.id == write.id)?;
        let is_there = |input: usize| !counts || inputs[input].place.bit == write.input;
        let is_same = session.value.is_none_or(|value| value == write.value)
            && session.input.is_none_or(is_there);
        Some(match session.progress {
            _ if !is_same => {
                Err(WriteRefusal::Order { expected: write.id.number.saturating_add(1) })
            }
            Progress::InEffect { since } => Ok(Taking::InEffect(since)),
            Progress::Taken | Progress::Sampled { .. } => Ok(Taking::Pending),
        })
    }

    /// Checks a new write and takes it.
    fn take(
        &mut self,
        inputs: &[OperatorInput],
        write: &Write,
        forced: Forced<'_>,
    ) -> Result<Taking, WriteRefusal> {
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
        if let Some(refusal) = forced_out(input, forced) {
            return Err(refusal);
        }
        let is_undecided = before.is_some_and(|session| !session.is_decided());
        let is_pressed =
            matches!(input.kind, OperatorInputKind::Pulse(_)) && self.values[at].left > 0;
        if is_undecided || !self.values[at].is_sampled || is_pressed {
            return Err(WriteRefusal::Busy);
        }
        self.sessions.put(Session::taken(write, at))?;
        let stored = write.value.stored();
        let left = samples(input, stored);
        let value = &mut self.values[at];
        *value = Written { stored, left, by: id, is_sampled: false, ..*value };
        Ok(Taking::New)
    }

    /// Puts the values into u(i), which follows the sample `before`. A pulse begins after a FALSE in the history, so that it is seen: samples with
    /// the end of an earlier one may be void, and a force may have ended.
    pub(super) fn put(&self, inputs: &[OperatorInput], before: Option<&Image>, image: &mut Image) {
        for (input, written) in inputs.iter().zip(&self.values) {
            let begins = matches!(input.kind, OperatorInputKind::Pulse(_)) && !written.is_sampled;
            let waits = begins && before.is_none_or(|sample| input.place.get(sample) != 0);
            input.place.set(image, if waits { 0 } else { written.stored });
            if let Some(valid) = input.valid() {
                image.set(usize::from(valid), written.left > 0);
            }
        }
    }

    /// Puts the values that forced inputs have without their forces into u(i), which was sampled: writes that the forces kept out have no effect.
    pub(super) fn put_forced(
        &self,
        inputs: &[OperatorInput],
        forced: Forced<'_>,
        image: &mut Image,
    ) {
        let values = inputs.iter().zip(&self.values);
        for (input, written) in values.filter(|(input, _)| forced_out(input, forced).is_some()) {
            input.place.set(image, written.stored);
        }
    }

    /// The newest writes that a sample carries, one for each session. In place of a pulse that waits it carries the write before it.
    pub(super) fn ids(&self) -> SmallVec<[WriteId; 1]> {
        let waits = |id| self.values.iter().any(|written| !written.is_sampled && written.by == id);
        let ids = self
            .sessions
            .ids()
            .into_iter()
            .map(|id| WriteId { number: id.number - u32::from(waits(id)), ..id });
        ids.filter(|id| id.number > 0).collect()
    }

    /// Pulses that are not over after the newest sample.
    pub(super) fn pulses(&self, inputs: &[OperatorInput]) -> SmallVec<[Pulse; 1]> {
        let values = inputs.iter().zip(&self.values);
        let pulses = values.filter(|(input, written)| {
            matches!(input.kind, OperatorInputKind::Pulse(_))
                && written.left > 0
                && written.is_sampled
        });
        let mut pulses: SmallVec<[Pulse; 1]> = pulses
            .map(|(input, written)| Pulse { input: input.place.bit, left: written.left })
            .collect();
        pulses.sort_unstable_by_key(|pulse| pulse.input);
        pulses.truncate(MAXIMUM_PULSES);
        pulses
    }

    /// Writes in samples of `history`, with their places: those that become void can be found afterwards.
    pub(super) fn in_history(&self, history: &History) -> SmallVec<[(WriteId, usize); 1]> {
        let sampled = self.sessions.iter().filter_map(|session| match session.progress {
            Progress::Sampled { after, .. } => Some((session.id, history.place(after)?)),
            Progress::Taken | Progress::InEffect { .. } => None,
        });
        sampled.collect()
    }

    /// The newest sample of `history`, of `moment`, has the values, except those of `forced` inputs and of pulses that wait. Pulses advance, and
    /// end where they are forced. Answers with the writes that have no effect.
    pub(super) fn sampled(
        &mut self,
        inputs: &[OperatorInput],
        moment: Moment,
        history: &History,
        forced: Forced<'_>,
    ) -> WithoutEffect {
        let now = Progress::Sampled { first: moment, after: history.head() };
        let mut void = WithoutEffect::new();
        for session in self.sessions.iter_mut() {
            if session.progress != Progress::Taken {
                continue;
            }
            let waits = session.input.is_some_and(|at| self.values[at].waits(&inputs[at], history));
            match session.input.and_then(|at| forced_out(&inputs[at], forced)) {
                Some(refusal) => void.push((session.id, refusal)),
                None if waits => {}
                // It was in samples that were not executed, and another write has followed.
                None if session.input.is_some_and(|at| self.values[at].by != session.id) => {
                    void.push((session.id, WriteRefusal::Void));
                }
                None => session.progress = now,
            }
        }
        self.sessions.drop_void(&void, moment);
        for (at, input) in inputs.iter().enumerate() {
            let waits = self.values[at].waits(input, history);
            let is_forced = forced_out(input, forced).is_some();
            self.values[at].is_sampled = is_forced || !waits;
            if is_forced {
                self.replaced_by_force(input, at, &void);
            } else if !waits {
                self.values[at].advance(input);
            }
        }
        void
    }

    /// A sample has a forced value in place of the one that was written to the operator input `at`. A write without an effect leaves the value
    /// before it.
    fn replaced_by_force(&mut self, input: &OperatorInput, at: usize, void: &WithoutEffect) {
        let written = &mut self.values[at];
        if matches!(input.kind, OperatorInputKind::Pulse(_)) {
            // The rest of a pulse after the force would be a second effect.
            (written.stored, written.left) = (0, 0);
            return;
        }
        if !void.iter().any(|(id, _)| *id == written.by) {
            return;
        }
        let of_input = self.sessions.iter().filter(|session| session.input == Some(at));
        let sampled = of_input.filter_map(|session| match session.progress {
            Progress::Sampled { first, .. } => Some((first, session.id, session.value?)),
            _ => None,
        });
        let newest = sampled.max_by_key(|(first, ..)| *first);
        (written.stored, written.by) = newest
            .map_or((written.in_effect, WriteId::default()), |(_, id, value)| (value.stored(), id));
    }

    /// Outputs of the sample of `moment` were applied. Answers with the writes that are in effect by it, and since when.
    pub(super) fn applied(&mut self, moment: Moment) -> SmallVec<[(WriteId, Moment); 1]> {
        let mut effective = SmallVec::new();
        let mut values: SmallVec<[(Moment, usize, u64); 1]> = SmallVec::new();
        for session in self.sessions.iter_mut() {
            if let Progress::Sampled { first, .. } = session.progress
                && first <= moment
            {
                session.progress = Progress::InEffect { since: first };
                if let (Some(input), Some(value)) = (session.input, session.value) {
                    values.push((first, input, value.stored()));
                }
                // What stations recall was in effect before the restart, unless its caller still asks.
                if session.has_caller() {
                    effective.push((session.id, first));
                }
            }
        }
        values.sort_unstable();
        for (_, input, value) in values {
            self.values[input].in_effect = value;
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
            let by = WriteId::default();
            *written = Written { stored, left, by, is_sampled: true, in_effect: stored };
        }
        self.sessions = Sessions::recalled(recalled.writes.iter().copied());
    }
}

impl Writing {
    /// After a power failure: takes up the writes that were in effect, and the values of the inputs that keep theirs.
    pub(super) fn start(&mut self, inputs: &[OperatorInput], recalled: &Recalled) {
        *self = Self::new(inputs);
        for (input, written) in inputs.iter().zip(&mut self.values) {
            let value = input.place.get(&recalled.inputs);
            // The limits may have become narrower since.
            if input.retains && input.admits(value) {
                written.stored = value;
                written.in_effect = written.stored;
            }
        }
        self.sessions = Sessions::recalled(recalled.writes.iter().copied());
    }
}

impl Written {
    /// Counts a sample with the value.
    fn advance(&mut self, input: &OperatorInput) {
        if self.left == 0 {
            return;
        }
        self.left -= 1;
        match input.kind {
            // The last sample of a pulse is FALSE, so that the next one is seen.
            OperatorInputKind::Pulse(_) if self.left <= 1 => self.stored = 0,
            OperatorInputKind::Group { .. } if self.left == 0 => self.stored = input.initial,
            _ => {}
        }
    }

    /// Whether the newest sample of `history` has the FALSE that a pulse begins after, in place of the pulse.
    fn waits(&self, input: &OperatorInput, history: &History) -> bool {
        matches!(input.kind, OperatorInputKind::Pulse(_))
            && !self.is_sampled
            && self.stored != 0
            && history.newest().is_some_and(|sample| input.place.get(sample) == 0)
    }

    /// Whether the value ended by itself.
    fn is_over(&self, input: &OperatorInput) -> bool {
        match input.kind {
            OperatorInputKind::Pulse(_) => self.stored == 0,
            OperatorInputKind::Group { .. } => self.left == 0,
            OperatorInputKind::Level | OperatorInputKind::Setpoint { .. } => false,
        }
    }
}

/// Samples until a written value ends: those of a pulse, and the FALSE after it.
fn samples(input: &OperatorInput, stored: u64) -> u32 {
    match input.kind {
        OperatorInputKind::Pulse(samples) if stored != 0 => samples.saturating_add(1),
        OperatorInputKind::Group { stale_after, .. } => stale_after.max(1),
        _ => 0,
    }
}

/// Reason why a force keeps a write of an input out of the samples. A signal of another group is no order of a person: like those of other programs it
/// is followed under a force, so that it stays valid.
fn forced_out(input: &OperatorInput, forced: Forced<'_>) -> Option<WriteRefusal> {
    match input.kind {
        OperatorInputKind::Group { .. } => None,
        _ => forced(input.place.bit),
    }
}

impl RemoteIo {
    /// Takes a write, or answers it.
    pub(super) fn write(&mut self, now: Time, write: &Write) {
        let moment = self.moment();
        let period = self.settings.agreement.schedule.period().as_nanos().max(1);
        let memory = u32::try_from(REMEMBERED_FOR.as_nanos().div_ceil(period));
        self.inputs.writing.sessions.forget(memory.unwrap_or(u32::MAX));
        let runs = self.arbiter.knowledge.run().is_some()
            && self.inputs.sensors.is_some()
            && self.arbiter.question.is_none()
            && !self.actuation.applied.as_ref().is_some_and(Applied::is_of_no_station);
        let inputs = &self.layout.operator_inputs;
        let is_pulse = inputs.iter().any(|input| {
            input.place.bit == write.input && matches!(input.kind, OperatorInputKind::Pulse(_))
        });
        let sees_it = !is_pulse || self.actuation.execution != Execution::Stopped;
        let counts = self.counts_by(write.points);
        let taken = match self.inputs.writing.known((inputs, counts), write) {
            Some(known) => known,
            None if !counts => Err(WriteRefusal::OtherPoints),
            None if runs && sees_it => {
                let forced = |input| self.inputs.forcing.refuses_write(input, now);
                self.inputs.writing.take(inputs, write, &forced)
            }
            None => Err(WriteRefusal::NotRunning),
        };
        match taken {
            Ok(Taking::New) => self.report(Event::Written { moment, write: write.clone() }),
            Ok(Taking::Pending) => self.inputs.writing.sessions.asked_again(write),
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

    /// Answers writes that were taken and have no effect.
    pub(super) fn report_void(&mut self, writes: &[(WriteId, WriteRefusal)]) {
        let moment = self.moment();
        for &(id, refusal) in writes {
            self.report(Event::WriteVoid { moment, id, refusal });
            self.answer(id, WriteOutcome::Refused { refusal });
        }
    }

    /// Answers writes of which outputs were applied.
    pub(super) fn report_in_effect(&mut self, moment: Moment) {
        for (id, since) in self.inputs.writing.applied(moment) {
            self.report(Event::WriteInEffect { moment, id, since });
            self.answer(id, WriteOutcome::InEffect { since });
        }
    }

    fn answer(&mut self, id: WriteId, outcome: WriteOutcome) {
        self.member.put(Output::Answer(WriteAnswer { id, outcome }));
    }
}
