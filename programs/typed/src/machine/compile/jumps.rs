//! Straightens code: a jump goes to where the jump at its target goes, and instructions that nothing reaches or that jump to the next one are
//! left out.
//!
//! Invariant: what is executed between two instructions that are kept is the same, but for jumps. Jumps cannot fault and charge nothing, and the
//! statement of each kept instruction stays, so neither results nor faults change.

use crate::machine::Tables;
use crate::machine::instruction::{Code, Instruction};

/// Jumps that are followed from one to the next; a loop without a body would have no end.
const FOLLOWED: usize = 8;

/// Straightens code and moves the starts of tasks with it.
pub(super) fn straighten(tables: &mut Tables, tasks: &mut [u32]) {
    follow(&mut tables.code);
    for task in tasks.iter_mut() {
        *task = end_of_jumps(&tables.code, *task);
    }
    let mut is_kept = reached(&tables.code, tasks);
    leave_out_jumps(&tables.code, &mut is_kept);
    // The place of each instruction, or of the next one that is kept.
    let mut places = Vec::with_capacity(tables.code.len() + 1);
    let mut count = 0;
    for &is_kept in &is_kept {
        places.push(count);
        count += u32::from(is_kept);
    }
    places.push(count);
    let mut kept = is_kept.iter();
    tables.code.retain(|_| kept.next() == Some(&true));
    for instruction in tables.code.iter_mut().filter(|it| it.code.has_target()) {
        instruction.c = places[instruction.c as usize];
    }
    for (first, ..) in &mut tables.lines {
        *first = places[*first as usize];
    }
    for task in tasks {
        *task = places[*task as usize];
    }
}

fn follow(code: &mut [Instruction]) {
    for at in 0..code.len() {
        if code[at].code.has_target() {
            let target = end_of_jumps(code, code[at].c);
            code[at].c = target;
            if code[at].code == Code::Jump && code[target as usize].code == Code::Return {
                code[at] = code[target as usize];
            }
        }
    }
}

fn end_of_jumps(code: &[Instruction], mut target: u32) -> u32 {
    for _ in 0..FOLLOWED {
        let next = code[target as usize];
        if next.code != Code::Jump {
            break;
        }
        target = next.c;
    }
    target
}

/// Which instructions can be reached.
fn reached(code: &[Instruction], tasks: &[u32]) -> Vec<bool> {
    let mut is_reached = vec![false; code.len()];
    let mut pending = tasks.to_vec();
    while let Some(start) = pending.pop() {
        let mut at = start as usize;
        while at < code.len() && !std::mem::replace(&mut is_reached[at], true) {
            let instruction = code[at];
            if instruction.code.has_target() {
                pending.push(instruction.c);
            }
            if matches!(instruction.code, Code::Jump | Code::Return) {
                break;
            }
            at += 1;
        }
    }
    is_reached
}

/// Leaves out jumps to the next instruction that is kept.
fn leave_out_jumps(code: &[Instruction], is_kept: &mut [bool]) {
    let mut next = code.len();
    for at in (0..code.len()).rev() {
        if !is_kept[at] {
            continue;
        }
        let goes_on = (at + 1..=next).contains(&(code[at].c as usize));
        if code[at].code == Code::Jump && goes_on {
            is_kept[at] = false;
        } else {
            next = at;
        }
    }
}
