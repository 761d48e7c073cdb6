//! The schemas know every key that the readers know, and no other.

use serde_json::{Value, json};
use understudy_supervisor::ladder::read_map;
use understudy_supervisor::petri::read_net;
use understudy_supervisor::{map_schema, model_schema, net_schema, read_model};

/// What of `data` a schema does not admit: keys, types and required keys.
fn refused(schema: &Value, data: &Value, at: &str, found: &mut Vec<String>) {
    if let Some(kinds) = schema["anyOf"].as_array() {
        let tries = kinds.iter().map(|kind| {
            let mut found = Vec::new();
            refused(kind, data, at, &mut found);
            found
        });
        found.extend(tries.min_by_key(Vec::len).unwrap_or_default());
        return;
    }
    let is_of_type = match schema["type"].as_str() {
        Some("object") => data.is_object(),
        Some("array") => data.is_array(),
        Some("string") => data.is_string(),
        Some("integer") => data.is_i64(),
        Some("boolean") => data.is_boolean(),
        _ => true,
    };
    if !is_of_type {
        found.push(at.to_owned());
        return;
    }
    for (index, item) in data.as_array().into_iter().flatten().enumerate() {
        refused(&schema["items"], item, &format!("{at}.{index}"), found);
    }
    for (key, value) in data.as_object().into_iter().flatten() {
        let place = format!("{at}.{key}");
        match schema["properties"].get(key) {
            Some(property) => refused(property, value, &place, found),
            None if schema["additionalProperties"].is_object() => {
                refused(&schema["additionalProperties"], value, &place, found);
            }
            None => found.push(place),
        }
    }
    for key in schema["required"].as_array().into_iter().flatten() {
        let key = key.as_str().expect("a key");
        if data.get(key).is_none() {
            found.push(format!("{at}.{key} is missing"));
        }
    }
}

fn check(schema: &schemars::Schema, text: &str) {
    let data: toml::Value = toml::from_str(text).expect("TOML");
    let data = serde_json::to_value(data).expect("data");
    let mut found = Vec::new();
    refused(schema.as_value(), &data, "", &mut found);
    assert_eq!(found, Vec::<String>::new());
}

#[test]
fn what_is_right_fits() {
    check(&net_schema(), include_str!("../../../examples/assembly-cell/net.toml"));
    check(&model_schema(), include_str!("../../../examples/assembly-cell/model.toml"));
    check(&model_schema(), include_str!("../../../examples/small-factory/model.toml"));
    check(&map_schema(), include_str!("../../../examples/motivating-example/map.toml"));
}

/// A file with every key of a schema, of the right type; the reader may find fault with the words, and not with a key.
fn full(schema: &Value) -> Value {
    if let Some(kinds) = schema["anyOf"].as_array() {
        return full(&kinds[0]);
    }
    match schema["type"].as_str() {
        Some("object") => {
            let properties = schema["properties"].as_object().into_iter().flatten();
            let mut table: serde_json::Map<String, Value> =
                properties.map(|(key, value)| (key.clone(), full(value))).collect();
            if schema["additionalProperties"].is_object() {
                table.insert("a".to_owned(), full(&schema["additionalProperties"]));
            }
            Value::Object(table)
        }
        Some("array") => json!([full(&schema["items"])]),
        Some("integer") => json!(1),
        Some("boolean") => json!(true),
        _ => json!("a"),
    }
}

#[test]
fn every_key_of_a_schema_is_one_of_the_reader() {
    let text = |schema: &schemars::Schema| {
        let value: toml::Value = serde_json::from_value(full(schema.as_value())).expect("TOML");
        toml::to_string(&value).expect("TOML")
    };
    let found =
        [read_net(&text(&net_schema())).diagnostics, read_map(&text(&map_schema())).diagnostics];
    for found in found.iter().flatten() {
        assert!(!["U0862", "U0864"].contains(&found.code), "{found:?}");
    }
    // A file or a net needs no other key, and refuses none but these.
    let model = text(&model_schema());
    for found in read_model(&model, |_| Err(String::new())).diagnostics {
        let allowed = found.code != "U0821" || found.message.contains("a plant that is a net");
        assert!(allowed, "{found:?}");
    }
}
