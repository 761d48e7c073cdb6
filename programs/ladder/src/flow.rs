//! What the power did in one scan: where it came, what let it pass, and what was read there.
//!
//! Power that comes to an element leaves it where the element passes it. An element passes or not also where no power comes, as a
//! closed contact behind an open one does; so the three are said apart. What a contact read is what its operand was *in that place* of
//! the scan, which a coil further down may have changed since.

use std::time::Duration;

/// What one element did in one scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ElementFlow {
    /// Power came to it from the left.
    pub enters: bool,
    /// It let power pass, or would have; for a block, its first output.
    pub passes: bool,
    /// Power left it to the right.
    pub leaves: bool,
    /// What it looked at, or holds.
    pub reading: Reading,
}

/// What an element looked at, or holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Reading {
    /// Branches, latches and edge blocks: what they pass says it all.
    Nothing,
    /// The operand of a contact.
    Bit(bool),
    /// CV of a counter; of the counter that a comparison reads.
    Number(u16),
    /// ET of a timer.
    Time(Duration),
}

/// What one rung did in one scan.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub struct RungFlow {
    /// In the order of [`crate::visit`]: what is inside of branches, or feeds a block, before them.
    pub elements: Vec<ElementFlow>,
    /// The power at the coils.
    pub power: bool,
    /// For each coil its target as the coil left it.
    pub coils: Vec<bool>,
}

/// One scan of a program, as a drawing shows it.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub struct Evaluation {
    /// u in this scan, as declared.
    pub inputs: Vec<bool>,
    /// y after this scan, as declared.
    pub outputs: Vec<bool>,
    /// The memory bits after this scan, as declared.
    pub memory: Vec<bool>,
    /// In the order of the scan.
    pub rungs: Vec<RungFlow>,
}

/// The flows of a rung one after the other; an iterator without end that gives nothing where no scan is looked at.
#[derive(Debug, Clone)]
pub(crate) struct Flows<'e>(std::slice::Iter<'e, ElementFlow>);

impl<'e> Flows<'e> {
    pub(crate) fn of(rung: Option<&'e RungFlow>) -> Self {
        Self(rung.map_or(&[][..], |rung| &rung.elements).iter())
    }

    pub(crate) fn next(&mut self) -> Option<&'e ElementFlow> {
        self.0.next()
    }
}
