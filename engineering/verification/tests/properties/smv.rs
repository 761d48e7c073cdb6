//! The text for NuSMV, read by its grammar (user manual 2.6, sections 2.2 and 2.3) and run beside the circuit that it was written from. NuSMV itself is
//! not packaged.

use std::collections::BTreeMap;
use std::time::Duration;

use proptest::prelude::*;
use understudy_logic::{Circuit, Running, bit};
use understudy_verification::property::read_one;
use understudy_verification::smv;
use understudy_verification::symbolic::resolve;

use understudy_testing::random::random_program;

/// From one scan to the next.
const PERIOD: Duration = Duration::from_millis(10);

/// Words that no signal may have, of those that a ladder's names could be.
const RESERVED: [&str; 24] = [
    "MODULE", "VAR", "ASSIGN", "DEFINE", "CTLSPEC", "SPEC", "FAIRNESS", "next", "init", "boolean",
    "xor", "TRUE", "FALSE", "case", "esac", "process", "self", "in", "union", "mod", "A", "E", "U",
    "X",
];

/// One module, as [`smv::of_circuit`] writes it.
#[derive(Default)]
struct Module {
    variables: Vec<String>,
    initial: BTreeMap<String, bool>,
    next: BTreeMap<String, Vec<String>>,
    defined: BTreeMap<String, Vec<String>>,
    specifications: Vec<String>,
}

fn tokens(text: &str) -> Vec<String> {
    let mut tokens: Vec<String> = Vec::new();
    let mut joins = false;
    for letter in text.chars() {
        let is_word = letter.is_ascii_alphanumeric() || letter == '_';
        if is_word && joins {
            tokens.last_mut().expect("a word began").push(letter);
        } else if !letter.is_whitespace() {
            tokens.push(letter.to_string());
        }
        joins = is_word;
    }
    tokens
}

/// A name that NuSMV takes: the first letter a letter or `_`, and no reserved word.
fn name(text: &str) -> String {
    let text = text.trim();
    let first = text.chars().next().expect("a name has a letter");
    assert!(first.is_ascii_alphabetic() || first == '_', "{text}");
    let mut rest = text.chars();
    assert!(rest.all(|letter| letter.is_ascii_alphanumeric() || "_$#-".contains(letter)));
    assert!(!RESERVED.contains(&text), "{text} is reserved");
    text.to_owned()
}

fn read(text: &str) -> Module {
    let mut module = Module::default();
    let mut lines = text.lines().filter(|line| !line.starts_with("--"));
    assert_eq!(lines.next(), Some("MODULE main"));
    let mut section = "";
    for line in lines {
        let Some(line) = line.strip_prefix("  ") else {
            match line.split_once(' ') {
                Some(("CTLSPEC", formula)) => module.specifications.push(formula.to_owned()),
                None => section = line,
                Some(_) => panic!("{line}"),
            }
            continue;
        };
        let line = line.strip_suffix(';').expect("a semicolon");
        match section {
            "VAR" => {
                let (left, kind) = line.split_once(" : ").expect("a declaration");
                assert_eq!(kind, "boolean");
                module.variables.push(name(left));
            }
            "ASSIGN" => {
                let (left, right) = line.split_once(" := ").expect("an assignment");
                let (what, of) = left.split_once('(').expect("init or next");
                let of = name(of.strip_suffix(')').expect("a bracket"));
                let once = match what {
                    "init" => module.initial.insert(of, right == "TRUE").is_none(),
                    "next" => module.next.insert(of, tokens(right)).is_none(),
                    _ => panic!("{line}"),
                };
                assert!(once, "assigned twice: {line}");
            }
            "DEFINE" => {
                let (left, right) = line.split_once(" := ").expect("a definition");
                let once = module.defined.insert(name(left), tokens(right)).is_none();
                assert!(once, "defined twice: {line}");
            }
            _ => panic!("{section}: {line}"),
        }
    }
    module
}

/// The value of an expression: `!` binds first; operators stand between brackets.
struct Reading<'a> {
    tokens: std::slice::Iter<'a, String>,
    module: &'a Module,
    values: &'a BTreeMap<String, bool>,
}

impl Reading<'_> {
    fn of(tokens: &[String], module: &Module, values: &BTreeMap<String, bool>) -> bool {
        let mut reading = Reading { tokens: tokens.iter(), module, values };
        let value = reading.value();
        assert_eq!(reading.tokens.as_slice(), &[] as &[String]);
        value
    }

    fn value(&mut self) -> bool {
        match self.tokens.next().expect("an expression").as_str() {
            "!" => !self.value(),
            "TRUE" => true,
            "FALSE" => false,
            "(" => {
                let left = self.value();
                let operator = self.tokens.next().expect("an operator");
                let right = self.value();
                assert_eq!(self.tokens.next().map(String::as_str), Some(")"));
                match operator.as_str() {
                    "&" => left & right,
                    "|" => left | right,
                    "xor" => left ^ right,
                    _ => panic!("{operator}"),
                }
            }
            name => match (self.values.get(name), self.module.defined.get(name)) {
                (Some(&value), None) => value,
                (None, Some(defined)) => Self::of(defined, self.module, self.values),
                _ => panic!("`{name}` is neither a variable nor defined, or both"),
            },
        }
    }
}

/// Runs the text and the circuit side by side, for some scans with inputs from `seed`.
fn run_beside(circuit: &Circuit, module: &Module, mut seed: u64) {
    let inputs = circuit.inputs().len();
    let (given, kept) = module.variables.split_at(inputs);
    assert_eq!(kept.len(), circuit.registers().len());
    let mut running = Running::new(circuit);
    let mut values = module.initial.clone();
    assert_eq!(values.len(), kept.len());
    for _ in 0..12 {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        let inputs: Vec<bool> = (0..inputs).map(|place| seed >> (40 + place) & 1 == 1).collect();
        values.extend(given.iter().cloned().zip(inputs.iter().copied()));
        let outputs = running.step(&inputs);
        for (output, expected) in circuit.outputs().iter().zip(outputs) {
            let said = [output.name.replace('.', "_")];
            assert_eq!(Reading::of(&said, module, &values), expected, "{said:?}");
        }
        let next = module.next.iter().map(|(name, tokens)| {
            let value = Reading::of(tokens, module, &values);
            (name.clone(), value)
        });
        values = next.collect();
        for (place, name) in kept.iter().enumerate() {
            assert_eq!(values[name], bit(running.state(), place), "{name}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn the_text_does_what_the_circuit_does(seed: u64) {
        let program = random_program(seed, 3);
        let circuit = program.lower_observed(Duration::from_millis(100)).expect("a right program");
        let written = circuit.outputs()[0].name.clone();
        let property = read_one(&format!("AG EF {written}"), PERIOD).expect("a formula");
        let formula = resolve(&property.formula, &circuit).expect("a signal");
        let module = read(&smv::of_circuit(&circuit, &[formula], &[]));
        prop_assert_eq!(module.specifications.len(), 1);
        run_beside(&circuit, &module, seed);
    }
}

/// Appendix 2 of the paper on the deployment of controllers, from its first module to its specification; `—` of the print is `|`.
const APPENDIX_2: &str = include_str!("appendix-2.smv");

/// A text in the names of the paper, without spaces, and with the constants of NuSMV.
fn as_printed(text: &str) -> String {
    let names = [
        ("on_switch", "ONSWITCH"),
        ("off_switch", "OFFSWITCH"),
        ("start", "START"),
        ("pe1", "PE1"),
        ("ccw_sense", "CCWSENSE"),
        ("cw_sense", "CWSENSE"),
        ("g_timer", "GTIMER"),
        ("green_lamp", "GLAMP"),
        ("FALSE", "0"),
    ];
    let code = text.lines().map(|line| line.split("--").next().unwrap_or_default());
    let words = code.flat_map(tokens).map(|word| {
        let name = names.iter().find(|(ours, _)| *ours == word);
        name.map_or(word, |(_, paper)| (*paper).to_owned())
    });
    // Brackets around a whole expression are the printer's choice.
    let text = words.collect::<Vec<_>>().join(" ");
    text.replace(": = ( GLAMP )", ": = GLAMP")
        .replace("( ONSWITCH | START ) & ( ! OFFSWITCH )", "( ( ONSWITCH | START ) & ! OFFSWITCH )")
}

#[test]
fn the_painting_system_is_written_as_in_appendix_2() {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../examples/painting-system/painting-system.ladder"
    );
    let program = understudy_ladder::parse(&std::fs::read_to_string(path).expect("an example"));
    let written = as_printed(&smv::of_rungs(&program.program));
    for (ours, paper) in written.split("MODULE ").zip(as_printed(APPENDIX_2).split("MODULE ")) {
        assert_eq!(ours, paper);
    }
    assert_eq!(written, as_printed(APPENDIX_2));
}
