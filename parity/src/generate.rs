//! From N circuits to the one that knows every role:
//!
//! ```text
//! x(N+1)(t+1) = [f(1), f(2), .., f(N)]              (7)
//! y(N+1)(t)   = h(1) + h(2) + .. + h(N)             (8) (9)
//! ```
//!
//! Invariant: the inputs and the registers of the summands stand one after another, in the order of the summands, each named
//! `program.signal`; so x(N+1) is the concatenation of the summands' states, bit by bit. p(N+1) = max p(i); an output that a
//! summand does not have counts as 0.

use std::borrow::Borrow;
use std::collections::HashSet;
use std::ops::Range;

use understudy_logic::{Circuit, CircuitBuilder, CircuitError, Expression, Variable};

/// Name of the generated circuit.
const NAME: &str = "understudy";

/// Where a summand's signals stand among those of the parity controller.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Summand {
    /// The program's name.
    pub name: String,
    /// u(i) in u(N+1), in bits.
    pub inputs: Range<usize>,
    /// x(i) in x(N+1), in bits.
    pub registers: Range<usize>,
    /// p(i), in bits; its outputs are added to the first p(i) parity outputs.
    pub outputs: usize,
}

/// The generated controller N+1.
#[derive(Debug, Clone)]
pub struct ParityController {
    circuit: Circuit,
    summands: Vec<Summand>,
}

impl ParityController {
    /// (7), (8).
    pub fn circuit(&self) -> &Circuit {
        &self.circuit
    }

    /// The circuit alone.
    pub fn into_circuit(self) -> Circuit {
        self.circuit
    }

    /// Where each summand stands, in order.
    pub fn summands(&self) -> &[Summand] {
        &self.summands
    }
}

/// Why there is no parity controller.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ParityError {
    /// A sum of nothing guards nothing.
    #[error("U0401: a parity controller needs at least one program, and there is none")]
    NoPrograms,
    /// Two programs share a name, so `program.signal` would not tell them apart.
    #[error(
        "U0402: the programs {first} and {second} are both named `{name}`; give each program its own name"
    )]
    SameName {
        /// 1-based place of the first.
        first: usize,
        /// 1-based place of the second.
        second: usize,
        /// What both are named.
        name: String,
    },
    /// Names that contain a dot coincide once they are joined.
    #[error("U0403: signals of different programs get the same name: {0}")]
    Names(#[from] CircuitError),
}

impl ParityError {
    /// Stable code for people.
    pub fn code(&self) -> &'static str {
        match self {
            Self::NoPrograms => "U0401",
            Self::SameName { .. } => "U0402",
            Self::Names(_) => "U0403",
        }
    }
}

/// Generates the parity controller (7)-(9) of `summands`, with the outputs `parity_1`, `parity_2`, ...
///
/// Linear in the operations of the summands. It has as many registers as all summands together, and keeps their initial
/// values.
///
/// # Errors
/// No summands, or names that do not tell the summands' signals apart.
pub fn generate<C: Borrow<Circuit>>(summands: &[C]) -> Result<ParityController, ParityError> {
    if summands.is_empty() {
        return Err(ParityError::NoPrograms);
    }
    distinct(summands.iter().map(|summand| summand.borrow().name()))?;
    let mut builder = CircuitBuilder::new(NAME);
    let mut places = Vec::with_capacity(summands.len());
    let mut parities: Vec<Option<Expression>> = Vec::new();
    let (mut input_count, mut register_count) = (0, 0);
    for summand in summands {
        let summand: &Circuit = summand.borrow();
        let qualified = |signal: &str| format!("{}.{signal}", summand.name());
        let inputs: Vec<Expression> =
            summand.inputs().iter().map(|input| builder.input(qualified(input))).collect();
        let registers: Vec<_> = summand
            .registers()
            .iter()
            .map(|register| builder.register(qualified(&register.name), register.initial))
            .collect();
        let copies =
            builder.graph().import(
                summand.graph(),
                &summand.roots(),
                |_, variable| match variable {
                    Variable::Input(index) => inputs[index as usize],
                    Variable::Register(index) => registers[index as usize].1,
                },
            );
        let (next, outputs) = copies.split_at(registers.len());
        for (&(register, _), &next) in registers.iter().zip(next) {
            builder.set_next(register, next);
        }
        parities.resize(parities.len().max(outputs.len()), None);
        for (parity, &output) in parities.iter_mut().zip(outputs) {
            *parity = Some(match *parity {
                None => output,
                Some(sum) => builder.graph().xor(sum, output),
            });
        }
        places.push(Summand {
            name: summand.name().to_owned(),
            inputs: input_count..input_count + inputs.len(),
            registers: register_count..register_count + registers.len(),
            outputs: outputs.len(),
        });
        input_count += inputs.len();
        register_count += registers.len();
    }
    for (index, parity) in parities.into_iter().flatten().enumerate() {
        builder.output(format!("parity_{}", index + 1), parity);
    }
    Ok(ParityController { circuit: builder.finish()?, summands: places })
}

fn distinct<'a>(names: impl Iterator<Item = &'a str>) -> Result<(), ParityError> {
    let names: Vec<&str> = names.collect();
    let mut seen = HashSet::new();
    let Some(second) = names.iter().position(|name| !seen.insert(*name)) else {
        return Ok(());
    };
    let name = names[second];
    let first = names.iter().position(|other| *other == name);
    Err(ParityError::SameName {
        first: first.unwrap_or(second) + 1,
        second: second + 1,
        name: name.to_owned(),
    })
}
