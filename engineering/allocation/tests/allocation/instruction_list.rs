//! The list, executed instruction by instruction, is one scan of the ladder.

use std::collections::BTreeMap;
use std::time::Duration;

use proptest::prelude::*;
use understudy_allocation::{Instruction, Operator, instructions};
use understudy_ladder::{BlockKind, Interpreter, Program};

use crate::support::program;

fn listing(text: &str) -> String {
    let lines = instructions(&program(text)).into_iter();
    lines.map(|line| line.to_string() + "\n").collect()
}

#[test]
fn lists_are_what_an_engineer_would_write() {
    let text = "program motor
input start
input stop
input part
output conveyor
output lamp
rung [ start | conveyor ] /stop ( conveyor )
rung part [ /start stop | +part ] {TON pause 300ms} ( lamp ) (R conveyor )
rung {CTU parts 10 R=[ start | stop ]}
rung stop parts.CV >= 5 (+ lamp ) (/ conveyor )
rung ( lamp )
";
    insta::assert_snapshot!(listing(text));
}

/// A machine with the current result, values by name, and stacked results of opened brackets.
#[derive(Default)]
struct Machine {
    bits: BTreeMap<String, bool>,
    /// The last input of each edge; nothing before its first call.
    edges: BTreeMap<String, bool>,
}

impl Machine {
    fn read(&self, name: &str) -> bool {
        name == "TRUE" || self.bits.get(name).copied().unwrap_or(false)
    }

    fn scan(&mut self, list: &[Instruction], blocks: &BTreeMap<String, BlockKind>) {
        let mut result = false;
        let mut opened: Vec<(bool, bool)> = Vec::new();
        for Instruction { operator, operand } in list {
            match operator {
                Operator::Load => result = self.read(operand),
                Operator::LoadNot => result = !self.read(operand),
                Operator::And => result &= self.read(operand),
                Operator::AndNot => result &= !self.read(operand),
                Operator::Or => result |= self.read(operand),
                Operator::OrNot => result |= !self.read(operand),
                Operator::AndOpen => opened.push((true, result)),
                Operator::OrOpen => opened.push((false, result)),
                Operator::Close => {
                    let (is_and, before) = opened.pop().expect("an opened bracket");
                    result = if is_and { before && result } else { before || result };
                }
                Operator::Store => {
                    self.bits.insert(operand.clone(), result);
                }
                Operator::StoreNot => {
                    self.bits.insert(operand.clone(), !result);
                }
                Operator::Set if result => {
                    self.bits.insert(operand.clone(), true);
                }
                Operator::Reset if result => {
                    self.bits.insert(operand.clone(), false);
                }
                Operator::Set | Operator::Reset => {}
                Operator::Compare(_) => panic!("no counters here"),
                Operator::Call => {
                    self.call(operand, blocks);
                    // What the current result is after a call, the standard leaves open: nobody may rely on it.
                    result = !result;
                }
            }
        }
        assert!(opened.is_empty());
    }

    fn call(&mut self, operand: &str, blocks: &BTreeMap<String, BlockKind>) {
        let name = match operand.split_once("(CLK := ") {
            Some((name, clock)) => {
                let clock = self.read(clock.strip_suffix(')').expect("a bracket"));
                self.bits.insert(format!("{name}.CLK"), clock);
                name
            }
            None => operand,
        };
        let pin = |pin: &str| format!("{name}.{pin}");
        let kind = blocks.get(name).copied();
        let rising = match kind {
            Some(BlockKind::RTrig) => true,
            Some(BlockKind::FTrig) => false,
            None => name.starts_with("rising"),
            Some(kind) => {
                let old = self.read(&pin("Q1"));
                let new = match kind {
                    BlockKind::Sr => self.read(&pin("S1")) || old && !self.read(&pin("R")),
                    BlockKind::Rs => !self.read(&pin("R1")) && (self.read(&pin("S")) || old),
                    _ => panic!("no timers and counters here"),
                };
                self.bits.insert(pin("Q1"), new);
                return;
            }
        };
        let clock = self.read(&pin("CLK"));
        // As matiec's: R_TRIG pulses in its first scan if its input is 1, F_TRIG if it is 0.
        let last = self.edges.insert(name.to_owned(), clock).unwrap_or(!rising);
        let pulse = if rising { clock && !last } else { !clock && last };
        self.bits.insert(pin("Q"), pulse);
    }
}

fn check(program: &Program, inputs: &[Vec<bool>]) -> Result<(), TestCaseError> {
    let list = instructions(program);
    let blocks: BTreeMap<String, BlockKind> =
        program.blocks().into_iter().map(|block| (block.name.to_string(), block.kind)).collect();
    let mut machine = Machine::default();
    let mut reference =
        Interpreter::new(program, Duration::from_millis(10)).expect("a sound program");
    for scan in inputs {
        for (signal, value) in program.inputs.iter().zip(scan) {
            machine.bits.insert(signal.name.to_string(), *value);
        }
        machine.scan(&list, &blocks);
        let expected = reference.scan(scan);
        let outputs = program.outputs.iter().map(|output| machine.read(&output.name));
        let found: Vec<bool> = outputs.collect();
        prop_assert_eq!(found, expected, "{:?}", list);
    }
    Ok(())
}

/// A series of contacts, branches, edges and latches, as text; `@` becomes a number of its own for each block.
fn series(depth: u32) -> BoxedStrategy<String> {
    let operand = prop::sample::select(vec!["a", "b", "c", "y", "z", "m"]);
    let sign = prop::sample::select(vec!["", "/", "+", "-"]);
    let contact = (sign, operand.clone()).prop_map(|(sign, operand)| format!("{sign}{operand}"));
    let block = prop::sample::select(vec!["SR", "RS", "R_TRIG", "F_TRIG"]);
    let block = (block, operand).prop_map(|(kind, operand)| match kind {
        "SR" => format!("{{SR k@ R={operand}}}"),
        "RS" => format!("{{RS k@ R1=[ /{operand} | +{operand} ]}}"),
        _ => format!("{{{kind} k@}}"),
    });
    if depth == 0 {
        return contact.boxed();
    }
    let branches = prop::collection::vec(series(depth - 1), 2..4);
    let branches = branches.prop_map(|branches| format!("[ {} ]", branches.join(" | ")));
    let element = prop_oneof![4 => contact, 1 => block, 2 => branches];
    prop::collection::vec(element, 1..4).prop_map(|elements| elements.join(" ")).boxed()
}

fn programs() -> impl Strategy<Value = String> {
    let coil = prop::sample::select(vec![
        "( y )",
        "(/ y )",
        "(S z )",
        "(R z )",
        "(+ m )",
        "(- z )",
        "( m )",
        "(S y ) (R m )",
        "(+ y ) ( z )",
        "(- m ) (/ y )",
    ]);
    let rung = (series(2), coil).prop_map(|(series, coil)| format!("rung {series} {coil}\n"));
    prop::collection::vec(rung, 1..5).prop_map(|rungs| {
        let mut text =
            "program p\ninput a\ninput b\ninput c\noutput y\noutput z\nmemory m = 0\n".to_owned();
        let all: String = rungs.concat();
        for (number, part) in all.split('@').enumerate() {
            if number > 0 {
                text.push_str(&number.to_string());
            }
            text.push_str(part);
        }
        text
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn executing_the_list_is_scanning_the_ladder(
        text in programs(),
        inputs in prop::collection::vec(prop::collection::vec(any::<bool>(), 3), 1..12),
    ) {
        check(&program(&text), &inputs)?;
    }
}
