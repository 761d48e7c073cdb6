//! The example of section V: what is generated from (22)-(29) is (34)-(40), row by row, and looks like it.

mod paper;

use paper::{parse, press, robot};
use understudy_logic::bdd::Diagrams;
use understudy_logic::{
    Circuit, Expression, Graph, NormalForm, Polynomial, Scan, Scratch, Variable,
};
use understudy_parity::{Equation, Equations, Style, generate, reconstruct, syndrome};
use understudy_wire::{Image, ProgramId, ProgramSet, Word};

/// (30).
const F1: [&str; 7] = [
    "u13(1+u15)((1+u12)x11 + u11u15(1+x11 + u12x11))",
    "u13(1+u15)((1+u11)x12 + u12(1+u15)(1+x12 + u11x12))",
    "u11(1+u15)((1+u14)x13 + u10u13(1+u15)(1+x13 + u14x13))",
    "u11(1+u15)((1+u13)x14 + u14u15(1+x14 + u13x14))",
    "u12(1+u15)((1+u14)x15 + u13u15(1+x15 + u14x15))",
    "u12(1+u15)((1+u13)x16 + u14(1+u15)(1+x16 + u13x16))",
    "(1+u15)(x17 + u12u14x17 + u11u14(1+x17 + u12x17))",
];

/// (31).
const H1: [&str; 5] = [
    "u13(1+u15)x11",
    "u13(1+u15)x12",
    "(1+u15)(x13 + x15 + x13x15)",
    "(1+u15)(x14 + x16 + x14x16)",
    "(1+u15)x17",
];

/// (32).
const F2: [&str; 2] = [
    "(1+u23)((1+u22)x21 + u20u21(1+x21 + u22x21))",
    "(1+u23)(u22 + x22 + u21x22 + u22x22 + u21u22x22)",
];

/// (33).
const H2: [&str; 2] = ["(1+u23)x21", "(1+u23)x22"];

/// (34).
const F3: [&str; 9] = [
    "u13(1+u15)((1+u12)x31 + u11u15(1+x31 + u12x31))",
    "u13(1+u15)((1+u11)x32 + u12(1+u15)(1+x32 + u11x32))",
    "u11(1+u15)((1+u14)x33 + u10u13(1+u15)(1+x33 + u14x33))",
    "u11(1+u15)((1+u13)x34 + u14u15(1+x34 + u13x34))",
    "u12(1+u15)((1+u14)x35 + u13u15(1+x35 + u14x35))",
    "u12(1+u15)((1+u13)x36 + u14(1+u15)(1+x36 + u13x36))",
    "(1+u15)(x37 + u12u14x37 + u11u14(1+x37 + u12x37))",
    "(1+u23)((1+u22)x38 + u20u21(1+x38 + u22x38))",
    "(1+u23)(u22 + x39 + u21x39 + u22x39 + u21u22x39)",
];

/// (35).
const H3: [&str; 5] = [
    "u13(1+u15)x31 + (1+u23)x38",
    "u13(1+u15)x32 + (1+u23)x39",
    "(1+u15)(x33 + x35 + x33x35)",
    "(1+u15)(x34 + x36 + x34x36)",
    "(1+u15)x37",
];

/// (39).
const FB3: [&str; 9] = [
    "(u13 ∧ u11 ∧ u15 ∨ x31 ∧ ¬u12) ∧ u13 ∧ ¬u15",
    "(u13 ∧ u12 ∧ ¬u15 ∨ x32 ∧ ¬u11) ∧ u13 ∧ ¬u15",
    "(u10 ∧ u11 ∧ u13 ∧ ¬u15 ∨ x33 ∧ ¬u14) ∧ u11 ∧ ¬u15",
    "(u14 ∧ u11 ∧ u15 ∨ x34 ∧ ¬u13) ∧ u11 ∧ ¬u15",
    "(u12 ∧ u13 ∧ u15 ∨ x35 ∧ ¬u14) ∧ u12 ∧ ¬u15",
    "(u14 ∧ u12 ∧ ¬u15 ∨ x36 ∧ ¬u13) ∧ u12 ∧ ¬u15",
    "(u11 ∧ u14 ∨ x37 ∧ (¬u12 ∨ ¬u14)) ∧ ¬u15",
    "(u20 ∧ u21 ∨ x38 ∧ ¬u22) ∧ ¬u23",
    "(u22 ∨ x39 ∧ ¬u21) ∧ ¬u23",
];

/// (40).
const HB3: [&str; 5] = [
    "(u15 ∨ ¬u13 ∨ ¬x31) ∧ x38 ∧ ¬u23 ∨ (u23 ∨ ¬x38) ∧ u13 ∧ x31 ∧ ¬u15",
    "(u15 ∨ ¬u13 ∨ ¬x32) ∧ x39 ∧ ¬u23 ∨ (u23 ∨ ¬x39) ∧ u13 ∧ x32 ∧ ¬u15",
    "(x33 ∨ x35) ∧ ¬u15",
    "(x34 ∨ x36) ∧ ¬u15",
    "x37 ∧ ¬u15",
];

/// Each row, as printed, is the root in its place: equal diagrams, and equal normal forms.
fn check(circuit: &Circuit, symbols: &[(String, Variable)], roots: &[Expression], rows: &[&str]) {
    assert_eq!(roots.len(), rows.len());
    let variables = symbols.iter().map(|(_, variable)| *variable);
    let diagrams = Diagrams::new(variables, 100_000);
    for (&root, row) in roots.iter().zip(rows) {
        let mut graph = Graph::new();
        let known: Vec<(&str, Expression)> = symbols
            .iter()
            .map(|(symbol, variable)| (symbol.as_str(), graph.variable(*variable)))
            .collect();
        let signal = |symbol: &str| {
            let found = known.iter().find(|(other, _)| *other == symbol);
            found.expect("a known symbol").1
        };
        let printed = parse(&mut graph, row, &signal);
        let ours = diagrams.of(circuit.graph(), root).expect("small");
        assert!(ours == diagrams.of(&graph, printed).expect("small"), "{row}");
        let form = NormalForm::of(&graph, printed, 1_000).expect("small");
        let factored = Polynomial::of(circuit.graph(), root).expect("small");
        assert_eq!(factored.normal_form(1_000), Some(form), "{row}");
    }
}

fn next(circuit: &Circuit) -> Vec<Expression> {
    let registers = circuit.registers().iter();
    registers.map(|register| register.next).collect()
}

fn values(circuit: &Circuit) -> Vec<Expression> {
    circuit.outputs().iter().map(|output| output.value).collect()
}

#[test]
fn programs_are_30_to_33() {
    for (circuit, states, outputs) in [(robot(), &F1[..], &H1[..]), (press(), &F2[..], &H2[..])] {
        let inputs = (0..circuit.inputs().len() as u32).map(Variable::Input);
        let registers = (0..circuit.registers().len() as u32).map(Variable::Register);
        let symbols: Vec<(String, Variable)> = inputs
            .chain(registers)
            .map(|variable| (circuit.variable_name(variable).to_owned(), variable))
            .collect();
        check(&circuit, &symbols, &next(&circuit), states);
        check(&circuit, &symbols, &values(&circuit), outputs);
    }
}

#[test]
fn the_generated_controller_is_34_to_40() {
    let generated = generate(&[robot(), press()]).expect("two names");
    let circuit = generated.circuit();
    let equations = Equations::of(&generated);
    let inputs = equations.inputs.iter().zip((0..).map(Variable::Input));
    let states = equations.states.iter().map(|state| &state.defines);
    let symbols: Vec<(String, Variable)> = inputs
        .chain(states.zip((0..).map(Variable::Register)))
        .map(|(legend, variable)| (legend.symbol.clone(), variable))
        .collect();
    check(circuit, &symbols, &next(circuit), &F3);
    check(circuit, &symbols, &next(circuit), &FB3);
    check(circuit, &symbols, &values(circuit), &H3);
    check(circuit, &symbols, &values(circuit), &HB3);
}

#[test]
fn the_equations_read_like_the_paper() {
    let generated = generate(&[robot(), press()]).expect("two names");
    let equations = Equations::of(&generated);
    let letter_by_letter = |equations: &[Equation], polynomials: &[&str], booleans: &[&str]| {
        for ((equation, polynomial), boolean) in equations.iter().zip(polynomials).zip(booleans) {
            for (ours, printed) in
                [(&equation.polynomial, polynomial), (&equation.boolean, boolean)]
            {
                let ours = ours.as_ref().map(|formula| formula.symbols.replace(' ', ""));
                assert_eq!(ours, Some(printed.replace(' ', "")));
            }
        }
    };
    letter_by_letter(&equations.states, &F3, &FB3);
    letter_by_letter(&equations.outputs, &H3, &HB3);
    insta::assert_snapshot!("symbols", equations.to_text(Style::Symbols));
    insta::assert_snapshot!("names", equations.to_text(Style::Names));
    let json = serde_json::to_string_pretty(&equations.outputs[0]).expect("plain data");
    insta::assert_snapshot!("json", json);
}

/// Theorems 1 and 2 for the press cell, in every state and under every input vector: 2^19 of them, 64 at once.
#[test]
fn theorems_hold_everywhere() {
    let members = [robot(), press()];
    let generated = generate(&members).expect("two names");
    let scans = members.each_ref().map(Scan::new);
    let parity = Scan::new(generated.circuit());
    let mut scratch = Scratch::default();
    let (inputs, registers) = (parity.input_count(), parity.register_count());
    assert_eq!((inputs, registers), (10, 9));
    for block in 0..1_u64 << (inputs + registers - 6) {
        let lane = |place: usize| -> u64 {
            (0..64).fold(0, |word, lane| word | ((block << 6 | lane) >> place & 1) << lane)
        };
        let u: Vec<u64> = (0..inputs).map(lane).collect();
        let x: Vec<u64> = (inputs..inputs + registers).map(lane).collect();
        let mut outputs: Vec<Vec<u64>> = Vec::new();
        let mut states = Vec::new();
        for (scan, member) in scans.iter().zip(generated.summands()) {
            let mut state = x[member.registers.clone()].to_vec();
            let mut output = vec![0; member.outputs];
            scan.step_lanes(&mut scratch, &mut state, &u[member.inputs.clone()], &mut output);
            states.extend(state);
            outputs.push(output);
        }
        let mut state = x.clone();
        let mut output = vec![0; parity.output_count()];
        parity.step_lanes(&mut scratch, &mut state, &u, &mut output);
        outputs.push(output);
        assert_eq!(state, states, "(7)");
        // A packed word is one output of 64 runs here, so a width of p outputs is one of 64 p bits.
        let mut images = outputs
            .iter()
            .map(|output| Image::from_words(64 * output.len(), output).expect("whole words"));
        let own: Vec<Image> = images.by_ref().take(2).collect();
        let word = Word { mask: ProgramSet::first(2), sum: images.next().expect("y(3)") };
        let every = |program: ProgramId| own.get(program.index());
        let zero = syndrome(&word, every).expect("both outputs are there");
        assert!(zero.is_zero(), "(10)");
        for wanted in word.mask.iter() {
            let truth = &own[wanted.index()];
            let others = |program| every(program).filter(|_| program != wanted);
            let estimated = reconstruct(&word, wanted, truth.width(), others);
            assert_eq!(estimated.as_ref(), Ok(truth), "(12)");
        }
    }
}
