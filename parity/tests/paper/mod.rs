//! The programs (22)-(29) of Fujimoto and Sekiguchi exactly as printed, rows 1, 4 and 5 of (24) included, which never set their
//! bit; and a reader of the paper's formulas.
#![allow(dead_code, reason = "each test file uses its part")]

use understudy_logic::{Circuit, CircuitBuilder, Expression, Graph};

/// (24).
const ROBOT_STATES: [&str; 7] = [
    "(u13 ∧ u11 ∧ u15 ∨ x11 ∧ ¬u12) ∧ u13 ∧ ¬u15",
    "(u13 ∧ u12 ∧ ¬u15 ∨ x12 ∧ ¬u11) ∧ u13 ∧ ¬u15",
    "(u10 ∧ u11 ∧ u13 ∧ ¬u15 ∨ x13 ∧ ¬u14) ∧ u11 ∧ ¬u15",
    "(u14 ∧ u11 ∧ u15 ∨ x14 ∧ ¬u13) ∧ u11 ∧ ¬u15",
    "(u12 ∧ u13 ∧ u15 ∨ x15 ∧ ¬u14) ∧ u12 ∧ ¬u15",
    "(u14 ∧ u12 ∧ ¬u15 ∨ x16 ∧ ¬u13) ∧ u12 ∧ ¬u15",
    "(u11 ∧ u14 ∨ x17 ∧ (¬u12 ∨ ¬u14)) ∧ ¬u15",
];

/// (25).
const ROBOT_OUTPUTS: [&str; 5] = [
    "x11 ∧ u13 ∧ ¬u15",
    "x12 ∧ u13 ∧ ¬u15",
    "(x13 ∨ x15) ∧ ¬u15",
    "(x14 ∨ x16) ∧ ¬u15",
    "x17 ∧ ¬u15",
];

/// (28).
const PRESS_STATES: [&str; 2] = ["(u20 ∧ u21 ∨ x21 ∧ ¬u22) ∧ ¬u23", "(u22 ∨ x22 ∧ ¬u21) ∧ ¬u23"];

/// (29).
const PRESS_OUTPUTS: [&str; 2] = ["x21 ∧ ¬u23", "x22 ∧ ¬u23"];

/// (22)-(25).
pub(crate) fn robot() -> Circuit {
    program("robot", '1', 6, &ROBOT_STATES, &ROBOT_OUTPUTS)
}

/// (26)-(29).
pub(crate) fn press() -> Circuit {
    program("press", '2', 4, &PRESS_STATES, &PRESS_OUTPUTS)
}

fn program(name: &str, own: char, inputs: usize, states: &[&str], outputs: &[&str]) -> Circuit {
    let mut builder = CircuitBuilder::new(name);
    let mut signals: Vec<(String, Expression)> = Vec::new();
    for number in 0..inputs {
        let symbol = format!("u{own}{number}");
        signals.push((symbol.clone(), builder.input(symbol)));
    }
    let mut registers = Vec::new();
    for number in 1..=states.len() {
        let symbol = format!("x{own}{number}");
        let (register, value) = builder.register(symbol.clone(), false);
        registers.push(register);
        signals.push((symbol, value));
    }
    let signal = |symbol: &str| {
        let found = signals.iter().find(|(other, _)| other == symbol);
        found.expect("a symbol of the program").1
    };
    for (&register, row) in registers.iter().zip(states) {
        let next = parse(builder.graph(), row, &signal);
        builder.set_next(register, next);
    }
    for (number, row) in outputs.iter().enumerate() {
        let value = parse(builder.graph(), row, &signal);
        builder.output(format!("y{own}{}", number + 1), value);
    }
    builder.finish().expect("symbols are distinct")
}

/// Reads a formula in either of the paper's notations: ∨, ∧ and ¬, or sums and products side by side.
pub(crate) fn parse(
    graph: &mut Graph,
    text: &str,
    signal: &dyn Fn(&str) -> Expression,
) -> Expression {
    let signs: Vec<char> = text.chars().filter(|sign| *sign != ' ').collect();
    let mut reader = Reader { graph, signs: &signs, signal };
    let root = reader.sum();
    assert!(reader.signs.is_empty(), "{text}: stopped at {:?}", reader.signs);
    root
}

struct Reader<'a> {
    graph: &'a mut Graph,
    signs: &'a [char],
    signal: &'a dyn Fn(&str) -> Expression,
}

impl Reader<'_> {
    fn take(&mut self, sign: char) -> bool {
        let found = self.signs.first() == Some(&sign);
        self.signs = &self.signs[usize::from(found)..];
        found
    }

    fn sum(&mut self) -> Expression {
        let mut left = self.product();
        loop {
            if self.take('∨') {
                let right = self.product();
                left = self.graph.or(left, right);
            } else if self.take('+') {
                let right = self.product();
                left = self.graph.xor(left, right);
            } else {
                return left;
            }
        }
    }

    fn product(&mut self) -> Expression {
        let mut left = self.factor();
        while self.take('∧') || matches!(self.signs.first(), Some('(' | 'u' | 'x')) {
            let right = self.factor();
            left = self.graph.and(left, right);
        }
        left
    }

    fn factor(&mut self) -> Expression {
        if self.take('¬') {
            let operand = self.factor();
            self.graph.not(operand)
        } else if self.take('(') {
            let inner = self.sum();
            assert!(self.take(')'), "a parenthesis is open");
            inner
        } else if self.take('1') {
            self.graph.constant(true)
        } else {
            let (symbol, rest) = self.signs.split_at(3);
            self.signs = rest;
            (self.signal)(&symbol.iter().collect::<String>())
        }
    }
}
