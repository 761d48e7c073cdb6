//! Sections of declarations in a written Structured Text.

use super::section;

/// Sections of declarations: a new one wherever the word, the addresses or the retention change.
#[derive(Default)]
pub(super) struct Sections {
    /// The word, whether its variables have addresses, and whether they are retentive.
    key: (&'static str, bool, bool),
    lines: Vec<String>,
    /// Those that have ended.
    pub(super) text: String,
}

impl Sections {
    pub(super) fn add(&mut self, key: (&'static str, bool, bool), line: String) {
        if self.key != key {
            self.end();
            self.key = key;
        }
        self.lines.push(line);
    }

    pub(super) fn end(&mut self) {
        let (word, _, is_kept) = self.key;
        let retain = if is_kept { " RETAIN" } else { "" };
        section(&mut self.text, &format!("{word}{retain}"), &self.lines);
        self.lines.clear();
    }
}
