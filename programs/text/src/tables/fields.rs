//! The keys of one table.
//!
//! Invariant: [`Fields::finish`] reports every key that the reader did not ask for, so no key of a file is ignored in silence.

use std::borrow::Cow;
use std::ops::{Range, RangeInclusive};
use std::time::Duration;

use super::Codes;
use super::format::{Kind, Table};
use super::value::{Placed, Value};
use crate::Diagnostic;
use crate::spelling::suggestion;
use toml::Spanned;
use toml::de::DeTable;

/// One table, `what`, and the keys that it was asked for.
pub struct Fields<'a, 't> {
    what: &'static str,
    table: &'a DeTable<'t>,
    span: Range<usize>,
    codes: &'static Codes,
    asked: Vec<&'static str>,
    format: Option<&'static Table>,
}

impl<'a, 't> Fields<'a, 't> {
    /// Of `table`.
    pub fn new(what: &'static str, table: Placed<&'a DeTable<'t>>, codes: &'static Codes) -> Self {
        Self { what, table: table.value, span: table.span, codes, asked: Vec::new(), format: None }
    }

    /// A table of a format. Bounds and required keys are those of the format; its reader asks for no other key.
    pub fn of(
        format: &'static Table,
        table: Placed<&'a DeTable<'t>>,
        codes: &'static Codes,
    ) -> Self {
        Self { format: Some(format), ..Self::new(format.what, table, codes) }
    }

    /// The values of a key in the format.
    fn kind(&self, key: &str) -> Option<&'static Kind> {
        self.format.map(|format| format.kind(key))
    }

    /// Reports the keys that the format requires and the table does not have.
    pub fn require_all(&self, diagnostics: &mut Vec<Diagnostic>) {
        let required = self.format.map(Table::required).unwrap_or_default();
        self.require(&required, diagnostics);
    }

    /// As [`Value::count`], in the bounds of the format.
    ///
    /// # Panics
    /// Where the key is not a whole number of the format, as the methods below where it is of another kind.
    pub fn format_count(
        &mut self,
        key: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Placed<u64>> {
        let bounds = self.kind(key)?.counts();
        self.count(key, bounds, diagnostics)
    }

    /// As [`Value::number`], in the bounds of the format.
    pub fn format_number(
        &mut self,
        key: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Placed<f64>> {
        let bounds = self.kind(key)?.numbers();
        self.number(key, bounds, diagnostics)
    }

    /// As [`Value::time`], in the bounds of the format.
    pub fn format_time(
        &mut self,
        key: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Duration> {
        let bounds = self.kind(key)?.times();
        self.time(key, bounds, diagnostics)
    }

    /// The table of a key, in its own format.
    pub fn format_table(
        &mut self,
        key: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Self> {
        let format = self.kind(key)?.table();
        let wanted = format!("a table, [{key}]");
        let table = self.get(key)?.table(&wanted, diagnostics)?;
        Some(Self::of(format, table, self.codes))
    }

    /// The tables under `[[key]]`, in their own format; none where the key is absent.
    pub fn format_tables(
        &mut self,
        key: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Vec<Self> {
        let format = self.kind(key).map(Kind::table);
        let value = self.get(key);
        let tables = value.map_or_else(Vec::new, |value| value.tables(diagnostics));
        let tables = tables.into_iter().zip(format.into_iter().cycle());
        tables.map(|(table, format)| Self::of(format, table, self.codes)).collect()
    }

    /// The place of the table.
    pub fn span(&self) -> Range<usize> {
        self.span.clone()
    }

    /// Whether the table has a key.
    pub fn has(&self, key: &str) -> bool {
        self.table.contains_key(key)
    }

    /// Reports those of `keys` that the table does not have.
    pub fn require(&self, keys: &[&str], diagnostics: &mut Vec<Diagnostic>) {
        for key in keys.iter().filter(|key| !self.has(key)) {
            let message = format!("{} has no `{key}`", self.what);
            diagnostics.push(
                Diagnostic::error(self.codes.missing_key, message, self.span())
                    .with_help(format!("add `{key} = …`")),
            );
        }
    }

    /// Asks for keys whose value has no meaning here, because of an error that is reported.
    pub fn ignore(&mut self, keys: &[&'static str]) {
        self.asked.extend(keys);
    }

    /// Asks for a key.
    pub fn get(&mut self, key: &'static str) -> Option<Value<'a, 't>> {
        // A key that is not in the format would be missing in the schema.
        self.kind(key);
        self.asked.push(key);
        let value = self.table.get(key)?;
        Some(Value::new(key, value, self.codes))
    }

    /// As [`Value::text`].
    pub fn text(
        &mut self,
        key: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Placed<&'a str>> {
        self.get(key)?.text(diagnostics)
    }

    /// As [`Value::texts`]; none where the key is absent.
    pub fn texts(
        &mut self,
        key: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Vec<Placed<&'a str>> {
        let value = self.get(key);
        value.map_or_else(Vec::new, |value| value.texts(diagnostics))
    }

    /// As [`Value::flag`].
    pub fn flag(&mut self, key: &'static str, diagnostics: &mut Vec<Diagnostic>) -> Option<bool> {
        Some(self.get(key)?.flag(diagnostics)?.value)
    }

    /// As [`Value::count`].
    pub fn count(
        &mut self,
        key: &'static str,
        bounds: RangeInclusive<u64>,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Placed<u64>> {
        self.get(key)?.count(bounds, diagnostics)
    }

    /// As [`Value::number`].
    pub fn number(
        &mut self,
        key: &'static str,
        bounds: RangeInclusive<f64>,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Placed<f64>> {
        self.get(key)?.number(bounds, diagnostics)
    }

    /// As [`Value::time`].
    pub fn time(
        &mut self,
        key: &'static str,
        bounds: RangeInclusive<Duration>,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Duration> {
        Some(self.get(key)?.time(bounds, diagnostics)?.value)
    }

    /// As [`Value::word`]; 0 where the key is absent or wrong.
    pub fn word(
        &mut self,
        key: &'static str,
        words: &[&str],
        diagnostics: &mut Vec<Diagnostic>,
    ) -> usize {
        let value = self.get(key);
        let word = value.and_then(|value| value.word(words, diagnostics));
        word.map_or(0, |word| word.value)
    }

    /// The table `[key]`, which is `what`.
    pub fn table(
        &mut self,
        key: &'static str,
        what: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Self> {
        let wanted = format!("a table, [{key}]");
        let table = self.get(key)?.table(&wanted, diagnostics)?;
        Some(Self::new(what, table, self.codes))
    }

    /// The tables under `[[key]]`, each of which is `what`; none where the key is absent.
    pub fn tables(
        &mut self,
        key: &'static str,
        what: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Vec<Self> {
        let value = self.get(key);
        let tables = value.map_or_else(Vec::new, |value| value.tables(diagnostics));
        let tables = tables.into_iter();
        tables.map(|table| Self::new(what, table, self.codes)).collect()
    }

    /// Reports every key that was not asked for.
    pub fn finish(self, diagnostics: &mut Vec<Diagnostic>) {
        for key in self.table.keys() {
            if !self.asked.contains(&key.get_ref().as_ref()) {
                diagnostics.push(unknown_key(self.codes, self.what, key, &self.asked));
            }
        }
    }
}

/// A key that `what` does not have; `known` are those that it has.
pub fn unknown_key(
    codes: &Codes,
    what: &str,
    key: &Spanned<Cow<'_, str>>,
    known: &[&str],
) -> Diagnostic {
    let name = key.get_ref();
    let message = format!("{what} has no key `{name}`");
    Diagnostic::error(codes.unknown_key, message, key.span())
        .with_help(suggestion(name, known.iter().copied()))
}
