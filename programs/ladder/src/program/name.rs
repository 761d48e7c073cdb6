//! Names with their places.

use std::fmt;
use std::hash::{Hash, Hasher};
use std::ops::{Deref, Range};

/// A name and, where it was read from a text, its place there.
///
/// Two names are equal when their letters are, wherever they stand.
#[derive(Debug, Clone, Default)]
pub struct Name {
    text: String,
    span: Range<usize>,
}

impl Name {
    /// A name that stood at `span` (bytes) of its source.
    pub fn at(text: impl Into<String>, span: Range<usize>) -> Self {
        Self { text: text.into(), span }
    }

    /// Its letters.
    pub fn as_str(&self) -> &str {
        &self.text
    }

    /// Byte range in the source; empty at 0 for a name that was not read.
    pub fn span(&self) -> Range<usize> {
        self.span.clone()
    }
}

impl<T: Into<String>> From<T> for Name {
    fn from(text: T) -> Self {
        Self::at(text, 0..0)
    }
}

impl Deref for Name {
    type Target = str;

    fn deref(&self) -> &str {
        &self.text
    }
}

impl PartialEq for Name {
    fn eq(&self, other: &Self) -> bool {
        self.text == other.text
    }
}

impl Eq for Name {}

impl Hash for Name {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.text.hash(state);
    }
}

impl fmt::Display for Name {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.text)
    }
}
