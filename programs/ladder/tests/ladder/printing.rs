//! What is printed is read as the same program.

use proptest::prelude::*;
use understudy_ladder::{draw_svg, draw_text, parse, print};

use crate::support::program;
use understudy_testing::random::random_program;

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_programs_come_back(seed: u64) {
        let program = random_program(seed, 8);
        let text = print(&program);
        let parsed = parse(&text);
        prop_assert!(!understudy_text::has_errors(&parsed.diagnostics), "{:#?}\n{text}", parsed.diagnostics);
        prop_assert_eq!(&parsed.program, &program, "{}", text);
        prop_assert_eq!(print(&parsed.program), text);
        // Anything can be drawn.
        prop_assert!(draw_text(&program).lines().count() > program.rungs.len());
        prop_assert!(draw_svg(&program).len() > program.rungs.len());
    }
}

#[test]
fn every_element_as_printed() {
    let original = program(include_str!("every-element.ladder"));
    let text = print(&original);
    assert_eq!(program(&text), original);
    insta::assert_snapshot!(text);
}
