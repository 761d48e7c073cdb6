//! Expressions, literals, types and initial values.

use std::fmt::Write as _;

use understudy_typed::{Comparison, Elementary, text_literal};

use crate::lexer::calendar;
use crate::syntax::{
    Argument, Expression, ExpressionKind, Initializer, Literal, Operator, Path, Step, TypeKind,
    TypeName,
};

/// One expression, with the brackets that it needs and those that show how operators bind.
pub fn expression(of: &Expression) -> String {
    match &of.kind {
        ExpressionKind::Literal(found) => literal(found),
        ExpressionKind::Variable(found) => path(found),
        ExpressionKind::Qualified(of, name) => format!("{of}#{name}"),
        ExpressionKind::Not(inner) => format!("NOT {}", operand_of_sign(inner)),
        ExpressionKind::Minus(inner) => format!("-{}", operand_of_sign(inner)),
        ExpressionKind::Call(called, arguments) => format!("{}({})", path(called), list(arguments)),
        ExpressionKind::Faulty => "FALSE".into(),
        ExpressionKind::Chain(first, rest) => {
            let rank = rest.first().map_or(0, |(operator, _)| operator.rank());
            let mut text = operand(first, rank, true);
            for (operator, right) in rest {
                let _ = write!(text, " {} {}", operator.sign(), operand(right, rank, false));
            }
            text
        }
    }
}

/// What a NOT or a minus is in front of.
fn operand_of_sign(of: &Expression) -> String {
    match &of.kind {
        ExpressionKind::Chain(..) | ExpressionKind::Minus(_) | ExpressionKind::Not(_) => {
            format!("({})", expression(of))
        }
        _ => expression(of),
    }
}

/// An operand of operators of this rank.
fn operand(of: &Expression, rank: u8, is_first: bool) -> String {
    let add = Operator::Add.rank();
    let compare = Operator::Compare(Comparison::Equal).rank();
    let is_bare = match &of.kind {
        ExpressionKind::Chain(_, inner) => {
            inner.first().is_some_and(|(operator, _)| operator.rank() > rank)
        }
        ExpressionKind::Minus(_) => is_first && rank <= add,
        ExpressionKind::Not(_) => rank < compare,
        ExpressionKind::Literal(Literal::Integer { value, .. }) => *value >= 0 || is_first,
        _ => true,
    };
    match is_bare {
        true => expression(of),
        false => format!("({})", expression(of)),
    }
}

pub(super) fn argument(of: &Argument) -> String {
    match of {
        Argument::Placed(value) => expression(value),
        Argument::Given(name, value) => format!("{name} := {}", expression(value)),
        Argument::Taken { from, to, negated } => {
            let not = if *negated { "NOT " } else { "" };
            format!("{not}{from} => {}", path(to))
        }
    }
}

pub(super) fn list(arguments: &[Argument]) -> String {
    let printed: Vec<String> = arguments.iter().map(argument).collect();
    printed.join(", ")
}

pub(super) fn path(of: &Path) -> String {
    let mut text = of.root.to_string();
    for step in &of.steps {
        let _ = match step {
            Step::Field(name) => write!(text, ".{name}"),
            Step::Index(indices) => {
                let printed: Vec<String> = indices.iter().map(expression).collect();
                write!(text, "[{}]", printed.join(", "))
            }
            Step::Bits { width: 1, number, .. } => write!(text, ".{number}"),
            Step::Bits { width, number, .. } => {
                let letter = match width {
                    8 => 'B',
                    16 => 'W',
                    _ => 'D',
                };
                write!(text, ".%{letter}{number}")
            }
            Step::Follow => write!(text, "^"),
        };
    }
    text
}

pub(super) fn literal(of: &Literal) -> String {
    let typed = |of: &Option<Elementary>, text: String| match of {
        Some(of) => format!("{of}#{text}"),
        None => text,
    };
    match of {
        Literal::Boolean(true) => "TRUE".into(),
        Literal::Boolean(false) => "FALSE".into(),
        Literal::Integer { value, of, based } => {
            let is_bits = of.map_or(*based, |of| of.is_bit_string() && of != Elementary::Bool);
            match is_bits && (*value > 9 || of.is_none()) {
                true => typed(of, format!("16#{value:X}")),
                false => typed(of, value.to_string()),
            }
        }
        Literal::Real { text, of } => typed(of, text.clone()),
        Literal::Time { nanoseconds, of } => time(*nanoseconds, *of),
        Literal::Text { bytes, wide } => text_literal(bytes, *wide),
    }
}

fn time(nanoseconds: i64, of: Elementary) -> String {
    const DAY: i64 = 86_400_000_000_000;
    let days = nanoseconds.div_euclid(DAY);
    let in_day = nanoseconds.rem_euclid(DAY);
    let date = || {
        let (year, month, day) = calendar(days);
        format!("{year:04}-{month:02}-{day:02}")
    };
    let clock = || {
        let seconds = in_day / 1_000_000_000;
        let (hours, minutes) = (seconds / 3_600, seconds / 60 % 60);
        let fraction = format!("{:09}", in_day % 1_000_000_000);
        let fraction = fraction.trim_end_matches('0');
        let point = if fraction.is_empty() { "" } else { "." };
        format!("{hours:02}:{minutes:02}:{:02}{point}{fraction}", seconds % 60)
    };
    match of {
        Elementary::Date => format!("D#{}", date()),
        Elementary::TimeOfDay => format!("TOD#{}", clock()),
        Elementary::DateAndTime => format!("DT#{}-{}", date(), clock()),
        _ => duration(nanoseconds),
    }
}

/// `T#1m30s`; with microseconds, which only `LTIME` has elsewhere, `LTIME#1us`.
fn duration(nanoseconds: i64) -> String {
    const UNITS: [(&str, u64); 7] = [
        ("d", 86_400_000_000_000),
        ("h", 3_600_000_000_000),
        ("m", 60_000_000_000),
        ("s", 1_000_000_000),
        ("ms", 1_000_000),
        ("us", 1_000),
        ("ns", 1),
    ];
    let mut rest = nanoseconds.unsigned_abs();
    let word = if rest.is_multiple_of(1_000_000) { "T" } else { "LTIME" };
    let sign = if nanoseconds < 0 { "-" } else { "" };
    let mut text = format!("{word}#{sign}");
    if rest == 0 {
        text.push_str("0ms");
    }
    for (unit, length) in UNITS {
        if rest >= length {
            let _ = write!(text, "{}{unit}", rest / length);
            rest %= length;
        }
    }
    text
}

/// A type as it is written behind the colon of a declaration; structures are on one line.
pub fn type_name(of: &TypeName) -> String {
    match &of.kind {
        TypeKind::Named(name) => name.to_string(),
        TypeKind::Subrange(name, first, last) => {
            format!("{name} ({}..{})", expression(first), expression(last))
        }
        TypeKind::Text { wide, length } => {
            let word = if *wide { "WSTRING" } else { "STRING" };
            match length {
                Some(length) => format!("{word}[{}]", expression(length)),
                None => word.into(),
            }
        }
        TypeKind::Array(ranges, element) => {
            let printed: Vec<String> = ranges
                .iter()
                .map(|(first, last)| format!("{}..{}", expression(first), expression(last)))
                .collect();
            format!("ARRAY [{}] OF {}", printed.join(", "), type_name(element))
        }
        TypeKind::OpenArray(dimensions, element) => {
            let stars = vec!["*"; *dimensions].join(", ");
            format!("ARRAY [{stars}] OF {}", type_name(element))
        }
        TypeKind::Structure(fields) => {
            let printed: Vec<String> = fields.iter().map(super::declaration::declared).collect();
            format!("STRUCT {} END_STRUCT", printed.join(" "))
        }
        TypeKind::Enumeration(values, base) => {
            let printed: Vec<String> = values
                .iter()
                .map(|(name, value)| match value {
                    Some(value) => format!("{name} := {}", expression(value)),
                    None => name.to_string(),
                })
                .collect();
            let base = base.as_ref().map(|base| format!(" {base}"));
            format!("({}){}", printed.join(", "), base.unwrap_or_default())
        }
        TypeKind::Pointer(to) => format!("REF_TO {}", type_name(to)),
    }
}

/// An initial value as it is written behind its `:=`.
pub fn initializer(of: &Initializer) -> String {
    match of {
        Initializer::Value(value) => expression(value),
        Initializer::Array(elements, _) => {
            let printed: Vec<String> = elements
                .iter()
                .map(|(count, values)| {
                    let values: Vec<String> = values.iter().map(initializer).collect();
                    match count {
                        Some(count) => format!("{}({})", expression(count), values.join(", ")),
                        None => values.join(", "),
                    }
                })
                .collect();
            format!("[{}]", printed.join(", "))
        }
        Initializer::Structure(fields, _) => {
            let printed: Vec<String> = fields
                .iter()
                .map(|(name, value)| format!("{name} := {}", initializer(value)))
                .collect();
            format!("({})", printed.join(", "))
        }
    }
}
