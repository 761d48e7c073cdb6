//! The naive execution: a value for each name, and the blocks as the library of matiec writes them.

use std::collections::HashMap;
use std::ops::ControlFlow;

use super::text::{Number, Statement, Text, Truth};

#[derive(Default)]
struct Timer {
    state: u8,
    previous: bool,
    output: bool,
    start: u64,
}

pub(crate) struct Execution {
    now: u64,
    truths: HashMap<String, bool>,
    numbers: HashMap<String, i128>,
    timers: HashMap<&'static str, Timer>,
}

/// Two's complement of 8 bits.
fn short(value: i128) -> i128 {
    i128::from(value as i8)
}

fn word(value: i128) -> i128 {
    i128::from(value as i16)
}

impl Execution {
    pub(crate) fn new() -> Self {
        Self {
            now: 0,
            truths: [("y1".to_owned(), true)].into(),
            numbers: [("v".to_owned(), 3), ("n2".to_owned(), -7)].into(),
            timers: HashMap::new(),
        }
    }

    pub(crate) fn execute(&mut self, text: &Text, inputs: &[bool]) {
        for (name, value) in ["a0", "a1", "a2"].into_iter().zip(inputs) {
            self.truths.insert(name.into(), *value);
        }
        let u = inputs[3..]
            .iter()
            .rev()
            .fold(0, |sum, bit| sum * 2 + i128::from(*bit));
        self.numbers.insert("u".into(), u);
        let _left = self.list(&text.body);
        self.now += 1;
    }

    /// Bits of the named outputs; a number's bits stand behind a dot.
    pub(crate) fn outputs(&self, names: &[&str]) -> Vec<bool> {
        names
            .iter()
            .map(|name| match name.split_once('.') {
                None => self.is(name),
                Some((name, place)) => {
                    self.value(name) >> place.parse::<u32>().expect("a place") & 1 == 1
                }
            })
            .collect()
    }

    fn is(&self, name: &str) -> bool {
        self.truths.get(name).copied().unwrap_or(false)
    }

    fn value(&self, name: &str) -> i128 {
        self.numbers.get(name).copied().unwrap_or(0)
    }

    fn put(&mut self, name: impl Into<String>, value: bool) {
        self.truths.insert(name.into(), value);
    }

    fn truth(&self, truth: &Truth) -> bool {
        match truth {
            Truth::Constant(value) => *value,
            Truth::Variable(name) => self.is(name),
            Truth::Not(inner) => !self.truth(inner),
            Truth::Join(word, parts) => {
                let mut values = parts.iter().map(|part| self.truth(part));
                let first = values.next().expect("an operand");
                values.fold(first, |left, right| match *word {
                    "AND" => left & right,
                    "OR" => left | right,
                    "=" => left == right,
                    _ => left != right,
                })
            }
            Truth::Compare(word, left, right) => {
                let (left, right) = (self.number(left), self.number(right));
                match *word {
                    "=" => left == right,
                    "<>" => left != right,
                    "<" => left < right,
                    "<=" => left <= right,
                    ">" => left > right,
                    _ => left >= right,
                }
            }
        }
    }

    fn number(&self, number: &Number) -> i128 {
        match number {
            Number::Constant(value) => (*value).into(),
            Number::Variable(name) => self.value(name),
            Number::Join(word, left, right) => {
                let (left, right) = (self.number(left), self.number(right));
                match *word {
                    "+" => left + right,
                    "-" => left - right,
                    _ => left * right,
                }
            }
            Number::Divide("/", number, by) => self.number(number) / i128::from(*by),
            Number::Divide(_, number, by) => self.number(number) % i128::from(*by),
            Number::Negated(inner) => -self.number(inner),
            Number::Better("MIN", left, right) => self.number(left).min(self.number(right)),
            Number::Better(_, left, right) => self.number(left).max(self.number(right)),
            Number::Absolute(inner) => self.number(inner).abs(),
            Number::Select(which, first, second) => {
                self.number(if self.truth(which) { second } else { first })
            }
        }
    }

    /// Breaks with the word that leaves the list.
    fn list(&mut self, statements: &[Statement]) -> ControlFlow<&'static str> {
        for statement in statements {
            self.statement(statement)?;
        }
        ControlFlow::Continue(())
    }

    fn statement(&mut self, statement: &Statement) -> ControlFlow<&'static str> {
        match statement {
            Statement::Leave(when, word) => {
                if self.truth(when) {
                    return ControlFlow::Break(*word);
                }
            }
            Statement::SetTruth(name, value) => {
                let value = self.truth(value);
                self.put(*name, value);
            }
            Statement::SetNumber(name, value) => {
                let value = self.number(value);
                let value = match *name {
                    "n0" => i128::from(value as u8),
                    "n1" => word(value),
                    _ => short(value),
                };
                self.numbers.insert((*name).into(), value);
            }
            Statement::If(branches, otherwise) => {
                let taken = branches.iter().find(|(condition, _)| self.truth(condition));
                let taken = taken.map_or(otherwise, |(_, branch)| branch);
                self.list(taken)?;
            }
            Statement::Case(name, branches, otherwise) => {
                let value = self.value(name);
                let fits = |first: &i64, last: &i64| {
                    i128::from(*first) <= value && value <= i128::from(*last)
                };
                let taken = branches.iter().find(|(first, last, _)| fits(first, last));
                self.list(taken.map_or(otherwise, |(_, _, branch)| branch))?;
            }
            Statement::For(from, to, body) => {
                for _ in *from..=*to {
                    match self.list(body) {
                        ControlFlow::Break("EXIT") => break,
                        ControlFlow::Break("RETURN") => return ControlFlow::Break("RETURN"),
                        _ => {}
                    }
                }
            }
            Statement::Trigger(name, clock) => {
                let clock = self.truth(clock) == (*name == "rise");
                let memory = format!("{name}.M");
                let output = clock && !self.is(&memory);
                self.put(memory, clock);
                self.put(format!("{name}.Q"), output);
            }
            Statement::Latch(name, set, reset) => {
                let (set, reset) = (self.truth(set), self.truth(reset));
                let output = format!("{name}.Q1");
                let old = self.is(&output);
                let new = if *name == "set_first" {
                    set || !reset && old
                } else {
                    !reset && (set || old)
                };
                self.put(output, new);
            }
            Statement::Count(name, clock, reset, preset) => {
                let (clock, reset) = (self.truth(clock), self.truth(reset));
                let preset = word(self.number(preset));
                let memory = format!("{name}.M");
                let up = clock && !self.is(&memory);
                self.put(memory, clock);
                let count = self.value(&format!("{name}.CV"));
                let count = match (reset, up && count < preset) {
                    (true, _) => 0,
                    (false, true) => count + 1,
                    (false, false) => count,
                };
                self.numbers.insert(format!("{name}.CV"), count);
                self.put(format!("{name}.Q"), count >= preset);
            }
            Statement::Timer(word, name, wire, scans) => {
                let wire = self.truth(wire);
                let output = self.timer(word, name, wire, u64::from(*scans));
                self.put(format!("{name}.Q"), output);
            }
            Statement::Stop => {
                let output = self.timer("TON", "late", false, 0);
                self.put("late.Q", output);
            }
            Statement::Total(name, enable, value) => {
                let (enable, value) = (self.truth(enable), short(self.number(value)));
                let sum = self.value(&format!("{name}.sum"));
                let sum = if enable { short(sum + value) } else { sum };
                self.numbers.insert(format!("{name}.sum"), sum);
                self.put(format!("{name}.big"), 2 * sum > 20);
            }
        }
        ControlFlow::Continue(())
    }

    /// State 0 waits, 1 runs, 2 is over.
    fn timer(&mut self, word: &str, name: &'static str, input: bool, preset: u64) -> bool {
        let now = self.now;
        let timer = self.timers.entry(name).or_default();
        let is_over = timer.state == 1 && timer.start + preset <= now;
        match word {
            "TON" => {
                if timer.state == 0 && !timer.previous && input {
                    (timer.state, timer.output, timer.start) = (1, false, now);
                } else if !input {
                    (timer.state, timer.output) = (0, false);
                } else if is_over {
                    (timer.state, timer.output) = (2, true);
                }
            }
            "TOF" => {
                if timer.state == 0 && timer.previous && !input {
                    (timer.state, timer.start) = (1, now);
                } else if input {
                    timer.state = 0;
                } else if is_over {
                    timer.state = 2;
                }
                timer.output = input || timer.state == 1;
            }
            _ => {
                if timer.state == 0 && !timer.previous && input {
                    (timer.state, timer.output, timer.start) = (1, true, now);
                } else if is_over {
                    (timer.state, timer.output) = (2, false);
                }
                if timer.state == 2 && !input {
                    timer.state = 0;
                }
            }
        }
        timer.previous = input;
        timer.output
    }
}
