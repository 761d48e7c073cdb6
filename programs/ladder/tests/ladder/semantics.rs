//! What the standard blocks do, case by case, by the interpreter and by the circuit.

use std::fmt::Write;

use understudy_ladder::Interpreter;

use crate::support::{PERIOD, program};
use understudy_logic::Running;

/// A block of `vectors/semantics.txt`.
struct Case {
    title: String,
    /// With its preset.
    block: String,
    /// Names, each with its value in every scan.
    rows: Vec<(String, Vec<bool>)>,
}

fn cases() -> Vec<Case> {
    let text = include_str!("vectors/semantics.txt");
    let lines: Vec<&str> = text.lines().filter(|line| !line.starts_with('#')).collect();
    let cases = lines.split(|line| line.is_empty()).filter(|lines| !lines.is_empty());
    let cases = cases.map(|lines| {
        let (block, _) = lines[0].split_once(':').expect("a block and what is to be seen");
        let rows = lines[1..].iter().map(|line| {
            let (name, bits) = line.split_once(' ').expect("a name and its values");
            (name.to_owned(), bits.trim().bytes().map(|bit| bit == b'1').collect())
        });
        Case { title: lines[0].to_owned(), block: block.to_owned(), rows: rows.collect() }
    });
    cases.collect()
}

#[test]
fn the_standard_blocks_do_what_the_standard_says() {
    let mut kinds = std::collections::BTreeSet::new();
    for case in cases() {
        let (kind, preset) = case.block.split_once(' ').unwrap_or((&case.block, ""));
        kinds.insert(kind.to_owned());
        let (outputs, inputs): (Vec<_>, Vec<_>) =
            case.rows.iter().partition(|(name, _)| name.starts_with('Q'));
        let mut text = String::from("program semantics\n");
        for (name, _) in &inputs {
            let _ = writeln!(text, "input {name}");
        }
        for (name, _) in &outputs {
            let _ = writeln!(text, "output out_{name}");
        }
        let sides: String = inputs[1..].iter().map(|(name, _)| format!(" {name}={name}")).collect();
        let _ = writeln!(text, "rung\n    {} {{{kind} block {preset}{sides}}}", inputs[0].0);
        for (name, _) in &outputs {
            let _ = writeln!(text, "rung\n    block.{name} ( out_{name} )");
        }
        let program = program(&text);
        let mut interpreter = Interpreter::new(&program, PERIOD).expect("a sound program");
        let mut circuit = Running::new(&program.lower(PERIOD).expect("a sound program"));
        for scan in 0..inputs[0].1.len() {
            let at = |rows: &[&(String, Vec<bool>)]| -> Vec<bool> {
                rows.iter().map(|(_, bits)| bits[scan]).collect()
            };
            let (given, expected) = (at(&inputs), at(&outputs));
            assert_eq!(interpreter.scan(&given), expected, "{}, scan {scan}", case.title);
            assert_eq!(circuit.step(&given), expected, "{}, scan {scan}", case.title);
        }
    }
    assert_eq!(kinds.len(), 10, "{kinds:?}");
}
