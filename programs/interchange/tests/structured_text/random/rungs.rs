//! Texts whose statements are rungs.

use std::fmt::Write;

use understudy_testing::random::Dice;

const READ: [&str; 20] = [
    "a0",
    "a1",
    "a2",
    "y0",
    "y1",
    "b0",
    "b1",
    "%QX4.1",
    "rise.Q",
    "fall.Q",
    "set_first.Q1",
    "reset_first.Q1",
    "up.Q",
    "down.Q",
    "both.QU",
    "both.QD",
    "on.Q",
    "off.Q",
    "pulse.Q",
    "%IX3.0",
];
const WRITTEN: [&str; 5] = ["y0", "y1", "b0", "b1", "%QX4.1"];

fn pick<T: Copy>(dice: &mut Dice, from: &[T]) -> T {
    from[dice.below(from.len())]
}

fn truth(dice: &mut Dice, depth: usize) -> String {
    match dice.below(if depth == 0 { 4 } else { 10 }) {
        0 => {
            let relation = pick(dice, &["=", "<>", "<", "<=", ">", ">="]);
            let counter = pick(dice, &["up.CV", "down.CV", "both.CV"]);
            match dice.below(2) {
                0 => format!("({counter} {relation} {})", dice.below(6)),
                _ => format!("({} {relation} {counter})", dice.below(6)),
            }
        }
        1..=3 => pick(dice, &READ).to_owned(),
        4 | 5 => format!("NOT {}", truth(dice, depth - 1)),
        _ => {
            let operator = pick(dice, &["AND", "OR", "XOR", "AND", "OR", "=", "<>"]);
            let count = if operator.starts_with(['=', '<']) { 2 } else { 2 + dice.below(3) };
            let parts: Vec<String> = (0..count).map(|_| truth(dice, depth - 1)).collect();
            format!("({})", parts.join(&format!(" {operator} ")))
        }
    }
}

fn assignment(dice: &mut Dice) -> String {
    let target = pick(dice, &WRITTEN);
    match dice.below(4) {
        0 => format!("{target} := {};\n", pick(dice, &["TRUE", "FALSE", "NOT TRUE"])),
        _ => format!("{target} := {};\n", truth(dice, 3)),
    }
}

fn statement(dice: &mut Dice, depth: usize) -> String {
    if depth == 0 || dice.below(3) > 0 {
        return assignment(dice);
    }
    let mut text = String::new();
    for place in 0..1 + dice.below(3) {
        let word = if place == 0 { "IF" } else { "ELSIF" };
        let _ = writeln!(text, "{word} {} THEN", truth(dice, 2));
        for _ in 0..dice.below(3) {
            text.push_str(&statement(dice, depth - 1));
        }
    }
    if dice.below(2) == 0 {
        text.push_str("ELSE\n");
        for _ in 0..dice.below(3) {
            text.push_str(&statement(dice, depth - 1));
        }
    }
    text.push_str("END_IF;\n");
    text
}

/// A call of each standard block, in any order, between assignments and conditions.
pub(crate) fn text(dice: &mut Dice) -> String {
    let mut body = String::new();
    let mut names = vec![
        "rise",
        "fall",
        "set_first",
        "reset_first",
        "up",
        "down",
        "both",
        "on",
        "off",
        "pulse",
    ];
    while !names.is_empty() {
        for _ in 0..dice.below(3) {
            body.push_str(&statement(dice, 3));
        }
        let name = names.swap_remove(dice.below(names.len()));
        let pins: &[&str] = match name {
            "rise" | "fall" => &["CLK"],
            "set_first" => &["S1", "R"],
            "reset_first" => &["S", "R1"],
            "up" => &["CU", "R"],
            "down" => &["CD", "LD"],
            "both" => &["CU", "CD", "R", "LD"],
            _ => &["IN"],
        };
        let mut given: Vec<String> =
            pins.iter().map(|pin| format!("{pin} := {}", truth(dice, 2))).collect();
        match name {
            "up" | "down" | "both" => given.push(format!("PV := {}", dice.below(6))),
            "on" | "off" | "pulse" => given.push(format!("PT := T#{}ms", 100 * dice.below(5))),
            _ => {}
        }
        if name == "on" && dice.below(2) == 0 {
            given.push(format!("Q => {}", pick(dice, &WRITTEN)));
        }
        let _ = writeln!(body, "{name}({});", given.join(", "));
    }
    format!(
        "PROGRAM random
VAR_INPUT a0, a1, a2 : BOOL; END_VAR
VAR_OUTPUT y0 : BOOL; y1 : BOOL := TRUE; END_VAR
VAR
  b0 : BOOL; b1 : BOOL := TRUE; rise : R_TRIG; fall : F_TRIG; set_first : SR; reset_first : RS;
  up : CTU; down : CTD; both : CTUD; on : TON; off : TOF; pulse : TP;
END_VAR
{body}END_PROGRAM
"
    )
}
