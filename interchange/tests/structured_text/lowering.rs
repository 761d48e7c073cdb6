//! What texts become, and that they do what they say.

use understudy_ladder::print;

use crate::support::program;

#[test]
fn a_text_as_a_ladder() {
    insta::assert_snapshot!(print(&program(include_str!(
        "../../../examples/other-tools/press.st"
    ))));
}
