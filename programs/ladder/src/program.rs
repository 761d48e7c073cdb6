//! What a ladder program is: signals, and rungs of elements and coils, all by name.
//!
//! The tree holds names and no references, so that it can be built by hand, compared and printed. Whether the names mean
//! something is the business of [`crate::check`]. A [`Name`] remembers where it stood in its text; equality ignores that.

mod block;
mod name;

use std::fmt;

pub use block::{Block, BlockKind, Cost, Feed};
pub use name::Name;
use understudy_text::words;
pub use understudy_typed::Comparison as Relation;

/// A whole program.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Program {
    /// Its name.
    pub name: Name,
    /// The comment behind its name.
    pub description: Option<String>,
    /// The comment lines above its name.
    pub comments: Vec<String>,
    /// u, in the order of their declaration.
    pub inputs: Vec<Signal>,
    /// y, in the order of their declaration.
    pub outputs: Vec<Signal>,
    /// Internal bits, in the order of their declaration.
    pub memory: Vec<Signal>,
    /// What a warm start keeps: names of outputs, memory bits and blocks.
    pub retained: Vec<Name>,
    /// In the order of the scan.
    pub rungs: Vec<Rung>,
    /// The comment lines below the last rung.
    pub footer: Vec<String>,
}

/// A declared bit: an input, an output or a memory bit.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Signal {
    /// Unique in the program.
    pub name: Name,
    /// Where it lives in the PLC.
    pub address: Option<Address>,
    /// Its value before the first scan, 0 where not given. Giving it also says that the last scan's value is meant where a
    /// rung reads the signal above the rung that writes it. Inputs have none.
    pub initial: Option<bool>,
    /// The comment behind its declaration.
    pub description: Option<String>,
    /// The comment lines above its declaration.
    pub comments: Vec<String>,
}

impl Signal {
    /// A signal with a name only.
    pub fn new(name: impl Into<Name>) -> Self {
        Self { name: name.into(), ..Self::default() }
    }
}

/// A directly represented variable of IEC 61131-3 of size bit, such as `%IX0.3`.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Address {
    /// Input, output or memory.
    pub area: Area,
    /// The numbers between the dots, one or more.
    pub path: Vec<u32>,
}

impl fmt::Display for Address {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let path: Vec<String> = self.path.iter().map(u32::to_string).collect();
        write!(formatter, "%{}X{}", self.area.letter(), path.join("."))
    }
}

/// The area of an [`Address`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Area {
    /// `%I`.
    Input,
    /// `%Q`.
    Output,
    /// `%M`.
    Memory,
}

impl Area {
    /// `I`, `Q` or `M`.
    pub fn letter(self) -> char {
        match self {
            Self::Input => 'I',
            Self::Output => 'Q',
            Self::Memory => 'M',
        }
    }
}

/// One rung: a network from the left rail to its coils.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Rung {
    /// What it does, in a few words.
    pub title: Option<String>,
    /// Its comment lines.
    pub comments: Vec<String>,
    /// The network between the left rail and the coils; empty is a wire.
    pub network: Series,
    /// The coils, all fed by the same power, written from left to right.
    pub coils: Vec<Coil>,
}

/// Elements one behind the other; power passes when all of them pass it.
pub type Series = Vec<Element>;

/// An element of a rung before its coils.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Element {
    /// A contact.
    Contact(Contact),
    /// A comparison of a counter's value with a number, drawn as a contact.
    Comparison(Comparison),
    /// Parallel branches, two or more; power passes when one of them passes it.
    Branches(Vec<Series>),
    /// A function block in the wire.
    Block(Block),
}

/// A contact on a signal or on an output pin of a block (`pause.Q`).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Contact {
    /// When it passes power.
    pub kind: ContactKind,
    /// The signal, or block and pin with a dot between.
    pub operand: Name,
}

words! {
    /// When a contact passes power.
    pub enum ContactKind by sign {
        /// While its operand is 1.
        NormallyOpen = "",
        /// While its operand is 0.
        NormallyClosed = "/",
        /// In the scan in which its operand has become 1 since the last scan of this contact (`R_TRIG`).
        Rising = "+",
        /// In the scan in which its operand has become 0 since the last scan of this contact (`F_TRIG`).
        Falling = "-",
    }
}

/// `counter.CV` compared with a number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Comparison {
    /// A counter.
    pub counter: Name,
    /// How.
    pub relation: Relation,
    /// With what.
    pub value: u16,
}

/// A coil: what becomes of the rung's power.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Coil {
    /// What it writes.
    pub kind: CoilKind,
    /// An output or a memory bit.
    pub target: Name,
}

words! {
    /// What a coil writes.
    pub enum CoilKind by sign {
        /// The power.
        Plain = "",
        /// The power, negated.
        Negated = "/",
        /// 1 when there is power, else nothing.
        Set = "S",
        /// 0 when there is power, else nothing.
        Reset = "R",
        /// 1 for the scan in which the power has come, else 0.
        Rising = "+",
        /// 1 for the scan in which the power has gone, else 0.
        Falling = "-",
    }
}

impl CoilKind {
    /// True for set and reset coils, which leave the target alone when there is no power.
    pub fn is_latch(self) -> bool {
        matches!(self, Self::Set | Self::Reset)
    }
}

impl Program {
    /// Outputs and memory bits, what coils may write.
    pub fn writable(&self) -> impl Iterator<Item = &Signal> {
        self.memory.iter().chain(&self.outputs)
    }

    /// One more rung behind the last.
    pub fn push_rung(&mut self, network: Series, coils: Vec<Coil>) {
        self.rungs.push(Rung { network, coils, ..Rung::default() });
    }

    /// One more rung behind the last, with what it is for.
    pub fn push_titled(&mut self, title: &str, network: Series, coils: Vec<Coil>) {
        self.rungs.push(Rung { title: Some(title.to_owned()), network, coils, ..Rung::default() });
    }

    /// All blocks, in the order of the scan.
    pub fn blocks(&self) -> Vec<&Block> {
        let mut blocks = Vec::new();
        for rung in &self.rungs {
            visit(&rung.network, &mut |element| {
                if let Element::Block(block) = element {
                    blocks.push(block);
                }
            });
        }
        blocks
    }

    /// The number of contacts, comparisons included.
    pub fn contact_count(&self) -> usize {
        let mut count = 0;
        for rung in &self.rungs {
            visit(&rung.network, &mut |element| {
                count +=
                    usize::from(matches!(element, Element::Contact(_) | Element::Comparison(_)));
            });
        }
        count
    }
}

impl Rung {
    /// What its contacts and comparisons read, in the order of the scan, and what it writes: its blocks, then the targets of its coils.
    pub fn names(&self) -> (Vec<&str>, Vec<&str>) {
        let (mut read, mut written) = (Vec::new(), Vec::new());
        visit(&self.network, &mut |element| match element {
            Element::Contact(contact) => read.push(contact.operand.as_str()),
            Element::Comparison(comparison) => read.push(comparison.counter.as_str()),
            Element::Block(block) => written.push(block.name.as_str()),
            Element::Branches(_) => {}
        });
        written.extend(self.coils.iter().map(|coil| coil.target.as_str()));
        (read, written)
    }
}

/// Calls `see` with every element in the order of the scan: what feeds a block comes before the block.
pub fn visit<'a>(series: &'a Series, see: &mut impl FnMut(&'a Element)) {
    for element in series {
        match element {
            Element::Branches(branches) => {
                for branch in branches {
                    visit(branch, see);
                }
            }
            Element::Block(block) => {
                for feed in &block.pins {
                    visit(&feed.network, see);
                }
            }
            Element::Contact(_) | Element::Comparison(_) => {}
        }
        see(element);
    }
}

/// Whether `is` holds for an element of the series, however deep.
pub(crate) fn visit_any(series: &Series, is: impl Fn(&Element) -> bool) -> bool {
    let mut found = false;
    visit(series, &mut |element| found |= is(element));
    found
}
