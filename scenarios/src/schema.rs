//! The JSON schema of a scenario file, for editors.

use schemars::Schema;
use understudy_journal::{SOURCES, source_word};

use crate::read::{MAXIMUM_CYCLES, MAXIMUM_NUMBER};
use crate::scenario::ACTIONS;

/// JSON Schema 2020-12 of the data of a scenario file. Whether names and cycles fit together is beyond a schema; [`crate::read`]
/// checks it.
pub fn scenario_schema() -> Schema {
    let count = || serde_json::json!({ "type": "integer", "minimum": 0 });
    let share = || serde_json::json!({ "type": "number", "minimum": 0, "maximum": 1 });
    let time =
        || serde_json::json!({ "type": "string", "pattern": "^[0-9]+(\\.[0-9]*)?(s|ms|us|ns)$" });
    let small = |least: u16| serde_json::json!({ "type": "integer", "minimum": least, "maximum": MAXIMUM_NUMBER });
    let name = serde_json::json!({ "type": "string" });
    let source = serde_json::json!({ "enum": SOURCES.map(source_word) });
    schemars::json_schema!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Scenario file of Understudy",
        "type": "object",
        "additionalProperties": false,
        "required": ["title", "cycles"],
        "properties": {
            "title": { "type": "string" },
            "cycles": { "type": "integer", "minimum": 1, "maximum": MAXIMUM_CYCLES },
            "seed": count(),
            "step": { "type": "array", "items": {
                "type": "object",
                "additionalProperties": false,
                "required": ["at", "action", "station"],
                "properties": {
                    "at": count(),
                    "phase": share(),
                    "action": { "enum": ACTIONS },
                    "station": name.clone(),
                    "to": { "anyOf": [name.clone(), { "type": "array", "items": name }] },
                    "both_ways": { "type": "boolean" },
                    "by": time(),
                    "frames": small(1),
                    "age": small(1),
                    "program": { "type": "string" },
                    "bit": small(0),
                    "epoch": count(),
                },
            } },
            "network": {
                "type": "object",
                "additionalProperties": false,
                "properties": {
                    "loss": share(),
                    "duplicate": share(),
                    "corruption": share(),
                    "latency": time(),
                    "jitter": time(),
                    "from": count(),
                    "to": count(),
                },
            },
            "expect": {
                "type": "object",
                "additionalProperties": false,
                "properties": {
                    "wrong": count(),
                    "held": count(),
                    "fail_safe": count(),
                    "plant_faults": count(),
                    "protected": { "type": "boolean" },
                    "functional": { "type": "array", "items": { "type": "string" } },
                    "finished": { "type": "object", "additionalProperties": count() },
                    "during": { "type": "array", "items": {
                        "type": "object",
                        "additionalProperties": false,
                        "required": ["from", "to", "remote_io", "source"],
                        "properties": {
                            "from": count(),
                            "to": count(),
                            "remote_io": { "type": "string" },
                            "source": { "anyOf": [source.clone(), { "type": "array", "items": source }] },
                        },
                    } },
                },
            },
        },
    })
}
