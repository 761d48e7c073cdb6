//! Both forms of polynomials, diagrams and covers, each against the truth table.

mod common;

use common::{assignments, configuration, grown, steps, variables};
use proptest::prelude::*;
use understudy_logic::bdd::Diagrams;
use understudy_logic::{Cover, Expression, Graph, NormalForm, Polynomial, Variable, notation};

const INPUTS: u32 = 3;
const REGISTERS: u32 = 2;

/// Every representation of `root` has its truth table.
fn check(graph: &Graph, root: Expression) {
    let form = NormalForm::of(graph, root, 1_000).expect("at most 32 monomials");
    let factored = Polynomial::of(graph, root).expect("small");
    assert_eq!(factored.normal_form(1_000).as_ref(), Some(&form));
    assert_eq!(Polynomial::from(&form).normal_form(1_000).as_ref(), Some(&form));

    let variables = variables(INPUTS, REGISTERS);
    let diagrams = Diagrams::new(variables.clone(), 10_000);
    let diagram = diagrams.of(graph, root).expect("small");
    let cover = Cover::of(&diagrams, &diagram, 100).expect("small");
    let mut short = Graph::new();
    let two_level = cover.sum_of_products(&mut short);
    let formula = cover.factored(&mut short);

    let mut ones = 0;
    for assignment in assignments(&variables) {
        let expected = graph.evaluate(root, &assignment);
        ones += u128::from(expected);
        assert_eq!(form.evaluate(&assignment), expected);
        assert_eq!(factored.evaluate(&assignment), expected);
        assert_eq!(short.evaluate(two_level, &assignment), expected);
        assert_eq!(short.evaluate(formula, &assignment), expected);
    }
    assert_eq!(diagrams.count(&diagram), Some(ones));
    assert_eq!(diagram.is_constant(false), ones == 0);
    match diagrams.satisfying(&diagram) {
        None => assert_eq!(ones, 0),
        Some(chosen) => {
            assert!(graph.evaluate(root, |variable| { chosen.contains(&(variable, true)) }))
        }
    }
    irredundant(&diagrams, &cover);
}

/// No product of the cover can be left out.
fn irredundant(diagrams: &Diagrams, cover: &Cover) {
    let mut graph = Graph::new();
    let whole = cover.sum_of_products(&mut graph);
    let whole = diagrams.of(&graph, whole).expect("small");
    for left_out in 0..cover.products().len() {
        let mut sum = graph.constant(false);
        for (place, product) in cover.products().iter().enumerate() {
            let literals: Vec<Expression> = product
                .iter()
                .map(|literal| {
                    let variable = graph.variable(literal.variable);
                    if literal.negated { graph.not(variable) } else { variable }
                })
                .collect();
            let product = graph.all(literals);
            if place != left_out {
                sum = graph.or(sum, product);
            }
        }
        assert!(diagrams.of(&graph, sum).expect("small") != whole);
    }
}

proptest! {
    #![proptest_config(configuration(150))]

    #[test]
    fn every_form_has_the_truth_table(steps in steps(25)) {
        let (graph, root) = grown(INPUTS, REGISTERS, &steps);
        check(&graph, root);
    }

    #[test]
    fn diagrams_are_equal_exactly_when_functions_are(left in steps(12), right in steps(12)) {
        let (left_graph, left) = grown(INPUTS, REGISTERS, &left);
        let (right_graph, right) = grown(INPUTS, REGISTERS, &right);
        let variables = variables(INPUTS, REGISTERS);
        let diagrams = Diagrams::new(variables.clone(), 10_000);
        let left_diagram = diagrams.of(&left_graph, left).expect("small");
        let right_diagram = diagrams.of(&right_graph, right).expect("small");
        let differ = assignments(&variables).any(|assignment| {
            left_graph.evaluate(left, &assignment) != right_graph.evaluate(right, &assignment)
        });
        prop_assert_eq!(left_diagram != right_diagram, differ);
        let difference = diagrams.difference(&left_diagram, &right_diagram).expect("small");
        prop_assert_eq!(difference.is_some(), differ);
        if let Some(chosen) = difference {
            let assignment = |variable| chosen.contains(&(variable, true));
            prop_assert_ne!(
                left_graph.evaluate(left, assignment),
                right_graph.evaluate(right, assignment)
            );
        }
    }
}

/// All functions of two variables and all ways to join two of them.
#[test]
fn every_small_expression() {
    let names = variables(2, 0);
    let mut graph = Graph::new();
    let mut level: Vec<Expression> = vec![graph.constant(false), graph.constant(true)];
    level.extend(names.iter().map(|&variable| graph.variable(variable)));
    for _ in 0..2 {
        let operands = level.clone();
        for &left in &operands {
            level.push(graph.not(left));
            for &right in &operands {
                level.push(graph.and(left, right));
                level.push(graph.or(left, right));
                level.push(graph.xor(left, right));
            }
        }
        level.sort_unstable();
        level.dedup();
    }
    let diagrams = Diagrams::new(names.clone(), 10_000);
    let mut builder = diagrams.builder(&graph, |variable| variable);
    let mut functions = std::collections::HashMap::new();
    for &root in &level {
        let table: Vec<bool> =
            assignments(&names).map(|assignment| graph.evaluate(root, assignment)).collect();
        let form = NormalForm::of(&graph, root, 100).expect("at most 4 monomials");
        let diagram = builder.diagram(root).expect("small");
        let (known_form, known_diagram) =
            functions.entry(table).or_insert_with(|| (form.clone(), diagram.clone()));
        assert_eq!(*known_form, form);
        assert!(*known_diagram == diagram);
    }
    assert_eq!(functions.len(), 16);
}

fn name(variable: Variable) -> String {
    match variable {
        Variable::Input(index) => ["a", "b", "c", "d", "e", "f"][index as usize].to_owned(),
        Variable::Register(index) => format!("x{}", index + 1),
    }
}

/// An expression of five inputs, and how it is printed: polynomial, formula as it stands, short formula.
fn printed(make: impl Fn(&mut Graph, [Expression; 5]) -> Expression) -> String {
    let mut graph = Graph::new();
    let inputs = [0, 1, 2, 3, 4].map(|input| graph.variable(Variable::Input(input)));
    let root = make(&mut graph, inputs);
    let polynomial = Polynomial::of(&graph, root).expect("small");
    let diagrams = Diagrams::for_roots(&graph, &[root], 10_000);
    let cover = Cover::of(&diagrams, &diagrams.of(&graph, root).expect("small"), 100);
    let mut short = Graph::new();
    let factored = cover.expect("small").factored(&mut short);
    format!(
        "{}  |  {}  |  {}",
        polynomial.print(&name, ""),
        notation::boolean(&graph, root, &name).expect("small"),
        notation::boolean(&short, factored, &name).expect("small"),
    )
}

#[test]
fn formulas_read_as_in_the_paper() {
    let or = |graph: &mut Graph, [a, b, ..]: [Expression; 5]| graph.or(a, b);
    insta::assert_snapshot!(printed(or), @"a + b + ab  |  a ∨ b  |  a ∨ b");
    let nor = |graph: &mut Graph, [a, b, ..]: [Expression; 5]| {
        let either = graph.or(a, b);
        graph.not(either)
    };
    insta::assert_snapshot!(printed(nor), @"1 + a + b + ab  |  ¬(a ∨ b)  |  ¬a ∧ ¬b");
    let sealed = |graph: &mut Graph, [set, hold, release, stop, _]: [Expression; 5]| {
        let not_release = graph.not(release);
        let held = graph.and(hold, not_release);
        let either = graph.or(set, held);
        let not_stop = graph.not(stop);
        graph.and(either, not_stop)
    };
    insta::assert_snapshot!(printed(sealed), @"(1+d)(a + b + ab + bc + abc)  |  (a ∨ b ∧ ¬c) ∧ ¬d  |  (a ∨ b ∧ ¬c) ∧ ¬d");
    let sum = |graph: &mut Graph, [a, b, c, ..]: [Expression; 5]| graph.sum([a, b, c]);
    insta::assert_snapshot!(printed(sum), @"a + b + c  |  a ⊕ b ⊕ c  |  (b ∧ c ∨ ¬b ∧ ¬c) ∧ a ∨ (b ∧ ¬c ∨ c ∧ ¬b) ∧ ¬a");
    let product_of_sums = |graph: &mut Graph, [a, b, c, d, e]: [Expression; 5]| {
        let left = graph.or(a, b);
        let right = graph.any([c, d, e]);
        graph.and(left, right)
    };
    insta::assert_snapshot!(printed(product_of_sums), @"(a + b + ab)(1 + (1+c)(1+d)(1+e))  |  (a ∨ b) ∧ (c ∨ d ∨ e)  |  (a ∨ b) ∧ (c ∨ d ∨ e)");
    let tautology = |graph: &mut Graph, [a, b, ..]: [Expression; 5]| {
        let not_b = graph.not(b);
        graph.any([a, b, not_b])
    };
    insta::assert_snapshot!(printed(tautology), @"1  |  a ∨ b ∨ ¬b  |  1");
}

/// What is too large is refused with its bound, and not attempted.
#[test]
fn bounds_hold() {
    let mut graph = Graph::new();
    let pairs: Vec<Expression> = (0..20)
        .map(|pair| {
            let left = graph.variable(Variable::Input(2 * pair));
            let right = graph.variable(Variable::Input(2 * pair + 1));
            graph.or(left, right)
        })
        .collect();
    let all = graph.all(pairs.clone());
    let error = NormalForm::of(&graph, all, 1_000).expect_err("3^20 monomials");
    assert_eq!((error.limit, error.code()), (1_000, "U0410"));

    // The order that keeps the halves of the pairs apart needs 2^20 nodes; the one that keeps them together 40.
    let apart = (0..20).map(|pair| 2 * pair).chain((0..20).map(|pair| 2 * pair + 1));
    let diagrams = Diagrams::new(apart.map(Variable::Input), 5_000);
    let error = diagrams.of(&graph, all).err().expect("too many nodes");
    assert_eq!(error.code(), "U0412");
    assert!(diagrams.of(&graph, pairs[0]).is_ok(), "it can still be used");
    let diagrams = Diagrams::for_roots(&graph, &[all], 5_000);
    let diagram = diagrams.of(&graph, all).expect("few nodes");
    assert_eq!(diagrams.count(&diagram), Some(3_u128.pow(20)));

    let sum = graph.sum(pairs);
    let diagram = diagrams.of(&graph, sum).expect("few nodes");
    let error = Cover::of(&diagrams, &diagram, 100).expect_err("long");
    assert_eq!(error.code(), "U0414");

    let mut doubled = graph.variable(Variable::Input(0));
    for input in 1..40 {
        let other = graph.variable(Variable::Input(input));
        let sum = graph.xor(doubled, other);
        doubled = graph.and(sum, doubled);
        let again = graph.not(other);
        let turned = graph.or(doubled, again);
        doubled = graph.xor(turned, doubled);
    }
    let error = notation::boolean(&graph, doubled, &name).expect_err("2^40 leaves");
    assert_eq!(error.code(), "U0411");
    assert!(Polynomial::of(&graph, doubled).is_err());

    let unknown = graph.variable(Variable::Register(7));
    let error = diagrams.of(&graph, unknown).err().expect("not declared");
    assert_eq!(error.code(), "U0413");
}

/// An order that is bad for a function is changed when the nodes grow many, and the functions are the same.
#[test]
fn a_bad_order_is_changed_by_need() {
    let pairs = 18;
    let mut graph = Graph::new();
    let terms: Vec<Expression> = (0..pairs)
        .map(|pair| {
            let left = graph.variable(Variable::Input(2 * pair));
            let right = graph.variable(Variable::Input(2 * pair + 1));
            graph.and(left, right)
        })
        .collect();
    let any = graph.any(terms.clone());
    let sum = graph.sum(terms.clone());
    let apart = (0..pairs).map(|pair| 2 * pair).chain((0..pairs).map(|pair| 2 * pair + 1));
    let apart: Vec<Variable> = apart.map(Variable::Input).collect();
    let fixed = Diagrams::new(apart.clone(), 40_000);
    assert!(fixed.of(&graph, any).is_err(), "2^18 nodes");

    let diagrams = Diagrams::new(apart.clone(), 40_000).reordered_by_need();
    let found = diagrams.of(&graph, any).expect("2 nodes a pair");
    assert!(found.node_count() < 5_000, "{}", found.node_count());
    let first = diagrams.of(&graph, terms[0]).expect("few nodes");
    assert!(diagrams.and(&first, &found).expect("few nodes") == first);
    // 4^18 assignments, and three of four values of each pair give no term.
    assert_eq!(diagrams.count(&found), Some(4_u128.pow(pairs) - 3_u128.pow(pairs)));
    let summed = diagrams.of(&graph, sum).expect("linear");
    // The same two functions in an order that was good from the start.
    let good = Diagrams::for_roots(&graph, &[any, sum], 40_000);
    for (function, root) in [(&found, any), (&summed, sum)] {
        let same = good.of(&graph, root).expect("few nodes");
        assert_eq!(diagrams.count(function), good.count(&same));
        let chosen = diagrams.satisfying(function).expect("it is not 0");
        let value = |variable| chosen.contains(&(variable, true));
        assert!(diagrams.value(function, value) && good.value(&same, value));
    }
    // Quantification and substitution know where the variables went.
    let right =
        diagrams.product((0..pairs).map(|pair| Variable::Input(2 * pair + 1))).expect("few nodes");
    let some = diagrams.exists(&found, &right).expect("few nodes");
    let lefts: Vec<Expression> =
        (0..pairs).map(|pair| graph.variable(Variable::Input(2 * pair))).collect();
    let any_left = graph.any(lefts);
    assert!(some == diagrams.of(&graph, any_left).expect("few nodes"));
    let twins = (0..pairs).map(|pair| {
        let left = diagrams.variable(Variable::Input(2 * pair));
        (Variable::Input(2 * pair + 1), left.expect("a variable that is there"))
    });
    let twins = diagrams.substitution(twins).expect("declared");
    assert!(diagrams.substitute(&found, &twins).expect("few nodes") == some);
}

/// Recursion over 20,000 variables does not overrun the stack, and the sum over all of them takes linear time.
#[test]
fn deep_diagrams_need_no_deep_stack() {
    let mut graph = Graph::new();
    let mut every_second = |first: u32| {
        let from_the_bottom = (0..10_000).rev();
        let variables: Vec<Expression> = from_the_bottom
            .map(|input| graph.variable(Variable::Input(2 * input + first)))
            .collect();
        graph.sum(variables)
    };
    let (even, odd) = (every_second(0), every_second(1));
    let sum = graph.xor(even, odd);
    let reversed = graph.xor(odd, even);
    let diagrams = Diagrams::new((0..20_000).map(Variable::Input), 200_000);
    let left = diagrams.of(&graph, sum).expect("linear");
    assert!(diagrams.of(&graph, reversed).expect("linear") == left);
    let chosen = diagrams.satisfying(&left).expect("it is not 0");
    assert_eq!(chosen.len(), 20_000);
}
