//! Programs that nothing runs: what is wrong with them, and what others miss of them.
//!
//! A program reads the memory of another one, or a global variable that another one writes. Where that one is not executed, the variable keeps
//! its initial value, and what is found of the first program is not true of both together.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::ops::Range;

use understudy_typed::{Place, Root, Uses};

use crate::syntax::Unit;

use super::Lowering;
use super::names::Symbol;

/// Names that a warning lists at most.
const NAMED: usize = 8;

impl<'a> Lowering<'a> {
    /// Checks the programs that nothing runs and nothing calls, and searches what the others read of them. Nothing of them
    /// is kept. Where one program was chosen, errors of the others are not reported.
    pub(super) fn check_idle(&mut self, programs: &[&'a Unit], is_chosen: bool) {
        let has_body = self.routines.keys().filter(|key| key.owner.method.is_none());
        let executed: HashSet<usize> = has_body.map(|key| key.owner.unit).collect();
        let routines = self.program.routines.iter();
        let read: Vec<Range<u64>> = routines
            .flat_map(|routine| Uses::of(&routine.body).reads)
            .filter_map(|place| address(place, None))
            .collect();
        let kept = (self.program.clone(), self.calls.clone());
        let at = (std::mem::take(&mut self.addresses), std::mem::take(&mut self.extents));
        let known = self.routines.clone();
        // A program with an error is not executed for that reason.
        let is_whole = !understudy_text::has_errors(&self.diagnostics);
        let warned = (self.subranges.len(), self.without_cycle.len(), self.sets_cycle);
        for program in programs {
            let Some(&unit) = self.unit_names.get(&program.name.key()) else {
                continue;
            };
            if executed.contains(&unit) {
                continue;
            }
            let named = self.named_programs.get(&unit).cloned();
            if named.is_none() && !is_chosen && is_whole {
                let message =
                    format!("nothing runs the PROGRAM `{}`: it is not kept", program.name);
                let help = "name it in a CONFIGURATION, call it, or remove it";
                self.warn("U1055", message, program.name.span(), help);
            }
            let is_silent = is_chosen || named.is_some();
            self.silent += u32::from(is_silent);
            let first = self.program.routines.len();
            self.check(unit, None, Some(unit), program);
            self.bodies();
            self.recursion();
            self.silent -= u32::from(is_silent);
            if is_silent {
                self.subranges.truncate(warned.0);
                self.without_cycle.truncate(warned.1);
                self.sets_cycle = warned.2;
            }
            let own = named.as_ref().and_then(slot);
            let mut written = self.written(first, unit, own);
            // What both have at an address is one memory.
            let addresses = self.addresses.iter();
            for (own, other) in addresses.filter_map(|(key, own)| Some((own, at.0.get(key)?))) {
                let (Some(own), Some(other)) = (slot(own), slot(other)) else {
                    continue;
                };
                let is_it = |range: &&Range<u64>| range.start / 64 == own;
                let there = |range: &Range<u64>| {
                    let [start, end] =
                        [range.start, range.end].map(|bit| bit - 64 * own + 64 * other);
                    start..end
                };
                let also: Vec<Range<u64>> = written.iter().filter(is_it).map(there).collect();
                written.extend(also);
            }
            self.warn_of_missing(program, written, (&read, &at.0));
        }
        (self.program, self.calls) = kept;
        (self.addresses, self.extents) = at;
        self.routines = known;
        self.elements = Default::default();
    }

    /// What the routines from `first` on write of global memory, and of the memory of their program where that begins at a slot.
    fn written(&self, first: usize, unit: usize, own: Option<u64>) -> Vec<Range<u64>> {
        let routines = self.routines.iter().filter(|(key, _)| key.class == Some(unit));
        let of_program: HashSet<usize> =
            routines.map(|(_, routine)| routine.id.0 as usize).collect();
        let mut written = Vec::new();
        for (index, routine) in self.program.routines.iter().enumerate().skip(first) {
            let own = own.filter(|_| of_program.contains(&index));
            let places = Uses::of(&routine.body).writes.into_iter();
            written.extend(places.filter_map(|place| address(place, own)));
        }
        written
    }

    fn warn_of_missing(
        &mut self,
        program: &Unit,
        written: Vec<Range<u64>>,
        (read, addresses): (&[Range<u64>], &HashMap<String, Symbol>),
    ) {
        let mut names = BTreeSet::new();
        let name = |bit: u64| {
            let part = self.program.part_at(bit).map(|part| part.name);
            let mut addresses = addresses.iter();
            let is_it = |symbol: &Symbol| slot(symbol) == Some(bit / 64);
            part.or_else(|| Some(addresses.find(|(_, symbol)| is_it(symbol))?.0.clone()))
        };
        for written in written {
            let read = read.iter();
            let both = read.map(|read| written.start.max(read.start)..written.end.min(read.end));
            names.extend(both.filter(|both| !both.is_empty()).filter_map(|both| name(both.start)));
        }
        if names.is_empty() {
            return;
        }
        let listed = names.iter().take(NAMED);
        let mut list: Vec<String> = listed.map(|name| format!("`{name}`")).collect();
        if let more @ 1.. = names.len().saturating_sub(NAMED) {
            list.push(format!("{more} more"));
        }
        let message = format!(
            "{} {} read here and written by the PROGRAM `{}`, which is not executed: without it the initial value stays",
            list.join(", "),
            if names.len() == 1 { "is" } else { "are" },
            program.name
        );
        let help = "execute the programs together: without --program, or by a CONFIGURATION that names both; or make it an input (VAR_INPUT)";
        self.warn("U1085", message, program.name.span(), help);
    }
}

/// The slot at which a variable of the state begins.
fn slot(symbol: &Symbol) -> Option<u64> {
    match symbol {
        Symbol::Variable(variable) => match variable.root {
            Root::Global(slot) => Some(slot.into()),
            _ => None,
        },
        _ => None,
    }
}

/// Where a place lies in the state, in bits; of the memory of a block only where it begins at a known slot.
fn address(place: &Place, own: Option<u64>) -> Option<Range<u64>> {
    let slot = match place.root {
        Root::Global(slot) => u64::from(slot),
        Root::Own(slot) => own? + u64::from(slot),
        _ => return None,
    };
    let Range { start, end } = place.extent();
    let first = 64 * slot;
    Some(first + start..first.saturating_add(end))
}
