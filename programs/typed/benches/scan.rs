//! One scan of a machine: PID loops, an integer loop over an array, Boolean logic.
//!
//! The bar is 3 ns for an elementary operation; divan's counter shows operations a second. Where gcc is found, the same is measured for C at
//! `-O2` first, which keeps variables in registers over a whole scan. The aim of 6 times holds for C as matiec makes it:
//! see the bench `peer` of `understudy-structured-text`.

mod compared;
mod programs;

use divan::counter::ItemsCount;
use understudy_typed::{Machine, Program, Scratch};

fn main() {
    compared::print();
    divan::main();
}

fn scan(bencher: divan::Bencher<'_, '_>, program: &Program, operations: usize) {
    assert_eq!(program.validate(), Ok(()));
    let machine = Machine::new(program);
    let mut scratch = Scratch::default();
    let mut state = machine.initial().to_vec();
    bencher
        .counter(ItemsCount::new(operations))
        .bench_local(|| machine.step(&mut scratch, &mut state, &[], &mut []));
    assert_eq!(state[0], 0, "no fault");
}

#[divan::bench(args = [1, 10, 100, 1_000])]
fn pid(bencher: divan::Bencher<'_, '_>, loops: usize) {
    let program = programs::pid(loops as u32);
    scan(bencher, &program, loops * programs::PID_OPERATIONS);
}

#[divan::bench(args = [100, 1_000])]
fn integer(bencher: divan::Bencher<'_, '_>, turns: usize) {
    let program = programs::integer(turns as u32);
    scan(bencher, &program, turns * programs::INTEGER_OPERATIONS);
}

#[divan::bench(args = [100, 1_000])]
fn boolean(bencher: divan::Bencher<'_, '_>, rungs: usize) {
    let program = programs::boolean(rungs as u32);
    scan(bencher, &program, rungs * programs::BOOLEAN_OPERATIONS);
}
