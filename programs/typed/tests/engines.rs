//! The machine is the interpreter, bit for bit: over random programs, inputs, faults and resets.

mod common;

use common::Random;
use proptest::prelude::*;
use understudy_typed::{Fault, Interpreter, Machine, Points, Program, Scratch};

/// What the scans of a program came to.
#[derive(Debug, Default)]
struct Account {
    scans: u64,
    faults: [u64; 8],
    resets: u64,
    /// Programs of which it is known that they never stop.
    steady: u64,
}

/// Runs both engines side by side.
fn compare(program: &Program, seed: u64, scans: usize, account: &mut Account) {
    assert_eq!(program.validate(), Ok(()));
    let can_fault = program.can_fault();
    account.steady += u64::from(!can_fault);
    let interpreter = Interpreter::new(program);
    let machine = Machine::new(program);
    assert_eq!(machine.initial(), interpreter.initial());
    let mut random = Random(seed);
    let mut scratch = Scratch::default();
    let mut expected = interpreter.initial().to_vec();
    let mut state = expected.clone();
    let mut inputs = vec![0; machine.input_count().div_ceil(64)];
    let mut outputs = vec![0; machine.output_count().div_ceil(64)];
    let mut expected_outputs = outputs.clone();
    for scan in 0..scans {
        inputs.fill(0);
        for point in &program.inputs {
            let value = match point.slot {
                0 => u64::from(random.percent(40)),
                _ => random.value(point.of),
            };
            point.set(&mut inputs, value);
        }
        let was_faulted = state[0] != 0;
        let before = state.clone();
        interpreter.step(&mut expected, &inputs, &mut expected_outputs);
        machine.step(&mut scratch, &mut state, &inputs, &mut outputs);
        if expected != state || expected_outputs != outputs {
            let at = expected.iter().zip(&state).position(|(a, b)| a != b);
            panic!(
                "scan {scan}, slot {at:?}: {:?} and {:?}\n{program:#?}",
                Fault::read(&expected).map(|fault| (fault, fault.describe(program))),
                Fault::read(&state).map(|fault| (fault, fault.describe(program))),
            );
        }
        account.scans += 1;
        let fault = Fault::read(&state);
        assert!(can_fault || fault.is_none(), "{fault:?}\n{program:#?}");
        if let (Some(fault), false) = (fault, was_faulted) {
            account.faults[usize::from(fault.cause.code())] += 1;
            assert!(fault.routine.is_none() || fault.line > 0, "{fault:?}");
            assert_eq!(before[3..], state[3..], "the state before the scan");
        }
        account.resets += u64::from(was_faulted && fault.is_none());
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 300,
        ..ProptestConfig::default()
    })]

    #[test]
    fn the_machine_is_the_interpreter(seed in any::<u64>(), statements in 1_usize..12) {
        let program = common::program(seed, statements);
        compare(&program, seed, 12, &mut Account::default());
    }
}

#[test]
fn random_programs_fault_in_every_way_and_run_besides() {
    let mut account = Account::default();
    for seed in 0..400 {
        let program = common::program(seed, 8);
        compare(&program, seed, 10, &mut account);
    }
    let faults: u64 = account.faults.iter().sum();
    assert!(faults < account.scans / 2, "{account:?}");
    assert!(account.faults[1..].iter().all(|&count| count > 0), "{account:?}");
    assert!(account.resets > 20, "{account:?}");
}

/// Small programs, among which are some that cannot stop.
#[test]
fn what_cannot_stop_does_not() {
    let mut account = Account::default();
    for seed in 0..600 {
        let mut program = common::program(seed, 1);
        program.outputs = program.outputs.iter().filter(|it| !it.of.is_real()).fold(
            Points::default(),
            |mut points, point| {
                points.push(&point.name, point.of, point.slot);
                points
            },
        );
        compare(&program, seed, 12, &mut account);
    }
    assert!(account.steady > 0, "{account:?}");
}

/// A row of more slots than an operand of 16 bits can name.
#[test]
fn large_programs_mean_the_same() {
    let mut account = Account::default();
    for seed in 0..120 {
        let mut program = common::program(seed, 8);
        program.frames += 1 << 16;
        compare(&program, seed, 6, &mut account);
    }
}

/// Working memory that another program left behind holds nothing that this one can see.
#[test]
fn working_memory_is_shared_by_programs() {
    let programs: Vec<Program> = (0..20).map(|seed| common::program(seed, 6)).collect();
    let machines: Vec<Machine> = programs.iter().map(Machine::new).collect();
    let run = |machine: &Machine, scratch: &mut Scratch| {
        let mut state = machine.initial().to_vec();
        let inputs = vec![0; machine.input_count().div_ceil(64)];
        let mut outputs = vec![0; machine.output_count().div_ceil(64)];
        for _ in 0..4 {
            machine.step(scratch, &mut state, &inputs, &mut outputs);
        }
        (state, outputs)
    };
    let mut shared = Scratch::default();
    for _ in 0..2 {
        for machine in &machines {
            assert_eq!(run(machine, &mut shared), run(machine, &mut Scratch::default()));
        }
    }
}
