//! Marks in comments of a cluster file: what the engineer of the plant must still fill in.

use understudy_diagnostic::Diagnostic;

/// A comment line that begins with it asks for something.
pub(crate) const MARK: &str = "FILL IN:";

/// Reminds of every mark that is left.
pub(crate) fn remind(text: &str, diagnostics: &mut Vec<Diagnostic>) {
    let mut start = 0;
    for line in text.split_inclusive('\n') {
        let asked = line.trim_start().strip_prefix('#').map(str::trim);
        if let Some(asked) = asked.and_then(|comment| comment.strip_prefix(MARK)) {
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
