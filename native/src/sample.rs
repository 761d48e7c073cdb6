//! Programs to measure with.

use understudy_logic::{Circuit, CircuitBuilder, Expression};

/// One rung `[ a b | x ] /c d ( x )` of a [`program`]: contacts by the number of their signal, inputs first, then registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rung {
    /// a and b, one after the other.
    pub start: [usize; 2],
    /// c, normally closed.
    pub stop: usize,
    /// d, which every tenth rung does not have.
    pub block: Option<usize>,
}

/// A program of `rungs` rungs with 4.9 contacts each, drawn by `seed`: as many inputs, and as many coils, each sealed in, each fourth an output.
///
/// Contacts are on any signals, so that on random inputs nobody can guess which way power takes.
pub fn rungs(rungs: usize, seed: u64) -> Vec<Rung> {
    let mut state = seed;
    let mut draw = move || {
        // SplitMix64.
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = state;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (mixed ^ (mixed >> 31)) as usize % (2 * rungs)
    };
    (0..rungs)
        .map(|rung| Rung {
            start: [draw(), draw()],
            stop: draw(),
            block: (rung % 10 != 0).then(&mut draw),
        })
        .collect()
}

/// The circuit of [`rungs`], each rung seeing what those above it wrote.
pub fn program(rungs: &[Rung]) -> Circuit {
    let mut builder = CircuitBuilder::new("sample");
    let inputs = (0..rungs.len()).map(|rung| builder.input(format!("u{rung}")));
    let mut present: Vec<Expression> = inputs.collect();
    let mut registers = Vec::with_capacity(rungs.len());
    for rung in 0..rungs.len() {
        let (register, value) = builder.register(format!("x{rung}"), false);
        registers.push(register);
        present.push(value);
    }
    for (place, rung) in rungs.iter().enumerate() {
        let own = rungs.len() + place;
        let graph = builder.graph();
        let start = graph.and(present[rung.start[0]], present[rung.start[1]]);
        let sealed = graph.or(start, present[own]);
        let run = graph.not(present[rung.stop]);
        let mut power = graph.and(sealed, run);
        if let Some(block) = rung.block {
            power = graph.and(power, present[block]);
        }
        present[own] = power;
        builder.set_next(registers[place], power);
        if place % 4 == 0 {
            builder.output(format!("y{place}"), power);
        }
    }
    builder.finish().expect("names are numbered")
}
