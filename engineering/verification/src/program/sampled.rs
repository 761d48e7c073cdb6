//! Many runs at random, before anything is proved: what is seen there can happen, and needs no proof that it can.

use std::array;

use understudy_logic::{Circuit, Random, Scan, Scratch};

use crate::property::Formula;
use crate::symbolic::{Resolved, Signal};

/// Scans of each of the 64 runs.
const SCANS: usize = 256;

/// Where something was seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Seen {
    scan: usize,
    run: usize,
}

/// 64 runs from the start.
pub(super) struct Sampled {
    inputs: Vec<Vec<[u64; 1]>>,
    /// For each question the first scan in which it was so.
    seen: Vec<Option<Seen>>,
}

impl Sampled {
    /// Looks in every scan whether `questions`, each of one scan, hold.
    pub(super) fn new(circuit: &Circuit, questions: &[Resolved]) -> Self {
        let scan = Scan::new(circuit);
        let mut scratch = Scratch::default();
        let initial = circuit.registers().iter();
        let mut state: Vec<[u64; 1]> =
            initial.map(|register| [u64::from(register.initial).wrapping_neg()]).collect();
        let mut outputs = vec![[0]; scan.output_count()];
        let mut inputs = vec![[0]; scan.input_count()];
        let mut seen = vec![None; questions.len()];
        let mut rows = Vec::with_capacity(SCANS);
        let mut random = Random(1);
        let mut open = questions.len();
        for number in 0..SCANS {
            if open == 0 {
                break;
            }
            for [input] in &mut inputs {
                *input ^= flips(&mut random);
            }
            scan.step_wide(&mut scratch, &mut state, &inputs, &mut outputs);
            rows.push(inputs.clone());
            for (question, seen) in questions.iter().zip(&mut seen) {
                if seen.is_none() {
                    let [runs] = words(question, &outputs, &inputs);
                    *seen = (runs != 0)
                        .then(|| Seen { scan: number, run: runs.trailing_zeros() as usize });
                    open -= usize::from(seen.is_some());
                }
            }
        }
        Self { inputs: rows, seen }
    }

    /// Where the question of this number was so.
    pub(super) fn seen(&self, question: usize) -> Option<Seen> {
        self.seen[question]
    }

    /// The inputs of the run, from its start to that scan.
    pub(super) fn inputs(&self, seen: Seen) -> Vec<Vec<bool>> {
        let rows = self.inputs[..=seen.scan].iter();
        let bit = |[word]: &[u64; 1]| word >> seen.run & 1 == 1;
        rows.map(|row| row.iter().map(bit).collect()).collect()
    }
}

/// Which runs an input changes in: half of them every second scan, others every eighth, others every thirty-second, as timers need it.
fn flips(random: &mut Random) -> u64 {
    let mut draw = || random.number();
    let often = draw();
    let seldom = often & draw() & draw();
    let rarely = seldom & draw() & draw();
    often & 0xffff_ffff | seldom & 0xffff << 32 | rarely & 0xffff << 48
}

/// In which runs the formula holds; what speaks of more than one scan holds in none.
pub(crate) fn words<const W: usize>(
    formula: &Resolved,
    outputs: &[[u64; W]],
    inputs: &[[u64; W]],
) -> [u64; W] {
    let of = |formula: &Resolved| words(formula, outputs, inputs);
    let joined = |left: &Resolved, right: &Resolved, join: fn(u64, u64) -> u64| {
        let (left, right) = (of(left), of(right));
        array::from_fn(|word| join(left[word], right[word]))
    };
    match formula {
        Formula::Constant(value) => [u64::from(*value).wrapping_neg(); W],
        Formula::Signal(Signal::Output(output)) => outputs[*output],
        Formula::Signal(Signal::Input(input)) => inputs[*input],
        Formula::Not(inner) => of(inner).map(|word| !word),
        Formula::And(left, right) => joined(left, right, |left, right| left & right),
        Formula::Or(left, right) => joined(left, right, |left, right| left | right),
        Formula::Implies(left, right) => joined(left, right, |left, right| !left | right),
        Formula::Same(left, right) => joined(left, right, |left, right| !(left ^ right)),
        _ => [0; W],
    }
}
