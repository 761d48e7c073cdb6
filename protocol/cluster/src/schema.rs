//! The JSON schema of a cluster file, for editors and other programs; made from the same tables as the reader.

use schemars::Schema;
use serde_json::{Map, Value, json};
use understudy_text::duration;

use crate::address::MAXIMUM_NAME_LENGTH;
use crate::format::{
    CLUSTER, CONTROLLER, FIELD, Key, Kind, OPERATOR_INPUT, PLANT_FILE_REQUIRED,
    PLANT_FILE_SECTIONS, POINT, PRESS_PARAMETERS, ROBOT_PARAMETERS, SECTIONS, SIGNAL, SIGNAL_INPUT,
    SIGNALS, Section, TWIN,
};
use crate::place::{ByteOrder, Registers};

/// JSON Schema 2020-12 of the data of a `cluster.toml`.
///
/// Bounds of times, and that names, addresses and signals fit together, are beyond a schema; [`crate::read`] checks them.
pub fn schema() -> Schema {
    let cards = json!({
        "type": "object",
        "description": SIGNAL.meaning,
        "additionalProperties": table(&SIGNAL),
    });
    let sections = SECTIONS.map(|section| {
        let table = table(section);
        let value = if section.repeated {
            let least = usize::from(section.name == CONTROLLER.name);
            json!({ "type": "array", "items": table, "minItems": least })
        } else {
            table
        };
        (section.name.to_owned(), value)
    });
    schemars::json_schema!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Cluster file of Understudy",
        "type": "object",
        "additionalProperties": false,
        "required": [CLUSTER.name, CONTROLLER.name],
        "properties": Value::Object(sections.into_iter().chain([(SIGNALS.to_owned(), cards)]).collect()),
    })
}

/// JSON Schema 2020-12 of the data of a plant file.
pub fn plant_file_schema() -> Schema {
    let sections = PLANT_FILE_SECTIONS.map(|section| {
        let value = json!({ "type": "array", "items": table(section), "minItems": 1 });
        (section.name.to_owned(), value)
    });
    schemars::json_schema!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Plant file of Understudy",
        "type": "object",
        "additionalProperties": false,
        "required": PLANT_FILE_REQUIRED.map(|section| section.name),
        "properties": Value::Object(sections.into_iter().collect()),
    })
}

fn table(section: &Section) -> Value {
    let properties: Map<String, Value> =
        section.keys.iter().map(|key| (key.name.to_owned(), property(key))).collect();
    let required: Vec<&str> =
        section.keys.iter().filter(|key| key.required).map(|key| key.name).collect();
    json!({
        "type": "object",
        "description": section.meaning,
        "additionalProperties": false,
        "required": required,
        "properties": properties,
    })
}

/// A place of a signal in its short form.
fn place_pattern() -> String {
    let (types, orders) = (Registers::TYPE_WORDS.join("|"), ByteOrder::WORDS.join("|"));
    format!(
        "^((discrete|coil):[0-9]{{1,5}}|(input|holding):[0-9]{{1,5}}(\\.[0-9]{{1,2}}| ({types})( ({orders}))?))$"
    )
}

fn property(key: &Key) -> Value {
    let mut property = match &key.kind {
        Kind::Name => json!({
            "type": "string",
            "pattern": "^[A-Za-z][A-Za-z0-9_-]*$",
            "maxLength": MAXIMUM_NAME_LENGTH,
        }),
        Kind::Text | Kind::Address | Kind::Connection => json!({ "type": "string" }),
        Kind::Count { least, most, default } => {
            json!({ "type": "integer", "minimum": least, "maximum": most, "default": default })
        }
        Kind::Digits { most } => json!({ "type": "integer", "minimum": 0, "maximum": most }),
        Kind::Time { .. } => {
            json!({ "type": "string", "pattern": duration::pattern() })
        }
        Kind::Word { words, .. } => json!({ "enum": words }),
        Kind::Values => {
            json!({ "type": "object", "additionalProperties": { "type": ["boolean", "number", "string"] } })
        }
        Kind::Device => table(&FIELD),
        Kind::Twin => table(&TWIN),
        Kind::Points => json!({
            "type": "object",
            "additionalProperties": {
                "anyOf": [{ "type": "string", "pattern": place_pattern() }, table(&POINT)],
            },
        }),
        Kind::Sources => json!({
            "type": "object",
            "additionalProperties": { "anyOf": [table(&OPERATOR_INPUT), table(&SIGNAL_INPUT)] },
        }),
        Kind::Command => {
            json!({ "type": "array", "items": { "type": "string" }, "minItems": 1 })
        }
        Kind::Value => json!({ "type": ["boolean", "number", "string"] }),
        Kind::Flag => json!({ "type": "boolean", "default": false }),
        Kind::Register => json!({ "type": "string", "pattern": "^(input|holding):[0-9]{1,5}$" }),
        Kind::Number { most, default } => {
            json!({ "type": "number", "minimum": -most, "maximum": most, "default": default })
        }
        Kind::Names => json!({ "type": "object", "additionalProperties": { "type": "string" } }),
        Kind::Parameters => {
            json!({ "anyOf": [table(&ROBOT_PARAMETERS), table(&PRESS_PARAMETERS)] })
        }
    };
    let entries = property.as_object_mut().expect("each kind is an object");
    entries.insert("description".into(), key.meaning.into());
    if let Kind::Time { .. } | Kind::Word { .. } = key.kind
        && let Some(default) = key.kind.default()
    {
        entries.insert("default".into(), default.trim_matches('"').into());
    }
    property
}
