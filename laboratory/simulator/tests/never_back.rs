//! An output that was applied has moved the plant: no program continues from a state before it, unless the operator says so.
//!
//! One broken link from a remote I/O costs no protection: another station relays the samples. A station that receives nothing for
//! long holds a stale state: it is not adopted, the loss is reported, and the operator decides.

mod press_cell;

use press_cell::fault;
use understudy_cycle::Mode;
use understudy_remote_io::{Event, LackingReason, StaleState};
use understudy_simulator::{Action, Network, Record, Simulation};
use understudy_wire::{Member, ProgramId, Source, StateChoice, StationId};

const PROGRAMS: u8 = 2;
const UNDERSTUDY: StationId = StationId(PROGRAMS);
const STATIONS: u8 = PROGRAMS + 1;
const ROBOT_IO: Member = Member::RemoteIo(ProgramId(0));

fn station(rank: u8) -> Member {
    Member::Station(StationId(rank))
}

/// Every link from a remote I/O to a station is cut for each length, then each station crashes: no cycle is lost, whether the
/// link is whole again before, after, or not at all.
#[test]
fn a_broken_link_of_a_remote_io_costs_no_protection() {
    for (program, deaf, crashing) in (0..PROGRAMS)
        .flat_map(|program| (0..STATIONS).map(move |deaf| (program, deaf)))
        .flat_map(|(program, deaf)| (0..STATIONS).map(move |dies| (program, deaf, dies)))
    {
        for (length, heals) in [2, 3, 9, 40, 300]
            .into_iter()
            .flat_map(|length| [Some(-1), Some(5), None].map(|heals| (length, heals)))
        {
            let remote_io = Member::RemoteIo(ProgramId(program));
            let to = station(deaf);
            let mut simulation = Simulation::new(
                press_cell::parts(Mode::Full, 1),
                Network::default(),
                u64::from(program),
            );
            let (cut, dies) = (10, 10 + length);
            simulation.schedule(fault(cut, 0.9, remote_io, Action::Cut { to }));
            simulation.schedule(fault(dies, 0.3, station(crashing), Action::Crash));
            if let Some(heals) = heals {
                let at = dies.saturating_add_signed(heals);
                simulation.schedule(fault(at, 0.9, remote_io, Action::Heal { to }));
            }
            let mut unprotected = Vec::new();
            simulation
                .run(dies + 60, 100, &mut |_, cycle, _, record| {
                    if let Record::RemoteIo(Event::Unprotected { .. }) = record {
                        unprotected.push(cycle);
                    }
                })
                .expect("the cluster gets ready");
            let what = format!("{program} to {deaf}, {crashing} dies after {length}, {heals:?}");
            assert_eq!(simulation.violations(), [], "{what}");
            for tally in simulation.tallies() {
                assert_eq!(tally.held + tally.fail_safe, 0, "{what}: {tally:?}");
            }
            // Protection is lost by the crash, not by the link.
            assert!(
                unprotected.iter().all(|&cycle| cycle >= Some(dies)),
                "{what}: {unprotected:?}"
            );
            assert!(!unprotected.is_empty(), "{what}");
        }
    }
}

/// A station dies, and its remote I/O after it; the station comes back while the remote I/O is away, and takes its state from the other one that
/// holds it. Nothing is lost: the remote I/O goes on from that state without a question, in whichever order the two come back.
#[test]
fn a_state_that_a_living_station_holds_is_not_lost() {
    for (dies, phase) in [station(0), Member::Station(UNDERSTUDY)]
        .into_iter()
        .flat_map(|dies| [0.0, 0.2, 0.4, 0.6, 0.8].map(|phase| (dies, phase)))
    {
        for (station_back, remote_io_back) in
            [(20, 22), (20, 40), (20, 200), (22, 20), (200, 20), (20, 20), (20, 21), (21, 20)]
        {
            let mut simulation =
                Simulation::new(press_cell::parts(Mode::Full, 1), Network::default(), 1);
            let remote_io_dies = 10 + 300;
            simulation.schedule(fault(10, phase, dies, Action::Crash));
            simulation.schedule(fault(remote_io_dies, phase, ROBOT_IO, Action::Crash));
            let back =
                |after: u64, member| fault(remote_io_dies + after, phase, member, Action::Restart);
            simulation.schedule(back(station_back, dies));
            simulation.schedule(back(remote_io_back, ROBOT_IO));
            let mut asked = Vec::new();
            let mut observe = |_, _, _, record: Record<'_>| {
                if let Record::RemoteIo(event) = record
                    && matches!(event, Event::StateLost { .. } | Event::Disputed { .. })
                {
                    asked.push(event.clone());
                }
            };
            simulation.run(800, 100, &mut observe).expect("the cluster gets ready");
            let what = format!("{dies:?} {station_back}, remote I/O {remote_io_back}, at {phase}");
            assert_eq!(simulation.violations(), [], "{what}");
            assert_eq!(asked, [], "{what}");
            simulation.run(5, 100, &mut |_, _, _, _| {}).expect("protection comes back");
        }
    }
}

/// A station that was gone comes back, and within a few cycles its remote I/O restarts, at each part of the cycle: the other station has the state,
/// and the operator is not asked.
#[test]
fn a_station_that_has_just_returned_is_no_reason_to_ask() {
    const PHASES: [f64; 5] = [0.0, 0.2, 0.4, 0.6, 0.9];
    let mut asked = 0;
    for (after, returns, fails) in (0..6).flat_map(|after| {
        PHASES.into_iter().flat_map(move |a| PHASES.into_iter().map(move |b| (after, a, b)))
    }) {
        for (station, twice) in
            [(station(0), false), (Member::Station(UNDERSTUDY), false), (station(0), true)]
        {
            let mut simulation =
                Simulation::new(press_cell::parts(Mode::Full, 1), Network::default(), 1);
            simulation.schedule(fault(10, 0.0, station, Action::Crash));
            simulation.schedule(fault(60, returns, station, Action::Restart));
            let mut restarts = vec![60 + after];
            if twice {
                restarts.insert(0, 58);
            }
            for at in restarts {
                simulation.schedule(fault(at, fails, ROBOT_IO, Action::Crash));
                simulation.schedule(fault(at, fails, ROBOT_IO, Action::Restart));
            }
            simulation
                .run(200, 100, &mut |_, _, _, record| {
                    let lost = matches!(record, Record::RemoteIo(Event::StateLost { .. }));
                    asked += u32::from(lost);
                })
                .expect("the cluster gets ready");
            let what = format!("{station:?} at {returns}, {after} later at {fails}, {twice}");
            assert_eq!(simulation.violations(), [], "{what}");
        }
    }
    assert_eq!(asked, 0);
}

/// The robot's remote I/O receives no station that runs its program for so long that what it samples, and nobody applies, fills every memory:
/// it goes on from its newest applied output.
#[test]
fn a_remote_io_that_receives_nobody_for_long_does_not_forget_its_history() {
    let mut simulation = Simulation::new(press_cell::parts(Mode::Full, 1), Network::default(), 1);
    for from in [station(0), Member::Station(UNDERSTUDY)] {
        simulation.schedule(fault(20, 0.0, from, Action::Cut { to: ROBOT_IO }));
        simulation.schedule(fault(1_300, 0.0, from, Action::Heal { to: ROBOT_IO }));
    }
    simulation.run(1_400, 100, &mut |_, _, _, _| {}).expect("the cluster gets ready");
    assert_eq!(simulation.violations(), []);
    let robot = &simulation.tallies()[0];
    assert!(robot.fail_safe > 1_200 && robot.direct > 90, "{robot:?}");
}

/// The robot's controller stands still with the only copy of the state, and goes on just before, in or after the cycle in which the program starts
/// cold: for as long as it was silent nobody could tell it from a dead one, and from then on it counts.
#[test]
fn a_station_that_comes_back_as_its_program_starts_cold_is_too_late_or_continues() {
    let mut colds = 0;
    for (continues, phase) in
        (40..58).flat_map(|cycle| [0.0, 0.13, 0.6].map(|phase| (cycle, phase)))
    {
        let mut simulation =
            Simulation::new(press_cell::parts(Mode::Full, 1), Network::default(), 1);
        simulation.schedule(fault(20, phase, station(0), Action::Stop));
        let crashes = if phase > 0.0 { 29 } else { 20 };
        simulation.schedule(fault(crashes, phase, Member::Station(UNDERSTUDY), Action::Crash));
        simulation.schedule(fault(crashes, phase, Member::Station(UNDERSTUDY), Action::Restart));
        simulation.schedule(fault(continues, phase, station(0), Action::Continue));
        let mut cold = 0;
        simulation
            .run(120, 100, &mut |_, cycle, member, record| {
                let is_cold = matches!(record, Record::RemoteIo(Event::StartedCold { .. }));
                cold += u32::from(is_cold && member == ROBOT_IO && cycle > Some(20));
            })
            .expect("the cluster gets ready");
        assert_eq!(simulation.violations(), [], "{continues} {phase}");
        colds += cold;
    }
    // Some of them are too late, and some are not.
    assert!((1..54).contains(&colds), "{colds}");
}

/// The understudy receives neither the samples of the robot nor any station for `length` cycles, then what
/// `ends` says happens to the robot's controller.
fn stale(length: u64, stale_state: StaleState, ends: Action) -> Simulation {
    let mut parts = press_cell::parts(Mode::Full, 1);
    for remote_io in &mut parts.remote_ios {
        remote_io.fallback.stale_state = stale_state;
    }
    let mut simulation = Simulation::new(parts, Network::default(), 1);
    let to = Member::Station(UNDERSTUDY);
    for from in [ROBOT_IO, station(0), station(1)] {
        simulation.schedule(fault(10, 0.0, from, Action::Cut { to }));
        simulation.schedule(fault(10 + length + 5, 0.0, from, Action::Heal { to }));
    }
    simulation.schedule(fault(10 + length, 0.5, station(0), ends));
    simulation
}

/// What the robot's remote I/O reports and applies.
#[derive(Default)]
struct Seen {
    unprotected: Vec<(u64, Vec<LackingReason>)>,
    lost: Vec<(u64, u64, Option<u64>)>,
    sources: Vec<(u64, Source)>,
    cold: u64,
}

impl Seen {
    fn note(&mut self, cycle: Option<u64>, member: Member, record: &Record<'_>) {
        let (Some(cycle), Member::RemoteIo(ProgramId(0)), Record::RemoteIo(event)) =
            (cycle, member, record)
        else {
            return;
        };
        match event {
            Event::Unprotected { lacking, .. } => {
                let reasons = lacking.iter().map(|one| one.reason).collect();
                self.unprotected.push((cycle, reasons));
            }
            Event::StateLost { newest, applied, .. } => {
                let applied = applied.map(|applied| applied.cycle.0);
                let newest = newest.expect("a station holds a state");
                self.lost.push((cycle, newest.cycle.0, applied));
            }
            Event::Applied { source, .. } => self.sources.push((cycle, *source)),
            Event::StartedCold { .. } => self.cold += 1,
            _ => {}
        }
    }
}

#[test]
fn a_stale_state_is_not_adopted_and_the_operator_is_asked() {
    for length in [20, 60, 300] {
        let mut simulation = stale(length, StaleState::Operator, Action::Crash);
        let mut seen = Seen::default();
        simulation
            .run(10 + length + 100, 100, &mut |_, cycle, member, record| {
                seen.note(cycle, member, &record)
            })
            .expect("the cluster gets ready");
        assert_eq!(simulation.violations(), []);
        let [(at, reasons)] = &seen.unprotected[..] else {
            panic!("{:?}", seen.unprotected);
        };
        assert!((10..10 + 5).contains(at), "protection is lost with the link, not later: {at}");
        assert!(matches!(reasons[..], [LackingReason::Behind { .. }]), "{reasons:?}");
        let [(_, newest, Some(applied))] = seen.lost[..] else {
            panic!("{:?}", seen.lost);
        };
        assert!((length - 2..=length + 2).contains(&(applied - newest)), "{applied} {newest}");
        assert_eq!(seen.cold, 0);
        let after = |source| {
            let dead = seen.sources.iter().filter(|(cycle, _)| *cycle > 10 + length);
            dead.filter(|(_, of)| *of == source).count()
        };
        assert_eq!(after(Source::Reconstructed) + after(Source::Direct), 0);
        assert_eq!(after(Source::Held), 3);
        // The operator chooses the state as it is offered, and no other one.
        for (cycle, continues) in [(newest + 1, false), (newest, true)] {
            let cycle = Some(understudy_wire::Cycle(cycle));
            let choice = StateChoice::Newest { cycle };
            simulation.schedule(fault(0, 0.0, ROBOT_IO, Action::Choose { choice }));
            let done = simulation.run(5, 60, &mut |_, _, _, _| {});
            // The robot's controller is dead: all others are served again.
            assert!(done.is_err());
            let reconstructed = simulation.tallies()[0].reconstructed > 0;
            assert_eq!(reconstructed, continues);
            assert_eq!(simulation.violations(), []);
        }
    }
}

#[test]
fn a_stale_state_is_followed_by_a_cold_start_where_that_is_configured() {
    let mut simulation = stale(100, StaleState::Cold, Action::Crash);
    let mut seen = Seen::default();
    simulation
        .run(300, 100, &mut |_, cycle, member, record| seen.note(cycle, member, &record))
        .expect("the cluster gets ready");
    assert_eq!(simulation.violations(), []);
    assert_eq!((seen.lost.len(), seen.cold), (1, 1));
    let last = seen.sources.last().map(|(_, source)| *source);
    assert_eq!(last, Some(Source::Reconstructed));
}

/// A controller that was suspended while the understudy was cut off returns with the state: the program continues without help.
#[test]
fn a_station_that_returns_with_the_state_ends_the_loss() {
    let mut simulation = stale(100, StaleState::Operator, Action::Stop);
    simulation.schedule(fault(200, 0.5, station(0), Action::Continue));
    let mut recovered = 0;
    simulation
        .run(300, 100, &mut |_, _, _, record| {
            recovered +=
                u64::from(matches!(record, Record::RemoteIo(Event::StateRecovered { .. })));
        })
        .expect("the cluster gets ready");
    assert_eq!(recovered, 1);
    assert_eq!(simulation.run(5, 100, &mut |_, _, _, _| {}), Ok(()));
    assert_eq!(simulation.violations(), []);
}

/// The remote I/O and its controller lose their memory together: what was applied last is not known, so the operator is asked. Where
/// the controller was gone before, or dies after the remote I/O was seen to be silent, nothing newer can have been applied.
#[test]
fn a_remote_io_that_cannot_know_what_it_applied_asks() {
    for (controller_dies, asks) in [(20, false), (99, true), (100, true), (101, true), (108, false)]
    {
        let parts = press_cell::parts(Mode::Full, 1);
        let mut simulation = Simulation::new(parts, Network::default(), 1);
        simulation.schedule(fault(controller_dies, 0.3, station(0), Action::Crash));
        simulation.schedule(fault(100, 0.3, ROBOT_IO, Action::Crash));
        simulation.schedule(fault(120, 0.3, ROBOT_IO, Action::Restart));
        let mut seen = Seen::default();
        simulation
            .run(250, 100, &mut |_, cycle, member, record| seen.note(cycle, member, &record))
            .expect("the cluster gets ready");
        assert_eq!(simulation.violations(), []);
        assert_eq!(!seen.lost.is_empty(), asks, "{controller_dies}: {:?}", seen.lost);
        let last = seen.sources.last().map(|(_, source)| *source);
        let expected = if asks { Source::FailSafe } else { Source::Reconstructed };
        assert_eq!(last, Some(expected), "{controller_dies}");
    }
}

/// A remote I/O that has just started loses the only holder of the state, and a station of a new life takes the state over: as long as it may,
/// nothing starts cold.
#[test]
fn a_state_that_is_handed_over_while_a_remote_io_listens_is_waited_for() {
    let robot_io_from = |rank| Action::Cut { to: station(rank) };
    let to_robot_io = Action::Cut { to: ROBOT_IO };
    for (at, phase) in (107..125).flat_map(|at| [0.1, 0.4, 0.6, 0.9].map(|phase| (at, phase))) {
        // The controller is cut off from it, and gives the state to the understudy; or it comes back, and takes the state from
        // the understudy, which the remote I/O does not receive.
        let cut_off = [
            (90, 0.4, station(2), Action::Crash),
            (100, 0.0, ROBOT_IO, Action::Crash),
            (103, 0.0, ROBOT_IO, Action::Restart),
            (at, phase, ROBOT_IO, robot_io_from(0)),
            (at, phase, station(0), to_robot_io),
            (at + 2, 0.4, station(2), Action::Restart),
        ];
        let restarted = [
            (20, 0.0, station(2), to_robot_io),
            (100, 0.9, ROBOT_IO, Action::Crash),
            (100, 0.9, ROBOT_IO, Action::Restart),
            (at, phase, station(0), Action::Crash),
            (at + 1, phase, station(0), Action::Restart),
        ];
        for faults in [&cut_off[..], &restarted] {
            let parts = press_cell::parts(Mode::Full, 1);
            let mut simulation = Simulation::new(parts, Network::default(), 1);
            for (cycle, phase, member, action) in faults {
                simulation.schedule(fault(*cycle, *phase, *member, *action));
            }
            let mut seen = Seen::default();
            simulation
                .run(200, 100, &mut |_, cycle, member, record| seen.note(cycle, member, &record))
                .expect("the cluster gets ready");
            let starts = faults.len();
            assert_eq!(simulation.violations(), [], "{at} {phase} {starts}");
            assert_eq!(seen.cold, 0, "{at} {phase} {starts}");
        }
    }
}

/// A remote I/O is suspended while the only station with the state is cut off, and reads at once what it received meanwhile: what it decides by
/// that loses no state, and it does not continue from before an applied output.
#[test]
fn a_remote_io_that_was_suspended_decides_by_the_present() {
    let members = [station(1), station(2), ROBOT_IO];
    for (stopped, length) in (21..47).flat_map(|at| [4, 12, 25, 40].map(|length| (at, length))) {
        let parts = press_cell::parts(Mode::Full, 1);
        let mut simulation = Simulation::new(parts, Network::default(), 1);
        for to in members {
            simulation.schedule(fault(20, 0.0, station(0), Action::Cut { to }));
            simulation.schedule(fault(46, 0.0, station(0), Action::Heal { to }));
        }
        for from in members {
            let to = station(0);
            simulation.schedule(fault(20, 0.0, from, Action::Cut { to }));
            if from != ROBOT_IO {
                simulation.schedule(fault(46, 0.0, from, Action::Heal { to }));
            }
        }
        simulation.schedule(fault(20, 0.0, station(2), Action::Crash));
        simulation.schedule(fault(20, 0.0, station(2), Action::Restart));
        simulation.schedule(fault(stopped, 0.0, ROBOT_IO, Action::Stop));
        simulation.schedule(fault(stopped + length, 0.0, ROBOT_IO, Action::Continue));
        let mut seen = Seen::default();
        simulation
            .run(200, 100, &mut |_, cycle, member, record| seen.note(cycle, member, &record))
            .expect("the cluster gets ready");
        assert_eq!(simulation.violations(), [], "{stopped} {length}");
        // It stays awake for so long that it starts cold before the state is there, or not at all.
        assert!(seen.cold == 0 || stopped > 40, "{stopped} {length}");
    }
}

/// The remote I/O restarts in the cycle whose outputs only its controller has proved, and the controller restarts after it: what the controller
/// recalled in its earlier life proves nothing of its new one, and the operator is asked.
#[test]
fn what_a_station_recalled_before_its_restart_proves_nothing() {
    for (dies, phase) in (64..75).flat_map(|dies| [0.0, 0.4, 0.8].map(|phase| (dies, phase))) {
        let parts = press_cell::parts(Mode::Full, 1);
        let mut simulation = Simulation::new(parts, Network::default(), 1);
        let understudy = Member::Station(UNDERSTUDY);
        for other in [station(0), station(1), ROBOT_IO] {
            simulation.schedule(fault(63, 0.0, understudy, Action::Cut { to: other }));
            simulation.schedule(fault(63, 0.0, other, Action::Cut { to: understudy }));
        }
        let to = ROBOT_IO;
        simulation.schedule(fault(64, 0.0, understudy, Action::Heal { to }));
        simulation.schedule(fault(64, 0.0, to, Action::Heal { to: understudy }));
        simulation.schedule(fault(63, 0.8, ROBOT_IO, Action::Crash));
        simulation.schedule(fault(63, 0.8, ROBOT_IO, Action::Restart));
        simulation.schedule(fault(dies, phase, station(0), Action::Crash));
        simulation.schedule(fault(dies, phase, station(0), Action::Restart));
        simulation.run(200, 100, &mut |_, _, _, _| {}).expect("the cluster gets ready");
        assert_eq!(simulation.violations(), [], "{dies} {phase}");
    }
}

/// The controller was gone for long, gets its state from the understudy, which receives nothing from then on, and proves outputs alone until it dies
/// with the remote I/O's memory: the understudy does not vouch for it any more.
#[test]
fn a_station_that_was_given_the_state_is_gone_no_more() {
    let mut adopted = 0;
    for (deaf, phase) in (60..75).flat_map(|deaf| [0.0, 0.4, 0.7, 0.9].map(|phase| (deaf, phase))) {
        let parts = press_cell::parts(Mode::Full, 1);
        let mut simulation = Simulation::new(parts, Network::default(), 1);
        let understudy = Member::Station(UNDERSTUDY);
        simulation.schedule(fault(20, 0.3, station(0), Action::Crash));
        simulation.schedule(fault(60, 0.3, station(0), Action::Restart));
        for other in [station(0), station(1), ROBOT_IO] {
            let to = understudy;
            simulation.schedule(fault(deaf, phase, other, Action::Cut { to }));
        }
        for (at, member) in [(90, station(0)), (90, ROBOT_IO)] {
            simulation.schedule(fault(at, 0.8, member, Action::Crash));
        }
        simulation.schedule(fault(95, 0.0, ROBOT_IO, Action::Restart));
        let mut direct = 0;
        simulation
            .run(200, 100, &mut |_, cycle, member, record| {
                if let (Record::RemoteIo(Event::Applied { source, .. }), ROBOT_IO) =
                    (record, member)
                {
                    let is_alone = (deaf + 1..90).contains(&cycle.unwrap_or(0));
                    direct += u64::from(*source == Source::Direct && is_alone);
                }
            })
            .expect("the cluster gets ready");
        adopted += u64::from(direct > 0);
        assert_eq!(simulation.violations(), [], "{deaf} {phase}");
    }
    // In some of them the controller has the state in time.
    assert!(adopted > 0);
}
