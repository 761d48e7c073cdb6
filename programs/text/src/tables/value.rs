//! One value of a file: its type and its bounds.

use std::ops::{Range, RangeInclusive};
use std::time::Duration;

use super::Codes;
use crate::Diagnostic;
use crate::duration;
use crate::spelling::suggestion;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The largest whole number that TOML knows.
const LARGEST: u64 = i64::MAX as u64;

/// A value and its place, as bytes of the text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Placed<T> {
    /// The value.
    pub value: T,
    /// Its place.
    pub span: Range<usize>,
}

impl<T> Placed<T> {
    /// Another value in the same place.
    pub fn map<U>(self, change: impl FnOnce(T) -> U) -> Placed<U> {
        Placed { value: change(self.value), span: self.span }
    }
}

/// A value as it is written, before anybody knows of which type it is to be.
#[derive(Debug, Clone, PartialEq)]
pub enum Constant {
    /// `true` or `false`.
    Flag(bool),
    /// A whole number.
    Whole(i64),
    /// A number with a fraction.
    Number(f64),
    /// A text.
    Text(String),
}

/// The value of a key, or one in its list.
#[derive(Clone, Copy)]
pub struct Value<'a, 't> {
    name: &'a str,
    value: &'a Spanned<DeValue<'t>>,
    codes: &'static Codes,
}

impl<'a, 't> Value<'a, 't> {
    /// The value of the key `name`.
    pub fn new(name: &'a str, value: &'a Spanned<DeValue<'t>>, codes: &'static Codes) -> Self {
        Self { name, value, codes }
    }

    /// Its place.
    pub fn span(self) -> Range<usize> {
        self.value.span()
    }

    /// Any text.
    pub fn text(self, diagnostics: &mut Vec<Diagnostic>) -> Option<Placed<&'a str>> {
        self.text_as("a text in quotes", diagnostics)
    }

    /// A text with a meaning, `wanted`.
    pub fn text_as(
        self,
        wanted: &str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Placed<&'a str>> {
        self.expect(self.value.get_ref().as_str(), wanted, diagnostics)
    }

    /// One text, or a list of texts.
    pub fn texts(self, diagnostics: &mut Vec<Diagnostic>) -> Vec<Placed<&'a str>> {
        let wanted = "a list of texts in quotes";
        match self.value.get_ref() {
            DeValue::Array(values) => {
                let texts = values.iter();
                texts.filter_map(|value| Self { value, ..self }.text(diagnostics)).collect()
            }
            _ => self.text_as(wanted, diagnostics).into_iter().collect(),
        }
    }

    /// Yes or no.
    pub fn flag(self, diagnostics: &mut Vec<Diagnostic>) -> Option<Placed<bool>> {
        self.expect(self.value.get_ref().as_bool(), "`true` or `false`", diagnostics)
    }

    /// A value of a signal: yes or no, a number, or a text such as a duration.
    pub fn constant(self, diagnostics: &mut Vec<Diagnostic>) -> Option<Placed<Constant>> {
        let whole = |number: &toml::de::DeInteger<'_>| {
            i64::from_str_radix(number.as_str(), number.radix()).ok()
        };
        let found = match self.value.get_ref() {
            DeValue::Boolean(bit) => Some(Constant::Flag(*bit)),
            DeValue::Integer(number) => whole(number).map(Constant::Whole),
            DeValue::Float(number) => number.as_str().parse().ok().map(Constant::Number),
            DeValue::String(text) => Some(Constant::Text(text.to_string())),
            _ => None,
        };
        self.expect(found, "`true`, `false` or a number", diagnostics)
    }

    /// A whole number in its bounds.
    pub fn count(
        self,
        bounds: RangeInclusive<u64>,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Placed<u64>> {
        let wanted = match (*bounds.start(), *bounds.end()) {
            (0, LARGEST..) => "a whole number that is not negative".to_owned(),
            (least, most) => format!("a whole number from {least} to {most}"),
        };
        let number = self.value.get_ref().as_integer();
        let number = self.expect(number, &wanted, diagnostics)?.value;
        let count = u64::from_str_radix(number.as_str(), number.radix()).ok();
        let inside = count.filter(|&count| count <= LARGEST && bounds.contains(&count));
        self.in_bounds(inside, &number.to_string(), &wanted, diagnostics)
    }

    /// A number in its bounds.
    pub fn number(
        self,
        bounds: RangeInclusive<f64>,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Placed<f64>> {
        let wanted = format!("a number from {} to {}", bounds.start(), bounds.end());
        let number = match self.value.get_ref() {
            DeValue::Integer(number) => number.as_str().parse::<f64>().ok(),
            DeValue::Float(number) => number.as_str().parse::<f64>().ok(),
            _ => None,
        };
        let number = self.expect(number, &wanted, diagnostics)?.value;
        let inside = bounds.contains(&number).then_some(number);
        self.in_bounds(inside, &number.to_string(), &wanted, diagnostics)
    }

    /// A time in its bounds, as a text with its unit.
    pub fn time(
        self,
        bounds: RangeInclusive<Duration>,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Placed<Duration>> {
        let (least, most) = (duration::text(*bounds.start()), duration::text(*bounds.end()));
        let wanted = format!("a time with its unit in quotes, from \"{least}\" to \"{most}\"");
        let time = self.value.get_ref().as_str().and_then(|text| duration::parse(text).ok());
        let time = self.expect(time, &wanted, diagnostics)?.value;
        let inside = bounds.contains(&time).then_some(time);
        self.in_bounds(inside, &duration::text(time), &wanted, diagnostics)
    }

    /// The place of a text among `words`.
    pub fn word(self, words: &[&str], diagnostics: &mut Vec<Diagnostic>) -> Option<Placed<usize>> {
        let quoted: Vec<String> = words.iter().map(|word| format!("\"{word}\"")).collect();
        let text = self.text_as(&quoted.join(" or "), diagnostics)?.value;
        let place = words.iter().position(|word| *word == text);
        if place.is_none() {
            let message = format!("`{}` cannot be {text:?}", self.name);
            let expected = format!("expected {}", quoted.join(" or "));
            diagnostics.push(
                Diagnostic::error(self.codes.unknown_word, message, self.span())
                    .with_label(expected)
                    .with_help(suggestion(text, words.iter().copied())),
            );
        }
        Some(self.placed(place?))
    }

    /// A table.
    pub fn table(
        self,
        wanted: &str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Placed<&'a DeTable<'t>>> {
        self.expect(self.value.get_ref().as_table(), wanted, diagnostics)
    }

    /// A table; nothing, and no diagnostic, where it is another value.
    pub fn as_table(self) -> Option<Placed<&'a DeTable<'t>>> {
        self.value.get_ref().as_table().map(|table| self.placed(table))
    }

    /// The tables under `[[name]]`.
    pub fn tables(self, diagnostics: &mut Vec<Diagnostic>) -> Vec<Placed<&'a DeTable<'t>>> {
        let wanted = format!("tables, each under [[{}]]", self.name);
        let values = self.value.get_ref().as_array();
        let values = self.expect(values, &wanted, diagnostics);
        let values = values.into_iter().flat_map(|values| values.value.iter());
        values.filter_map(|value| Self { value, ..self }.table(&wanted, diagnostics)).collect()
    }

    /// The names and values of a table in which every name is possible.
    pub fn entries(
        self,
        wanted: &str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Vec<(Placed<&'a str>, Value<'a, 't>)> {
        let table = self.table(wanted, diagnostics);
        let entries = table.into_iter().flat_map(|table| table.value.iter());
        let entry = |(name, value): (&'a Spanned<_>, &'a Spanned<DeValue<'t>>)| {
            let text: &'a std::borrow::Cow<'t, str> = name.get_ref();
            let placed = Placed { value: text.as_ref(), span: name.span() };
            (placed, Value::new(text, value, self.codes))
        };
        entries.map(entry).collect()
    }

    fn placed<T>(self, value: T) -> Placed<T> {
        Placed { value, span: self.span() }
    }

    /// What was found, or that something else was wanted.
    pub fn expect<T>(
        self,
        found: Option<T>,
        wanted: &str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Placed<T>> {
        if found.is_none() {
            let is = match self.value.get_ref() {
                DeValue::String(text) => format!("the text {text:?}"),
                DeValue::Integer(number) => format!("the number {number}"),
                DeValue::Float(number) => format!("the number {number}"),
                DeValue::Boolean(bit) => format!("`{bit}`"),
                DeValue::Datetime(_) => "a date".into(),
                DeValue::Array(_) => "a list".into(),
                DeValue::Table(_) => "a table".into(),
            };
            self.report(self.codes.wrong_type, &is, wanted, diagnostics);
        }
        found.map(|found| self.placed(found))
    }

    fn in_bounds<T>(
        self,
        inside: Option<T>,
        found: &str,
        wanted: &str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Placed<T>> {
        if inside.is_none() {
            self.report(self.codes.out_of_bounds, found, wanted, diagnostics);
        }
        inside.map(|inside| self.placed(inside))
    }

    fn report(self, code: &'static str, is: &str, wanted: &str, diagnostics: &mut Vec<Diagnostic>) {
        let message = format!("`{}` is {is}", self.name);
        diagnostics.push(
            Diagnostic::error(code, message, self.span()).with_label(format!("expected {wanted}")),
        );
    }
}
