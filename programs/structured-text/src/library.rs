//! The blocks that come with this crate, in Structured Text: the standard ones, and those for control.

use std::sync::OnceLock;

use crate::syntax::{File, Unit};

/// The whole library as one text.
pub(crate) const TEXT: &str = concat!(
    include_str!("library/standard.st"),
    "\n",
    include_str!("library/annex.st"),
    "\n",
    include_str!("library/control.st"),
);

/// Where the standard blocks end and those for control begin that other compilers do not have.
const CONTROL: usize =
    concat!(include_str!("library/standard.st"), "\n", include_str!("library/annex.st")).len();

/// The blocks for control that other compilers do not have.
pub fn control() -> impl Iterator<Item = &'static Unit> {
    let units = file().units.iter();
    units.filter(|unit| unit.span.start >= CONTROL)
}

/// The library, read once.
pub fn file() -> &'static File {
    static FILE: OnceLock<File> = OnceLock::new();
    FILE.get_or_init(|| crate::parser::parse(TEXT).0)
}

/// The block for control that a block of the standard is taken for: it measures the time and calculates in LREAL. A block in capitals.
pub(crate) fn counterpart(block: &str) -> Option<&'static str> {
    Some(match block {
        "PID" => "PID_ISA",
        "RAMP" => "SETPOINT_RAMP",
        "INTEGRAL" => "INTEGRATOR",
        "DERIVATIVE" => "DIFFERENTIATOR",
        "HYSTERESIS" => "COMPARATOR",
        _ => return None,
    })
}
