//! Ladders as people write them.

use std::cell::Cell;
use std::time::Duration;

use understudy_ladder::parse;
use understudy_logic::Circuit;
use understudy_logic::bdd::Diagrams;
use understudy_verification::program::{Answer, Bounds, Lamp, OutputFinding, Subject};
use understudy_verification::property::Asked;
use understudy_verification::property::read_one;
use understudy_verification::symbolic::{Checker, Trace, Verdict, resolve};
use understudy_verification::{Stopped, Work, smv};

use crate::replay::replays;

/// From one scan to the next.
const PERIOD: Duration = Duration::from_millis(10);

const SEAL_IN: &str = "\
program pump
input start
input stop
output motor
output lamp
memory ready

rung
    [ start | motor ] /stop ( motor )
rung
    motor {TON warm 30ms}
rung
    warm.Q ( ready )
rung
    ready /stop ( lamp )
";

fn circuit() -> Circuit {
    let parsed = parse(SEAL_IN);
    assert_eq!(parsed.diagnostics, []);
    parsed.program.lower_observed(Duration::from_millis(10)).expect("a right program")
}

fn check(property: &str, fair: &[&str]) -> (bool, Option<Vec<String>>) {
    let circuit = circuit();
    let formula = |text: &str| {
        let property = read_one(text, PERIOD).expect("right");
        resolve(&property.formula, &circuit).expect("known signals")
    };
    let fair = fair.iter().map(|text| formula(text)).collect();
    let mut checker = Checker::new(&circuit, fair, Diagrams::DEFAULT_LIMIT);
    let (holds, trace) = match checker.check(&formula(property)).expect("small") {
        Verdict::Holds(trace) => (true, trace),
        Verdict::Fails(trace) => (false, trace),
    };
    let rows = trace.map(|trace| {
        assert!(replays(&circuit, &trace));
        let bits = |bits: &[bool]| -> String {
            bits.iter().map(|&bit| if bit { '1' } else { '0' }).collect()
        };
        let rows = trace.scans.iter();
        rows.map(|row| format!("{} {}", bits(&row.inputs), bits(&row.outputs))).collect()
    });
    (holds, rows)
}

#[test]
fn a_seal_in_keeps_what_it_promises() {
    assert_eq!(check("never motor and stop", &[]), (true, None));
    assert_eq!(check("lamp only while motor", &[]), (true, None));
    assert!(check("motor can always be reached", &[]).0);
    assert!(check("motor stays until stop", &[]).0);
    assert!(check("warm.Q only while motor", &[]).0);
    // The operator may stop it before it is warm, or for ever.
    assert!(!check("motor is followed by lamp", &[]).0);
    assert!(!check("motor is followed by lamp", &["!stop"]).0);
    assert!(check("AG (AG !stop -> (motor -> ABF 0..5 lamp))", &[]).0);
    // Fair runs start again and again.
    assert!(!check("AF motor", &[]).0);
    assert!(check("AF motor", &["start & !stop"]).0);
}

#[test]
fn what_is_reached_is_shown_scan_by_scan() {
    let (holds, rows) = check("lamp can be reached", &[]);
    assert!(holds);
    let rows = rows.expect("a run");
    // The start, and the three scans of the timer.
    assert_eq!(rows.len(), 4, "{rows:?}");
    assert_eq!(rows[0], "10 1000");
    let (holds, rows) = check("AG !lamp", &[]);
    assert!(!holds);
    assert_eq!(rows.expect("a run").len(), 4);
}

#[test]
fn every_output_is_asked_whether_it_can_be_switched() {
    let check = |rung: &str, expected: OutputFinding| {
        let text = format!("program p\ninput a\noutput y\nrung\n    {rung}\n");
        let program = parse(&text).program;
        let subject =
            Subject::new(&program, Duration::from_millis(10), &Asked::default()).expect("right");
        let found = subject.switches(Bounds::default());
        let found = found.into_iter().map(|(_, finding)| match finding {
            // Which scans show it is not the matter here.
            OutputFinding::Stuck(lamp, _) => format!("Stuck({lamp:?})"),
            other => format!("{other:?}"),
        });
        let expected = match expected {
            OutputFinding::Stuck(lamp, _) => format!("Stuck({lamp:?})"),
            other => format!("{other:?}"),
        };
        assert_eq!(found.collect::<Vec<_>>(), [expected], "{rung}");
    };
    let stuck = |lamp| {
        let signals = Vec::new();
        let (scans, again_from) = (Vec::new(), None);
        OutputFinding::Stuck(lamp, Trace { signals, scans, again_from })
    };
    check("a ( y )", OutputFinding::Free);
    check("a /a ( y )", OutputFinding::Never(Lamp::On));
    check("[ a | /a ] ( y )", OutputFinding::Never(Lamp::Off));
    check("a ( S y )", stuck(Lamp::Off));
}

/// What NuSMV is given: read by it once, and kept.
#[test]
fn the_texts_for_nusmv() {
    let program = parse(SEAL_IN).program;
    let circuit = circuit();
    let properties = ["never motor and stop", "lamp can always be reached"].map(|text| {
        let property = read_one(text, PERIOD).expect("right");
        resolve(&property.formula, &circuit).expect("known signals")
    });
    insta::assert_snapshot!("of_circuit", smv::of_circuit(&circuit, &properties, &[]));
    insta::assert_snapshot!("of_rungs", smv::of_rungs(&program));
}

#[test]
fn an_unknown_signal_is_named() {
    let property = read_one("AG (motor -> lmap & oops)", PERIOD).expect("right");
    let circuit = circuit();
    let unknown = resolve(&property.formula, &circuit).expect_err("two are unknown");
    let names: Vec<&str> = unknown.iter().map(|named| named.name.as_str()).collect();
    assert_eq!(names, ["lmap", "oops"]);
}

/// More inputs than 64 lanes tell apart, and more registers than a word: a shift register, tapped at its end.
#[test]
fn listed_states_of_many_inputs_and_registers() {
    use std::fmt::Write as _;
    use understudy_verification::explicit::{Explicit, ExplicitError};

    let mut text = String::from("program shift\n");
    for input in 0..8 {
        let _ = writeln!(text, "input i{input}");
    }
    text.push_str("output y\n");
    for place in 0..70 {
        let _ = writeln!(text, "memory m{place} = 0");
    }
    text.push_str("rung\n    m69 ( y )\n");
    for place in (1..70).rev() {
        let _ = writeln!(text, "rung\n    m{} ( m{place} )", place - 1);
    }
    // One bit at most is on its way: the next one begins when it has left.
    let waiting: Vec<String> = (1..70).map(|place| format!("/m{place}")).collect();
    let _ = writeln!(text, "rung\n    i0 i7 /m0 {} ( m0 )", waiting.join(" "));
    let (program, _) = parse(&text).into_result().expect("a right program");
    let circuit = program.lower_observed(Duration::from_millis(10)).expect("a right program");
    let listed = Explicit::new(&circuit, 100_000).expect("few states");
    assert_eq!(listed.count(), 71);
    let formulas = ["AG !y", "AG EF y", "never i0 and y", "EF (y & m3)"].map(|text| {
        let property = read_one(text, PERIOD).expect("right");
        resolve(&property.formula, &circuit).expect("known signals")
    });
    let found = listed.check(&formulas);
    let found = found.iter();
    let found: Vec<(bool, Option<usize>)> =
        found.map(|(holds, run)| (*holds, run.as_ref().map(Vec::len))).collect();
    assert_eq!(found, [(false, Some(71)), (true, None), (false, Some(71)), (false, None)]);
    let bound = 70 * 256;
    let refused = Explicit::new(&circuit, bound).err();
    assert_eq!(refused, Some(ExplicitError::States { bound }));
}

/// All the `a` stand before all the `b` in the order that the program suggests, where `any` needs 2^13 nodes; in pairs it needs two a pair.
#[test]
fn an_order_that_is_bad_is_changed_by_need() {
    let pairs = 13;
    let mut text = String::from("program twins\n");
    let all = |name: &str| -> String { (0..pairs).map(|k| format!("{name}{k} ")).collect() };
    for k in 0..pairs {
        text += &format!("input a{k}\ninput b{k}\n");
    }
    text += "output left\noutput right\noutput any\n";
    text += &format!("rung\n    {}( left )\n", all("a"));
    text += &format!("rung\n    {}( right )\n", all("b"));
    let twins: Vec<String> = (0..pairs).map(|k| format!("a{k} b{k}")).collect();
    text += &format!("rung\n    [ {} ] ( any )\n", twins.join(" | "));
    let circuit =
        parse(&text).program.lower_observed(Duration::from_millis(10)).expect("a right program");
    let verdict = |property: &str, nodes: usize, fixed: bool| {
        let property = read_one(property, PERIOD).expect("right");
        let formula = resolve(&property.formula, &circuit).expect("known signals");
        let checker = Checker::new(&circuit, Vec::new(), nodes);
        let mut checker = if fixed { checker.in_fixed_order() } else { checker };
        checker.check(&formula).map(|verdict| match verdict {
            Verdict::Holds(_) => true,
            Verdict::Fails(trace) => {
                assert!(trace.is_none_or(|trace| replays(&circuit, &trace)));
                false
            }
        })
    };
    for (property, holds) in [
        ("AG (left & right -> any)", true),
        ("AG (left & b3 -> any)", true),
        ("AG EF (any & !left & !right)", true),
        ("AG (any -> left | right)", false),
        ("AG (any & right -> left)", false),
    ] {
        assert!(verdict(property, 3_000, true).is_err(), "{property}");
        assert_eq!(verdict(property, 3_000, false), Ok(holds), "{property}");
        assert_eq!(verdict(property, 400_000, true), Ok(holds), "{property}");
    }
}

/// A supervisor of 234 rungs: diagrams of all its states do not end, and it reaches 2,464 with a period of 5 s.
#[test]
fn a_large_supervisor_is_decided() {
    let text = include_str!("../../../../examples/boiler/complete.ladder");
    let program = parse(text).program;
    let period = Duration::from_secs(5);
    let subject = Subject::new(&program, period, &Asked::default()).expect("a right program");
    let bounds = Bounds { nodes: 1 << 14, ..Bounds::default() };
    for (signal, finding) in subject.switches(bounds) {
        let name = signal.name(subject.circuit());
        assert_eq!(finding, OutputFinding::Free, "{name}");
    }
    let decide = |property: &str| {
        let property = read_one(property, PERIOD).expect("right");
        let formula = subject.resolve(&property).expect("known signals");
        let answers = subject.check(&[formula], Vec::new(), bounds, &mut |_, _| {});
        match &answers[0] {
            Answer::Holds(_) => true,
            Answer::Fails(trace) => {
                let trace = trace.as_ref();
                assert!(trace.is_none_or(|trace| replays(subject.circuit(), trace)));
                false
            }
            Answer::Undecided(why) => panic!("{}: {why}", property.text),
        }
    };
    assert!(decide("never gas_valve_low and gas_valve_high"));
    assert!(decide("gas_valve_high only while blower"));
    assert!(decide("AG (gas_valve_low -> EF gas_valve_high)"));
    assert!(!decide("never purging and blower"));
}

/// The functions of its registers are large diagrams in any order, and it has few states: they are listed before an order is looked for.
#[test]
fn states_are_listed_first_where_functions_are_large() {
    let program = parse(include_str!("../../../../examples/boiler/main.ladder")).program;
    let period = Duration::from_millis(100);
    let subject = Subject::new(&program, period, &Asked::default()).expect("a right program");
    let switches = |name| {
        let property = read_one(&format!("AG (EF {name} & EF !{name})"), period).expect("right");
        subject.resolve(&property).expect("known signals")
    };
    let asked = ["blower", "gas_valve_high"].map(switches);
    let is_small = |work| !matches!(work, Work::Diagrams { nodes, .. } if nodes > 1 << 15);
    let bounds = Bounds { go_on: &is_small, ..Bounds::default() };
    let answers = subject.check(&asked, Vec::new(), bounds, &mut |_, _| {});
    assert!(answers.iter().all(|answer| matches!(answer, Answer::Holds(_))), "{answers:?}");
}

/// Whoever has a clock can end it, and is told what was proved until then.
#[test]
fn a_proof_ends_when_nobody_waits() {
    let text = include_str!("../../../../examples/boiler/complete.ladder");
    let program = parse(text).program;
    let subject = Subject::new(&program, Duration::from_millis(10), &Asked::default())
        .expect("a right program");
    let asked = Cell::new(0);
    let go_on = |_: Work| {
        asked.set(asked.get() + 1);
        asked.get() < 40
    };
    let bounds = Bounds { go_on: &go_on, ..Bounds::default() };
    let property = read_one("AG EF gas_valve_high", PERIOD).expect("right");
    let formula = subject.resolve(&property).expect("known signals");
    let mut told = 0;
    let answers = subject.check(&[formula], Vec::new(), bounds, &mut |_, _| told += 1);
    let Answer::Undecided(undecided) = &answers[0] else {
        panic!("{answers:?}");
    };
    assert_eq!((undecided.why, told), (Some(Stopped::Time), 1));
}
