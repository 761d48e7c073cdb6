//! Minimising against causes that are known: what is left is the cause, and nothing else.

use understudy_simulator::Network;
use understudy_wire::{ProgramId, StationId};

use super::*;
use crate::injection::kind::Kind;

const CYCLES: u64 = 200;

fn outage(rank: u8, at: u64, cycles: u64) -> Injection {
    let step = |at_cycle, action| Fault {
        at_cycle,
        phase: 0.375,
        member: Member::Station(StationId(rank)),
        action,
    };
    Injection {
        kind: Kind::Crash,
        role: Role::Controller,
        steps: vec![step(at, Action::Crash), step(at + cycles, Action::Restart)],
    }
}

fn schedule() -> Schedule {
    Schedule::new(Duration::from_millis(10), 6, 2, 2).expect("within bounds")
}

/// Minimises against `cause`, which is asked whether a faultload still violates; counts the trials.
fn check(faultload: Faultload, cause: &dyn Fn(&Faultload) -> bool) -> (Violating, u32) {
    check_judged(faultload, false, cause)
}

fn check_judged(
    faultload: Faultload,
    judges_at_end: bool,
    cause: &dyn Fn(&Faultload) -> bool,
) -> (Violating, u32) {
    let symptom = Symptom { cycle: CYCLES - 1, member: None, what: String::new() };
    let mut trials = 0;
    let found = Violating { faultload, cycles: CYCLES, seed: 1, symptom: symptom.clone() };
    let small = minimise(found, &schedule(), judges_at_end, &mut |faultload, _, _| {
        trials += 1;
        cause(faultload).then(|| symptom.clone())
    });
    assert!(cause(&small.faultload), "what is kept violates");
    (small, trials)
}

/// Of a property that is judged at the end of the run, a fault that lasts is no counterexample: each one that is left is over by then.
#[test]
fn faults_keep_their_ends_where_the_end_of_the_run_is_judged() {
    let step = |at_cycle, rank, action| Fault {
        at_cycle,
        phase: 0.5,
        member: Member::Station(StationId(rank)),
        action,
    };
    let injection = |kind, steps| Injection { kind, role: Role::Controller, steps };
    let to = Member::RemoteIo(ProgramId(0));
    let by = Duration::from_millis(8);
    let storm = [60, 70, 80, 90].map(|at| outage(1, at, 5).steps).concat();
    let injections = vec![
        outage(0, 60, 40),
        injection(Kind::Crash, storm),
        injection(Kind::Stop, vec![step(60, 2, Action::Stop), step(65, 2, Action::Continue)]),
        injection(
            Kind::OneWayCut,
            vec![step(60, 3, Action::Cut { to }), step(75, 3, Action::Heal { to })],
        ),
        injection(
            Kind::Slow,
            vec![
                step(60, 4, Action::Slow { by }),
                step(75, 4, Action::Slow { by: Duration::ZERO }),
            ],
        ),
    ];
    for culprit in 0..injections.len() {
        let member = injections[culprit].steps[0].member;
        let strikes =
            |faultload: &Faultload| faultload.steps().iter().any(|step| step.member == member);
        let faultload = Faultload { injections: injections.clone(), network: None };
        let (small, _) = check_judged(faultload, true, &strikes);
        assert_eq!(small.faultload.injections.len(), 1, "{culprit}");
        let steps = small.faultload.steps();
        assert_eq!(steps.len(), 2, "{culprit}: a fault and its end of {steps:?}");
        let end = injections[culprit].steps.last().expect("an end").action;
        assert_eq!(steps.last().map(|step| step.action), Some(end), "{culprit}");
    }
}

/// Every set of culprits among six outages is found, whatever it is.
#[test]
fn exactly_the_culprits_are_left() {
    let all: Vec<Injection> = (0..6).map(|rank| outage(rank, 60, 10)).collect();
    for culprits in 1..64_u32 {
        let is_culprit = |step: &Fault| match step.member {
            Member::Station(station) => culprits >> station.0 & 1 == 1,
            _ => false,
        };
        let crashed = |faultload: &Faultload| {
            let steps = faultload.steps();
            let crashes = steps.iter().filter(|step| step.action == Action::Crash);
            let mut ranks: Vec<Member> =
                crashes.filter(|step| is_culprit(step)).map(|step| step.member).collect();
            ranks.dedup();
            ranks.len() == culprits.count_ones() as usize
        };
        let faultload = Faultload { injections: all.clone(), network: None };
        let (small, trials) = check(faultload, &crashed);
        let left = small.faultload.injections.len();
        assert_eq!(left, culprits.count_ones() as usize, "{culprits:b}");
        assert!(small.faultload.injections.iter().all(|injection| injection.steps.len() == 1));
        assert!(trials <= MAXIMUM_TRIALS);
    }
}

/// Numbers go down to the least that still violates, and no further.
#[test]
fn numbers_become_small() {
    let lasts = |faultload: &Faultload| {
        let outages = faultload.injections.iter().map(Injection::cycles);
        outages.into_iter().any(|cycles| cycles.end - cycles.start >= 4)
    };
    let faultload = Faultload {
        injections: vec![outage(4, 90, 30), outage(2, 50, 3)],
        network: Some(Disturbance {
            network: Network { loss: 0.137, ..Network::default() },
            cycles: Some(40..80),
        }),
    };
    let (small, _) = check(faultload, &lasts);
    assert_eq!(small.faultload.network, None);
    let steps = small.faultload.steps();
    let times: Vec<(u64, f64)> = steps.iter().map(|step| (step.at_cycle, step.phase)).collect();
    assert_eq!(times, [(FIRST_CYCLE, 0.0), (FIRST_CYCLE + 3, 0.0)]);
    assert!(steps.iter().all(|step| step.member == Member::Station(StationId(0))));
}

/// A network that has to be there stays, with round numbers, for as short as it may be.
#[test]
fn a_network_becomes_simple() {
    let lossy = |faultload: &Faultload| {
        let network = faultload.network.as_ref();
        network.is_some_and(|disturbance| {
            let cycles = disturbance.cycles.clone().unwrap_or_default();
            disturbance.network.loss > 0.1 && cycles.contains(&70)
        })
    };
    let faultload = Faultload {
        injections: vec![outage(0, 60, 10)],
        network: Some(Disturbance {
            network: Network {
                loss: 0.137,
                duplicate: 0.02,
                jitter: Duration::from_micros(1234),
                ..Network::default()
            },
            cycles: Some(40..80),
        }),
    };
    let (small, _) = check(faultload, &lossy);
    assert_eq!(small.faultload.injections, []);
    let expected =
        Disturbance { network: Network { loss: 0.15, ..Network::default() }, cycles: Some(70..71) };
    assert_eq!(small.faultload.network, Some(expected));
}

/// Cuts between later members become cuts between earlier ones of the same roles.
#[test]
fn members_become_simple() {
    let cut = |from: Member, to: Member| Injection {
        kind: Kind::OneWayCut,
        role: Role::Controller,
        steps: vec![Fault {
            at_cycle: FIRST_CYCLE,
            phase: 0.0,
            member: from,
            action: Action::Cut { to },
        }],
    };
    let (late, first) = (StationId(5), StationId(0));
    let faultload = Faultload {
        injections: vec![cut(Member::Station(late), Member::RemoteIo(ProgramId(4)))],
        network: None,
    };
    let (small, _) = check(faultload, &|faultload| !faultload.injections.is_empty());
    let expected = cut(Member::Station(first), Member::RemoteIo(ProgramId(0)));
    assert_eq!(small.faultload.injections, [expected]);
}
