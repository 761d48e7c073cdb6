//! Random texts: what their rungs and their circuits do is what their programs do.

mod rungs;
pub(crate) mod text;

use proptest::prelude::*;
use understudy_structured_text::parse;
use understudy_testing::random::Dice;
use understudy_text::Diagnostic;

use self::text::Text;
use crate::execution::{check, check_bits, typed};
use crate::support::{found, program};

/// A branch of a CASE may assign a known value outside a subrange.
pub(crate) fn is_outside(found: &Diagnostic) -> bool {
    found.code == "U1043"
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn rungs_scan_as_their_text_executes(seed: u64) {
        let mut dice = Dice::new(seed);
        let source = rungs::text(&mut dice);
        let ladder = program(&source);
        let typed = typed(&source, &parse(&source).0).expect("a sound program");
        check(&source, &ladder, &typed, seed);
    }

    #[test]
    fn an_exact_circuit_scans_as_its_text_executes(seed: u64) {
        let mut dice = Dice::new(seed);
        let source = Text::random(&mut dice).to_string();
        prop_assume!(!found(&source).iter().any(is_outside));
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
