//! Timers in a proof end at any time, so that their scans need not be counted.
//!
//! A rung that is nothing but a contact and an on-delay timer becomes an input that is 1 only while that contact's signal was
//! 1 and stays 1 until it is 0. Every run of the real timer is one of these, whatever its preset.

use std::borrow::Cow;

use understudy_ladder::{ContactKind, Element, Name, Program, Rung, Signal};

/// A timer that was replaced: the name of its output, now an input, and what it runs by.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct FreeTimer {
    pub(super) input: Name,
    pub(super) runs_while: Name,
}

/// `program` with its timers as inputs; the program itself where it has none.
pub(super) fn free_timers(program: &Program) -> (Cow<'_, Program>, Vec<FreeTimer>) {
    let timers: Vec<FreeTimer> = program.rungs.iter().filter_map(free).collect();
    if timers.is_empty() {
        return (Cow::Borrowed(program), timers);
    }
    let mut freed = program.clone();
    freed.rungs.retain(|rung| free(rung).is_none());
    let inputs = timers.iter().map(|timer| Signal::new(timer.input.clone()));
    freed.inputs.extend(inputs);
    (Cow::Owned(freed), timers)
}

fn free(rung: &Rung) -> Option<FreeTimer> {
    let [Element::Contact(contact), Element::Block(block)] = rung.network.as_slice() else {
        return None;
    };
    let is_timer = block.kind.preset_time().is_some()
        && block.kind.needs_power()
        && contact.kind == ContactKind::NormallyOpen
        && rung.coils.is_empty();
    is_timer.then(|| FreeTimer {
        input: Name::from(format!("{}.Q", block.name)),
        runs_while: contact.operand.clone(),
    })
}
