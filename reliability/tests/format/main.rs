//! Chains as text: what is read, and how everything that is wrong is said at once.

mod export;

use std::fmt::Write;

use proptest::prelude::*;
use understudy_reliability::{ChainBuilder, read_chain};

const GOOD: &str = "\
# Three controllers and an understudy.
mtbf = 10000h
mttr = 24 h   # a day
c = 0.999
lambda = 1 / mtbf

state whole start
state degraded
state failed failure

whole -> degraded : 4 * c * lambda
whole -> failed : 4 * (1 - c) * lambda
degraded -> whole : 1 / mttr
degraded -> failed : 3 / mtbf
";

/// As a person sees it: place, code, message, help.
fn findings(text: &str) -> String {
    let read = read_chain("a.chain", text);
    let mut said = String::new();
    for finding in &read.report.diagnostics {
        let at = read.report.line_and_column(finding.span.start);
        let _ = writeln!(said, "{at} {} {}", finding.code, finding.message);
        assert!(text.get(finding.span.clone()).is_some(), "{finding:?}");
        if let Some(help) = &finding.help {
            let _ = writeln!(said, "    {help}");
        }
    }
    assert_eq!(read.chain.is_none(), read.report.has_errors());
    said
}

#[test]
fn a_chain_is_read() {
    assert_eq!(findings(GOOD), "");
    let chain = read_chain("a.chain", GOOD).chain.expect("a chain");
    // (p + q c)/(q p - q c μ), with q = 4 λ and p = 3 λ + μ: (19) with coverage.
    let (lambda, mu, c) = (1e-4, 1.0 / 24.0, 0.999);
    let (q, p) = (4.0 * lambda, 3.0 * lambda + mu);
    let expected = (p + q * c) / (q * p - q * c * mu);
    let mean = chain.mttf().expect("a mean");
    assert!((mean / expected - 1.0).abs() < 1e-11, "{mean}");
    assert_eq!((chain.states(), chain.start(), chain.name(2)), (3, 0, "failed".into()));
}

#[test]
fn all_that_is_wrong_is_said_in_one_run() {
    let text = "\
mtbf = 10000h
mtbf = 1h
spare = 12 parsecs
state whole start
state whole
state degraded start
state failed failur
state 3rd
state
nonsense
whole -> degarded : 4 / mtbf
whole -> degraded : 4 * lambda
whole -> degraded : 0.0004
whole -> degraded : 1 / mtbf + 3
whole -> degraded : -1 / mtbf
whole -> degraded : 0 / mtbf
whole -> degraded : 1 / 0h
whole -> degraded : 1 / (mtbf
whole -> degraded : 1 / mtbf )
whole -> degraded :
whole -> degraded
whole -> whole : 1 / mtbf
 -> whole : 1 / mtpf
";
    insta::assert_snapshot!(findings(text));
}

#[test]
fn structure_is_checked_too() {
    insta::assert_snapshot!(findings(""));
    insta::assert_snapshot!(findings(
        "state a\nstate b\nstate island\na -> b : 1/1h\nb -> a : 2/1h\n"
    ));
    insta::assert_snapshot!(findings("x = 3\nstate a\nstate b\na -> b : 1/1h\nb -> a : 2/1h\n"));
    insta::assert_snapshot!(findings(
        "state a\nstate trap\nstate f failure\na -> trap : 1/1h\na -> f : 2/1h\n"
    ));
    let deep = format!("state a\nstate f failure\na -> f : {}1/1h\n", "(".repeat(10_000));
    assert!(findings(&deep).contains("U0730"));
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 2_000, ..ProptestConfig::default() })]

    #[test]
    fn no_text_is_too_odd(text in "\\PC*") {
        findings(&text);
    }

    #[test]
    fn no_torn_text_is_too_odd(cut in 0..GOOD.len(), put in "[-+*/():=#>a-c0-9.eh \n½]{0,6}") {
        let text = format!("{}{put}{}", &GOOD[..cut], &GOOD[cut..]);
        findings(&text);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Transitions may come before the states that they name, in any order, and several times.
    #[test]
    fn a_chain_is_that_of_its_lines_in_any_order(
        states in 2..9_usize,
        transitions in proptest::collection::vec((0..8_usize, 0..8_usize, 1..9_u32, 0..9_usize), 1..30),
    ) {
        let transitions: Vec<_> = transitions
            .into_iter()
            .map(|(from, to, rate, after)| (from % states, to % states, rate, after))
            .filter(|(from, to, ..)| from != to)
            .collect();
        let mut builder = ChainBuilder::new();
        for state in 0..states - 1 {
            builder.state(format!("s{state:x}"));
        }
        let last = builder.failure("failed");
        let name = |state: usize| if state == last { "failed".to_owned() } else { format!("s{state:x}") };
        let mut text = String::new();
        for state in 0..=states {
            for (from, to, rate, _) in transitions.iter().filter(|(.., after)| (*after).min(states) == state) {
                let _ = writeln!(text, "{}->{}:{rate}/1h", name(*from), name(*to));
            }
            if state < states {
                let _ = writeln!(text, "state {}{}", name(state), if state == last { " failure" } else { "" });
            }
        }
        for (from, to, rate, _) in &transitions {
            builder.transition(*from, *to, f64::from(*rate));
        }
        prop_assert_eq!(read_chain("a.chain", text).chain, builder.build().ok());
    }
}
