//! The tokens of a place in a ladder: token passing logic, section 2.3.
//!
//! A safe place is a flag. Another one is an up and down counter where each transition moves one token and it begins empty
//! or full, which is all that the standard's counter can be loaded with; its value is up to date at the end of a scan. Where
//! more tokens move at once it is a row of flags, the k-th of which is 1 while there are at least k tokens.

use understudy_ladder::{Block, BlockKind, Coil, Comparison, Element, Feed, Name, Relation, Rung};

use super::net::{NetTransition, Place};
use crate::ladder::rung::{closed, open, reset, rung, set};

/// Representation of the tokens of a place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Tokens {
    Flags(Vec<Name>),
    Counter {
        counter: Name,
        bound: u16,
        /// A token comes; a token goes; one of both in the last scan, whose edge has to pass before the next.
        comes: Name,
        goes: Name,
        busy: Name,
        /// Loads the counter in the first scan.
        first: Option<Name>,
    },
}

fn compare(counter: &Name, relation: Relation, count: u32) -> Element {
    Element::Comparison(Comparison {
        counter: counter.clone(),
        relation,
        value: u16::try_from(count).unwrap_or(u16::MAX),
    })
}

impl Tokens {
    /// Whether a counter can represent `place`.
    pub(super) fn can_count(
        index: usize,
        place: &Place,
        bound: u32,
        transitions: &[NetTransition],
    ) -> bool {
        bound > 1
            && bound <= u32::from(understudy_ladder::MAXIMUM_PRESET_VALUE)
            && (place.initial == 0 || place.initial == bound)
            && transitions
                .iter()
                .all(|transition| transition.given(index).abs_diff(transition.taken(index)) <= 1)
    }

    /// Passes power while there are at least `count` tokens.
    pub(super) fn at_least(&self, count: u32) -> Vec<Element> {
        if count == 0 {
            return Vec::new();
        }
        match self {
            Self::Flags(flags) => match flags.get(count as usize - 1) {
                Some(flag) => vec![open(flag)],
                // More than there can ever be.
                None => self.never(),
            },
            Self::Counter { counter, .. } => {
                vec![compare(counter, Relation::GreaterOrEqual, count)]
            }
        }
    }

    /// Passes power while there are fewer than `count` tokens, of which there is at least one.
    pub(super) fn fewer(&self, count: u32) -> Vec<Element> {
        match self {
            Self::Flags(flags) => {
                let flag = flags.get((count as usize).saturating_sub(1));
                flag.map(closed).into_iter().collect()
            }
            Self::Counter { counter, .. } => vec![compare(counter, Relation::Less, count)],
        }
    }

    /// Passes power never.
    pub(super) fn never(&self) -> Vec<Element> {
        match self {
            Self::Flags(flags) => vec![open(&flags[0]), closed(&flags[0])],
            Self::Counter { counter, .. } => vec![compare(counter, Relation::Less, 0)],
        }
    }

    /// What a transition that moves tokens of this place waits for besides.
    pub(super) fn ready(&self) -> Vec<Element> {
        match self {
            Self::Flags(_) => Vec::new(),
            Self::Counter { comes, goes, busy, first, .. } => {
                [comes, goes, busy].into_iter().chain(first).map(closed).collect()
            }
        }
    }

    /// The coils on the rung of a transition that adds `change` tokens, for a flag and for a counter.
    pub(super) fn coils(&self, change: i64) -> Vec<Coil> {
        match self {
            _ if change == 0 => Vec::new(),
            Self::Flags(flags) if flags.len() == 1 => {
                vec![if change > 0 { set(&flags[0]) } else { reset(&flags[0]) }]
            }
            Self::Flags(_) => Vec::new(),
            Self::Counter { comes, goes, .. } => vec![set(if change > 0 { comes } else { goes })],
        }
    }

    /// The rungs below that of the transition, for a row of flags: `fires` is 1 while it fires.
    pub(super) fn shift(&self, name: &str, change: i64, fires: &Name) -> Vec<Rung> {
        let Self::Flags(flags) = self else {
            return Vec::new();
        };
        let width = change.unsigned_abs() as usize;
        if flags.len() == 1 || width == 0 {
            return Vec::new();
        }
        let mut order: Vec<usize> = (1..=flags.len()).collect();
        if change > 0 {
            order.reverse();
        }
        let rungs = order.into_iter().map(|count| {
            let flag = &flags[count - 1];
            let mut network = vec![open(fires)];
            if change > 0 {
                network.extend(self.at_least(count.saturating_sub(width) as u32));
                rung(format!("{name}: add {width}, {count} or more"), network, vec![set(flag)])
            } else {
                network.extend(self.fewer((count + width) as u32));
                rung(format!("{name}: remove {width}, below {count}"), network, vec![reset(flag)])
            }
        });
        rungs.collect()
    }

    /// The counter itself, at the end of the scan.
    pub(super) fn count(&self, name: &str) -> Option<Rung> {
        let Self::Counter { counter, bound, comes, goes, first, .. } = self else {
            return None;
        };
        let feed =
            |pin: &str, signal: &Name| Feed { pin: Name::from(pin), network: vec![open(signal)] };
        let mut pins = vec![feed("CD", goes)];
        pins.extend(first.iter().map(|first| feed("LD", first)));
        let block =
            Element::Block(Block { name: counter.clone(), kind: BlockKind::Ctud(*bound), pins });
        Some(rung(format!("tokens of {name}"), vec![open(comes), block], Vec::new()))
    }
}
