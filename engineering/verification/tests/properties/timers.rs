//! Many scans at once, against single scans: random ladders with timers.

use std::fmt::Write as _;
use std::time::Duration;

use proptest::prelude::*;
use understudy_ladder::parse;
use understudy_logic::Circuit;
use understudy_logic::bdd::Diagrams;
use understudy_verification::Work;
use understudy_verification::explicit::Explicit;
use understudy_verification::program::{Answer, Bounds, Subject};
use understudy_verification::property::{Asked, Formula};
use understudy_verification::symbolic::{Checker, Resolved, Trace, Verdict};

use crate::naive::Naive;
use crate::random::{formula, one_scan};
use crate::replay::replays;

#[path = "../../benches/timers/programs.rs"]
#[expect(dead_code, reason = "the benchmark writes other families too")]
mod programs;

/// What contacts ask for.
const OPERANDS: [&str; 6] = ["u0", "u1", "y0", "y1", "t0.Q", "t1.Q"];

/// Two rungs, each with a timer of its preset number of scans between random contacts; a scan is 1 ms.
fn circuit(rungs: &[(u8, u8, u8, u8)], presets: [u32; 2]) -> Circuit {
    let mut text = String::from("program random\ninput u0\ninput u1\noutput y0\noutput y1\n");
    for (place, (preset, &(kind, first, second, third))) in presets.iter().zip(rungs).enumerate() {
        let timer = ["TON", "TOF", "TP"][kind as usize % 3];
        let coil = ["", "S ", "R "][kind as usize / 3 % 3];
        let contact = |number: u8| {
            let negated = if number / 6 % 2 == 1 { "/" } else { "" };
            format!("{negated}{}", OPERANDS[number as usize % 6])
        };
        let [first, second, third] = [first, second, third].map(contact);
        let _ = writeln!(
            text,
            "rung\n    [ {first} | {second} ] {{{timer} t{place} {preset}ms}} ( {coil}y{place} )\n\
             rung\n    {third} {second} ( y{} )",
            1 - place
        );
    }
    let parsed = parse(&text);
    let subject = Subject::new(&parsed.program, Duration::from_millis(1), &Asked::default())
        .expect("a right program");
    subject.circuit().clone()
}

fn rungs() -> impl Strategy<Value = Vec<(u8, u8, u8, u8)>> {
    prop::collection::vec(any::<(u8, u8, u8, u8)>(), 2)
}

fn check(
    circuit: &Circuit,
    fair: Vec<Resolved>,
    property: &Resolved,
    single: usize,
) -> (bool, Option<Trace>) {
    let checker = Checker::new(circuit, fair, Diagrams::DEFAULT_LIMIT);
    match checker.with_single_scans(single).check(property) {
        Ok(Verdict::Holds(trace)) => (true, trace),
        Ok(Verdict::Fails(trace)) => (false, trace),
        Err(stopped) => panic!("{stopped}"),
    }
}

/// `AG (EF y & EF !y)` for each output y.
fn switched(text: &str) -> (Subject, Vec<Resolved>) {
    let program = parse(text).program;
    let period = Duration::from_millis(1);
    let subject = Subject::new(&program, period, &Asked::default()).expect("a right program");
    let outputs = subject.outputs().map(Formula::Signal);
    let again = |signal: Resolved| signal.reachable();
    let asked = outputs.map(|on| again(on.clone()).and(again(on.negated())).always()).collect();
    (subject, asked)
}

/// Timers that begin each other and count on at the same time: in the order of the program the sets need more than 100,000 nodes from 40 scans on.
#[test]
fn delays_that_follow_each_other_stay_small() {
    for kind in ["TOF", "TP"] {
        let (subject, asked) = switched(&programs::edges(kind, 100, true));
        let is_small = |work| !matches!(work, Work::Diagrams { nodes, .. } if nodes > 100_000);
        let bounds = Bounds { go_on: &is_small, ..Bounds::default() };
        let answers = subject.check(&asked, Vec::new(), bounds, &mut |_, _| {});
        let held = answers.iter().filter(|answer| matches!(answer, Answer::Holds(_))).count();
        assert_eq!(held, 6, "{kind}: {answers:?}");
    }
}

/// Three timers that begin each other in a ring have a million states, of which each scan more finds as many as the one before: they are listed
/// before any diagram is made, which has no end here.
#[test]
fn states_that_become_no_more_with_each_scan_are_listed_first() {
    let (subject, asked) = switched(&programs::random(28, 3, 10, 10_000));
    let is_list = |work| !matches!(work, Work::Diagrams { .. });
    let bounds = Bounds { go_on: &is_list, ..Bounds::default() };
    let answers = subject.check(&asked, Vec::new(), bounds, &mut |_, _| {});
    let is_decided = |answer: &Answer| !matches!(answer, Answer::Undecided(_));
    assert!(answers.len() == 3 && answers.iter().all(is_decided));
}

/// Random programs of timers, edges, mutual resets and counters: the verdicts of a list of all states, after any number of single scans.
#[test]
fn programs_of_timers_agree_with_a_list_of_states() {
    let mut compared = [0; 2];
    for seed in 1000..1060 {
        let text = programs::random(seed, 2 + (seed % 3) as usize, 2, 9);
        let (subject, asked) = switched(&text);
        let Ok(listed) = Explicit::new(subject.circuit(), 1 << 18) else {
            continue;
        };
        for (property, (expected, _)) in asked.iter().zip(listed.check(&asked)) {
            let (holds, trace) = check(subject.circuit(), Vec::new(), property, seed as usize % 4);
            assert_eq!(holds, expected, "seed {seed}: {property:?} of\n{text}");
            assert!(trace.is_none_or(|trace| replays(subject.circuit(), &trace)));
            compared[usize::from(holds)] += 1;
        }
    }
    assert!(compared[0] > 10 && compared[1] > 50, "{compared:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    /// All states of short timers, with and without fairness; every run that is shown is one of the circuit.
    #[test]
    fn jumps_agree_with_the_reference(
        rungs in rungs(),
        presets in [1..4_u32, 1..4_u32],
        property in formula(),
        fair in prop::collection::vec(one_scan(), 0..2),
    ) {
        let circuit = circuit(&rungs, presets);
        let naive = Naive::new(&circuit, &fair);
        let (holds, trace) = check(&circuit, fair, &property, 0);
        prop_assert_eq!(holds, naive.holds(&property));
        prop_assert!(trace.is_none_or(|trace| replays(&circuit, &trace)));
    }

    /// The states of long timers, listed scan by scan: the same verdicts after any number of single scans, and runs that end where they must.
    #[test]
    fn jumps_agree_with_a_list_of_states(
        rungs in rungs(),
        presets in [1..150_u32, 1..150_u32],
        property in formula(),
        kept in one_scan(),
        single in 0..70_usize,
    ) {
        let circuit = circuit(&rungs, presets);
        let listed = Explicit::new(&circuit, 1 << 20).expect("two timers");
        let invariant = kept.clone().always();
        let reached = kept.clone().negated().reachable();
        let asked = [property, invariant, reached];
        let expected = listed.check(&asked);
        for (property, (expected, _)) in asked.iter().zip(&expected) {
            let (holds, trace) = check(&circuit, Vec::new(), property, single);
            prop_assert_eq!(holds, *expected);
            prop_assert!(trace.is_none_or(|trace| replays(&circuit, &trace)));
        }
        let (holds, trace) = check(&circuit, Vec::new(), &asked[1], single);
        if !holds {
            let trace = trace.expect("a run shows it");
            let shortest = expected[1].1.as_ref().expect("a run shows it").len();
            prop_assert!(trace.scans.len() >= shortest);
            prop_assert!(shortest > single || trace.scans.len() == shortest);
            let last = Trace { scans: trace.scans[trace.scans.len() - 1..].to_vec(), ..trace };
            prop_assert!(!holds_in_last(&kept, &last));
        }
    }
}

/// Whether a formula of one scan holds in the only scan of a run.
fn holds_in_last(formula: &Resolved, run: &Trace) -> bool {
    match formula {
        Formula::Constant(value) => *value,
        Formula::Signal(signal) => run.value(*signal, 0),
        Formula::Not(inner) => !holds_in_last(inner, run),
        Formula::And(left, right) => holds_in_last(left, run) && holds_in_last(right, run),
        _ => unreachable!("made of these only"),
    }
}
