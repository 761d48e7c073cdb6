//! The inputs and outputs of a drafted program, whatever it was written in.

use std::collections::HashMap;

use understudy_executable::declared;
use understudy_interchange::Source;
use understudy_typed::{Declared, Elementary, Point, Points, Variable};

use super::comment;

/// What a program reads and drives.
#[derive(Debug, Clone, Default)]
pub(super) struct Signals {
    pub(super) inputs: Vec<Signal>,
    pub(super) outputs: Vec<Signal>,
}

/// An input or an output.
#[derive(Debug, Clone)]
pub(super) struct Signal {
    pub(super) name: String,
    pub(super) declared: Declared,
    /// What the program says about it: its address and its comment.
    pub(super) note: Option<String>,
}

impl Signals {
    pub(super) fn of(source: &Source) -> Self {
        match source {
            Source::Program(program) => {
                let variables = program.variables.iter().rev();
                let variables: HashMap<&str, &Variable> =
                    variables.map(|variable| (variable.name.as_str(), variable)).collect();
                let of_all = |points: &Points| {
                    let signal = |point: &Point| {
                        let variable = variables.get(point.name.as_str()).copied();
                        Signal::point(&point.name, point.declared(), variable)
                    };
                    declared(points).map(signal).collect()
                };
                Self { inputs: of_all(&program.inputs), outputs: of_all(&program.outputs) }
            }
            Source::Library(_) => Self::default(),
        }
    }

    /// Whether all are BOOL.
    pub(super) fn are_bits(&self) -> bool {
        self.inputs.iter().chain(&self.outputs).all(Signal::is_bit)
    }
}

impl Signal {
    fn point(name: &str, declared: Declared, variable: Option<&Variable>) -> Self {
        let (address, description) = variable.map_or((None, None), |variable| {
            (variable.address.as_deref(), variable.description.as_deref())
        });
        Self { name: name.to_owned(), declared, note: note(address, description) }
    }

    /// The value that is nearest to a whole number.
    pub(super) fn nearest(&self, wanted: i128) -> i128 {
        self.declared.nearest(wanted)
    }

    pub(super) fn is_bit(&self) -> bool {
        self.declared.of == Elementary::Bool
    }
}

fn note(address: Option<&str>, description: Option<&str>) -> Option<String> {
    let parts: Vec<&str> = address.into_iter().chain(description).collect();
    let text = comment(&parts.join(" "));
    (!text.is_empty()).then_some(text)
}
