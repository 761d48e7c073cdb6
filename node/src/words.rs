//! The parity words of a station in one cycle, each with a mask.
//!
//! A controller has one word, y(i) over its own program. An understudy publishes last, so it knows which controllers it
//! has not received. It publishes
//!
//! ```text
//! one word over all programs whose controllers were received      Σ h(j)(x(j), u(j)), (9) when all were received
//! one word for each program whose controller was not received     h(j)(x(j), u(j))
//! ```
//!
//! A controller whose outputs differ from those of the understudy counts as not received: its program gets a word of
//! its own, so that its remote I/O can compare both, and a value fault affects no other program.
//! A program of which it does not know this cycle's output is in no word, instead of spoiling one.

use smallvec::SmallVec;
use understudy_cycle::Mode;
use understudy_wire::{Image, ProgramId, ProgramSet, Word};

/// The word of a controller.
pub fn of_controller(program: ProgramId, outputs: &Image) -> SmallVec<[Word; 2]> {
    smallvec::smallvec![Word { mask: ProgramSet::only(program), sum: outputs.clone() }]
}

/// The masks of the parity words of an understudy that knows the outputs of `known`, in a cluster of the programs `all`,
/// where the controllers of `published` have published the same outputs in this cycle.
pub(crate) fn masks_of_understudy(
    mode: Mode,
    all: ProgramSet,
    known: ProgramSet,
    published: ProgramSet,
) -> SmallVec<[ProgramSet; 2]> {
    let (together, others) = match mode {
        Mode::Full => (known.and(published), known.without(published)),
        Mode::Paper if known == all => (all, ProgramSet::EMPTY),
        Mode::Paper => (ProgramSet::EMPTY, ProgramSet::EMPTY),
    };
    let first = (!together.is_empty()).then_some(together);
    let others = others.iter().map(ProgramSet::only);
    first.into_iter().chain(others).collect()
}

/// The parity words of an understudy, as sums of the outputs that `outputs_of` returns for the programs of `known`.
pub fn of_understudy<'a>(
    mode: Mode,
    all: ProgramSet,
    known: ProgramSet,
    published: ProgramSet,
    outputs_of: impl Fn(ProgramId) -> Option<&'a Image>,
) -> SmallVec<[Word; 2]> {
    let masks = masks_of_understudy(mode, all, known, published).into_iter();
    masks.filter_map(|mask| understudy_parity::sum(mask, &outputs_of)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every cluster of three programs: whichever controllers are not received, the words and the turns give every
    /// known output.
    #[test]
    fn no_erasure_spoils_a_word() {
        let outputs: Vec<Image> = [0b101_u64, 0b11, 0b1]
            .iter()
            .zip([3, 2, 1])
            .map(|(&word, width)| Image::from_words(width, &[word]).expect("fits"))
            .collect();
        let all = ProgramSet::first(3);
        for known in (0..8).map(ProgramSet::from_bits) {
            for published in (0..8).map(ProgramSet::from_bits) {
                let of = |program: ProgramId| outputs.get(program.index());
                let words = of_understudy(Mode::Full, all, known, published, of);
                let mut covered = ProgramSet::EMPTY;
                for word in &words {
                    assert!(covered.and(word.mask).is_empty());
                    covered = covered.or(word.mask);
                    let alone = word.mask.len() == 1;
                    assert!(alone || word.mask.without(published).is_empty());
                    let expected = word
                        .mask
                        .iter()
                        .fold(0, |sum, program| sum ^ outputs[program.index()].words()[0]);
                    assert_eq!(word.sum.words(), [expected]);
                }
                assert_eq!(covered, known);
                let paper = of_understudy(Mode::Paper, all, known, published, of);
                assert_eq!(paper.len(), usize::from(known == all));
            }
        }
    }
}
