//! The reference models in `tests/data`, by name.

use std::fs;
use std::path::PathBuf;

use serde_json::Value;
use understudy_supervisor::{Automaton, read_ads};

fn folder(model: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data")
        .join(model)
}

/// A component or a result of a model.
pub(crate) fn automaton(model: &str, name: &str) -> Automaton {
    let path = folder(model).join(format!("{name}.ADS"));
    let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path:?}: {error}"));
    read_ads(&text)
        .automaton
        .unwrap_or_else(|| panic!("{path:?} is no automaton"))
}

/// `model.json` or `expected.json` of a model.
pub(crate) fn json(model: &str, name: &str) -> Value {
    let path = folder(model).join(name);
    let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path:?}: {error}"));
    serde_json::from_str(&text).expect("JSON")
}

/// The plants of a model.
pub(crate) fn plants(model: &str) -> Vec<Automaton> {
    let names = json(model, "model.json");
    let names = names["plants"].as_array().expect("a list of plants");
    let names = names.iter().map(|name| name.as_str().expect("a name"));
    names.map(|name| automaton(model, name)).collect()
}
