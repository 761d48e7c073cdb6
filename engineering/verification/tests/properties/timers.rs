//! Many scans at once, against single scans: random ladders with timers.

use std::fmt::Write as _;
use std::time::Duration;

use proptest::prelude::*;
use understudy_ladder::parse;
use understudy_logic::Circuit;
use understudy_logic::bdd::Diagrams;
use understudy_verification::explicit::Explicit;
use understudy_verification::program::Subject;
use understudy_verification::property::Asked;
use understudy_verification::symbolic::{Checker, Resolved, Trace, Verdict};

use crate::naive::Naive;
use crate::random::{formula, one_scan};
use crate::replay::replays;

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
    use understudy_verification::property::Formula;
    match formula {
        Formula::Constant(value) => *value,
        Formula::Signal(signal) => run.value(*signal, 0),
        Formula::Not(inner) => !holds_in_last(inner, run),
        Formula::And(left, right) => holds_in_last(left, run) && holds_in_last(right, run),
        _ => unreachable!("made of these only"),
    }
}
