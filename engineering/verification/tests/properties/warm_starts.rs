//! A proof holds for a program that is restarted warm in any scans.

use std::collections::{BTreeSet, HashSet};
use std::time::Duration;

use understudy_bits::{Member, POWER_RETURNS, Source};
use understudy_ladder::{Program, parse};
use understudy_logic::{Scan, Scratch};
use understudy_structured_text::{Options, lower, parse as parse_text};
use understudy_testing::random::random_program;
use understudy_verification::numbers::{self, Model};
use understudy_verification::program::{Answer, Bounds, Lamp, OutputFinding, Subject};
use understudy_verification::property::{Asked, Property, read, read_one};
use understudy_verification::symbolic::{Signal, Trace};

const PERIOD: Duration = Duration::from_millis(100);

fn ladder(text: &str) -> Program {
    parse(text).into_result().expect("a sound program").0
}

fn property(text: &str) -> Property {
    read_one(text, PERIOD).expect("a property")
}

fn answer(subject: &Subject, text: &str) -> Answer {
    let formula = subject.resolve(&property(text)).expect("names of the program");
    let mut answers = subject.check(&[formula], Vec::new(), Bounds::default(), &mut |_, _| {});
    answers.remove(0)
}

/// `seen` is kept, `armed` is not: only after a restart is one TRUE without the other.
const LATCHES: &str = "program p\ninput a\noutput y\nmemory seen = 0\nmemory armed = 0\nRETAIN\
    rung [ a | seen ] ( seen )\nrung [ a | armed ] ( armed )\nrung seen /armed ( y )\n";

#[test]
fn what_only_a_mixed_state_breaks_is_found() {
    let plain = ladder(&LATCHES.replace("RETAIN", ""));
    let subject = Subject::new(&plain, PERIOD, &Asked::default()).expect("a circuit");
    assert!(matches!(answer(&subject, "never y"), Answer::Holds(_)));
    assert_eq!(subject.restarting().count(), 0);

    let kept = ladder(&LATCHES.replace("RETAIN", "retain seen\n"));
    let subject = Subject::new(&kept, PERIOD, &Asked::default()).expect("a circuit");
    let restarting: Vec<&str> = subject.restarting().collect();
    assert_eq!(restarting, [POWER_RETURNS]);
    let Answer::Fails(Some(trace)) = answer(&subject, "never y") else {
        panic!("a restart breaks it");
    };
    assert_eq!(restarts(&subject, &trace).last(), Some(&true), "{trace:?}");
    // The run is one of stations: their circuit, started warm where the run says so.
    let typed = kept.typed(PERIOD).expect("a sound program");
    let exact = understudy_ladder::circuit(&typed).expect("a circuit");
    let mask = exact.layout.retentive_mask(&typed);
    let scan = Scan::new(&exact.circuit);
    let mut state = scan.initial().to_vec();
    let mut outputs = [0];
    for (row, restarts) in trace.scans.iter().zip(restarts(&subject, &trace)) {
        if restarts {
            state[0] = scan.initial()[0] & !mask[0] | state[0] & mask[0];
        }
        scan.step(&mut Scratch::default(), &mut state, &[u64::from(row.inputs[0])], &mut outputs);
    }
    assert_eq!(outputs, [1]);
    // Who assumes that the power stays has the proof.
    let assumed = read("assume: !power.returns", PERIOD);
    let subject = Subject::new(&kept, PERIOD, &Asked::of([&assumed])).expect("a circuit");
    assert!(matches!(answer(&subject, "never y"), Answer::Holds(_)));
}

/// In which scans of a run the power returns.
fn restarts(subject: &Subject, trace: &Trace) -> Vec<bool> {
    let input = subject.circuit().inputs().len() - 1;
    trace.values(Signal::Input(input)).collect()
}

/// That an output is off after a restart is no way to switch it off.
#[test]
fn a_restart_switches_no_output() {
    let text = "program p\ninput a\noutput y = 0\noutput z = 0\nretain z\n\
                rung a (S y )\nrung a (S z )\n";
    let subject = Subject::new(&ladder(text), PERIOD, &Asked::default()).expect("a circuit");
    for (signal, finding) in subject.switches(Bounds::default()) {
        let OutputFinding::Stuck(Lamp::Off, trace) = finding else {
            panic!("{signal:?}: {finding:?}");
        };
        let inputs = subject.circuit().inputs().len();
        assert!(trace.signals.iter().all(|it| !matches!(it, Signal::Input(it) if *it >= inputs)));
    }
}

#[test]
fn numbers_of_a_mixed_state_are_found() {
    let text = "PROGRAM p VAR_INPUT a : BOOL; END_VAR VAR_OUTPUT y : BOOL; END_VAR
        VAR RETAIN n : INT (0..3); END_VAR VAR m : INT (0..3); END_VAR
        y := n > m; IF a AND n < 3 THEN n := n + 1; m := m + 1; END_IF; END_PROGRAM";
    let check = |text: &str| {
        let (file, _) = parse_text(text);
        let lowered = lower(&file, &Options { text, ..Options::default() });
        let program = lowered.program.expect("a program");
        let model = Model::of_program(&program, &Asked::default()).expect("followed");
        let formula = model.resolve(&property("never y")).expect("a name");
        let mut answers = model.check(&[formula], &[], Bounds::default(), &mut || {});
        (answers.remove(0), model.restarting().count())
    };
    let (kept, restarting) = check(text);
    assert_eq!(restarting, 1);
    assert!(matches!(kept, numbers::Answer::Fails(Some(_))), "{kept:?}");
    let (lost, restarting) = check(&text.replace("RETAIN", ""));
    assert_eq!(restarting, 0);
    assert!(matches!(lost, numbers::Answer::Holds(_)), "{lost:?}");
    // Both kept, or neither: no scan sees a difference.
    let (both, _) = check(&text.replace("END_VAR VAR m", "m"));
    assert!(matches!(both, numbers::Answer::Holds(_)), "{both:?}");
}

/// Each program of a cluster restarts by itself; a sample that a remote I/O keeps is not one of a program.
#[test]
fn programs_of_a_cluster_restart_one_by_one() {
    let text = "PROGRAM p VAR_INPUT a : BOOL; END_VAR VAR_OUTPUT y : BOOL; END_VAR
        VAR RETAIN kept : BOOL; END_VAR VAR lost : BOOL; END_VAR
        kept := kept OR a; lost := lost OR a; y := kept AND NOT lost; END_PROGRAM";
    let (file, _) = parse_text(text);
    let program = lower(&file, &Options { text, ..Options::default() }).program.expect("a program");
    let member = |name: &str| {
        let sources = vec![Source::Any(None)];
        Member { name: name.to_owned(), program: &program, sources }
    };
    let members = [member("one"), member("two")];
    let model = Model::of_cluster("cell", &members, &Asked::default()).expect("followed");
    let restarting: Vec<&str> = model.restarting().collect();
    assert_eq!(restarting, ["one.power.returns", "two.power.returns"]);
    for (text, holds) in
        [("never one.y", false), ("AG (one.y -> !two.y)", false), ("never one.y and !one.y", true)]
    {
        let formula = model.resolve(&property(text)).expect("names");
        let answer = model.check(&[formula], &[], Bounds::default(), &mut || {}).remove(0);
        match holds {
            true => assert!(matches!(answer, numbers::Answer::Holds(_)), "{text}: {answer:?}"),
            false => {
                assert!(matches!(answer, numbers::Answer::Fails(Some(_))), "{text}: {answer:?}")
            }
        }
    }
}

/// Outputs of all scans of all runs with warm starts: from every state that the circuit of the stations reaches, step by step. Nothing where there are
/// many.
fn reached(ladder: &Program, period: Duration) -> Option<BTreeSet<u64>> {
    let typed = ladder.typed(period).expect("a sound program");
    let exact = understudy_ladder::circuit(&typed).expect("a circuit");
    let mask = exact.layout.retentive_mask(&typed);
    let scan = Scan::new(&exact.circuit);
    let mut scratch = Scratch::default();
    let mut outputs = vec![0_u64; scan.output_count().div_ceil(64)];
    let mut seen = HashSet::from([scan.initial().to_vec()]);
    let mut waiting = vec![scan.initial().to_vec()];
    let mut found = BTreeSet::new();
    while let Some(state) = waiting.pop() {
        let restarted = scan.initial().iter().zip(&mask).zip(&state);
        let restarted = restarted.map(|((initial, mask), kept)| initial & !mask | kept & mask);
        for begins in [restarted.collect(), state.clone()] {
            for inputs in 0..1_u64 << scan.input_count() {
                let mut next: Vec<u64> = begins.clone();
                scan.step(&mut scratch, &mut next, &[inputs], &mut outputs);
                found.insert(outputs[0]);
                if seen.len() > 3_000 {
                    return None;
                }
                if seen.insert(next.clone()) {
                    waiting.push(next);
                }
            }
        }
    }
    Some(found)
}

#[test]
fn what_holds_in_every_scan_is_what_no_state_breaks() {
    let (mut compared, mut broken_by_restarts) = (0, 0);
    for seed in 0..200 {
        let ladder = random_program(seed, 4);
        let period = Duration::from_millis(400);
        let Some(wanted) = reached(&ladder, period) else { continue };
        let plain = Program { retained: Vec::new(), ..ladder.clone() };
        let without = reached(&plain, period);
        let subject = Subject::new(&ladder, period, &Asked::default()).expect("a circuit");
        let outputs = ladder.outputs.iter().enumerate();
        for (one, name) in outputs.clone() {
            for (other, without) in outputs.clone() {
                // An output that is on, or is on while another one is not.
                let text = match one == other {
                    true => format!("never {}", name.name),
                    false => format!("never {} and !{}", name.name, without.name),
                };
                let is_so =
                    |word: &u64| word >> one & 1 == 1 && (one == other || word >> other & 1 == 0);
                let answer = answer(&subject, &text);
                let holds = matches!(answer, Answer::Holds(_));
                let what = understudy_ladder::print(&ladder);
                assert!(holds || matches!(answer, Answer::Fails(Some(_))), "{answer:?}\n{what}");
                assert_eq!(holds, !wanted.iter().any(is_so), "{text}\n{what}");
                compared += 1;
            }
        }
        broken_by_restarts += usize::from(without.is_some_and(|without| without != wanted));
    }
    assert!(compared > 60 && broken_by_restarts > 0, "{compared}, {broken_by_restarts}");
}
