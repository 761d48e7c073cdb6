//! A ladder as Instruction List of IEC 61131-3: what a controller stores and executes, so that it can be counted.
//!
//! ```text
//! LD  start          rung: [ start | conveyor ] /stop ( conveyor )
//! OR  conveyor
//! ANDN stop
//! ST  conveyor
//! ```
//!
//! Invariant: executing the list from the first instruction to the last is one scan of the program. Every block and every edge is called
//! where the scan passes it, also where no power arrives; so the power to its left is put aside while it is called, in a
//! temporary bit of its own.

use std::fmt;

use understudy_ladder::{
    Block, Coil, CoilKind, Contact, ContactKind, Element, Program, Relation, Series, visit,
};

/// One instruction.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Instruction {
    /// The operator.
    pub operator: Operator,
    /// The operand; empty for [`Operator::Close`].
    pub operand: String,
}

/// Operators, each on the current result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operator {
    /// `LD`
    Load,
    /// `LDN`
    LoadNot,
    /// `AND`
    And,
    /// `ANDN`
    AndNot,
    /// `OR`
    Or,
    /// `ORN`
    OrNot,
    /// `AND(`
    AndOpen,
    /// `OR(`
    OrOpen,
    /// `)`
    Close,
    /// `EQ`, `NE`, `LT`, `LE`, `GT`, `GE`
    Compare(Relation),
    /// `ST`
    Store,
    /// `STN`
    StoreNot,
    /// `S`
    Set,
    /// `R`
    Reset,
    /// `CAL`
    Call,
}

impl Operator {
    /// The spelling of the operator.
    pub fn word(self) -> &'static str {
        match self {
            Self::Load => "LD",
            Self::LoadNot => "LDN",
            Self::And => "AND",
            Self::AndNot => "ANDN",
            Self::Or => "OR",
            Self::OrNot => "ORN",
            Self::AndOpen => "AND(",
            Self::OrOpen => "OR(",
            Self::Close => ")",
            Self::Compare(Relation::Equal) => "EQ",
            Self::Compare(Relation::NotEqual) => "NE",
            Self::Compare(Relation::Less) => "LT",
            Self::Compare(Relation::LessOrEqual) => "LE",
            Self::Compare(Relation::Greater) => "GT",
            Self::Compare(Relation::GreaterOrEqual) => "GE",
            Self::Store => "ST",
            Self::StoreNot => "STN",
            Self::Set => "S",
            Self::Reset => "R",
            Self::Call => "CAL",
        }
    }
}

impl fmt::Display for Instruction {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let line = format!("{:<5} {}", self.operator.word(), self.operand);
        formatter.write_str(line.trim_end())
    }
}

/// The whole program, rung by rung in the order of the scan.
pub fn instructions(program: &Program) -> Vec<Instruction> {
    let mut writer = Writer::default();
    for rung in &program.rungs {
        writer.series(&rung.network, Power::Rail);
        if rung.coils.is_empty() {
            // A block at the end of its rung has an unused output.
            writer.list.pop();
        }
        for (place, coil) in rung.coils.iter().enumerate() {
            writer.coil(coil, place + 1 == rung.coils.len());
        }
    }
    writer.list
}

/// What arrives from the left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Power {
    /// The rail: always power, and nothing is loaded yet.
    Rail,
    /// The current result.
    Result,
}

#[derive(Debug, Default)]
struct Writer {
    list: Vec<Instruction>,
    temporaries: usize,
    edges: usize,
}

impl Writer {
    fn put(&mut self, operator: Operator, operand: impl Into<String>) {
        self.list.push(Instruction { operator, operand: operand.into() });
    }

    fn temporary(&mut self) -> String {
        self.temporaries += 1;
        format!("power_{}", self.temporaries)
    }

    fn edge(&mut self, rising: bool) -> String {
        self.edges += 1;
        let kind = if rising { "rising" } else { "falling" };
        format!("{kind}_{}", self.edges)
    }

    /// Afterwards the current result is the power to the right of the series.
    fn series(&mut self, series: &Series, mut power: Power) {
        if series.is_empty() && power == Power::Rail {
            self.put(Operator::Load, "TRUE");
        }
        for element in series {
            match element {
                Element::Contact(contact) => self.contact(contact, power),
                Element::Comparison(comparison) => {
                    let value = format!("{}.CV", comparison.counter);
                    self.bracketed(power, |writer| {
                        writer.put(Operator::Load, value);
                        let operator = Operator::Compare(comparison.relation);
                        writer.put(operator, comparison.value.to_string());
                    });
                }
                Element::Branches(branches) if branches.iter().any(calls) => {
                    self.branches_that_call(branches, power);
                }
                Element::Branches(branches) => {
                    self.bracketed(power, |writer| writer.branches(branches));
                }
                Element::Block(block) => self.block(block, power),
            }
            power = Power::Result;
        }
    }

    fn bracketed(&mut self, power: Power, write: impl FnOnce(&mut Self)) {
        if power == Power::Rail {
            return write(self);
        }
        self.put(Operator::AndOpen, "");
        write(self);
        self.put(Operator::Close, "");
    }

    fn contact(&mut self, contact: &Contact, power: Power) {
        let operand = contact.operand.as_str();
        match (contact.kind, power) {
            (ContactKind::NormallyOpen, Power::Rail) => self.put(Operator::Load, operand),
            (ContactKind::NormallyOpen, Power::Result) => self.put(Operator::And, operand),
            (ContactKind::NormallyClosed, Power::Rail) => self.put(Operator::LoadNot, operand),
            (ContactKind::NormallyClosed, Power::Result) => self.put(Operator::AndNot, operand),
            (ContactKind::Rising | ContactKind::Falling, _) => {
                let edge = self.edge(contact.kind == ContactKind::Rising);
                let call = format!("{edge}(CLK := {operand})");
                if power == Power::Rail {
                    self.put(Operator::Call, call);
                    self.put(Operator::Load, format!("{edge}.Q"));
                } else {
                    let aside = self.temporary();
                    self.put(Operator::Store, aside.clone());
                    self.put(Operator::Call, call);
                    self.put(Operator::Load, aside);
                    self.put(Operator::And, format!("{edge}.Q"));
                }
            }
        }
    }

    /// Branches from the rail, without calls.
    fn branches(&mut self, branches: &[Series]) {
        for (place, branch) in branches.iter().enumerate() {
            match branch.as_slice() {
                _ if place == 0 => self.series(branch, Power::Rail),
                [Element::Contact(contact)] if contact.kind == ContactKind::NormallyOpen => {
                    self.put(Operator::Or, contact.operand.as_str());
                }
                [Element::Contact(contact)] if contact.kind == ContactKind::NormallyClosed => {
                    self.put(Operator::OrNot, contact.operand.as_str());
                }
                _ => {
                    self.put(Operator::OrOpen, "");
                    self.series(branch, Power::Rail);
                    self.put(Operator::Close, "");
                }
            }
        }
    }

    /// Branches with blocks or edges: one after the other, each from the power that arrives, and their sum put aside.
    fn branches_that_call(&mut self, branches: &[Series], power: Power) {
        let arriving = (power == Power::Result).then(|| self.temporary());
        if let Some(arriving) = &arriving {
            self.put(Operator::Store, arriving.clone());
        }
        let sum = self.temporary();
        for (place, branch) in branches.iter().enumerate() {
            match &arriving {
                Some(arriving) => {
                    if place > 0 {
                        self.put(Operator::Load, arriving.clone());
                    }
                    self.series(branch, Power::Result);
                }
                None => self.series(branch, Power::Rail),
            }
            if place > 0 {
                self.put(Operator::Or, sum.clone());
            }
            if place + 1 < branches.len() {
                self.put(Operator::Store, sum.clone());
            }
        }
    }

    fn block(&mut self, block: &Block, power: Power) {
        let name = block.name.as_str();
        if power == Power::Rail {
            self.put(Operator::Load, "TRUE");
        }
        self.put(Operator::Store, format!("{name}.{}", block.kind.wire_input()));
        for feed in &block.pins {
            self.series(&feed.network, Power::Rail);
            self.put(Operator::Store, format!("{name}.{}", feed.pin));
        }
        self.put(Operator::Call, name);
        let output = block.kind.outputs()[0];
        self.put(Operator::Load, format!("{name}.{output}"));
    }

    /// The current result is the rung's power, and stays so unless this is the last coil.
    fn coil(&mut self, coil: &Coil, is_last: bool) {
        let target = coil.target.as_str();
        match coil.kind {
            CoilKind::Plain => self.put(Operator::Store, target),
            CoilKind::Negated => self.put(Operator::StoreNot, target),
            CoilKind::Set => self.put(Operator::Set, target),
            CoilKind::Reset => self.put(Operator::Reset, target),
            CoilKind::Rising | CoilKind::Falling => {
                let edge = self.edge(coil.kind == CoilKind::Rising);
                // What is stored at the edge's input is the power, and can be loaded from there again.
                self.put(Operator::Store, format!("{edge}.CLK"));
                self.put(Operator::Call, edge.clone());
                self.put(Operator::Load, format!("{edge}.Q"));
                self.put(Operator::Store, target);
                if !is_last {
                    self.put(Operator::Load, format!("{edge}.CLK"));
                }
            }
        }
    }
}

/// Whether a series calls a block or an edge, however deep.
fn calls(series: &Series) -> bool {
    let mut found = false;
    visit(series, &mut |element| {
        found |= match element {
            Element::Block(_) => true,
            Element::Contact(contact) => {
                matches!(contact.kind, ContactKind::Rising | ContactKind::Falling)
            }
            Element::Comparison(_) | Element::Branches(_) => false,
        };
    });
    found
}
