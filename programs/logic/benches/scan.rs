//! One step of a compiled circuit: a program of 1,000 rungs and 4,900 contacts, and a cell of 9 registers.
//!
//! The bar is 3 ns a contact; divan's counter shows contacts a second.

use divan::counter::ItemsCount;
use understudy_logic::{Circuit, CircuitBuilder, Expression, Scan, Scratch};

fn main() {
    divan::main();
}

/// Rungs `[ u x' | x ] /u' /u'' ( x )`, five contacts each, of which every tenth has four.
fn program(rungs: usize) -> Circuit {
    let mut builder = CircuitBuilder::new("program");
    let inputs: Vec<Expression> =
        (0..rungs).map(|rung| builder.input(format!("u{rung}"))).collect();
    let registers: Vec<_> =
        (0..rungs).map(|rung| builder.register(format!("x{rung}"), rung % 5 == 0)).collect();
    let mut state: Vec<Expression> = registers.iter().map(|register| register.1).collect();
    for rung in 0..rungs {
        let [first, second, third] = [1, 7, 31].map(|step| (rung * step + step) % rungs);
        let graph = builder.graph();
        let start = graph.and(inputs[rung], state[first]);
        let either = graph.or(start, state[rung]);
        let not_stop = graph.not(inputs[second]);
        let run = graph.and(either, not_stop);
        let next = if rung % 10 == 0 {
            run
        } else {
            let not_block = graph.not(inputs[third]);
            graph.and(run, not_block)
        };
        state[rung] = next;
        builder.set_next(registers[rung].0, next);
        if rung % 4 == 0 {
            builder.output(format!("y{rung}"), next);
        }
    }
    builder.finish().expect("names are numbered")
}

#[divan::bench(args = [9, 100, 1_000])]
fn one_state(bencher: divan::Bencher, rungs: usize) {
    let scan = Scan::new(&program(rungs));
    let mut scratch = Scratch::default();
    let mut state = scan.initial().to_vec();
    let mut inputs = vec![0x0123_4567_89ab_cdef_u64; scan.input_count().div_ceil(64)];
    let mut outputs = vec![0; scan.output_count().div_ceil(64)];
    bencher.counter(ItemsCount::new(rungs * 49 / 10)).bench_local(|| {
        for word in &mut inputs {
            *word = word.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(1);
        }
        scan.step(&mut scratch, &mut state, &inputs, &mut outputs);
    });
}

#[divan::bench(args = [9, 100, 1_000])]
fn sixty_four_states(bencher: divan::Bencher, rungs: usize) {
    let scan = Scan::new(&program(rungs));
    let mut scratch = Scratch::default();
    let mut state = vec![0; scan.register_count()];
    let inputs: Vec<u64> = (1..=scan.input_count() as u64)
        .map(|place| place.wrapping_mul(0x9e37_79b9_7f4a_7c15))
        .collect();
    let mut outputs = vec![0; scan.output_count()];
    bencher.counter(ItemsCount::new(64 * rungs * 49 / 10)).bench_local(|| {
        scan.step_lanes(&mut scratch, &mut state, &inputs, &mut outputs);
    });
}
