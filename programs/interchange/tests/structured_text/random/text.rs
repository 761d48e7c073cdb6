//! Texts with everything that is taken, as trees of their own and as they are written.

use std::fmt;

use understudy_testing::random::Dice;

#[derive(Debug, Clone)]
pub(crate) enum Truth {
    Constant(bool),
    Variable(&'static str),
    Not(Box<Truth>),
    Join(&'static str, Vec<Truth>),
    Compare(&'static str, Number, Number),
}

#[derive(Debug, Clone)]
pub(crate) enum Number {
    Constant(i64),
    Variable(&'static str),
    Join(&'static str, Box<Number>, Box<Number>),
    /// `/` or `MOD` by a constant.
    Divide(&'static str, Box<Number>, i64),
    Negated(Box<Number>),
    Better(&'static str, Box<Number>, Box<Number>),
    Absolute(Box<Number>),
    Select(Box<Truth>, Box<Number>, Box<Number>),
}

#[derive(Debug, Clone)]
pub(crate) enum Statement {
    SetTruth(&'static str, Truth),
    SetNumber(&'static str, Number),
    If(Vec<(Truth, Vec<Statement>)>, Vec<Statement>),
    Case(&'static str, Vec<(i64, i64, Vec<Statement>)>, Vec<Statement>),
    For(i64, i64, Vec<Statement>),
    /// RETURN, or EXIT or CONTINUE in a loop.
    Leave(Truth, &'static str),
    /// R_TRIG and F_TRIG.
    Trigger(&'static str, Truth),
    Latch(&'static str, Truth, Truth),
    /// CTU with its preset.
    Count(&'static str, Truth, Truth, Number),
    /// Its preset in scans of 100 ms.
    Timer(&'static str, Truth, u32),
    /// `late` is stopped; this may happen anywhere.
    Stop,
    /// A block of the text: two inputs, and what it has added up.
    Total(&'static str, Truth, Number),
}

/// A program.
pub(crate) struct Text {
    pub(crate) body: Vec<Statement>,
}

const TRUTHS_READ: [&str; 20] = [
    "a0",
    "a1",
    "a2",
    "y0",
    "y1",
    "b0",
    "b1",
    "rise.Q",
    "fall.Q",
    "set_first.Q1",
    "reset_first.Q1",
    "up.Q",
    "many.Q",
    "on.Q",
    "off.Q",
    "pulse.Q",
    "late.Q",
    "linger.Q",
    "flash.Q",
    "total.big",
];
const TRUTHS_WRITTEN: [&str; 4] = ["y0", "y1", "b0", "b1"];
const NUMBERS_READ: [&str; 7] = ["u", "v", "n0", "n1", "n2", "up.CV", "total.sum"];
const NUMBERS_WRITTEN: [&str; 4] = ["v", "n0", "n1", "n2"];

fn pick<T: Copy>(dice: &mut Dice, from: &[T]) -> T {
    from[dice.below(from.len())]
}

fn small(dice: &mut Dice) -> i64 {
    i64::try_from(dice.below(16)).expect("small") - 4
}

fn truth(dice: &mut Dice, depth: usize) -> Truth {
    match dice.below(if depth == 0 { 4 } else { 9 }) {
        0 if dice.below(4) == 0 => Truth::Constant(dice.below(2) == 1),
        0..=3 => Truth::Variable(pick(dice, &TRUTHS_READ)),
        4 => Truth::Not(Box::new(truth(dice, depth - 1))),
        5 | 6 => {
            let word = pick(dice, &["AND", "OR", "XOR", "=", "<>"]);
            let count = if word.len() < 3 && word != "OR" { 2 } else { 2 + dice.below(2) };
            Truth::Join(word, (0..count).map(|_| truth(dice, depth - 1)).collect())
        }
        _ => {
            let word = pick(dice, &["=", "<>", "<", "<=", ">", ">="]);
            Truth::Compare(word, number(dice, depth - 1), number(dice, depth - 1))
        }
    }
}

fn leaf(dice: &mut Dice) -> Number {
    match dice.below(3) {
        0 => Number::Constant(small(dice)),
        _ => Number::Variable(pick(dice, &NUMBERS_READ)),
    }
}

fn number(dice: &mut Dice, depth: usize) -> Number {
    if depth == 0 {
        return leaf(dice);
    }
    let inner = |dice: &mut Dice| Box::new(number(dice, depth - 1));
    match dice.below(12) {
        0..=3 => leaf(dice),
        4 | 5 => Number::Join("+", inner(dice), inner(dice)),
        6 => Number::Join("-", inner(dice), inner(dice)),
        // Products of products need more bits than there are.
        7 => Number::Join("*", Box::new(leaf(dice)), Box::new(leaf(dice))),
        8 => Number::Divide(
            pick(dice, &["/", "MOD"]),
            inner(dice),
            pick(dice, &[1, 2, 3, 4, 7, 10, -3]),
        ),
        9 => Number::Negated(inner(dice)),
        10 => Number::Better(pick(dice, &["MIN", "MAX"]), inner(dice), inner(dice)),
        _ if dice.below(2) == 0 => Number::Absolute(inner(dice)),
        _ => Number::Select(Box::new(truth(dice, depth - 1)), inner(dice), inner(dice)),
    }
}

fn statements(dice: &mut Dice, count: usize, depth: usize) -> Vec<Statement> {
    (0..count).map(|_| statement(dice, depth)).collect()
}

fn statement(dice: &mut Dice, depth: usize) -> Statement {
    let deeper = depth.saturating_sub(1);
    match dice.below(if depth == 0 { 14 } else { 19 }) {
        0..=3 => Statement::SetTruth(pick(dice, &TRUTHS_WRITTEN), truth(dice, 3)),
        4..=7 => Statement::SetNumber(pick(dice, &NUMBERS_WRITTEN), number(dice, 2)),
        8 => Statement::Trigger(pick(dice, &["rise", "fall"]), truth(dice, 1)),
        9 => Statement::Latch(
            pick(dice, &["set_first", "reset_first"]),
            truth(dice, 1),
            truth(dice, 1),
        ),
        10 => {
            let (clock, reset) = (truth(dice, 1), truth(dice, 0));
            match dice.below(2) {
                0 => Statement::Count("up", clock, reset, Number::Constant(5)),
                _ => Statement::Count("many", clock, reset, leaf(dice)),
            }
        }
        11 => Statement::Total("total", truth(dice, 1), number(dice, 1)),
        12 => Statement::Stop,
        13 if dice.below(3) == 0 => Statement::Leave(truth(dice, 1), "RETURN"),
        13 => Statement::SetTruth("b1", truth(dice, 1)),
        14..=16 => {
            let branches = (0..1 + dice.below(3)).map(|_| {
                let condition = truth(dice, 2);
                let count = dice.below(3);
                (condition, statements(dice, count, deeper))
            });
            let branches = branches.collect();
            let count = dice.below(3);
            Statement::If(branches, statements(dice, count, deeper))
        }
        17 => {
            let mut first = -3;
            let branches = (0..1 + dice.below(3)).map(|_| {
                first += i64::try_from(dice.below(3)).expect("small");
                let last = first + i64::try_from(dice.below(3)).expect("small");
                let count = 1 + dice.below(2);
                let branch = (first, last, statements(dice, count, deeper));
                first = last + 1;
                branch
            });
            let branches = branches.collect();
            let count = dice.below(2);
            Statement::Case(
                pick(dice, &["u", "n0", "n1", "v"]),
                branches,
                statements(dice, count, deeper),
            )
        }
        _ => {
            let from = small(dice);
            let to = from + i64::try_from(dice.below(4)).expect("small") - 1;
            let count = 1 + dice.below(2);
            let mut body = statements(dice, count, deeper);
            if dice.below(2) == 0 {
                let word = pick(dice, &["EXIT", "CONTINUE", "RETURN"]);
                let leave = Statement::Leave(truth(dice, 1), word);
                body.insert(dice.below(body.len() + 1), leave);
            }
            Statement::For(from, to, body)
        }
    }
}

/// Timers that conditions decide about, each called once on a way through the text at most.
fn timed(dice: &mut Dice, depth: usize, timers: &[(&'static str, &'static str)]) -> Vec<Statement> {
    let mut list = Vec::new();
    for &(word, name) in timers {
        let count = dice.below(2);
        list.extend(statements(dice, count, 1));
        match dice.below(if depth == 0 { 2 } else { 4 }) {
            0 => {}
            1 => {
                let scans = match word {
                    "TP" => 3,
                    _ => pick(dice, &[0, 1, 3, 5]),
                };
                list.push(Statement::Timer(name, truth(dice, 2), scans));
            }
            _ => {
                let branches = (0..1 + dice.below(2))
                    .map(|_| (truth(dice, 1), timed(dice, depth - 1, &[(word, name)])));
                let branches = branches.collect();
                let otherwise = timed(dice, depth - 1, &[(word, name)]);
                list.push(Statement::If(branches, otherwise));
            }
        }
    }
    list
}

impl Text {
    pub(crate) fn random(dice: &mut Dice) -> Self {
        let mut body = Vec::new();
        // A timer stands where every execution passes, and once.
        for name in ["on", "off", "pulse"] {
            let count = dice.below(4);
            body.extend(statements(dice, count, 2));
            let scans = u32::try_from(dice.below(5)).expect("small");
            body.push(Statement::Timer(name, truth(dice, 2), scans));
        }
        let timers = [("TON", "late"), ("TOF", "linger"), ("TP", "flash")];
        body.extend(timed(dice, 3, &timers));
        let count = dice.below(4);
        body.extend(statements(dice, count, 2));
        Self { body }
    }
}

impl fmt::Display for Truth {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Constant(value) => out.write_str(if *value { "TRUE" } else { "FALSE" }),
            Self::Variable(name) => out.write_str(name),
            Self::Not(inner) => write!(out, "NOT ({inner})"),
            Self::Join(word, parts) => {
                let parts: Vec<String> = parts.iter().map(|part| format!("({part})")).collect();
                out.write_str(&parts.join(&format!(" {word} ")))
            }
            Self::Compare(word, left, right) => write!(out, "{left} {word} {right}"),
        }
    }
}

impl fmt::Display for Number {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Constant(value) => write!(out, "{value}"),
            Self::Variable(name) => out.write_str(name),
            Self::Join(word, left, right) => write!(out, "({left} {word} {right})"),
            Self::Divide(word, number, by) => write!(out, "(({number}) {word} {by})"),
            Self::Negated(inner) => write!(out, "(-({inner}))"),
            Self::Better(word, left, right) => write!(out, "{word}({left}, {right})"),
            Self::Absolute(inner) => write!(out, "ABS({inner})"),
            Self::Select(which, first, second) => write!(out, "SEL({which}, {first}, {second})"),
        }
    }
}

impl fmt::Display for Statement {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let list = |statements: &[Statement]| -> String {
            statements.iter().map(ToString::to_string).collect()
        };
        match self {
            Self::SetTruth(name, value) => writeln!(out, "{name} := {value};"),
            // A constant outside the subrange is refused; a number that is calculated may leave it.
            Self::SetNumber(name @ "n1", value) => writeln!(out, "{name} := u - u + ({value});"),
            Self::SetNumber(name, value) => writeln!(out, "{name} := {value};"),
            Self::If(branches, otherwise) => {
                for (place, (condition, branch)) in branches.iter().enumerate() {
                    let word = if place == 0 { "IF" } else { "ELSIF" };
                    writeln!(out, "{word} {condition} THEN\n{}", list(branch))?;
                }
                writeln!(out, "ELSE\n{}END_IF;", list(otherwise))
            }
            Self::Case(name, branches, otherwise) => {
                writeln!(out, "CASE {name} OF")?;
                for (first, last, branch) in branches {
                    if first == last {
                        writeln!(out, "{first}:\n{}", list(branch))?;
                    } else {
                        writeln!(out, "{first}..{last}:\n{}", list(branch))?;
                    }
                }
                writeln!(out, "ELSE\n{}END_CASE;", list(otherwise))
            }
            Self::For(from, to, body) => {
                writeln!(out, "FOR k := {from} TO {to} DO\n{}END_FOR;", list(body))
            }
            Self::Leave(when, word) => writeln!(out, "IF {when} THEN {word}; END_IF;"),
            Self::Trigger(name, clock) => writeln!(out, "{name}(CLK := {clock});"),
            Self::Latch("set_first", set, reset) => {
                writeln!(out, "set_first(S1 := {set}, R := {reset});")
            }
            Self::Latch(name, set, reset) => writeln!(out, "{name}(S := {set}, R1 := {reset});"),
            Self::Count(name, clock, reset, preset) => {
                writeln!(out, "{name}(CU := {clock}, R := {reset}, PV := {preset});")
            }
            Self::Timer(name, wire, scans) => {
                writeln!(out, "{name}(IN := {wire}, PT := T#{}ms);", scans * 100)
            }
            Self::Stop => writeln!(out, "late(IN := FALSE);"),
            Self::Total(name, enable, value) => {
                writeln!(out, "{name}(enable := {enable}, value := {value});")
            }
        }
    }
}

impl fmt::Display for Text {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            out,
            "FUNCTION twice : INT\n  VAR_INPUT x : INT; END_VAR\n  twice := 2 * x;\nEND_FUNCTION\n
FUNCTION_BLOCK Total
  VAR_INPUT enable : BOOL; value : INT; END_VAR
  VAR_OUTPUT sum : INT; big : BOOL; END_VAR
  IF enable THEN sum := sum + value; END_IF;
  big := twice(sum) > 20;
END_FUNCTION_BLOCK

PROGRAM random
  VAR_INPUT a0, a1, a2 : BOOL; u : INT (0..7); END_VAR
  VAR_OUTPUT y0 : BOOL; y1 : BOOL := TRUE; v : INT := 3; END_VAR
  VAR
    b0, b1 : BOOL; n0 : INT; n1 : INT (0..9); n2 : INT := -7; k : INT;
    rise : R_TRIG; fall : F_TRIG; set_first : SR; reset_first : RS; up, many : CTU;
    on, late : TON; off, linger : TOF; pulse, flash : TP; total : Total;
  END_VAR"
        )?;
        for statement in &self.body {
            write!(out, "{statement}")?;
        }
        writeln!(out, "END_PROGRAM")
    }
}
