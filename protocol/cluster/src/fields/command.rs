//! A program and its arguments.

use understudy_text::Diagnostic;

use super::Fields;

impl Fields<'_, '_> {
    /// A program and its arguments; nothing where the program is absent or empty.
    pub(crate) fn command(
        &self,
        name: &'static str,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<(String, Vec<String>)> {
        let (key, value) = self.get(name);
        let (value, expected) = (value?, key.kind.expected());
        let list = self.table.get(name).and_then(|value| value.get_ref().as_array());
        value.expect(list, &expected, diagnostics)?;
        let texts = value.texts(diagnostics).into_iter().map(|text| text.value.to_owned());
        let mut texts = texts.collect::<Vec<_>>().into_iter();
        let program = texts.next().filter(|program| !program.is_empty());
        if program.is_none() {
            let message = format!("`{name}` names no program");
            diagnostics.push(
                Diagnostic::error("U0205", message, value.span())
                    .with_label(format!("expected {expected}")),
            );
        }
        Some((program?, texts.collect()))
    }
}
