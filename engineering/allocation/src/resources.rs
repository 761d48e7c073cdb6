//! What a program consists of, counted.
//!
//! The paper on the deployment of controllers counts the same from its XML model, under other names: its "Total Contacts" are
//! the [`elements`](Resources::elements), its "Number of inputs" are the [`contacts`](Resources::contacts), its "Number of outputs"
//! the [`coils`](Resources::coils). Here a thing is counted under its own name, and the terminals that have to be wired are apart.

use std::collections::BTreeMap;

use serde::Serialize;
use understudy_ladder::{CoilKind, ContactKind, Cost, Element, Program, Signal, visit};

use crate::instructions::instructions;

/// Counts of one program.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Resources {
    /// Distinct inputs of one bit: terminals to be wired.
    pub inputs: u64,
    /// Distinct outputs of one bit: terminals to be wired.
    pub outputs: u64,
    /// Distinct inputs that are numbers, such as one at `%IW0`: analog channels.
    pub analog_inputs: u64,
    /// Distinct outputs that are numbers: analog channels.
    pub analog_outputs: u64,
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
    /// Additional parallel paths.
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
        let (inputs, analog_inputs) = channels(&program.inputs);
        let (outputs, analog_outputs) = channels(&program.outputs);
        let mut found = Self {
            inputs,
            outputs,
            analog_inputs,
            analog_outputs,
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
                let is_input = program.inputs.iter().any(|input| input.name == contact.operand);
                self.input_contacts += u64::from(is_input);
                let is_edge = matches!(contact.kind, ContactKind::Rising | ContactKind::Falling);
                self.data_bits += u64::from(is_edge);
            }
            Element::Comparison(_) => self.contacts += 1,
            Element::Branches(branches) => self.branches += branches.len().saturating_sub(1) as u64,
            Element::Block(block) => {
                self.blocks += 1;
                let Cost { timers, counters, bits } = block.kind.cost();
                self.timers += timers;
                self.counters += counters;
                self.data_bits += bits;
            }
        }
    }

    /// Contacts, coils and blocks: what is drawn on the rungs.
    pub fn elements(&self) -> u64 {
        self.contacts + self.coils + self.blocks
    }

    /// Number of wired inputs and outputs.
    pub fn points(&self) -> u64 {
        self.inputs + self.outputs + self.analog_inputs + self.analog_outputs
    }

    /// Each count with what it is called, in the order in which a person reads them.
    fn rows(&self) -> [(&'static str, u64); 16] {
        [
            ("inputs", self.inputs),
            ("outputs", self.outputs),
            ("analog inputs", self.analog_inputs),
            ("analog outputs", self.analog_outputs),
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
            ("retentive bits", self.data_bits),
            ("instructions", self.instructions),
        ]
    }

    /// The counts of each program, the same for all; analog channels only where a program has some.
    pub fn table(programs: &[Self]) -> Vec<Vec<(&'static str, u64)>> {
        let has_analog =
            programs.iter().any(|program| program.analog_inputs + program.analog_outputs > 0);
        let rows = programs.iter().map(|program| {
            let mut rows = program.rows().to_vec();
            rows.retain(|(what, _)| has_analog || !what.starts_with("analog"));
            rows
        });
        rows.collect()
    }
}

/// How many of the signals are bits of their own, and of how many numbers the others are the bits: a number `level` stands as
/// `level.0`, `level.1` and so on, without addresses.
fn channels(signals: &[Signal]) -> (u64, u64) {
    let mut numbers: BTreeMap<&str, Vec<u32>> = BTreeMap::new();
    for signal in signals.iter().filter(|signal| signal.address.is_none()) {
        if let Some((name, bit)) = signal.name.rsplit_once('.')
            && let Ok(bit) = bit.parse()
        {
            numbers.entry(name).or_default().push(bit);
        }
    }
    numbers.retain(|_, bits| {
        bits.sort_unstable();
        bits.len() > 1 && bits.iter().copied().eq(0..bits.len() as u32)
    });
    let bits: usize = numbers.values().map(Vec::len).sum();
    ((signals.len() - bits) as u64, numbers.len() as u64)
}
