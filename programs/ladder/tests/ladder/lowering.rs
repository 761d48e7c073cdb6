//! The circuit does what the interpreter does.

use std::time::Duration;

use proptest::prelude::*;
use understudy_ladder::{
    Block, BlockKind, Coil, CoilKind, Contact, ContactKind, Element, Feed, Interpreter, LowerError,
    Program, Relation, Rung, Series, Signal, print,
};

use crate::support::{PERIOD, program};
use understudy_logic::Running;
use understudy_testing::random::{Dice, random_program};

fn check(program: &Program, period: Duration, scans: impl Iterator<Item = Vec<bool>>) {
    let mut interpreter = Interpreter::new(program, period).expect("a sound program");
    let mut circuit = Running::new(&program.lower(period).expect("a sound program"));
    for (number, inputs) in scans.enumerate() {
        let expected = interpreter.scan(&inputs);
        if circuit.step(&inputs) != expected {
            panic!("scan {number}, expected {expected:?}\n{}", print(program));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_programs(seed: u64, milliseconds in 30_u64..300) {
        let program = random_program(seed, 6);
        let mut dice = Dice::new(!seed);
        let width = program.inputs.len();
        let mut inputs = dice.bits(width);
        let scans = (0..50).map(|_| {
            // Inputs that stay for a while let timers end.
            if dice.rarely(2) {
                let place = dice.below(width);
                inputs[place] = !inputs[place];
            }
            inputs.clone()
        });
        check(&program, Duration::from_millis(milliseconds), scans);
    }
}

/// A sequence of numbers below `symbols` in which every word of `length` of them occurs (de Bruijn).
fn every_word(symbols: usize, length: usize) -> Vec<usize> {
    fn extend(
        word: &mut [usize],
        place: usize,
        period: usize,
        symbols: usize,
        all: &mut Vec<usize>,
    ) {
        let length = word.len() - 1;
        if place > length {
            if length.is_multiple_of(period) {
                all.extend(&word[1..=period]);
            }
            return;
        }
        word[place] = word[place - period];
        extend(word, place + 1, period, symbols, all);
        for symbol in word[place - period] + 1..symbols {
            word[place] = symbol;
            extend(word, place + 1, place, symbols, all);
        }
    }
    let mut all = Vec::new();
    extend(&mut vec![0; length + 1], 1, 1, symbols, &mut all);
    let wrapped: Vec<usize> = all.iter().take(length - 1).copied().collect();
    all.extend(wrapped);
    all
}

#[test]
fn every_word_occurs() {
    let sequence = every_word(4, 3);
    assert_eq!(sequence.len(), 64 + 2);
    let words: std::collections::HashSet<&[usize]> = sequence.windows(3).collect();
    assert_eq!(words.len(), 64);
}

fn small(rungs: Vec<Rung>) -> Program {
    Program {
        name: "small".into(),
        inputs: vec![Signal::new("a")],
        outputs: vec![Signal::new("y")],
        memory: vec![Signal::new("m")],
        rungs,
        ..Program::default()
    }
}

fn rung(network: Series, kind: CoilKind, target: &str) -> Rung {
    Rung { network, coils: vec![Coil { kind, target: target.into() }], ..Rung::default() }
}

fn contacts() -> Vec<Element> {
    let kinds = ContactKind::ALL.into_iter();
    kinds
        .flat_map(|kind| {
            ["a", "m", "y"]
                .map(|operand| Element::Contact(Contact { kind, operand: operand.into() }))
        })
        .collect()
}

fn check_on_one_input(program: &Program) {
    let sequence = every_word(2, 3);
    check(program, PERIOD, sequence.into_iter().map(|bit| vec![bit == 1]));
}

#[test]
fn all_programs_of_two_rungs_of_one_contact() {
    let mut rungs = Vec::new();
    for network in contacts().into_iter().map(|contact| vec![contact]).chain([Vec::new()]) {
        for kind in CoilKind::ALL {
            for target in ["m", "y"] {
                rungs.push(rung(network.clone(), kind, target));
            }
        }
    }
    assert_eq!(rungs.len(), 156);
    for first in &rungs {
        for second in &rungs {
            check_on_one_input(&small(vec![first.clone(), second.clone()]));
        }
    }
}

#[test]
fn all_networks_of_three_contacts() {
    let contacts = contacts();
    for first in &contacts {
        for second in &contacts {
            for third in &contacts {
                let [first, second, third] = [first, second, third].map(|one| vec![one.clone()]);
                let series = [first.clone(), second.clone(), third.clone()].concat();
                let pair = Element::Branches(vec![second.clone(), third.clone()]);
                let before = [first.clone(), vec![pair]].concat();
                let tail = [second, third].concat();
                let beside = vec![Element::Branches(vec![first, tail])];
                for network in [series, before, beside] {
                    check_on_one_input(&small(vec![
                        rung(network, CoilKind::Plain, "m"),
                        rung(
                            vec![Element::Contact(Contact {
                                kind: ContactKind::NormallyOpen,
                                operand: "m".into(),
                            })],
                            CoilKind::Plain,
                            "y",
                        ),
                    ]));
                }
            }
        }
    }
}

#[test]
fn every_block_on_every_short_history_of_its_inputs() {
    let contact = |operand: &str| {
        Element::Contact(Contact { kind: ContactKind::NormallyOpen, operand: operand.into() })
    };
    let mut kinds = vec![BlockKind::Sr, BlockKind::Rs, BlockKind::RTrig, BlockKind::FTrig];
    for preset in 0..5 {
        let time = PERIOD * u32::from(preset);
        kinds.extend([BlockKind::Ton(time), BlockKind::Tof(time), BlockKind::Tp(time)]);
        kinds.extend([BlockKind::Ctu(preset), BlockKind::Ctd(preset), BlockKind::Ctud(preset)]);
    }
    for kind in kinds {
        let inputs = ["wire", "R", "LD", "CD", "R1"];
        let pins = kind
            .side_inputs()
            .iter()
            .map(|(pin, _)| Feed { pin: (*pin).into(), network: vec![contact(pin)] });
        let used = inputs.into_iter().filter(|input| {
            *input == "wire" || kind.side_inputs().iter().any(|(pin, _)| pin == input)
        });
        let block = Block { name: "block".into(), kind, pins: pins.collect() };
        // Both below the block and above it, where a contact sees the last scan's output.
        let program = Program {
            name: "one".into(),
            inputs: used.map(Signal::new).collect(),
            outputs: ["above", "below", "second"].map(Signal::new).to_vec(),
            rungs: vec![
                rung(
                    vec![contact(&format!("block.{}", kind.outputs()[0]))],
                    CoilKind::Plain,
                    "above",
                ),
                rung(vec![contact("wire"), Element::Block(block)], CoilKind::Plain, "below"),
                rung(
                    vec![contact(&format!("block.{}", kind.outputs().last().expect("an output")))],
                    CoilKind::Plain,
                    "second",
                ),
            ],
            ..Program::default()
        };
        let width = program.inputs.len();
        let length = [0, 10, 7, 4, 3][width];
        let sequence = every_word(1 << width, length).into_iter();
        let scans = sequence.map(|word| (0..width).map(|place| word >> place & 1 == 1).collect());
        check(&program, PERIOD, scans);
    }
}

fn registers(text: &str) -> Vec<String> {
    let circuit = program(text).lower(PERIOD).expect("a sound program");
    let registers = circuit.registers().iter();
    registers.map(|register| register.name.clone()).collect()
}

#[test]
fn only_what_outlives_a_scan_is_a_register() {
    let check = |text: &str, expected: &[&str]| assert_eq!(registers(text), expected, "{text}");
    let declared = "program p\ninput a\noutput y\nmemory m\nmemory n\n";
    check(&format!("{declared}rung a (m)\nrung m (y)"), &[]);
    check(&format!("{declared}rung m (y)\nrung a (m)"), &["m"]);
    check(&format!("{declared}rung [ a | m ] (m)\nrung m (y)"), &["m"]);
    check(&format!("{declared}rung a (S m)\nrung m (y)"), &["m"]);
    check(&format!("{declared}rung a (m)\nrung a (S m)\nrung m (y)"), &[]);
    check(&format!("{declared}rung [ a | y ] (y)"), &["y"]);
    check(&format!("{declared}rung m (y)"), &[]);
    check(&format!("{declared}rung n (y)\nrung m (n)\nrung a (m)"), &["m", "n"]);
    check(
        &format!("{declared}rung +a {{TON t 300ms}} (y)"),
        &["a.rising.M", "t.scans.0", "t.scans.1"],
    );
    check(
        &format!("{declared}rung a {{TON t 300ms}} (m)\nrung m (y)"),
        &["t.scans.0", "t.scans.1"],
    );
    check(&format!("{declared}rung a /t.Q {{TON t 100ms}} (y)"), &["t.Q", "t.scans.0"]);
    check(&format!("{declared}rung a {{CTU c 5}} (y)"), &["c.LAST", "c.CV.0", "c.CV.1", "c.CV.2"]);
}

#[test]
fn periods_that_make_no_sense_are_refused() {
    let program = program("program p\ninput a\noutput y\nrung a (y)");
    for period in [Duration::ZERO, Duration::from_secs(3601)] {
        assert_eq!(program.lower(period).map(|_| ()), Err(LowerError::Period { period }));
        assert!(Interpreter::new(&program, period).is_err());
    }
}

#[test]
fn a_program_with_errors_is_refused_with_all_of_them() {
    let parsed = understudy_ladder::parse("program p\ninput a\noutput y\nrung b (a)\nrung c (y)");
    let error = parsed.program.lower(PERIOD).map(|_| ()).expect_err("three errors");
    insta::assert_snapshot!(error, @"the program `p` has errors: the input `a` cannot be written; nothing is called `b`; nothing is called `c`");
}

#[test]
fn presets_are_rounded_up_to_the_period_with_a_warning() {
    let program = program("program p\ninput a\noutput y\nrung a {TON t 250ms} (y)");
    let messages = |milliseconds| -> Vec<String> {
        let warnings = program.preset_warnings(Duration::from_millis(milliseconds));
        warnings.into_iter().map(|warning| warning.message).collect()
    };
    assert_eq!(messages(50), [""; 0]);
    assert_eq!(
        messages(100),
        ["the preset 250ms of `t` is not a multiple of the period 100ms; it lasts 3 scans, 300ms"]
    );
    let scans = std::iter::repeat_n(vec![true], 8);
    check(&program, Duration::from_millis(100), scans);
}

#[test]
fn relations_are_turned_round() {
    for relation in Relation::ALL {
        for (left, right) in (0..3).flat_map(|left| (0..3).map(move |right| (left, right))) {
            let holds = relation.holds(left, right);
            assert_eq!(relation.opposite().holds(left, right), !holds);
            assert_eq!(relation.mirrored().holds(right, left), holds);
        }
    }
}
