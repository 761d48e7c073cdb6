//! Every kind of fault on its own: what the cell does about it, and that nothing wrong is driven.

mod press_cell;

use std::time::Duration;

use understudy_cycle::Mode;
use understudy_node::Event;
use understudy_remote_io::Event as RemoteIoEvent;
use understudy_simulator::{Action, Fault, Network, Record, Simulation, Tally};
use understudy_wire::{ConfigurationHash, Member, ProgramId, Source, StationId};

const ROBOT: Member = Member::Station(StationId(0));
const UNDERSTUDY: Member = Member::Station(StationId(2));
const ROBOT_IO: Member = Member::RemoteIo(ProgramId(0));
const MEMBERS: [Member; 5] =
    [ROBOT, Member::Station(StationId(1)), UNDERSTUDY, ROBOT_IO, Member::RemoteIo(ProgramId(1))];

/// What a run came to.
struct Outcome {
    tallies: Vec<Tally>,
    refused_frames: u64,
    /// Who refused whom, with both hashes.
    refusals: Vec<(Member, Member, ConfigurationHash, ConfigurationHash)>,
}

/// 200 cycles with the given faults, then all is well again: nothing wrong is driven, and protection is back.
fn check(network: Network, faults: &[(u64, f64, Member, Action)]) -> Outcome {
    let mut simulation = Simulation::new(press_cell::parts(Mode::Full, 1), network, 1);
    for &(at_cycle, phase, member, action) in faults {
        simulation.schedule(Fault { at_cycle, phase, member, action });
    }
    let mut refusals = Vec::new();
    let mut observe = |_, _, member, record: Record<'_>| {
        let refused = match record {
            Record::Station(Event::Refused { member: other, theirs, ours })
            | Record::RemoteIo(understudy_remote_io::Event::Refused {
                member: other,
                theirs,
                ours,
            }) => Some((member, *other, *theirs, *ours)),
            _ => None,
        };
        refusals.extend(refused);
    };
    simulation.run(200, 100, &mut observe).expect("the cluster gets ready");
    let tallies = simulation.tallies().to_vec();
    simulation.run(5, 100, &mut observe).expect("protection comes back");
    assert_eq!(simulation.violations().first(), None, "{faults:?}");
    Outcome { tallies, refused_frames: simulation.refused_frames(), refusals }
}

fn quiet(faults: &[(u64, f64, Member, Action)]) -> Outcome {
    check(Network::default(), faults)
}

fn untrue(outcome: &Outcome) -> u64 {
    let tallies = outcome.tallies.iter();
    tallies.map(|tally| tally.held + tally.fail_safe).sum()
}

#[test]
fn a_corrupted_frame_is_refused_and_its_copy_serves() {
    for member in MEMBERS {
        let outcome = quiet(&[(50, 0.0, member, Action::Corrupt { frames: 1 })]);
        assert_eq!(outcome.refused_frames, 1, "{member:?}");
        assert_eq!(untrue(&outcome), 0, "{member:?}");
    }
}

#[test]
fn a_network_that_corrupts_is_as_one_that_loses() {
    let network = Network { corruption: 0.05, ..Network::default() };
    assert!(check(network, &[]).refused_frames > 0);
}

/// Old frames of everybody, at every tenth of a cycle, from within the cycle back to the start of the run.
#[test]
fn a_replayed_frame_is_harmless() {
    for member in MEMBERS {
        for age in [1, 2, 3, 5, 20, 150] {
            let replays: Vec<_> = (0..10)
                .map(|tenth| {
                    let phase = f64::from(tenth) / 10.0;
                    (60 + tenth as u64, phase, member, Action::Replay { age })
                })
                .collect();
            assert_eq!(untrue(&quiet(&replays)), 0, "{member:?}, {age} frames ago");
        }
    }
}

/// While a member is down, others hear what it said before, as if it lived.
#[test]
fn a_replayed_frame_does_not_stand_in_for_the_dead() {
    for member in MEMBERS {
        for age in [1, 2, 3, 5, 20, 150] {
            let mut faults = vec![(50, 0.3, member, Action::Crash)];
            faults.extend((0..40).map(|cycle| {
                let phase = cycle as f64 * 0.37 % 1.0;
                (51 + cycle, phase, member, Action::Replay { age })
            }));
            faults.push((91, 0.3, member, Action::Restart));
            faults.extend((0..10).map(|cycle| {
                let phase = cycle as f64 * 0.37 % 1.0;
                (91 + cycle, phase, member, Action::Replay { age })
            }));
            quiet(&faults);
        }
    }
}

/// Each of its neighbours names it once, with both hashes; its program is carried by the understudy.
#[test]
fn a_misconfigured_station_is_refused_with_both_hashes() {
    let outcome = quiet(&[
        (50, 0.0, ROBOT, Action::Crash),
        (60, 0.0, ROBOT, Action::RestartMisconfigured),
        (150, 0.0, ROBOT, Action::Restart),
    ]);
    assert_eq!(untrue(&outcome), 0);
    let right = press_cell::parts(Mode::Full, 1).stations[0].agreement.configuration;
    let mut refusals = outcome.refusals;
    let wrong = refusals.iter().find(|refusal| refusal.1 == ROBOT);
    let wrong = wrong.expect("the robot is refused").2;
    assert_ne!(wrong, right);
    let mut named: Vec<_> = MEMBERS[1..]
        .iter()
        .flat_map(|&other| [(other, ROBOT, wrong, right), (ROBOT, other, right, wrong)])
        .collect();
    named.sort_unstable();
    refusals.sort_unstable();
    assert_eq!(refusals, named);
}

/// A remote I/O and one of its stations are restarted with one and the same wrong program: they admit each other, and everything else that they
/// receive has another configuration. Nothing of their program is applied, and with the right one again the operator decides.
#[test]
fn a_wrong_program_drives_nothing() {
    for station in [ROBOT, UNDERSTUDY] {
        for (first, second) in [(ROBOT_IO, station), (station, ROBOT_IO)] {
            for apart in [0, 1, 3, 40] {
                for phase in [0.0, 0.3, 0.6, 0.9] {
                    let restart = |cycle, member| {
                        let action = Action::RestartWrongProgram;
                        [(cycle, phase, member, Action::Crash), (cycle, phase, member, action)]
                    };
                    let mut simulation =
                        Simulation::new(press_cell::parts(Mode::Full, 1), Network::default(), 1);
                    let steps = restart(50, first).into_iter().chain(restart(50 + apart, second));
                    for (at_cycle, phase, member, action) in steps {
                        simulation.schedule(Fault { at_cycle, phase, member, action });
                    }
                    let (mut asked, mut outvoted) = (0, Vec::new());
                    let mut observe = |_, _, member, record: Record<'_>| match record {
                        Record::RemoteIo(RemoteIoEvent::ConfigurationDisputed { .. }) => asked += 1,
                        Record::RemoteIo(RemoteIoEvent::Outvoted { .. })
                        | Record::Station(Event::Outvoted { .. }) => outvoted.push(member),
                        _ => {}
                    };
                    simulation.run(500, 100, &mut observe).expect("the cluster gets ready");
                    let case = format!("{first:?} and {apart} cycles later {second:?}, at {phase}");
                    assert_eq!(simulation.violations().first(), None, "{case}");
                    assert_eq!(asked, 1, "{case}");
                    // The station has the majority against it; the remote I/O where it receives two stations of the others.
                    assert!(outvoted.contains(&station), "{case}: {outvoted:?}");
                    assert!(
                        outvoted.iter().all(|it| [station, ROBOT_IO].contains(it)),
                        "{case}: {outvoted:?}"
                    );
                }
            }
        }
    }
}

/// A program that all members have starts cold, although one member with another configuration is received.
#[test]
fn one_member_with_another_configuration_keeps_no_cluster_from_its_start() {
    let members = || MEMBERS.into_iter().chain([Member::Station(StationId(3))]);
    for other in members() {
        let all = members().flat_map(|member| {
            let action = match member == other {
                true => Action::RestartMisconfigured,
                false => Action::Restart,
            };
            [(50, 0.0, member, Action::Crash), (50, 0.1, member, action)]
        });
        let mut simulation =
            Simulation::new(press_cell::parts(Mode::Full, 2), Network::default(), 1);
        for (at_cycle, phase, member, action) in all {
            simulation.schedule(Fault { at_cycle, phase, member, action });
        }
        let (mut cold, mut asked) = (Vec::new(), 0);
        let mut observe = |_, _, member, record: Record<'_>| match record {
            Record::RemoteIo(RemoteIoEvent::StartedCold { .. }) => cold.push(member),
            Record::RemoteIo(RemoteIoEvent::ConfigurationDisputed { .. }) => asked += 1,
            _ => {}
        };
        simulation.run(300, 100, &mut observe).expect("the cluster gets ready");
        // The start of the run, and the restart: of both programs, or of that whose remote I/O is right.
        let expected = if matches!(other, Member::RemoteIo(_)) { 3 } else { 4 };
        assert_eq!((cold.len(), asked), (expected, 0), "{other:?}: {cold:?}");
    }
}

/// A station that stood still for seconds misses samples that its remote I/O has sent all the time: that is no remote I/O that is gone.
#[test]
fn a_station_that_stood_still_does_not_report_samples_as_missing() {
    for station in [ROBOT, UNDERSTUDY] {
        for (cycles, phase) in [150, 300, 450]
            .into_iter()
            .flat_map(|cycles| [0.0, 0.3, 0.6, 0.9].map(|phase| (cycles, phase)))
        {
            let mut simulation =
                Simulation::new(press_cell::parts(Mode::Full, 1), Network::default(), 1);
            for (at_cycle, action) in [(50, Action::Stop), (50 + cycles, Action::Continue)] {
                simulation.schedule(Fault { at_cycle, phase, member: station, action });
            }
            let mut missing = Vec::new();
            simulation
                .run(800, 100, &mut |_, cycle, member, record| {
                    if let Record::Station(Event::SamplesMissing { .. }) = record {
                        missing.push((cycle, member));
                    }
                })
                .expect("the cluster gets ready");
            assert_eq!(missing, [], "{station:?} stood still for {cycles} cycles at {phase}");
        }
    }
}

/// A remote I/O that goes on after it was suspended for longer than it holds outputs has proved nothing since: it drives the fail-safe values and
/// then new outputs, whether the frames of the time between have waited for it or are lost.
#[test]
fn a_remote_io_that_stood_still_holds_no_output_of_before() {
    let stations = [0, 1, 2].map(|rank| Member::Station(StationId(rank)));
    let hold = u64::from(press_cell::HOLD_CYCLES);
    for (cycles, phase) in [hold + 2, 30, 300]
        .into_iter()
        .flat_map(|cycles| [0.0, 0.3, 0.6, 0.9].map(|phase| (cycles, phase)))
    {
        for is_cut in [false, true] {
            let mut simulation =
                Simulation::new(press_cell::parts(Mode::Full, 1), Network::default(), 1);
            let goes_on = 50 + cycles;
            let mut schedule = |at_cycle, member, action| {
                simulation.schedule(Fault { at_cycle, phase, member, action });
            };
            schedule(50, ROBOT_IO, Action::Stop);
            schedule(goes_on, ROBOT_IO, Action::Continue);
            for station in stations.into_iter().filter(|_| is_cut) {
                schedule(50, station, Action::Cut { to: ROBOT_IO });
                schedule(goes_on + 1, station, Action::Heal { to: ROBOT_IO });
            }
            let mut sources = Vec::new();
            let mut observe = |_, cycle: Option<u64>, member, record: Record<'_>| {
                if let Record::RemoteIo(RemoteIoEvent::Applied { source, .. }) = record
                    && member == ROBOT_IO
                    && cycle.is_some_and(|cycle| (goes_on..goes_on + 20).contains(&cycle))
                {
                    sources.push(*source);
                }
            };
            simulation.run(400, 100, &mut observe).expect("the cluster gets ready");
            let what = format!("{cycles} cycles at {phase}, cut: {is_cut}: {sources:?}");
            // Where the frames have waited, new outputs may be proved at its first deadline.
            let is_proved_at_once = !is_cut && sources.first() == Some(&Source::Direct);
            assert!(sources.contains(&Source::FailSafe) || is_proved_at_once, "{what}");
            assert!(!sources.contains(&Source::Held), "{what}");
            assert_eq!(sources.last(), Some(&Source::Direct), "{what}");
            assert_eq!(simulation.violations().first(), None, "{what}");
        }
    }
}

/// A remote I/O that goes on after it was suspended finds the only station with its state back, with samples that became void meanwhile: the program
/// continues, and no person is asked.
#[test]
fn a_remote_io_that_stood_still_does_not_take_what_it_missed_for_a_lost_state() {
    for (from, phase) in (430..450).flat_map(|from| [0.0, 0.3, 0.6, 0.9].map(|phase| (from, phase)))
    {
        let mut simulation =
            Simulation::new(press_cell::parts(Mode::Full, 1), Network::default(), 1);
        let steps = [
            (30, UNDERSTUDY, Action::Stop),
            (400, ROBOT, Action::Stop),
            (420, UNDERSTUDY, Action::Continue),
            (from, ROBOT_IO, Action::Stop),
            (460, ROBOT, Action::Continue),
            (480, ROBOT_IO, Action::Continue),
        ];
        for (at_cycle, member, action) in steps {
            simulation.schedule(Fault { at_cycle, phase, member, action });
        }
        let mut lost = Vec::new();
        let mut observe = |_, cycle: Option<u64>, _, record: Record<'_>| {
            if let Record::RemoteIo(event @ RemoteIoEvent::StateLost { .. }) = record
                && cycle.is_some_and(|cycle| cycle >= 480)
            {
                lost.push(event.clone());
            }
        };
        simulation.run(700, 100, &mut observe).expect("the cluster gets ready");
        assert_eq!(lost, [], "suspended in cycle {from} at {phase}");
        assert!(simulation.synchronised(), "suspended in cycle {from} at {phase}");
    }
}

/// Up to a slot and far beyond it: a slow station is late, then silent, and never wrong.
#[test]
fn a_slow_station_is_late_and_then_silent() {
    for member in MEMBERS {
        for tenths_of_a_millisecond in [1, 5, 10, 30, 60, 100, 250, 1000] {
            let by = Duration::from_micros(tenths_of_a_millisecond * 100);
            let outcome = quiet(&[
                (50, 0.0, member, Action::Slow { by }),
                (150, 0.0, member, Action::Slow { by: Duration::ZERO }),
            ]);
            if matches!(member, Member::Station(_)) {
                assert_eq!(untrue(&outcome), 0, "{member:?} slow by {by:?}");
            }
        }
    }
}

/// A station that is started again and again before it is synchronised costs nothing but its own protection.
#[test]
fn a_restart_storm_costs_no_cycle() {
    for member in [ROBOT, UNDERSTUDY] {
        for every in [1, 2, 3, 5, 8] {
            let storm: Vec<_> = (0..100 / every)
                .flat_map(|restart| {
                    let cycle = 50 + restart * every;
                    [(cycle, 0.2, member, Action::Crash), (cycle, 0.6, member, Action::Restart)]
                })
                .collect();
            assert_eq!(untrue(&quiet(&storm)), 0, "{member:?} every {every} cycles");
        }
    }
}

/// With keys a stranger is not heard, whatever it says in whose name.
#[test]
fn a_forged_frame_is_refused() {
    for member in MEMBERS {
        let forged: Vec<_> = (0..40)
            .map(|number| {
                let phase = f64::from(number) / 40.0;
                (60 + number as u64, phase, member, Action::Forge)
            })
            .collect();
        let outcome = quiet(&forged);
        assert_eq!(outcome.refused_frames, 40, "{member:?}");
        assert_eq!(untrue(&outcome), 0, "{member:?}");
    }
}

/// The wall clock gives a station the epoch that it founds when nobody is there. One that comes back with an epoch from the past or
/// from the far future renumbers nobody; where all come back so, they agree on one again.
#[test]
fn a_wall_clock_that_jumps_renumbers_nobody() {
    for epoch in [0, 1, 2, 1000, u64::MAX] {
        let in_epoch = Action::RestartInEpoch { epoch };
        for rank in 0..3 {
            let member = Member::Station(StationId(rank));
            let faults = [(50, 0.3, member, Action::Crash), (80, 0.6, member, in_epoch)];
            let outcome = quiet(&faults);
            assert_eq!(untrue(&outcome), 0, "{member:?} in epoch {epoch}");
        }
        let all = [0, 1, 2].map(|rank| Member::Station(StationId(rank)));
        let crashes = all.map(|member| (50, 0.3, member, Action::Crash));
        let restarts = [
            (60, 0.6, all[0], in_epoch),
            (64, 0.6, all[1], Action::RestartInEpoch { epoch: 7 }),
            (60, 0.8, all[2], Action::Restart),
        ];
        quiet(&[crashes, restarts].concat());
    }
}

/// The only holder of a state is stopped while the others start cold in an epoch before its own: what it knows is history.
#[test]
fn a_state_from_a_later_epoch_is_not_newer_for_it() {
    let all = [0, 1, 2].map(|rank| Member::Station(StationId(rank)));
    let early = Action::RestartInEpoch { epoch: 0 };
    quiet(&[
        (50, 0.3, all[2], Action::Stop),
        (50, 0.4, all[0], Action::Crash),
        (50, 0.4, all[1], Action::Crash),
        (55, 0.0, all[0], early),
        (55, 0.2, all[1], early),
        (120, 0.0, all[2], Action::Continue),
        (130, 0.0, ROBOT_IO, Action::Crash),
        (131, 0.0, ROBOT_IO, Action::Restart),
    ]);
}

/// A state that is corrupted while it is computed in shadow never speaks.
#[test]
fn a_fault_in_shadow_is_found_in_shadow() {
    for member in [ROBOT, UNDERSTUDY] {
        for cycle in 60..70 {
            for bit in 0..8 {
                let program = ProgramId(0);
                let outcome = quiet(&[
                    (50, 0.0, member, Action::Crash),
                    (60, 0.0, member, Action::Restart),
                    (cycle, 0.8, member, Action::FlipState { program, bit }),
                    (100, 0.0, ROBOT_IO, Action::Release),
                    (101, 0.0, member, Action::Crash),
                    (101, 0.1, member, Action::Restart),
                    (120, 0.0, ROBOT_IO, Action::Release),
                ]);
                // Later it speaks, and is found by comparison with the others.
                if cycle < 63 {
                    assert_eq!(untrue(&outcome), 0, "{member:?}, cycle {cycle}, bit {bit}");
                }
            }
        }
    }
}

/// A remote I/O whose samples are changed on their way, and which loses its history meanwhile: what nobody has sampled is no
/// state of any program.
#[test]
fn a_changed_sample_is_no_history() {
    for member in MEMBERS {
        for frames in [1, 3, 10, 30] {
            for restarted in [51, 52, 55] {
                let flip = Action::FlipSample { bit: 0, frames };
                quiet(&[
                    (50, 0.0, member, flip),
                    (restarted, 0.4, ROBOT_IO, Action::Crash),
                    (restarted, 0.5, ROBOT_IO, Action::Restart),
                ]);
            }
        }
    }
}

/// After a cold start the operator releases the outputs, and nobody else.
#[test]
fn a_cold_start_waits_for_the_operator() {
    let mut parts = press_cell::parts(Mode::Full, 1);
    for settings in &mut parts.remote_ios {
        settings.fallback.release = understudy_remote_io::Release::Operator;
    }
    let mut simulation = Simulation::new(parts, Network::default(), 1);
    let nobody = simulation.run(1, 100, &mut |_, _, _, _| {});
    assert!(nobody.is_err(), "nothing is driven directly yet");
    assert!(!simulation.tallies().is_empty());
    assert!(simulation.tallies().iter().all(|it| it.fail_safe > 90 && it.direct == 0));
}
