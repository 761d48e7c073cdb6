//! Inputs that do not come from the field.

use understudy_remote_io::{OperatorInput, OperatorInputKind, SignalInput};
use understudy_typed::Declared;

/// Input of a program with a source of its own.
#[derive(Debug, Clone)]
pub struct InputSource {
    /// Name of the input.
    pub name: String,
    /// Source.
    pub kind: InputSourceKind,
}

/// Source of an input.
#[derive(Debug, Clone)]
pub enum InputSourceKind {
    /// Operators write it.
    Operator(OperatorDeclaration),
    /// It is an output of another program.
    Signal(SignalDeclaration),
}

/// Input that operators write.
#[derive(Debug, Clone)]
pub struct OperatorDeclaration {
    /// Place, behaviour and rights.
    pub input: OperatorInput,
    /// How the program declares it.
    pub declared: Declared,
    /// Text on the page; the name of the input where absent.
    pub title: Option<String>,
    /// Unit of a setpoint.
    pub unit: Option<String>,
    /// Whether the page asks before it writes.
    pub confirm: bool,
    /// The output of another group that the gateway writes; nothing for an input that people write.
    pub group: Option<GroupSignal>,
}

/// An output of a program of another group.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GroupSignal {
    /// Name of the cluster.
    pub group: String,
    /// Name of the controller.
    pub controller: String,
    /// Name of the output.
    pub output: String,
}

impl OperatorDeclaration {
    /// Lowest and highest stored value of a setpoint.
    pub fn limits(&self) -> Option<(u64, u64)> {
        match self.input.kind {
            OperatorInputKind::Setpoint { low, high } => Some((low, high)),
            OperatorInputKind::Level
            | OperatorInputKind::Pulse(_)
            | OperatorInputKind::Group { .. } => None,
        }
    }
}

/// Input that is an output of another program.
#[derive(Debug, Clone)]
pub struct SignalDeclaration {
    /// Place and source.
    pub input: SignalInput,
    /// Name of the output in its program.
    pub output: String,
}

impl InputSource {
    /// The declaration of an input that operators write.
    pub fn operator(&self) -> Option<&OperatorDeclaration> {
        match &self.kind {
            InputSourceKind::Operator(declaration) => Some(declaration),
            InputSourceKind::Signal(_) => None,
        }
    }

    /// The declaration of a signal of another program.
    pub fn signal(&self) -> Option<&SignalDeclaration> {
        match &self.kind {
            InputSourceKind::Operator(_) => None,
            InputSourceKind::Signal(declaration) => Some(declaration),
        }
    }
}
