//! The texts of an alarm that is told anew while it lasts, each from a cycle on: the past is shown with the text of its time.

/// Texts that are kept, at most; then the newest takes the place of the one before it.
const MOST: usize = 64;

#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Texts(Vec<(i64, String)>);

impl Texts {
    /// From `cycle` on the text is this one; before, from its beginning on, it was `before`.
    pub(super) fn tell(&mut self, before: (i64, &str), cycle: i64, text: &str) {
        if self.0.is_empty() {
            self.0.push((before.0, before.1.to_owned()));
        }
        if self.0.len() == MOST {
            self.0.pop();
        }
        self.0.push((cycle, text.to_owned()));
    }

    /// The text in a cycle; nothing where it never changed.
    pub(super) fn at(&self, cycle: i64) -> Option<&str> {
        let told = self.0.iter().rfind(|(since, _)| *since <= cycle);
        told.or_else(|| self.0.first()).map(|(_, text)| text.as_str())
    }

    pub(super) fn shift(&mut self, by: i64) {
        self.0.iter_mut().for_each(|(since, _)| *since = since.saturating_add(by));
    }
}
