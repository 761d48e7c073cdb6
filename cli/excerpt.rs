//! Excerpt of a file for one finding; long lines are shortened around the position.

use std::collections::BTreeMap;
use std::ops::Range;

use codespan_reporting::diagnostic::Label;
use codespan_reporting::files::{Error, Files};
use understudy_text::{Diagnostic, Lines};

/// Maximum number of characters of a line, without ellipses.
const MAXIMUM_COLUMNS: usize = 120;

/// Maximum number of characters before the position.
const COLUMNS_BEFORE: usize = 40;

/// Maximum number of lines of one position.
const MAXIMUM_LINES: usize = 8;

/// Ellipsis for omitted characters.
const CUT: &str = "…";

/// Lines of a file with their original numbers.
pub(crate) struct Excerpt<'r> {
    name: &'r str,
    text: String,
    /// By line number in the file, from 0; ascending in `text` too.
    lines: BTreeMap<usize, Line>,
}

/// A line or the shown part of it.
struct Line {
    /// Shown bytes of the file.
    shown: Range<usize>,
    /// Number of characters of the line before them.
    before: usize,
    /// Start of the line in the excerpt.
    start: usize,
    /// Start of `shown` in the excerpt.
    text: usize,
    /// End of `shown` in the excerpt.
    end: usize,
}

/// A finding with its excerpt.
pub(crate) struct Shown<'r> {
    pub(crate) excerpt: Excerpt<'r>,
    pub(crate) labels: Vec<Label<()>>,
    /// Related positions outside of the excerpt.
    pub(crate) notes: Vec<String>,
}

impl<'r> Shown<'r> {
    /// Makes the excerpt of `text`, the file `name`.
    pub(crate) fn new(
        name: &'r str,
        text: &str,
        lines: &Lines<'_>,
        diagnostic: &Diagnostic,
    ) -> Self {
        let place = |span: &Range<usize>| {
            let start = lines.boundary(span.start);
            let end = lines.boundary(span.end.max(start));
            let line = lines.index(start);
            if lines.index(end) - line < MAXIMUM_LINES {
                start..end
            } else {
                start..without_newline(text, lines.range(line)).end.max(start)
            }
        };
        let primary = place(&diagnostic.span);
        let related: Vec<(Range<usize>, &str)> = diagnostic
            .related
            .iter()
            .map(|related| (place(&related.span), related.message.as_str()))
            .collect();
        let places = std::iter::once(&primary).chain(related.iter().map(|(place, _)| place));
        let excerpt = Excerpt::new(name, text, lines, places);
        let first = Label::primary((), excerpt.mapped(lines, &primary));
        let first = first.with_message(diagnostic.label.clone().unwrap_or_default());
        let mut shown = Self { labels: vec![first], notes: Vec::new(), excerpt };
        for (place, message) in &related {
            if shown.excerpt.shows(lines, place.start) {
                let label = Label::secondary((), shown.excerpt.mapped(lines, place));
                shown.labels.push(label.with_message(*message));
            } else {
                let position = lines.position(place.start);
                shown.notes.push(format!("{position}: {message}"));
            }
        }
        shown
    }
}

impl<'r> Excerpt<'r> {
    /// Shows each line around the first of `places` in it.
    fn new<'p>(
        name: &'r str,
        text: &str,
        lines: &Lines<'_>,
        places: impl Iterator<Item = &'p Range<usize>>,
    ) -> Self {
        // By line: the byte that must be shown.
        let mut wanted: BTreeMap<usize, usize> = BTreeMap::new();
        for place in places {
            let (first, last) = (lines.index(place.start), lines.index(place.end));
            wanted.entry(first).or_insert(place.start);
            for line in first + 1..=last {
                wanted.entry(line).or_insert(lines.range(line).start);
            }
        }
        // A single line between two shown lines is shown as well.
        let numbers: Vec<usize> = wanted.keys().copied().collect();
        for pair in numbers.windows(2) {
            if pair[0] + 2 == pair[1] {
                wanted.insert(pair[0] + 1, lines.range(pair[0] + 1).start);
            }
        }
        let mut excerpt = Self { name, text: String::new(), lines: BTreeMap::new() };
        for (number, focus) in wanted {
            let whole = lines.range(number);
            excerpt.add(text, number, whole, focus);
        }
        excerpt
    }

    fn add(&mut self, text: &str, number: usize, whole: Range<usize>, focus: usize) {
        let line = without_newline(text, whole.clone());
        let shown = window(text, line.clone(), focus.clamp(line.start, line.end));
        let start = self.text.len();
        if shown.start > line.start {
            self.text.push_str(CUT);
        }
        let at = self.text.len();
        self.text.push_str(&text[shown.clone()]);
        let end = self.text.len();
        if shown.end < line.end {
            self.text.push_str(CUT);
        }
        self.text.push_str(&text[line.end..whole.end]);
        let before = text[line.start..shown.start].chars().count();
        self.lines.insert(number, Line { shown, before, start, text: at, end });
    }

    /// Whether the excerpt contains a byte of the file.
    fn shows(&self, lines: &Lines<'_>, offset: usize) -> bool {
        let line = self.lines.get(&lines.index(offset));
        line.is_some_and(|line| (line.shown.start..=line.shown.end).contains(&offset))
    }

    /// Translates a position in the file to the excerpt.
    fn mapped(&self, lines: &Lines<'_>, place: &Range<usize>) -> Range<usize> {
        let map = |offset: usize| match self.lines.get(&lines.index(offset)) {
            None => self.text.len(),
            Some(line) if offset < line.shown.start => line.start,
            Some(line) if offset > line.shown.end => line.end,
            Some(line) => line.text + (offset - line.shown.start),
        };
        let start = map(place.start);
        start..map(place.end).max(start)
    }

    fn line(&self, number: usize) -> Result<&Line, Error> {
        let max = self.lines.keys().next_back().copied().unwrap_or(0);
        let given = number;
        self.lines.get(&number).ok_or(Error::LineTooLarge { given, max })
    }
}

fn without_newline(text: &str, line: Range<usize>) -> Range<usize> {
    let length = text[line.clone()].trim_end_matches(['\n', '\r']).len();
    line.start..line.start + length
}

/// Part of a line around `focus`; a short line as a whole.
fn window(text: &str, line: Range<usize>, focus: usize) -> Range<usize> {
    let content = &text[line.clone()];
    if content.len() <= MAXIMUM_COLUMNS || content.chars().nth(MAXIMUM_COLUMNS).is_none() {
        return line;
    }
    let place = |(place, _)| place;
    let before = text[line.start..focus].char_indices().rev();
    let start = line.start + before.take(COLUMNS_BEFORE).last().map_or(focus - line.start, place);
    let behind = text[start..line.end].char_indices().nth(MAXIMUM_COLUMNS);
    start..start + behind.map_or(line.end - start, place)
}

impl<'a> Files<'a> for Excerpt<'_> {
    type FileId = ();
    type Name = &'a str;
    type Source = &'a str;

    fn name(&'a self, (): ()) -> Result<&'a str, Error> {
        Ok(self.name)
    }

    fn source(&'a self, (): ()) -> Result<&'a str, Error> {
        Ok(&self.text)
    }

    fn line_index(&'a self, (): (), byte: usize) -> Result<usize, Error> {
        let mut lines = self.lines.iter().rev();
        let line = lines.find(|(_, line)| line.start <= byte);
        Ok(line.map_or(0, |(number, _)| *number))
    }

    fn line_range(&'a self, (): (), number: usize) -> Result<Range<usize>, Error> {
        let line = self.line(number)?;
        let next = self.lines.range(number + 1..).next();
        Ok(line.start..next.map_or(self.text.len(), |(_, next)| next.start))
    }

    fn column_number(&'a self, (): (), number: usize, byte: usize) -> Result<usize, Error> {
        let line = self.line(number)?;
        let within = self.text.get(line.text..byte).unwrap_or_default();
        Ok(line.before + within.chars().count() + 1)
    }
}
