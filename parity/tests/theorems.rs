//! Theorems 1 and 2 on random programs of any widths, with every pattern of erasures.

#[path = "../../programs/logic/tests/common/mod.rs"]
mod common;

use common::{Recipe, circuit, configuration, recipe};
use proptest::prelude::*;
use understudy_logic::{Circuit, Scan, Scratch};
use understudy_parity::words::{self, ErasureError, ParityWord};
use understudy_parity::{ParityController, ParityError, generate};

/// One cycle of all stations: y(1)..y(N+1).
struct Cluster {
    members: Vec<(Scan, Vec<u64>)>,
    parity: (Scan, Vec<u64>),
    scratch: Scratch,
}

impl Cluster {
    fn new(circuits: &[Circuit], generated: &ParityController) -> Self {
        let start = |circuit: &Circuit| {
            let scan = Scan::new(circuit);
            let state = scan.initial().to_vec();
            (scan, state)
        };
        Self {
            members: circuits.iter().map(start).collect(),
            parity: start(generated.circuit()),
            scratch: Scratch::default(),
        }
    }

    /// All inputs come from the bits of `sample`, program by program.
    fn step(&mut self, sample: u64) -> Vec<Vec<u64>> {
        let mut shift = 0;
        let mut outputs = Vec::new();
        for (scan, state) in &mut self.members {
            let inputs = sample >> shift & ((1 << scan.input_count()) - 1);
            shift += scan.input_count();
            outputs.push(step(scan, &mut self.scratch, state, inputs));
        }
        let (scan, state) = &mut self.parity;
        let inputs = sample & ((1 << shift) - 1);
        outputs.push(step(scan, &mut self.scratch, state, inputs));
        outputs
    }
}

fn step(scan: &Scan, scratch: &mut Scratch, state: &mut [u64], inputs: u64) -> Vec<u64> {
    let mut outputs = vec![0; scan.output_count().div_ceil(64)];
    scan.step(scratch, state, &[inputs], &mut outputs);
    outputs
}

fn named(recipes: &[Recipe]) -> Vec<Circuit> {
    let numbered = recipes.iter().enumerate();
    numbered
        .map(|(number, recipe)| circuit(&format!("p{number}"), recipe))
        .collect()
}

/// Theorem 1, Theorem 2, and what is refused, for the outputs of one cycle.
fn check(outputs: &[Vec<u64>], widths: &[usize]) {
    let syndrome = words::syndrome(outputs.iter().map(Vec::as_slice));
    assert!(syndrome.iter().all(|&word| word == 0), "Theorem 1");
    let programs = widths.len();
    for erased in 0..1_u32 << outputs.len() {
        let present = |place: usize| erased >> place & 1 == 0;
        let heard: Vec<Option<&[u64]>> = outputs
            .iter()
            .enumerate()
            .map(|(place, output)| present(place).then_some(output.as_slice()))
            .collect();
        for (wanted, &width) in widths.iter().enumerate() {
            let estimated = words::estimate(&heard, wanted, width);
            if present(wanted) || erased.count_ones() == 1 {
                assert_eq!(estimated.as_ref(), Ok(&outputs[wanted]), "Theorem 2");
            } else {
                assert!(matches!(estimated, Err(ErasureError::Two { .. })));
            }
        }
        // A word over those that `erased` leaves brings back each of them, and nothing else.
        let word = ParityWord::over(&heard[..programs]);
        let all: Vec<Option<&[u64]>> = outputs[..programs]
            .iter()
            .map(|y| Some(y.as_slice()))
            .collect();
        for (wanted, &width) in widths.iter().enumerate() {
            let mut others = all.clone();
            others[wanted] = None;
            let restored = word.reconstruct(&others, wanted, width);
            if present(wanted) {
                assert_eq!(restored.as_ref(), Ok(&outputs[wanted]));
            } else {
                assert_eq!(restored, Err(ErasureError::NotMember { wanted }));
            }
        }
    }
}

proptest! {
    #![proptest_config(configuration(60))]

    #[test]
    fn theorems_hold_for_random_programs(
        recipes in prop::collection::vec(recipe(), 1..5),
        samples in prop::collection::vec(any::<u64>(), 8),
    ) {
        let circuits = named(&recipes);
        let generated = generate(&circuits).expect("names are numbered");
        let widths: Vec<usize> = circuits.iter().map(|circuit| circuit.outputs().len()).collect();
        prop_assert_eq!(Some(&generated.circuit().outputs().len()), widths.iter().max());
        let mut cluster = Cluster::new(&circuits, &generated);
        for sample in samples {
            check(&cluster.step(sample), &widths);
        }
        // x(N+1) is the members' states, one after another.
        let bit = |words: &[u64], place: usize| words[place / 64] >> (place % 64) & 1;
        for ((_, state), member) in cluster.members.iter().zip(generated.summands()) {
            for (own, place) in member.registers.clone().enumerate() {
                prop_assert_eq!(bit(&cluster.parity.1, place), bit(state, own));
            }
        }
    }
}

/// Outputs of unequal width, wider than a word.
#[test]
fn wide_outputs_are_cut_to_their_own_width() {
    let narrow = vec![0b101];
    let wide = vec![u64::MAX, 0b11];
    let parity = words::sum([narrow.as_slice(), wide.as_slice()]);
    check(&[narrow, wide, parity], &[3, 66]);
}

#[test]
fn what_cannot_be_told_apart_is_refused() {
    let empty = |name: &str| {
        let mut builder = understudy_logic::CircuitBuilder::new(name);
        builder.input("b.c");
        builder.finish().expect("one input")
    };
    let none: [Circuit; 0] = [];
    assert_eq!(generate(&none).err(), Some(ParityError::NoPrograms));
    let twice = generate(&[empty("a"), empty("d"), empty("a")]).expect_err("named twice");
    assert_eq!(
        twice.to_string(),
        "U0402: the programs 1 and 3 are both named `a`; give each program its own name"
    );
    let mut builder = understudy_logic::CircuitBuilder::new("a.b");
    builder.input("c");
    let other = builder.finish().expect("one input");
    let joined = generate(&[empty("a"), other]).expect_err("a.b.c twice");
    assert_eq!(joined.code(), "U0403");
}
