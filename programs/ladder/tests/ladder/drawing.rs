//! Drawings, as people see them.

use understudy_ladder::{
    Evaluation, Interpreter, Program, draw_svg, draw_svg_rungs, draw_text, draw_text_rungs,
};

use crate::support::{PERIOD, program};

fn check(name: &str, text: &str) {
    let program = program(text);
    insta::assert_snapshot!(name, draw_text(&program));
}

#[test]
fn robot() {
    check("robot", include_str!("../../../../examples/press-cell/robot.ladder"));
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

fn last_scan(program: &Program, scans: &[&[bool]]) -> Evaluation {
    let mut interpreter = Interpreter::new(program, PERIOD).expect("a right program");
    let mut last = Evaluation::default();
    for inputs in scans {
        last = interpreter.scan_observed(inputs);
    }
    last
}

const FLOWING: &str = "program p
input start at %IX0.0 -- the green button
input stop
input part
output motor
output full
output late
output latched
rung \"seal-in\"
    [ start | motor part | +part ] /stop ( motor )
rung
    motor {TON pause 300ms} pause.Q ( late ) (S latched)
rung
    part {CTU parts 5 R = [ stop | full ]} parts.CV>=2 (/ full)
";

#[test]
fn power_is_heavy() {
    let program = program(FLOWING);
    let scans: [&[bool]; 3] = [&[true, false, true], &[false, false, false], &[false, false, true]];
    let evaluation = last_scan(&program, &scans);
    let rungs = [0, 1, 2];
    let text = draw_text_rungs(&program, &rungs, Some(&evaluation));
    insta::assert_snapshot!("power", text);
    let picture = draw_svg_rungs(&program, &rungs, Some(&evaluation));
    insta::assert_snapshot!("power-picture", picture);
}

#[test]
fn rungs_of_a_picture() {
    let program = program(FLOWING);
    let one = draw_svg_rungs(&program, &[2, 99], None);
    assert!(one.contains("parts") && !one.contains("pause") && !one.contains("class=\"live\""));
}

#[test]
fn without_a_scan_all_is_as_without_power() {
    let program = program(FLOWING);
    let all: Vec<usize> = (0..program.rungs.len()).collect();
    let plain = draw_text_rungs(&program, &all, None);
    assert!(draw_text(&program).ends_with(&plain));
    assert!(!plain.contains('━'));
}
