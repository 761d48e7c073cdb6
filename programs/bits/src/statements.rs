//! The statement of a program in which a value is met, and the variable that it is of.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use understudy_typed::{Elementary, Place, Program, Root, Statement, StatementKind, Uses, bodies};

use crate::exact::Gap;

/// Values without bits, each with the variable that takes it and a statement: that which computes the value, else the first one that names the
/// variable. Each variable is told once, in the order of the statements.
pub(crate) fn told(gaps: Vec<Gap>, program: &Program) -> Vec<Gap> {
    let instances = Instances::of(program);
    let mut told: Vec<Gap> = Vec::new();
    for mut gap in gaps {
        match &gap.at {
            Some((routine, line)) => {
                let assigned = instances.assigned(routine, *line).filter(|part| part.1 == gap.of);
                gap.what = assigned.map_or(gap.what, |(name, _)| name);
            }
            None => gap.at = instances.first_naming(&gap.what),
        }
        if told.iter().all(|known| known.what != gap.what) {
            told.push(gap);
        }
    }
    told.sort_by_key(|gap| gap.at.as_ref().map_or(u32::MAX, |(_, line)| *line));
    told
}

/// The instances on which the routines of a program run.
struct Instances<'p> {
    program: &'p Program,
    /// The first slot of each routine's only instance; nothing for one with several.
    slots: HashMap<u32, Option<u32>>,
}

impl<'p> Instances<'p> {
    fn of(program: &'p Program) -> Self {
        let mut slots: HashMap<u32, Option<u32>> = HashMap::new();
        let mut open: Vec<(u32, u32)> =
            program.tasks.iter().map(|task| (task.routine.0, task.own)).collect();
        while let Some((routine, own)) = open.pop() {
            match slots.entry(routine) {
                Entry::Occupied(mut known) => {
                    if *known.get() != Some(own) {
                        known.insert(None);
                    }
                    continue;
                }
                Entry::Vacant(free) => {
                    free.insert(Some(own));
                }
            }
            let body = program.routines.get(routine as usize).map_or(&[][..], |it| &it.body);
            each(body, &mut |statement| {
                if let StatementKind::Invoke(called, place) = &statement.kind
                    && let Some(slot) = slot(place, Some(own))
                {
                    open.push((called.0, slot));
                }
            });
        }
        Self { program, slots }
    }

    /// The address of a place in a routine.
    fn address(&self, routine: usize, place: &Place) -> Option<u64> {
        let own = self.slots.get(&u32::try_from(routine).ok()?).copied().flatten();
        Some(64 * u64::from(slot(place, own)?) + u64::from(place.bit))
    }

    /// The variable that the only assignment in a line of a routine writes, with its type.
    fn assigned(&self, routine: &str, line: u32) -> Option<(String, Elementary)> {
        let found = self.program.routines.iter().position(|found| found.name == routine)?;
        let mut places = Vec::new();
        each(&self.program.routines[found].body, &mut |statement| match &statement.kind {
            StatementKind::Assign(place, _) if statement.line == line => places.push(place),
            _ => {}
        });
        let [place] = places.as_slice() else {
            return None;
        };
        let part = self.program.part_at(self.address(found, place)?)?;
        Some((part.name, place.of.elementary()?))
    }

    /// The first statement that names a variable: its routine and its line.
    fn first_naming(&self, variable: &str) -> Option<(String, u32)> {
        let at = self.program.part(variable)?.address;
        self.program.routines.iter().enumerate().find_map(|(place, routine)| {
            let mut first = None;
            each(&routine.body, &mut |statement| {
                if first.is_none() && statement.line > 0 && self.names(place, statement, at) {
                    first = Some(statement.line);
                }
            });
            Some((routine.name.clone(), first?))
        })
    }

    /// Whether a statement names the variable at an address, by itself and not by the statements within it.
    fn names(&self, routine: usize, statement: &Statement, at: u64) -> bool {
        let count = |statements: &[Statement]| {
            let Uses { reads, writes } = Uses::of(statements);
            let mut places = reads.into_iter().chain(writes);
            places.by_ref().filter(|place| self.address(routine, place) == Some(at)).count()
        };
        let within: usize = bodies(statement).into_iter().map(count).sum();
        count(std::slice::from_ref(statement)) > within
    }
}

/// Shows every statement, outer ones first.
fn each<'a>(statements: &'a [Statement], show: &mut dyn FnMut(&'a Statement)) {
    for statement in statements {
        show(statement);
        for body in bodies(statement) {
            each(body, show);
        }
    }
}

/// The slot of a place without computed indices, in a routine on the instance at slot `own`.
fn slot(place: &Place, own: Option<u32>) -> Option<u32> {
    let root = match place.root {
        Root::Global(slot) => slot,
        Root::Own(slot) => own? + slot,
        _ => return None,
    };
    place.indices.is_empty().then_some(root + place.offset)
}
