//! The blocks that come with this crate, in Structured Text: the standard ones, and those for control.

use std::sync::OnceLock;

use crate::syntax::{File, Unit};

/// The whole library as one text.
pub(crate) const TEXT: &str =
    concat!(include_str!("library/standard.st"), "\n", include_str!("library/control.st"),);

/// Where the standard blocks end and those for control begin.
const CONTROL: usize = include_str!("library/standard.st").len();

/// The blocks for control: other compilers do not have them.
pub fn control() -> impl Iterator<Item = &'static Unit> {
    let units = file().units.iter();
    units.filter(|unit| unit.span.start >= CONTROL)
}

/// The library, read once.
pub fn file() -> &'static File {
    static FILE: OnceLock<File> = OnceLock::new();
    FILE.get_or_init(|| crate::parser::parse(TEXT).0)
}
