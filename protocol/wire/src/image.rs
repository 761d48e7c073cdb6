//! Bit vectors of a fixed width: u(i), x(i) and y(i).
//!
//! Invariant: there are exactly as many words as the width needs, and the bits past the width are 0; so equal images
//! have equal words, and words of unequal width can be added as if the absent high bits were 0 (as (9) does).

use std::fmt;

use serde::{Deserialize, Serialize};
use smallvec::SmallVec;

/// Maximum number of bits of an image that is sent as it is: it fits into one frame.
pub const MAXIMUM_IMAGE_BITS: usize = 64 * 1024;

/// Maximum number of bits of a state, 256 KiB; a wide one is sent in segments.
pub const MAXIMUM_STATE_BITS: usize = 32 * MAXIMUM_IMAGE_BITS;

/// Bit k of word k / 64 is element k + 1 of the vector.
#[derive(PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(try_from = "RawImage", into = "RawImage")]
pub struct Image {
    width: u32,
    words: SmallVec<[u64; 2]>,
}

/// An image as it is sent, before it is checked.
#[derive(Serialize, Deserialize)]
struct RawImage {
    width: u32,
    words: SmallVec<[u64; 2]>,
}

/// Reason why bits are not an image.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ImageError {
    /// Wider than [`MAXIMUM_STATE_BITS`].
    #[error("an image of {width} bits is wider than {MAXIMUM_STATE_BITS}")]
    TooWide {
        /// Requested width.
        width: usize,
    },
    /// Words that do not fit the width, or bits that are set past it.
    #[error("{words} words are no image of {width} bits")]
    Malformed {
        /// Width in the frame.
        width: usize,
        /// Number of words in the frame.
        words: usize,
    },
}

impl Image {
    /// An image whose bits are all 0.
    ///
    /// # Panics
    /// If wider than [`MAXIMUM_STATE_BITS`]; widths are checked where a cluster is configured.
    pub fn zero(width: usize) -> Self {
        assert!(width <= MAXIMUM_STATE_BITS, "an image of {width} bits");
        Self { width: width as u32, words: SmallVec::from_elem(0, width.div_ceil(64)) }
    }

    /// An image from packed words, bit k of word k / 64 being element k + 1.
    pub fn from_words(width: usize, words: &[u64]) -> Result<Self, ImageError> {
        if width > MAXIMUM_STATE_BITS {
            return Err(ImageError::TooWide { width });
        }
        let unused = if width.is_multiple_of(64) { 0 } else { u64::MAX << (width % 64) };
        if words.len() != width.div_ceil(64) || words.last().is_some_and(|last| last & unused != 0)
        {
            return Err(ImageError::Malformed { width, words: words.len() });
        }
        Ok(Self { width: width as u32, words: SmallVec::from_slice(words) })
    }

    /// An image from its bits in order.
    ///
    /// # Panics
    /// If there are more than [`MAXIMUM_STATE_BITS`].
    pub fn from_bits(bits: impl IntoIterator<Item = bool>) -> Self {
        let bits: SmallVec<[bool; 64]> = bits.into_iter().collect();
        let mut image = Self::zero(bits.len());
        for (index, bit) in bits.into_iter().enumerate() {
            image.set(index, bit);
        }
        image
    }

    /// Number of bits.
    pub fn width(&self) -> usize {
        self.width as usize
    }

    /// Packed words.
    pub fn words(&self) -> &[u64] {
        &self.words
    }

    /// Packed words for a writer that keeps the bits past the width at 0, as the step of a circuit does.
    pub fn words_mut(&mut self) -> &mut [u64] {
        &mut self.words
    }

    /// Element `index` + 1; false past the width.
    pub fn get(&self, index: usize) -> bool {
        index < self.width() && self.words[index / 64] >> (index % 64) & 1 == 1
    }

    /// Sets element `index` + 1.
    ///
    /// # Panics
    /// If `index` is not below the width.
    pub fn set(&mut self, index: usize, bit: bool) {
        assert!(index < self.width(), "bit {index} of {} bits", self.width);
        let mask = 1 << (index % 64);
        if bit {
            self.words[index / 64] |= mask;
        } else {
            self.words[index / 64] &= !mask;
        }
    }

    /// The bits in order.
    pub fn bits(&self) -> impl ExactSizeIterator<Item = bool> + '_ {
        (0..self.width()).map(|index| self.get(index))
    }

    /// Adds `other` over GF(2); absent high bits count as 0, and the wider width is kept.
    pub fn add(&mut self, other: &Self) {
        if other.width > self.width {
            self.words.resize(other.words.len(), 0);
            self.width = other.width;
        }
        for (word, other) in self.words.iter_mut().zip(&other.words) {
            *word ^= other;
        }
    }

    /// Sets the bits that `other` has, of an image of this width.
    pub fn unite(&mut self, other: &Self) {
        for (word, other) in self.words.iter_mut().zip(&other.words) {
            *word |= other;
        }
    }

    /// The first `width` bits, if those past them are 0: the inverse of the padding in (9).
    #[must_use]
    pub fn narrowed(&self, width: usize) -> Option<Self> {
        let needed = width.div_ceil(64);
        if width >= self.width() || self.words[needed..].iter().any(|&word| word != 0) {
            return (width == self.width()).then(|| self.clone());
        }
        Self::from_words(width, &self.words[..needed]).ok()
    }

    /// Whether every bit is 0, as in the syndrome of consistent outputs.
    pub fn is_zero(&self) -> bool {
        self.words.iter().all(|&word| word == 0)
    }
}

/// All words at once: every frame and every report has images in it, and a derived copy goes word by word.
impl Clone for Image {
    #[inline]
    fn clone(&self) -> Self {
        Self { width: self.width, words: SmallVec::from_slice(&self.words) }
    }

    fn clone_from(&mut self, other: &Self) {
        self.width = other.width;
        self.words.clear();
        self.words.extend_from_slice(&other.words);
    }
}

impl TryFrom<RawImage> for Image {
    type Error = ImageError;

    fn try_from(raw: RawImage) -> Result<Self, ImageError> {
        Self::from_words(raw.width as usize, &raw.words)
    }
}

impl From<Image> for RawImage {
    fn from(image: Image) -> Self {
        Self { width: image.width, words: image.words }
    }
}

/// As the paper writes vectors: element 1 first.
impl fmt::Display for Image {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for bit in self.bits() {
            formatter.write_str(if bit { "1" } else { "0" })?;
        }
        Ok(())
    }
}

impl fmt::Debug for Image {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{self}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_past_the_width_are_refused() {
        assert!(Image::from_words(3, &[0b111]).is_ok());
        assert!(Image::from_words(3, &[0b1000]).is_err());
        assert!(Image::from_words(64, &[u64::MAX]).is_ok());
        assert!(Image::from_words(65, &[u64::MAX]).is_err());
        assert!(Image::from_words(0, &[]).is_ok());
        assert!(Image::from_words(MAXIMUM_STATE_BITS + 1, &[]).is_err());
    }

    /// Every pair of images of up to four bits against addition bit by bit.
    #[test]
    fn addition_pads_with_zeros() {
        let every =
            || (0..=4_usize).flat_map(|width| (0..1_u64 << width).map(move |word| (width, word)));
        for (left_width, left) in every() {
            for (right_width, right) in every() {
                let image = |width, word: u64| {
                    Image::from_bits((0..width).map(move |bit| word >> bit & 1 == 1))
                };
                let mut sum = image(left_width, left);
                sum.add(&image(right_width, right));
                assert_eq!(sum, image(left_width.max(right_width), left ^ right));
                let back = sum.narrowed(left_width);
                assert_eq!(back.is_some(), (left ^ right) >> left_width == 0);
            }
        }
    }

    #[test]
    fn a_copy_is_equal_whatever_it_replaces() {
        let of_width = |width| Image::from_bits((0..width).map(|bit| bit % 3 == 0));
        let widths = [0, 1, 64, 65, 128, 129, 500];
        for image in widths.map(of_width) {
            assert_eq!(image.clone(), image);
            for mut other in widths.map(of_width) {
                other.clone_from(&image);
                assert_eq!(other, image);
            }
        }
    }

    #[test]
    fn an_image_reads_as_the_paper_writes_it() {
        let mut image = Image::zero(5);
        image.set(0, true);
        image.set(3, true);
        assert_eq!(image.to_string(), "10010");
        assert!(!image.get(77));
    }
}
