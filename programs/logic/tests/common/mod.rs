//! Random expressions and circuits, shared by the tests of the crates that deal with circuits.
#![allow(dead_code, reason = "each test file uses its part")]

use proptest::prelude::*;
use proptest::sample::Index;
use understudy_logic::{Circuit, CircuitBuilder, Expression, Graph, Variable};

/// How one more expression is made of those before it.
pub(crate) type Step = (u8, Index, Index);

pub(crate) fn configuration(cases: u32) -> ProptestConfig {
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}

pub(crate) fn steps(most: usize) -> impl Strategy<Value = Vec<Step>> {
    prop::collection::vec((0..5_u8, any::<Index>(), any::<Index>()), 0..=most)
}

/// Appends what `steps` make to `expressions`.
pub(crate) fn grow(graph: &mut Graph, expressions: &mut Vec<Expression>, steps: &[Step]) {
    for (kind, left, right) in steps {
        let (left, right) = (*left.get(expressions), *right.get(expressions));
        let made = match kind {
            0 => graph.not(left),
            1 | 2 => graph.and(left, right),
            3 => graph.or(left, right),
            _ => graph.xor(left, right),
        };
        expressions.push(made);
    }
}

/// A graph over `inputs` inputs and `registers` registers, and its last expression.
pub(crate) fn grown(inputs: u32, registers: u32, steps: &[Step]) -> (Graph, Expression) {
    let mut graph = Graph::new();
    let mut expressions = vec![graph.constant(false), graph.constant(true)];
    for variable in variables(inputs, registers) {
        expressions.push(graph.variable(variable));
    }
    grow(&mut graph, &mut expressions, steps);
    let root = expressions[expressions.len() - 1];
    (graph, root)
}

pub(crate) fn variables(inputs: u32, registers: u32) -> Vec<Variable> {
    let inputs = (0..inputs).map(Variable::Input);
    inputs.chain((0..registers).map(Variable::Register)).collect()
}

/// Every assignment of `variables`, as a function.
pub(crate) fn assignments(
    variables: &[Variable],
) -> impl Iterator<Item = impl Fn(Variable) -> bool> {
    (0..1_u64 << variables.len()).map(move |bits| {
        move |variable| {
            let place = variables.iter().position(|other| *other == variable);
            bits >> place.expect("a variable of the list") & 1 == 1
        }
    })
}

/// A circuit of the given widths; what is recipe and what is chosen of it comes from proptest.
#[derive(Debug, Clone)]
pub(crate) struct Recipe {
    pub(crate) inputs: usize,
    pub(crate) initial: Vec<bool>,
    pub(crate) steps: Vec<Step>,
    pub(crate) next: Vec<Index>,
    pub(crate) outputs: Vec<Index>,
}

pub(crate) fn recipe() -> impl Strategy<Value = Recipe> {
    (0..5_usize, 0..5_usize, 0..6_usize).prop_flat_map(|(inputs, registers, outputs)| {
        (
            prop::collection::vec(any::<bool>(), registers),
            steps(25),
            prop::collection::vec(any::<Index>(), registers),
            prop::collection::vec(any::<Index>(), outputs),
        )
            .prop_map(move |(initial, steps, next, outputs)| Recipe {
                inputs,
                initial,
                steps,
                next,
                outputs,
            })
    })
}

pub(crate) fn circuit(name: &str, recipe: &Recipe) -> Circuit {
    let mut builder = CircuitBuilder::new(name);
    let mut expressions = vec![builder.graph().constant(true)];
    for number in 0..recipe.inputs {
        expressions.push(builder.input(format!("u{number}")));
    }
    let mut registers = Vec::new();
    for (number, &initial) in recipe.initial.iter().enumerate() {
        let (register, value) = builder.register(format!("x{number}"), initial);
        registers.push(register);
        expressions.push(value);
    }
    grow(builder.graph(), &mut expressions, &recipe.steps);
    for (&register, next) in registers.iter().zip(&recipe.next) {
        builder.set_next(register, *next.get(&expressions));
    }
    for (number, output) in recipe.outputs.iter().enumerate() {
        builder.output(format!("y{number}"), *output.get(&expressions));
    }
    builder.finish().expect("names are numbered and all is set")
}
