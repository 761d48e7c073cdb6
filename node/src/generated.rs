//! The generated parity controller in an understudy: y(N+1) of `mode = "paper"`.
//!
//! ```text
//! x(N+1)(t) = [x(1)(t), .., x(N)(t)]                         states of the replicas before their last step
//! u(N+1)(t) = [u(1)(t), .., u(N)(t)]                         samples of that step
//! y(N+1)(t) = h(N+1)(x(N+1)(t), u(N+1)(t))                   (8)
//! ```
//!
//! Samples arrive, are replayed and become void program by program, and a state is transferred program by program. So
//! the replicas hold x(N+1) from cycle to cycle, and the generated circuit is evaluated on it in each turn. What a replica keeps for a changed program
//! alone stands behind x(i), and is no part of x(N+1).

use understudy_executable::{Executable, Scratch};
use understudy_wire::Image;

use crate::replica::Stepped;

/// A generated parity controller.
#[derive(Debug, Clone)]
pub struct Generated {
    /// Its circuit.
    pub executable: Executable,
    /// For each program the number of bits of x(i), the first ones of its state.
    pub widths: Vec<usize>,
}

impl Generated {
    /// y(N+1) of one cycle, where `steps` are the last steps of all replicas in the order of programs.
    ///
    /// `None` where they are not the steps of all its programs.
    pub(crate) fn outputs<'a>(
        &self,
        scratch: &mut Scratch,
        steps: impl ExactSizeIterator<Item = &'a Stepped>,
    ) -> Option<Image> {
        let Self { executable, widths } = self;
        let (mut state, mut inputs) = (Packed::default(), Packed::default());
        let are_all = steps.len() == widths.len();
        for (step, &width) in steps.zip(widths) {
            state.append(&step.state, width);
            inputs.append(&step.inputs, step.inputs.width());
        }
        let fits =
            state.width == executable.state_count() && inputs.width == executable.input_count();
        if !are_all || !fits {
            return None;
        }
        let mut outputs = Image::zero(executable.output_count());
        executable.step(scratch, &mut state.words, &inputs.words, outputs.words_mut());
        Some(outputs)
    }
}

/// A concatenation of images, which may be wider than one image.
#[derive(Debug, Default)]
struct Packed {
    width: usize,
    words: Vec<u64>,
}

impl Packed {
    /// Appends the first bits of an image.
    fn append(&mut self, image: &Image, width: usize) {
        let end = self.width + width.min(image.width());
        self.words.resize(end.div_ceil(64), 0);
        for (place, _) in (self.width..end).zip(image.bits()).filter(|&(_, bit)| bit) {
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
            packed.append(&image(width), width);
            expected.extend(image(width).bits());
            packed.append(&image(width), width / 2);
            expected.extend(image(width).bits().take(width / 2));
        }
        assert_eq!(packed.width, expected.len());
        let whole = Image::from_words(packed.width, &packed.words).expect("no bit past the width");
        assert_eq!(whole, Image::from_bits(expected));
    }
}
