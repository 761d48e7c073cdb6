//! Taking the fields of a TOML table one by one, so that one run finds everything that is wrong with it.
//!
//! Invariant: each key is asked for once; [`Fields::finish`] reports every key that nobody asked for, with the nearest known one.

use std::ops::Range;
use std::time::Duration;

use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};
use understudy_diagnostic::Diagnostic;
use understudy_diagnostic::spelling::suggestion;

/// A value and where it stands.
pub(crate) type Placed<T> = (T, Range<usize>);

/// The fields of one table that have not been asked for yet.
pub(crate) struct Fields<'a, 't> {
    table: &'a DeTable<'t>,
    place: Range<usize>,
    what: &'static str,
    known: Vec<&'static str>,
}

impl<'a, 't> Fields<'a, 't> {
    pub(crate) fn new(table: &'a DeTable<'t>, place: Range<usize>, what: &'static str) -> Self {
        Self {
            table,
            place,
            what,
            known: Vec::new(),
        }
    }

    /// Where the table stands.
    pub(crate) fn place(&self) -> Range<usize> {
        self.place.clone()
    }

    /// Asks for keys whose value has no meaning here, because of an error that is reported.
    pub(crate) fn ignore(&mut self, keys: &[&'static str]) {
        self.known.extend(keys);
    }

    fn get(&mut self, key: &'static str) -> Option<&'a Spanned<DeValue<'t>>> {
        self.known.push(key);
        self.table.get(key)
    }

    /// A field that has to be there.
    pub(crate) fn required<T>(
        &mut self,
        key: &'static str,
        found: Option<T>,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<T> {
        if !self.table.contains_key(key) {
            let message = format!("{} has no `{key}`", self.what);
            diagnostics.push(
                Diagnostic::error("U0303", message, self.place())
                    .with_label(format!("`{key} = ...` is expected here")),
            );
        }
        found
    }

    pub(crate) fn text(
        &mut self,
        key: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Placed<&'a str>> {
        let value = self.get(key)?;
        expect(
            value,
            value.get_ref().as_str(),
            "a text in quotes",
            diagnostics,
        )
    }

    /// A whole number that is not negative.
    pub(crate) fn count(
        &mut self,
        key: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Placed<u64>> {
        let value = self.get(key)?;
        count(value, diagnostics)
    }

    /// Yes or no.
    pub(crate) fn flag(
        &mut self,
        key: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Placed<bool>> {
        let value = self.get(key)?;
        expect(
            value,
            value.get_ref().as_bool(),
            "true or false",
            diagnostics,
        )
    }

    /// A share from 0 to 1.
    pub(crate) fn share(
        &mut self,
        key: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Placed<f64>> {
        let value = self.get(key)?;
        let number = match value.get_ref() {
            DeValue::Integer(integer) => integer.as_str().parse().ok(),
            DeValue::Float(float) => float.as_str().parse::<f64>().ok(),
            _ => None,
        };
        let (number, place) = expect(value, number, "a number from 0 to 1", diagnostics)?;
        if (0.0..=1.0).contains(&number) {
            return Some((number, place));
        }
        let message = format!("`{key}` is {number}; it is a share from 0 to 1");
        diagnostics.push(Diagnostic::error("U0305", message, place));
        None
    }

    /// A time with its unit.
    pub(crate) fn duration(
        &mut self,
        key: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Placed<Duration>> {
        let value = self.get(key)?;
        let duration = value.get_ref().as_str().and_then(parse_duration);
        let wanted = "a time with its unit, such as \"500us\", \"10ms\" or \"2s\"";
        expect(value, duration, wanted, diagnostics)
    }

    /// One text, or a list of texts.
    pub(crate) fn texts(
        &mut self,
        key: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Vec<Placed<&'a str>> {
        let Some(value) = self.get(key) else {
            return Vec::new();
        };
        let wanted = "a text in quotes";
        match value.get_ref() {
            DeValue::Array(values) => values
                .iter()
                .filter_map(|value| expect(value, value.get_ref().as_str(), wanted, diagnostics))
                .collect(),
            other => expect(
                value,
                other.as_str(),
                "a list of texts in quotes",
                diagnostics,
            )
            .into_iter()
            .collect(),
        }
    }

    /// A table.
    pub(crate) fn table(
        &mut self,
        key: &'static str,
        what: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Fields<'a, 't>> {
        let value = self.get(key)?;
        let wanted = format!("a table, `[{key}]`");
        let (table, place) = expect(value, value.get_ref().as_table(), &wanted, diagnostics)?;
        Some(Fields::new(table, place, what))
    }

    /// A list of tables.
    pub(crate) fn tables(
        &mut self,
        key: &'static str,
        what: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Vec<Fields<'a, 't>> {
        let Some(value) = self.get(key) else {
            return Vec::new();
        };
        let wanted = format!("tables, each under `[[{key}]]`");
        let values = expect(value, value.get_ref().as_array(), &wanted, diagnostics);
        let values: &DeArray<'_> = match values {
            Some((values, _)) => values,
            None => return Vec::new(),
        };
        values
            .iter()
            .filter_map(|value| expect(value, value.get_ref().as_table(), &wanted, diagnostics))
            .map(|(table, place)| Fields::new(table, place, what))
            .collect()
    }

    /// A table from names to counts, each with the place of its name.
    pub(crate) fn counts(
        &mut self,
        key: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Vec<(Placed<&'a str>, u64)> {
        let Some(value) = self.get(key) else {
            return Vec::new();
        };
        let wanted = "a table from names to numbers, such as `{ ram = 15 }`";
        let table = expect(value, value.get_ref().as_table(), wanted, diagnostics);
        let Some((table, _)) = table else {
            return Vec::new();
        };
        table
            .iter()
            .filter_map(|(name, value)| {
                let (count, _) = count(value, diagnostics)?;
                Some(((name.get_ref().as_ref(), name.span()), count))
            })
            .collect()
    }

    /// Reports every key that was not asked for.
    pub(crate) fn finish(self, diagnostics: &mut Vec<Diagnostic>) {
        for key in self.table.keys() {
            let name = key.get_ref().as_ref();
            if self.known.contains(&name) {
                continue;
            }
            let message = format!("{} has no key `{name}`", self.what);
            let known = self.known.iter().copied();
            diagnostics.push(
                Diagnostic::error("U0302", message, key.span())
                    .with_label("unknown key")
                    .with_help(suggestion(name, known)),
            );
        }
    }
}

fn expect<T>(
    value: &Spanned<DeValue<'_>>,
    found: Option<T>,
    wanted: &str,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<Placed<T>> {
    if found.is_none() {
        let kind = value.get_ref().type_str();
        let article = if kind.starts_with(['a', 'i']) {
            "an"
        } else {
            "a"
        };
        diagnostics.push(
            Diagnostic::error("U0304", format!("expected {wanted}"), value.span())
                .with_label(format!("this is {article} {kind}")),
        );
    }
    found.map(|found| (found, value.span()))
}

fn count(value: &Spanned<DeValue<'_>>, diagnostics: &mut Vec<Diagnostic>) -> Option<Placed<u64>> {
    let number = value
        .get_ref()
        .as_integer()
        .and_then(|integer| u64::from_str_radix(integer.as_str(), integer.radix()).ok())
        .filter(|&number| i64::try_from(number).is_ok());
    expect(
        value,
        number,
        "a whole number that is not negative",
        diagnostics,
    )
}

/// `10ms`, `1.5s`, `200us`, `3ns`; at most an hour.
fn parse_duration(text: &str) -> Option<Duration> {
    let unit_at = text.find(|character: char| character.is_ascii_alphabetic())?;
    let (number, unit) = text.split_at(unit_at);
    let seconds_per_unit = match unit {
        "s" => 1.0,
        "ms" => 1e-3,
        "us" => 1e-6,
        "ns" => 1e-9,
        _ => return None,
    };
    let seconds = number.trim().parse::<f64>().ok()? * seconds_per_unit;
    (0.0..=3600.0)
        .contains(&seconds)
        .then(|| Duration::from_secs_f64(seconds))
}
