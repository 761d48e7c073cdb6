//! Random texts: what their ladders do is what their typed programs do.

mod text;

use proptest::prelude::*;
use understudy_structured_text::parse;
use understudy_testing::random::Dice;
use understudy_text::Diagnostic;

use self::text::Text;
use crate::execution::{check, check_bits, typed};
use crate::support::{program, read};

/// A branch of a CASE may assign a known value outside a subrange.
fn is_outside(found: &Diagnostic) -> bool {
    found.code == "U1043"
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_ladder_scans_as_its_text_executes(seed: u64) {
        let mut dice = Dice::new(seed);
        let source = Text::random(&mut dice).to_string();
        // A counter that an inner loop assigns under a condition is refused, and so is a loop that does not end.
        let is_refused = |found: &Diagnostic| matches!(found.code, "U1048" | "U1056") && found.message.contains("no ladder") || is_outside(found);
        prop_assume!(!read(&source).diagnostics.iter().any(is_refused));
        let ladder = program(&source);
        let typed = typed(&source, &parse(&source).0).expect("a sound program");
        check(&source, &ladder, &typed, seed);
    }

    #[test]
    fn an_exact_circuit_scans_as_its_text_executes(seed: u64) {
        let mut dice = Dice::new(seed);
        let source = Text::random(&mut dice).to_string();
        prop_assume!(!read(&source).diagnostics.iter().any(is_outside));
        let typed = typed(&source, &parse(&source).0).expect("a sound program");
        match understudy_bits::exact(&typed) {
            Ok(circuit) => check_bits(&source, &circuit, &typed, seed),
            // The number of turns of a loop is not known, or loops in loops make too many values.
            Err(understudy_bits::Inexact::Unsupported(reason)) => {
                prop_assume!(!["number of turns", "too many values"].iter().any(|known| reason.what.contains(known)));
                panic!("{reason}\n{source}");
            }
            Err(gaps) => panic!("{gaps}\n{source}"),
        }
    }
}
