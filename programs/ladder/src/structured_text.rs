//! Structured Text of IEC 61131-3 that other compilers run as it is: a PROGRAM, and a CONFIGURATION whose task runs it.
//!
//! A ladder becomes statements in the order of its rungs, with its timers, counters, latches and triggers as instances of the standard
//! function blocks ([`structured_text`]). A circuit, such as that of the understudy, becomes Boolean assignments
//! ([`circuit_as_structured_text`]).

mod circuit;
mod power;
mod program;
mod sections;

use std::fmt::Write;
use std::time::Duration;

use understudy_text::duration;

use crate::names::Namer;

pub use self::circuit::circuit_as_structured_text;
pub(crate) use self::program::Written;
pub use self::program::{edge_names, structured_text};

/// Characters of a line past which a statement is broken before an operator.
const LINE_WIDTH: usize = 96;

/// A time literal of the standard, such as `T#1m30s`. The standard's smallest unit is the millisecond, with a fraction.
pub fn standard_time(time: Duration) -> String {
    let nanoseconds = time.subsec_nanos();
    if nanoseconds.is_multiple_of(1_000_000) {
        return format!("T#{}", duration::text(time));
    }
    let seconds = match time.as_secs() {
        0 => String::new(),
        seconds => duration::text(Duration::from_secs(seconds)),
    };
    let milliseconds = format!("{}.{:06}", nanoseconds / 1_000_000, nanoseconds % 1_000_000);
    format!("T#{seconds}{}ms", milliseconds.trim_end_matches('0'))
}

/// The CONFIGURATION that runs `program` every `period`.
fn configuration(text: &mut String, program: &str, period: Duration, namer: &mut Namer) {
    let mut name = |wanted: &str| namer.name(wanted);
    let (configuration, resource) = (name("configuration0"), name("resource0"));
    let (task, instance) = (name("task0"), name("instance0"));
    let interval = standard_time(period);
    let _ = write!(
        text,
        "
CONFIGURATION {configuration}
  RESOURCE {resource} ON PLC
    TASK {task}(INTERVAL := {interval}, PRIORITY := 0);
    PROGRAM {instance} WITH {task} : {program};
  END_RESOURCE
END_CONFIGURATION
"
    );
}

/// Declarations of one kind, one a line.
fn section(text: &mut String, word: &str, lines: &[String]) {
    if lines.is_empty() {
        return;
    }
    let _ = writeln!(text, "  {word}");
    for line in lines {
        let _ = writeln!(text, "    {line}");
    }
    text.push_str("  END_VAR\n");
}

/// A comment. Comments do not nest everywhere, so nothing in one looks like the beginning or the end of another.
fn comment(content: &str) -> String {
    let harmless = |character: char| {
        if character.is_control() { ' ' } else { character }
    };
    let mut content: String = content.chars().map(harmless).collect();
    // Once is not enough for `(*)`.
    for _ in 0..2 {
        content = content.replace("(*", "( *").replace("*)", "* )");
    }
    format!("(* {} *)", content.trim())
}

/// Writes a statement.
fn statement(text: &mut String, words: &[String]) {
    broken(text, words);
    text.push_str(";\n");
}

/// Writes words, broken before operators where the line is long.
fn broken(text: &mut String, words: &[String]) {
    let is_operator = |word: &String| matches!(word.as_str(), "AND" | "OR" | "XOR" | "THEN");
    let mut line = String::from(" ");
    for (place, word) in words.iter().enumerate() {
        if is_operator(word) {
            let behind = words[place + 1..].iter().take_while(|word| !is_operator(word));
            let length: usize = behind.map(|word| word.len() + 1).sum();
            if line.len() + 1 + word.len() + length > LINE_WIDTH {
                let _ = writeln!(text, "{line}");
                line = String::from("     ");
            }
        }
        if !line.ends_with('(') && !word.starts_with(')') {
            line.push(' ');
        }
        line.push_str(word);
    }
    text.push_str(&line);
}
