//! The statement of a program in which a value is met, and the variable that it is of.

use understudy_typed::{Elementary, Place, Program, Root, Statement, StatementKind, Uses, bodies};

use crate::exact::Gap;

/// Values without bits, each with the variable that takes it and a statement: that which computes the value, else the first one that names the
/// variable. Each variable is told once, in the order of the statements.
pub(crate) fn told(gaps: Vec<Gap>, program: &Program) -> Vec<Gap> {
    let mut told: Vec<Gap> = Vec::new();
    for mut gap in gaps {
        match &gap.at {
            Some((routine, line)) => {
                let assigned = assigned(program, routine, *line).filter(|part| part.1 == gap.of);
                gap.what = assigned.map_or(gap.what, |(name, _)| name);
            }
            None => gap.at = first_naming(program, &gap.what),
        }
        if told.iter().all(|known| known.what != gap.what) {
            told.push(gap);
        }
    }
    told.sort_by_key(|gap| gap.at.as_ref().map_or(u32::MAX, |(_, line)| *line));
    told
}

/// The variable that the only assignment in a line of a routine writes, with its type.
fn assigned(program: &Program, routine: &str, line: u32) -> Option<(String, Elementary)> {
    let mut routines = program.routines.iter();
    let found = routines.find(|found| found.name == routine)?;
    let mut places = Vec::new();
    each(&found.body, &mut |statement| match &statement.kind {
        StatementKind::Assign(place, _) if statement.line == line => places.push(place),
        _ => {}
    });
    let [place] = places.as_slice() else {
        return None;
    };
    let part = program.part_at(address(place)?)?;
    Some((part.name, place.of.elementary()?))
}

/// The first statement that names a variable: its routine and its line.
fn first_naming(program: &Program, variable: &str) -> Option<(String, u32)> {
    let at = program.part(variable)?.address;
    program.routines.iter().find_map(|routine| {
        let mut first = None;
        each(&routine.body, &mut |statement| {
            if first.is_none() && statement.line > 0 && names(statement, at) {
                first = Some(statement.line);
            }
        });
        Some((routine.name.clone(), first?))
    })
}

/// Whether a statement names the variable at an address, by itself and not by the statements within it.
fn names(statement: &Statement, at: u64) -> bool {
    let count = |statements: &[Statement]| {
        let Uses { reads, writes } = Uses::of(statements);
        reads.into_iter().chain(writes).filter(|place| address(place) == Some(at)).count()
    };
    let within: usize = bodies(statement).into_iter().map(count).sum();
    count(std::slice::from_ref(statement)) > within
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

/// The address of a place of the state without computed indices.
fn address(place: &Place) -> Option<u64> {
    match place.root {
        Root::Global(slot) if place.indices.is_empty() => {
            Some(64 * (u64::from(slot) + u64::from(place.offset)) + u64::from(place.bit))
        }
        _ => None,
    }
}
