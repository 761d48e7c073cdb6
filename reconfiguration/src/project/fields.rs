//! Taking values of a TOML table key by key, and saying what is wrong with them.

use std::ops::{Range, RangeInclusive};
use std::time::Duration;

use toml::Spanned;
use toml::de::{DeTable, DeValue};
use understudy_diagnostic::Diagnostic;
use understudy_diagnostic::spelling::suggestion;

/// One table of the file.
pub(super) struct Fields<'a, 't> {
    name: &'static str,
    table: &'a DeTable<'t>,
    pub(super) span: Range<usize>,
}

/// A name that nothing has.
pub(super) fn unknown(what: &str, name: &str, span: Range<usize>, known: &[&str]) -> Diagnostic {
    Diagnostic::error("U1205", format!("there is no {what} `{name}`"), span)
        .with_help(suggestion(name, known.iter().copied()))
}

impl<'a, 't> Fields<'a, 't> {
    pub(super) fn new(
        name: &'static str,
        table: &'a DeTable<'t>,
        span: Range<usize>,
        known: &[&str],
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Self {
        for key in table.keys() {
            let text = key.get_ref().as_ref();
            if !known.contains(&text) {
                let mut found = unknown("key", text, key.span(), known);
                found.code = "U1202";
                found.message = format!("{name} has no key `{text}`");
                diagnostics.push(found);
            }
        }
        Self { name, table, span }
    }

    pub(super) fn require(&self, keys: &[&str], diagnostics: &mut Vec<Diagnostic>) {
        for key in keys.iter().filter(|key| !self.table.contains_key(**key)) {
            let message = format!("{} has no `{key}`", self.name);
            diagnostics.push(Diagnostic::error("U1203", message, self.span.clone()));
        }
    }

    pub(super) fn lacks(&self, key: &str) -> bool {
        !self.table.contains_key(key)
    }

    /// Where a key's value stands.
    pub(super) fn place(&self, key: &str) -> Option<Range<usize>> {
        self.table.get(key).map(Spanned::span)
    }

    fn expected(key: &str, expected: &str, value: &Spanned<DeValue<'_>>) -> Diagnostic {
        let message = format!("`{key}` is not {expected}");
        Diagnostic::error("U1204", message, value.span()).with_label(format!("expected {expected}"))
    }

    /// A text; nothing where it is absent or something else.
    pub(super) fn text(
        &self,
        key: &str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Spanned<String>> {
        let value = self.table.get(key)?;
        match value.get_ref().as_str() {
            Some(text) => Some(Spanned::new(value.span(), text.to_owned())),
            None => {
                diagnostics.push(Self::expected(key, "a text in quotes", value));
                None
            }
        }
    }

    /// A list of texts; empty where absent.
    pub(super) fn texts(
        &self,
        key: &str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Vec<Spanned<String>> {
        let Some(value) = self.table.get(key) else {
            return Vec::new();
        };
        let DeValue::Array(list) = value.get_ref() else {
            diagnostics.push(Self::expected(
                key,
                "a list of texts, such as [\"a\", \"b\"]",
                value,
            ));
            return Vec::new();
        };
        let mut texts = Vec::new();
        for entry in list.iter() {
            match entry.get_ref().as_str() {
                Some(text) => texts.push(Spanned::new(entry.span(), text.to_owned())),
                None => diagnostics.push(Self::expected(key, "a list of texts", entry)),
            }
        }
        texts
    }

    /// A table in this one, with its place.
    pub(super) fn table(
        &self,
        key: &str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<(&'a DeTable<'t>, Range<usize>)> {
        let value = self.table.get(key)?;
        match value.get_ref() {
            DeValue::Table(table) => Some((table, value.span())),
            _ => {
                diagnostics.push(Self::expected(key, "a table", value));
                None
            }
        }
    }

    /// The tables of `[[key]]`; none where absent.
    pub(super) fn tables(
        &self,
        key: &str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Vec<(&'a DeTable<'t>, Range<usize>)> {
        let Some(value) = self.table.get(key) else {
            return Vec::new();
        };
        let DeValue::Array(list) = value.get_ref() else {
            diagnostics.push(Self::expected(key, "a list of tables, [[...]]", value));
            return Vec::new();
        };
        let mut tables = Vec::new();
        for entry in list.iter() {
            match entry.get_ref() {
                DeValue::Table(table) => tables.push((table, entry.span())),
                _ => diagnostics.push(Self::expected(key, "a list of tables, [[...]]", entry)),
            }
        }
        tables
    }

    /// A whole number in its bounds.
    pub(super) fn count(
        &self,
        key: &str,
        bounds: RangeInclusive<usize>,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<usize> {
        let value = self.table.get(key)?;
        let Some(number) = value.get_ref().as_integer() else {
            diagnostics.push(Self::expected(key, "a whole number", value));
            return None;
        };
        let parsed = usize::from_str_radix(number.as_str(), number.radix()).ok();
        let inside = parsed.filter(|number| bounds.contains(number));
        if inside.is_none() {
            let message = format!(
                "`{key}` is {number}; it is from {} to {}",
                bounds.start(),
                bounds.end()
            );
            diagnostics.push(Diagnostic::error("U1207", message, value.span()));
        }
        inside
    }

    /// The place of one of `words`; 0 where absent or wrong.
    pub(super) fn word(
        &self,
        key: &str,
        words: &[&str],
        diagnostics: &mut Vec<Diagnostic>,
    ) -> usize {
        let Some(text) = self.text(key, diagnostics) else {
            return 0;
        };
        let found = words.iter().position(|word| *word == text.get_ref());
        found.unwrap_or_else(|| {
            let mut wrong = unknown("word", text.get_ref(), text.span(), words);
            wrong.code = "U1207";
            wrong.message = format!("`{key}` cannot be {:?}", text.get_ref());
            diagnostics.push(wrong);
            0
        })
    }

    /// A time such as `"10ms"`, from 1 us to 1 h.
    pub(super) fn time(
        &self,
        key: &str,
        absent: Duration,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Duration {
        let Some(text) = self.text(key, diagnostics) else {
            return absent;
        };
        let parsed = parse_time(text.get_ref());
        let bounds = Duration::from_micros(1)..=Duration::from_secs(3600);
        match parsed.filter(|time| bounds.contains(time)) {
            Some(time) => time,
            None => {
                let message = format!("`{key}` cannot be {:?}", text.get_ref());
                diagnostics.push(Diagnostic::error("U1207", message, text.span()).with_help(
                    "a whole number and its unit, such as \"10ms\", \"200us\" or \"1s\"",
                ));
                absent
            }
        }
    }
}

fn parse_time(text: &str) -> Option<Duration> {
    let unit_at = text.find(|character: char| character.is_ascii_alphabetic())?;
    let number: u64 = text[..unit_at].trim().parse().ok()?;
    let microseconds = match &text[unit_at..] {
        "us" => 1,
        "ms" => 1_000,
        "s" => 1_000_000,
        _ => return None,
    };
    number.checked_mul(microseconds).map(Duration::from_micros)
}
