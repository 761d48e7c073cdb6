//! Pragmas, and C code of Beremiz and matiec.

use std::ops::Range;

use understudy_text::Diagnostic;

use super::Lexer;

/// Pragmas that no execution depends on, by their first word. `S7_…` belongs to them.
const PRAGMAS: [&str; 17] = [
    "attribute",
    "info",
    "warning",
    "error",
    "text",
    "region",
    "endregion",
    "warnings",
    "analysis",
    "link_always",
    "linkalways",
    "flow",
    "external",
    "externalaccessible",
    "externalvisible",
    "externalwritable",
    "instructionlist",
];

/// Pragmas that choose which statements are compiled, by their first word.
const CONDITIONS: [&str; 8] =
    ["if", "elsif", "else", "end_if", "define", "undefine", "#if", "#ifdef"];

/// Whether a pragma is C code, which matiec copies into its own.
pub(super) fn is_foreign_code(content: &str) -> bool {
    content.contains("__SET_VAR")
        || content.contains("__GET_VAR")
        || content.trim_end().ends_with(';')
}

/// Why C code is refused.
pub(crate) fn code_refused(span: Range<usize>) -> Diagnostic {
    let message = "C code that can write variables is not supported";
    let help = "write it in Structured Text, or do it outside of the program";
    Diagnostic::error("U1040", message, span).with_help(help)
}

impl<'a> Lexer<'a> {
    /// Takes C code of Beremiz and matiec that can write a variable: nothing executes it here, so no program can have it.
    pub(super) fn code(&mut self) -> Option<&'a str> {
        const WRITES: [&str; 4] = ["SET", "Set", "data__", "&"];
        let rest = self.rest();
        let pairs = [("{{", "}}"), ("{", "}")];
        let (opening, closing) = pairs.into_iter().find(|pair| rest.starts_with(pair.0))?;
        let content = &rest[opening.len()..];
        let length = self.comment_length(content, opening, closing)?;
        let content = &content[..length];
        let is_code = opening == "{{" || is_foreign_code(content);
        if !is_code || !WRITES.iter().any(|word| content.contains(word)) {
            return None;
        }
        let start = self.place;
        self.place += opening.len() + length + closing.len();
        Some(self.since(start))
    }

    /// Reads past a pragma where that changes nothing.
    pub(super) fn pragma(&mut self, content: &str, start: usize) {
        let content = content.trim();
        let is_part = |next: char| next.is_ascii_alphanumeric() || next == '_' || next == '#';
        let word = content.split(|next| !is_part(next)).next().unwrap_or("");
        let is = |known: &&str| word.eq_ignore_ascii_case(known);
        if CONDITIONS.iter().any(is) {
            let message = format!("the conditional pragma `{{{word}}}` is not supported");
            let finding = Diagnostic::error("U1040", message, start..self.place);
            let help = "keep the lines of one case and remove the pragmas";
            self.diagnostics.push(finding.with_help(help));
        } else if !content.is_empty()
            && !word.to_ascii_uppercase().starts_with("S7_")
            && !PRAGMAS.iter().any(is)
        {
            let shown: String = content.chars().take(40).collect();
            let message = format!("the pragma `{}` has no effect", shown.escape_debug());
            self.warn(message, start);
        }
    }
}
