//! Networks of function blocks.

mod layout;

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
    /// A function, or an instance of a function block.
    Block {
        /// Its type.
        of: String,
        /// The name of the instance.
        instance: Option<String>,
    },
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
        self.add(
            Kind::Value(text.into()),
            Vec::new(),
            vec![Output::default()],
        )
    }

    /// Adds a variable that is assigned; its place.
    pub fn target(
        &mut self,
        text: impl Into<String>,
        from: (usize, usize),
        negated: bool,
    ) -> usize {
        let input = Input {
            name: String::new(),
            negated,
            from: Some(from),
        };
        self.add(Kind::Target(text.into()), vec![input], Vec::new())
    }

    /// Adds a part; its place.
    pub fn add(&mut self, kind: Kind, inputs: Vec<Input>, outputs: Vec<Output>) -> usize {
        self.objects.push(Object {
            kind,
            inputs,
            outputs,
            executed: None,
            source: None,
        });
        self.objects.len() - 1
    }
}
