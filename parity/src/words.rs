//! The arithmetic of outputs: sums over GF(2) of packed words, (10) and (12).
//!
//! Outputs are packed, bit k of word k / 64 being y(k+1). They may be of unequal width: what an output lacks counts as 0,
//! as in (9). Nothing here tells *which* output is missing; the caller knows (an erasure), and two at once are refused.

/// Sum over GF(2) of any number of packed outputs; as wide as the widest.
pub fn sum<'a>(outputs: impl IntoIterator<Item = &'a [u64]>) -> Vec<u64> {
    let mut total = Vec::new();
    for output in outputs {
        add(&mut total, output);
    }
    total
}

/// The syndrome of a cycle, the left side of (10): all of y(1)..y(N), y(N+1).
///
/// All words are 0 when nothing is wrong (Theorem 1). Where a bit is 1, an odd number of outputs is wrong in that bit.
pub fn syndrome<'a>(outputs: impl IntoIterator<Item = &'a [u64]>) -> Vec<u64> {
    sum(outputs)
}

/// Why a reconstruction is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ErasureError {
    /// One sum carries one missing output, not two.
    #[error(
        "U0404: the outputs {wanted} and {other} are both missing, and one parity word carries one"
    )]
    Two {
        /// 0-based place of the output to be reconstructed.
        wanted: usize,
        /// 0-based place of the other.
        other: usize,
    },
    /// The word says nothing about the output.
    #[error("U0405: the parity word does not contain the output {wanted}")]
    NotMember {
        /// 0-based place of the output to be reconstructed.
        wanted: usize,
    },
}

/// The estimated output of Theorem 2, packed and `width` bits wide:
///
/// ```text
/// ŷ(i) = (1 - θ(i)) y(i) + θ(i) Σ(j≠i) y(j)         (12)
/// ```
///
/// `outputs` are y(1)..y(N+1), `None` where θ = 1.
///
/// # Errors
/// θ(i) = 1 and some other θ(j) = 1: no sum is left that holds y(i) alone.
///
/// # Panics
/// If there is no output number `wanted`.
pub fn estimate(
    outputs: &[Option<&[u64]>],
    wanted: usize,
    width: usize,
) -> Result<Vec<u64>, ErasureError> {
    let estimated = match outputs[wanted] {
        Some(output) => output.to_vec(),
        None => {
            let missing = |&place: &usize| -> bool { place != wanted && outputs[place].is_none() };
            if let Some(other) = (0..outputs.len()).find(missing) {
                return Err(ErasureError::Two { wanted, other });
            }
            sum(outputs.iter().copied().flatten())
        }
    };
    Ok(truncate(estimated, width))
}

/// A sum of the outputs of some programs, with the mask that names them.
///
/// The paper's y(N+1) is the word over all N. A program whose output is not known is left out of the mask instead of spoiling
/// the word.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ParityWord {
    /// For each program, whether it is in the sum; absent programs are not.
    pub members: Vec<bool>,
    /// Sum over the members of h(j)(x(j), u(j)), packed.
    pub sum: Vec<u64>,
}

impl ParityWord {
    /// The word over those of `outputs`, y(1)..y(N), that are known.
    pub fn over(outputs: &[Option<&[u64]>]) -> Self {
        Self {
            members: outputs.iter().map(Option::is_some).collect(),
            sum: sum(outputs.iter().copied().flatten()),
        }
    }

    /// y(`wanted`), packed and `width` bits wide: this word plus the outputs of all its other members.
    ///
    /// `outputs` are y(1)..y(N), `None` where missing; that of `wanted` is not used.
    ///
    /// # Errors
    /// The output is not in the word, or another member's output is missing.
    pub fn reconstruct(
        &self,
        outputs: &[Option<&[u64]>],
        wanted: usize,
        width: usize,
    ) -> Result<Vec<u64>, ErasureError> {
        if !self.members.get(wanted).copied().unwrap_or(false) {
            return Err(ErasureError::NotMember { wanted });
        }
        let mut total = self.sum.clone();
        for (place, _) in self.members.iter().enumerate().filter(|member| *member.1) {
            if place == wanted {
                continue;
            }
            match outputs.get(place).copied().flatten() {
                Some(output) => add(&mut total, output),
                None => {
                    return Err(ErasureError::Two {
                        wanted,
                        other: place,
                    });
                }
            }
        }
        Ok(truncate(total, width))
    }
}

fn add(total: &mut Vec<u64>, output: &[u64]) {
    total.resize(total.len().max(output.len()), 0);
    for (word, &addend) in total.iter_mut().zip(output) {
        *word ^= addend;
    }
}

/// Bits past `width` belong to wider programs, and cancel when nothing is wrong; they are not this one's to have.
fn truncate(mut image: Vec<u64>, width: usize) -> Vec<u64> {
    image.resize(width.div_ceil(64), 0);
    if let (Some(last), rest @ 1..) = (image.last_mut(), width % 64) {
        *last &= (1 << rest) - 1;
    }
    image
}
