//! What has to be known of a whole program before its steps can be made, gathered by making them again until nothing new is found.

use std::collections::{BTreeMap, BTreeSet};

use understudy_typed::Elementary;

/// What is known of a program. It only grows, so gathering ends.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Facts {
    /// Addresses that the program writes; what it never writes keeps its initial value.
    pub(super) written: BTreeSet<u64>,
    /// What of the frames is a cell.
    pub(super) frames: BTreeMap<u64, Elementary>,
    /// Instances of standard blocks, by their addresses.
    pub(super) blocks: BTreeMap<u64, BlockFacts>,
}

/// How an instance of a standard block is used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct BlockFacts {
    /// Such as `TON`.
    pub(super) word: &'static str,
    /// The address of each of its variables, by name.
    pub(super) parts: BTreeMap<&'static str, u64>,
    /// Where it is called, at most two of them.
    pub(super) calls: u8,
    /// A call stands under a condition.
    pub(super) is_conditional: bool,
    /// A ladder's block does not do what is asked, so the statements of the standard are executed.
    pub(super) is_expanded: bool,
    /// Inputs that some call gives.
    pub(super) given: BTreeSet<&'static str>,
    /// Inputs that are read, or written outside of calls, or not given in every call: bits of their own.
    pub(super) held: BTreeSet<&'static str>,
}

impl BlockFacts {
    /// Every execution calls it once.
    pub(super) fn is_exclusive(&self) -> bool {
        self.calls == 1 && !self.is_conditional
    }

    /// Whether it is TON, TOF or TP.
    pub(super) fn is_timer(&self) -> bool {
        matches!(self.word, "TON" | "TOF" | "TP")
    }

    /// Whether it becomes a block of the ladder.
    pub(super) fn is_native(&self) -> bool {
        self.is_timer() || self.is_exclusive() && !self.is_expanded
    }
}

/// The standard blocks of the ladder.
pub(super) const STANDARD: [&str; 10] =
    ["TON", "TOF", "TP", "CTU", "CTD", "CTUD", "SR", "RS", "R_TRIG", "F_TRIG"];

/// Boolean inputs of a standard block, the wire's first.
pub(super) fn inputs(word: &str) -> &'static [&'static str] {
    match word {
        "CTU" => &["CU", "R"],
        "CTD" => &["CD", "LD"],
        "CTUD" => &["CU", "CD", "R", "LD"],
        "SR" => &["S1", "R"],
        "RS" => &["S", "R1"],
        "R_TRIG" | "F_TRIG" => &["CLK"],
        _ => &["IN"],
    }
}

/// Its preset, where it has one.
pub(super) fn preset(word: &str) -> Option<&'static str> {
    match word {
        "TON" | "TOF" | "TP" => Some("PT"),
        "CTU" | "CTD" | "CTUD" => Some("PV"),
        _ => None,
    }
}

/// Boolean outputs of a standard block.
pub(super) fn outputs(word: &str) -> &'static [&'static str] {
    match word {
        "CTUD" => &["QU", "QD"],
        "SR" | "RS" => &["Q1"],
        _ => &["Q"],
    }
}

impl BlockFacts {
    /// The same block before anything is known of its calls.
    pub(super) fn uncalled(&self) -> Self {
        Self {
            word: self.word,
            parts: self.parts.clone(),
            calls: 0,
            is_conditional: false,
            is_expanded: false,
            given: BTreeSet::new(),
            held: BTreeSet::new(),
        }
    }

    fn join(&mut self, other: Self) {
        self.calls = self.calls.max(other.calls);
        self.is_conditional |= other.is_conditional;
        self.is_expanded |= other.is_expanded;
        self.given.extend(other.given);
        self.held.extend(other.held);
    }
}

impl Facts {
    /// All that either knows.
    pub(super) fn joined(&self, other: Self) -> Self {
        let mut joined = self.clone();
        joined.written.extend(other.written);
        joined.frames.extend(other.frames);
        for (address, found) in other.blocks {
            match joined.blocks.get_mut(&address) {
                Some(known) => known.join(found),
                None => {
                    joined.blocks.insert(address, found);
                }
            }
        }
        joined
    }
}
