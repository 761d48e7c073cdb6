//! Whole numbers without a default.

use understudy_text::Diagnostic;

use super::{Fields, Placed};
use crate::format::Kind;

impl Fields<'_, '_> {
    /// A whole number in its bounds; nothing where absent or wrong.
    pub(crate) fn digits(
        &self,
        name: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Placed<u8>> {
        let (key, value) = self.get(name);
        let Kind::Digits { most } = key.kind else {
            unreachable!("`{name}` is a number of digits in its table");
        };
        let count = value?.count(0..=u64::from(most), diagnostics)?;
        Some(count.map(|count| count as u8))
    }
}
