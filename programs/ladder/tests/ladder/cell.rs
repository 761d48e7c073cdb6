//! The cell of section V: what the ladders lower to is (24), (25), (28) and (29), on every state and input.

use understudy_logic::{Circuit, Expression, Variable};

use crate::support::{PERIOD, program};

/// x(t+1) and y(t) of a circuit for one state and input, read from its expressions.
fn evaluate(circuit: &Circuit, state: &[bool], inputs: &[bool]) -> (Vec<bool>, Vec<bool>) {
    let value = |root: Expression| {
        circuit.graph().evaluate(root, |variable| match variable {
            Variable::Input(index) => inputs[index as usize],
            Variable::Register(index) => state[index as usize],
        })
    };
    let next = circuit.registers().iter().map(|register| value(register.next));
    let outputs = circuit.outputs().iter().map(|output| value(output.value));
    (next.collect(), outputs.collect())
}

fn bits(number: usize, width: usize) -> Vec<bool> {
    (0..width).map(|place| number >> place & 1 == 1).collect()
}

/// `equations` answers with f(x, u) and h(x, u).
fn check(text: &str, equations: impl Fn(&[bool], &[bool]) -> (Vec<bool>, Vec<bool>)) -> Circuit {
    let circuit = program(text).lower(PERIOD).expect("a sound program");
    let (registers, inputs) = (circuit.registers().len(), circuit.inputs().len());
    for number in 0..1 << (registers + inputs) {
        let x = bits(number, registers);
        let u = bits(number >> registers, inputs);
        assert_eq!(evaluate(&circuit, &x, &u), equations(&x, &u), "x {x:?}, u {u:?}");
    }
    assert!(circuit.registers().iter().all(|register| !register.initial));
    circuit
}

/// (24) with `holding` and `empty` in the set terms of rows 1 to 6, and (25).
fn robot(x: &[bool], u: &[bool], holding: bool, empty: [bool; 3]) -> (Vec<bool>, Vec<bool>) {
    let &[u10, u11, u12, u13, u14, u15] = u else { panic!("six inputs") };
    let &[x11, x12, x13, x14, x15, x16, x17] = x else { panic!("seven state bits") };
    let f = vec![
        (u13 && u11 && holding || x11 && !u12) && u13 && !u15,
        (u13 && u12 && empty[0] || x12 && !u11) && u13 && !u15,
        (u10 && u11 && u13 && empty[1] || x13 && !u14) && u11 && !u15,
        (u14 && u11 && holding || x14 && !u13) && u11 && !u15,
        (u12 && u13 && holding || x15 && !u14) && u12 && !u15,
        (u14 && u12 && empty[2] || x16 && !u13) && u12 && !u15,
        (u11 && u14 || x17 && (!u12 || !u14)) && !u15,
    ];
    let h = vec![
        x11 && u13 && !u15,
        x12 && u13 && !u15,
        (x13 || x15) && !u15,
        (x14 || x16) && !u15,
        x17 && !u15,
    ];
    (f, h)
}

fn press(x: &[bool], u: &[bool]) -> (Vec<bool>, Vec<bool>) {
    let &[u20, u21, u22, u23] = u else { panic!("four inputs") };
    let &[x21, x22] = x else { panic!("two state bits") };
    let f = vec![(u20 && u21 || x21 && !u22) && !u23, (u22 || x22 && !u21) && !u23];
    (f, vec![x21 && !u23, x22 && !u23])
}

#[test]
fn the_robot_is_the_working_reading_of_24_and_25() {
    let circuit = check(include_str!("../../../../examples/press-cell/robot.ladder"), |x, u| {
        robot(x, u, x[6], [!x[6]; 3])
    });
    let names: Vec<&str> =
        circuit.registers().iter().map(|register| register.name.as_str()).collect();
    assert_eq!(
        names,
        [
            "moving_right",
            "moving_left",
            "lowering_left",
            "lifting_left",
            "lowering_right",
            "lifting_right",
            "holding"
        ]
    );
}

#[test]
fn the_robot_as_printed_is_24_and_25() {
    check(include_str!("../../../../parity/tests/fixtures/robot-as-printed.ladder"), |x, u| {
        robot(x, u, u[5], [!u[5]; 3])
    });
}

#[test]
fn the_press_is_28_and_29() {
    check(include_str!("../../../../examples/press-cell/press.ladder"), press);
    check(include_str!("../../../../parity/tests/fixtures/press-as-printed.ladder"), press);
}

#[test]
fn the_ladders_of_the_cell_are_without_warnings() {
    for text in [
        include_str!("../../../../examples/press-cell/robot.ladder"),
        include_str!("../../../../examples/press-cell/press.ladder"),
    ] {
        assert_eq!(understudy_ladder::parse(text).diagnostics, []);
    }
}
