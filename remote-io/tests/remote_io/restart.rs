//! A remote I/O that has lost its history: from which state the program goes on.

use std::sync::Arc;

use understudy_cycle::{Input, Output, RemoteIoInput};
use understudy_remote_io::{Channel, Event, Layout, Release, RemoteIo, Settings};
use understudy_wire::{
    Body, Cycle, Digest, Epoch, Force, Holding, Image, Lineage, Moment, Recalled, SamplesReceived,
    SignalPlace, Source, StationId, StationSet,
};

use crate::bench::{
    Bench, PROGRAM, held_after, join, recalled_of, releasing, sample_of, settings, turn,
};

fn moment(cycle: u64) -> Moment {
    Moment { epoch: Epoch(1), cycle: Cycle(cycle) }
}

/// What a station says to hold: (lineage, the cycle of its last sample).
type Held = Option<(u64, u64)>;

/// The only program's controller and two understudies ask to join in each cycle, and say what they hold; the operator releases the
/// outputs after `released_at` cycles. Answers with what was reported, and every source of an output.
fn run(held: [Held; 3], release: Release, released_at: u64, cycles: u64) -> Vec<Event> {
    let mut bench = Bench::new(releasing(settings(2), release), 100);
    let mut said = Vec::new();
    for cycle in 0..cycles {
        bench.cycle = 100 + cycle;
        for (rank, held) in (0..).zip(held) {
            let holding = held.map(|(lineage, stepped)| Holding {
                program: PROGRAM,
                born: moment(0),
                lineage: Lineage(lineage),
                stepped: moment(stepped),
                digest: Digest(0),
                version: None,
            });
            let recalled = Recalled {
                program: PROGRAM,
                sampled: moment(50),
                received: SamplesReceived::Later,
                applied: None,
                excluded: StationSet::EMPTY,
                accounted_for: StationSet::EMPTY,
                writes: Default::default(),
                pulses: Default::default(),
                inputs: Image::zero(2),
                version: None,
            };
            said.extend(bench.receive(bench.start(), rank, false, join(holding, Some(recalled))));
        }
        if cycle == released_at {
            said.extend(bench.give(bench.start(), Input::RemoteIo(RemoteIoInput::Release)));
        }
        said.extend(bench.decide());
    }
    let reported = said.into_iter().filter_map(|output| match output {
        Output::Report(event) => Some(event),
        _ => None,
    });
    reported.collect()
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

/// Where no output of the program was applied since it started cold, the operator has not released it, and a restart of the remote I/O does not either.
#[test]
fn a_restart_releases_no_outputs() {
    for release in [Release::Automatic, Release::Operator] {
        let events = run([Some((9, 60)); 3], release, 20, 40);
        assert!(matches!(chosen(&events), Some((9, Some(_)))), "{events:?}");
        let released = events.iter().any(|event| matches!(event, Event::Released { .. }));
        assert_eq!(released, release == Release::Operator);
    }
}

/// A failed channel keeps the last good value, and not one that was forced: the force ends with the process.
#[test]
fn a_failed_channel_keeps_no_forced_value_over_a_restart() {
    for (good, forces) in [(true, 0), (true, 1), (true, 2), (false, 1), (false, 2)] {
        let channels = vec![Channel { input: 0, status: 1 }];
        let layout = Arc::new(Layout { channels, ..Layout::booleans(2, 1) });
        let settings = Settings { layout, ..settings(1) };
        let mut bench = Bench::new(settings.clone(), 100);
        let mut last: Option<(Holding, Recalled, Image)> = None;
        for cycle in 100..140 {
            bench.cycle = cycle;
            if cycle == 130 {
                bench.remote_io = RemoteIo::new(bench.start(), settings.clone());
            }
            let is_failed = cycle > 115;
            let shown = Image::from_bits([good && !is_failed, is_failed]);
            bench.give(bench.start(), Input::RemoteIo(RemoteIoInput::Field(&shown)));
            let said = bench.receive(bench.start(), 0, false, Body::Sync);
            if let Some(sample) = sample_of(&said) {
                let moment = bench.moment();
                let inputs = sample.history.last().expect("its inputs").inputs.clone();
                last = Some((held_after(sample, moment), recalled_of(sample, moment), inputs));
            }
            for rank in [0, 1] {
                let body = match (&last, sample_of(&said)) {
                    (Some((held, ..)), Some(_)) => turn(*held),
                    (Some((held, recalled, _)), None) => join(Some(*held), Some(recalled.clone())),
                    (None, _) => join(None, None),
                };
                bench.receive(bench.start(), rank, false, body);
            }
            bench.decide();
            for place in (0..forces).filter(|_| cycle == 120) {
                let force = Force {
                    signal: SignalPlace::Input(place),
                    value: (place == 0 && !good).into(),
                    seconds: 60,
                    owner: "anna".to_owned(),
                    reason: "a test".to_owned(),
                    points: None,
                };
                bench.tell(RemoteIoInput::Force(&force));
            }
        }
        let (.., inputs) = last.expect("the program runs");
        assert_eq!(inputs, Image::from_bits([good, true]), "{forces} forces");
    }
}
