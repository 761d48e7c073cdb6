//! 2,000 scans of all standard blocks, as matiec compiles the text and gcc runs it, replayed.

use std::time::Duration;

use understudy_bits::exact;
use understudy_ladder::Interpreter;
use understudy_logic::Running;
use understudy_structured_text::parse;

use crate::execution::typed;
use crate::support::{PERIOD, read};

fn bits(text: &str) -> Vec<bool> {
    text.bytes().map(|byte| byte == b'1').collect()
}

#[test]
fn the_text_of_all_blocks_does_what_matiec_makes_of_it() {
    let text = include_str!("texts/blocks.st");
    let recorded: serde_json::Value =
        serde_json::from_str(include_str!("../../../ladder/tests/ladder/vectors/blocks.json"))
            .expect("a JSON document");
    let period = Duration::from_millis(recorded["period_ms"].as_u64().expect("a period"));
    assert_eq!(read(text).period, Some(period));
    let typed = typed(text, &parse(text).0).expect("a sound program");
    for (kind, points) in [("inputs", &typed.inputs), ("outputs", &typed.outputs)] {
        let points = points.iter().filter(|point| point.slot != 0);
        let found: Vec<(&str, &str)> = points
            .map(|point| {
                let shown = typed.variables.iter().find(|shown| shown.name == point.name);
                let address = shown.and_then(|shown| shown.address.as_deref());
                (point.name.as_str(), address.unwrap_or_default())
            })
            .collect();
        let expected = recorded[kind].as_array().expect("a list of signals").iter();
        let word = |signal: &'static str, of: &'_ serde_json::Value| {
            of[signal].as_str().map(str::to_owned)
        };
        let expected: Vec<(String, String)> = expected
            .map(|of| (word("name", of).expect("a name"), word("address", of).unwrap_or_default()))
            .collect();
        let expected: Vec<(&str, &str)> =
            expected.iter().map(|(name, address)| (name.as_str(), address.as_str())).collect();
        assert_eq!(found, expected);
    }
    let mut circuit = Running::new(&exact(&typed).expect("a circuit"));
    let scans = recorded["scans"].as_array().expect("a list of scans");
    assert_eq!(scans.len(), 2_000);
    for (number, scan) in scans.iter().enumerate() {
        let scan = scan.as_str().and_then(|scan| scan.split_once(' '));
        let (inputs, outputs) = scan.expect("inputs, a blank, outputs");
        assert_eq!(circuit.step(&bits(inputs)), bits(outputs), "scan {number}");
    }
}

/// The cases of the ladder's own tests, as rungs and as circuits, and as circuits of calls under a condition.
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
            let typed = typed(&source, &parse(&source).0).expect("a sound program");
            let mut circuits = vec![Running::new(&exact(&typed).expect("a circuit"))];
            // A call under a condition is no rung.
            let is_rung = !call.starts_with("IF");
            let program = read(&source).program;
            assert_eq!(program.is_some(), is_rung, "{source}");
            let rungs = program.iter().map(|it| it.lower(PERIOD).expect("a sound program"));
            circuits.extend(rungs.map(|circuit| Running::new(&circuit)));
            let scans = program.iter().map(|it| Interpreter::new(it, PERIOD));
            let mut scans: Vec<_> = scans.map(|scans| scans.expect("a sound program")).collect();
            for scan in 0..inputs[0].1.len() {
                let at = |rows: &[(&str, Vec<bool>)]| -> Vec<bool> {
                    rows.iter().map(|(_, values)| values[scan]).collect()
                };
                let found = circuits.iter_mut().map(|circuit| circuit.step(&at(&inputs)));
                let found = found.chain(scans.iter_mut().map(|scans| scans.scan(&at(&inputs))));
                for found in found.collect::<Vec<_>>() {
                    assert_eq!(found, at(&outputs), "{}, scan {scan}\n{source}", case[0]);
                }
                count += 1;
            }
        }
    }
    assert!(count > 150, "{count}");
}
