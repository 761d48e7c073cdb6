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

/// The states of a timer, as its body has them.
const IDLE: u64 = 0;
pub(crate) const RUNNING: u64 = 1;
const OVER: u64 = 2;

/// The timers of a program.
#[derive(Debug)]
pub(crate) struct Timers {
    /// Those that are counted, by address.
    pub(crate) counted: BTreeMap<u64, Counted>,
    /// What they do not keep then, by address.
    pub(crate) dropped: BTreeSet<u64>,
    /// What a scan does with them, until it is decided which are counted.
    watched: Option<Watched>,
    /// Bodies of timers that are being executed.
    pub(super) inside: u32,
}

/// What a scan does with timers, and what of memory it reads and writes outside of their bodies, by address.
#[derive(Debug, Default)]
struct Watched {
    uses: BTreeMap<u64, Use>,
    read: BTreeSet<u64>,
    written: BTreeSet<u64>,
}

/// A timer, and the slots of its variables in an instance.
#[derive(Debug, Clone, Copy)]
pub(super) struct Variables {
    timer: Timer,
    input: u64,
    preset: u64,
    output: u64,
    elapsed: u64,
    start: u64,
    state: u64,
    last: u64,
}

impl Variables {
    /// What nothing else may read or write: the time that has elapsed, and what it keeps.
    fn own(self) -> [u64; 4] {
        [self.elapsed, self.start, self.state, self.last]
    }
}

/// A timer that is counted.
#[derive(Debug, Clone)]
pub(crate) struct Counted {
    address: u64,
    variables: Variables,
    /// Scans until it is over.
    scans: u64,
    /// Nanoseconds.
    preset: i64,
}

impl Counted {
    fn at(&self, slot: u64) -> u64 {
        self.address + 64 * slot
    }

    /// Whether another timer has the same state for each count.
    pub(crate) fn counts_as(&self, other: &Self) -> bool {
        let kind = |counted: &Self| (counted.variables.timer, counted.scans, counted.preset);
        kind(self) == kind(other)
    }

    /// The address whose cell has the count.
    pub(crate) fn start(&self) -> u64 {
        self.at(self.variables.start)
    }

    /// How many scans the count may reach back.
    pub(crate) fn reach(&self) -> u64 {
        self.scans
    }

    /// The addresses at which the timer keeps something.
    pub(crate) fn addresses(&self) -> [u64; 5] {
        self.kept(0, 0, 0).map(|(address, _)| address)
    }

    /// Whether the timer keeps what is at an address.
    pub(crate) fn keeps(&self, address: u64) -> bool {
        self.addresses().contains(&address)
    }

    /// The count with which every later scan of the timer is that from what `stored` has at each address; none where it began in the future. One that is
    /// over stays so, whatever its preset was.
    pub(crate) fn count(&self, stored: impl Fn(u64) -> u64, now: i64, period: i64) -> Option<u64> {
        let variables = self.variables;
        let at = |slot: u64| stored(self.at(slot));
        let runs = now.saturating_sub(at(variables.start) as i64).checked_div(period);
        let runs = || Some(u64::try_from(runs?).ok()?.min(self.scans));
        match (variables.timer, at(variables.state)) {
            (Timer::OnDelay | Timer::Pulse, RUNNING) => runs(),
            (Timer::OnDelay | Timer::Pulse, OVER) => Some(self.scans),
            (Timer::OffDelay, RUNNING) => Some(self.scans - runs()?),
            (Timer::OffDelay, IDLE) if at(variables.last) == 1 => Some(self.scans),
            _ => Some(0),
        }
    }

    /// Where the timer keeps its output and whether that is TRUE once it is over, and where it keeps its state; nothing of one that keeps no such state.
    pub(crate) fn over(&self, count: u64) -> Option<(u64, bool, u64)> {
        let is_over = count >= self.scans && self.variables.timer != Timer::OffDelay;
        let [output, state] =
            [self.variables.output, self.variables.state].map(|slot| self.at(slot));
        is_over.then_some((output, self.variables.timer == Timer::OnDelay, state))
    }

    /// What the timer keeps where its count is `count`, so that every later scan is the same: values by address. `now` is the `TIME()` of the next
    /// scan.
    pub(crate) fn kept(&self, count: u64, now: i64, period: i64) -> [(u64, u64); 5] {
        let variables = self.variables;
        let time = |scans: u64| period.saturating_mul(scans as i64);
        // Scans that it runs, its input, its output, and the time that has elapsed where it does not run.
        let is_full = count >= self.scans;
        let (runs, input, output, rest) = match variables.timer {
            Timer::OnDelay => (count, count > 0, is_full, 0),
            Timer::Pulse => (count, count > 0, count > 0 && !is_full, 0),
            Timer::OffDelay if is_full => (0, true, true, 0),
            Timer::OffDelay if count == 0 => (0, false, false, self.preset),
            Timer::OffDelay => (self.scans - count, false, true, 0),
        };
        let (state, elapsed) = match runs {
            0 => (IDLE, rest),
            _ if is_full => (OVER, self.preset),
            runs => (RUNNING, time(runs - 1).min(self.preset)),
        };
        [
            (variables.state, state),
            (variables.last, u64::from(input)),
            (variables.start, now.saturating_sub(time(runs)) as u64),
            (variables.elapsed, elapsed as u64),
            (variables.output, u64::from(output)),
        ]
        .map(|(slot, value)| (self.at(slot), value))
    }
}

/// How a timer is called in a scan.
#[derive(Debug)]
struct Use {
    variables: Variables,
    calls: u32,
    /// Nanoseconds, where the call is certain and has always the same.
    preset: Option<i64>,
}

impl Timers {
    /// Of a program, before its first scan is executed.
    pub(crate) fn new(program: &Program) -> Self {
        let has_timers = program.routines.iter().any(|routine| routine.timer.is_some());
        let watched = has_timers.then(Watched::default);
        Self { counted: BTreeMap::new(), dropped: BTreeSet::new(), watched, inside: 0 }
    }

    pub(super) fn read(&mut self, address: u64) {
        if let (0, Some(watched)) = (self.inside, &mut self.watched) {
            watched.read.insert(address);
        }
    }

    pub(super) fn written(&mut self, address: u64) {
        if let (0, Some(watched)) = (self.inside, &mut self.watched) {
            watched.written.insert(address);
        }
    }

    /// Counts the timers that can be counted, after a scan was executed; `wanted` are addresses whose values are asked for.
    pub(crate) fn choose(&mut self, program: &Program, wanted: &BTreeSet<u64>) {
        let Some(Watched { uses, read, written }) = self.watched.take() else {
            return;
        };
        for (address, used) in uses {
            let Use { variables, calls: 1, preset: Some(preset) } = used else {
                continue;
            };
            let at = |slot: u64| address + 64 * slot;
            let own = variables.own().map(at);
            let is_used = written.contains(&at(variables.output))
                || own
                    .iter()
                    .any(|of| [&read, &written, wanted].iter().any(|all| all.contains(of)));
            let period = program.period.max(1);
            let scans = preset.max(1).checked_add(period - 1).map(|time| time / period);
            if let (false, Some(scans @ ..=MOST)) = (is_used, scans) {
                let scans = scans as u64;
                self.counted.insert(address, Counted { address, variables, scans, preset });
                self.dropped.extend(own);
            }
        }
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
        Some(Variables {
            timer,
            input: slot("IN")?,
            preset: slot("PT")?,
            output: slot("Q")?,
            elapsed: slot("ET")?,
            start: slot("START")?,
            state: slot("STATE")?,
            last: slot("LAST")?,
        })
    }

    /// Notes a call of a timer.
    pub(super) fn watch(&mut self, variables: &Variables, address: u64, is_only: bool) {
        if self.timers.watched.is_none() {
            return;
        }
        let preset = self.get(address + 64 * variables.preset, Elementary::Time);
        let is_certain = is_only && self.terms.is(self.path, true);
        let preset = self.terms.value(preset).filter(|_| is_certain);
        let preset = preset.map(|stored| stored as i64);
        if let Some(watched) = &mut self.timers.watched {
            let first = Use { variables: *variables, calls: 0, preset };
            watched.uses.entry(address).or_insert(first).calls += 1;
        }
    }

    /// A call of a timer that is counted.
    pub(super) fn count(&mut self, counted: &Counted) {
        let of = Elementary::Udint;
        let Counted { variables, scans, .. } = *counted;
        let at = |slot: u64| counted.at(slot);
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
