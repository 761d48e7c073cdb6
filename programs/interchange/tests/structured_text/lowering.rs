//! What texts become, and that they do what they say.

use understudy_ladder::print;
use understudy_logic::Running;

use crate::support::{PERIOD, findings, program};

#[test]
fn a_text_as_a_ladder() {
    insta::assert_snapshot!(print(&program(include_str!(
        "../../../../examples/other-tools/press.st"
    ))));
}

#[test]
fn two_names_of_one_address_are_one_bit() {
    let text =
        "PROGRAM p VAR a AT %IX0.0 : BOOL; again AT %IX0.0 : BOOL; y AT %QX0.0 : BOOL; END_VAR
y := a AND NOT again; END_PROGRAM";
    let reading = crate::support::read(text);
    let found = findings(text, reading.diagnostics);
    assert_eq!(
        found,
        "1:35: U1055 Warning: `again` as a second name of `a`, whose address it has, is not kept\n"
    );
    let program = program(text);
    assert_eq!(program.inputs.len(), 1);
    let mut running = Running::new(&program.lower(PERIOD).expect("a circuit"));
    assert_eq!(running.step(&[true]), [false]);
}
