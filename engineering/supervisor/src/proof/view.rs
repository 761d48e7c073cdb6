//! The ladder as a proof sees it: which bits of its circuit are states, positions of switches, and pulses.

use std::collections::{HashMap, HashSet};

use understudy_ladder::{Name, Program, Signal};
use understudy_logic::Circuit;

use super::reference::Allowed;
use super::verdict::ProofError;
use crate::ladder::{Correspondence, InputOutputMap};
use crate::{Label, State};

/// What a register or an output bit is.
#[derive(Debug, Clone, Copy)]
pub(super) enum Bit {
    Other,
    State {
        automaton: usize,
        state: State,
    },
    Switch {
        switch: usize,
        position: u8,
    },
    Pulse(usize),
    /// An event waits for its turn.
    Waiting(Label),
}

/// Which bits of the circuit say what.
pub(super) struct View {
    pub(super) registers: Vec<Bit>,
    pub(super) outputs: Vec<Bit>,
    /// States whose bit is never written.
    pub(super) constant: Vec<(usize, State)>,
    pub(super) register_of: HashMap<String, usize>,
}

impl View {
    pub(super) fn new(
        circuit: &Circuit,
        program: &Program,
        map: &InputOutputMap,
        correspondence: &Correspondence,
    ) -> Result<Self, ProofError> {
        let registers = circuit.registers().iter().map(|register| register.name.clone());
        let register_of: HashMap<String, usize> = registers.zip(0..).collect();
        let outputs = circuit.outputs().iter().map(|output| output.name.as_str());
        let output_of: HashMap<&str, usize> = outputs.zip(0..).collect();
        let coils = program.rungs.iter().flat_map(|rung| &rung.coils);
        let written: HashSet<&str> = coils.map(|coil| coil.target.as_str()).collect();
        let memory = program.memory.iter();
        let memory: HashMap<&str, &Signal> =
            memory.map(|signal| (signal.name.as_str(), signal)).collect();
        let mut view = Self {
            registers: vec![Bit::Other; circuit.registers().len()],
            outputs: vec![Bit::Other; circuit.outputs().len()],
            constant: Vec::new(),
            register_of: HashMap::new(),
        };
        for (automaton, bits) in correspondence.states.iter().enumerate() {
            for (number, name) in (0..).zip(bits) {
                let state = State::new(number);
                match (register_of.get(name.as_str()), memory.get(name.as_str())) {
                    (Some(&place), _) => view.registers[place] = Bit::State { automaton, state },
                    (None, Some(signal)) if !written.contains(name.as_str()) => {
                        if signal.initial == Some(true) {
                            view.constant.push((automaton, state));
                        }
                    }
                    _ => return Err(no_bit(name)),
                }
            }
        }
        for (switch, content) in map.switches.iter().enumerate() {
            for (position, entry) in (1..).zip(&content.positions) {
                let bit = Bit::Switch { switch, position };
                view.place(&entry.signal, bit, &register_of, &output_of, &written)?;
            }
        }
        for (pulse, entry) in map.pulses.iter().enumerate() {
            let bit = Bit::Pulse(pulse);
            view.place(&entry.signal, bit, &register_of, &output_of, &written)?;
        }
        for (&label, name) in &correspondence.waiting {
            let place = register_of.get(name.as_str()).ok_or_else(|| no_bit(name))?;
            view.registers[*place] = Bit::Waiting(label);
        }
        view.register_of = register_of;
        Ok(view)
    }

    fn place(
        &mut self,
        signal: &Name,
        bit: Bit,
        register_of: &HashMap<String, usize>,
        output_of: &HashMap<&str, usize>,
        written: &HashSet<&str>,
    ) -> Result<(), ProofError> {
        if let Some(&place) = output_of.get(signal.as_str()) {
            self.outputs[place] = bit;
        } else if let Some(&place) = register_of.get(signal.as_str()) {
            self.registers[place] = bit;
        } else if written.contains(signal.as_str()) {
            return Err(no_bit(signal));
        }
        Ok(())
    }
}

fn no_bit(name: &Name) -> ProofError {
    ProofError::NoBit { name: name.to_string() }
}

/// What is to be seen after a scan.
pub(super) struct Seen {
    /// The states of each automaton that are on.
    pub(super) states: Vec<Vec<State>>,
    /// The positions of each switch that are on.
    pub(super) positions: Vec<Vec<u8>>,
    pub(super) pulses: Vec<usize>,
    /// Events that wait for their turn, ascending.
    pub(super) waiting: Vec<Label>,
}

impl Seen {
    /// Whether it is what is allowed.
    pub(super) fn is(&self, allowed: &Allowed) -> bool {
        let states = match &allowed.state {
            Some(states) => {
                let mut pairs = self.states.iter().zip(states);
                pairs.all(|(on, state)| on.as_slice() == [*state])
            }
            None => self.states.iter().all(Vec::is_empty),
        };
        let mut positions = self.positions.iter().zip(&allowed.positions);
        states
            && self.waiting == allowed.waiting
            && positions.all(|(on, &position)| match position {
                0 => on.is_empty(),
                _ => on.as_slice() == [position],
            })
            && match allowed.pulse {
                Some(pulse) => self.pulses == [pulse],
                None => self.pulses.is_empty(),
            }
    }
}
