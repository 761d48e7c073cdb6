//! The JSON schemas of models, nets and maps of signals, for editors. Whether names mean something is beyond a schema.

use schemars::Schema;
use understudy_text::tables::format::Table;

use crate::format::{MAP, MODEL, NET_FILE};

fn schema(format: &Table, title: &str) -> Schema {
    // An object is a schema.
    Schema::try_from(format.schema(title)).unwrap_or_default()
}

/// JSON Schema 2020-12 of a model.
pub fn model_schema() -> Schema {
    schema(&MODEL, "Model of plants and specifications of Understudy")
}

/// JSON Schema 2020-12 of an automation Petri net.
pub fn net_schema() -> Schema {
    schema(&NET_FILE, "Automation Petri net of Understudy")
}

/// JSON Schema 2020-12 of a map of signals.
pub fn map_schema() -> Schema {
    schema(&MAP, "Map of signals of Understudy")
}
