//! The reader of durations and the pattern of the schemas agree.

use std::collections::BTreeSet;
use std::io::Write;
use std::process::{Command, Stdio};

use understudy_text::duration::{parse, pattern};

const NUMBERS: [&str; 11] = ["", "0", "7", "10", "007", "1.5", "0.25", "1.", ".5", "-1", "1e3"];

const UNITS: [&str; 14] =
    ["", "d", "h", "m", "min", "s", "ms", "us", "ns", "S", "sec", "y", "µs", "%"];

/// Each number with each unit, with and without a blank, and pairs of such parts.
fn spellings() -> BTreeSet<String> {
    let mut parts = Vec::new();
    for number in NUMBERS {
        for unit in UNITS {
            parts.push(format!("{number}{unit}"));
            parts.push(format!("{number} {unit}"));
        }
    }
    let mut spellings: BTreeSet<String> = parts.iter().cloned().collect();
    for first in &parts {
        for second in parts.iter().step_by(3) {
            spellings.insert(format!("{first}{second}"));
            spellings.insert(format!(" {first}  {second} "));
        }
    }
    spellings.extend(["1d2h3m4s5ms6us7ns", "1d 2h 3min 4.5s", "1h2m3", "1  s"].map(String::from));
    spellings
}

#[test]
fn the_pattern_matches_what_the_reader_accepts() {
    let spellings = spellings();
    let accepted: BTreeSet<&String> = spellings.iter().filter(|text| has_form(text)).collect();
    assert!(accepted.len() > 500, "{}", accepted.len());
    assert_eq!(matched(&spellings), accepted);
}

/// Whether the reader accepts a text, or refuses it only for its bound, which is beyond a pattern.
fn has_form(text: &str) -> bool {
    match parse(text) {
        Ok(_) => true,
        Err(error) => error.to_string().ends_with("expected at most 100 days"),
    }
}

/// The spellings that match the pattern, as an extended regular expression of POSIX, which is a part of those of JSON Schema.
fn matched(spellings: &BTreeSet<String>) -> BTreeSet<&String> {
    let mut grep = Command::new("grep")
        .args(["-E", "-x", "-n", "-e", &pattern()])
        .env("LC_ALL", "C.UTF-8")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("grep runs");
    let lines: Vec<&String> = spellings.iter().collect();
    let input: String = lines.iter().map(|line| format!("{line}\n")).collect();
    let mut stdin = grep.stdin.take().expect("a pipe");
    let writer = std::thread::spawn(move || stdin.write_all(input.as_bytes()));
    let output = grep.wait_with_output().expect("grep ends");
    writer.join().expect("no panic").expect("grep reads all lines");
    let output = String::from_utf8(output.stdout).expect("text");
    let number = |line: &str| line.split_once(':').and_then(|(number, _)| number.parse().ok());
    let found: Vec<usize> = output.lines().filter_map(number).collect();
    found.into_iter().map(|number| lines[number - 1]).collect()
}
