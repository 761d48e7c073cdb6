//! The keystone: a synchronous sequential circuit with named inputs, registers and outputs,
//!
//! ```text
//! x(t+1) = f(x(t), u(t))    (1) (4)
//! y(t)   = h(x(t), u(t))    (2) (5)
//! ```
//!
//! Both right sides read the *old* state x(t). Invariant: every register has a next-state function, every variable that
//! occurs is declared, and names are unique among the inputs, among the registers and among the outputs; [`CircuitBuilder`]
//! is the only way to make one.

use std::collections::HashSet;

use crate::expression::{Expression, Graph, Variable};

/// A state bit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Register {
    /// Unique among the registers.
    pub name: String,
    /// x(0).
    pub initial: bool,
    /// f: its value at t+1.
    pub next: Expression,
}

/// An output bit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Output {
    /// Unique among the outputs.
    pub name: String,
    /// h: its value at t.
    pub value: Expression,
}

/// x(t+1) = f(x(t), u(t)), y(t) = h(x(t), u(t)).
#[derive(Debug, Clone)]
pub struct Circuit {
    name: String,
    graph: Graph,
    inputs: Vec<String>,
    registers: Vec<Register>,
    outputs: Vec<Output>,
}

impl Circuit {
    /// The program's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The same under another name.
    #[must_use]
    pub fn named(self, name: &str) -> Self {
        Self { name: name.to_owned(), ..self }
    }

    /// The owner of all its expressions.
    pub fn graph(&self) -> &Graph {
        &self.graph
    }

    /// Names of u, in order; `Variable::Input(k)` is the k-th.
    pub fn inputs(&self) -> &[String] {
        &self.inputs
    }

    /// x, in order; `Variable::Register(k)` is the k-th.
    pub fn registers(&self) -> &[Register] {
        &self.registers
    }

    /// y, in order.
    pub fn outputs(&self) -> &[Output] {
        &self.outputs
    }

    /// The name of an input or a register of this circuit.
    pub fn variable_name(&self, variable: Variable) -> &str {
        match variable {
            Variable::Input(index) => &self.inputs[index as usize],
            Variable::Register(index) => &self.registers[index as usize].name,
        }
    }

    /// Every root: the next-state functions, then the outputs.
    pub fn roots(&self) -> Vec<Expression> {
        let next = self.registers.iter().map(|register| register.next);
        let values = self.outputs.iter().map(|output| output.value);
        next.chain(values).collect()
    }
}

/// Refers to a register while its circuit is being built.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RegisterId(u32);

/// Why a circuit could not be built.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CircuitError {
    /// Two inputs, two registers or two outputs share a name.
    #[error("the {kind} `{name}` of `{circuit}` is declared twice")]
    Duplicate {
        /// The circuit.
        circuit: String,
        /// "input", "register" or "output".
        kind: &'static str,
        /// The name that occurs twice.
        name: String,
    },
    /// A register has no next-state function.
    #[error("the register `{name}` of `{circuit}` has no next-state function")]
    NoNext {
        /// The circuit.
        circuit: String,
        /// The register.
        name: String,
    },
}

/// Makes a [`Circuit`].
#[derive(Debug, Clone, Default)]
pub struct CircuitBuilder {
    name: String,
    graph: Graph,
    inputs: Vec<String>,
    registers: Vec<(String, bool, Option<Expression>)>,
    outputs: Vec<Output>,
}

impl CircuitBuilder {
    /// A circuit without inputs, registers and outputs.
    pub fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), ..Self::default() }
    }

    /// The inputs and registers of a circuit, in the places that they have there, for a circuit that differs little from it.
    pub fn like(circuit: &Circuit) -> Self {
        let mut builder = Self::new(circuit.name());
        for input in &circuit.inputs {
            builder.input(input);
        }
        for register in &circuit.registers {
            builder.register(&register.name, register.initial);
        }
        builder
    }

    /// Copies the functions of the circuit that this one is [`Self::like`], with each variable replaced by what `place` gives for it: f of its registers is
    /// set; answers with h of its outputs.
    pub fn copy_functions(
        &mut self,
        circuit: &Circuit,
        place: impl FnMut(&mut Graph, Variable) -> Expression,
    ) -> Vec<Expression> {
        let mut copies = self.graph.import(&circuit.graph, &circuit.roots(), place);
        let values = copies.split_off(circuit.registers.len());
        for (register, next) in self.registers.iter_mut().zip(copies) {
            register.2 = Some(next);
        }
        values
    }

    /// Where its expressions are made.
    pub fn graph(&mut self) -> &mut Graph {
        &mut self.graph
    }

    /// Declares the next input and answers with its value.
    pub fn input(&mut self, name: impl Into<String>) -> Expression {
        let index = u32::try_from(self.inputs.len()).expect("fewer than 2^32 inputs");
        self.inputs.push(name.into());
        self.graph.variable(Variable::Input(index))
    }

    /// Declares the next register and answers with its old value, x(t).
    pub fn register(&mut self, name: impl Into<String>, initial: bool) -> (RegisterId, Expression) {
        let index = u32::try_from(self.registers.len()).expect("fewer than 2^32 registers");
        self.registers.push((name.into(), initial, None));
        (RegisterId(index), self.graph.variable(Variable::Register(index)))
    }

    /// Sets f of a register; the last call counts.
    pub fn set_next(&mut self, register: RegisterId, next: Expression) {
        self.registers[register.0 as usize].2 = Some(next);
    }

    /// Declares the next output.
    pub fn output(&mut self, name: impl Into<String>, value: Expression) {
        self.outputs.push(Output { name: name.into(), value });
    }

    /// Checks the invariant.
    pub fn finish(self) -> Result<Circuit, CircuitError> {
        let circuit = self.name.clone();
        let duplicate = |kind, names: Vec<&String>| {
            let mut seen = HashSet::new();
            let twice = names.into_iter().find(|name| !seen.insert(*name));
            twice.map_or(Ok(()), |name| {
                Err(CircuitError::Duplicate { circuit: circuit.clone(), kind, name: name.clone() })
            })
        };
        duplicate("input", self.inputs.iter().collect())?;
        duplicate("register", self.registers.iter().map(|register| &register.0).collect())?;
        duplicate("output", self.outputs.iter().map(|output| &output.name).collect())?;
        let registers = self
            .registers
            .into_iter()
            .map(|(name, initial, next)| match next {
                Some(next) => Ok(Register { name, initial, next }),
                None => Err(CircuitError::NoNext { circuit: circuit.clone(), name }),
            })
            .collect::<Result<_, _>>()?;
        Ok(Circuit {
            name: self.name,
            graph: self.graph,
            inputs: self.inputs,
            registers,
            outputs: self.outputs,
        })
    }
}
