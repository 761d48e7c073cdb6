//! Networks of function blocks.

mod contacts;
mod layout;

pub(crate) use contacts::BARS;
pub use contacts::{BRANCH, CONTACT_HEAD, CONTACT_ROW, Contacts};
pub(crate) use layout::COIL;
pub use layout::{BlockPlan, Placed, Wire, lay_out};

/// What is connected, and perhaps one scan of it.
///
/// Invariants, which the layout relies on: an object is connected only to objects before it, an output to at most one input, and an object to
/// at most one block; targets come on top.
#[derive(Debug, Clone, Default)]
pub struct Network {
    /// Lines above it.
    pub comments: Vec<String>,
    /// Its parts, each behind those that feed it.
    pub objects: Vec<Object>,
}

/// A part of a network.
#[derive(Debug, Clone)]
pub struct Object {
    /// What it is.
    pub kind: Kind,
    /// The inputs, from top to bottom.
    pub inputs: Vec<Input>,
    /// The outputs, from top to bottom.
    pub outputs: Vec<Output>,
    /// Whether the scan executed it; nothing where no scan is shown.
    pub executed: Option<bool>,
    /// Where its statement begins in the text; nothing where another statement stands there.
    pub source: Option<usize>,
}

/// What a part of a network is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Kind {
    /// An expression that is read, such as a variable. It has one output.
    Value(String),
    /// A variable that is assigned. It has one input.
    Target(String),
    /// A variable that a ladder assigns. It has one input.
    Coil(String, Coil),
    /// Contacts of a ladder. They have one output.
    Contacts(Contacts),
    /// A function, or an instance of a function block.
    Block {
        /// Its type.
        of: String,
        /// The name of the instance.
        instance: Option<String>,
    },
}

/// What a coil does with the power.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coil {
    /// Its variable is what the power is.
    Plain,
    /// Its variable is the opposite.
    Negated,
    /// The power makes its variable TRUE.
    Set,
    /// The power makes its variable FALSE.
    Reset,
}

impl Kind {
    /// The variable that is assigned.
    pub fn target(&self) -> Option<&str> {
        match self {
            Self::Target(name) | Self::Coil(name, _) => Some(name),
            _ => None,
        }
    }
}

/// An input of a part.
#[derive(Debug, Clone, Default)]
pub struct Input {
    /// Its name; empty for that of a target.
    pub name: String,
    /// Whether it takes the opposite.
    pub negated: bool,
    /// Object and output that it is connected to.
    pub from: Option<(usize, usize)>,
}

/// An output of a part.
#[derive(Debug, Clone, Default)]
pub struct Output {
    /// Its name; empty for that of a value.
    pub name: String,
    /// Its value in the scan.
    pub value: Option<String>,
}

impl Network {
    /// Adds an expression that is read; its place.
    pub fn value(&mut self, text: impl Into<String>) -> usize {
        self.add(Kind::Value(text.into()), Vec::new(), vec![Output::default()])
    }

    /// Adds a variable that is assigned; its place.
    pub fn target(&mut self, text: impl Into<String>, from: (usize, usize)) -> usize {
        self.assigned(Kind::Target(text.into()), from)
    }

    /// Adds a coil; its place.
    pub fn coil(&mut self, text: impl Into<String>, kind: Coil, from: (usize, usize)) -> usize {
        self.assigned(Kind::Coil(text.into(), kind), from)
    }

    fn assigned(&mut self, kind: Kind, from: (usize, usize)) -> usize {
        let input = Input { from: Some(from), ..Input::default() };
        self.add(kind, vec![input], Vec::new())
    }

    /// Adds a part; its place.
    pub fn add(&mut self, kind: Kind, inputs: Vec<Input>, outputs: Vec<Output>) -> usize {
        self.objects.push(Object { kind, inputs, outputs, executed: None, source: None });
        self.objects.len() - 1
    }
}
