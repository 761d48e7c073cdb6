//! The lines of a text, found once for many places in it.

use std::ops::Range;

use crate::Position;

/// A text with the beginnings of its lines.
#[derive(Debug, Clone)]
pub struct Lines<'t> {
    text: &'t str,
    /// The first byte of each line; a text has at least one line.
    starts: Vec<usize>,
}

impl<'t> Lines<'t> {
    /// The lines of `text`.
    pub fn new(text: &'t str) -> Self {
        let behind = text.match_indices('\n').map(|(newline, _)| newline + 1);
        Self { text, starts: std::iter::once(0).chain(behind).collect() }
    }

    /// The nearest byte at or before `offset` where a character begins, or the end of the text.
    pub fn boundary(&self, offset: usize) -> usize {
        let mut offset = offset.min(self.text.len());
        while !self.text.is_char_boundary(offset) {
            offset -= 1;
        }
        offset
    }

    /// The number of the line of a byte, from 0; a place past the end is on the last line.
    pub fn index(&self, offset: usize) -> usize {
        self.starts.partition_point(|start| *start <= offset) - 1
    }

    /// The bytes of a line with its newline; nothing past the last line.
    pub fn range(&self, index: usize) -> Range<usize> {
        let end = self.text.len();
        let start = |index: usize| self.starts.get(index).copied().unwrap_or(end);
        start(index)..start(index + 1)
    }

    /// 1-based line and column (in characters) of a byte offset; an offset past the end is taken as the end.
    pub fn position(&self, offset: usize) -> Position {
        let offset = self.boundary(offset);
        let line = self.index(offset);
        Position {
            line: line + 1,
            column: self.text[self.starts[line]..offset].chars().count() + 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(text: &str, offset: usize, expected: &str) {
        let position = Lines::new(text).position(offset);
        assert_eq!(position.to_string(), expected, "{text:?}");
    }

    #[test]
    fn places_are_counted_from_one_in_characters() {
        check("", 0, "1:1");
        check("ab\ncd", 2, "1:3");
        check("ab\ncd", 3, "2:1");
        check("ab\ncd", 4, "2:2");
        check("ab\n", 3, "2:1");
        check("é!\n", 2, "1:2");
        check("é", 1, "1:1");
        check("ab", 99, "1:3");
    }

    #[test]
    fn lines_are_the_whole_text() {
        let lines = Lines::new("ab\n\ncd");
        let ranges: Vec<Range<usize>> = (0..4).map(|index| lines.range(index)).collect();
        assert_eq!(ranges, [0..3, 3..4, 4..6, 6..6]);
    }
}
