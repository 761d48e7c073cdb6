//! Exported chains, read back by code that shares nothing with the writer.

use understudy_reliability::{
    Chain, ChainBuilder, ExportForm, Hours, export_chain, export_properties,
};

/// A chain with an absorbing failure, two failures side by side, and a start that is not its first state.
fn chain() -> Chain {
    let mut builder = ChainBuilder::new();
    let degraded = builder.state("degraded");
    let whole = builder.state("whole\nhere");
    let (lost, dead) = (builder.failure("lost"), builder.failure(""));
    builder.start(whole);
    builder.transition(whole, degraded, 4e-4).transition(whole, lost, 1e-300);
    builder.transition(degraded, whole, 1.0 / 24.0).transition(degraded, dead, 3e-4);
    builder.transition(lost, whole, 0.1);
    builder.build().expect("a chain")
}

/// From, to and the rate; the failures; the start.
type Parts = (Vec<(usize, usize, f64)>, Vec<usize>, usize);

fn parts(chain: &Chain) -> Parts {
    let states = || 0..chain.states();
    let rows =
        states().flat_map(|from| chain.successors(from).map(move |(to, rate)| (from, to, rate)));
    (rows.collect(), states().filter(|state| chain.is_failure(*state)).collect(), chain.start())
}

fn number<T: std::str::FromStr>(text: &str) -> T {
    text.trim().parse().unwrap_or_else(|_| panic!("a number: {text}"))
}

/// The content of a text between two others.
fn between<'t>(text: &'t str, begin: &str, end: &str) -> &'t str {
    let (_, rest) = text.split_once(begin).unwrap_or_else(|| panic!("{begin} in {text}"));
    rest.split_once(end).unwrap_or_else(|| panic!("{end} in {rest}")).0
}

fn of_language(text: &str) -> Parts {
    let mut rows = Vec::new();
    for line in text.lines().filter(|line| line.trim_start().starts_with("[]")) {
        let from: usize = number(between(line, "s=", " ->"));
        for way in between(line, "-> ", ";").split(" + ") {
            let (rate, target) = way.split_once(':').expect("a rate and a target");
            rows.push((from, number(between(target, "(s'=", ")")), number(rate)));
        }
    }
    let mut failures = Vec::new();
    for run in between(text, "label \"failure\" = ", ";").split(" | ") {
        match run.strip_prefix("s=") {
            Some(only) => failures.push(number(only)),
            None => failures.extend(
                number::<usize>(between(run, "s>=", " "))..=number(between(run, "s<=", ")")),
            ),
        }
    }
    (rows, failures, number(between(text, "init ", ";")))
}

fn of_states(text: &str) -> Parts {
    let (mut rows, mut failures, mut start) = (Vec::new(), Vec::new(), None);
    let (mut from, mut exit, mut sum) = (0, 0.0, 0.0);
    for line in between(text, "@model\n", "\u{0}").lines().chain(["state 0 !0"]) {
        if let Some(state) = line.strip_prefix("state ") {
            assert_eq!(exit, sum, "{text}");
            let words: Vec<&str> = state.split(' ').collect();
            (from, exit, sum) = (number(words[0]), number(words[1].trim_start_matches('!')), 0.0);
            failures.extend(words.contains(&"failure").then_some(from));
            start = start.or(words.contains(&"init").then_some(from));
        } else if let Some((to, rate)) = line.split_once(" : ") {
            sum += number::<f64>(rate);
            rows.push((from, number(to), number(rate)));
        }
    }
    (rows, failures, start.expect("a start"))
}

#[test]
fn an_exported_chain_is_the_chain_in_both_forms() {
    let chain = chain();
    let (mut rows, failures, start) = parts(&chain);
    // A state that is never left has a transition to itself.
    rows.push((3, 3, 1.0));
    let expected = (rows, failures, start);
    let text = export_chain(&chain, ExportForm::Language);
    assert_eq!(of_language(&text), expected, "{text}");
    assert!(text.contains("s : [0..3] init 1;") && text.contains("// whole here\n"), "{text}");
    let text = export_chain(&chain, ExportForm::States);
    assert_eq!(of_states(&format!("{text}\u{0}")), expected, "{text}");
    assert!(text.contains("@nr_states\n4\n"), "{text}");
}

#[test]
fn the_properties_ask_what_the_answer_has() {
    let without = export_properties(None);
    assert_eq!(without.lines().count(), 2);
    let mission = Hours::new("mission", 1000.0).expect("a time");
    let with = export_properties(Some(mission));
    assert!(with.starts_with(&without) && with.contains("F<=1000 \"failure\""), "{with}");
}
