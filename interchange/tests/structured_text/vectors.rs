//! 2,000 scans of all standard blocks, as matiec compiles the text and gcc runs it, replayed.

use std::time::Duration;

use understudy_interchange::structured_text::read;
use understudy_ladder::Interpreter;

use crate::support::{Running, program};

fn bits(text: &str) -> Vec<bool> {
    text.bytes().map(|byte| byte == b'1').collect()
}

#[test]
fn the_text_of_all_blocks_does_what_matiec_makes_of_it() {
    let text = include_str!("texts/blocks.st");
    let recorded: serde_json::Value = serde_json::from_str(include_str!(
        "../../../ladder/tests/ladder/vectors/blocks.json"
    ))
    .expect("a JSON document");
    let program = program(text);
    let period = Duration::from_millis(recorded["period_ms"].as_u64().expect("a period"));
    assert_eq!(read(text).period, Some(period));
    for (kind, signals) in [("inputs", &program.inputs), ("outputs", &program.outputs)] {
        let found: Vec<(String, String)> = signals
            .iter()
            .map(|signal| {
                let address = signal.address.as_ref().map(ToString::to_string);
                (signal.name.to_string(), address.unwrap_or_default())
            })
            .collect();
        let word = |signal: &serde_json::Value, key: &str| {
            signal[key].as_str().expect("a word").to_owned()
        };
        let expected = recorded[kind].as_array().expect("a list of signals").iter();
        let expected: Vec<_> = expected
            .map(|signal| (word(signal, "name"), word(signal, "address")))
            .collect();
        assert_eq!(found, expected);
    }
    let mut interpreter = Interpreter::new(&program, period).expect("a sound program");
    let mut circuit = Running::new(&program.lower(period).expect("a sound program"));
    let scans = recorded["scans"].as_array().expect("a list of scans");
    assert_eq!(scans.len(), 2_000);
    for (number, scan) in scans.iter().enumerate() {
        let scan = scan.as_str().and_then(|scan| scan.split_once(' '));
        let (inputs, outputs) = scan.expect("inputs, a blank, outputs");
        let inputs = bits(inputs);
        assert_eq!(
            interpreter.scan(&inputs),
            bits(outputs),
            "interpreter, scan {number}"
        );
        assert_eq!(
            circuit.step(&inputs),
            bits(outputs),
            "circuit, scan {number}"
        );
    }
}
