//! What a controller runs.

use std::borrow::Cow;
use std::sync::Arc;

use understudy_bits::{Exact, Inexact, exact};
use understudy_executable::{Executable, Interface};
use understudy_ladder::{LowerError, Program as LadderProgram, circuit};
use understudy_logic::Circuit;
use understudy_typed::Program as TypedProgram;
use understudy_wire::ProgramHash;

use crate::canonical::{circuit_text, typed_text};

/// A program, read.
#[derive(Debug, Clone)]
pub struct Code {
    typed: Arc<TypedProgram>,
    body: Body,
}

/// What a program is written in.
#[derive(Debug, Clone)]
enum Body {
    /// Rungs. They are executed as the circuit for the period of the cluster, and what is proved is proved of it.
    Rungs(Box<Rungs>),
    /// The text of its file, whose lines a program fault names.
    Text(Arc<str>),
}

/// Rungs and their circuit.
#[derive(Debug, Clone)]
struct Rungs {
    ladder: LadderProgram,
    circuit: Circuit,
    /// The registers that a warm start keeps, packed.
    retentive: Vec<u64>,
}

impl Code {
    /// The program of a ladder, for the period of the cluster.
    ///
    /// # Errors
    /// A ladder that is too large for a circuit.
    pub fn of_ladder(typed: Arc<TypedProgram>, ladder: LadderProgram) -> Result<Self, LowerError> {
        let Exact { circuit, layout } = circuit(&typed)?;
        let circuit = circuit.named(ladder.name.as_str());
        let retentive = layout.retentive_mask(&typed);
        let rungs = Rungs { ladder, circuit, retentive };
        Ok(Self { typed, body: Body::Rungs(Box::new(rungs)) })
    }

    /// A program of a text.
    pub fn of_text(typed: Arc<TypedProgram>, text: Arc<str>) -> Self {
        Self { typed, body: Body::Text(text) }
    }

    /// The program.
    pub fn typed(&self) -> &Arc<TypedProgram> {
        &self.typed
    }

    /// Its rungs, of one that is written in rungs.
    pub fn ladder(&self) -> Option<&LadderProgram> {
        match &self.body {
            Body::Rungs(rungs) => Some(&rungs.ladder),
            Body::Text(_) => None,
        }
    }

    /// The circuit that stations execute, of one that is written in rungs.
    pub fn circuit(&self) -> Option<&Circuit> {
        match &self.body {
            Body::Rungs(rungs) => Some(&rungs.circuit),
            Body::Text(_) => None,
        }
    }

    /// The circuit that does in every scan what the program does.
    ///
    /// # Errors
    /// The values of the program that have no bits.
    pub fn exact_circuit(&self) -> Result<Cow<'_, Circuit>, Inexact> {
        match self.circuit() {
            Some(circuit) => Ok(Cow::Borrowed(circuit)),
            None => exact(&self.typed).map(Cow::Owned),
        }
    }

    /// The text of its file, of one that is written in statements, charts and networks.
    pub fn source_text(&self) -> Option<&Arc<str>> {
        match &self.body {
            Body::Rungs(..) => None,
            Body::Text(text) => Some(text),
        }
    }

    /// Its inputs and its outputs.
    pub fn interface(&self) -> Interface {
        self.typed.as_ref().into()
    }

    /// As stations execute it.
    pub fn executable(&self) -> Executable {
        match &self.body {
            Body::Rungs(rungs) => Executable::from(&rungs.circuit).keeping(rungs.retentive.clone()),
            Body::Text(_) => self.typed.as_ref().into(),
        }
    }

    /// The canonical text that its hash is of: equal texts mean equal behaviour, and equal states.
    pub(crate) fn text(&self) -> String {
        match &self.body {
            Body::Rungs(rungs) => circuit_text(&rungs.circuit, &rungs.retentive),
            Body::Text(_) => typed_text(&self.typed),
        }
    }

    /// Of the canonical text; the program's own name is not in it, its role is the cluster's affair.
    pub(crate) fn hash(&self) -> ProgramHash {
        ProgramHash::of(self.text().as_bytes())
    }
}
