//! The keys of a kind of file, once: its reader and its JSON schema are made from these tables.

use std::ops::RangeInclusive;
use std::time::Duration;

use serde_json::{Map, Value, json};

use crate::duration;

/// A table of a file.
#[derive(Debug)]
pub struct Table {
    /// The name of such a table in messages, such as "a step".
    pub what: &'static str,
    /// Its keys.
    pub keys: &'static [Key],
}

/// A key of a table.
#[derive(Debug)]
pub struct Key {
    /// The key itself.
    pub name: &'static str,
    /// Whether the table must have it.
    pub required: bool,
    /// Its values.
    pub kind: Kind,
}

/// The values that a key can have.
#[derive(Debug)]
pub enum Kind {
    /// Any text.
    Text,
    /// A text that matches a regular expression.
    Pattern(&'static str),
    /// `true` or `false`.
    Flag,
    /// A whole number in its bounds.
    Count(u64, u64),
    /// A number in its bounds.
    Number(f64, f64),
    /// A duration in its bounds, which are beyond a schema.
    Time(Duration, Duration),
    /// One of these words.
    Word(fn() -> Vec<&'static str>),
    /// A value or a list of such values.
    OneOrMany(&'static Kind),
    /// A value of one kind or of the other.
    Either(&'static Kind, &'static Kind),
    /// A list.
    List(&'static Kind),
    /// A table.
    Table(&'static Table),
    /// A table of the first format or of the second.
    TableOr(&'static Table, &'static Table),
    /// A table from any names to values.
    Entries(&'static Kind),
}

/// A key that may be absent.
pub const fn key(name: &'static str, kind: Kind) -> Key {
    Key { name, required: false, kind }
}

/// A key that must be there.
pub const fn required(name: &'static str, kind: Kind) -> Key {
    Key { name, required: true, kind }
}

impl Table {
    /// The names of the keys.
    pub fn names(&self) -> Vec<&'static str> {
        self.keys.iter().map(|key| key.name).collect()
    }

    /// The names of the keys that must be there.
    pub fn required(&self) -> Vec<&'static str> {
        let required = self.keys.iter().filter(|key| key.required);
        required.map(|key| key.name).collect()
    }

    /// The values of a key.
    ///
    /// # Panics
    /// Where the table does not have the key: its reader asks for its keys only.
    pub fn kind(&self, name: &str) -> &'static Kind {
        let key = self.keys.iter().find(|key| key.name == name);
        match key {
            Some(key) => &key.kind,
            None => panic!("{} has no key `{name}` in its format", self.what),
        }
    }

    /// JSON Schema 2020-12 of a file whose top table is this one.
    pub fn schema(&self, title: &str) -> Value {
        let mut schema = self.properties();
        schema["$schema"] = json!("https://json-schema.org/draft/2020-12/schema");
        schema["title"] = json!(title);
        schema
    }

    fn properties(&self) -> Value {
        let properties = self.keys.iter();
        let properties: Map<String, Value> =
            properties.map(|key| (key.name.to_owned(), key.kind.schema())).collect();
        json!({
            "type": "object",
            "additionalProperties": false,
            "required": self.required(),
            "properties": properties,
        })
    }
}

impl Kind {
    fn schema(&self) -> Value {
        match self {
            Self::Text => json!({ "type": "string" }),
            Self::Pattern(pattern) => json!({ "type": "string", "pattern": pattern }),
            Self::Flag => json!({ "type": "boolean" }),
            Self::Count(least, u64::MAX) => json!({ "type": "integer", "minimum": least }),
            Self::Count(least, most) => {
                json!({ "type": "integer", "minimum": least, "maximum": most })
            }
            Self::Number(least, most) => {
                json!({ "type": "number", "minimum": least, "maximum": most })
            }
            Self::Time(..) => json!({ "type": "string", "pattern": duration::pattern() }),
            Self::Word(words) => json!({ "enum": words() }),
            Self::OneOrMany(kind) => {
                json!({ "anyOf": [kind.schema(), Self::List(kind).schema()] })
            }
            Self::Either(one, other) => json!({ "anyOf": [one.schema(), other.schema()] }),
            Self::List(kind) => json!({ "type": "array", "items": kind.schema() }),
            Self::Table(table) => table.properties(),
            Self::TableOr(one, other) => {
                json!({ "anyOf": [one.properties(), other.properties()] })
            }
            Self::Entries(kind) => {
                json!({ "type": "object", "additionalProperties": kind.schema() })
            }
        }
    }

    /// The format of a table, or of each table of a list.
    ///
    /// # Panics
    /// For another kind.
    pub fn table(&self) -> &'static Table {
        match *self {
            Self::Table(table) | Self::List(&Self::Table(table)) => table,
            _ => panic!("{self:?} is not a table"),
        }
    }

    /// The bounds of a whole number.
    ///
    /// # Panics
    /// For another kind.
    pub fn counts(&self) -> RangeInclusive<u64> {
        match *self {
            Self::Count(least, most) => least..=most,
            _ => panic!("{self:?} is not a whole number"),
        }
    }

    /// The bounds of a number.
    ///
    /// # Panics
    /// For another kind.
    pub fn numbers(&self) -> RangeInclusive<f64> {
        match *self {
            Self::Number(least, most) => least..=most,
            _ => panic!("{self:?} is not a number"),
        }
    }

    /// The bounds of a duration.
    ///
    /// # Panics
    /// For another kind.
    pub fn times(&self) -> RangeInclusive<Duration> {
        match *self {
            Self::Time(least, most) => least..=most,
            _ => panic!("{self:?} is not a duration"),
        }
    }
}
