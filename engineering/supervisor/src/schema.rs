//! The JSON schemas of models, nets and maps of signals, for editors. Whether names mean something is beyond a schema.

use schemars::Schema;
use serde_json::{Value, json};

use crate::ads::MAXIMUM_LABEL;
use crate::ladder::{Agent, When};

const DIALECT: &str = "https://json-schema.org/draft/2020-12/schema";

fn table(required: &[&str], properties: &Value) -> Value {
    json!({
        "type": "object",
        "additionalProperties": false,
        "required": required,
        "properties": properties,
    })
}

fn list(items: &Value) -> Value {
    json!({ "type": "array", "items": items })
}

fn text() -> Value {
    json!({ "type": "string" })
}

/// A text or a list of texts.
fn texts() -> Value {
    json!({ "anyOf": [text(), list(&text())] })
}

fn time() -> Value {
    json!({ "type": "string", "pattern": "^([0-9]+(d|h|m|s|ms|us))+$" })
}

fn whens() -> Value {
    json!({ "enum": When::WORDS.map(|(word, _)| word) })
}

fn addresses() -> Value {
    let address = json!({ "type": "string", "pattern": "^%[IQM]X?[0-9]+(\\.[0-9]+)*$" });
    json!({ "type": "object", "additionalProperties": address })
}

fn events(signals: bool) -> Value {
    let mut properties = json!({
        "controllable": { "type": "boolean" },
        "label": { "type": "integer", "minimum": 0, "maximum": MAXIMUM_LABEL },
    });
    if signals {
        properties["signal"] = text();
        properties["when"] = whens();
    }
    json!({ "type": "object", "additionalProperties": table(&[], &properties) })
}

fn schema(title: &str, mut content: Value) -> Schema {
    content["$schema"] = json!(DIALECT);
    content["title"] = json!(title);
    // An object is a schema.
    Schema::try_from(content).unwrap_or_default()
}

/// JSON Schema 2020-12 of a model.
pub fn model_schema() -> Schema {
    let automaton = table(
        &[],
        &json!({
            "name": text(),
            "file": text(),
            "events": list(&text()),
            "initial": text(),
            "marked": { "anyOf": [{ "const": "all" }, list(&text())] },
            "states": list(&text()),
            "transitions": list(&json!({ "type": "string", "pattern": "^\\s*\\S+\\s+\\S+\\s+\\S+\\s*$" })),
        }),
    );
    let mut plant = automaton.clone();
    plant["properties"]["net"] = text();
    let content = table(
        &[],
        &json!({
            "name": text(),
            "events": events(true),
            "addresses": addresses(),
            "plant": list(&plant),
            "specification": list(&automaton),
            "supervisor": list(&automaton),
        }),
    );
    schema("Model of plants and specifications of Understudy", content)
}

/// JSON Schema 2020-12 of an automation Petri net.
pub fn net_schema() -> Schema {
    let count = |least: u32| json!({ "type": "integer", "minimum": least, "maximum": 32767 });
    let place = table(
        &["name"],
        &json!({
            "name": text(),
            "tokens": count(0),
            "capacity": count(1),
            "level": texts(),
            "impulse": texts(),
        }),
    );
    let transition = table(
        &["name"],
        &json!({
            "name": text(),
            "event": text(),
            "takes": texts(),
            "gives": texts(),
            "inhibited_by": texts(),
            "enabled_by": texts(),
            "when": text(),
            "after": time(),
        }),
    );
    let content = table(
        &["name"],
        &json!({
            "name": text(),
            "events": events(false),
            "place": list(&place),
            "transition": list(&transition),
            "addresses": addresses(),
        }),
    );
    schema("Automation Petri net of Understudy", content)
}

/// JSON Schema 2020-12 of a map of signals.
pub fn map_schema() -> Schema {
    let signal = |more: &[(&str, Value)]| {
        let mut properties = json!({ "event": text(), "signal": text() });
        for (key, value) in more {
            properties[*key] = value.clone();
        }
        table(&["event", "signal"], &properties)
    };
    let flag = json!({ "type": "boolean" });
    let by = json!({ "enum": Agent::WORDS.map(|(word, _)| word) });
    let switch = table(
        &["positions"],
        &json!({ "off": text(), "positions": list(&signal(&[])), "memory": flag }),
    );
    let timer = table(
        &["event", "name", "runs_while", "preset"],
        &json!({ "event": text(), "name": text(), "runs_while": text(), "preset": time() }),
    );
    let content = table(
        &["program"],
        &json!({
            "program": text(),
            "start": text(),
            "events": { "type": "object", "additionalProperties": { "type": "integer", "minimum": 0 } },
            "input": list(&signal(&[("when", whens()), ("by", by)])),
            "switch": list(&switch),
            "pulse": list(&signal(&[("memory", flag.clone())])),
            "timer": list(&timer),
            "request": list(&signal(&[])),
            "addresses": addresses(),
        }),
    );
    schema("Map of signals of Understudy", content)
}
