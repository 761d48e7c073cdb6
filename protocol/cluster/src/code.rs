//! What a controller runs, in the form in which it was read.

use std::borrow::Cow;
use std::sync::Arc;

use understudy_bits::{Inexact, exact};
use understudy_executable::{Executable, Interface};
use understudy_ladder::Program as LadderProgram;
use understudy_logic::Circuit;
use understudy_typed::Program as TypedProgram;
use understudy_wire::ProgramHash;

use crate::canonical::{circuit_text, typed_text};

/// A program, read.
#[derive(Debug, Clone)]
pub enum Code {
    /// All Boolean: a ladder and its circuit for the period of the cluster. What is proved is proved of the circuit.
    Ladder(Box<LadderProgram>, Circuit),
    /// With numbers, and the text of its file, whose lines a program fault names.
    Typed(Arc<TypedProgram>, Arc<str>),
}

impl Code {
    /// The ladder, of one that is Boolean.
    pub fn ladder(&self) -> Option<&LadderProgram> {
        match self {
            Self::Ladder(program, _) => Some(program.as_ref()),
            Self::Typed(..) => None,
        }
    }

    /// The circuit, of one that is Boolean.
    pub fn circuit(&self) -> Option<&Circuit> {
        match self {
            Self::Ladder(_, circuit) => Some(circuit),
            Self::Typed(..) => None,
        }
    }

    /// The circuit that does in every scan what the program does.
    ///
    /// # Errors
    /// The values of the program that have no bits.
    pub fn exact_circuit(&self) -> Result<Cow<'_, Circuit>, Inexact> {
        match self {
            Self::Ladder(_, circuit) => Ok(Cow::Borrowed(circuit)),
            Self::Typed(program, _) => exact(program).map(Cow::Owned),
        }
    }

    /// The typed program, of one with numbers.
    pub fn typed(&self) -> Option<&Arc<TypedProgram>> {
        match self {
            Self::Ladder(..) => None,
            Self::Typed(program, _) => Some(program),
        }
    }

    /// The text of its file, of one with numbers.
    pub fn source_text(&self) -> Option<&str> {
        match self {
            Self::Ladder(..) => None,
            Self::Typed(_, text) => Some(text),
        }
    }

    /// Its inputs and its outputs.
    pub fn interface(&self) -> Interface {
        match self {
            Self::Ladder(_, circuit) => circuit.into(),
            Self::Typed(program, _) => program.as_ref().into(),
        }
    }

    /// Bits of its state.
    pub fn state_bits(&self) -> usize {
        match self {
            Self::Ladder(_, circuit) => circuit.registers().len(),
            Self::Typed(program, _) => program.state as usize * 64,
        }
    }

    /// As stations execute it.
    pub fn executable(&self) -> Executable {
        match self {
            Self::Ladder(_, circuit) => circuit.into(),
            Self::Typed(program, _) => program.as_ref().into(),
        }
    }

    /// The canonical text that its hash is of: equal texts mean equal behaviour.
    pub(crate) fn text(&self) -> String {
        match self {
            Self::Ladder(_, circuit) => circuit_text(circuit),
            Self::Typed(program, _) => typed_text(program),
        }
    }

    /// Of the canonical text; the program's own name is not in it, its role is the cluster's affair.
    pub(crate) fn hash(&self) -> ProgramHash {
        ProgramHash::of(self.text().as_bytes())
    }
}
