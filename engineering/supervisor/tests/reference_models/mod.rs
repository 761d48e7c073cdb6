//! The reference models, by name, with the figures that other tools computed for them. What is not in `tests/data` is an
//! example of the project.
#![allow(dead_code, reason = "each test uses a part of it")]

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use understudy_supervisor::{Automaton, read_ads};

/// The models that have plants and specifications, and a supervisor of TCT's.
pub(crate) const MODELS: [&str; 6] =
    ["small_factory", "transfer_line", "guideway", "dining5", "line4_3", "agv"];

/// Automata of papers, in `examples/avalanche`.
pub(crate) const OF_PAPERS: [&str; 3] = ["TEST", "FIG4", "FIG6"];

pub(crate) struct Model {
    pub(crate) name: String,
    pub(crate) plants: Vec<Automaton>,
    pub(crate) specifications: Vec<Automaton>,
    pub(crate) expected: Value,
}

impl Model {
    pub(crate) fn read(name: &str) -> Self {
        let roles = json(name, "model.json");
        let of = |role: &str| {
            let names = roles[role].as_array().expect("a list of names");
            names
                .iter()
                .map(|component| automaton(name, component.as_str().expect("a name")))
                .collect()
        };
        Self {
            plants: of("plants"),
            specifications: of("specs"),
            expected: json(name, "expected.json"),
            name: name.to_owned(),
        }
    }

    pub(crate) fn plants(&self) -> Vec<&Automaton> {
        self.plants.iter().collect()
    }

    pub(crate) fn specifications(&self) -> Vec<&Automaton> {
        self.specifications.iter().collect()
    }

    /// A component or a result, such as `_SUPER`.
    pub(crate) fn file(&self, name: &str) -> Automaton {
        automaton(&self.name, name)
    }

    /// As [`counts_in`].
    pub(crate) fn counts(&self, key: &str) -> Option<(usize, usize)> {
        counts_in(&self.expected, key)
    }
}

/// States and transitions that other tools counted; none where they did not.
pub(crate) fn counts_in(expected: &Value, key: &str) -> Option<(usize, usize)> {
    let pair = expected.get(key)?.as_array()?;
    let number = |value: &Value| value.as_u64().expect("a number") as usize;
    Some((number(&pair[0]), number(&pair[1])))
}

pub(crate) fn counts(automaton: &Automaton) -> (usize, usize) {
    (automaton.state_count(), automaton.transition_count())
}

/// A component or a result of a model.
pub(crate) fn automaton(model: &str, name: &str) -> Automaton {
    let (path, text) = file(model, &format!("{name}.ADS"));
    let read = read_ads(&text);
    read.automaton.unwrap_or_else(|| panic!("{}: {:?}", path.display(), read.diagnostics))
}

/// `model.json` or `expected.json` of a model.
pub(crate) fn json(model: &str, name: &str) -> Value {
    let (_, text) = file(model, name);
    serde_json::from_str(&text).expect("JSON")
}

/// The text of a file, and where it is.
pub(crate) fn file(model: &str, name: &str) -> (PathBuf, String) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut path = root.join("tests/data").join(model).join(name);
    if !path.exists() {
        let examples = root.join("../../examples");
        path = examples.join(model.replace('_', "-")).join(name);
    }
    let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path:?}: {error}"));
    (path, text)
}
