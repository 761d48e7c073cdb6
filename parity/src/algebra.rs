//! The algebra of outputs over GF(2): the sum (9), the syndrome (10) and the reconstruction (12).
//!
//! ```text
//!   y(N+1) = y(1) + y(2) + .. + y(N)                      (9)   `sum`
//!   0      = y(1) + .. + y(N) + y(N+1)                    (10)  `syndrome`, Theorem 1
//!   ŷ(i)   = (1 - θ(i)) y(i) + θ(i) Σ(j≠i) y(j)           (12)  `reconstruct` where θ(i) = 1, Theorem 2
//! ```
//!
//! The paper's sums cover all N programs. Here each sum covers the programs of its mask, so a program whose output is not
//! known is left out of a parity word instead of spoiling it. Outputs may have different widths: absent high bits count as 0.
//!
//! Nothing here decides which output is missing, nor whether two outputs belong to the same states: the caller does, with
//! `output_of`, which answers only for outputs that may be added. Stations and remote I/Os compute with these functions
//! alone, and the tests of Theorems 1 and 2 hold them.

use understudy_wire::{Image, ProgramId, ProgramSet, Word};

/// Reason why an output cannot be reconstructed from a parity word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ErasureError {
    /// The output of another member of the mask is missing as well.
    #[error(
        "U0404: the outputs {} and {} are both missing, and one parity word carries one",
        wanted.0,
        other.0
    )]
    Two {
        /// Program whose output is to be reconstructed.
        wanted: ProgramId,
        /// Other program without an output.
        other: ProgramId,
    },
    /// The mask of the parity word does not contain the program.
    #[error("U0405: the parity word does not contain the output {}", wanted.0)]
    NotMember {
        /// Program whose output is to be reconstructed.
        wanted: ProgramId,
    },
    /// The sum has a 1 past the width of the output, or is narrower: some output in it is faulty.
    #[error("U0406: the sum for the output {} does not fit its {width} bits", wanted.0)]
    Width {
        /// Program whose output is to be reconstructed.
        wanted: ProgramId,
        /// Width of its output, in bits.
        width: usize,
    },
}

/// Parity word over the programs of `mask`: y(N+1) of (9) where `mask` is every program.
///
/// `None` where an output of the mask is not known.
pub fn sum<'a>(
    mask: ProgramSet,
    output_of: impl Fn(ProgramId) -> Option<&'a Image>,
) -> Option<Word> {
    let mut sum = Image::default();
    add_all(&mut sum, mask, output_of).ok()?;
    Some(Word { mask, sum })
}

/// Syndrome (10) of a parity word: its sum plus the outputs of all members of its mask.
///
/// It is 0 when nothing is wrong (Theorem 1). Where a bit is 1, an odd number of the outputs and the word is wrong in that bit.
/// `None` where an output of the mask is missing.
pub fn syndrome<'a>(
    word: &Word,
    output_of: impl Fn(ProgramId) -> Option<&'a Image>,
) -> Option<Image> {
    let mut sum = word.sum.clone();
    add_all(&mut sum, word.mask, output_of).ok()?;
    Some(sum)
}

/// Output of the program `wanted`, `width` bits wide, by (12) with θ = 1: the sum of a parity word plus the outputs of all other
/// members of its mask. An output of `wanted` itself is not asked for.
///
/// # Errors
/// The word does not contain the output, the output of another member is missing, or the sum does not fit `width` bits, as a sum
/// of true outputs does.
pub fn reconstruct<'a>(
    word: &Word,
    wanted: ProgramId,
    width: usize,
    output_of: impl Fn(ProgramId) -> Option<&'a Image>,
) -> Result<Image, ErasureError> {
    if !word.mask.contains(wanted) {
        return Err(ErasureError::NotMember { wanted });
    }
    let others = word.mask.without(ProgramSet::only(wanted));
    let mut sum = word.sum.clone();
    add_all(&mut sum, others, output_of).map_err(|other| ErasureError::Two { wanted, other })?;
    sum.narrowed(width).ok_or(ErasureError::Width { wanted, width })
}

/// Adds the outputs of all programs of `mask`, or names the first that has none.
fn add_all<'a>(
    sum: &mut Image,
    mask: ProgramSet,
    output_of: impl Fn(ProgramId) -> Option<&'a Image>,
) -> Result<(), ProgramId> {
    for program in mask.iter() {
        sum.add(output_of(program).ok_or(program)?);
    }
    Ok(())
}
