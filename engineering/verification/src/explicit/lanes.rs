//! The scans of many states at once, each state in a lane of its own: 64 lanes a word.

use std::ops::Range;

use understudy_logic::{Scratch, transpose};

use super::Explicit;

/// Words of one signal, and states that are scanned at once.
pub(super) const WORDS: usize = 8;
pub(super) const LANES: usize = 64 * WORDS;

/// Some states, by their numbers, and their scans.
#[derive(Default)]
pub(super) struct Lanes {
    scratch: Scratch,
    /// x, then the x that each leads to; a signal after the other, as u and y are.
    state: Vec<[u64; WORDS]>,
    pub(super) inputs: Vec<[u64; WORDS]>,
    pub(super) outputs: Vec<[u64; WORDS]>,
    /// The x that each leads to, one after the other.
    next: Vec<u64>,
    states: Range<usize>,
}

/// The outputs of some states.
pub(crate) struct Seen<'a> {
    states: Range<usize>,
    outputs: &'a [[u64; WORDS]],
}

impl Seen<'_> {
    /// The first of them with this output.
    pub(crate) fn first(&self, output: usize) -> Option<usize> {
        first_of(&self.outputs[output], &self.states)
    }
}

/// The first of `states` whose lane is 1; what is past the last is of no account.
pub(super) fn first_of(words: &[u64; WORDS], states: &Range<usize>) -> Option<usize> {
    let (place, word) = words.iter().enumerate().find(|&(_, &word)| word != 0)?;
    let state = states.start + 64 * place + word.trailing_zeros() as usize;
    states.contains(&state).then_some(state)
}

impl Lanes {
    /// Scans `states`, at most [`LANES`]; the first of them is of an x for itself, or has a multiple of [`LANES`] for its number.
    pub(super) fn scan(&mut self, listed: &Explicit, states: Range<usize>) {
        let words = states.len().div_ceil(64);
        self.take_registers(listed, &states, words);
        let inputs = listed.scan.input_count();
        self.inputs.clear();
        self.inputs.extend((0..inputs).map(|input| lanes_of_input(input, states.start)));
        self.outputs.resize(listed.scan.output_count(), [0; WORDS]);
        let scratch = &mut self.scratch;
        listed.scan.step_wide(scratch, &mut self.state, &self.inputs, &mut self.outputs);
        self.next.resize(LANES * listed.width, 0);
        let mut square = [0; 64];
        for (chunk, registers) in self.state.chunks(64).enumerate() {
            for word in 0..words {
                square.fill(0);
                for (row, register) in square.iter_mut().zip(registers) {
                    *row = register[word];
                }
                transpose(&mut square);
                for (lane, row) in square.iter().enumerate() {
                    self.next[(64 * word + lane) * listed.width + chunk] = *row;
                }
            }
        }
        self.states = states;
    }

    /// x of each state, a lane each.
    fn take_registers(&mut self, listed: &Explicit, states: &Range<usize>, words: usize) {
        let count = listed.scan.register_count();
        self.state.resize(count, [0; WORDS]);
        let last = states.end - 1;
        let mut square = [0; 64];
        for (chunk, registers) in self.state.chunks_mut(64).enumerate() {
            for word in 0..words {
                let first = states.start + 64 * word;
                let of = |state: usize| {
                    let x = state.min(last) / listed.ways;
                    listed.registers[x * listed.width + chunk]
                };
                if listed.ways < 64 {
                    for (lane, row) in square.iter_mut().enumerate() {
                        *row = of(first + lane);
                    }
                    transpose(&mut square);
                    for (register, column) in registers.iter_mut().zip(&square) {
                        register[word] = *column;
                    }
                } else {
                    let bits = of(first);
                    for (place, register) in registers.iter_mut().enumerate() {
                        register[word] = (bits >> place & 1).wrapping_neg();
                    }
                }
            }
        }
    }

    /// The x that each leads to, `width` words each.
    pub(super) fn next(&self, width: usize) -> impl Iterator<Item = &[u64]> {
        self.next.chunks(width)
    }

    /// For who looks at every scan.
    pub(super) fn seen(&self) -> Seen<'_> {
        Seen { states: self.states.clone(), outputs: &self.outputs }
    }
}

/// The values of an input in the states from `first` on: bit `input` of their numbers.
fn lanes_of_input(input: usize, first: usize) -> [u64; WORDS] {
    std::array::from_fn(|word| match input {
        0 => 0xaaaa_aaaa_aaaa_aaaa,
        1 => 0xcccc_cccc_cccc_cccc,
        2 => 0xf0f0_f0f0_f0f0_f0f0,
        3 => 0xff00_ff00_ff00_ff00,
        4 => 0xffff_0000_ffff_0000,
        5 => 0xffff_ffff_0000_0000,
        _ => ((first / 64 + word) as u64 >> (input - 6) & 1).wrapping_neg(),
    })
}
