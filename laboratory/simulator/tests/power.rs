//! The power fails: what members have kept on their disks, and what the plant sees of it.

use proptest::prelude::*;
use understudy_cluster::read;
use understudy_cycle::RemoteIoInput;
use understudy_remote_io::{AskReason, Event};
use understudy_simulator::{Action, Fault, Network, Record, Simulation, parts};
use understudy_testing::COUNTER;
use understudy_wire::{Image, Member, Moment, ProgramId, Source, StateChoice, StationId};

const CONTROLLER: Member = Member::Station(StationId(0));
const UNDERSTUDY: Member = Member::Station(StationId(1));
const REMOTE_IO: Member = Member::RemoteIo(ProgramId(0));
const ALL: [Member; 3] = [CONTROLLER, UNDERSTUDY, REMOTE_IO];

fn simulation(remote_io: &str, seed: u64) -> Simulation {
    let text = format!(
        "[cluster]\nname = \"power\"\n\n[[controller]]\nname = \"counter\"\nladder = \"counter.st\"\n\n\
         [[understudy]]\nname = \"understudy\"\n\n[[remote_io]]\ncontroller = \"counter\"\n{remote_io}"
    );
    let loaded = read("cluster.toml", &text, &mut |_| Ok(COUNTER.to_owned()));
    let cluster = loaded.cluster.unwrap_or_else(|| panic!("{:?}", loaded.reports));
    assert!(cluster.is_retentive());
    Simulation::new(parts(&cluster), Network::default(), seed)
}

fn fault((cycle, phase): (u64, f64), member: Member, action: Action) -> Fault {
    Fault { at_cycle: cycle, phase, member, action }
}

/// Both counters of an image of outputs.
fn counters(outputs: &Image) -> (u32, u32) {
    let number =
        |first: usize| (0..32).fold(0, |sum, bit| sum | u32::from(outputs.get(first + bit)) << bit);
    (number(0), number(32))
}

/// What the remote I/O reports.
#[derive(Debug, Default)]
struct Seen {
    /// Counters that were applied, with their cycles.
    applied: Vec<(u32, u32)>,
    cold: Vec<Option<Moment>>,
    /// Cycles lost by each warm start.
    warm: Vec<Option<u64>>,
    /// States that the operator was offered, with the stations that have them.
    offered: Vec<(Option<StationId>, Moment)>,
    /// States that the warm starts were from.
    from: Vec<Moment>,
    refused: u32,
    reasons: Vec<AskReason>,
    asked: u32,
    held: u32,
}

impl Seen {
    fn note(&mut self, record: &Record<'_>) {
        let Record::RemoteIo(event) = record else {
            return;
        };
        match event {
            Event::Applied { outputs, source: Source::Direct | Source::Reconstructed, .. } => {
                self.applied.push(counters(outputs));
            }
            Event::Applied { source: Source::Held, .. } => self.held += 1,
            Event::StartedCold { lost, .. } => self.cold.push(*lost),
            Event::StartedWarm { lost, retained, .. } => {
                self.warm.push(*lost);
                self.from.push(*retained);
            }
            Event::StateLost { asks: true, newest, holder, reason, .. } => {
                self.reasons.push(*reason);
                self.asked += 1;
                self.offered.extend(newest.map(|newest| (*holder, newest)));
            }
            Event::ChoiceRefused { .. } => self.refused += 1,
            _ => {}
        }
    }

    /// Whether a counter that the plant sees goes back.
    fn goes_back(&self) -> bool {
        self.applied.is_sorted_by_key(|(total, _)| *total).eq(&false)
    }
}

/// Runs for so many cycles after the cluster is ready, or for as long as it takes.
fn run(simulation: &mut Simulation, cycles: u64) -> Seen {
    let mut seen = Seen::default();
    // It may wait for a person.
    let _ = simulation.run(cycles, 400, &mut |_, _, member, record| {
        if member == REMOTE_IO {
            seen.note(&record);
        }
    });
    seen
}

fn fail_and_return(simulation: &mut Simulation, members: &[Member], at: u64, down: u64) {
    for member in members {
        simulation.schedule(fault((at, 0.9), *member, Action::Crash));
        simulation.schedule(fault((at + down, 0.1), *member, Action::Restart));
    }
}

#[test]
fn a_program_goes_on_with_its_retentive_values_and_with_nothing_else() {
    let mut simulation = simulation("", 1);
    fail_and_return(&mut simulation, &ALL, 100, 50);
    let seen = run(&mut simulation, 400);
    assert_eq!(simulation.violations(), []);
    assert_eq!((seen.cold.as_slice(), seen.warm.as_slice()), (&[None][..], &[Some(0)][..]));
    assert_eq!(seen.asked, 0);
    assert!(!seen.goes_back());
    let totals: Vec<u32> = seen.applied.iter().map(|(total, _)| *total).collect();
    // Every applied sample is counted, once.
    assert!(totals.windows(2).all(|pair| pair[1] == pair[0] + 1), "{totals:?}");
    let restart = seen.applied.iter().skip(1).position(|(_, since)| *since == 1);
    assert!(restart.is_some_and(|place| place > 90), "{restart:?}");
}

/// The remote I/O has kept its history, and the stations the state that it needs: nothing is lost, retentive or not, in whichever phase they fail.
#[test]
fn stations_that_return_go_on_from_the_newest_applied_state() {
    for place in 0..100 {
        let mut simulation = simulation("", 1);
        for (rank, station) in [CONTROLLER, UNDERSTUDY].into_iter().enumerate() {
            let phases = [place % 10, place / 10].map(|tenth| f64::from(tenth) / 10.0);
            simulation.schedule(fault((100, phases[rank]), station, Action::Crash));
            simulation.schedule(fault((150, 0.1), station, Action::Restart));
        }
        let seen = run(&mut simulation, 300);
        assert_eq!(simulation.violations(), [], "{place}");
        assert_eq!((seen.cold.len(), seen.warm.len(), seen.asked), (1, 0, 0), "{place}");
        assert!(!seen.goes_back(), "{place}");
        assert!(seen.applied.iter().all(|(total, since)| total == since), "{place}");
    }
}

#[test]
fn a_retained_state_before_the_newest_applied_one_is_the_operators_choice() {
    let mut simulation = simulation("", 1);
    for member in ALL {
        simulation.schedule(fault((100, 0.9), member, Action::Crash));
    }
    let before = run(&mut simulation, 110);
    let (last, _) = *before.applied.last().expect("it ran");
    for station in [0, 1] {
        simulation.lose_steps(StationId(station), 2);
    }
    for member in ALL {
        simulation.schedule(fault((10, 0.1), member, Action::Restart));
    }
    let asked = run(&mut simulation, 100);
    assert_eq!((asked.asked, asked.applied.len(), asked.warm.len()), (1, 0, 0), "{asked:?}");
    assert_eq!(asked.reasons, [AskReason::Doubt]);
    let choice = StateChoice::Newest { cycle: None };
    simulation.schedule(fault((0, 0.0), REMOTE_IO, Action::Choose { choice }));
    let after = run(&mut simulation, 100);
    assert_eq!(simulation.violations(), []);
    assert_eq!(after.warm.len(), 1);
    let lost = after.warm[0].expect("it has a note");
    assert!((1..=2).contains(&lost), "{lost}");
    assert_eq!(u64::from(after.applied[0].0), u64::from(last) - lost + 1);
}

#[test]
fn the_start_after_a_power_failure_is_as_configured() {
    for (restart, cold, asked) in [("cold", 2, 0), ("operator", 1, 1)] {
        let mut simulation = simulation(&format!("restart = \"{restart}\"\n"), 1);
        fail_and_return(&mut simulation, &ALL, 100, 50);
        let seen = run(&mut simulation, 300);
        assert_eq!(simulation.violations(), [], "{restart}");
        assert_eq!((seen.cold.len(), seen.warm.len(), seen.asked), (cold, 0, asked), "{restart}");
        // A cold start that is configured loses nothing that was to be kept.
        assert_eq!(seen.cold.last(), Some(&None), "{restart}");
        // Nor does a question that is configured.
        assert!(seen.reasons.iter().all(|reason| *reason == AskReason::Configured), "{restart}");
    }
}

/// Nobody releases the outputs between two power failures: what was kept meanwhile is the newest state, and nothing is behind the plant.
#[test]
fn a_second_power_failure_before_the_release_loses_nothing() {
    for up in 1..100 {
        let mut simulation = simulation("release = \"operator\"\n", 1);
        let started = run(&mut simulation, 0);
        assert_eq!((started.cold.len(), started.applied.len()), (1, 0), "{up}");
        simulation.order(ProgramId(0), RemoteIoInput::Release, &mut |_, _, _, _| {});
        fail_and_return(&mut simulation, &ALL, 100, 50);
        fail_and_return(&mut simulation, &ALL, 150 + up, 50);
        simulation.schedule(fault((320, 0.5), REMOTE_IO, Action::Release));
        let seen = run(&mut simulation, 400);
        assert_eq!(simulation.violations(), [], "{up}");
        assert!(seen.warm.iter().all(|lost| *lost == Some(0)), "{up}: {:?}", seen.warm);
        assert_eq!((seen.cold.len(), seen.asked), (0, 0), "{up}");
        assert!(!seen.goes_back(), "{up}");
        let (total, since) = *seen.applied.last().expect("it was released");
        assert!((80..260).contains(&since) && total > 300, "{up}: {total}, {since}");
    }
}

/// A station that comes first and has kept nothing starts nothing: one that has may come later.
#[test]
fn a_station_with_an_empty_disk_does_not_start_the_program_cold() {
    let mut simulation = simulation("", 1);
    for member in ALL {
        simulation.schedule(fault((100, 0.9), member, Action::Crash));
    }
    let before = run(&mut simulation, 110);
    simulation.lose_disk(StationId(1));
    simulation.schedule(fault((120, 0.1), REMOTE_IO, Action::Restart));
    simulation.schedule(fault((120, 0.1), UNDERSTUDY, Action::Restart));
    simulation.schedule(fault((220, 0.1), CONTROLLER, Action::Restart));
    let seen = run(&mut simulation, 300);
    assert_eq!(simulation.violations(), []);
    assert_eq!((seen.cold.len(), seen.warm.as_slice()), (0, &[Some(0)][..]), "{seen:?}");
    let (last, _) = *before.applied.last().expect("it ran");
    assert_eq!(seen.applied[0].0, last + 1);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

    /// Members fail and return one after another, at any phase: no output is wrong, no counter goes back, and nothing starts cold.
    #[test]
    fn a_counter_never_goes_back(
        fails in prop::array::uniform3((0u64..6, 0.0f64..1.0)),
        returns in prop::array::uniform3((0u64..60, 0.0f64..1.0)),
        again in prop::option::of((0u64..40, 0usize..3)),
        seed in 1u64..1000,
    ) {
        let mut simulation = simulation("", seed);
        for ((member, (after, phase)), (returns, at)) in ALL.into_iter().zip(fails).zip(returns) {
            simulation.schedule(fault((60 + after, phase), member, Action::Crash));
            simulation.schedule(fault((70 + returns, at), member, Action::Restart));
        }
        if let Some((after, which)) = again {
            simulation.schedule(fault((140 + after, 0.5), ALL[which], Action::Crash));
            simulation.schedule(fault((190, 0.5), ALL[which], Action::Restart));
        }
        let seen = run(&mut simulation, 300);
        prop_assert_eq!(simulation.violations(), []);
        prop_assert!(!seen.goes_back(), "{:?}", seen);
        prop_assert_eq!(seen.cold.len(), 1, "{:?}", seen);
        // One of the two stations may have missed what the other one proved last: the operator is asked until that one is back.
        prop_assert!(seen.asked == 0 || seen.applied.len() > 100, "{:?}", seen);
    }
}

/// Every power failure sets the wall clocks back, so epochs are founded that are earlier than those before: an old state is none the newer for it.
#[test]
fn a_wall_clock_that_is_set_back_brings_no_old_state_back() {
    let mut simulation = simulation("", 1);
    let mut last = 0;
    for epoch in [900, 500, 20] {
        for (place, member) in (0..).zip(ALL) {
            simulation.schedule(fault((100, 0.9), member, Action::Crash));
            let action = match member {
                Member::Station(_) => Action::RestartInEpoch { epoch: epoch + place },
                _ => Action::Restart,
            };
            simulation.schedule(fault((140, 0.1), member, action));
        }
        let seen = run(&mut simulation, 250);
        assert_eq!(simulation.violations(), [], "{epoch}");
        assert!(!seen.goes_back() && seen.applied[0].0 > last, "{epoch}");
        assert_eq!((seen.warm.as_slice(), seen.asked), (&[Some(0)][..], 0), "{epoch}");
        last = seen.applied.last().expect("it ran").0;
    }
}

/// A remote I/O and a station run a wrong program for a while, and the note is of that program then: what was applied of the right one before is not
/// known, so an older state that a station has kept is the operator's choice.
#[test]
fn a_note_of_another_program_proves_nothing() {
    for (crash, returns) in (0..6).flat_map(|crash| (0..6).map(move |returns| (crash, returns))) {
        let mut simulation = simulation("", 1);
        // The controller goes first: its newest state is before the newest applied output.
        simulation.schedule(fault((60, 0.3), CONTROLLER, Action::Crash));
        for member in [UNDERSTUDY, REMOTE_IO] {
            simulation.schedule(fault((62 + crash, 0.5), member, Action::Crash));
            simulation.schedule(fault((64 + crash, 0.5), member, Action::RestartWrongProgram));
            simulation.schedule(fault((120, 0.5), member, Action::Crash));
            simulation.schedule(fault((122 + returns, 0.5), member, Action::Restart));
        }
        // The wrong program finds the note of the right one, and asks too.
        let choice = StateChoice::Cold;
        simulation.schedule(fault((100, 0.5), REMOTE_IO, Action::Choose { choice }));
        simulation.schedule(fault((124, 0.5), CONTROLLER, Action::Restart));
        let seen = run(&mut simulation, 250);
        assert_eq!(simulation.violations(), [], "{crash} {returns}");
        assert_eq!((seen.warm.len(), seen.asked), (0, 2), "{crash} {returns}");
    }
}

/// Without a note it is not known what was applied: a person is asked, whether stations have kept a state or not.
#[test]
fn a_damaged_note_is_a_question() {
    for has_states in [true, false] {
        let mut simulation = simulation("", 1);
        for member in ALL {
            simulation.schedule(fault((100, 0.9), member, Action::Crash));
        }
        run(&mut simulation, 110);
        simulation.damage_notes(ProgramId(0));
        if !has_states {
            (0..2).for_each(|rank| simulation.lose_disk(StationId(rank)));
        }
        for member in ALL {
            simulation.schedule(fault((10, 0.1), member, Action::Restart));
        }
        let seen = run(&mut simulation, 100);
        assert_eq!(simulation.violations(), [], "{has_states}");
        let starts = seen.warm.len() + seen.cold.len();
        assert_eq!((starts, seen.asked, seen.applied.len()), (0, 1, 0), "{has_states}");
    }
}

/// The slot of a spare is empty, and no other member sends while the remote I/O restarts. Where both stations receive nothing for a cycle meanwhile, neither
/// knows whether the program was started by the spare and the remote I/O: the operator is asked, and the referee finds that no needless question.
#[test]
fn two_isolated_stations_do_not_account_for_an_empty_slot() {
    for (cycles, asks) in [(0, 0), (1, 1), (2, 1)] {
        let mut simulation = simulation("\n[[understudy]]\nname = \"spare\"\nspare = true\n", 1);
        for other in [UNDERSTUDY, REMOTE_IO] {
            for (member, to) in [(CONTROLLER, other), (other, CONTROLLER)] {
                simulation.schedule(fault((60, 0.0), member, Action::Cut { to }));
                simulation.schedule(fault((60 + cycles, 0.0), member, Action::Heal { to }));
            }
        }
        simulation.schedule(fault((60, 0.0), REMOTE_IO, Action::Crash));
        simulation.schedule(fault((60, 0.0), REMOTE_IO, Action::Restart));
        let seen = run(&mut simulation, 120);
        assert_eq!(simulation.violations(), [], "{cycles}");
        assert_eq!(seen.asked, asks, "{cycles}");
    }
}

/// The note of the remote I/O is of an earlier start of the cluster, so the operator is asked. Once the station returns that has the newest state, that
/// one is offered, although the station publishes for another program, and an older one is not taken any more.
#[test]
fn the_newest_state_that_a_station_has_kept_is_offered_once_it_returns() {
    let text = "[cluster]\nname = \"power\"\n\n[[controller]]\nname = \"counter\"\nladder = \"counter.st\"\n\n\
         [[controller]]\nname = \"other\"\nladder = \"counter.st\"\n\n[[understudy]]\nname = \"understudy\"\n\n\
         [[remote_io]]\ncontroller = \"counter\"\n\n[[remote_io]]\ncontroller = \"other\"\n";
    let loaded = read("cluster.toml", text, &mut |_| Ok(COUNTER.to_owned()));
    let cluster = loaded.cluster.unwrap_or_else(|| panic!("{:?}", loaded.reports));
    let (other, understudy) = (Member::Station(StationId(1)), Member::Station(StationId(2)));
    let others = [other, REMOTE_IO, Member::RemoteIo(ProgramId(1))];
    for phase in (0..20).map(|part| f64::from(part) / 20.0) {
        let mut simulation = Simulation::new(parts(&cluster), Network::default(), 1);
        run(&mut simulation, 100);
        simulation.write_protect(ProgramId(0));
        fail_and_return(&mut simulation, &[CONTROLLER, understudy], 0, 20);
        fail_and_return(&mut simulation, &others, 0, 20);
        run(&mut simulation, 200);
        simulation.schedule(fault((0, 0.9), CONTROLLER, Action::Crash));
        for member in others.into_iter().chain([understudy]) {
            simulation.schedule(fault((60, 0.9), member, Action::Crash));
        }
        for member in others.into_iter().chain([CONTROLLER]) {
            simulation.schedule(fault((80, 0.1), member, Action::Restart));
        }
        let before = run(&mut simulation, 200);
        simulation.schedule(fault((0, 0.1), understudy, Action::Restart));
        let after = run(&mut simulation, 50);
        let [(Some(StationId(0)), older)] = before.offered[..] else {
            panic!("{phase}: {before:?}");
        };
        let [(Some(StationId(2)), newer)] = after.offered[..] else {
            panic!("{phase}: {after:?}");
        };
        assert!(newer > older, "{phase}: {older:?} {newer:?}");
        for (cycle, phase) in [(older.cycle, phase), (newer.cycle, 0.99)] {
            let choice = StateChoice::Newest { cycle: Some(cycle) };
            simulation.schedule(fault((0, phase), REMOTE_IO, Action::Choose { choice }));
        }
        let chosen = run(&mut simulation, 50);
        assert_eq!((chosen.refused, chosen.from.as_slice()), (1, &[newer][..]), "{phase}");
        assert_eq!(simulation.violations(), []);
    }
}
