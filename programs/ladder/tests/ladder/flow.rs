//! What the power does in a scan, against the rules of a ladder said once more.

use std::time::Duration;

use proptest::prelude::*;
use understudy_ladder::{
    ContactKind, Element, ElementFlow, Interpreter, Observer, Program, Reading, Series,
};
use understudy_logic::{Scan, Scratch, pack};

use crate::support::PERIOD;
use understudy_testing::random::{Dice, random_program};

/// Follows the power through `series`; answers with the power behind it.
fn follow(series: &Series, power: bool, flows: &mut std::slice::Iter<'_, ElementFlow>) -> bool {
    let mut power = power;
    for element in series {
        let mut any = false;
        match element {
            Element::Branches(branches) => {
                for branch in branches {
                    any |= follow(branch, power, flows);
                }
            }
            Element::Block(block) => {
                for feed in &block.pins {
                    follow(&feed.network, true, flows);
                }
            }
            _ => {}
        }
        let flow = flows.next().expect("a flow for every element");
        assert_eq!(flow.enters, power);
        match element {
            Element::Contact(contact) => {
                let Reading::Bit(bit) = flow.reading else {
                    panic!("a contact reads a bit, not {:?}", flow.reading);
                };
                match contact.kind {
                    ContactKind::NormallyOpen => assert_eq!(flow.passes, bit),
                    ContactKind::NormallyClosed => assert_eq!(flow.passes, !bit),
                    ContactKind::Rising => assert!(bit || !flow.passes),
                    ContactKind::Falling => assert!(!bit || !flow.passes),
                }
                assert_eq!(flow.leaves, power && flow.passes);
            }
            Element::Comparison(comparison) => {
                let Reading::Number(number) = flow.reading else {
                    panic!("a comparison reads a number, not {:?}", flow.reading);
                };
                assert_eq!(flow.passes, comparison.relation.holds(number, comparison.value));
                assert_eq!(flow.leaves, power && flow.passes);
            }
            Element::Branches(_) => assert_eq!(flow.leaves, any),
            Element::Block(block) => {
                let bound = block.kind.preset_time().unwrap_or_default();
                match flow.reading {
                    Reading::Time(time) => assert!(time <= bound),
                    Reading::Number(number) => {
                        assert!(Some(number) <= block.kind.preset_value());
                    }
                    other => assert_eq!(other, Reading::Nothing),
                }
            }
        }
        power = flow.leaves;
    }
    power
}

fn check(program: &Program, seed: u64) {
    let mut observed = Interpreter::new(program, PERIOD).expect("a right program");
    let mut plain = observed.clone();
    let mut dice = Dice::new(seed);
    for _ in 0..20 {
        let inputs = dice.bits(program.inputs.len());
        let evaluation = observed.scan_observed(&inputs);
        assert_eq!(evaluation.outputs, plain.scan(&inputs));
        assert_eq!(evaluation.inputs, inputs);
        assert_eq!(evaluation.rungs.len(), program.rungs.len());
        for (rung, flow) in program.rungs.iter().zip(&evaluation.rungs) {
            let mut flows = flow.elements.iter();
            let power = follow(&rung.network, true, &mut flows);
            assert_eq!(flows.next(), None);
            assert_eq!(flow.power, power);
            assert_eq!(flow.coils.len(), rung.coils.len());
        }
    }
}

proptest! {
    #[test]
    fn power_follows_the_rules(seed: u64) {
        check(&random_program(seed, 8), seed);
    }
}

#[test]
fn a_timer_tells_its_time() {
    let program =
        crate::support::program("program p\ninput a\noutput y\nrung\n    a {TON t 250ms} ( y )\n");
    let mut interpreter = Interpreter::new(&program, PERIOD).expect("a right program");
    let mut times = Vec::new();
    for input in [true, true, true, true, true, false] {
        let evaluation = interpreter.scan_observed(&[input]);
        times.push(evaluation.rungs[0].elements[1].reading);
    }
    let expected =
        [0, 100, 200, 250, 250, 0].map(|time| Reading::Time(Duration::from_millis(time)));
    assert_eq!(times, expected);
}

/// The circuit's own wires show what the naive scan shows, from x(t) and u(t) alone.
fn check_observer(program: &Program, seed: u64) {
    let circuit = program.lower(PERIOD).expect("a right program");
    let scan = Scan::new(&circuit);
    let observer = Observer::new(program, program.layout(PERIOD).expect("a right program"), PERIOD)
        .expect("a right program");
    let mut naive = Interpreter::new(program, PERIOD).expect("a right program");
    let mut state = scan.initial().to_vec();
    let mut outputs = vec![0; scan.output_count().div_ceil(64)];
    let mut scratch = Scratch::default();
    let mut dice = Dice::new(seed);
    for _ in 0..30 {
        let inputs = dice.bits(program.inputs.len());
        let packed = pack(inputs.iter().copied());
        let expected = naive.scan_observed(&inputs);
        let found = observer.evaluate(&state, &packed);
        assert_eq!(found, expected);
        scan.step(&mut scratch, &mut state, &packed, &mut outputs);
    }
}

proptest! {
    #[test]
    fn a_scan_is_seen_from_its_state_alone(seed: u64) {
        check_observer(&random_program(seed, 8), seed);
    }
}
