//! The models of `tests/data`, with the figures that other tools computed for them.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use understudy_supervisor::{Automaton, read_ads};

/// The models that have plants and specifications, and a supervisor of TCT's.
pub(crate) const MODELS: [&str; 6] = [
    "small_factory",
    "transfer_line",
    "guideway",
    "dining5",
    "line4_3",
    "agv",
];

pub(crate) struct Model {
    pub(crate) folder: PathBuf,
    pub(crate) plants: Vec<Automaton>,
    pub(crate) specifications: Vec<Automaton>,
    pub(crate) expected: Value,
}

impl Model {
    pub(crate) fn read(name: &str) -> Self {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("tests/data")
            .join(name);
        let roles = json(&folder.join("model.json"));
        let of = |role: &str| {
            let names = roles[role].as_array().expect("a list of names");
            names
                .iter()
                .map(|name| ads(&folder, name.as_str().expect("a name")))
                .collect()
        };
        Self {
            plants: of("plants"),
            specifications: of("specs"),
            expected: json(&folder.join("expected.json")),
            folder,
        }
    }

    pub(crate) fn plants(&self) -> Vec<&Automaton> {
        self.plants.iter().collect()
    }

    pub(crate) fn specifications(&self) -> Vec<&Automaton> {
        self.specifications.iter().collect()
    }

    pub(crate) fn file(&self, name: &str) -> Automaton {
        ads(&self.folder, name)
    }

    /// States and transitions that other tools counted; none where they did not.
    pub(crate) fn counts(&self, key: &str) -> Option<(usize, usize)> {
        let pair = self.expected.get(key)?.as_array()?;
        let number = |value: &Value| value.as_u64().expect("a number") as usize;
        Some((number(&pair[0]), number(&pair[1])))
    }
}

pub(crate) fn counts(automaton: &Automaton) -> (usize, usize) {
    (automaton.state_count(), automaton.transition_count())
}

fn ads(folder: &Path, name: &str) -> Automaton {
    let path = folder.join(name).with_extension("ADS");
    let text = fs::read_to_string(&path).expect("a model of the tests");
    let read = read_ads(&text);
    read.automaton
        .unwrap_or_else(|| panic!("{}: {:?}", path.display(), read.diagnostics))
}

fn json(path: &Path) -> Value {
    let text = fs::read_to_string(path).expect("a file of the tests");
    serde_json::from_str(&text).expect("JSON")
}
