//! What is evaluated again is what has to be.

use std::collections::BTreeSet;
use std::time::Duration;

use understudy_structured_text::{Options, lower, parse};
use understudy_testing::random::random_program;
use understudy_typed::Program;

use super::Extents;
use crate::System;

/// Compares the extents of all terms with those of a search that evaluates every term for each scan.
fn check(what: &str, program: &Program) {
    for restarts in [false, true] {
        let system = System::comparing(program, BTreeSet::new(), restarts);
        let Ok(system) = system else { return };
        let kept: Vec<u32> = system.read.iter().copied().collect();
        for whole in [&[][..], &kept] {
            let found = Extents::new(&system, whole);
            let wanted = Extents::found(&system, whole, None);
            assert_eq!(found.0, wanted.0, "{what}");
        }
    }
}

#[test]
fn random_ladders_have_the_extents_of_a_full_search() {
    for seed in 0..120 {
        let ladder = random_program(seed, 12);
        let typed = ladder.typed(Duration::from_millis(70)).expect("a sound program");
        check(&format!("seed {seed}"), &typed);
    }
}

#[test]
fn programs_with_numbers_have_the_extents_of_a_full_search() {
    let texts = [
        include_str!("../tests/blocks.st").to_owned(),
        include_str!("../tests/chart.st").to_owned(),
        "PROGRAM p VAR_INPUT a, b : BOOL; u : INT (0..9); END_VAR VAR_OUTPUT y : BOOL; v : INT; END_VAR
         VAR n, m, k : INT; t : TON; w : ARRAY [0..3] OF INT; RETAIN_END
           n := n + 1; IF n > 5 THEN n := 0; END_IF;
           IF a AND n < 4 THEN m := m + n; ELSIF b THEN m := MAX(m - u, 0); END_IF;
           IF m > 100 THEN m := 100; END_IF;
           IF u < 4 THEN w[u] := w[u] + 1; IF w[u] >= 7 THEN w[u] := k; END_IF; END_IF;
           k := SEL(n = m, k, k + 2); IF k > 50 OR NOT a THEN k := 3; END_IF;
           t(IN := k > 20, PT := T#1s); y := t.Q; v := n * 3 - m; END_PROGRAM"
            .replace("RETAIN_END", "END_VAR VAR RETAIN r : INT (0..3); END_VAR"),
    ];
    for text in texts {
        let (file, _) = parse(&text);
        let options = Options { text: &text, ..Options::default() };
        check(&text, &lower(&file, &options).program.expect("a program"));
    }
}
