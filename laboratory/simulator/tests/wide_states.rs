//! States of several segments: a station that lacks one takes it over as a snapshot and a log, whatever is lost and whoever is killed.

use proptest::prelude::*;
use understudy_cluster::read;
use understudy_node::Event;
use understudy_simulator::{Action, Fault, Network, Parts, Record, Simulation, parts};
use understudy_wire::{Member, StationId};

const CLUSTER: &str = r#"
[cluster]
name = "wide"

[[controller]]
name = "recorder"
ladder = "recorder.st"

[[controller]]
name = "counter"
ladder = "counter.st"

[[understudy]]
name = "first"

[[understudy]]
name = "second"

[[remote_io]]
controller = "recorder"

[[remote_io]]
controller = "counter"
"#;

/// Writes each value of a counter to a ring, and reads what it wrote a turn of the ring before.
fn recorder(kibibytes: usize) -> String {
    let last = kibibytes * 1024 / 8 - 8;
    format!(
        "
PROGRAM recorder
  VAR_INPUT hold : BOOL; END_VAR
  VAR_OUTPUT oldest : DINT; sum : LINT; END_VAR
  VAR ring : ARRAY [0..{last}] OF LINT; place : DINT; count : LINT; END_VAR
  IF NOT hold THEN
    count := count + 1;
    oldest := LINT_TO_DINT(ring[place]);
    sum := sum + ring[(place * 7919) MOD {last}];
    ring[place] := count;
    place := (place + 1) MOD {last};
  END_IF;
END_PROGRAM"
    )
}

const COUNTER: &str = "
PROGRAM counter
  VAR_INPUT hold : BOOL; END_VAR
  VAR_OUTPUT count : DINT; END_VAR
  IF NOT hold THEN count := count + 1; END_IF;
END_PROGRAM";

fn cluster(kibibytes: usize) -> Parts {
    let loaded = read("cluster.toml", CLUSTER, &mut |name| match name {
        "recorder.st" => Ok(recorder(kibibytes)),
        _ => Ok(COUNTER.to_owned()),
    });
    let cluster = loaded.cluster.unwrap_or_else(|| panic!("{:?}", loaded.reports));
    parts(&cluster)
}

fn station(rank: u8) -> Member {
    Member::Station(StationId(rank))
}

fn fault(at_cycle: u64, member: Member, action: Action) -> Fault {
    Fault { at_cycle, phase: 0.3, member, action }
}

const STATIONS: u64 = 4;

/// The simulation after `cycles`, with the cycles in which stations were synchronised with a state that they took over.
fn run(
    kibibytes: usize,
    loss: f64,
    faults: &[Fault],
    cycles: u64,
    seed: u64,
) -> (Simulation, Vec<(Member, u64)>) {
    let network = Network { loss, ..Network::default() };
    let mut simulation = Simulation::new(cluster(kibibytes), network, seed);
    for fault in faults {
        simulation.schedule(*fault);
    }
    let mut synchronised = Vec::new();
    let mut observe = |_, cycle: Option<u64>, member, record: Record<'_>| {
        if let (Some(cycle), Record::Station(Event::Synchronised { .. })) = (cycle, record) {
            synchronised.push((member, cycle));
        }
    };
    simulation.run(cycles, 1000, &mut observe).expect("the cluster gets ready");
    assert_eq!(simulation.violations(), []);
    (simulation, synchronised)
}

/// 64 KiB at 10 % loss within 100 cycles.
#[test]
fn a_station_joins_within_a_hundred_cycles() {
    for rank in [0, 2] {
        for seed in 0..5 {
            let faults = [
                fault(50, station(rank), Action::Crash),
                fault(100, station(rank), Action::Restart),
            ];
            let (_, synchronised) = run(64, 0.1, &faults, 250, seed);
            let mut after = synchronised.iter();
            let joined = after.rfind(|(member, cycle)| *member == station(rank) && *cycle >= 100);
            let (_, cycle) = *joined.expect("it joins");
            assert!(cycle < 200, "{rank}: synchronised in cycle {cycle}");
        }
    }
}

/// Nearly the widest state there may be.
#[test]
fn a_state_of_255_kibibytes_is_taken_over() {
    let faults = [
        fault(50, station(2), Action::Crash),
        fault(60, station(2), Action::Restart),
        fault(250, station(0), Action::Crash),
        fault(300, station(0), Action::Restart),
    ];
    let (simulation, _) = run(255, 0.0, &faults, 450, 1);
    assert!(simulation.synchronised());
    for tally in simulation.tallies() {
        assert_eq!((tally.held, tally.fail_safe), (0, 0), "{tally:?}");
    }
}

/// The giver is killed in the middle: another one gives its own snapshot.
#[test]
fn another_station_goes_on_where_the_giver_is_killed() {
    for at in 103..110 {
        let faults = [
            fault(90, station(3), Action::Crash),
            fault(100, station(3), Action::Restart),
            fault(at, station(0), Action::Crash),
            fault(300, station(0), Action::Restart),
        ];
        let (simulation, _) = run(64, 0.0, &faults, 450, 1);
        assert!(simulation.synchronised(), "killed in cycle {at}");
        for tally in simulation.tallies() {
            assert_eq!((tally.held, tally.fail_safe), (0, 0), "{at}: {tally:?}");
        }
    }
}

/// A controller takes its state over while its remote I/O is down, and is accounted for as soon as it has it: the remote I/O asks nothing when it
/// is back.
#[test]
fn a_station_that_took_a_state_over_is_accounted_for_at_once() {
    let remote_io = Member::RemoteIo(understudy_wire::ProgramId(0));
    for back in 205..220 {
        let faults = [
            fault(143, station(0), Action::Crash),
            fault(154, station(1), Action::Crash),
            fault(194, remote_io, Action::Crash),
            fault(196, station(0), Action::Restart),
            fault(199, station(1), Action::Restart),
            fault(back, remote_io, Action::Restart),
        ];
        let (simulation, _) = run(64, 0.0, &faults, 300, 0);
        assert!(simulation.synchronised(), "the remote I/O is back in cycle {back}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(24) })]

    /// Members are killed and restarted at random while frames are lost: nothing wrong is driven, and in the end all are synchronised.
    #[test]
    fn states_are_taken_over_whatever_fails(
        kills in prop::collection::vec((0..STATIONS + 2, 20..300_u64, 1..60_u64), 1..8),
        loss in prop_oneof![Just(0.0), 0.0..0.2_f64],
        seed: u64,
    ) {
        let faults: Vec<Fault> = kills
            .into_iter()
            .flat_map(|(place, at, down)| {
                let member = match place.checked_sub(STATIONS) {
                    None => station(place as u8),
                    Some(program) => Member::RemoteIo(understudy_wire::ProgramId(program as u8)),
                };
                [fault(at, member, Action::Crash), fault(at + down, member, Action::Restart)]
            })
            .collect();
        let (mut simulation, _) = run(64, loss, &faults, 360, seed);
        let mut synchronised = false;
        for cycle in (400..1200).step_by(20) {
            simulation.let_operator_choose();
            simulation.go_on(cycle, &mut |_, _, _, _| {}, &mut || false);
            synchronised = simulation.synchronised();
            if synchronised {
                break;
            }
        }
        prop_assert_eq!(simulation.violations(), []);
        prop_assert!(synchronised);
    }
}
