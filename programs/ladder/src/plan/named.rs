//! The names of all that a plan reads and writes, in one language, and what is said above its assignments.

use understudy_logic::{Circuit, Variable};

use super::{Plan, Target};
use crate::names::Namer;

/// Names by place.
pub(crate) struct Named {
    pub(crate) inputs: Vec<String>,
    pub(crate) outputs: Vec<String>,
    pub(crate) registers: Vec<String>,
    pub(crate) shared: Vec<String>,
    /// Of the held new value of a register; blank where it is not held.
    next: Vec<String>,
    /// Registers whose new value is held, in the order of the plan.
    held: Vec<usize>,
}

impl Named {
    /// Names for `circuit`; `suffix` follows a register's name in that of its held new value.
    pub(crate) fn new(circuit: &Circuit, plan: &Plan<'_>, namer: &mut Namer, suffix: &str) -> Self {
        let mut name = |wanted: &str| namer.name(wanted);
        let inputs = circuit.inputs().iter().map(|input| name(input)).collect();
        let outputs = circuit.outputs().iter();
        let outputs = outputs.map(|output| name(&output.name)).collect();
        let registers = circuit.registers().iter();
        let registers: Vec<String> = registers.map(|register| name(&register.name)).collect();
        let shared = 0..plan.shared_count;
        let shared = shared.map(|k| name(&format!("shared_{}", k + 1))).collect();
        let mut next = vec![String::new(); registers.len()];
        let mut held = Vec::new();
        for assignment in &plan.assignments {
            if let Target::Next(index) = assignment.target {
                next[index] = name(&format!("{}{suffix}", registers[index]));
                held.push(index);
            }
        }
        Self { inputs, outputs, registers, shared, next, held }
    }

    /// What an assignment writes.
    pub(crate) fn target(&self, target: Target) -> &str {
        match target {
            Target::Shared(k) => &self.shared[k],
            Target::Output(k) => &self.outputs[k],
            Target::Register(k) | Target::Takeover(k) => &self.registers[k],
            Target::Next(k) => &self.next[k],
        }
    }

    pub(crate) fn variable(&self, variable: Variable) -> &str {
        match variable {
            Variable::Input(index) => &self.inputs[index as usize],
            Variable::Register(index) => &self.registers[index as usize],
        }
    }

    /// The held new value of a register.
    pub(crate) fn next(&self, register: usize) -> &str {
        &self.next[register]
    }

    /// The names of all held new values.
    pub(crate) fn held(&self) -> impl Iterator<Item = &str> {
        self.held.iter().map(|&register| self.next(register))
    }
}

impl Target {
    /// What is said above the first of the assignments of this kind.
    pub(crate) fn heading(self) -> &'static str {
        match self {
            Self::Shared(_) => "expressions that are used more than once, or long",
            Self::Output(_) => "outputs",
            Self::Register(_) => "the new state; the old values of these are not read again",
            Self::Next(_) => "the new state, held until all of it is known",
            Self::Takeover(_) => "the new state is stored",
        }
    }
}
