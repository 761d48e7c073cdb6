//! Random faults over all members and links: whatever happens, nothing wrong is driven, nobody is accused of a value fault that
//! there was not, and protection comes back.

mod press_cell;

use std::time::Duration;

use proptest::prelude::*;
use understudy_cycle::Mode;
use understudy_remote_io::Event;
use understudy_simulator::{Action, Disturbance, Fault, Network, Record, Simulation};
use understudy_wire::{Member, ProgramId, StationId};

/// Something is done to a member, and undone later where it lasts.
#[derive(Debug, Clone)]
struct Trouble {
    member: Member,
    begins: Action,
    ends: Option<Action>,
    at_cycle: u64,
    phase: f64,
    cycles: u64,
}

fn member() -> impl Strategy<Value = Member> {
    prop_oneof![
        4 => (0..4_u8).prop_map(|rank| Member::Station(StationId(rank))),
        1 => (0..2_u8).prop_map(|program| Member::RemoteIo(ProgramId(program))),
        1 => (0..2_u8).prop_map(|program| Member::Twin(ProgramId(program))),
    ]
}

fn late() -> impl Strategy<Value = Duration> {
    prop_oneof![100..9_000_u64, 9_000..40_000_u64].prop_map(Duration::from_micros)
}

/// What is done, and what undoes it.
fn action() -> impl Strategy<Value = (Action, Option<Action>)> {
    let on_time = Duration::ZERO;
    let lasting = |begins, ends| (begins, Some(ends));
    prop_oneof![
        4 => Just(lasting(Action::Crash, Action::Restart)),
        4 => Just(lasting(Action::Stop, Action::Continue)),
        1 => Just(lasting(Action::RestartMisconfigured, Action::Restart)),
        4 => member().prop_map(move |to| lasting(Action::Cut { to }, Action::Heal { to })),
        2 => (member(), late()).prop_map(move |(to, by)| {
            lasting(Action::Delay { to, by }, Action::Delay { to, by: on_time })
        }),
        1 => late().prop_map(move |by| lasting(Action::Slow { by }, Action::Slow { by: on_time })),
        1 => (1..20_u16).prop_map(|frames| (Action::Corrupt { frames }, None)),
        2 => prop_oneof![1..8_u16, 8..500_u16].prop_map(|age| (Action::Replay { age }, None)),
        1 => Just((Action::Forge, None)),
        2 => (0..20_u64).prop_map(move |epoch| {
            lasting(Action::Crash, Action::RestartInEpoch { epoch })
        }),
        1 => (0..10_u16, 1..20_u16).prop_map(|(bit, frames)| (Action::FlipSample { bit, frames }, None)),
    ]
}

/// One of the two remote I/Os of the first program.
fn one_of_two() -> impl Strategy<Value = Member> {
    prop_oneof![Just(Member::RemoteIo(ProgramId(0))), Just(Member::Twin(ProgramId(0)))]
}

fn trouble(member: impl Strategy<Value = Member>) -> impl Strategy<Value = Trouble> {
    let cycles = prop_oneof![4 => 0..3_u64, 4 => 3..40_u64, 1 => 40..500_u64];
    (member, action(), 0..150_u64, 0.0..1.0_f64, cycles).prop_map(
        |(member, (begins, ends), at_cycle, phase, cycles)| Trouble {
            member,
            begins,
            ends,
            at_cycle,
            phase,
            cycles,
        },
    )
}

fn network() -> impl Strategy<Value = Network> {
    let share = prop_oneof![2 => Just(0.0), 1 => 0.0..0.2_f64];
    let jitter = prop_oneof![3 => 0..3_000_u64, 1 => 3_000..30_000_u64];
    (share.clone(), share, jitter).prop_map(|(loss, duplicate, jitter)| Network {
        loss,
        duplicate,
        jitter: Duration::from_micros(jitter),
        ..Network::default()
    })
}

/// Whether somebody is accused of a value fault.
fn accuses(record: &Record<'_>) -> bool {
    match record {
        Record::Station(event) => matches!(
            event,
            understudy_node::Event::DigestDiffers { .. } | understudy_node::Event::Excluded { .. }
        ),
        Record::RemoteIo(event) => matches!(
            event,
            Event::ValueFault { .. } | Event::Syndrome { .. } | Event::DigestDiffers { .. }
        ),
        _ => false,
    }
}

fn check(
    (mode, understudies, twins): (Mode, usize, Option<u32>),
    troubles: &[Trouble],
    network: Network,
    seed: u64,
) {
    let quiet = Network { latency: network.latency, ..Network::default() };
    let ends = troubles.iter().map(|it| it.at_cycle + it.cycles + 50);
    let cycles = ends.fold(200, u64::max);
    let mut parts = press_cell::parts(mode, understudies);
    if let Some(take_over_after) = twins {
        press_cell::pair(&mut parts, take_over_after);
    }
    let mut simulation = Simulation::new(parts, quiet, seed);
    simulation.disturb(Disturbance { network, cycles: Some(0..200) });
    for trouble in troubles {
        let mut schedule = |at_cycle, action| {
            simulation.schedule(Fault {
                at_cycle,
                phase: trouble.phase,
                member: trouble.member,
                action,
            });
        };
        schedule(trouble.at_cycle, trouble.begins);
        if let Some(ends) = trouble.ends {
            schedule(trouble.at_cycle + trouble.cycles, ends);
        }
    }
    let mut accusations = 0;
    let mut observe = |_, _, _, record: Record<'_>| accusations += u64::from(accuses(&record));
    simulation.run(cycles, 2000, &mut observe).expect("the cluster gets ready");
    assert_eq!(simulation.violations().first(), None);
    // All are back by now: all are synchronised again without help, unless an operator is asked.
    if let Err(error) = simulation.run(10, 200, &mut observe) {
        assert!(!simulation.asking().is_empty(), "protection comes back: {error}");
        simulation.let_operator_choose();
        simulation
            .run(10, 200, &mut observe)
            .expect("protection comes back after the operator's choice");
    }
    assert_eq!(simulation.violations().first(), None);
    assert_eq!(accusations, 0);
}

/// A longer campaign is asked for with `PROPTEST_CASES`.
fn cases() -> u32 {
    let asked = std::env::var("PROPTEST_CASES").ok();
    asked.and_then(|cases| cases.parse().ok()).unwrap_or(500)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn nothing_wrong_is_driven(
        troubles in prop::collection::vec(trouble(member()), 0..8),
        network in network(),
        understudies in 0..3_usize,
        paper in any::<bool>(),
        twins in prop::option::of(1..4_u32),
        seed in any::<u64>(),
    ) {
        let mode = if paper { Mode::Paper } else { Mode::Full };
        check((mode, understudies, twins), &troubles, network, seed);
    }

    #[test]
    fn nothing_wrong_is_driven_by_two_remote_ios(
        troubles in prop::collection::vec(trouble(one_of_two()), 1..4),
        network in network(),
        take_over_after in 1..4_u32,
        seed in any::<u64>(),
    ) {
        check((Mode::Full, 1, Some(take_over_after)), &troubles, network, seed);
    }
}

/// On a network that delays frames by up to two cycles, every turn of the one station that holds the state comes too late, while an understudy
/// without a state is received.
#[test]
fn a_state_whose_station_is_late_is_not_lost() {
    let crash = |rank, ends, at_cycle, phase, cycles| Trouble {
        member: Member::Station(StationId(rank)),
        begins: Action::Crash,
        ends: Some(ends),
        at_cycle,
        phase,
        cycles,
    };
    let troubles = [
        crash(2, Action::Restart, 42, 0.6932735763821679, 12),
        crash(3, Action::RestartInEpoch { epoch: 0 }, 31, 0.0, 70),
        Trouble {
            member: Member::Station(StationId(0)),
            begins: Action::Replay { age: 1 },
            ends: None,
            at_cycle: 52,
            phase: 0.36283512961119024,
            cycles: 0,
        },
    ];
    let network = Network {
        jitter: Duration::from_micros(22_099),
        loss: 0.14757381049998938,
        duplicate: 0.1218262537843947,
        ..Network::default()
    };
    check((Mode::Full, 2, None), &troubles, network, 7891165348679592666);
}

/// The author receives everything more than two cycles late, and then on time again: the cycles that it skips are those in which the stations have
/// followed the other one.
#[test]
fn an_author_that_was_late_does_not_go_back() {
    let troubles = [Trouble {
        member: Member::RemoteIo(ProgramId(0)),
        begins: Action::Slow { by: Duration::from_micros(21_572) },
        ends: Some(Action::Slow { by: Duration::ZERO }),
        at_cycle: 100,
        phase: 0.0,
        cycles: 6,
    }];
    let network = Network {
        latency: Duration::from_micros(100),
        jitter: Duration::from_micros(583),
        ..Network::default()
    };
    check((Mode::Paper, 2, Some(2)), &troubles, network, 8423444371132508279);
}
