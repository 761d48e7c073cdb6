//! How large rungs are, and which are larger than a target takes.

use understudy_text::Diagnostic;

use crate::program::{Element, Program, Rung};

impl Rung {
    /// How many elements stand one behind the other, and how many lines below each other, without the coils.
    pub fn size(&self) -> (usize, usize) {
        size(&self.network)
    }
}

/// The size of a network: the sum of its elements by the largest of them, and of branches the widest by the sum.
fn size(series: &[Element]) -> (usize, usize) {
    series.iter().fold((0, 1), |(across, down), element| {
        let (wide, high) = match element {
            Element::Branches(branches) => branches.iter().fold((0, 0), |(wide, high), branch| {
                let (of_it, lines) = size(branch);
                (wide.max(of_it), high + lines)
            }),
            Element::Contact(_) | Element::Comparison(_) | Element::Block(_) => (1, 1),
        };
        (across + wide, down.max(high))
    })
}

impl Program {
    /// Warnings of the rungs that are larger than a target takes (U0157).
    pub fn size_warnings(&self, across: usize, down: usize) -> Vec<Diagnostic> {
        let numbered = self.rungs.iter().zip(1..);
        let large = numbered.filter_map(|(rung, number)| {
            let (wide, high) = rung.size();
            let place = rung.coils.first().map_or(0..0, |coil| coil.target.span());
            let message = format!(
                "rung {number} has {wide} elements across and {high} lines down, and the target takes {across} and {down}"
            );
            (wide > across || high > down).then(|| {
                Diagnostic::warning("U0157", message, place)
                    .with_help("put a part of it into a memory bit on a rung above")
            })
        });
        large.collect()
    }
}
