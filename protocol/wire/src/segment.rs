//! Parts of a state, each as much as one frame takes.

use serde::{Deserialize, Serialize};

use crate::image::{Image, MAXIMUM_IMAGE_BITS, MAXIMUM_STATE_BITS};
use crate::lineage::Digest;

/// Bits of each segment of a state but the last.
const SEGMENT_BITS: usize = MAXIMUM_IMAGE_BITS;
const SEGMENT_WORDS: usize = SEGMENT_BITS / 64;

/// Maximum number of segments of one state.
pub const MAXIMUM_SEGMENTS: usize = MAXIMUM_STATE_BITS / SEGMENT_BITS;

/// Segments of a state, bit k being segment k.
pub type SegmentMask = u32;

/// One part of a state.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Segment {
    /// Number of bits of the whole state.
    pub width: u32,
    /// Digest of the whole state: segments with equal digests are parts of one state.
    pub whole: Digest,
    /// Place among the segments, from 0.
    pub place: u8,
    /// Its bits.
    pub part: Image,
}

impl Segment {
    /// Number of segments of a state of `width` bits.
    pub fn count(width: usize) -> usize {
        width.div_ceil(SEGMENT_BITS).max(1)
    }

    /// All segments of a state of `width` bits.
    pub fn all(width: usize) -> SegmentMask {
        SegmentMask::MAX >> (MAXIMUM_SEGMENTS.saturating_sub(Self::count(width)))
    }

    /// The segment `place` of a state whose digest is `whole`; `None` past its end.
    pub fn of(state: &Image, whole: Digest, place: usize) -> Option<Self> {
        let width = bits_of(state.width(), place)?;
        let first = place * SEGMENT_WORDS;
        let words = &state.words()[first..first + width.div_ceil(64)];
        Some(Self {
            width: u32::try_from(state.width()).ok()?,
            whole,
            place: u8::try_from(place).ok()?,
            part: Image::from_words(width, words).ok()?,
        })
    }

    /// The only segment of a state that one frame takes.
    ///
    /// # Panics
    /// If `state` is wider than [`MAXIMUM_IMAGE_BITS`].
    pub fn single(state: &Image) -> Self {
        assert!(Self::count(state.width()) == 1, "one frame takes it");
        Self::of(state, Digest::of(state), 0).expect("every state has a first segment")
    }

    /// Whether its place and its width fit the state that it is a part of.
    pub(crate) fn fits(&self) -> bool {
        let width = self.width as usize;
        width <= MAXIMUM_STATE_BITS
            && bits_of(width, usize::from(self.place)) == Some(self.part.width())
    }

    /// Writes its bits to their place in `state`, which has the width of the whole.
    pub fn put(&self, state: &mut Image) {
        let first = usize::from(self.place) * SEGMENT_WORDS;
        let words = self.part.words();
        if let Some(place) = state.words_mut().get_mut(first..first + words.len()) {
            place.copy_from_slice(words);
        }
    }
}

/// Bits of the segment `place` of a state of `width` bits.
fn bits_of(width: usize, place: usize) -> Option<usize> {
    let is_there = place < Segment::count(width);
    is_there.then(|| (width - place * SEGMENT_BITS).min(SEGMENT_BITS))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every state is the sum of its segments, and no other place or width is one.
    #[test]
    fn segments_make_the_state() {
        let edges = [0, 1, 64, SEGMENT_BITS - 1, SEGMENT_BITS, SEGMENT_BITS + 1];
        for width in edges.into_iter().chain([MAXIMUM_STATE_BITS - 63, MAXIMUM_STATE_BITS]) {
            let state = Image::from_bits((0..width).map(|bit| bit % 7 == 0 || bit % 11 == 0));
            let whole = Digest::of(&state);
            let count = Segment::count(width);
            assert_eq!(Segment::all(width).count_ones() as usize, count);
            let mut put = Image::zero(width);
            for place in 0..count {
                let segment = Segment::of(&state, whole, place).expect("it is one");
                assert!(segment.fits());
                segment.put(&mut put);
                let moved = Segment { place: segment.place + 1, ..segment.clone() };
                assert_eq!(
                    moved.fits(),
                    place + 1 < count
                        && moved.part.width() == bits_of(width, place + 1).expect("it is there")
                );
            }
            assert_eq!(put, state);
            assert_eq!(Segment::of(&state, whole, count), None);
        }
        assert_eq!(Segment::count(MAXIMUM_STATE_BITS), MAXIMUM_SEGMENTS);
    }
}
