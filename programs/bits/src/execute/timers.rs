//! Timers as counts of scans.
//!
//! A timer that is called once in every scan, with one preset, is in a state that a number of scans tells: how long its input has been TRUE, or
//! FALSE, up to the preset. So it has the registers of this count and no others. A first execution of a scan finds such timers; the others are
//! followed through their bodies.

use std::collections::{BTreeMap, BTreeSet};

use understudy_typed::{Comparison, Elementary, Operation, Place, Program, RoutineId, Timer, Type};

use super::Execution;
use crate::term::Term;

/// Most scans that are counted.
const MOST: i64 = u32::MAX as i64;

/// The timers of a program.
#[derive(Debug, Default)]
pub(crate) struct Timers {
    /// Scans until they are over, of those that are counted, by address.
    pub(crate) counted: BTreeMap<u64, u64>,
    /// What they do not keep then, by address.
    pub(crate) dropped: BTreeSet<u64>,
    uses: BTreeMap<u64, Use>,
    read: BTreeSet<u64>,
    written: BTreeSet<u64>,
    /// Bodies of timers that are being executed.
    pub(super) inside: u32,
}

/// A timer, and the slots of its variables in an instance.
#[derive(Debug, Clone)]
pub(super) struct Variables {
    timer: Timer,
    input: u64,
    preset: u64,
    output: u64,
    start: u64,
    /// What nothing else may read or write: the time that has elapsed, and what it keeps.
    own: Vec<u64>,
}

/// How a timer is called in a scan.
#[derive(Debug)]
struct Use {
    variables: Variables,
    calls: u32,
    /// Nanoseconds, where every call has the same.
    preset: Option<i64>,
}

impl Timers {
    pub(super) fn read(&mut self, address: u64) {
        if self.inside == 0 {
            self.read.insert(address);
        }
    }

    pub(super) fn written(&mut self, address: u64) {
        if self.inside == 0 {
            self.written.insert(address);
        }
    }

    /// Counts the timers that can be counted, after a scan was executed; `wanted` are addresses that somebody asks for.
    pub(crate) fn choose(&mut self, program: &Program, wanted: &BTreeSet<u64>) {
        for (&address, used) in &self.uses {
            let Use { variables, calls: 1, preset: Some(preset) } = used else {
                continue;
            };
            let mut own = variables.own.iter().map(|slot| address + 64 * slot);
            let is_read = |of: &u64| self.read.contains(of) || wanted.contains(of);
            let is_used = own.any(|of| is_read(&of) || self.written.contains(&of))
                || self.written.contains(&(address + 64 * variables.output));
            let period = program.period.max(1);
            let scans = (*preset).max(1).checked_add(period - 1).map(|time| time / period);
            if let (false, Some(scans @ ..=MOST)) = (is_used, scans) {
                self.counted.insert(address, scans as u64);
                self.dropped.extend(variables.own.iter().map(|slot| address + 64 * slot));
            }
        }
        (self.uses, self.read, self.written) = Default::default();
    }
}

impl Execution<'_> {
    /// The variables of a timer that is invoked.
    pub(super) fn timer(&self, routine: RoutineId, place: &Place) -> Option<Variables> {
        let timer = self.program.routine(routine).timer?;
        let Type::Structure(id, _) = place.of else { return None };
        let fields = &self.program.structures.get(id.0 as usize)?.fields;
        let slot = |name: &str| {
            let field = fields.iter().find(|field| field.name.eq_ignore_ascii_case(name))?;
            Some(u64::from(field.slot))
        };
        let start = slot("START")?;
        Some(Variables {
            timer,
            input: slot("IN")?,
            preset: slot("PT")?,
            output: slot("Q")?,
            start,
            own: vec![start, slot("ET")?, slot("STATE")?, slot("LAST")?],
        })
    }

    /// Notes a call of a timer that is not counted.
    pub(super) fn watch(&mut self, variables: &Variables, address: u64, is_only: bool) {
        let preset = self.get(address + 64 * variables.preset, Elementary::Time);
        let is_certain = is_only && self.terms.is(self.path, true);
        let preset = self.terms.value(preset).filter(|_| is_certain);
        let used = self.timers.uses.entry(address).or_insert_with(|| Use {
            variables: variables.clone(),
            calls: 0,
            preset: preset.map(|stored| stored as i64),
        });
        used.calls += 1;
    }

    /// A call of a timer that is over after so many scans.
    pub(super) fn count(&mut self, variables: &Variables, address: u64, scans: u64) {
        let of = Elementary::Udint;
        let at = |slot: u64| address + 64 * slot;
        let input = self.get(at(variables.input), Elementary::Bool);
        let before = self.get(at(variables.start), of);
        let [zero, one, all] = [0, 1, scans].map(|value| self.terms.constant(of, value));
        let (next, output) = match variables.timer {
            Timer::OnDelay => {
                let (more, is_over) = self.one_more(before, one, all);
                (self.terms.choose(input, more, zero), self.terms.and(input, is_over))
            }
            Timer::OffDelay => {
                // Scans that are left.
                let runs = self.terms.compare(Comparison::Greater, before, zero);
                let less = self.terms.apply(Operation::Subtract(of), of, &[before, one]);
                let left = self.terms.choose(runs, less, zero);
                (self.terms.choose(input, all, left), self.terms.or(input, runs))
            }
            Timer::Pulse => {
                let (more, is_over) = self.one_more(before, one, all);
                let runs = self.terms.compare(Comparison::Greater, before, zero);
                let begun = self.terms.or(runs, input);
                let [counted, kept] = [(begun, more), (input, all)]
                    .map(|(condition, value)| self.terms.choose(condition, value, zero));
                let is_running = self.terms.not(is_over);
                (self.terms.choose(is_over, kept, counted), self.terms.and(is_running, begun))
            }
        };
        self.set(at(variables.start), next);
        self.set(at(variables.output), output);
    }

    /// A count with one more, up to all, and whether it was all before.
    fn one_more(&mut self, before: Term, one: Term, all: Term) -> (Term, Term) {
        let of = Elementary::Udint;
        let more = self.terms.apply(Operation::Add(of), of, &[before, one]);
        let runs = self.terms.compare(Comparison::Less, before, all);
        (self.terms.choose(runs, more, all), self.terms.not(runs))
    }
}
