//! Timers as counts of scans, and the state of a program by the registers of its circuit.

use understudy_logic::{Running, Scan, pack};
use understudy_testing::random::Dice;
use understudy_typed::{Elementary, Machine, Program, Scratch};

use super::{compare, lowered};
use crate::{Exact, Shown};

/// Statements with timers, and how many of the timers are counted.
const PROGRAMS: [(&str, usize); 14] = [
    ("t(IN := a, PT := T#50ms); y := t.Q;", 1),
    ("y := t.Q; t(IN := a AND NOT t.Q, PT := T#35ms); z := t.Q;", 1),
    ("p(IN := a, PT := T#50ms); y := p.Q; f(IN := b, PT := T#40ms); z := f.Q;", 2),
    (
        "p(IN := a, PT := T#0s); y := p.Q; f(IN := b, PT := T#-5ms); z := f.Q; t(IN := a); x := t.Q;",
        2,
    ),
    ("t.IN := a; t.PT := T#30ms; t(); y := t.Q AND t.IN; z := t.PT > T#20ms;", 1),
    ("own(go := a, PT := T#50ms); y := own.done;", 1),
    // Not in every scan, not once, not with one preset.
    ("IF b THEN t(IN := a, PT := T#50ms); END_IF; y := t.Q;", 0),
    ("t(IN := a, PT := T#50ms); t(IN := b, PT := T#50ms); y := t.Q;", 0),
    ("IF b THEN RETURN; END_IF; f(IN := a, PT := T#30ms); y := f.Q;", 0),
    ("t(IN := a, PT := SEL(b, T#20ms, T#60ms)); y := t.Q;", 0),
    ("ts[n MOD 2](IN := a, PT := T#50ms); y := ts[0].Q; z := ts[1].Q;", 0),
    // The time that has elapsed is read.
    ("t(IN := a, PT := T#50ms); y := t.ET >= T#20ms; z := t.Q;", 0),
    (
        "p(IN := a, PT := T#50ms); y := p.ET = T#50ms; f(IN := b, PT := T#40ms); z := f.ET < T#40ms;",
        0,
    ),
    ("ts[0](IN := a, PT := T#50ms); ts[1](IN := b, PT := T#30ms); y := ts[0].Q; z := ts[1].Q;", 2),
];

fn program(statements: &str) -> Program {
    lowered(&format!(
        "FUNCTION_BLOCK delayed
           VAR_INPUT go : BOOL; PT : TIME; END_VAR
           VAR_OUTPUT done : BOOL; END_VAR
           VAR inner : TON; END_VAR
           inner(IN := go, PT := T#50ms);
           done := inner.Q;
         END_FUNCTION_BLOCK
         PROGRAM main
           VAR_INPUT a : BOOL; b : BOOL; n : USINT; END_VAR
           VAR_OUTPUT x : BOOL; y : BOOL; z : BOOL; END_VAR
           VAR t : TON; p : TP; f : TOF; ts : ARRAY[0..1] OF TON; own : delayed; END_VAR
           {statements}
         END_PROGRAM"
    ))
}

#[test]
fn timers_are_counted_where_a_count_tells_all_of_them() {
    for (seed, (statements, counted)) in (1..).zip(PROGRAMS) {
        let program = program(statements);
        compare(&program, seed, 400);
        let system = crate::System::of_program(&program).expect("followed");
        let counts = system.cells.iter().filter(|cell| cell.name.ends_with(".scans"));
        let counts = counts.filter(|cell| cell.of == Elementary::Udint).count();
        assert_eq!(counts, counted, "{statements}");
    }
}

/// The image of a program for the inputs of its circuit: a point stands at a multiple of its width.
fn of_points(program: &Program, bits: &[bool]) -> Vec<u64> {
    let mut image = vec![0; program.inputs.width().div_ceil(64)];
    let mut bits = bits.iter();
    for point in program.inputs.iter().filter(|point| point.slot != 0) {
        let own = bits.by_ref().take(point.of.bits() as usize).enumerate();
        let value = own.fold(0, |value, (place, &bit)| value | u64::from(bit) << place);
        point.set(&mut image, value);
    }
    image
}

#[test]
fn a_machine_goes_on_from_the_state_of_a_circuit() {
    let mut exact = 0;
    for (seed, (statements, _)) in (1..).zip(PROGRAMS) {
        let program = program(statements);
        for keeps_all in [false, true] {
            let shown = Shown { keeps_all, ..Shown::default() };
            let Ok(Exact { circuit, layout, .. }) = Exact::new(&program, shown) else {
                continue;
            };
            exact += 1;
            let (machine, scan) = (Machine::new(&program), Scan::new(&circuit));
            let mut dice = Dice::new(seed);
            let mut running = Running::new(&circuit);
            let mut registers = scan.initial().to_vec();
            let mut image = vec![false; circuit.inputs().len()];
            let (mut scratch, mut of_machine) = (Default::default(), Scratch::default());
            for _ in 0..200 {
                let place = dice.below(image.len());
                image[place] ^= dice.rarely(2);
                let inputs = pack(image.iter().copied());
                let expected = running.step(&image);
                let mut state = layout.state(&registers);
                let mut outputs = vec![0; machine.output_count().div_ceil(64)];
                machine.step(
                    &mut of_machine,
                    &mut state,
                    &of_points(&program, &image),
                    &mut outputs,
                );
                let found: Vec<bool> =
                    (0..expected.len()).map(|bit| outputs[0] >> bit & 1 == 1).collect();
                assert_eq!(found, expected, "{statements}");
                scan.step(&mut scratch, &mut registers, &inputs, &mut [0]);
            }
        }
    }
    assert!(exact >= 20, "{exact} circuits");
}
