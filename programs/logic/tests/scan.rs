//! A compiled circuit does in one state, and in 64 at once, what the expressions say.

mod common;

use common::{circuit, configuration, recipe};
use proptest::prelude::*;
use understudy_logic::{
    Circuit, CircuitBuilder, Expression, Scan, Scratch, Sparse, SparseRun, Variable, bit, pack,
};

/// One step of `circuit` from packed `state` under packed `inputs`, by [`understudy_logic::Graph::evaluate`].
fn expected(circuit: &Circuit, state: &[u64], inputs: &[u64]) -> (Vec<bool>, Vec<bool>) {
    let value = |root: Expression| {
        circuit.graph().evaluate(root, |variable| match variable {
            Variable::Input(place) => bit(inputs, place as usize),
            Variable::Register(place) => bit(state, place as usize),
        })
    };
    let next = circuit.registers().iter().map(|register| value(register.next));
    let outputs = circuit.outputs().iter().map(|output| value(output.value));
    (next.collect(), outputs.collect())
}

/// Steps through `samples` in one state; and in 64, each with the samples rotated by its lane; and in twice 64, of which the second half is one sample ahead.
fn check(circuit: &Circuit, samples: &[Vec<u64>]) {
    let scan = Scan::new(circuit);
    let initial: Vec<bool> = circuit.registers().iter().map(|register| register.initial).collect();
    assert_eq!(scan.initial(), pack(initial.iter().copied()));
    let mut scratch = Scratch::default();
    let mut lane_states: Vec<u64> =
        initial.iter().map(|&bit| u64::from(bit).wrapping_neg()).collect();
    let mut lane_outputs = vec![0; scan.output_count()];
    let mut halves = [lane_states.clone(), lane_states.clone()];
    let mut wide_states: Vec<[u64; 2]> = lane_states.iter().map(|&word| [word; 2]).collect();
    let mut wide_outputs = vec![[0; 2]; scan.output_count()];
    let mut states = vec![scan.initial().to_vec(); 64];
    let mut outputs = vec![0; scan.output_count().div_ceil(64)];
    for cycle in 0..samples.len() {
        let sample = |lane: usize| &samples[(cycle + lane) % samples.len()];
        let lanes_from = |first: usize| -> Vec<u64> {
            let of_lane = |lane, place| u64::from(bit(sample(first + lane), place)) << lane;
            let places = 0..scan.input_count();
            places.map(|place| (0..64).fold(0, |word, lane| word | of_lane(lane, place))).collect()
        };
        let lane_inputs = lanes_from(0);
        let ahead = lanes_from(1);
        let wide_inputs: Vec<[u64; 2]> =
            lane_inputs.iter().zip(&ahead).map(|(&now, &ahead)| [now, ahead]).collect();
        scan.step_wide(&mut scratch, &mut wide_states, &wide_inputs, &mut wide_outputs);
        for (half, inputs) in [&lane_inputs, &ahead].into_iter().enumerate() {
            scan.step_lanes(&mut scratch, &mut halves[half], inputs, &mut lane_outputs);
            let of_half = |words: &[[u64; 2]]| -> Vec<u64> {
                words.iter().map(|words| words[half]).collect()
            };
            assert_eq!(of_half(&wide_states), halves[half]);
            assert_eq!(of_half(&wide_outputs), lane_outputs);
        }
        scan.step_lanes(&mut scratch, &mut lane_states, &lane_inputs, &mut lane_outputs);
        for (lane, state) in states.iter_mut().enumerate() {
            let (next, values) = expected(circuit, state, sample(lane));
            scan.step(&mut scratch, state, sample(lane), &mut outputs);
            assert_eq!(*state, pack(next.iter().copied()));
            assert_eq!(outputs, pack(values.iter().copied()));
            let of_lane = |words: &[u64]| -> Vec<bool> {
                words.iter().map(|word| word >> lane & 1 == 1).collect()
            };
            assert_eq!(of_lane(&lane_states), next);
            assert_eq!(of_lane(&lane_outputs), values);
        }
    }
}

proptest! {
    #![proptest_config(configuration(60))]

    #[test]
    fn random_circuits(recipe in recipe(), samples in prop::collection::vec(any::<u64>(), 1..5)) {
        let samples: Vec<Vec<u64>> = samples.into_iter().map(|word| vec![word]).collect();
        check(&circuit("random", &recipe), &samples);
    }
}

/// Runs in which few registers are on do in a sparse pass what they do alone.
fn check_sparse(circuit: &Circuit, count: usize, mask: u64, samples: &[u64]) {
    let mut sparse = Sparse::new(Scan::new(circuit));
    let sample = |number: usize| samples[number % samples.len()].rotate_left(number as u32);
    let registers = circuit.registers().len() as u32;
    let runs = (0..count).map(|number| {
        let is_on = |place: &u32| mask & sample(number + 1) >> (place % 64) & 1 == 1;
        SparseRun {
            on: (0..registers).filter(is_on).collect(),
            signals: vec![sample(number); circuit.inputs().len().div_ceil(64)],
        }
    });
    let before: Vec<SparseRun> = runs.collect();
    let mut after = before.clone();
    sparse.step(&mut after);
    for (before, after) in before.iter().zip(&after) {
        let state = pack((0..registers).map(|place| before.on.contains(&place)));
        let (next, values) = expected(circuit, &state, &before.signals);
        let on = (0..registers).filter(|&place| next[place as usize]);
        assert_eq!(after.on, on.collect::<Vec<_>>());
        assert_eq!(after.signals, pack(values.iter().copied()));
    }
}

proptest! {
    #![proptest_config(configuration(200))]

    #[test]
    fn sparse_runs(recipe in recipe(), mask in any::<u64>(), samples in prop::collection::vec(any::<u64>(), 1..20)) {
        let circuit = circuit("random", &recipe);
        for (count, mask) in [(1, mask), (64, 0), (65, mask & mask >> 7), (200, u64::MAX)] {
            check_sparse(&circuit, count, mask, &samples);
        }
    }
}

/// More than one word of each; constants and negations as roots; a register that copies another reads its old value.
#[test]
fn wide_images() {
    let mut builder = CircuitBuilder::new("wide");
    let inputs: Vec<Expression> = (0..70).map(|place| builder.input(format!("u{place}"))).collect();
    let registers: Vec<_> =
        (0..130).map(|place| builder.register(format!("x{place}"), place % 3 == 0)).collect();
    for place in 0..130 {
        let before = registers[(place + 129) % 130].1;
        let input = inputs[place % 70];
        let next = match place % 3 {
            0 => before,
            1 => builder.graph().not(before),
            _ => builder.graph().xor(before, input),
        };
        builder.set_next(registers[place].0, next);
        builder.output(format!("y{place}"), next);
    }
    let one = builder.graph().constant(true);
    builder.output("one", one);
    let zero = builder.graph().constant(false);
    builder.output("zero", zero);
    let circuit = builder.finish().expect("names are numbered");
    check(&circuit, &[vec![0x5555_0000_ffff_1234, 0x2a], vec![u64::MAX, 0x3f], vec![0, 0]]);
}
