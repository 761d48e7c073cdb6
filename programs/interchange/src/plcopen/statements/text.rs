//! A text of statements that remembers where each piece of it came from.

use std::ops::Range;

use crate::plcopen::xml::Passage;

/// A text that grows, with its places.
#[derive(Debug, Default)]
pub(crate) struct Text {
    pub(crate) body: String,
    /// In the order of the text.
    pieces: Vec<Piece>,
}

/// A piece of the text, up to the next one.
#[derive(Debug)]
struct Piece {
    start: usize,
    /// Where it comes from.
    place: Range<usize>,
    /// It is there letter for letter.
    is_copy: bool,
}

impl Text {
    /// A text that is in the file as it is.
    pub(crate) fn verbatim(passage: &Passage) -> Self {
        let mut verbatim = Self::default();
        for (text, place) in passage.pieces() {
            verbatim.copy(text, place);
        }
        verbatim
    }

    /// Adds what was made for something at `place`.
    pub(crate) fn push(&mut self, text: &str, place: Range<usize>) {
        self.add(text, place, false);
    }

    /// Adds the text of the file at `place`.
    pub(crate) fn copy(&mut self, text: &str, place: Range<usize>) {
        self.add(text, place, true);
    }

    fn add(&mut self, text: &str, place: Range<usize>, is_copy: bool) {
        self.pieces.push(Piece {
            start: self.body.len(),
            place,
            is_copy,
        });
        self.body.push_str(text);
    }

    /// The place in the file of a place in the text.
    pub(crate) fn place(&self, span: &Range<usize>) -> Range<usize> {
        let next = self
            .pieces
            .partition_point(|piece| piece.start <= span.start);
        let piece = self.pieces.get(next.saturating_sub(1));
        match piece {
            None => 0..0,
            Some(Piece {
                start,
                place,
                is_copy: true,
            }) if *start <= span.start => {
                let begin = (place.start + span.start - start).min(place.end);
                begin..(begin + span.len()).min(place.end)
            }
            Some(piece) => piece.place.clone(),
        }
    }
}
