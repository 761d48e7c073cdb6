//! A remote I/O that has lost its history: from which state the program goes on.

use std::sync::Arc;
use std::time::Duration;

use understudy_cycle::{Agreement, Input, Machine, Mode, Output, RemoteIoInput, Schedule};
use understudy_remote_io::{
    Event, PointPlace, Release, RemoteIo, Settings, StaleState, ValueFault,
};
use understudy_wire::{
    Body, ClusterHash, ConfigurationHash, Cycle, Digest, Epoch, Frame, Header, Holding, Image,
    Join, Lineage, Member, Moment, ProgramHash, ProgramId, ProgramSet, Recalled, SamplesReceived,
    Source, StationId, StationSet, Time,
};

const PERIOD: Duration = Duration::from_millis(10);
const LISTEN_CYCLES: u64 = 2;

fn moment(cycle: u64) -> Moment {
    Moment { epoch: Epoch(1), cycle: Cycle(cycle) }
}

/// What a station says to hold: (lineage, the cycle of its last sample).
type Held = Option<(u64, u64)>;

/// The only program's controller and two understudies ask to join in each cycle, and say what they hold; the operator releases the
/// outputs after `released_at` cycles. Answers with what was reported, and every source of an output.
fn run(held: [Held; 3], release: Release, released_at: u64, cycles: u64) -> Vec<Event> {
    let agreement = Arc::new(Agreement {
        cluster: ClusterHash(1),
        configuration: ConfigurationHash(2),
        schedule: Schedule::new(PERIOD, 1, 2, 1).expect("within bounds"),
        mode: Mode::Full,
        history: 4,
        flag_after: 3,
        shadow_cycles: 1,
        listen_cycles: LISTEN_CYCLES as u32,
    });
    let mut remote_io = RemoteIo::new(
        Time(0),
        Settings {
            program: ProgramId(0),
            agreement,
            hash: ProgramHash(1),
            undriven: Image::zero(1),
            input_points: PointPlace::booleans(1),
            output_points: PointPlace::booleans(1),
            operator_inputs: Vec::new(),
            signals: Vec::new(),
            signal_sources: Vec::new(),
            channels: Vec::new(),
            stop: None,
            diagnosis: None,
            hold_cycles: 3,
            fail_safe: Image::zero(1),
            ramps: Vec::new(),
            release,
            value_fault: ValueFault::Hold,
            stale_state: StaleState::Operator,
        },
    );
    let mut events = Vec::new();
    for cycle in 0..cycles {
        let start = Time(cycle * PERIOD.as_nanos() as u64);
        for (rank, held) in (0..).zip(held) {
            let holdings = held.map(|(lineage, stepped)| Holding {
                program: ProgramId(0),
                born: moment(0),
                lineage: Lineage(lineage),
                stepped: moment(stepped),
                digest: Digest(0),
            });
            let frame = Arc::new(Frame {
                header: Header {
                    cluster: ClusterHash(1),
                    configuration: ConfigurationHash(2),
                    moment: moment(100 + cycle),
                    sender: Member::Station(StationId(rank)),
                    alone: false,
                },
                body: Body::Join(Join {
                    wants: ProgramSet::EMPTY,
                    holdings: holdings.into_iter().collect(),
                    recalled: vec![Recalled {
                        program: ProgramId(0),
                        sampled: moment(50),
                        received: SamplesReceived::Later,
                        applied: None,
                        excluded: StationSet::EMPTY,
                        accounted_for: StationSet::EMPTY,
                        writes: Default::default(),
                        pulses: Default::default(),
                        inputs: Image::zero(1),
                    }],
                    lacks: ProgramSet::EMPTY,
                    partial: Vec::new(),
                }),
            });
            remote_io.handle_input(start, Input::Frame(&frame));
        }
        if cycle == released_at {
            remote_io.handle_input(start, Input::RemoteIo(RemoteIoInput::Release));
        }
        remote_io.handle_input(start + PERIOD * 65 / 100, Input::Wakeup);
        while let Some(output) = remote_io.poll_output() {
            if let Output::Report(event) = output {
                events.push(event);
            }
        }
    }
    events
}

/// The state that it goes on from: a lineage and its holder, the initial state, or none yet.
fn chosen(events: &[Event]) -> Option<(u64, Option<u8>)> {
    events.iter().find_map(|event| match event {
        Event::AdoptedLineage { lineage, from, .. } => Some((lineage.0, Some(from.0))),
        Event::StartedCold { .. } => Some((0, None)),
        _ => None,
    })
}

const NEVER: u64 = u64::MAX;

#[test]
fn the_state_that_was_stepped_last_is_the_one() {
    for held in [[(7, 50), (8, 49), (9, 48)], [(8, 49), (7, 50), (7, 50)], [(9, 1), (8, 2), (7, 3)]]
    {
        let newest = held.iter().position(|&(lineage, _)| lineage == 7);
        let events = run(held.map(Some), Release::Automatic, NEVER, 6);
        assert_eq!(chosen(&events), Some((7, newest.map(|rank| rank as u8))));
    }
}

#[test]
fn the_operator_decides_between_different_states_of_one_cycle() {
    let held = [Some((7, 50)), Some((8, 50)), Some((9, 48))];
    let asked = run(held, Release::Automatic, NEVER, 40);
    assert_eq!(chosen(&asked), None);
    let disputes: Vec<&Event> =
        asked.iter().filter(|event| matches!(event, Event::Disputed { .. })).collect();
    let [Event::Disputed { stations, .. }] = disputes[..] else {
        panic!("{disputes:?}");
    };
    let holders: StationSet = [StationId(0), StationId(1)].into_iter().collect();
    assert_eq!(*stations, holders);
    for event in &asked {
        if let Event::Applied { source, .. } = event {
            assert_eq!(*source, Source::FailSafe);
        }
    }
    let decided = run(held, Release::Automatic, 20, 40);
    assert_eq!(chosen(&decided), Some((7, Some(0))));
}

#[test]
fn where_nobody_holds_a_state_the_program_starts_cold_and_the_operator_releases_it() {
    for release in [Release::Automatic, Release::Operator] {
        let events = run([None; 3], release, 20, 40);
        assert_eq!(chosen(&events), Some((0, None)));
        let waits = events.iter().any(
            |event| matches!(event, Event::StartedCold { awaits_release, .. } if *awaits_release),
        );
        assert_eq!(waits, release == Release::Operator);
        let released = events.iter().any(|event| matches!(event, Event::Released { .. }));
        assert_eq!(released, release == Release::Operator);
    }
}
