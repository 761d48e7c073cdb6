//! Why a variable of a program with numbers has its value: the statement that assigned it last, and the values that it read.
//!
//! Bounded by [`DEEPEST`] and [`MOST`]; the last reason states it. What was explained once is not explained again.

mod alternatives;

use std::collections::{HashMap, HashSet};
use std::rc::Rc;

use serde_json::Value;
use understudy_typed::{
    Cause, Done, Effect, Elementary, Fault, Part, Point, Program, Read, RoutineId, Trace,
};

use super::{Reason, end_of_history};
use crate::error::ViewError;
use crate::history::History;
use crate::model::Model;
use crate::source_text::SourceText;
use crate::value::shown;

/// Reasons within reasons.
const DEEPEST: usize = 12;

/// Reasons in all.
const MOST: usize = 200;

/// Values that the statement of a program fault read.
const MOST_FAILED: usize = 20;

/// Text of a reason whose causes are not shown.
const OMITTED: &str = "; further causes omitted";

/// Explains variables of one program.
pub(super) struct Explainer<'m> {
    model: &'m Model,
    history: &'m History,
    program: &'m Program,
    text: SourceText<'m>,
    traces: HashMap<usize, Option<Rc<Trace>>>,
    count: usize,
    /// Address, step and statement of what was explained.
    explained: HashSet<(u64, usize, Option<usize>)>,
}

/// Type and value, as it is stored, of a variable without parts.
type Stored = Option<(Elementary, u64)>;

impl<'m> Explainer<'m> {
    pub(super) fn new(
        model: &'m Model,
        history: &'m History,
        program: &'m Program,
        text: SourceText<'m>,
    ) -> Self {
        Self {
            model,
            history,
            program,
            text,
            traces: HashMap::new(),
            count: 0,
            explained: HashSet::new(),
        }
    }

    /// A variable as it was after the scan of the step at `place`.
    pub(super) fn root(&mut self, part: &Part, place: usize) -> Result<Reason, ViewError> {
        let trace = Rc::new(self.model.trace_at(self.history, place)?);
        self.traces.insert(place, Some(Rc::clone(&trace)));
        let stored = part.stored(&trace.memory);
        if let Some(input) = self.input(part.address, place) {
            return Ok(input);
        }
        match trace.last_write(part.address) {
            Some(write) => {
                Ok(self.written((&part.name, part.address, stored), &trace, write, place, 0))
            }
            None => {
                let mut kept = self.kept(part, stored, place, 0);
                if let Some((routine, line)) = self.writer_of(part, place) {
                    let others = self.alternatives(&kept, &trace, None, (routine, line), place, 0);
                    kept.because.splice(0..0, others);
                }
                Ok(kept)
            }
        }
    }

    /// The statement that assigned a variable, in the newest scan up to `place` of those that were looked at.
    fn writer_of(&self, part: &Part, place: usize) -> Option<(RoutineId, u32)> {
        let mut places: Vec<usize> = self.traces.keys().copied().collect();
        places.sort_unstable_by(|one, other| other.cmp(one));
        places.into_iter().filter(|at| *at <= place).find_map(|at| {
            let trace = self.traces.get(&at)?.as_ref()?;
            let done = &trace.done[trace.last_write(part.address)?];
            Some((done.routine, done.line))
        })
    }

    /// The choices that could have assigned a variable otherwise, each with what it read.
    fn alternatives(
        &mut self,
        assigned: &Reason,
        trace: &Rc<Trace>,
        after: Option<usize>,
        (routine, line): (RoutineId, u32),
        place: usize,
        depth: usize,
    ) -> Vec<Reason> {
        let found = self.program.routine(routine);
        if !self.text.declares(&found.name) {
            return Vec::new();
        }
        let untaken = alternatives::untaken(trace, after, routine, &found.body, line);
        let reasons = untaken.into_iter().map(|choice| {
            let lines: Vec<String> = choice.lines.iter().map(u32::to_string).collect();
            let (noun, lines) = match lines.len() {
                1 => ("line", lines.join("")),
                _ => ("lines", lines.join(", ")),
            };
            let mut reason = Reason {
                at: None,
                rung: None,
                title: None,
                line: None,
                statement: None,
                text: format!("not assigned in {noun} {lines}: this condition did not lead there"),
                because: self.reads(&choice.done.reads, trace, place, depth, None),
                ..assigned.clone()
            };
            self.locate(&mut reason, routine, choice.done.line, None);
            reason
        });
        reasons.collect()
    }

    /// The program fault of the newest scan up to `place` that ended in one, with what its statement read.
    pub(super) fn fault(&mut self, name: &str, value: Value, place: usize) -> Option<Reason> {
        let at = self.history.fault_before(place)?;
        let fault = self.history.steps()[at].sampled.as_ref()?.fault?;
        let trace = self.trace(at)?;
        let text = format!("program fault: {}", fault.describe(self.program));
        let mut reason = Reason {
            at: None,
            value,
            of: self.program.part(name).and_then(|part| part.declared()),
            ..self.leaf(name, None, at, text)
        };
        if let Some(routine) = fault.routine {
            self.locate(&mut reason, routine, fault.line, None);
        }
        reason.because = match self.not_finite(&fault, &trace, at) {
            Some(output) => vec![output],
            None => self.reads(&last_reads(&trace.failed), &trace, at, 0, None),
        };
        Some(reason)
    }

    /// The output that is not a finite number, as a statement of the scan at `place` assigned it.
    fn not_finite(&mut self, fault: &Fault, trace: &Rc<Trace>, place: usize) -> Option<Reason> {
        let Cause::OutputNotFinite { output, value } = fault.cause else {
            return None;
        };
        let point = self.program.outputs.iter().nth(output as usize)?;
        let address = 64 * u64::from(point.slot);
        let write = trace.last_write(address)?;
        let output = (point.name.as_str(), address, Some((point.of, value)));
        Some(self.written(output, trace, write, place, 0))
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

    fn leaf(&self, signal: &str, stored: Stored, place: usize, text: impl Into<String>) -> Reason {
        let declared = stored.map(|(of, _)| {
            let Program { inputs, outputs, .. } = self.program;
            let point = inputs.find(signal).or_else(|| outputs.find(signal));
            let part = || self.program.part(signal).and_then(|part| part.declared());
            let declared = point.map(Point::declared).or_else(part);
            declared.filter(|declared| declared.of == of).unwrap_or(of.into())
        });
        let value = declared.as_ref().zip(stored);
        Reason {
            at: None,
            signal: signal.to_owned(),
            value: value.map_or(Value::Null, |(declared, (_, stored))| shown(declared, stored)),
            of: declared,
            unit: None,
            cycle: self.cycle(place),
            rung: None,
            title: None,
            line: None,
            statement: None,
            text: text.into(),
            because: Vec::new(),
        }
    }

    /// Gives a reason the line and the statement of the program's text, of several in the line the one that assigns `target`; those of a library
    /// block are not in it.
    fn locate(&self, reason: &mut Reason, routine: RoutineId, line: u32, target: Option<&str>) {
        let routine = self.program.routine(routine);
        if self.text.declares(&routine.name) {
            reason.line = Some(line).filter(|line| *line > 0);
            reason.statement = self.text.statement(line, target).map(str::to_owned);
        } else {
            reason.text += &format!(", in the library block {}", routine.name);
        }
    }

    /// A value that a statement of the scan at `place` assigned to the variable of a name and an address, alone or with the whole that it is a part of.
    fn written(
        &mut self,
        (name, address, stored): (&str, u64, Stored),
        trace: &Rc<Trace>,
        write: usize,
        place: usize,
        depth: usize,
    ) -> Reason {
        let done = &trace.done[write];
        // An element of an array of inputs is a point, which is copied into the array before the program runs.
        if let [read] = done.reads.as_slice()
            && let Some(input) = self.input(read.address, place).filter(|it| it.signal == name)
        {
            return input;
        }
        let stored = match done.effect {
            Effect::Assigned { value: Some(value), .. } => Some(value),
            Effect::Assigned { value: None, .. } => stored,
            Effect::Chose => None,
        };
        let mut reason = self.leaf(name, stored, place, "assigned");
        self.locate(&mut reason, done.routine, done.line, Some(name));
        if depth >= DEEPEST || self.count > MOST {
            reason.text += OMITTED;
            return reason;
        }
        let copied = stored.and_then(|stored| trace.copied(write, address, stored));
        let reads: Vec<Read> = done.reads.iter().copied().chain(copied).collect();
        reason.because = self.reads(&reads, trace, place, depth, None);
        let mut under = done.under;
        while let Some(choice) = under.map(|choice| &trace.done[choice]) {
            let read = self.reads(&choice.reads, trace, place, depth, Some(choice));
            reason.because.extend(read);
            under = choice.under;
        }
        let own = (done.routine, done.line);
        let others = self.alternatives(&reason, trace, Some(write), own, place, depth);
        reason.because.extend(others);
        reason
    }

    fn reads(
        &mut self,
        reads: &[Read],
        trace: &Rc<Trace>,
        place: usize,
        depth: usize,
        condition: Option<&Done>,
    ) -> Vec<Reason> {
        let mut told = Vec::new();
        let mut reasons = Vec::new();
        for read in reads {
            if told.contains(&(read.address, read.value)) {
                continue;
            }
            told.push((read.address, read.value));
            self.count += 1;
            let mut reason = self.read(read, trace, place, depth + 1);
            if let Some(choice) = condition {
                reason.text += &self.condition_text(choice);
            }
            let is_full = self.count >= MOST;
            if is_full && !reason.text.ends_with(OMITTED) {
                reason.text += OMITTED;
            }
            reasons.push(reason);
            if is_full {
                break;
            }
        }
        reasons
    }

    fn condition_text(&self, choice: &Done) -> String {
        let routine = self.program.routine(choice.routine);
        match self.text.declares(&routine.name) {
            true => format!("; read by the condition in line {}", choice.line),
            false => format!("; read by a condition of the library block {}", routine.name),
        }
    }

    /// A value that a statement read.
    fn read(&mut self, read: &Read, trace: &Rc<Trace>, place: usize, depth: usize) -> Reason {
        let stored = Some((read.of, read.value));
        if let Some(input) = self.input(read.address, place) {
            return input;
        }
        let slots = u64::from(self.program.state);
        let part = (read.address / 64 < slots).then(|| self.program.part_at(read.address));
        let part = part.flatten();
        let is_new = self.explained.insert((read.address, place, read.by));
        if let Some(part) = part.as_ref().filter(|_| !is_new) {
            return self.leaf(&part.name, stored, place, "explained above");
        }
        match (read.by, part) {
            // Only the first statements of a scan are recorded.
            (Some(write), part) if trace.is_cut && !assigned(trace.done[write].effect, read) => {
                let name = part.map_or("temporary".to_owned(), |part| part.name);
                self.leaf(&name, stored, place, "assigned by a later turn of a loop")
            }
            (Some(write), Some(part)) => {
                self.written((&part.name, part.address, stored), trace, write, place, depth)
            }
            (Some(write), None) => {
                let name = self.text.assigned(trace.done[write].line).unwrap_or("temporary");
                self.written((name, read.address, stored), trace, write, place, depth)
            }
            (None, Some(part)) => self.kept(&part, stored, place, depth),
            (None, None) => self.leaf("temporary", stored, place, "its initial value in this call"),
        }
    }

    /// The input at an address, as it was sampled.
    fn input(&self, address: u64, place: usize) -> Option<Reason> {
        let mut points = self.program.inputs.iter();
        let point =
            points.find(|point| point.slot != 0 && u64::from(point.slot) == address / 64)?;
        let at = |place: usize| self.model.input_at(self.history, place, point);
        let value = at(place)?;
        let (mut since, mut known) = (place, false);
        loop {
            let Some(before) = self.history.before(since) else {
                known |= self.history.begins_at(since);
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
        Some(self.leaf(&point.name, Some((point.of, value)), place, text))
    }

    /// A value of the state before the scan at `place`, which an earlier scan assigned.
    fn kept(&mut self, part: &Part, value: Stored, place: usize, depth: usize) -> Reason {
        let stored = |place: usize| {
            let sampled = self.history.steps()[place].sampled.as_ref()?;
            part.stored(sampled.state.words())
        };
        let now = stored(place);
        let mut since = place;
        let mut writer = None;
        while let Some(before) = self.history.scan_before(since) {
            if stored(before) != now {
                writer = Some(before);
                break;
            }
            since = before;
        }
        let Some(writer) = writer else {
            let text = end_of_history(self.history, since);
            return self.leaf(&part.name, value, place, text);
        };
        let when = self.cycle(writer);
        let is_bool = part.of.elementary() == Some(Elementary::Bool);
        // A number that changes in every scan leads back through all of them.
        let is_followed = (is_bool || since != place) && depth < DEEPEST && self.count <= MOST;
        let trace = self.trace(writer);
        let write = trace.as_ref().and_then(|it| it.last_write(part.address));
        let (Some(trace), Some(write)) = (trace, write) else {
            let text = format!("unchanged since the scan of cycle {when}");
            return self.leaf(&part.name, value, place, text);
        };
        let text = format!("assigned in cycle {when}");
        let mut reason = self.leaf(&part.name, value, place, text);
        let done = &trace.done[write];
        if since != place {
            reason.text += &self.kept_text(part, place, (done.routine, done.line));
        }
        self.locate(&mut reason, done.routine, done.line, Some(&part.name));
        if is_followed {
            let written = (part.name.as_str(), part.address, value);
            reason.because = self.written(written, &trace, write, writer, depth + 1).because;
        }
        reason
    }

    /// How a value went on that an earlier scan than the last one gave to a variable: it may have been assigned again in each scan.
    fn kept_text(&mut self, part: &Part, place: usize, by: (RoutineId, u32)) -> String {
        let again = self.history.scan_before(place).and_then(|last| {
            let trace = self.trace(last)?;
            let done = &trace.done[trace.last_write(part.address)?];
            Some((self.cycle(last), (done.routine, done.line)))
        });
        let Some((cycle, of)) = again else {
            return ", and unchanged since".to_owned();
        };
        let mut text = format!(", and again with the same value, last in cycle {cycle}");
        let (routine, line) = (&self.program.routine(of.0).name, of.1);
        if of != by {
            match (self.text.declares(routine), line) {
                // No line of the text is that of the statement.
                (true, 0) => {}
                (true, _) => text += &format!(" by line {line}"),
                (false, _) => text += &format!(" by the library block {routine}"),
            }
        }
        text
    }
}

/// Whether a statement assigned what was read.
fn assigned(effect: Effect, read: &Read) -> bool {
    match effect {
        Effect::Assigned { value, .. } => value.is_none_or(|(_, stored)| stored == read.value),
        Effect::Chose => false,
    }
}

/// The last reads of each address: before it fails, a loop has read in each of its turns.
fn last_reads(reads: &[Read]) -> Vec<Read> {
    let mut last: Vec<Read> = Vec::new();
    for read in reads.iter().rev() {
        if last.len() == MOST_FAILED {
            break;
        }
        if last.iter().all(|known| known.address != read.address) {
            last.push(*read);
        }
    }
    last.reverse();
    last
}
