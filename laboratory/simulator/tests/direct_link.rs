//! A cable between the two remote I/Os of each program, apart from the networks: what it masks, and that it harms nothing.

mod press_cell;

use press_cell::{Gap, WIRINGS, Wire, fault};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use understudy_cycle::Mode;
use understudy_remote_io::{Event, PartnerLack};
use understudy_simulator::{Action, Fault, Network, Parts, Record, Simulation};
use understudy_wire::{Member, ProgramId, ProgramSet, StationId, Time, Via};

const ROBOT: ProgramId = ProgramId(0);
const FIRST: Member = Member::RemoteIo(ROBOT);
const TWIN: Member = Member::Twin(ROBOT);

fn parts(wire: Wire, take_over_after: u32, is_linked: bool) -> Parts {
    let mut parts = press_cell::parts(Mode::Full, 1);
    wire(&mut parts, take_over_after);
    parts.has_two_networks = true;
    parts.direct_links = if is_linked { ProgramSet::first(2) } else { ProgramSet::EMPTY };
    parts
}

/// Both networks fail between the two remote I/Os of the robot.
fn cut_between(at_cycle: u64, phase: f64) -> Vec<Fault> {
    vec![
        fault(at_cycle, phase, FIRST, Action::Cut { to: TWIN }),
        fault(at_cycle, phase, TWIN, Action::Cut { to: FIRST }),
    ]
}

/// What came of a run.
struct Outcome {
    simulation: Simulation,
    /// Periods in which the outputs of the robot were not driven, in a row, and deadlines at which nothing was proved.
    held: u64,
    /// Why the other one could not take over, as the two remote I/Os report, the first report first.
    partner_lost: Vec<PartnerLack>,
}

fn run(parts: Parts, faults: &[Fault], cycles: u64) -> Outcome {
    let mut simulation = Simulation::new(parts, Network::default(), 1);
    for fault in faults {
        simulation.schedule(*fault);
    }
    let (mut gap, mut partner_lost) = (Gap::default(), Vec::new());
    let mut observe = |now: Time, cycle: Option<u64>, member: Member, record: Record<'_>| match (
        cycle, member, record,
    ) {
        (Some(_), Member::Plant(ROBOT), Record::Plant(..)) => {
            gap.driven(now);
        }
        (Some(_), FIRST | TWIN, Record::RemoteIo(Event::PartnerLost { lack, .. })) => {
            partner_lost.push(*lack);
        }
        _ => {}
    };
    simulation.run(0, 200, &mut observe).expect("the cluster gets ready");
    simulation.go_to(cycles, 0.0, &mut observe);
    assert_eq!(simulation.violations(), []);
    let gap = u64::from(gap.periods_until(simulation.now()));
    let tally = &simulation.tallies()[ROBOT.index()];
    let held = gap + tally.held + tally.fail_safe;
    Outcome { simulation, held, partner_lost }
}

/// Over the link the two receive each other while the networks between them are cut; without it each reports that it does not.
#[test]
fn the_two_receive_each_other_while_the_networks_between_them_are_cut() {
    for wire in WIRINGS {
        for tenth in 0..10 {
            let faults = cut_between(100, f64::from(tenth) / 10.0);
            for is_linked in [false, true] {
                let outcome = run(parts(wire, 1, is_linked), &faults, 300);
                assert_eq!(outcome.held, 0, "{is_linked} {tenth}");
                assert_eq!(outcome.simulation.author(ROBOT), Some(FIRST));
                assert_eq!(outcome.partner_lost.is_empty(), is_linked, "{is_linked} {tenth}");
            }
        }
    }
}

/// The networks between the two are cut, then a controller ends, then the author. Over the link the follower knows from the author that nothing is lost with
/// the controller, and takes over as if the networks were in order; without it an operator must decide.
#[test]
fn a_follower_on_the_link_takes_over_after_a_cut() {
    for wire in WIRINGS {
        for after in 1..=3 {
            for tenth in 0..10 {
                let phase = f64::from(tenth) / 10.0;
                let mut faults = cut_between(100, phase);
                faults.push(fault(150, phase, Member::Station(StationId(0)), Action::Crash));
                faults.push(fault(200, phase, FIRST, Action::Crash));
                let linked = run(parts(wire, after, true), &faults, 400);
                assert_eq!(linked.simulation.author(ROBOT), Some(TWIN), "{after} {phase}");
                assert!(linked.held <= u64::from(after) + 1, "{after} {phase}: {}", linked.held);
                let unlinked = run(parts(wire, after, false), &faults, 400);
                assert_eq!(unlinked.simulation.author(ROBOT), None, "{after} {phase}");
                assert!(unlinked.simulation.asking().contains(ROBOT), "{after} {phase}");
            }
        }
    }
}

/// The author loses all stations, and the follower still receives it: over the link, where the cables to both networks are pulled, or over the networks. The
/// author gives the outputs to the follower.
#[test]
fn an_author_without_stations_gives_the_outputs_to_the_follower() {
    for wire in WIRINGS {
        for after in 1..=3 {
            for tenth in 0..10 {
                let phase = f64::from(tenth) / 10.0;
                let pulled = Via::NETWORKS
                    .map(|network| fault(100, phase, FIRST, Action::Unplug { network }))
                    .to_vec();
                let cut = (0..3).map(|rank| Member::Station(StationId(rank))).flat_map(|station| {
                    let forth = fault(100, phase, FIRST, Action::Cut { to: station });
                    [forth, fault(100, phase, station, Action::Cut { to: FIRST })]
                });
                for (is_linked, faults) in [(true, pulled), (false, cut.collect())] {
                    let outcome = run(parts(wire, after, is_linked), &faults, 300);
                    let what = format!("{after} {phase} {is_linked}: {}", outcome.held);
                    assert_eq!(outcome.simulation.author(ROBOT), Some(TWIN), "{what}");
                    assert!(outcome.held <= u64::from(2 * after) + 1, "{what}");
                }
            }
        }
    }
}

/// The author loses all stations, the follower takes over, and is suspended or restarted: it drives again, though it receives the other one, which receives
/// no station.
#[test]
fn one_that_receives_no_station_does_not_keep_the_other_one_from_driving() {
    for (wire, isolated) in WIRINGS.into_iter().flat_map(|wire| [FIRST, TWIN].map(|it| (wire, it)))
    {
        let healthy = if isolated == FIRST { TWIN } else { FIRST };
        for after in 1..=3 {
            for tenth in 0..10 {
                let phase = f64::from(tenth) / 10.0;
                let pulled = Via::NETWORKS
                    .map(|network| fault(100, phase, isolated, Action::Unplug { network }));
                for (begins, ends) in
                    [(Action::Stop, Action::Continue), (Action::Crash, Action::Restart)]
                {
                    for lasts in [1, 2, 5, 30] {
                        let mut faults = pulled.to_vec();
                        faults.push(fault(200, phase, healthy, begins));
                        faults.push(fault(200 + lasts, phase, healthy, ends));
                        let outcome = run(parts(wire, after, true), &faults, 400);
                        let what = format!("{isolated:?} {after} {phase} {begins:?} {lasts}");
                        let author = outcome.simulation.author(ROBOT);
                        assert_eq!(author, Some(healthy), "{what}");
                        let bound = lasts + 10 * u64::from(after) + 40;
                        assert!(outcome.held <= bound, "{what}: {}", outcome.held);
                    }
                }
            }
        }
    }
}

/// The link fails and comes back: no cycle is lost.
#[test]
fn a_link_that_fails_costs_no_cycle() {
    let network = Via::Link;
    for wire in WIRINGS {
        for member in [FIRST, TWIN] {
            let faults = [
                fault(100, 0.3, member, Action::Unplug { network }),
                fault(200, 0.6, member, Action::Plug { network }),
            ];
            let outcome = run(parts(wire, 1, true), &faults, 300);
            assert_eq!((outcome.held, outcome.partner_lost.len()), (0, 0));
            assert_eq!(outcome.simulation.author(ROBOT), Some(FIRST));
        }
    }
    // Pulled, it carries nothing.
    for member in [FIRST, TWIN] {
        let mut faults = cut_between(100, 0.3);
        faults.push(fault(100, 0.3, member, Action::Unplug { network }));
        let outcome = run(parts(press_cell::pair, 1, true), &faults, 300);
        assert_eq!(outcome.partner_lost.len(), 2);
    }
}

/// The follower loses all networks, and the author receives it over the link: it could not take over, and the author says so, once, until it can again.
#[test]
fn a_follower_that_receives_no_station_is_reported_as_lost() {
    for wire in WIRINGS {
        for tenth in 0..10 {
            let phase = f64::from(tenth) / 10.0;
            let network = |network| fault(100, phase, TWIN, Action::Unplug { network });
            let mut faults = Via::NETWORKS.map(network).to_vec();
            let outcome = run(parts(wire, 1, true), &faults, 300);
            assert_eq!((outcome.held, outcome.partner_lost), (0, vec![PartnerLack::Stations]));
            let network = |network| fault(200, phase, TWIN, Action::Plug { network });
            faults.extend(Via::NETWORKS.map(network));
            faults.push(fault(300, phase, FIRST, Action::Crash));
            let outcome = run(parts(wire, 1, true), &faults, 400);
            assert!(outcome.held <= 2, "{phase}: {}", outcome.held);
            assert_eq!(outcome.partner_lost, [PartnerLack::Stations, PartnerLack::Silent]);
            assert_eq!(outcome.simulation.author(ROBOT), Some(TWIN), "{phase}");
        }
    }
}

/// Members fail, cables are pulled and networks are cut between members, by chance: nothing wrong is driven, and two never drive at one time.
#[test]
fn nothing_wrong_is_driven_whatever_fails() {
    let mut random = Pcg64Mcg::seed_from_u64(36);
    let members = [
        Member::Station(StationId(0)),
        Member::Station(StationId(1)),
        Member::Station(StationId(2)),
        FIRST,
        TWIN,
    ];
    for number in 0..200 {
        let wire = WIRINGS[number % 2];
        let mut faults = Vec::new();
        for _ in 0..4 {
            let member = members[random.random_range(0..members.len())];
            let (from, lasts) = (random.random_range(50..150), random.random_range(1..60));
            let phase = f64::from(random.random_range(0..10)) / 10.0;
            let to = members[random.random_range(0..members.len())];
            let network = Via::ALL[random.random_range(0..3)];
            let (begins, ends) = match random.random_range(0..4) {
                0 => (Action::Crash, Action::Restart),
                1 => (Action::Stop, Action::Continue),
                2 if to != member => (Action::Cut { to }, Action::Heal { to }),
                _ => (Action::Unplug { network }, Action::Plug { network }),
            };
            faults.push(fault(from, phase, member, begins));
            faults.push(fault(from + lasts, phase, member, ends));
        }
        let mut parts = parts(wire, random.random_range(1..=3), true);
        parts.has_two_networks = random.random();
        let outcome = run(parts, &faults, 300);
        assert_eq!(outcome.simulation.violations(), [], "{number}: {faults:?}");
    }
}
