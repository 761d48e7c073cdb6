//! 2,000 scans of all standard blocks, as matiec compiles the text and gcc runs it, replayed.

use std::time::Duration;

use crate::support::read;
use understudy_ladder::Interpreter;

use crate::support::program;
use understudy_logic::Running;

fn bits(text: &str) -> Vec<bool> {
    text.bytes().map(|byte| byte == b'1').collect()
}

#[test]
fn the_text_of_all_blocks_does_what_matiec_makes_of_it() {
    let text = include_str!("texts/blocks.st");
    let recorded: serde_json::Value =
        serde_json::from_str(include_str!("../../../ladder/tests/ladder/vectors/blocks.json"))
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
        let expected: Vec<_> =
            expected.map(|signal| (word(signal, "name"), word(signal, "address"))).collect();
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
        assert_eq!(interpreter.scan(&inputs), bits(outputs), "interpreter, scan {number}");
        assert_eq!(circuit.step(&inputs), bits(outputs), "circuit, scan {number}");
    }
}

/// The cases of the ladder's own tests, once as blocks of the ladder and once, called under a condition, as bits.
#[test]
fn the_standard_blocks_do_what_the_standard_says() {
    let text = include_str!("../../../ladder/tests/ladder/vectors/semantics.txt");
    let lines: Vec<&str> = text.lines().filter(|line| !line.starts_with('#')).collect();
    let mut count = 0;
    for case in lines.split(|line| line.is_empty()).filter(|case| !case.is_empty()) {
        let (block, _) = case[0].split_once(':').expect("a block and what is to be seen");
        let (kind, preset) = block.split_once(' ').unwrap_or((block, ""));
        let rows =
            case[1..].iter().map(|line| line.split_once(' ').expect("a name and its values"));
        let rows: Vec<(&str, Vec<bool>)> =
            rows.map(|(name, values)| (name, bits(values.trim()))).collect();
        let (outputs, inputs): (Vec<_>, Vec<_>) =
            rows.into_iter().partition(|(name, _)| name.starts_with('Q'));
        let names = |rows: &[(&str, Vec<bool>)], prefix: &str| -> String {
            let names: Vec<String> =
                rows.iter().map(|(name, _)| format!("{prefix}{name}")).collect();
            names.join(", ")
        };
        let given: Vec<String> =
            inputs.iter().map(|(name, _)| format!("{name} := in_{name}")).collect();
        let preset = match preset {
            "" => String::new(),
            time if time.ends_with("ms") => format!(", PT := T#{time}"),
            number => format!(", PV := {number}"),
        };
        let call = format!("block({}{preset});", given.join(", "));
        let shown: String =
            outputs.iter().map(|(name, _)| format!("out_{name} := block.{name}; ")).collect();
        let calls = [call.clone(), format!("IF always THEN {call} END_IF;")];
        for call in calls {
            let source = format!(
                "PROGRAM semantics VAR_INPUT {} : BOOL; END_VAR VAR_OUTPUT {} : BOOL; END_VAR \
                 VAR block : {kind}; always : BOOL := TRUE; END_VAR always := always; {call} {shown} END_PROGRAM",
                names(&inputs, "in_"),
                names(&outputs, "out_")
            );
            let program = program(&source);
            assert_eq!(
                program.blocks().is_empty(),
                call.starts_with("IF") && !matches!(kind, "TON" | "TOF" | "TP"),
                "{source}"
            );
            let period = Duration::from_millis(100);
            let mut scans = Interpreter::new(&program, period).expect("a sound program");
            let mut circuit = Running::new(&program.lower(period).expect("a sound program"));
            for scan in 0..inputs[0].1.len() {
                let at = |rows: &[(&str, Vec<bool>)]| -> Vec<bool> {
                    rows.iter().map(|(_, values)| values[scan]).collect()
                };
                assert_eq!(
                    scans.scan(&at(&inputs)),
                    at(&outputs),
                    "{}, scan {scan}\n{source}",
                    case[0]
                );
                assert_eq!(
                    circuit.step(&at(&inputs)),
                    at(&outputs),
                    "{}, scan {scan}\n{source}",
                    case[0]
                );
                count += 1;
            }
        }
    }
    assert!(count > 150, "{count}");
}
