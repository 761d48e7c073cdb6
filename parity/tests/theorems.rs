//! Theorems 1 and 2 on random programs of any widths, with every pattern of erasures.

#[path = "../../programs/logic/tests/common/mod.rs"]
mod common;

use common::{Recipe, circuit, configuration, recipe};
use proptest::prelude::*;
use understudy_logic::{Circuit, Scan, Scratch};
use understudy_parity::{
    ErasureError, ParityController, ParityError, generate, reconstruct, sum, syndrome,
};
use understudy_wire::{Image, ProgramId, ProgramSet, Word};

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
    fn step(&mut self, sample: u64) -> Vec<Image> {
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

fn step(scan: &Scan, scratch: &mut Scratch, state: &mut [u64], inputs: u64) -> Image {
    let mut outputs = Image::zero(scan.output_count());
    scan.step(scratch, state, &[inputs], outputs.words_mut());
    outputs
}

fn named(recipes: &[Recipe]) -> Vec<Circuit> {
    let numbered = recipes.iter().enumerate();
    numbered.map(|(number, recipe)| circuit(&format!("p{number}"), recipe)).collect()
}

/// Theorem 1, Theorem 2, and what is refused, for the outputs y(1)..y(N), y(N+1) of one cycle.
fn check(outputs: &[Image], widths: &[usize]) {
    let programs = widths.len();
    let (own, parity) = outputs.split_at(programs);
    let all = ProgramSet::first(programs);
    let paper = Word { mask: all, sum: parity[0].clone() };
    let every = |program: ProgramId| own.get(program.index());
    assert_eq!(sum(all, every), Some(paper.clone()), "(9)");
    let zero = syndrome(&paper, every).expect("every output is there");
    assert!(zero.is_zero(), "Theorem 1");
    for erased in (0..1_u128 << programs).map(ProgramSet::from_bits) {
        let received = |program: ProgramId| every(program).filter(|_| !erased.contains(program));
        assert_eq!(sum(all, received).is_some(), erased.is_empty());
        assert_eq!(syndrome(&paper, received).is_some(), erased.is_empty());
        // The word over the programs that `erased` leaves reconstructs each of them, and no other.
        let mask = all.without(erased);
        let word = sum(mask, every).expect("every output is there");
        for (wanted, &width) in all.iter().zip(widths) {
            let truth = &own[wanted.index()];
            let estimated = reconstruct(&paper, wanted, width, received);
            let mut others = erased.without(ProgramSet::only(wanted)).iter();
            match others.next() {
                None => assert_eq!(estimated.as_ref(), Ok(truth), "Theorem 2"),
                Some(other) => assert_eq!(estimated, Err(ErasureError::Two { wanted, other })),
            }
            let alone = |program| received(program).filter(|_| program != wanted);
            let estimated = reconstruct(&word, wanted, width, alone);
            if mask.contains(wanted) {
                assert_eq!(estimated.as_ref(), Ok(truth));
            } else {
                assert_eq!(estimated, Err(ErasureError::NotMember { wanted }));
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
    let image = |width, words: &[u64]| Image::from_words(width, words).expect("the bits fit");
    let narrow = image(3, &[0b101]);
    let wide = image(66, &[u64::MAX, 0b11]);
    let parity = image(66, &[u64::MAX ^ 0b101, 0b11]);
    check(&[narrow, wide, parity], &[3, 66]);
}

/// A sum with a 1 past the width of the wanted output contains a faulty output: it is refused, not cut.
#[test]
fn a_sum_that_is_too_wide_is_refused() {
    let wanted = ProgramId(0);
    let word = Word {
        mask: ProgramSet::only(wanted),
        sum: Image::from_words(4, &[0b1001]).expect("the bits fit"),
    };
    let output = reconstruct(&word, wanted, 3, |_| None);
    assert_eq!(output, Err(ErasureError::Width { wanted, width: 3 }));
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
