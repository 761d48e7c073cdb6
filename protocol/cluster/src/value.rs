//! Values that a cluster file gives to signals.

use understudy_executable::{stored_value, whole_number};
use understudy_text::tables::Constant;
use understudy_typed::Declared;

/// As [`stored_value`], of a signal that may have a subrange.
///
/// # Errors
/// What is written instead.
pub(crate) fn value_within(value: &Constant, declared: Declared) -> Result<u64, String> {
    let expected = |error| declared.range.map_or(error, whole_number);
    let stored = stored_value(value, declared.of).map_err(expected)?;
    match declared.range {
        Some(range) if !declared.contains(stored) => Err(whole_number(range)),
        _ => Ok(stored),
    }
}
