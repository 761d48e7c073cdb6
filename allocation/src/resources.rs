//! What a program consists of, counted.
//!
//! The paper on the deployment of controllers counts the same from its XML model, under other names: its "Total Contacts" are
//! the [`elements`](Resources::elements), its "Number of inputs" are the [`contacts`](Resources::contacts), its "Number of outputs"
//! the [`coils`](Resources::coils). Here a thing is counted under its own name, and the terminals that have to be wired are apart.

use serde::Serialize;
use understudy_ladder::{BlockKind, CoilKind, ContactKind, Element, Program, visit};

use crate::instructions::instructions;

/// Counts of one program.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Resources {
    /// Distinct inputs: terminals to be wired.
    pub inputs: u64,
    /// Distinct outputs: terminals to be wired.
    pub outputs: u64,
    /// Internal bits that are declared.
    pub memory_bits: u64,
    /// Rungs.
    pub rungs: u64,
    /// Contacts, comparisons of counters included.
    pub contacts: u64,
    /// Of these, the contacts on inputs.
    pub input_contacts: u64,
    /// Coils.
    pub coils: u64,
    /// Function blocks of every kind.
    pub blocks: u64,
    /// Parallel paths beside the first.
    pub branches: u64,
    /// Timers: TON, TOF, TP.
    pub timers: u64,
    /// Counters: CTU, CTD, CTUD.
    pub counters: u64,
    /// Bits that remember: memory bits, and one for each latch block and each edge.
    pub data_bits: u64,
    /// Instructions of its Instruction List.
    pub instructions: u64,
}

impl Resources {
    /// Counts a program.
    pub fn of(program: &Program) -> Self {
        let mut found = Self {
            inputs: program.inputs.len() as u64,
            outputs: program.outputs.len() as u64,
            memory_bits: program.memory.len() as u64,
            rungs: program.rungs.len() as u64,
            data_bits: program.memory.len() as u64,
            instructions: instructions(program).len() as u64,
            ..Self::default()
        };
        for rung in &program.rungs {
            visit(&rung.network, &mut |element| found.count(program, element));
            found.coils += rung.coils.len() as u64;
            let edges = rung.coils.iter().filter(|coil| {
                let kind = coil.kind;
                matches!(kind, CoilKind::Rising | CoilKind::Falling)
            });
            found.data_bits += edges.count() as u64;
        }
        found
    }

    fn count(&mut self, program: &Program, element: &Element) {
        match element {
            Element::Contact(contact) => {
                self.contacts += 1;
                let is_input = program
                    .inputs
                    .iter()
                    .any(|input| input.name == contact.operand);
                self.input_contacts += u64::from(is_input);
                let is_edge = matches!(contact.kind, ContactKind::Rising | ContactKind::Falling);
                self.data_bits += u64::from(is_edge);
            }
            Element::Comparison(_) => self.contacts += 1,
            Element::Branches(branches) => self.branches += branches.len().saturating_sub(1) as u64,
            Element::Block(block) => {
                self.blocks += 1;
                match block.kind {
                    BlockKind::Ton(_) | BlockKind::Tof(_) | BlockKind::Tp(_) => self.timers += 1,
                    BlockKind::Ctu(_) | BlockKind::Ctd(_) | BlockKind::Ctud(_) => {
                        self.counters += 1;
                    }
                    BlockKind::Sr | BlockKind::Rs | BlockKind::RTrig | BlockKind::FTrig => {
                        self.data_bits += 1;
                    }
                }
            }
        }
    }

    /// Contacts, coils and blocks: what is drawn on the rungs.
    pub fn elements(&self) -> u64 {
        self.contacts + self.coils + self.blocks
    }

    /// Inputs and outputs: what has to be wired.
    pub fn points(&self) -> u64 {
        self.inputs + self.outputs
    }

    /// Each count with what it is called, in the order in which a person reads them.
    pub fn rows(&self) -> [(&'static str, u64); 14] {
        [
            ("inputs", self.inputs),
            ("outputs", self.outputs),
            ("rungs", self.rungs),
            ("elements", self.elements()),
            ("contacts", self.contacts),
            ("contacts on inputs", self.input_contacts),
            ("coils", self.coils),
            ("branches", self.branches),
            ("timers", self.timers),
            ("counters", self.counters),
            ("blocks", self.blocks),
            ("memory bits", self.memory_bits),
            ("bits that remember", self.data_bits),
            ("instructions", self.instructions),
        ]
    }
}
