//! Files in TOML as tables of known keys, read so that one run finds everything that is wrong with them, each with its place.
//!
//! Invariant: a value that leaves here has the type and the bounds that were asked for; where the text has another one, that
//! is reported, and the reader goes on without it to check the rest. What the values mean is the reader's own affair.

mod fields;
pub mod format;
mod value;

pub use fields::{Fields, unknown_key};
pub use value::{Constant, Placed, Value};

use crate::{Diagnostic, MAXIMUM_FINDINGS};
use toml::Spanned;
use toml::de::DeTable;

/// The largest file; readers of one kind may have a smaller bound.
pub const MAXIMUM_TEXT_BYTES: usize = 16 << 20;

/// The stable codes of one kind of file for what can be wrong with its form.
#[derive(Debug)]
pub struct Codes {
    /// The text is not TOML.
    pub no_toml: &'static str,
    /// A key that its table does not have.
    pub unknown_key: &'static str,
    /// A key that is missing.
    pub missing_key: &'static str,
    /// A value of another type than expected.
    pub wrong_type: &'static str,
    /// A number or a time out of its bounds.
    pub out_of_bounds: &'static str,
    /// A word that is not one of the possible ones.
    pub unknown_word: &'static str,
}

/// A name as a key: in quotes where it has other letters than those of a bare one, such as `list[1]` or `pair.left`.
pub fn key_text(name: &str) -> String {
    let is_bare = |letter: char| letter.is_ascii_alphanumeric() || "-_".contains(letter);
    if name.chars().all(is_bare) { name.to_owned() } else { format!("{name:?}") }
}

/// The tables of `text`; nothing where it is not TOML, because what the recovery makes of a broken text would only bring
/// errors that follow from the first ones.
pub fn parse<'t>(
    text: &'t str,
    codes: &Codes,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<Spanned<DeTable<'t>>> {
    if text.len() > MAXIMUM_TEXT_BYTES {
        let message =
            format!("the file has {} bytes; at most {MAXIMUM_TEXT_BYTES} are read", text.len());
        diagnostics.push(Diagnostic::error(codes.no_toml, message, 0..0));
        return None;
    }
    let (table, errors) = DeTable::parse_recoverable(text);
    for error in errors.iter().take(MAXIMUM_FINDINGS) {
        let span = error.span().unwrap_or(text.len()..text.len());
        let message = format!("invalid TOML: {}", error.message().trim_end());
        diagnostics.push(Diagnostic::error(codes.no_toml, message, span));
    }
    errors.is_empty().then_some(table)
}

#[cfg(test)]
mod tests;
