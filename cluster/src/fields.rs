//! Taking the values of a TOML table key by key, so that one run finds everything that is wrong with it.
//!
//! Invariant: a value that leaves here has the type and the bounds of its [`Key`]; where the text has another one, that is
//! reported and the default goes on in its place, so that the rest is still checked.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::ops::Range;
use std::time::Duration;

use toml::Spanned;
use toml::de::{DeTable, DeValue};
use understudy_diagnostic::Diagnostic;
use understudy_diagnostic::spelling::suggestion;

use crate::duration::{parse_time, spoken};
use crate::format::{Key, Kind, Section};

/// The longest name of a party, in characters.
pub const MAXIMUM_NAME_LENGTH: usize = 48;

/// Names of one place that are looked up and not found; those past it are only counted, so that no file takes long.
pub(crate) const MAXIMUM_MISFITS: usize = 100;

/// A value and where it stands, or where it would stand.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Placed<T> {
    pub(crate) value: T,
    pub(crate) span: Range<usize>,
}

/// One table of the file.
pub(crate) struct Fields<'a, 't> {
    section: &'static Section,
    table: &'a DeTable<'t>,
    pub(crate) span: Range<usize>,
}

impl<'a, 't> Fields<'a, 't> {
    /// Reports the unknown and the missing keys at once.
    pub(crate) fn new(
        section: &'static Section,
        table: &'a DeTable<'t>,
        span: Range<usize>,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Self {
        let known: Vec<&str> = section.keys.iter().map(|key| key.name).collect();
        for key in table.keys() {
            if !known.contains(&key.get_ref().as_ref()) {
                diagnostics.push(unknown_key(key, &section.header(), &known));
            }
        }
        for key in section.keys {
            if key.required && !table.contains_key(key.name) {
                let message = format!("{} has no `{}`", section.header(), key.name);
                diagnostics.push(
                    Diagnostic::error("U0203", message, span.clone()).with_help(format!(
                        "add `{} = …`: {}",
                        key.name,
                        key.kind.expected()
                    )),
                );
            }
        }
        Self {
            section,
            table,
            span,
        }
    }

    pub(crate) fn has(&self, name: &str) -> bool {
        self.table.contains_key(name)
    }

    fn get(&self, name: &str) -> (&'static Key, Option<&'a Spanned<DeValue<'t>>>) {
        (self.section.key(name), self.table.get(name))
    }

    /// Any text.
    pub(crate) fn text(
        &self,
        name: &str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Placed<String>> {
        let (key, value) = self.get(name);
        let value = value?;
        let text = value.get_ref().as_str();
        let text = expect(key, value, text, diagnostics)?;
        Some(Placed {
            value: text.to_owned(),
            span: value.span(),
        })
    }

    /// The name of a party.
    pub(crate) fn name(
        &self,
        name: &str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Placed<String>> {
        let text = self.text(name, diagnostics)?;
        let legal = |character: char| character.is_ascii_alphanumeric() || "-_".contains(character);
        let starts = text
            .value
            .starts_with(|first: char| first.is_ascii_alphabetic());
        if !starts || !text.value.chars().all(legal) || text.value.len() > MAXIMUM_NAME_LENGTH {
            let message = format!("{:?} is no name", text.value);
            diagnostics.push(
                Diagnostic::error("U0206", message, text.span.clone()).with_help(format!(
                    "a name starts with a letter and has letters, digits, `-` and `_`, {MAXIMUM_NAME_LENGTH} at most"
                )),
            );
        }
        Some(text)
    }

    pub(crate) fn address(
        &self,
        name: &str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Placed<SocketAddr>> {
        let text = self.text(name, diagnostics)?;
        match text.value.parse() {
            Ok(value) => Some(Placed {
                value,
                span: text.span,
            }),
            Err(_) => {
                let message = format!("{:?} is no address", text.value);
                let expected = self.section.key(name).kind.expected();
                diagnostics.push(
                    Diagnostic::error("U0210", message, text.span)
                        .with_label(format!("expected {expected}"))
                        .with_help("a numeric host, a colon and a port"),
                );
                None
            }
        }
    }

    /// A whole number in its bounds; its default where absent or wrong.
    pub(crate) fn count(&self, name: &str, diagnostics: &mut Vec<Diagnostic>) -> u32 {
        let (key, value) = self.get(name);
        let Kind::Count {
            least,
            most,
            default,
        } = key.kind
        else {
            unreachable!("`{name}` is a count in its table");
        };
        let Some(value) = value else {
            return default;
        };
        let number = value.get_ref().as_integer();
        let Some(number) = expect(key, value, number, diagnostics) else {
            return default;
        };
        let parsed = u32::from_str_radix(number.as_str(), number.radix());
        match parsed {
            Ok(count) if (least..=most).contains(&count) => count,
            _ => {
                diagnostics.push(out_of_bounds(key, value, &number.to_string()));
                default
            }
        }
    }

    /// A time in its bounds; its default where absent or wrong.
    pub(crate) fn time(&self, name: &str, diagnostics: &mut Vec<Diagnostic>) -> Duration {
        let (key, value) = self.get(name);
        let Kind::Time {
            least,
            most,
            default,
        } = key.kind
        else {
            unreachable!("`{name}` is a time in its table");
        };
        let Some(value) = value else {
            return default;
        };
        let text = value.get_ref().as_str();
        let time = text.and_then(parse_time);
        match expect(key, value, time, diagnostics) {
            Some(time) if (least..=most).contains(&time) => time,
            Some(time) => {
                diagnostics.push(out_of_bounds(key, value, &spoken(time)));
                default
            }
            None => default,
        }
    }

    /// The index of one of the words of the key; 0 where absent or wrong.
    pub(crate) fn word(&self, name: &str, diagnostics: &mut Vec<Diagnostic>) -> usize {
        let Kind::Word { words, .. } = self.section.key(name).kind else {
            unreachable!("`{name}` is a word in its table");
        };
        let Some(text) = self.text(name, diagnostics) else {
            return 0;
        };
        let found = words.iter().position(|word| *word == text.value);
        found.unwrap_or_else(|| {
            let message = format!("`{name}` cannot be {:?}", text.value);
            diagnostics.push(
                Diagnostic::error("U0207", message, text.span)
                    .with_help(suggestion(&text.value, words.iter().copied())),
            );
            0
        })
    }

    /// A table from names to bits, in the order of its places.
    pub(crate) fn bits(
        &self,
        name: &str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Vec<(Placed<String>, bool)> {
        let entries = self.entries(name, diagnostics, DeValue::as_bool, "`true` or `false`");
        let mut entries: Vec<_> = entries
            .into_iter()
            .map(|(name, bit)| (name, bit.value))
            .collect();
        entries.sort_by_key(|(name, _)| name.span.start);
        entries
    }

    /// A table from names to names.
    pub(crate) fn names(
        &self,
        name: &str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> BTreeMap<String, (Range<usize>, Placed<String>)> {
        let text = |value: &DeValue<'t>| value.as_str().map(str::to_owned);
        let entries = self.entries(name, diagnostics, text, "a name in quotes");
        entries
            .into_iter()
            .map(|(name, value)| (name.value, (name.span, value)))
            .collect()
    }

    fn entries<T>(
        &self,
        name: &str,
        diagnostics: &mut Vec<Diagnostic>,
        read: impl Fn(&DeValue<'t>) -> Option<T>,
        wanted: &str,
    ) -> Vec<(Placed<String>, Placed<T>)> {
        let (key, value) = self.get(name);
        let Some(value) = value else {
            return Vec::new();
        };
        let table = value.get_ref().as_table();
        let Some(table) = expect(key, value, table, diagnostics) else {
            return Vec::new();
        };
        let mut entries = Vec::new();
        for (name, value) in table {
            let Some(found) = read(value.get_ref()) else {
                diagnostics.push(wrong_type(name.get_ref(), value, wanted));
                continue;
            };
            let name = Placed {
                value: name.get_ref().clone().into_owned(),
                span: name.span(),
            };
            let value = Placed {
                value: found,
                span: value.span(),
            };
            entries.push((name, value));
        }
        entries
    }

    /// A table with keys of its own; an empty one where absent or wrong.
    pub(crate) fn table(
        &self,
        name: &str,
        section: &'static Section,
        empty: &'a DeTable<'t>,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Fields<'a, 't> {
        let (key, value) = self.get(name);
        let table = value.and_then(|value| {
            let table = value.get_ref().as_table();
            expect(key, value, table, diagnostics).map(|table| (table, value.span()))
        });
        let (table, span) = table.unwrap_or((empty, self.span.clone()));
        Fields::new(section, table, span, diagnostics)
    }
}

fn expect<T>(
    key: &Key,
    value: &Spanned<DeValue<'_>>,
    found: Option<T>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<T> {
    if found.is_none() {
        diagnostics.push(wrong_type(key.name, value, &key.kind.expected()));
    }
    found
}

/// A value of another type than expected.
pub(crate) fn wrong_type(name: &str, value: &Spanned<DeValue<'_>>, wanted: &str) -> Diagnostic {
    let found = match value.get_ref() {
        DeValue::String(text) => format!("the text {text:?}"),
        DeValue::Integer(number) => format!("the number {number}"),
        DeValue::Float(number) => format!("the number {number}"),
        DeValue::Boolean(bit) => format!("`{bit}`"),
        DeValue::Datetime(_) => "a date".into(),
        DeValue::Array(_) => "a list".into(),
        DeValue::Table(_) => "a table".into(),
    };
    Diagnostic::error("U0204", format!("`{name}` is {found}"), value.span())
        .with_label(format!("expected {wanted}"))
}

fn out_of_bounds(key: &Key, value: &Spanned<DeValue<'_>>, found: &str) -> Diagnostic {
    let message = format!("`{}` is {found}", key.name);
    Diagnostic::error("U0205", message, value.span())
        .with_label(format!("expected {}", key.kind.expected()))
}

/// A key that nothing has.
pub(crate) fn unknown_key(
    key: &Spanned<std::borrow::Cow<'_, str>>,
    owner: &str,
    known: &[&str],
) -> Diagnostic {
    let name = key.get_ref();
    let message = format!("{owner} has no key `{name}`");
    Diagnostic::error("U0202", message, key.span())
        .with_help(suggestion(name, known.iter().copied()))
}
