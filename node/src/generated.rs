//! The generated parity controller in an understudy: y(N+1) of `mode = "paper"`.
//!
//! ```text
//! x(N+1)(t) = [x(1)(t), .., x(N)(t)]                         states of the replicas before their last step
//! u(N+1)(t) = [u(1)(t), .., u(N)(t)]                         samples of that step
//! y(N+1)(t) = h(N+1)(x(N+1)(t), u(N+1)(t))                   (8)
//! ```
//!
//! Samples arrive, are replayed and become void program by program, and a state is transferred program by program. So
//! the replicas hold x(N+1) from cycle to cycle, and the generated circuit is evaluated on it in each turn.

use understudy_executable::{Executable, Scratch};
use understudy_wire::Image;

use crate::replica::Stepped;

/// y(N+1) of one cycle, where `steps` are the last steps of all replicas in the order of programs.
///
/// `None` where they are not the steps of all programs of `generated`.
pub(crate) fn outputs<'a>(
    generated: &Executable,
    scratch: &mut Scratch,
    steps: impl Iterator<Item = &'a Stepped>,
) -> Option<Image> {
    let (mut state, mut inputs) = (Packed::default(), Packed::default());
    for step in steps {
        state.append(&step.state);
        inputs.append(&step.inputs);
    }
    if state.width != generated.state_count() || inputs.width != generated.input_count() {
        return None;
    }
    let mut outputs = Image::zero(generated.output_count());
    generated.step(scratch, &mut state.words, &inputs.words, outputs.words_mut());
    Some(outputs)
}

/// A concatenation of images, which may be wider than one image.
#[derive(Debug, Default)]
struct Packed {
    width: usize,
    words: Vec<u64>,
}

impl Packed {
    fn append(&mut self, image: &Image) {
        let end = self.width + image.width();
        self.words.resize(end.div_ceil(64), 0);
        for (place, _) in (self.width..).zip(image.bits()).filter(|&(_, bit)| bit) {
            self.words[place / 64] |= 1 << (place % 64);
        }
        self.width = end;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_are_joined_bit_by_bit() {
        let widths = [0, 1, 63, 64, 65, 3];
        let image = |width| Image::from_bits((0..width).map(|bit| bit % 3 == 1));
        let mut packed = Packed::default();
        let mut expected = Vec::new();
        for width in widths {
            packed.append(&image(width));
            expected.extend(image(width).bits());
        }
        assert_eq!(packed.width, expected.len());
        let whole = Image::from_words(packed.width, &packed.words).expect("no bit past the width");
        assert_eq!(whole, Image::from_bits(expected));
    }
}
