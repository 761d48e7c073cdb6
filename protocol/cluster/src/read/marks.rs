//! Marks in comments of a cluster file: what the engineer of the plant must still fill in.

use understudy_text::{Diagnostic, MAXIMUM_FINDINGS};

/// A comment line that begins with it asks for something.
pub(crate) const MARK: &str = "FILL IN:";

/// Reminds of the marks that are left, of the first [`MAXIMUM_FINDINGS`] at most.
pub(crate) fn remind(text: &str, diagnostics: &mut Vec<Diagnostic>) {
    let mut start = 0;
    for line in text.split_inclusive('\n') {
        let asked = line.trim_start().strip_prefix('#').map(str::trim);
        let asked = asked.and_then(|comment| comment.strip_prefix(MARK));
        if let Some(asked) = asked
            && diagnostics.len() < MAXIMUM_FINDINGS
        {
            let message = format!("to be filled in: {}", asked.trim());
            let end = start + line.trim_end().len();
            diagnostics.push(
                Diagnostic::warning("U0255", message, start..end)
                    .with_help(format!("remove `{MARK}` when it is done")),
            );
        }
        start += line.len();
    }
}
