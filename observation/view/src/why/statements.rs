//! Why a variable of a program with numbers has its value: the statement that assigned it last, and the values that it read.
//!
//! Bounded by [`DEEPEST`] and [`MOST`]; the last reason states it.

use std::collections::HashMap;
use std::rc::Rc;

use serde_json::Value;
use understudy_typed::{Effect, Elementary, Fault, Part, Program, Read, RoutineId, Trace};

use super::Reason;
use crate::error::ViewError;
use crate::history::History;
use crate::model::Model;
use crate::source_text::SourceText;
use crate::value::elementary;

/// Reasons within reasons.
const DEEPEST: usize = 12;

/// Reasons in all.
const MOST: usize = 200;

/// Cycles that are gone back through to find when a value changed.
const FARTHEST: usize = 4096;

/// Explains variables of one program.
pub(super) struct Explainer<'m> {
    model: &'m Model,
    history: &'m History,
    program: &'m Program,
    text: SourceText<'m>,
    traces: HashMap<usize, Option<Rc<Trace>>>,
    count: usize,
}

impl<'m> Explainer<'m> {
    pub(super) fn new(
        model: &'m Model,
        history: &'m History,
        program: &'m Program,
        text: &'m str,
    ) -> Self {
        Self {
            model,
            history,
            program,
            text: SourceText::new(text),
            traces: HashMap::new(),
            count: 0,
        }
    }

    /// A variable as it was after the scan of the step at `place`.
    pub(super) fn root(&mut self, part: &Part, place: usize) -> Result<Reason, ViewError> {
        let trace = Rc::new(self.model.trace_at(self.history, place)?);
        self.traces.insert(place, Some(Rc::clone(&trace)));
        let stored = part.stored(&trace.memory);
        let value = stored.map_or(Value::Null, |(of, stored)| elementary(of, stored));
        if let Some(input) = self.input(part.address, place) {
            return Ok(input);
        }
        match trace.last_write(part.address) {
            Some(write) => Ok(self.written(&part.name, &trace, write, place, 0)),
            None => Ok(self.kept(part, value, place, 0)),
        }
    }

    /// The program fault of the newest scan up to `place` that ended in one, with what its statement read.
    pub(super) fn fault(&mut self, name: &str, value: Value, place: usize) -> Option<Reason> {
        let steps = self.history.steps();
        let is_new = |at: &usize| {
            let sampled = steps[*at].sampled.as_ref();
            sampled.is_some_and(|sampled| sampled.fault_is_new)
        };
        let Some(at) = (0..=place).rev().take(FARTHEST).find(is_new) else {
            self.history.end().reach();
            return None;
        };
        let fault = steps[at].sampled.as_ref()?.fault?;
        let trace = self.trace(at)?;
        let mut reason = self.leaf(
            name,
            value,
            at,
            format!("program fault: {}", self.told(&fault)),
        );
        if let Some(routine) = fault.routine {
            self.locate(&mut reason, routine, fault.line);
        }
        reason.because = self.reads(&trace.failed, &trace, at, 0, None);
        Some(reason)
    }

    fn told(&self, fault: &Fault) -> String {
        fault.describe(self.program)
    }

    fn trace(&mut self, place: usize) -> Option<Rc<Trace>> {
        let found = self.traces.get(&place).cloned();
        found.unwrap_or_else(|| {
            let trace = self.model.trace_at(self.history, place).ok().map(Rc::new);
            self.traces.insert(place, trace.clone());
            trace
        })
    }

    fn cycle(&self, place: usize) -> i64 {
        self.history.steps()[place].cycle
    }

    fn leaf(&self, signal: &str, value: Value, place: usize, text: impl Into<String>) -> Reason {
        Reason {
            signal: signal.to_owned(),
            value,
            cycle: self.cycle(place),
            rung: None,
            title: None,
            line: None,
            statement: None,
            text: text.into(),
            because: Vec::new(),
        }
    }

    /// Gives a reason the line and the statement of the program's text; those of a library block are not in it.
    fn locate(&self, reason: &mut Reason, routine: RoutineId, line: u32) {
        let routine = self.program.routine(routine);
        if self.text.declares(&routine.name) {
            reason.line = Some(line).filter(|line| *line > 0);
            reason.statement = self.text.line(line).map(str::to_owned);
        } else {
            reason.text += &format!(", in the library block {}", routine.name);
        }
    }

    /// A value that a statement of the scan at `place` assigned.
    fn written(
        &mut self,
        name: &str,
        trace: &Rc<Trace>,
        write: usize,
        place: usize,
        depth: usize,
    ) -> Reason {
        let done = &trace.done[write];
        let value = match done.effect {
            Effect::Assigned {
                value: Some((of, stored)),
                ..
            } => elementary(of, stored),
            _ => Value::Null,
        };
        let mut reason = self.leaf(name, value, place, "assigned");
        self.locate(&mut reason, done.routine, done.line);
        self.count += 1;
        if depth >= DEEPEST || self.count > MOST {
            reason.text += "; further causes omitted";
            return reason;
        }
        reason.because = self.reads(&done.reads, trace, place, depth, None);
        let mut under = done.under;
        while let Some(choice) = under.map(|choice| &trace.done[choice]) {
            let read = self.reads(&choice.reads, trace, place, depth, Some(choice.line));
            reason.because.extend(read);
            under = choice.under;
        }
        reason
    }

    fn reads(
        &mut self,
        reads: &[Read],
        trace: &Rc<Trace>,
        place: usize,
        depth: usize,
        condition: Option<u32>,
    ) -> Vec<Reason> {
        let mut told = Vec::new();
        let mut reasons = Vec::new();
        for read in reads {
            if told.contains(&(read.address, read.value)) {
                continue;
            }
            told.push((read.address, read.value));
            let mut reason = self.read(read, trace, place, depth + 1);
            if let Some(line) = condition {
                reason.text += &format!("; read by the condition in line {line}");
            }
            reasons.push(reason);
        }
        reasons
    }

    /// A value that a statement read.
    fn read(&mut self, read: &Read, trace: &Rc<Trace>, place: usize, depth: usize) -> Reason {
        let value = elementary(read.of, read.value);
        if let Some(input) = self.input(read.address, place) {
            return input;
        }
        let slots = u64::from(self.program.state);
        let part = (read.address / 64 < slots).then(|| self.program.part_at(read.address));
        let part = part.flatten();
        match (read.by, part) {
            (Some(write), Some(part)) => self.written(&part.name, trace, write, place, depth),
            (Some(write), None) => {
                let line = self.text.line(trace.done[write].line);
                let target = line.and_then(|line| line.split_once(":="));
                let name = target.map_or("temporary", |(target, _)| target.trim());
                self.written(name, trace, write, place, depth)
            }
            (None, Some(part)) => self.kept(&part, value, place, depth),
            (None, None) => self.leaf("temporary", value, place, "its initial value in this call"),
        }
    }

    /// The input at an address, as it was sampled.
    fn input(&self, address: u64, place: usize) -> Option<Reason> {
        let mut points = self.program.inputs.iter();
        let point =
            points.find(|point| point.slot != 0 && u64::from(point.slot) == address / 64)?;
        let at = |place: usize| {
            let sampled = self.history.steps()[place].sampled.as_ref()?;
            Some(point.get(sampled.inputs.words()))
        };
        let value = at(place)?;
        let (mut since, mut known) = (place, false);
        for _ in 0..FARTHEST {
            let Some(before) = self.history.before(since) else {
                known = !self.history.is_cut();
                break;
            };
            if at(before) != Some(value) {
                known = true;
                break;
            }
            since = before;
        }
        let text = match (since == place, known) {
            (true, true) => "input, new in this cycle".to_owned(),
            (false, true) => format!("input, since cycle {}", self.cycle(since)),
            (_, false) => format!("input, since cycle {} or longer", self.cycle(since)),
        };
        Some(self.leaf(&point.name, elementary(point.of, value), place, text))
    }

    /// A value of the state before the scan at `place`, which an earlier scan assigned.
    fn kept(&mut self, part: &Part, value: Value, place: usize, depth: usize) -> Reason {
        let stored = |place: usize| {
            let sampled = self.history.steps()[place].sampled.as_ref()?;
            part.stored(sampled.state.words())
        };
        let now = stored(place);
        let mut since = place;
        let mut writer = None;
        for _ in 0..FARTHEST {
            let Some(before) = self.history.before(since) else {
                break;
            };
            if stored(before) != now {
                writer = Some(before);
                break;
            }
            since = before;
        }
        let Some(writer) = writer else {
            let text = match self.history.is_cut() {
                true => "unchanged since before the oldest cycle that is remembered",
                false => "its initial value",
            };
            return self.leaf(&part.name, value, place, text);
        };
        let when = self.cycle(writer);
        self.count += 1;
        let is_bool = part.of.elementary() == Some(Elementary::Bool);
        // A number that changes in every scan leads back through all of them.
        let is_followed = (is_bool || since != place) && depth < DEEPEST && self.count <= MOST;
        let trace = self.trace(writer);
        let write = trace.as_ref().and_then(|it| it.last_write(part.address));
        let (Some(trace), Some(write)) = (trace, write) else {
            let text = format!("unchanged since the scan of cycle {when}");
            return self.leaf(&part.name, value, place, text);
        };
        let kept = if since == place {
            format!("assigned in cycle {when}")
        } else {
            format!("assigned in cycle {when}, and kept since")
        };
        let mut reason = self.leaf(&part.name, value, place, kept);
        let done = &trace.done[write];
        self.locate(&mut reason, done.routine, done.line);
        if is_followed {
            reason.because = self
                .written(&part.name, &trace, write, writer, depth + 1)
                .because;
        }
        reason
    }
}
