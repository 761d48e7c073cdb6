//! A text of statements that remembers where each piece of it came from.

use std::ops::Range;

use understudy_ladder::Name;

/// A text that grows, with its places.
#[derive(Debug, Default)]
pub(crate) struct Text {
    pub(crate) body: String,
    /// Ascending: from which byte on, and where that comes from.
    places: Vec<(usize, Range<usize>)>,
}

impl Text {
    /// A text that stands in the file as it is.
    pub(crate) fn verbatim(text: &Name) -> Self {
        let mut verbatim = Self::default();
        let mut at = text.span().start;
        for line in text.split_inclusive('\n') {
            verbatim.push(line, at..at + line.len());
            at += line.len();
        }
        verbatim
    }

    pub(crate) fn push(&mut self, text: &str, place: Range<usize>) {
        self.places.push((self.body.len(), place));
        self.body.push_str(text);
    }

    /// The place in the file of a place in the text.
    pub(crate) fn place(&self, span: &Range<usize>) -> Range<usize> {
        let next = self
            .places
            .partition_point(|(start, _)| *start <= span.start);
        match next.checked_sub(1).and_then(|last| self.places.get(last)) {
            None => self.places.first().map_or(0..0, |(_, place)| place.clone()),
            Some((start, place)) => {
                let within = span.start - start;
                // Whole lines and names were taken as they are; of the rest the whole is meant.
                if within < place.len() && within > 0 {
                    place.start + within..(place.start + within + span.len()).min(place.end)
                } else {
                    place.clone()
                }
            }
        }
    }
}
