//! Drawings, as people see them.

use understudy_ladder::{draw_svg, draw_text};

use crate::support::program;

fn check(name: &str, text: &str) {
    let program = program(text);
    insta::assert_snapshot!(name, draw_text(&program));
}

#[test]
fn robot() {
    check(
        "robot",
        include_str!("../../../examples/press-cell/robot.ladder"),
    );
}

#[test]
fn every_element() {
    check("every-element", include_str!("every-element.ladder"));
}

#[test]
fn a_picture() {
    let text = "program p  -- a & b\ninput a at %IX0.0  -- \"<a>\"\noutput y\nrung \"1 < 2\"\n    [ /a | y ] {TON t 1s} (S y)\n";
    insta::assert_snapshot!("picture", draw_svg(&program(text)));
}
