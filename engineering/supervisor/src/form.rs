//! What every reader of this crate does alike with the tables of its files, so that one run finds everything that is wrong with
//! the form of a file, each with its place.

use std::ops::Range;
use std::time::Duration;

use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};
use understudy_ladder::Name;
use understudy_text::spelling;
use understudy_text::tables::Codes;
use understudy_text::tables::format::Table;
use understudy_text::{Diagnostic, duration};

/// A place in the text, in bytes.
pub(crate) type Place = Range<usize>;

/// A word with its place.
pub(crate) type Word<'t> = (&'t str, Place);

/// Those of maps of signals and of nets.
pub(crate) const CODES: Codes = Codes {
    no_toml: "U0861",
    unknown_key: "U0862",
    missing_key: "U0863",
    wrong_type: "U0864",
    out_of_bounds: "U0865",
    unknown_word: "U0865",
};

/// A text that is being read, and what is wrong with it.
pub(crate) struct Form<'t> {
    pub(crate) text: &'t str,
    codes: &'static Codes,
    pub(crate) diagnostics: Vec<Diagnostic>,
}

/// Parses `text` and reads it; nothing where it is no TOML. The diagnostics are in the order of their places.
pub(crate) fn read<'t, T>(
    text: &'t str,
    codes: &'static Codes,
    read: impl FnOnce(&mut Form<'t>, &DeTable<'t>) -> T,
) -> (Option<T>, Vec<Diagnostic>) {
    let mut form = Form {
        text,
        codes,
        diagnostics: Vec::new(),
    };
    let root = understudy_text::tables::parse(text, codes, &mut form.diagnostics);
    let result = root.map(|root| read(&mut form, root.get_ref()));
    form.diagnostics
        .sort_by_key(|diagnostic| diagnostic.span.start);
    (result, form.diagnostics)
}

impl<'t> Form<'t> {
    pub(crate) fn error(&mut self, code: &'static str, message: impl Into<String>, place: Place) {
        self.diagnostics
            .push(Diagnostic::error(code, message, place));
    }

    /// An error with the known name that is nearest, or with `else_help`.
    pub(crate) fn error_near<'n>(
        &mut self,
        code: &'static str,
        message: String,
        (name, place): (&str, Place),
        known: impl IntoIterator<Item = &'n str>,
        else_help: Option<String>,
    ) {
        let help = spelling::question(name, known);
        let mut diagnostic = Diagnostic::error(code, message, place);
        diagnostic.help = help.or(else_help);
        self.diagnostics.push(diagnostic);
    }

    /// Reports the keys of a table that its format does not have.
    pub(crate) fn check_keys(&mut self, table: &DeTable, format: &Table) {
        let (what, known) = (format.what, format.names());
        for key in table.keys() {
            let name = key.get_ref().as_ref();
            if !known.contains(&name) {
                self.error_near(
                    self.codes.unknown_key,
                    format!("{what} has no \"{name}\""),
                    (name, key.span()),
                    known.iter().copied(),
                    Some(format!("it has {}", known.join(", "))),
                );
            }
        }
    }

    pub(crate) fn missing(&mut self, key: &str, what: &str, place: Place) {
        self.error(
            self.codes.missing_key,
            format!("{what} needs \"{key}\""),
            place,
        );
    }

    pub(crate) fn wrong_type(&mut self, value: &Spanned<DeValue>, wanted: &str) {
        let found = value.get_ref().type_str();
        let message = format!("{wanted} is wanted, not {found}");
        self.error(self.codes.wrong_type, message, value.span());
    }

    pub(crate) fn table<'v, 'w>(
        &mut self,
        value: &'v Spanned<DeValue<'w>>,
    ) -> Option<&'v DeTable<'w>> {
        let table = value.get_ref().as_table();
        if table.is_none() {
            self.wrong_type(value, "a table");
        }
        table
    }

    pub(crate) fn array<'v, 'w>(
        &mut self,
        value: &'v Spanned<DeValue<'w>>,
    ) -> Option<&'v DeArray<'w>> {
        let array = value.get_ref().as_array();
        if array.is_none() {
            self.wrong_type(value, "a list");
        }
        array
    }

    pub(crate) fn boolean(&mut self, value: &Spanned<DeValue>) -> Option<bool> {
        let boolean = value.get_ref().as_bool();
        if boolean.is_none() {
            self.wrong_type(value, "true or false");
        }
        boolean
    }

    /// A text as it is.
    pub(crate) fn string(&mut self, value: &Spanned<DeValue>) -> Option<String> {
        let word = value.get_ref().as_str();
        if word.is_none() {
            self.wrong_type(value, "a text");
        }
        word.map(str::to_owned)
    }

    /// The name under `key`, if there is one.
    pub(crate) fn optional(&mut self, table: &DeTable, key: &str) -> Option<Name> {
        let value = table.get(key)?;
        let text = self.string(value)?;
        Some(Name::at(&*text, value.span()))
    }

    /// The name under `key`, which `what` at `place` needs.
    pub(crate) fn name(&mut self, table: &DeTable, key: &str, what: &str, place: &Place) -> Name {
        if !table.contains_key(key) {
            self.missing(key, what, place.clone());
        }
        self.optional(table, key).unwrap_or_default()
    }

    pub(crate) fn flag(&mut self, table: &DeTable, key: &str) -> bool {
        let value = table.get(key);
        value.and_then(|value| self.boolean(value)).unwrap_or(false)
    }

    /// A number from `range` under `key`.
    pub(crate) fn number(
        &mut self,
        table: &DeTable,
        key: &str,
        range: std::ops::RangeInclusive<u32>,
    ) -> Option<u32> {
        let value = table.get(key)?;
        let Some(number) = value.get_ref().as_integer() else {
            self.wrong_type(value, "a number");
            return None;
        };
        let number = u32::from_str_radix(number.as_str(), number.radix()).ok();
        let number = number.filter(|number| range.contains(number));
        if number.is_none() {
            let message = format!(
                "\"{key}\" is a number from {} to {}",
                range.start(),
                range.end()
            );
            self.error(self.codes.out_of_bounds, message, value.span());
        }
        number
    }

    /// One of `words` under `key`; the default where nothing is said.
    pub(crate) fn choice<T: Copy + Default>(
        &mut self,
        table: &DeTable,
        key: &str,
        words: &[(&str, T)],
    ) -> T {
        let text = self.optional(table, key);
        text.and_then(|text| self.one_of(&text, words))
            .unwrap_or_default()
    }

    /// What `text` means among `words`.
    pub(crate) fn one_of<T: Copy>(&mut self, text: &Name, words: &[(&str, T)]) -> Option<T> {
        let found = words.iter().find(|(word, _)| *word == text.as_str());
        if found.is_none() {
            let listed: Vec<&str> = words.iter().map(|(word, _)| *word).collect();
            let message = format!("{:?} is none of {}", text.as_str(), listed.join(", "));
            let word = (text.as_str(), text.span());
            self.error_near(self.codes.unknown_word, message, word, listed, None);
        }
        found.map(|(_, value)| *value)
    }

    /// The time that `text` says.
    pub(crate) fn time(&mut self, text: &Name) -> Option<Duration> {
        let time = duration::parse(text);
        if let Err(error) = &time {
            let error = Diagnostic::error(self.codes.unknown_word, error.to_string(), text.span());
            self.diagnostics
                .push(error.with_help("such as \"15s\", \"1.5s\" or \"2m\""));
        }
        time.ok()
    }

    /// What `read` makes of each table of the list under `key`.
    pub(crate) fn list<T>(
        &mut self,
        table: &DeTable,
        key: &str,
        mut read: impl FnMut(&mut Self, &DeTable, &Place) -> T,
    ) -> Vec<T> {
        let entries = table.get(key).and_then(|value| self.array(value));
        let mut list = Vec::new();
        for entry in entries.into_iter().flatten() {
            if let Some(table) = self.table(entry) {
                list.push(read(self, table, &entry.span()));
            }
        }
        list
    }

    /// The texts of a list, each with the words in it.
    pub(crate) fn phrases(&mut self, list: &Spanned<DeValue>) -> Vec<(Vec<Word<'t>>, Place)> {
        let mut phrases = Vec::new();
        for item in self.array(list).into_iter().flatten() {
            if self.string(item).is_some() {
                phrases.push((split(self.text, item.span()), item.span()));
            }
        }
        phrases
    }
}

/// Content of a quoted text in the file, with its position.
pub(crate) fn trimmed(text: &str, span: Place) -> Word<'_> {
    let raw = text.get(span.clone()).unwrap_or_default();
    let start = span.start + (raw.len() - raw.trim_start_matches(['"', '\'']).len());
    let inside = raw.trim_matches(['"', '\'']);
    (inside, start..start + inside.len())
}

/// Its words.
pub(crate) fn split(text: &str, span: Place) -> Vec<Word<'_>> {
    let (inside, place) = trimmed(text, span);
    let words = inside.split_whitespace().map(|word| {
        let start = place.start + (word.as_ptr() as usize - inside.as_ptr() as usize);
        (word, start..start + word.len())
    });
    words.collect()
}

/// A word as TOML writes it.
pub(crate) fn quoted(word: &str) -> String {
    toml::Value::from(word).to_string()
}

/// A key as TOML writes it.
pub(crate) fn key(word: &str) -> String {
    let is_bare = |letter: char| letter.is_ascii_alphanumeric() || letter == '_' || letter == '-';
    if !word.is_empty() && word.chars().all(is_bare) {
        word.to_owned()
    } else {
        quoted(word)
    }
}
