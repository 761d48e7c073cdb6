//! A warm start of a ladder: its circuit goes on as its typed program does.

use std::time::Duration;

use proptest::prelude::*;
use understudy_bits::Registers;
use understudy_ladder::{circuit, print};
use understudy_testing::random::{Dice, random_program};
use understudy_typed::{CarriedState, Interpreter, Program, Told};

use crate::support::{PERIOD, program};
use understudy_logic::{Scan, Scratch};

fn flip(inputs: &mut [u64], place: usize) {
    inputs[place / 64] ^= 1 << (place % 64);
}

/// One scan of a program and of its circuit, which have the same outputs.
fn both_step(
    (interpreter, state): (&Interpreter, &mut Vec<u64>),
    (scan, registers): (&Scan, &mut Vec<u64>),
    inputs: &[u64],
    about: &str,
) {
    let [mut wanted, mut found] = [0; 2].map(|_| vec![0_u64; scan.output_count().div_ceil(64)]);
    interpreter.step(state, inputs, &mut wanted);
    scan.step(&mut Scratch::default(), registers, inputs, &mut found);
    assert_eq!(found, wanted, "{about}");
}

/// Runs the circuit of a program and its interpreter, and restarts both warm in about one of eight scans.
fn check(typed: &Program, seed: u64, about: &str) -> usize {
    let exact = circuit(typed).expect("a sound program");
    let mask = exact.layout.retentive_mask(typed);
    let scan = Scan::new(&exact.circuit);
    let interpreter = Interpreter::new(typed);
    let mut registers = scan.initial().to_vec();
    let mut state = interpreter.initial().to_vec();
    let mut dice = Dice::new(!seed);
    let mut inputs = vec![0_u64; scan.input_count().div_ceil(64)];
    let mut kept = 0;
    for number in 0..80 {
        if dice.rarely(8) {
            let initial = scan.initial();
            for (place, word) in registers.iter_mut().enumerate() {
                *word = initial[place] & !mask[place] | *word & mask[place];
            }
            state = typed.restarted(&state);
            kept += usize::from(registers != initial);
        }
        // Inputs that stay for a while let timers end.
        if dice.rarely(2) {
            flip(&mut inputs, dice.below(scan.input_count()));
        }
        let about_scan = format!("scan {number}\n{about}");
        both_step((&interpreter, &mut state), (&scan, &mut registers), &inputs, &about_scan);
        // The state that views show is the same program's, too.
        let mut shown = exact.layout.state(&registers);
        let mut go_on = registers.clone();
        let about_scan = format!("after the state of scan {number}\n{about}");
        both_step((&interpreter, &mut shown), (&scan, &mut go_on), &inputs, &about_scan);
    }
    kept
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_programs_restart(seed: u64, milliseconds in 30_u64..300) {
        let ladder = random_program(seed, 6);
        let typed = ladder.typed(Duration::from_millis(milliseconds)).expect("a sound program");
        check(&typed, seed, &print(&ladder));
    }
}

/// Runs the circuit of a program for some scans, then starts the circuit and the interpreter of another one from its retentive values, which must
/// agree. Answers whether the circuit has all of these values, and whether there are any.
fn change(before: &Program, now: &Program, seed: u64, about: &str) -> (bool, bool) {
    let [old, new] = [before, now].map(|typed| circuit(typed).expect("a sound program"));
    let scan = Scan::new(&old.circuit);
    let mut scratch = Scratch::default();
    let mut dice = Dice::new(!seed);
    let mut registers = scan.initial().to_vec();
    let mut inputs = vec![0_u64; scan.input_count().div_ceil(64)];
    let mut outputs = vec![0_u64; scan.output_count().div_ceil(64)];
    for _ in 0..dice.below(60) {
        flip(&mut inputs, dice.below(scan.input_count()));
        scan.step(&mut scratch, &mut registers, &inputs, &mut outputs);
    }
    let told = Told {
        is_known: &|address| old.layout.holds(address),
        is_read: &|address| new.layout.holds(address),
    };
    let CarriedState { mut state, .. } =
        now.carried(before, &old.layout.state(&registers), told, &[]);
    let scan = Scan::new(&new.circuit);
    let Registers { packed: mut registers, lost } =
        new.layout.registers(now, &state, scan.initial());
    let is_new = registers != scan.initial();
    if !lost.is_empty() {
        // The same program with the same period takes over everything.
        assert!(!seed.is_multiple_of(6), "{lost:?} {state:?}\n{about}");
        return (false, is_new);
    }
    let interpreter = Interpreter::new(now);
    let mut inputs = vec![0_u64; scan.input_count().div_ceil(64)];
    for number in 0..60 {
        if dice.rarely(2) {
            flip(&mut inputs, dice.below(scan.input_count()));
        }
        let about_scan = format!("scan {number}\n{about}");
        both_step((&interpreter, &mut state), (&scan, &mut registers), &inputs, &about_scan);
    }
    (true, is_new)
}

#[test]
fn changed_programs_go_on_from_what_the_circuit_before_has_left() {
    let [mut whole, mut new] = [0; 2];
    for seed in 0..300 {
        let [before, now] =
            [seed, seed + u64::from(seed % 3 > 0) * 7919].map(|seed| random_program(seed, 6));
        let about = format!("{}\n{}", print(&before), print(&now));
        let periods = [PERIOD, if seed % 2 == 0 { PERIOD } else { PERIOD * 3 }];
        let [before, now] = [(&before, periods[0]), (&now, periods[1])]
            .map(|(ladder, period)| ladder.typed(period).expect("a sound program"));
        let (is_whole, is_new) = change(&before, &now, seed, &about);
        whole += u32::from(is_whole && is_new);
        new += u32::from(is_new);
    }
    assert!(whole > 30 && new > 35, "{whole} of {new}");
}

#[test]
fn warm_starts_of_random_programs_keep_something() {
    let kept = |seed: u64| {
        let ladder = random_program(seed, 6);
        check(&ladder.typed(PERIOD).expect("a sound program"), seed, &print(&ladder))
    };
    let count = (0..60).filter(|&seed| kept(seed) > 0).count();
    assert!(count > 20, "{count} of 60");
}

#[test]
fn the_registers_of_what_is_retentive_are_kept() {
    let ladder = program(
        "program p\ninput a\noutput y\nmemory m = 0\nmemory n = 0\nretain m, t, c\n\
         rung [ a | m ] ( m )\nrung [ a | n ] ( n )\nrung a {TON t 1s} {TON u 1s} ( y )\n\
         rung a {CTU c 3}\nrung a {CTU d 3}",
    );
    let typed = ladder.typed(PERIOD).expect("a sound program");
    assert_eq!(typed.retentive_names(), ["m", "t", "c"]);
    let exact = circuit(&typed).expect("a sound program");
    let mask = exact.layout.retentive_mask(&typed);
    let registers = exact.circuit.registers().iter().enumerate();
    let kept = registers.filter(|(place, _)| mask[0] >> place & 1 == 1);
    let kept: Vec<&str> = kept.map(|(_, register)| register.name.as_str()).collect();
    assert!(
        kept.iter().all(|name| *name == "m" || name.starts_with("t.") || name.starts_with("c.")),
        "{kept:?}"
    );
    let of = |block: &str| kept.iter().filter(|name| name.starts_with(block)).count();
    assert_eq!((of("m"), of("t."), of("c.")), (1, 4, 3), "{kept:?}");
}
