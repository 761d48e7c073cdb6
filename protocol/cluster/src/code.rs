//! What a controller runs.

use std::borrow::Cow;
use std::sync::Arc;

use understudy_bits::{Exact, Inexact, Layout, exact};
use understudy_executable::{Executable, Interface};
use understudy_ladder::{LowerError, Program as LadderProgram, circuit};
use understudy_logic::Circuit;
use understudy_typed::{CarriedPath, CarriedState, Fate, Program as TypedProgram, Told};
use understudy_wire::ProgramHash;

use crate::canonical::{circuit_text, typed_text};
use crate::source_text::SourceText;

/// A program, read.
#[derive(Debug, Clone)]
pub struct Code {
    typed: Arc<TypedProgram>,
    source: Arc<SourceText>,
    body: Body,
}

/// What a program is written in.
#[derive(Debug, Clone)]
enum Body {
    /// Rungs. They are executed as the circuit for the period of the cluster, and what is proved is proved of it.
    Rungs(Box<Rungs>),
    /// Statements, charts and networks. A program fault names lines of the text.
    Text,
}

/// Rungs and their circuit.
#[derive(Debug, Clone)]
struct Rungs {
    ladder: LadderProgram,
    circuit: Circuit,
    /// What its registers are in the state of the program.
    layout: Layout,
    /// The registers that a warm start keeps, packed.
    retentive: Vec<u64>,
}

impl Code {
    /// The program of a ladder, for the period of the cluster.
    ///
    /// # Errors
    /// A ladder that is too large for a circuit.
    pub fn of_ladder(
        typed: Arc<TypedProgram>,
        ladder: LadderProgram,
        source: Arc<SourceText>,
    ) -> Result<Self, LowerError> {
        let Exact { circuit, layout } = circuit(&typed)?;
        let circuit = circuit.named(ladder.name.as_str());
        let retentive = layout.retentive_mask(&typed);
        let rungs = Rungs { ladder, circuit, layout, retentive };
        Ok(Self { typed, source, body: Body::Rungs(Box::new(rungs)) })
    }

    /// A program of a text.
    pub fn of_text(typed: Arc<TypedProgram>, source: Arc<SourceText>) -> Self {
        Self { typed, source, body: Body::Text }
    }

    /// The file that it was read from.
    pub fn source(&self) -> &SourceText {
        &self.source
    }

    /// The program.
    pub fn typed(&self) -> &Arc<TypedProgram> {
        &self.typed
    }

    /// Its rungs, of one that is written in rungs.
    pub fn ladder(&self) -> Option<&LadderProgram> {
        match &self.body {
            Body::Rungs(rungs) => Some(&rungs.ladder),
            Body::Text => None,
        }
    }

    /// The circuit that stations execute, of one that is written in rungs.
    pub fn circuit(&self) -> Option<&Circuit> {
        match &self.body {
            Body::Rungs(rungs) => Some(&rungs.circuit),
            Body::Text => None,
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
            Body::Text => Some(&self.source.text),
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
            Body::Text => self.typed.as_ref().into(),
        }
    }

    /// The state with which it starts warm from a state of the program before it, both as stations hold them, and what has become of each retentive path.
    ///
    /// # Panics
    /// If `state` is shorter than a state of `before`.
    pub fn carried(&self, before: &Self, state: &[u64]) -> CarriedState {
        self.with_values_of(before, state, |state, told| {
            self.typed.carried(&before.typed, state, told)
        })
    }

    /// The state with which it goes on from a state of the program before it, in an online change; as [`Self::carried`], of all variables.
    ///
    /// # Panics
    /// If `state` is shorter than a state of `before`.
    pub(crate) fn changed(
        &self,
        before: &Self,
        state: &[u64],
        take: impl FnOnce(&[u64], Told<'_>) -> CarriedState,
    ) -> CarriedState {
        self.with_values_of(before, state, take)
    }

    fn with_values_of(
        &self,
        before: &Self,
        state: &[u64],
        take: impl FnOnce(&[u64], Told<'_>) -> CarriedState,
    ) -> CarriedState {
        let (old, new) = (before.layout(), self.layout());
        let held =
            |layout: Option<&Layout>, address| layout.is_none_or(|layout| layout.holds(address));
        let told = Told {
            is_known: &|address| held(old, address),
            is_read: &|address| held(new, address),
        };
        let mut carried = take(&before.typed_state(state), told);
        if let Some(layout) = new {
            let executable = self.executable();
            let registers = layout.registers(&self.typed, &carried.state, executable.initial());
            carried.paths.retain(|path| !registers.lost.contains(&path.path));
            carried.paths.extend(registers.lost.iter().map(|path| self.without_registers(path)));
            carried.state = registers.packed;
        }
        carried
    }

    /// Why the states of this program cannot be those of a changed one; nothing where they can.
    pub(crate) fn why_not_changed(&self) -> Option<&'static str> {
        if self.ladder().is_some() {
            return Some("is written in rungs");
        }
        // Parts of a chart have names that stay where other parts change.
        let stays = |name: &str| {
            let parts = ["begun.", "timer.", "stored.", "fires."];
            !name.contains('.') || parts.iter().any(|part| name.starts_with(part))
        };
        let has_names = self.typed.variables.iter().all(|variable| stays(&variable.name));
        let is_named = has_names && self.typed.has_names_for_all();
        (!is_named).then_some("has memory without a name, such as that of an edge of an input")
    }

    /// A state of the program in the order of its variables, for one as stations hold it.
    ///
    /// # Panics
    /// If `state` is shorter than a state of the program.
    pub fn typed_state<'s>(&self, state: &'s [u64]) -> Cow<'s, [u64]> {
        match self.layout() {
            Some(layout) => Cow::Owned(layout.state(state)),
            None => Cow::Borrowed(state),
        }
    }

    fn layout(&self) -> Option<&Layout> {
        match &self.body {
            Body::Rungs(rungs) => Some(&rungs.layout),
            Body::Text => None,
        }
    }

    /// The entry of a path whose value the circuit cannot hold.
    fn without_registers(&self, path: &str) -> CarriedPath {
        let part = self.typed.part(path);
        let of = part.map(|part| self.typed.type_name(&part.of));
        CarriedPath { path: path.to_owned(), fate: Fate::Dropped, before: of.clone(), now: of }
    }

    /// The canonical text that its hash is of: equal texts mean equal behaviour, and equal states.
    pub(crate) fn text(&self) -> String {
        match &self.body {
            Body::Rungs(rungs) => circuit_text(&rungs.circuit, &rungs.retentive),
            Body::Text => typed_text(&self.typed),
        }
    }

    /// Of the canonical text; the program's own name is not in it, its role is the cluster's affair.
    pub(crate) fn hash(&self) -> ProgramHash {
        ProgramHash::of(self.text().as_bytes())
    }
}
