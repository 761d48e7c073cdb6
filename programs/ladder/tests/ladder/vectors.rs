//! 2,000 scans of all standard blocks as a program compiled by matiec does them, replayed.

use std::time::Duration;

use understudy_ladder::Interpreter;

use crate::support::program;
use understudy_logic::Running;

fn bits(text: &str) -> Vec<bool> {
    text.bytes().map(|byte| byte == b'1').collect()
}

#[test]
fn all_blocks_do_what_matiec_does() {
    let recorded: serde_json::Value =
        serde_json::from_str(include_str!("vectors/blocks.json")).expect("a JSON document");
    let program = program(include_str!("vectors/blocks.ladder"));
    let period = Duration::from_millis(recorded["period_ms"].as_u64().expect("a period"));
    for (kind, signals) in [("inputs", &program.inputs), ("outputs", &program.outputs)] {
        let names: Vec<&str> = signals.iter().map(|signal| signal.name.as_str()).collect();
        let expected = recorded[kind].as_array().expect("a list of signals");
        let expected: Vec<&str> =
            expected.iter().map(|signal| signal["name"].as_str().expect("a name")).collect();
        assert_eq!(names, expected);
    }
    let mut interpreter = Interpreter::new(&program, period).expect("a sound program");
    let mut circuit = Running::new(&program.lower(period).expect("a sound program"));
    let scans = recorded["scans"].as_array().expect("a list of scans");
    assert_eq!(scans.len(), 2_000);
    for (number, scan) in scans.iter().enumerate() {
        let (inputs, outputs) =
            scan.as_str().and_then(|scan| scan.split_once(' ')).expect("inputs, a blank, outputs");
        let inputs = bits(inputs);
        assert_eq!(interpreter.scan(&inputs), bits(outputs), "interpreter, scan {number}");
        assert_eq!(circuit.step(&inputs), bits(outputs), "circuit, scan {number}");
    }
}
