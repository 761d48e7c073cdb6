//! A program of 1,000 rungs and 4,900 contacts: reading, lowering, scanning, and generating from it.
//!
//! The scan is given for each contact (the bar is 3 ns), compared with the plain evaluation of the same graph.

use std::fmt::Write;
use std::hint::black_box;
use std::time::Duration;

use divan::Bencher;
use divan::counter::ItemsCount;
use understudy_ladder::{Program, circuit_as_structured_text, from_circuit, parse};
use understudy_logic::{Circuit, Expression, Operation, Scan, Scratch, Variable};

const RUNGS: usize = 1_000;
const CONTACTS: usize = 4_900;
const INPUTS: usize = 256;
const PERIOD: Duration = Duration::from_millis(10);

fn main() {
    let program = program();
    assert_eq!((program.rungs.len(), program.contact_count()), (RUNGS, CONTACTS));
    divan::main();
}

/// SplitMix64.
fn random(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut mixed = *state;
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    mixed ^ (mixed >> 31)
}

/// Half of the rungs write outputs, half write memory; nine in ten have a branch and five contacts.
fn text() -> String {
    let mut state = 1;
    let mut text = String::from("program large\n");
    for index in 0..INPUTS {
        let _ = writeln!(text, "input u{index}");
    }
    for index in 0..RUNGS / 2 {
        let _ = writeln!(text, "output y{index}\nmemory x{index} = 0");
    }
    for rung in 0..RUNGS {
        let mut contact = || {
            let sign = ["", "/"][(random(&mut state) % 2) as usize];
            let place = random(&mut state) as usize;
            match random(&mut state) % 3 {
                0 => format!("{sign}x{}", place % (RUNGS / 2)),
                _ => format!("{sign}u{}", place % INPUTS),
            }
        };
        let [a, b, c, d, e] = std::array::from_fn(|_| contact());
        let target = ["y", "x"][rung % 2];
        let seal = format!("{target}{}", rung / 2);
        let last = if rung % 10 == 0 { String::new() } else { e };
        let _ = match rung % 2 {
            0 => writeln!(text, "rung [ {a} {b} | {c} ] {d} {last} ({seal})"),
            _ => writeln!(text, "rung [ {a} {b} | {seal} {c} ] {last} ({seal})"),
        };
    }
    text
}

fn program() -> Program {
    parse(&text()).program
}

fn circuit() -> Circuit {
    program().lower(PERIOD).expect("a sound program")
}

#[divan::bench]
fn reading(bencher: Bencher<'_, '_>) {
    let text = text();
    bencher.bench(|| parse(black_box(&text)));
}

#[divan::bench]
fn lowering(bencher: Bencher<'_, '_>) {
    let program = program();
    bencher.bench(|| black_box(&program).lower(PERIOD));
}

#[divan::bench]
fn ladder_from_circuit(bencher: Bencher<'_, '_>) {
    let circuit = circuit();
    bencher.bench(|| from_circuit(black_box(&circuit)));
}

#[divan::bench]
fn structured_text_from_circuit(bencher: Bencher<'_, '_>) {
    let circuit = circuit();
    bencher.bench(|| circuit_as_structured_text(black_box(&circuit), PERIOD));
}

/// 64 random inputs, packed, so that no scan is like the one before.
fn images() -> Vec<Vec<u64>> {
    let mut state = 2;
    (0..64).map(|_| (0..INPUTS.div_ceil(64)).map(|_| random(&mut state)).collect()).collect()
}

/// Time for each contact.
#[divan::bench(counters = [ItemsCount::new(CONTACTS)])]
fn scan(bencher: Bencher<'_, '_>) {
    let scan = Scan::new(&circuit());
    let images = images();
    let mut scratch = Scratch::default();
    let mut state = scan.initial().to_vec();
    let mut outputs = vec![0; scan.output_count().div_ceil(64)];
    let mut turn = 0;
    bencher.bench_local(|| {
        turn = (turn + 1) % images.len();
        scan.step(&mut scratch, &mut state, &images[turn], &mut outputs);
        black_box(&outputs);
    });
}

/// The same by walking the operations of the graph.
#[divan::bench(counters = [ItemsCount::new(CONTACTS)])]
fn plain_evaluation(bencher: Bencher<'_, '_>) {
    let circuit = circuit();
    let images = images();
    let mut state: Vec<bool> =
        circuit.registers().iter().map(|register| register.initial).collect();
    let mut values = vec![false; circuit.graph().operations().len()];
    let mut turn = 0;
    bencher.bench_local(|| {
        turn = (turn + 1) % images.len();
        for (index, operation) in circuit.graph().operations().iter().enumerate() {
            let value = |operand: Expression| values[operand.index()];
            values[index] = match *operation {
                Operation::Constant(constant) => constant,
                Operation::Variable(Variable::Input(input)) => {
                    images[turn][input as usize / 64] >> (input % 64) & 1 == 1
                }
                Operation::Variable(Variable::Register(register)) => state[register as usize],
                Operation::Not(operand) => !value(operand),
                Operation::And(left, right) => value(left) & value(right),
                Operation::Or(left, right) => value(left) | value(right),
                Operation::Xor(left, right) => value(left) ^ value(right),
            };
        }
        for (bit, register) in state.iter_mut().zip(circuit.registers()) {
            *bit = values[register.next.index()];
        }
        let outputs: Vec<bool> =
            circuit.outputs().iter().map(|output| values[output.value.index()]).collect();
        black_box(outputs);
    });
}
