//! Random circuits and formulas, against the reference.

use proptest::prelude::*;
use understudy_logic::bdd::Diagrams;
use understudy_logic::{Circuit, CircuitBuilder, Expression};
use understudy_verification::assumed::{assuming, with_assumptions};
use understudy_verification::explicit::Explicit;
use understudy_verification::induction::{Depth, Induction, prove_always};
use understudy_verification::property::{Formula, Path};
use understudy_verification::symbolic::{Checker, Resolved, Signal, Verdict};

use crate::naive::Naive;
use crate::replay::replays;

const REGISTERS: usize = 3;
const INPUTS: usize = 2;
const OUTPUTS: usize = 2;

/// A circuit whose functions are made by taking operations and operands from a list of numbers.
fn circuit(recipe: &[(u8, u8, u8)], initial: u8) -> Circuit {
    of_sums(recipe, initial, 1)
}

/// The same, with the sum of so many inputs in the place of each; the sums are outputs too, where they are no inputs.
fn of_sums(recipe: &[(u8, u8, u8)], initial: u8, inputs_each: usize) -> Circuit {
    let mut builder = CircuitBuilder::new("random");
    let mut pool: Vec<Expression> = Vec::new();
    for input in 0..INPUTS {
        let names = (0..inputs_each).map(|place| format!("u{}", input + place * INPUTS));
        let inputs: Vec<Expression> = names.map(|name| builder.input(name)).collect();
        let graph = builder.graph();
        let sum = inputs.into_iter().reduce(|sum, input| graph.xor(sum, input));
        pool.push(sum.expect("at least one"));
    }
    let sums = pool.clone();
    let mut registers = Vec::new();
    for register in 0..REGISTERS {
        let (id, value) = builder.register(format!("x{register}"), initial >> register & 1 == 1);
        registers.push(id);
        pool.push(value);
    }
    for &(operation, left, right) in recipe {
        let left = pool[left as usize % pool.len()];
        let right = pool[right as usize % pool.len()];
        let graph = builder.graph();
        pool.push(match operation % 4 {
            0 => graph.and(left, right),
            1 => graph.or(left, right),
            2 => graph.xor(left, right),
            _ => graph.not(left),
        });
    }
    let last = pool.len() - 1;
    for (place, register) in registers.into_iter().enumerate() {
        builder.set_next(register, pool[last - place]);
    }
    for output in 0..OUTPUTS {
        builder.output(format!("y{output}"), pool[last - REGISTERS - output]);
    }
    if inputs_each > 1 {
        for (input, sum) in sums.into_iter().enumerate() {
            builder.output(format!("sum{input}"), sum);
        }
    }
    builder.finish().expect("the names differ")
}

pub(crate) fn one_scan() -> BoxedStrategy<Resolved> {
    let leaf = prop_oneof![
        (0..OUTPUTS).prop_map(|output| Formula::Signal(Signal::Output(output))),
        (0..INPUTS).prop_map(|input| Formula::Signal(Signal::Input(input))),
    ];
    leaf.prop_recursive(2, 6, 2, |inner| {
        prop_oneof![
            inner.clone().prop_map(Formula::negated),
            (inner.clone(), inner).prop_map(|(left, right)| left.and(right)),
        ]
    })
    .boxed()
}

/// Formulas of one scan over inputs.
fn of_inputs() -> BoxedStrategy<Resolved> {
    let leaf = (0..INPUTS).prop_map(|input| Formula::Signal(Signal::Input(input)));
    leaf.prop_recursive(2, 5, 2, connected).boxed()
}

/// Formulas that are made of others in one scan.
fn connected(inner: BoxedStrategy<Resolved>) -> BoxedStrategy<Resolved> {
    let pair = || (inner.clone(), inner.clone()).prop_map(|(a, b)| (Box::new(a), Box::new(b)));
    prop_oneof![
        inner.clone().prop_map(Formula::negated),
        pair().prop_map(|(a, b)| Formula::And(a, b)),
        pair().prop_map(|(a, b)| Formula::Or(a, b)),
        pair().prop_map(|(a, b)| Formula::Implies(a, b)),
        pair().prop_map(|(a, b)| Formula::Same(a, b)),
    ]
    .boxed()
}

fn path() -> impl Strategy<Value = Path> {
    prop_oneof![Just(Path::All), Just(Path::Some)]
}

pub(crate) fn formula() -> impl Strategy<Value = Resolved> {
    one_scan().prop_recursive(3, 12, 2, |inner| {
        let pair = || (inner.clone(), inner.clone()).prop_map(|(a, b)| (Box::new(a), Box::new(b)));
        let single = || (path(), inner.clone().prop_map(Box::new));
        prop_oneof![
            5 => connected(inner.clone()),
            1 => single().prop_map(|(path, inner)| Formula::Next(path, inner)),
            1 => single().prop_map(|(path, inner)| Formula::Eventually(path, inner)),
            1 => single().prop_map(|(path, inner)| Formula::Always(path, inner)),
            1 => (path(), pair()).prop_map(|(path, (a, b))| Formula::Until(path, a, b)),
            1 => (single(), 0..4_u32).prop_map(|((path, inner), n)| Formula::Within(path, n, inner)),
        ]
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// The sets of diagrams and the lists of states agree, with and without fairness, and every run that is shown is one of the circuit.
    #[test]
    fn agrees_with_the_reference(
        recipe in prop::collection::vec(any::<(u8, u8, u8)>(), 6..16),
        initial in any::<u8>(),
        property in formula(),
        fair in prop::collection::vec(one_scan(), 0..3),
    ) {
        let circuit = circuit(&recipe, initial);
        let naive = Naive::new(&circuit, &fair);
        let mut checker = Checker::new(&circuit, fair, Diagrams::DEFAULT_LIMIT);
        let verdict = checker.check(&property).expect("small");
        let (holds, trace) = match verdict {
            Verdict::Holds(trace) => (true, trace),
            Verdict::Fails(trace) => (false, trace),
        };
        let readable = property.map(&|signal: &Signal| Some(naive.names()[signal].to_owned()));
        prop_assert_eq!(holds, naive.holds(&property), "{:?}", readable.map(|f| f.to_string()));
        if let Some(trace) = trace {
            prop_assert!(replays(&circuit, &trace));
        }
    }

    /// Under an assumption about inputs the runs are those in which it holds in every scan, with fairness and without.
    #[test]
    fn assumptions_leave_runs_out(
        recipe in prop::collection::vec(any::<(u8, u8, u8)>(), 6..16),
        initial in any::<u8>(),
        property in formula(),
        assumed in of_inputs(),
        fair in prop::collection::vec(one_scan(), 0..2),
    ) {
        let circuit = circuit(&recipe, initial);
        let naive = Naive::new(&circuit, &fair).where_it_holds(&assumed);
        let with = with_assumptions(&circuit, std::slice::from_ref(&assumed));
        let ok = Signal::Output(OUTPUTS);
        let mut checker = Checker::new(&with, fair.clone(), Diagrams::DEFAULT_LIMIT);
        prop_assume!(!matches!(checker.check(&Formula::Signal(ok).negated().always()), Ok(Verdict::Holds(_))));
        let mut fair = fair;
        if !fair.is_empty() {
            fair.push(Formula::Signal(ok));
        }
        let mut checker = Checker::new(&with, fair, Diagrams::DEFAULT_LIMIT);
        let (holds, trace) = match checker.check(&assuming(&property, ok)).expect("small") {
            Verdict::Holds(_) => (true, None),
            Verdict::Fails(trace) => (false, trace),
        };
        prop_assert_eq!(holds, naive.holds(&property), "{:?} under {:?}", property, assumed);
        if let Some(trace) = trace {
            prop_assert!(replays(&with, &trace));
        }
    }

    /// The list of reachable states and the lists of all states agree, and runs are as short as those from the diagrams.
    #[test]
    fn listed_states_agree_with_the_reference(
        recipe in prop::collection::vec(any::<(u8, u8, u8)>(), 6..16),
        initial in any::<u8>(),
        property in formula(),
    ) {
        let circuit = circuit(&recipe, initial);
        let naive = Naive::new(&circuit, &[]);
        let listed = Explicit::new(&circuit, 1 << (REGISTERS + INPUTS)).expect("no more states than there are");
        let (holds, _) = listed.check(std::slice::from_ref(&property)).remove(0);
        prop_assert_eq!(holds, naive.holds(&property));
        let kept = property.clone().always();
        let (holds, run) = listed.check(std::slice::from_ref(&kept)).remove(0);
        prop_assert_eq!(holds, naive.holds(&kept));
        let mut checker = Checker::new(&circuit, Vec::new(), Diagrams::DEFAULT_LIMIT);
        if let (Verdict::Fails(Some(trace)), Some(run)) = (checker.check(&kept).expect("small"), run) && property.is_of_one_scan() {
            prop_assert_eq!(trace.scans.len(), run.len());
        }
    }

    /// Clauses and lists of states agree on invariants; so many scans decide every circuit of this size.
    #[test]
    fn induction_agrees_with_the_reference(
        recipe in prop::collection::vec(any::<(u8, u8, u8)>(), 6..16),
        initial in any::<u8>(),
        kept in one_scan(),
    ) {
        let circuit = circuit(&recipe, initial);
        let naive = Naive::new(&circuit, &[]);
        let holds = match prove_always(&circuit, &kept, Depth::of(1 << REGISTERS)).expect("of one scan") {
            Induction::Holds(_) => true,
            Induction::Fails(trace) => {
                prop_assert!(replays(&circuit, &trace));
                false
            }
            Induction::Undecided(scans) => panic!("{scans} scans are as many as there are states"),
        };
        prop_assert_eq!(holds, naive.holds(&kept.always()));
    }

    /// A run that refutes `AG p` ends where p does not hold, and one that refutes `AG (p -> AF q)` comes by p and then never to q.
    #[test]
    fn what_is_shown_is_a_counterexample(
        recipe in prop::collection::vec(any::<(u8, u8, u8)>(), 6..16),
        initial in any::<u8>(),
        first in 0..OUTPUTS,
        second in 0..INPUTS,
    ) {
        let circuit = circuit(&recipe, initial);
        let mut checker = Checker::new(&circuit, Vec::new(), Diagrams::DEFAULT_LIMIT);
        let never: Resolved = Formula::Signal(Signal::Output(first)).negated().always();
        if let Verdict::Fails(trace) = checker.check(&never).expect("small") {
            let trace = trace.expect("a run shows it");
            prop_assert!(trace.scans[trace.scans.len() - 1].outputs[first]);
        }
        let answer = Formula::Eventually(Path::All, Box::new(Formula::Signal(Signal::Input(second))));
        let response = Formula::Signal(Signal::Output(first)).implies(answer).always();
        if let Verdict::Fails(trace) = checker.check(&response).expect("small") {
            let trace = trace.expect("a run shows it");
            let from = trace.again_from.expect("never is shown by a run without end");
            prop_assert!(trace.scans[from..].iter().all(|scan| !scan.inputs[second]));
            prop_assert!(trace.scans.iter().any(|scan| scan.outputs[first]));
            prop_assert!(replays(&circuit, &trace));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// With the sums of inputs in the place of inputs nothing else is so, whether the states of one x are fewer or more than are scanned at once.
    #[test]
    fn listed_states_of_many_inputs(
        recipe in prop::collection::vec(any::<(u8, u8, u8)>(), 6..16),
        initial in any::<u8>(),
        property in formula(),
        inputs_each in 2..6_usize,
    ) {
        let few = circuit(&recipe, initial);
        let naive = Naive::new(&few, &[]);
        let list = |circuit| Explicit::new(circuit, 1 << 14).expect("no more states than there are");
        let (few, many) = (list(&few), list(&of_sums(&recipe, initial, inputs_each)));
        let of_sums = |property: &Resolved| {
            let mapped = property.map(&|signal: &Signal| Some(match signal {
                Signal::Input(input) => Signal::Output(OUTPUTS + input),
                Signal::Output(output) => Signal::Output(*output),
            }));
            mapped.expect("every signal has one")
        };
        for property in [property.clone(), property.always()] {
            let (holds, run) = many.check(&[of_sums(&property)]).remove(0);
            prop_assert_eq!(holds, naive.holds(&property));
            let (_, shortest) = few.check(&[property]).remove(0);
            prop_assert_eq!(run.map(|run| run.len()), shortest.map(|run| run.len()));
        }
    }
}
