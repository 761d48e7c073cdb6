//! Programs as systems: one alone, or several that read each other's signals.
//!
//! ```text
//! cycle t      y(j)(t)
//! cycle t+1    remote I/O i samples: y(j)(t) where it could prove it, else the value before it, for so many cycles, else the default
//! ```
//!
//! In every cycle each sample may be missing, and each signal may be lost: what is proved holds whatever fails.

mod change;
mod moments;
mod restart;
mod scan;

use std::collections::{BTreeSet, HashMap, HashSet};

use understudy_typed::{Comparison, Elementary, Operation, Parts, Point, Points, Program};

use crate::beside::{Placed, told};
use crate::execute::Unsupported;
use crate::execute::timers::Timers;
use crate::system::{Holds, Source, System};
use crate::term::Term;
pub use change::{AnyValue, InTheWay, SameNames, Switch};
use moments::Age;
pub use restart::POWER_RETURNS;
use restart::Restart;
use scan::Scan;

/// A program, its name and what its inputs are.
#[derive(Debug, Clone)]
pub struct Member<'a> {
    /// The name that its signals stand behind, and a dot.
    pub name: String,
    /// The program.
    pub program: &'a Program,
    /// One for each input, in their order, but for [`Program::RESET`].
    pub sources: Vec<Source>,
}

/// What other programs read of one: its outputs, and whether it ran in the cycle.
struct Outputs {
    points: HashMap<String, Term>,
    can_be_read: Term,
}

impl System {
    /// One program, whose inputs are whatever their bits are. Its properties name its BOOL points and variables.
    ///
    /// # Errors
    /// What of the program cannot be followed.
    pub fn of_program(program: &Program) -> Result<Self, Unsupported> {
        Self::comparing(program, BTreeSet::new(), false)
    }

    /// One program, whose inputs are within their subranges; see [`Source::declared`]. Its properties compare the numbers `compared` too. One with
    /// retentive variables is restarted warm in any scans: where the input [`POWER_RETURNS`] is TRUE.
    ///
    /// # Errors
    /// What of the program cannot be followed.
    pub fn within_subranges(
        program: &Program,
        compared: BTreeSet<String>,
    ) -> Result<Self, Unsupported> {
        Self::alone(program, Source::declared, (compared, true))
    }

    /// As [`Self::of_program`]; properties compare the numbers `compared` too, and the program is restarted warm in any scans where it `restarts`.
    pub(crate) fn comparing(
        program: &Program,
        compared: BTreeSet<String>,
        restarts: bool,
    ) -> Result<Self, Unsupported> {
        Self::alone(program, |_| Source::Any(None), (compared, restarts))
    }

    fn alone(
        program: &Program,
        source: fn(&Point) -> Source,
        (wanted, restarts): (BTreeSet<String>, bool),
    ) -> Result<Self, Unsupported> {
        let mut system = Self { wanted, restarts, ..System::new(&program.name) };
        let points = program.inputs.iter().filter(|point| point.slot != 0);
        let sources: Vec<Source> = points.map(source).collect();
        let runs = system.terms.boolean(true);
        let inputs = sources_as_terms(&mut system, "", &program.inputs, &sources);
        system.add_program("", program, &inputs, runs)?;
        Ok(system)
    }

    /// All programs of a cluster; their signals stand behind the names of their controllers and a dot. Properties compare the numbers `compared` too.
    /// Those with retentive variables are restarted warm in any cycles, as in [`Self::within_subranges`].
    ///
    /// # Errors
    /// What of a program cannot be followed.
    pub fn of_cluster(
        name: &str,
        members: &[Member<'_>],
        compared: BTreeSet<String>,
    ) -> Result<Self, Unsupported> {
        let mut system = Self { wanted: compared, restarts: true, ..System::new(name) };
        // Outputs in the cycle before are cells, so that the order of the programs does not matter.
        let mut before = Vec::with_capacity(members.len());
        for member in members {
            before.push(system.outputs_before(member));
        }
        for (place, member) in members.iter().enumerate() {
            let prefix = format!("{}.", member.name);
            let sampled = system.input(format!("{prefix}sampled"), Elementary::Bool, None);
            let inputs = system.sampled(&prefix, member, &before, sampled);
            let outputs = system.add_program(&prefix, member.program, &inputs, sampled)?;
            system.keep_outputs(&before[place], &outputs, sampled);
        }
        Ok(system)
    }
}

/// Scans after which all tasks of a program begin together again.
pub(crate) fn together(program: &Program) -> u64 {
    program.tasks.iter().map(|task| u64::from(task.every.max(1))).fold(1, |all, every| {
        let divisor = crate::extent::divisor(all.into(), every.into()) as u64;
        // Past every count of scans, the tasks do not meet again.
        (all / divisor.max(1)).saturating_mul(every)
    })
}

/// Free inputs for all points.
fn sources_as_terms(
    system: &mut System,
    prefix: &str,
    points: &Points,
    sources: &[Source],
) -> Vec<Term> {
    let mut sources = sources.iter();
    let terms = points.iter().map(|point| {
        let range = match point.slot {
            0 => None,
            _ => match sources.next() {
                Some(Source::Any(range)) => range.as_ref(),
                _ => None,
            },
        };
        system.input(format!("{prefix}{}", point.name), point.of, range)
    });
    terms.collect()
}

/// The cells that hold what others read of a program.
struct Before {
    outputs: HashMap<String, u32>,
    can_be_read: u32,
}

impl System {
    fn outputs_before(&mut self, member: &Member<'_>) -> Before {
        let outputs = member.program.outputs.iter().map(|point| {
            let shown = format!("{}.{} before", member.name, point.name);
            (point.name.clone(), self.cell(shown, point.of, 0))
        });
        let outputs = outputs.collect();
        let name = format!("{} can be read", member.name);
        Before { outputs, can_be_read: self.cell(name, Elementary::Bool, 0) }
    }

    fn keep_outputs(&mut self, before: &Before, outputs: &Outputs, sampled: Term) {
        for (name, &cell) in &before.outputs {
            if let Some(&value) = outputs.points.get(name) {
                self.cells[cell as usize].next = value;
            }
        }
        let can_be_read = self.terms.and(sampled, outputs.can_be_read);
        self.cells[before.can_be_read as usize].next = can_be_read;
    }

    /// The inputs of a program in a cycle, as its remote I/O samples them.
    fn sampled(
        &mut self,
        prefix: &str,
        member: &Member<'_>,
        before: &[Before],
        sampled: Term,
    ) -> Vec<Term> {
        let points = &member.program.inputs;
        // A remote I/O that restarts has no value of a signal; it samples nothing meanwhile.
        let reads = member.sources.iter();
        let reads = reads.filter(|source| matches!(source, Source::Signal { .. })).count() > 0;
        let forgets = match reads {
            true => {
                let restarts = self.input(format!("{prefix}restarted"), Elementary::Bool, None);
                let absent = self.terms.not(sampled);
                self.terms.and(restarts, absent)
            }
            false => self.terms.boolean(false),
        };
        let mut proved: HashMap<usize, Term> = HashMap::new();
        let mut valid: HashMap<String, Term> = HashMap::new();
        let mut terms = Vec::with_capacity(points.len());
        let mut late = Vec::new();
        let mut sources = member.sources.iter();
        for Point { name, of, slot, .. } in points {
            let (of, source) = match slot {
                0 => (*of, None),
                _ => (*of, sources.next()),
            };
            let shown = format!("{prefix}{name}");
            let term = match source {
                None => self.input(shown, of, None),
                Some(Source::Any(range)) => self.input(shown, of, range.as_ref()),
                Some(Source::Valid { of: other }) => {
                    late.push((terms.len(), other.clone()));
                    self.terms.boolean(false)
                }
                Some(Source::Signal { program, output, default, stale_after }) => {
                    let source = &before[*program];
                    let is_read = match proved.get(program) {
                        Some(&known) => known,
                        None => {
                            let received = format!("{prefix}receives program {program}");
                            let received = self.input(received, Elementary::Bool, None);
                            let can = self.cells[source.can_be_read as usize].term;
                            let is = self.terms.and(received, can);
                            proved.insert(*program, is);
                            is
                        }
                    };
                    let value = source.outputs.get(output);
                    let value = value.map(|&cell| self.cells[cell as usize].term);
                    let default = self.terms.constant(of, *default);
                    let value = value.unwrap_or(default);
                    let (taken, is_valid) =
                        self.taken(&shown, value, is_read, forgets, *stale_after);
                    valid.insert(name.clone(), is_valid);
                    let input = self.terms.choose(is_valid, taken, default);
                    match of {
                        Elementary::Bool => self.observed.push((shown, input)),
                        _ => self.shown.push((shown, input)),
                    }
                    input
                }
            };
            terms.push(term);
        }
        for (place, name) in late {
            if let Some(&is_valid) = valid.get(&name) {
                terms[place] = is_valid;
            }
        }
        for (name, is_valid) in valid {
            self.observed.push((format!("{prefix}{name}.valid"), is_valid));
        }
        terms
    }

    /// The newest value of a signal and whether it is recent enough.
    fn taken(
        &mut self,
        name: &str,
        value: Term,
        is_read: Term,
        forgets: Term,
        stale_after: u32,
    ) -> (Term, Term) {
        let of = self.terms.of(value);
        let kept = self.cell(format!("{name} kept"), of, 0);
        let age = self.cell(format!("{name} age"), Elementary::Uint, 0xffff);
        let old = self.cells[age as usize].term;
        let last = stale_after.min(0xfffe);
        let limit = self.terms.constant(Elementary::Uint, u64::from(last) + 1);
        let one = self.terms.constant(Elementary::Uint, 1);
        let is_old = self.terms.compare(Comparison::GreaterOrEqual, old, limit);
        let older =
            self.terms.apply(Operation::Add(Elementary::Uint), Elementary::Uint, &[old, one]);
        let aged = self.terms.choose(is_old, limit, older);
        let zero = self.terms.constant(Elementary::Uint, 0);
        let now = self.terms.choose(is_read, zero, aged);
        let now = self.terms.choose(forgets, limit, now);
        self.cells[age as usize].next = now;
        let kept_value = self.cells[kept as usize].term;
        let newest = self.terms.choose(is_read, value, kept_value);
        self.cells[kept as usize].next = newest;
        let is_valid = self.terms.compare(Comparison::Less, now, limit);
        (newest, is_valid)
    }

    /// Adds a program; it makes a scan where `runs` holds.
    fn add_program(
        &mut self,
        prefix: &str,
        program: &Program,
        inputs: &[Term],
        runs: Term,
    ) -> Result<Outputs, Unsupported> {
        let first = self.cells.len() as u32;
        let stopped = self.cell(format!("{prefix}{}", Program::FAULT), Elementary::Bool, 0);
        let was_stopped = self.cells[stopped as usize].term;
        let scans = self.cell(format!("{prefix}scans"), Elementary::Ulint, 0);
        let was_scans = self.cells[scans as usize].term;
        let phase = self.cell(format!("{prefix}phase"), Elementary::Ulint, 0);
        let was_phase = self.cells[phase as usize].term;
        let none = HashMap::new();
        let mut how = Scan {
            prefix,
            program,
            inputs,
            scans: was_scans,
            phase: was_phase,
            stopped: None,
            ages: &none,
            clock: None,
        };
        let mut numbers = HashMap::new();
        let mut timers = Timers::new(program);
        let mut scan = self.scan(&how, &mut numbers, &mut timers)?;
        let wanted = self.wanted.iter().filter_map(|name| name.strip_prefix(prefix));
        let wanted = wanted.filter_map(|name| Some(program.part(name)?.address)).collect();
        timers.choose(program, &wanted);
        if !timers.counted.is_empty() {
            numbers.retain(|address, _| !timers.dropped.contains(address));
            scan = self.scan(&how, &mut numbers, &mut timers)?;
        }
        if !self.terms.is(scan.faulted, false) {
            // It can stop: a scan may begin with the initial values.
            how.stopped = Some(was_stopped);
            scan = self.scan(&how, &mut numbers, &mut timers)?;
        }
        let (scan, ages) = self.scan_with_ages(&how, scan, &mut numbers, &mut timers)?;
        let (scan, clock) = self.scan_with_clock(&how, scan, &ages, &mut numbers, &mut timers)?;
        let sums = self.sums(&how, &scan, &ages, &numbers);
        let can_restart = self.restarts && program.is_retentive();
        let time = if can_restart { self.restart_time(prefix, program, &ages) } else { None };
        self.most.extend(ages.values().chain(&clock).map(|age| (age.cell, age.most)));
        self.most.extend(sums.iter().map(|(address, &most)| (numbers[address], most)));
        self.cells[scans as usize].holds = Holds::Scans;
        self.cells[phase as usize].holds = Holds::Phase;
        for counted in timers.counted.values() {
            if let Some(&cell) = numbers.get(&counted.start()) {
                self.cells[cell as usize].holds = Holds::Count(Box::new(counted.clone()));
            }
        }
        for (number, cell) in (first..).zip(&mut self.cells[first as usize..]) {
            match cell.holds {
                Holds::Value(address, _) if numbers.get(&address) != Some(&number) => {
                    cell.holds = Holds::Unused;
                }
                Holds::Age(address) if !ages.contains_key(&address) => {
                    cell.holds = Holds::Uncounted(address);
                }
                Holds::Clock if clock.is_none() => cell.holds = Holds::Unused,
                _ => {}
            }
        }
        let outputs = program.outputs.iter().map(|point| 64 * u64::from(point.slot));
        let shown = outputs.filter(|address| !scan.memory.contains_key(address));
        let seen = scan.read.iter().copied().chain(shown);
        self.seen.extend(seen.filter_map(|address| numbers.get(&address)));
        let read = scan.read.iter().filter(|address| scan.memory.contains_key(address));
        self.read.extend(read.filter_map(|address| numbers.get(address)));
        let can_fault = scan.faulted;
        let resets = program.inputs.iter().zip(inputs);
        let mut reset = resets.filter(|(point, _)| point.slot == 0).map(|(_, &term)| term);
        let reset = reset.next().unwrap_or_else(|| self.terms.boolean(false));
        let running = self.terms.not(was_stopped);
        let begins = self.terms.or(running, reset);
        let begins = self.terms.and(runs, begins);
        // What a fault leaves: the state before the scan.
        let is_restart = self.terms.and(was_stopped, reset);
        let times: Vec<Age> = ages.values().copied().collect();
        let moments: HashSet<u64> = ages.keys().copied().filter(|_| self.keeps_moments).collect();
        let ages = ages.into_iter().map(|(address, age)| (Some(address), age));
        for (address, age) in ages.chain(clock.into_iter().chain(time).map(|time| (None, time))) {
            let new = self.next_age(program, &scan, age, address, how.stopped);
            let cell = self.cells[age.cell as usize].term;
            let left = self.age(age, how.stopped);
            let left = self.terms.choose(is_restart, left, cell);
            let kept = self.terms.choose(can_fault, left, new);
            let next = self.terms.choose(begins, kept, cell);
            self.cells[age.cell as usize].next = next;
        }
        let mut after = HashMap::new();
        for (&address, &cell) in &numbers {
            let (term, initial, of) = {
                let cell = &self.cells[cell as usize];
                (cell.term, cell.initial, cell.of)
            };
            let initial = self.terms.constant(of, initial);
            let left = self.terms.choose(is_restart, initial, term);
            let new = scan.memory.get(&address).copied().unwrap_or(left);
            let mut new = self.terms.as_type(new, of);
            if moments.contains(&address) {
                let now = match clock {
                    Some(_) => self.time_since_start(program, was_scans),
                    None => scan.elapsed,
                };
                new = self.moment(new, &scan, (now, left));
            }
            if let Some(&most) = sums.get(&address) {
                new = self.stopped_at(new, most);
            }
            let kept = self.terms.choose(can_fault, left, new);
            let next = self.terms.choose(begins, kept, term);
            self.cells[cell as usize].next = next;
            after.insert(address, next);
        }
        let mut faulted = self.terms.choose(begins, can_fault, was_stopped);
        self.cells[stopped as usize].next = faulted;
        let one = self.terms.constant(Elementary::Ulint, 1);
        let zero = self.terms.constant(Elementary::Ulint, 0);
        let together = self.terms.constant(Elementary::Ulint, together(program));
        for (counter, was) in [(scans, was_scans), (phase, was_phase)] {
            let begun = self.terms.choose(is_restart, zero, was);
            let add = Operation::Add(Elementary::Ulint);
            let mut more = self.terms.apply(add, Elementary::Ulint, &[begun, one]);
            if counter == phase {
                let less = self.terms.compare(Comparison::Less, more, together);
                more = self.terms.choose(less, more, zero);
            }
            let counted = self.terms.choose(can_fault, begun, more);
            self.cells[counter as usize].next = self.terms.choose(begins, counted, was);
        }
        let mut restarts = None;
        if can_restart {
            let cells = [stopped, scans, phase].into_iter().chain(numbers.values().copied());
            let cells = cells.chain(times.iter().chain(&clock).chain(&time).map(|age| age.cell));
            let mut cells: Vec<u32> = cells.collect();
            cells.sort_unstable();
            let restart = Restart { prefix, program, cells, ages: times, time };
            let roots = after.values_mut().chain([&mut faulted]);
            restarts = Some(self.let_restart(&restart, &mut roots.collect::<Vec<_>>()));
        }
        let told = told(prefix, program, &after, faulted);
        self.programs.push(Placed { inputs: inputs.to_vec(), runs, restarts, told });
        let limited = program.inputs.iter().filter_map(|point| Some((point, point.range?)));
        self.subranges
            .extend(limited.map(|(point, range)| (format!("{prefix}{}", point.name), range)));
        Ok(self.observe(prefix, program, &after, faulted))
    }

    /// Names what properties and others read.
    fn observe(
        &mut self,
        prefix: &str,
        program: &Program,
        after: &HashMap<u64, Term>,
        faulted: Term,
    ) -> Outputs {
        let mut read = HashMap::new();
        for point in &program.outputs {
            let name = format!("{prefix}{}", point.name);
            let value = match point.slot {
                0 => Some(faulted),
                slot => after.get(&(64 * u64::from(slot))).copied(),
            };
            let Some(value) = value else { continue };
            read.insert(point.name.clone(), value);
            match point.of {
                Elementary::Bool => self.observed.push((name, value)),
                _ => self.shown.push((name, value)),
            }
        }
        if program.outputs.find(Program::FAULT).is_none() {
            self.observed.push((format!("{prefix}{}", Program::FAULT), faulted));
        }
        self.name_numbers(prefix, program, after);
        let mut rest: Vec<(u64, Term)> = after.iter().map(|(&at, &term)| (at, term)).collect();
        rest.sort_unstable();
        let slots = program.outputs.iter().chain(&program.inputs);
        let points: HashSet<u64> = slots.map(|point| 64 * u64::from(point.slot)).collect();
        let mut known: HashSet<String> =
            self.observed.iter().map(|(name, _)| name.clone()).collect();
        let parts = Parts::new(program);
        for (address, value) in rest {
            if self.terms.of(value) == Elementary::Bool
                && !points.contains(&address)
                && let Some(part) = parts.at(address)
            {
                let name = format!("{prefix}{}", part.name);
                if known.insert(name.clone()) {
                    self.observed.push((name, value));
                }
            }
        }
        Outputs { points: read, can_be_read: self.terms.not(faulted) }
    }
}
