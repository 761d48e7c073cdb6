//! Variables that had another name in the program before.

use std::collections::BTreeMap;
use std::ops::Range;

use understudy_text::Diagnostic;
use understudy_text::tables::key_text;
use understudy_typed::Renamed;

use crate::code::Code;
use crate::fields::Placed;

/// The pairs of a program: each names a path that the program has, and no two name the same one.
pub(super) fn pairs(
    section: &BTreeMap<String, (Range<usize>, Placed<String>)>,
    code: &Code,
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<Renamed> {
    let mut known: Vec<&str> = Vec::new();
    for (old, (_, new)) in section {
        let (path, span) = (new.value.as_str(), new.span.clone());
        let is_known = |known: &&str| known.eq_ignore_ascii_case(path);
        if known.iter().any(is_known) {
            let message =
                format!("`{path}` takes over the values of two variables, one of them `{old}`");
            let help = "leave one of the two pairs out";
            diagnostics.push(Diagnostic::error("U0208", message, span).with_help(help));
        } else if !code.typed().has_path(path) {
            let message = format!(
                "the program has no variable `{path}`, which is the new name of the old `{old}`"
            );
            let help = match code.typed().has_path(old) {
                true => format!(
                    "the old name is the key, and the new one the value: `{} = {old:?}`",
                    key_text(path)
                ),
                false => "the path of a variable, or of a member such as `pump.hours`; elements of arrays keep their indices".to_owned(),
            };
            diagnostics.push(Diagnostic::error("U0209", message, span).with_help(help));
        }
        known.push(path);
    }
    section.iter().map(|(old, (_, new))| (old.clone(), new.value.clone())).collect()
}
