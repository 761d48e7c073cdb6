//! What is said about texts that are wrong: everything in one run, with place and way out.

use std::fmt::Write;

use proptest::prelude::*;
use understudy_ladder::{
    KEYWORDS, MAXIMUM_NAME_LENGTH, MAXIMUM_NESTING, MAXIMUM_RUNGS, MAXIMUM_TEXT_BYTES, draw_text,
    parse, print,
};
use understudy_text::{Report, Severity};

/// All diagnostics as lines: place, severity, code, message, label, related places, help.
fn report(text: &str) -> String {
    let report = Report {
        name: "test.ladder".into(),
        text: text.into(),
        diagnostics: parse(text).diagnostics,
    };
    let mut lines = String::new();
    for found in &report.diagnostics {
        let severity = match found.severity {
            Severity::Error => "error",
            Severity::Warning => "warning",
        };
        let place = report.line_and_column(found.span.start);
        let _ = write!(lines, "{place} {severity} {}: {}", found.code, found.message);
        if let Some(label) = &found.label {
            let _ = write!(lines, " [{label}]");
        }
        for related in &found.related {
            let place = report.line_and_column(related.span.start);
            let _ = write!(lines, " ({place} {})", related.message);
        }
        if let Some(help) = &found.help {
            let _ = write!(lines, "\n    {help}");
        }
        lines.push('\n');
    }
    lines
}

const HEAD: &str = "program p\ninput a\ninput b\noutput y\nmemory m\n";

/// The same with rungs that use every name below the text, so that only what the text does is reported.
const TAIL: &str = "\nrung a b y m (S m)";

/// Snapshots each text beside what is said about it; one that begins with a rung stands between [`HEAD`] and [`TAIL`].
fn check(name: &str, texts: &[&str]) {
    let mut all = String::new();
    for text in texts {
        let whole = if text.starts_with("rung") {
            format!("{HEAD}{text}{TAIL}")
        } else {
            (*text).to_owned()
        };
        let _ = writeln!(all, "{text}\n{}", report(&whole).trim_end());
        let _ = writeln!(all, "{}", "-".repeat(40));
    }
    insta::assert_snapshot!(name, all);
}

#[test]
fn a_text_full_of_errors_is_reported_in_one_run() {
    let text = include_str!("full-of-errors.ladder");
    insta::assert_snapshot!("full-of-errors", report(text));
}

#[test]
fn nothing_is_said_about_sound_programs() {
    let check = |text: &str| assert_eq!(report(text), "", "{text}");
    // A seal-in.
    check("program p\ninput a\ninput b\noutput y\nrung [ a | y ] /b (y)");
    // A latch read above its coils.
    check(
        "program p\ninput a\ninput b\noutput y\nmemory m\nrung m (y)\nrung a (S m)\nrung b (R m)",
    );
    // A state, said to be one.
    check("program p\ninput a\noutput y\nmemory m = 0\nrung m (y)\nrung a (m)");
    // A constant.
    check("program p\noutput y\nmemory on = 1\nrung on (y)");
    // A blinker reads its own timer's last scan.
    check("program p\noutput y\nrung /t.Q {TON t 1s}\nrung t.Q (y)");
}

#[test]
fn what_is_suspicious_is_a_warning() {
    check(
        "suspicious",
        &[
            "program p\ninput a\noutput y\nrung (y)",
            "program p\ninput a\noutput y\noutput z\nmemory m\nrung a (y)",
            "program p\ninput a\noutput y\nmemory m\nrung a (m) (y)",
            "program p\noutput y\nmemory m\nrung m (y)",
            "program p\ninput a\noutput y\nrung a (y)\nrung /a (y)",
            "program p\ninput a\noutput y\nmemory m\nrung m (y)\nrung a (m)",
        ],
    );
}

#[test]
fn what_a_rung_gets_wrong() {
    check(
        "rungs",
        &[
            "rung a",
            "rung a (y) b",
            "rung [ a | b (y)",
            "rung [ a | ] b ] (y",
            "rung a | b (y) ( ) (/)",
            "rung !a ^b ~a # (y)",
            "rung aa / (y)\nrung a (aa) (S a)",
        ],
    );
}

#[test]
fn what_a_block_gets_wrong() {
    check(
        "blocks",
        &[
            "rung a {TNO t 1s} {TON} {TON u} {TON v 5} (y)",
            "rung a {CTU c 40000} {TON t 1x} {TON u 5s3m} {TON v 101d} (y)",
            "rung a {CTU c 4 LD=b} {TON c 1s} {SR s} {CTU d 4 R=a R=b} {CTU e 1 CU=a} (y)",
            "rung a {TON t 1s} {TON a 1s} t t.QQ t.CV>3 m.CV=1 q.CV=1 /t.CV<2 (t.Q)",
            "rung a {SR s R=} {SR t R a} {SR u R=b (y)",
        ],
    );
}

#[test]
fn what_declarations_get_wrong() {
    check(
        "declarations",
        &[
            "imput a\nprogram p q\ninput a at %QX0.1 = 1\ninput\noutput y at\noutput y = 2\noutput x at %IX\nmemory rung\nmemory m at %MX0.0 garbage\nmemory n at %MX0.0\nprogram q",
            "",
        ],
    );
}

#[test]
fn what_retain_gets_wrong() {
    check(
        "retain",
        &[
            "rung a {TON t 1s} {CTU c 3} (y)\nretain y, t,\n  m -- why\nretain c",
            "rung a {TON t 1s} (y)\nretain y, a, t.Q, n, y",
            "rung a (y)\nretain\nretain y m\nretain y,\nrung b (y)\nretain m, 5",
        ],
    );
}

#[test]
fn every_bound_is_an_error() {
    let codes = |text: &str| -> Vec<&'static str> {
        let diagnostics = parse(text).diagnostics.into_iter();
        let errors = diagnostics.filter(|found| found.severity == Severity::Error);
        errors.map(|found| found.code).collect()
    };
    let nested =
        |depth: usize| format!("{HEAD}rung {}a{} (y)", "[ b | ".repeat(depth), " ]".repeat(depth));
    assert_eq!(codes(&nested(MAXIMUM_NESTING)), [""; 0]);
    assert_eq!(codes(&nested(MAXIMUM_NESTING + 1)), ["U0113", "U0118"]);
    assert_eq!(codes(&nested(100_000)), ["U0113", "U0118"]);
    let named = |length: usize| format!("program {}", "n".repeat(length));
    assert_eq!(codes(&named(MAXIMUM_NAME_LENGTH)), [""; 0]);
    assert_eq!(codes(&named(MAXIMUM_NAME_LENGTH + 1)), ["U0114"]);
    let many = |rungs: usize| format!("{HEAD}{}", "rung a(y)\n".repeat(rungs));
    assert_eq!(codes(&many(MAXIMUM_RUNGS)), [""; 0]);
    assert_eq!(codes(&many(MAXIMUM_RUNGS + 1)), ["U0115"]);
    assert_eq!(codes(&" ".repeat(MAXIMUM_TEXT_BYTES + 1)), ["U0112"]);
}

#[test]
fn a_large_text_that_is_all_wrong_is_read_in_bounded_time() {
    let mut text = String::from(HEAD);
    for index in 0..20_000 {
        let _ = writeln!(text, "rung wrong_name_{index} ] ( [ )");
    }
    let found = parse(&text).diagnostics;
    assert!((10_000..40_000).contains(&found.len()), "{}", found.len());
    assert!(found.iter().any(|found| found.code == "U0617"));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_text_is_read(text in "\\PC{0,60}") {
        survives(&text);
    }

    #[test]
    fn any_mix_of_lexemes_is_read(words in proptest::collection::vec(0_usize..46, 0..60)) {
        let all = WORDS.split(' ').chain(["-- comment\n", "\n"]).chain(KEYWORDS);
        let all: Vec<&str> = all.collect();
        let words: Vec<&str> = words.into_iter().map(|word| all[word]).collect();
        survives(&words.join(" "));
    }

    #[test]
    fn a_sound_text_with_a_hole_is_read(start in 0_usize..900, length in 0_usize..40) {
        let text = include_str!("every-element.ladder");
        let (start, end) = (start.min(text.len()), (start + length).min(text.len()));
        survives(&format!("{}{}", &text[..start], &text[end..]));
    }
}

/// Lexemes by blanks; a comment ends with its line.
const WORDS: &str = r#"a b y S R t t.Q t.CV [ ] | ( ) { } / + - = < >= <> 0 1 99999 300ms 1x %IX0.0 %QX0.1 % "text" " TON CTU SR R_TRIG ! é"#;

/// Any text gives diagnostics inside of it and a program that can be printed and drawn; one without errors comes back.
fn survives(text: &str) {
    let parsed = parse(text);
    for found in &parsed.diagnostics {
        assert!(found.span.start <= found.span.end && found.span.end <= text.len());
        assert!(text.get(found.span.clone()).is_some(), "{found:?}");
    }
    let printed = print(&parsed.program);
    let _ = draw_text(&parsed.program);
    if let Ok((program, _)) = parsed.into_result() {
        assert_eq!(parse(&printed).program, program, "{printed}");
    }
}
