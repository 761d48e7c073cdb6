//! An online change: a program and the one that takes its place, on the same inputs.
//!
//! ```text
//! old.y(t) = h(x(t), u(t))                          the old program continues
//! new.y(t) = h'(z(t), u(t))                         the new one, from the switch on
//! z(s) = c(x(s))                                    the state that it takes over before scan s
//! changed                                           a switch was before this scan, or is
//! ```
//!
//! The switch is before the first scan, from two states at hand, or before any scan of the old program. Then every read of a cell of the new program is
//! replaced by `changed before ? z(i) : c(x)(i)`, as for a warm start. A value that cannot be taken over cell by cell may be any, which is told: what
//! is proved for any value is true of the one that it has.

mod times;

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use understudy_typed::{Comparison, Elementary, Operation, Origin, Point, Points, Program, Taken};

use super::{Outputs, together};
use crate::System;
use crate::execute::Unsupported;
use crate::extent::Extents;
use crate::system::{Begins, Cell, Holds, Source};
use crate::term::{Term, Variable};

/// Prefix of the signals of the old program.
const OLD: &str = "old.";
/// Prefix of the signals of the new program.
const NEW: &str = "new.";
/// Prefix of the signal that is TRUE where an output differs.
const DIFFERS: &str = "differs.";

/// Attempts to follow two programs so that the values of one are those of the other.
const ATTEMPTS: u32 = 6;

/// About a value whose conversion is not followed.
const OTHER_TYPE: &str = "has another type in the new program";

/// When the new program takes the place of the old one.
#[derive(Debug, Clone, Copy)]
pub enum Switch<'a> {
    /// Before the first scan, in these states of the two programs.
    Now {
        /// State of the old program.
        before: &'a [u64],
        /// State of the new program.
        after: &'a [u64],
    },
    /// Before any scan of the old program: where the input [`System::CHANGE`] is TRUE for the first time.
    AnyScan {
        /// Where the values of the new program come from; see [`understudy_typed::Successor::origins`].
        origins: &'a [Origin],
    },
}

/// Which inputs and outputs of two programs are the same one: their names before and after.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SameNames {
    /// Inputs.
    pub inputs: Vec<[String; 2]>,
    /// Outputs.
    pub outputs: Vec<[String; 2]>,
}

impl SameNames {
    /// Those of the same name and type.
    pub fn by_name(before: &Program, after: &Program) -> Self {
        let same = |old: &Points, new: &Points| {
            let is_same =
                |point: &&Point| old.find(&point.name).is_some_and(|it| it.of == point.of);
            new.iter().filter(is_same).map(|it| [it.name.clone(), it.name.clone()]).collect()
        };
        Self {
            inputs: same(&before.inputs, &after.inputs),
            outputs: same(&before.outputs, &after.outputs),
        }
    }

    /// The outputs that both programs have, in the order of the one after: their names before and after. A program that reports no fault has none.
    pub fn compared(&self, before: &Program, after: &Program) -> Vec<[String; 2]> {
        let faults = before.outputs.find(Program::FAULT);
        let of = |name: &str| {
            let both = self.outputs.iter().find(|[_, now]| now == name).cloned();
            let is_fault = name == Program::FAULT && faults.is_none();
            both.or_else(|| is_fault.then(|| [name, name].map(str::to_owned)))
        };
        after.outputs.names().filter_map(of).collect()
    }
}

/// Why two programs are not compared.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum InTheWay {
    /// A statement of one of them cannot be followed.
    #[error(transparent)]
    Unsupported(#[from] Unsupported),
    /// Times of the two programs depend on each other.
    #[error("`{0}` has times that depend on each other")]
    Times(String),
}

/// A value that the new program takes over and that is not followed: it may be any.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{name}` {why}")]
pub struct AnyValue {
    /// The variable.
    pub name: String,
    /// What about it.
    pub why: &'static str,
}

/// A program of the two.
struct Side<'p> {
    prefix: &'static str,
    program: &'p Program,
    cells: Range<u32>,
    outputs: Outputs,
}

/// What must be followed in another way, so that values of one program are those of the other.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
struct Asked {
    /// Variables with a cell of their own; a timer with one is not counted in scans.
    wanted: BTreeSet<String>,
    /// Times that are counted so far at least.
    least: BTreeMap<(String, u64), i64>,
}

/// Both programs in one system.
struct Both<'p> {
    old: Side<'p>,
    new: Side<'p>,
    /// Where what is named of the new program begins, among the BOOLs and among all others.
    named: [usize; 2],
    origins: BTreeMap<u64, Origin>,
}

/// What a cell begins with, or what about it is not followed.
type Begun = Result<Term, &'static str>;

impl System {
    /// The input of [`Switch::AnyScan`].
    pub const CHANGE: &'static str = "change";

    /// The BOOL that is TRUE from the switch on.
    pub const CHANGED: &'static str = "changed";

    /// `before` and `after` on the same inputs, within their declarations; an input that is not in `same` may be any. Outputs are named `old.` and `new.`,
    /// then their names; `differs.` and the name after of an output that both have is TRUE where the two differ after the switch.
    ///
    /// # Errors
    /// What is in the way.
    pub fn of_change(
        before: &Program,
        after: &Program,
        switch: Switch<'_>,
        same: &SameNames,
    ) -> Result<Self, InTheWay> {
        let origins: BTreeMap<u64, Origin> = match switch {
            Switch::Now { .. } => BTreeMap::new(),
            Switch::AnyScan { origins } => {
                origins.iter().map(|origin| (origin.now, *origin)).collect()
            }
        };
        let mut asked = Asked::default();
        for _ in 0..ATTEMPTS {
            let known = asked.clone();
            let Asked { wanted, least } = known.clone();
            let mut system = Self { wanted, least, keeps_moments: true, ..Self::new(&after.name) };
            let mut both = system.both((before, after), switch, origins.clone(), same)?;
            let changed = match switch {
                Switch::Now { before, after } => {
                    system.begin(&both.old, before, &mut asked);
                    system.begin(&both.new, after, &mut asked);
                    system.terms.boolean(true)
                }
                Switch::AnyScan { .. } => system.take_over(&mut both, &mut asked),
            };
            if asked == known {
                system.observe_differences(&both, changed, &same.compared(before, after));
                return Ok(system);
            }
        }
        Err(InTheWay::Times(after.name.clone()))
    }

    /// The values that a new program takes over and that may be any.
    pub fn any_values(&self) -> &[AnyValue] {
        &self.any_values
    }

    /// The name of the BOOL that is TRUE where an output differs after the switch.
    pub fn differs(output: &str) -> String {
        format!("{DIFFERS}{output}")
    }

    /// The signals of an output with these names in the old and in the new program.
    pub fn both_of([old, new]: &[String; 2]) -> [String; 2] {
        [format!("{OLD}{old}"), format!("{NEW}{new}")]
    }

    fn both<'p>(
        &mut self,
        (before, after): (&'p Program, &'p Program),
        switch: Switch<'_>,
        origins: BTreeMap<u64, Origin>,
        same: &SameNames,
    ) -> Result<Both<'p>, Unsupported> {
        let points = before.inputs.iter().filter(|point| point.slot != 0);
        let sources: Vec<Source> = points.map(Source::declared).collect();
        let given = super::sources_as_terms(self, "", &before.inputs, &sources);
        let known: BTreeMap<(&str, Elementary), Term> =
            before.inputs.iter().map(|it| (it.name.as_str(), it.of)).zip(given.clone()).collect();
        let names: BTreeMap<&str, &str> =
            same.inputs.iter().map(|[old, new]| (new.as_str(), old.as_str())).collect();
        let of_new = after.inputs.iter().map(|point| {
            let known = names.get(point.name.as_str()).and_then(|old| known.get(&(*old, point.of)));
            if let Some(&term) = known {
                return term;
            }
            // An input of another type is another one.
            let is_known = before.inputs.find(&point.name).is_some();
            let prefix = if is_known { NEW } else { "" };
            self.input(format!("{prefix}{}", point.name), point.of, None)
        });
        let of_new: Vec<Term> = of_new.collect();
        if let Switch::Now { before, .. } = switch {
            self.begins = Begins::In(before.to_vec());
        }
        let old = self.side(OLD, before, &given)?;
        let named = [self.observed.len(), self.shown.len()];
        self.begins = match switch {
            Switch::Now { after, .. } => Begins::In(after.to_vec()),
            Switch::AnyScan { .. } => Begins::AtMost(self.greatest_taken_over(&old, &origins)),
        };
        let new = self.side(NEW, after, &of_new)?;
        self.begins = Begins::Initially;
        Ok(Both { old, new, named, origins })
    }

    fn side<'p>(
        &mut self,
        prefix: &'static str,
        program: &'p Program,
        inputs: &[Term],
    ) -> Result<Side<'p>, Unsupported> {
        let first = self.cells.len() as u32;
        let runs = self.terms.boolean(true);
        let outputs = self.add_program(prefix, program, inputs, runs)?;
        Ok(Side { prefix, program, cells: first..self.cells.len() as u32, outputs })
    }

    /// The greatest number that each variable of the new program takes over; nothing where the old one may have any, or keeps it in another way.
    fn greatest_taken_over(
        &self,
        old: &Side<'_>,
        origins: &BTreeMap<u64, Origin>,
    ) -> BTreeMap<u64, Option<i64>> {
        let extents = Extents::new(self, &[]);
        let cells = &self.cells[old.cells.start as usize..old.cells.end as usize];
        let greatest = |from: u64| {
            let is_it = |cell: &&Cell| matches!(cell.holds, Holds::Value(at, _) if at == from);
            let cell = cells.iter().find(is_it)?;
            let high = extents.get(cell.term).high;
            (high < cell.of.limits().1).then(|| i64::try_from(high).ok()).flatten()
        };
        let is_number_kept = |origin: &Origin| match origin.taken {
            Taken::Same => true,
            Taken::Wider(_, to) => !to.is_real(),
            Taken::Otherwise => false,
        };
        let of = |origin: &Origin| greatest(origin.before).filter(|_| is_number_kept(origin));
        origins.iter().map(|(&now, origin)| (now, of(origin))).collect()
    }

    /// Begins one of the programs in a state.
    fn begin(&mut self, side: &Side<'_>, state: &[u64], asked: &mut Asked) {
        let times = (side.program.period.max(1), together(side.program));
        for cell in side.cells.clone() {
            let most = self.most.get(&cell).map_or(i128::MAX, |&most| i128::from(most));
            let Self { cells, .. } = self;
            let cell = &mut cells[cell as usize];
            let number = match &cell.holds {
                // Whether a fault has stopped it.
                Holds::Other => Some(i128::from(state[0] != 0)),
                holds => holds.number(state, most, times),
            };
            match (number, &cell.holds) {
                (Some(number), _) => cell.initial = number as u64 & cell.of.mask(),
                // It runs with the preset of the other program.
                (None, Holds::Count(counted)) => asked.want(side, counted.start()),
                (None, _) => {}
            }
        }
    }

    /// Lets the new program take over the state of the old one before any scan; whether it has, or does in this scan.
    fn take_over(&mut self, both: &mut Both<'_>, asked: &mut Asked) -> Term {
        let change = self.input(Self::CHANGE.to_owned(), Elementary::Bool, None);
        let known = self.cell(Self::CHANGED.to_owned(), Elementary::Bool, 0);
        let before = self.cells[known as usize].term;
        let changed = self.terms.or(before, change);
        self.cells[known as usize].next = changed;
        let mut replaced: BTreeMap<Term, Term> = BTreeMap::new();
        for cell in both.new.cells.clone() {
            let Cell { term, of, .. } = self.cells[cell as usize];
            let begins = match self.begun(cell, both, asked) {
                Ok(begins) => begins,
                Err(why) => {
                    let is_read = !matches!(self.cells[cell as usize].holds, Holds::Value(..))
                        || self.seen.contains(&cell);
                    if is_read {
                        let name = self.cells[cell as usize].name.trim_start_matches(NEW);
                        self.any_values.push(AnyValue { name: name.to_owned(), why });
                    }
                    self.any(cell, of, both.new.program)
                }
            };
            let read = self.terms.choose(before, term, begins);
            replaced.insert(term, read);
        }
        let [observed, shown] = both.named;
        let cells: Vec<u32> = both.new.cells.clone().collect();
        let mut roots: Vec<Term> =
            cells.iter().map(|&cell| self.cells[cell as usize].next).collect();
        roots.extend(self.observed[observed..].iter().map(|(_, term)| *term));
        roots.extend(self.shown[shown..].iter().map(|(_, term)| *term));
        let names: Vec<String> = both.new.outputs.points.keys().cloned().collect();
        roots.extend(names.iter().map(|name| both.new.outputs.points[name]));
        let terms = self.terms.replaced(&roots, |variable, term| match variable {
            Variable::Cell(_) => replaced.get(&term).copied().unwrap_or(term),
            Variable::Input(_) => term,
        });
        let mut terms = terms.into_iter();
        for (cell, next) in cells.into_iter().zip(terms.by_ref()) {
            let kept = self.cells[cell as usize].term;
            self.cells[cell as usize].next = self.terms.choose(changed, next, kept);
        }
        let named = self.observed[observed..].iter_mut().chain(&mut self.shown[shown..]);
        for ((_, term), new) in named.zip(terms.by_ref()) {
            *term = new;
        }
        both.new.outputs.points.extend(names.into_iter().zip(terms));
        changed
    }

    /// Any value that a cell can have.
    fn any(&mut self, cell: u32, of: Elementary, program: &Program) -> Term {
        let any = self.terms.unknown(of);
        match self.cells[cell as usize].holds {
            Holds::Phase => {
                let together = self.terms.constant(of, together(program));
                self.terms.apply(Operation::Modulo(of), of, &[any, together])
            }
            _ => any,
        }
    }

    /// What a cell of the new program has at the switch; or what about it is not followed, which may be because more is asked first.
    fn begun(&mut self, cell: u32, both: &Both<'_>, asked: &mut Asked) -> Begun {
        let Both { old, new, origins, .. } = both;
        let holds = self.cells[cell as usize].holds.clone();
        let initial = |system: &mut Self| {
            let cell = &system.cells[cell as usize];
            let (of, initial) = (cell.of, cell.initial);
            system.terms.constant(of, initial)
        };
        let most = self.most.get(&cell).copied();
        match holds {
            // Whether a fault has stopped it.
            Holds::Other => Ok(self.cells[old.cells.start as usize].term),
            Holds::Uncounted(_) | Holds::Unused => Ok(initial(self)),
            Holds::Scans => Ok(self.held(old, |holds| matches!(holds, Holds::Scans))?),
            Holds::Phase if together(new.program) == 1 => Ok(initial(self)),
            Holds::Phase if together(new.program) == together(old.program) => {
                self.held(old, |holds| matches!(holds, Holds::Phase))
            }
            Holds::Phase => Err("counts the scans of tasks with other intervals"),
            Holds::Clock => {
                let clock = self.held(old, |holds| matches!(holds, Holds::Clock));
                match clock.ok().filter(|&clock| self.reaches(clock, most)) {
                    Some(clock) => Ok(self.up_to(clock, most)),
                    None => self.time(old, most),
                }
            }
            Holds::Age(address) => {
                let Some(origin) = origins.get(&address) else {
                    // A moment begins as 0.
                    return self.time(old, most);
                };
                if origin.taken != Taken::Same {
                    return Err(OTHER_TYPE);
                }
                let from = origin.before;
                let is_age = |holds: &Holds| matches!(holds, Holds::Age(at) if *at == from);
                let Ok(age) = self.held(old, is_age) else {
                    self.want_count(old, from, asked);
                    return self.time_since(old, from, most);
                };
                if !self.reaches(age, most) {
                    asked.least.insert((OLD.to_owned(), from), most.unwrap_or(i64::MAX));
                    return Err("is a moment that is longer ago than the old program asks");
                }
                Ok(self.up_to(age, most))
            }
            Holds::Count(counted) => {
                let Some(origin) = origins.get(&counted.start()) else {
                    return Ok(initial(self));
                };
                let from = origin.before;
                let same = |holds: &Holds| match holds {
                    Holds::Count(other) => other.start() == from && other.counts_as(&counted),
                    _ => false,
                };
                self.held(old, same).inspect_err(|_| {
                    asked.want(new, counted.start());
                    self.want_count(old, from, asked);
                })
            }
            Holds::Value(address, of) => {
                let Some(origin) = origins.get(&address) else {
                    return Ok(initial(self));
                };
                if origin.taken == Taken::Otherwise {
                    return Err(OTHER_TYPE);
                }
                let from = origin.before;
                let same = |holds: &Holds| matches!(holds, Holds::Value(at, _) if *at == from);
                let value = self.held(old, same).inspect_err(|_| {
                    if !self.want_count(old, from, asked) {
                        asked.want(old, from);
                    }
                })?;
                if let Taken::Wider(narrow, wide) = origin.taken
                    && (self.terms.of(value), of) == (narrow, wide)
                {
                    return Ok(self.terms.apply(Operation::Convert(narrow, wide), wide, &[value]));
                }
                if self.terms.of(value) != of {
                    return Err(OTHER_TYPE);
                }
                if self.most_of(value).is_some() && !self.reaches(value, most) {
                    asked.least.insert((OLD.to_owned(), from), most.unwrap_or(i64::MAX));
                    return Err("is a time that is longer than the old program asks");
                }
                Ok(self.up_to(value, most))
            }
        }
    }

    /// The cell of a program that holds something, before a scan.
    fn held(&self, side: &Side<'_>, what: impl Fn(&Holds) -> bool) -> Begun {
        let cells = &self.cells[side.cells.start as usize..side.cells.end as usize];
        let found = cells.iter().find(|cell| what(&cell.holds));
        found.map(|cell| cell.term).ok_or("is kept by the old program in another way")
    }

    /// Asks for a timer of a program to be followed through its body, if it is counted and keeps what is at an address; whether it is.
    fn want_count(&self, side: &Side<'_>, address: u64, asked: &mut Asked) -> bool {
        let cells = &self.cells[side.cells.start as usize..side.cells.end as usize];
        let mut starts = cells.iter().filter_map(|cell| match &cell.holds {
            Holds::Count(counted) if counted.keeps(address) => Some(counted.start()),
            _ => None,
        });
        let start = starts.next();
        start.into_iter().for_each(|start| asked.want(side, start));
        start.is_some()
    }

    /// Names where the outputs differ.
    fn observe_differences(&mut self, both: &Both<'_>, changed: Term, compared: &[[String; 2]]) {
        self.wanted.clear();
        self.numbers.clear();
        self.observed.push((Self::CHANGED.to_owned(), changed));
        let stopped = self.terms.boolean(false);
        for names in compared {
            let Some(point) = both.new.program.outputs.find(&names[1]) else {
                continue;
            };
            let sides = [(&both.old, &names[0]), (&both.new, &names[1])];
            let [old, new] =
                sides.map(|(side, name)| side.outputs.points.get(name).copied().unwrap_or(stopped));
            let apart = match point.of {
                Elementary::Bool => {
                    let xor = Operation::Xor(Elementary::Bool);
                    self.terms.apply(xor, Elementary::Bool, &[old, new])
                }
                _ => self.terms.compare(Comparison::NotEqual, old, new),
            };
            let differs = self.terms.and(changed, apart);
            self.observed.push((Self::differs(&point.name), differs));
        }
    }
}

impl Asked {
    /// Asks for a cell of the variable at an address.
    fn want(&mut self, side: &Side<'_>, address: u64) {
        if let Some(part) = side.program.part_at(address) {
            self.wanted.insert(format!("{}{}", side.prefix, part.name));
        }
    }
}
