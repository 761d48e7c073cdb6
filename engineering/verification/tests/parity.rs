//! What the generator makes is proved, and what differs from it in any one place is refuted.

#[path = "../../../programs/logic/tests/common/mod.rs"]
mod common;

use common::{Recipe, circuit, configuration, recipe};
use proptest::prelude::*;
use proptest::sample::Index;
use understudy_logic::bdd::Diagrams;
use understudy_logic::{Circuit, CircuitBuilder, Expression, Variable};
use understudy_parity::generate;
use understudy_verification::{Proof, Refutation, prove_parity, prove_parity_within};

fn named(recipes: &[Recipe]) -> Vec<Circuit> {
    let numbered = recipes.iter().enumerate();
    numbered.map(|(number, recipe)| circuit(&format!("p{number}"), recipe)).collect()
}

/// `circuit` with its registers' initial values and all roots changed by `change`, told which root it is.
fn changed(
    circuit: &Circuit,
    flip_initial: Option<usize>,
    change: impl Fn(&mut CircuitBuilder, usize, Expression) -> Expression,
) -> Circuit {
    let mut builder = CircuitBuilder::new("changed");
    let inputs: Vec<Expression> =
        circuit.inputs().iter().map(|name| builder.input(name.clone())).collect();
    let registers: Vec<_> = circuit
        .registers()
        .iter()
        .enumerate()
        .map(|(place, register)| {
            let initial = register.initial ^ (flip_initial == Some(place));
            builder.register(register.name.clone(), initial)
        })
        .collect();
    let roots = circuit.roots();
    let copies = builder.graph().import(circuit.graph(), &roots, |_, variable| match variable {
        Variable::Input(index) => inputs[index as usize],
        Variable::Register(index) => registers[index as usize].1,
    });
    let mut made = Vec::new();
    for (place, copy) in copies.into_iter().enumerate() {
        made.push(change(&mut builder, place, copy));
    }
    for ((register, _), next) in registers.iter().zip(&made) {
        builder.set_next(*register, *next);
    }
    for (output, value) in circuit.outputs().iter().zip(&made[registers.len()..]) {
        builder.output(output.name.clone(), *value);
    }
    builder.finish().expect("the same names")
}

proptest! {
    #![proptest_config(configuration(60))]

    #[test]
    fn the_generator_is_right(recipes in prop::collection::vec(recipe(), 1..5)) {
        let members = named(&recipes);
        let generated = generate(&members).expect("names are numbered").into_circuit();
        let proof = Proof {
            registers: generated.registers().len(),
            outputs: generated.outputs().len(),
        };
        prop_assert_eq!(prove_parity(&members, &generated), Ok(proof));
    }

    /// One root is negated where all signals have one combination of values: refuted there, and nowhere else.
    #[test]
    fn one_wrong_value_is_found(
        recipes in prop::collection::vec(recipe(), 1..4),
        which in any::<Index>(),
        combination in any::<u64>(),
    ) {
        let members = named(&recipes);
        let generated = generate(&members).expect("names are numbered").into_circuit();
        let roots = generated.roots();
        prop_assume!(!roots.is_empty());
        let wrong = which.index(roots.len());
        let inputs = (0..generated.inputs().len() as u32).map(Variable::Input);
        let registers = (0..generated.registers().len() as u32).map(Variable::Register);
        let variables: Vec<Variable> = inputs.chain(registers).collect();
        let value = |place: usize| combination >> (place % 64) & 1 == 1;
        let broken = changed(&generated, None, |builder, place, root| {
            if place != wrong {
                return root;
            }
            let graph = builder.graph();
            let mut here = graph.constant(true);
            for (place, &variable) in variables.iter().enumerate() {
                let variable = graph.variable(variable);
                let literal = if value(place) { variable } else { graph.not(variable) };
                here = graph.and(here, literal);
            }
            graph.xor(root, here)
        });
        let Err(Refutation::Function { found, counterexample, .. }) = prove_parity(&members, &broken) else {
            return Err(TestCaseError::fail("not refuted"));
        };
        let expected: Vec<(String, bool)> = variables
            .iter()
            .enumerate()
            .map(|(place, &variable)| (generated.variable_name(variable).to_owned(), value(place)))
            .collect();
        let mut shown = counterexample.0;
        shown.sort();
        let mut sorted = expected.clone();
        sorted.sort();
        prop_assert_eq!(shown, sorted);
        let assignment = |variable| {
            let place = variables.iter().position(|other| *other == variable);
            value(place.expect("a variable of the circuit"))
        };
        prop_assert_eq!(found, !generated.graph().evaluate(roots[wrong], assignment));
    }
}

/// A valve that is held open, and a lamp.
fn members() -> [Circuit; 2] {
    let mut valve = CircuitBuilder::new("valve");
    let open = valve.input("open");
    let close = valve.input("close");
    let (held, was_held) = valve.register("held", false);
    let graph = valve.graph();
    let either = graph.or(open, was_held);
    let not_close = graph.not(close);
    let next = graph.and(either, not_close);
    valve.set_next(held, next);
    valve.output("valve", was_held);
    let mut lamp = CircuitBuilder::new("lamp");
    let button = lamp.input("button");
    let (lit, was_lit) = lamp.register("lit", true);
    let next = lamp.graph().xor(button, was_lit);
    lamp.set_next(lit, next);
    lamp.output("lamp", was_lit);
    lamp.output("bell", button);
    [valve, lamp].map(|builder| builder.finish().expect("names differ"))
}

fn check(members: &[Circuit], generated: &Circuit, expected: &str) {
    let refutation = prove_parity(members, generated).expect_err("it is wrong");
    assert_eq!(refutation.to_string(), expected);
    assert!(expected.starts_with(refutation.code()));
}

#[test]
fn refutations_name_what_is_wrong() {
    let members = members();
    let generated = generate(&members).expect("two names").into_circuit();
    assert!(prove_parity(&members, &generated).is_ok());
    check(
        &members,
        &changed(&generated, Some(1), |_, _, root| root),
        "U0423: `lamp.lit` starts as 0, and its program starts it as 1",
    );
    check(
        &members,
        &changed(&generated, None, |builder, place, root| match place {
            0 => builder.graph().variable(Variable::Input(0)),
            _ => root,
        }),
        "U0424: the next state of `valve.held` is 0 where its members say 1, for example at valve.open = 0, valve.held = 1, valve.close = 0",
    );
    check(
        &members,
        &changed(&generated, None, |builder, place, root| match place {
            2 => builder.graph().not(root),
            _ => root,
        }),
        "U0424: the output `parity_1` is 1 where its members say 0, for example at any values",
    );
    check(
        &members[..1],
        &generated,
        "U0421: `understudy` has 2 outputs, and its members call for 1",
    );
    check(
        &[members[1].clone(), members[1].clone()],
        &generated,
        "U0422: two members both have `lamp.button`, so no circuit can hold a copy of each",
    );
    let alone = generate(&members[1..]).expect("one name").into_circuit();
    check(&members, &alone, "U0420: the input `valve.open` is missing in `understudy`");
    check(
        &members[1..],
        &generated,
        "U0421: `understudy` has 3 inputs, and its members call for 1",
    );
}

/// Where the bound is too small the answer is neither yes nor no.
#[test]
fn what_is_too_large_is_said() {
    let mut builder = CircuitBuilder::new("multiplexer");
    let select: Vec<Expression> = (0..9).map(|bit| builder.input(format!("s{bit}"))).collect();
    let mut layer: Vec<Expression> =
        (0..512).map(|line| builder.input(format!("d{line}"))).collect();
    for bit in select {
        layer = layer
            .chunks(2)
            .map(|pair| builder.graph().if_then_else(bit, pair[1], pair[0]))
            .collect();
    }
    builder.output("chosen", layer[0]);
    let members = [builder.finish().expect("names are numbered")];
    let generated = generate(&members).expect("one name").into_circuit();
    let refutation =
        prove_parity_within(&members, &generated, 2_000).expect_err("too small a bound");
    assert_eq!(
        refutation.to_string(),
        "U0425: the output `parity_1` could not be decided: U0412: the decision diagram needs more than 2000 nodes; split the function or raise the bound"
    );
}

/// 32 programs of 100 rungs, the sums over all of them included.
#[test]
fn a_large_cluster_is_proved() {
    let program = |number: u32| {
        let mut builder = CircuitBuilder::new(format!("p{number}"));
        let rungs = 100;
        let inputs: Vec<Expression> =
            (0..rungs).map(|rung| builder.input(format!("u{rung}"))).collect();
        let registers: Vec<_> =
            (0..rungs).map(|rung| builder.register(format!("x{rung}"), rung % 3 == 0)).collect();
        for rung in 0..rungs {
            let (start, stop) = (inputs[rung], inputs[(rung * 7 + 3) % rungs]);
            let (own, other) = (registers[rung].1, registers[(rung + 1) % rungs].1);
            let graph = builder.graph();
            let not_stop = graph.not(stop);
            let started = graph.and(start, other);
            let run = graph.or(started, own);
            let next = graph.and(run, not_stop);
            let value = graph.or(own, next);
            builder.set_next(registers[rung].0, next);
            builder.output(format!("y{rung}"), value);
        }
        builder.finish().expect("names are numbered")
    };
    let members: Vec<Circuit> = (0..32).map(program).collect();
    let generated = generate(&members).expect("names are numbered").into_circuit();
    let proof = prove_parity_within(&members, &generated, Diagrams::DEFAULT_LIMIT);
    assert_eq!(proof, Ok(Proof { registers: 3_200, outputs: 100 }));
}
