//! The blocks that come with this crate, in Structured Text: the standard ones, and those for control.

use std::sync::OnceLock;

use crate::syntax::File;

/// The whole library as one text.
pub(crate) const TEXT: &str = concat!(
    include_str!("library/standard.st"),
    "\n",
    include_str!("library/control.st"),
);

/// The library, read once.
pub fn file() -> &'static File {
    static FILE: OnceLock<File> = OnceLock::new();
    FILE.get_or_init(|| crate::parser::parse(TEXT).0)
}
