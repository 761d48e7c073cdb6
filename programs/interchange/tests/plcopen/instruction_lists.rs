//! Instruction lists against a naive machine: one result, and what waits in brackets.

use std::collections::HashMap;
use std::fmt::Write;

use understudy_interchange::plcopen::read;
use understudy_logic::Running;

use crate::meaning::{file, variables};
use crate::support::{circuit, findings};
use understudy_testing::random::Dice;

const INPUTS: [&str; 3] = ["i0", "i1", "i2"];
const OUTPUTS: [&str; 3] = ["q0", "q1", "q2"];

#[derive(Debug, Clone)]
enum Line {
    /// LD, AND, OR, XOR, ST, and the same with N; S and R.
    Plain(&'static str, &'static str),
    Not,
    Open(&'static str, &'static str),
    Close,
    /// A TON with an IN of its own, after two scans.
    Call(&'static str),
    /// JMPC, JMPCN, RETC, RETCN.
    Leave(&'static str, usize),
    Label(usize),
}

const JOINS: [&str; 6] = ["AND", "ANDN", "OR", "ORN", "XOR", "XORN"];

fn lines(dice: &mut Dice) -> Vec<Line> {
    let read: Vec<&'static str> = INPUTS.into_iter().chain(OUTPUTS).chain(["t.Q"]).collect();
    let mut lines = Vec::new();
    let mut labels = 0;
    let mut is_called = false;
    for _ in 0..2 + dice.below(5) {
        lines.push(Line::Plain(dice.pick(&["LD", "LDN"]), dice.pick(&read)));
        let mut open = 0;
        for _ in 0..dice.below(6) {
            match dice.below(6) {
                0 => lines.push(Line::Not),
                1 => {
                    lines.push(Line::Open(dice.pick(&JOINS), dice.pick(&read)));
                    open += 1;
                }
                2 if open > 0 => {
                    lines.push(Line::Close);
                    open -= 1;
                }
                _ => lines.push(Line::Plain(dice.pick(&JOINS), dice.pick(&read))),
            }
        }
        lines.extend(std::iter::repeat_n(Line::Close, open));
        for _ in 0..1 + dice.below(3) {
            lines.push(match dice.below(7) {
                0 if !is_called => {
                    is_called = true;
                    Line::Call(dice.pick(&INPUTS))
                }
                1 => {
                    labels += 1;
                    Line::Leave(dice.pick(&["JMPC", "JMPCN"]), labels - 1)
                }
                2 if dice.rarely(2) => Line::Leave(dice.pick(&["RETC", "RETCN"]), 0),
                _ => Line::Plain(dice.pick(&["ST", "STN", "S", "R"]), dice.pick(&OUTPUTS)),
            });
            if matches!(lines.last(), Some(Line::Call(_))) {
                break;
            }
        }
        // Some of the labels that are wanted, and at the end all others.
        let wanted = lines.iter().filter_map(|line| match line {
            Line::Leave(word, label) if word.starts_with('J') => Some(*label),
            _ => None,
        });
        let placed = |label: &usize| {
            lines.iter().any(|line| matches!(line, Line::Label(known) if known == label))
        };
        let missing: Vec<usize> = wanted.filter(|label| !placed(label)).collect();
        if !missing.is_empty() && dice.rarely(2) {
            lines.push(Line::Label(dice.pick(&missing)));
        }
    }
    for label in 0..labels {
        if !lines.iter().any(|line| matches!(line, Line::Label(known) if *known == label)) {
            lines.push(Line::Label(label));
        }
    }
    lines
}

fn written(lines: &[Line]) -> String {
    let mut text = String::new();
    for line in lines {
        let _ = match line {
            Line::Plain(word, operand) => writeln!(text, "  {word} {operand} (* {word} *)"),
            Line::Not => writeln!(text, "  NOT"),
            Line::Open(word, operand) => writeln!(text, "  {word}( {operand}"),
            Line::Close => writeln!(text, "  )"),
            Line::Call(input) => writeln!(text, "  CAL t(IN := {input},\n    PT := T#200ms)"),
            Line::Leave(word, label) if word.starts_with('J') => {
                writeln!(text, "  {word} L{label}")
            }
            Line::Leave(word, _) => writeln!(text, "  {word}"),
            Line::Label(label) => writeln!(text, "L{label}:"),
        };
    }
    text
}

fn unit(declared: &str, list: &str) -> String {
    let body = format!("<IL><xhtml:p>\n{list}</xhtml:p></IL>");
    file(declared, "").replace("<LD>\n</LD>", &body)
}

#[derive(Default)]
struct Naive {
    now: u64,
    values: HashMap<&'static str, bool>,
    /// When the timer was started.
    start: Option<u64>,
}

impl Naive {
    fn is(&self, name: &str) -> bool {
        self.values.get(name).copied().unwrap_or(false)
    }

    fn scan(&mut self, lines: &[Line]) {
        let mut result = false;
        let mut open: Vec<(bool, &'static str)> = Vec::new();
        let mut target = None;
        for line in lines {
            if let Some(label) = target {
                if !matches!(line, Line::Label(found) if *found == label) {
                    continue;
                }
                target = None;
            }
            match line {
                Line::Plain("LD", operand) => result = self.is(operand),
                Line::Plain("LDN", operand) => result = !self.is(operand),
                Line::Plain("ST", operand) => {
                    self.values.insert(operand, result);
                }
                Line::Plain("STN", operand) => {
                    self.values.insert(operand, !result);
                }
                Line::Plain(word @ ("S" | "R"), operand) => {
                    if result {
                        self.values.insert(operand, *word == "S");
                    }
                }
                Line::Plain(word, operand) => result = joined(result, word, self.is(operand)),
                Line::Not => result = !result,
                Line::Open(word, operand) => {
                    open.push((result, word));
                    result = self.is(operand);
                }
                Line::Close => {
                    let (before, word) = open.pop().expect("as many as were opened");
                    result = joined(before, word, result);
                }
                Line::Call(input) => {
                    let starts = self.is(input) && self.start.is_none();
                    match (self.is(input), starts) {
                        (false, _) => self.start = None,
                        (true, true) => self.start = Some(self.now),
                        (true, false) => {}
                    }
                    let over = self.start.is_some_and(|start| start + 2 <= self.now);
                    self.values.insert("t.Q", over);
                }
                Line::Leave(word, label) => {
                    if result != word.ends_with('N') {
                        if word.starts_with('R') {
                            break;
                        }
                        target = Some(*label);
                    }
                }
                Line::Label(_) => {}
            }
        }
        self.now += 1;
    }
}

fn joined(left: bool, word: &str, right: bool) -> bool {
    let right = right != word.ends_with('N');
    match word.as_bytes()[0] {
        b'A' => left && right,
        b'O' => left || right,
        _ => left != right,
    }
}

fn declared() -> String {
    let mut declared = String::new();
    for (section, names) in [("input", INPUTS), ("output", OUTPUTS)] {
        declared += &variables(&names.map(|name| (section, name, "<BOOL/>")));
    }
    declared + &variables(&[("local", "t", "<derived name=\"TON\"/>"), ("local", "n", "<INT/>")])
}

#[test]
fn lists_do_what_a_machine_of_one_result_does() {
    for seed in 0..150 {
        let mut dice = Dice::new(seed);
        let lines = lines(&mut dice);
        let list = written(&lines);
        let circuit = circuit(&unit(&declared(), &list));
        let mut run = Running::new(&circuit);
        let mut naive = Naive::default();
        for scan in 0..24 {
            let inputs = dice.bits(INPUTS.len());
            naive.values.extend(INPUTS.into_iter().zip(inputs.iter().copied()));
            naive.scan(&lines);
            assert_eq!(
                run.step(&inputs),
                OUTPUTS.map(|name| naive.is(name)),
                "seed {seed}, scan {scan}\n{list}"
            );
        }
    }
}

#[test]
fn numbers_functions_and_calls_under_a_condition() {
    let list = "LD i0\nCALC t(IN := i1, PT := T#100ms)\nLD n\nADD 1\nMIN 5\nST n\nGE 3\nST q0\nLD n\nGT( 2\nADD 1\n)\nST q1\nLD t.Q\nST q2\n";
    let circuit = circuit(&unit(&declared(), list));
    let mut run = Running::new(&circuit);
    let scans: Vec<Vec<bool>> = (0..5).map(|_| run.step(&[true, true, false])).collect();
    let shown = |place: usize| scans.iter().map(|scan| scan[place]).collect::<Vec<_>>();
    assert_eq!(shown(0), [false, false, true, true, true]);
    assert_eq!(shown(1), [false, false, false, true, true]);
    assert_eq!(shown(2), [false, true, true, true, true]);
}

#[test]
fn what_is_wrong_with_a_list_is_said() {
    let list =
        "AND i0\nback: LD i0\n)\nJMPC back\nJMP nowhere\nLD i1\nAND( i2\nST q0\nLD ghost\nST q1\n";
    let text = unit(&declared(), list);
    insta::assert_snapshot!(findings(&text, &read(&text, None)).join("\n"));
}

#[test]
fn a_result_that_nothing_stores_is_said_and_looked_at() {
    let list = "LD i0\nNONSENSE ghost\nLD i1\nAND\nST q0\nLD i2\n";
    let text = unit(&declared(), list);
    insta::assert_snapshot!(findings(&text, &read(&text, None)).join("\n"));
}
