//! Where an output was assigned that is not a finite number: the fault itself belongs to no statement.

use understudy_typed::{Cause, Fault, Place, Program, Root, Statement, StatementKind, Task};

/// Lines that are named.
const MOST: usize = 5;

/// `, assigned in line 41`; empty for other faults.
pub(super) fn assigned_text(program: &Program, fault: &Fault) -> String {
    let Cause::OutputNotFinite { output, .. } = fault.cause else {
        return String::new();
    };
    let Some(point) = program.outputs.iter().nth(output as usize) else {
        return String::new();
    };
    let mut lines = Vec::new();
    for task in &program.tasks {
        let body = &program.routine(task.routine).body;
        collect(body, task, point.slot, &mut lines);
    }
    lines.sort_unstable();
    lines.dedup();
    lines.truncate(MOST);
    match lines.as_slice() {
        [] => String::new(),
        [line] => format!(", assigned in line {line}"),
        lines => {
            let lines: Vec<String> = lines.iter().map(u32::to_string).collect();
            format!(", assigned in the lines {}", lines.join(", "))
        }
    }
}

/// The lines of the statements that assign the variable in a slot of the state.
fn collect(statements: &[Statement], task: &Task, slot: u32, lines: &mut Vec<u32>) {
    for statement in statements {
        match &statement.kind {
            StatementKind::Assign(place, _) if is_at(place, task, slot) => {
                lines.push(statement.line);
            }
            StatementKind::If(branches, otherwise) => {
                for branch in branches {
                    collect(&branch.body, task, slot, lines);
                }
                collect(otherwise, task, slot, lines);
            }
            StatementKind::Case(_, cases, otherwise) => {
                for case in cases {
                    collect(&case.body, task, slot, lines);
                }
                collect(otherwise, task, slot, lines);
            }
            StatementKind::For(turns) => collect(&turns.body, task, slot, lines),
            StatementKind::While(_, body) | StatementKind::Repeat(body, _) => {
                collect(body, task, slot, lines);
            }
            _ => {}
        }
    }
}

fn is_at(place: &Place, task: &Task, slot: u32) -> bool {
    let first = match place.root {
        Root::Global(first) => Some(first),
        Root::Own(first) => Some(task.own + first),
        _ => None,
    };
    place.indices.is_empty() && first.map(|first| first + place.offset) == Some(slot)
}
