//! Every cut of the four-station cluster, one-way and full, from 1 to 1000 cycles, then healed.
//!
//! Nothing wrong is driven; a program whose remote I/O and a station that can compute it hear each other loses one cycle at
//! most, on whichever side of the cut they are; no program starts from its initial state again (it goes on from a state that its plant has seen:
//! the referee sees to that), and protection comes back without help.

mod press_cell;

use understudy_cycle::{Mode, Turns};
use understudy_remote_io::Event;
use understudy_simulator::{Action, Fault, Network, Record, Simulation};
use understudy_wire::{Member, ProgramId, StationId};

const PROGRAMS: usize = 3;
const STATIONS: usize = 4;
const MEMBERS: usize = STATIONS + PROGRAMS;

/// Within the history of a sample, around it, around every other limit of the protocol, and far beyond all.
const LENGTHS: [u64; 8] = [1, 2, 3, 5, 8, 13, 30, 100];

/// The longest ones take long; each cut gets one of these.
const LONGEST: [u64; 4] = [200, 400, 700, 1000];

/// Cycles after which everybody is synchronised again, at most.
const RECOVERY: u64 = 100;

fn member(place: usize) -> Member {
    match place.checked_sub(STATIONS) {
        None => Member::Station(StationId(place as u8)),
        Some(program) => Member::RemoteIo(ProgramId(program as u8)),
    }
}

/// Which frames do not arrive: from each member, the set of those who do not hear it.
type Cut = [u8; MEMBERS];

/// Both ways between the members of `side` and all others.
fn full(side: u8) -> Cut {
    std::array::from_fn(|place| if side >> place & 1 == 1 { !side } else { side })
}

/// The members of `side` are heard by no others, and hear them.
fn mute(side: u8) -> Cut {
    std::array::from_fn(|place| if side >> place & 1 == 1 { !side } else { 0 })
}

/// The links that `before` and `after` do not agree on change at a cycle.
fn change(simulation: &mut Simulation, at_cycle: u64, before: Cut, after: Cut) {
    for from in 0..MEMBERS {
        for to in (0..MEMBERS).filter(|&to| to != from) {
            let [was, is] = [before, after].map(|cut| cut[from] >> to & 1 == 1);
            if was == is {
                continue;
            }
            let to = member(to);
            simulation.schedule(Fault {
                at_cycle,
                // Somewhere else in the cycle for each length.
                phase: at_cycle as f64 * 0.37 % 1.0,
                member: member(from),
                action: if is { Action::Cut { to } } else { Action::Heal { to } },
            });
        }
    }
}

fn check(cut: Cut, seed: u64) {
    let longest = LONGEST[seed as usize % LONGEST.len()];
    for length in LENGTHS.into_iter().chain([longest]) {
        let parts = press_cell::line(PROGRAMS, Mode::Full, STATIONS - PROGRAMS);
        let mut simulation = Simulation::new(parts, Network::default(), seed);
        let at = 5 + seed % 7;
        change(&mut simulation, at, [0; MEMBERS], cut);
        change(&mut simulation, at + length, cut, [0; MEMBERS]);
        let mut cold = 0;
        let mut observe = |_, cycle: Option<u64>, _, record: Record<'_>| {
            let starts = matches!(record, Record::RemoteIo(Event::StartedCold { .. }));
            cold += u64::from(starts && cycle.is_some());
        };
        simulation.run(at + length + 1, 100, &mut observe).expect("the cluster gets ready");
        let what = format!("cut {cut:x?} for {length} cycles");
        for program in 0..PROGRAMS {
            let tally = &simulation.tallies()[program];
            let untrue = tally.held + tally.fail_safe;
            if served(&cut, program) {
                assert!(untrue <= 1, "{what}: program {program}, {tally:?}");
            } else {
                assert!(untrue + 1 >= length, "{what}: program {program}, {tally:?}");
            }
        }
        let back = simulation.run(5, RECOVERY, &mut observe);
        assert_eq!(simulation.violations().first(), None, "{what}");
        assert_eq!(back, Ok(()), "{what}");
        assert_eq!(cold, 0, "{what}");
    }
}

/// Whether a station that can compute a program and its remote I/O hear each other.
fn served(cut: &Cut, program: usize) -> bool {
    let remote_io = STATIONS + program;
    let hear = |from: usize, to: usize| cut[from] >> to & 1 == 0;
    let holders = [program].into_iter().chain(PROGRAMS..STATIONS);
    let mut both_ways = holders.map(|station| hear(station, remote_io) && hear(remote_io, station));
    both_ways.any(|heard| heard)
}

#[test]
fn every_full_partition_heals() {
    // A side and its complement are one partition.
    for side in 1..1 << (MEMBERS - 1) {
        check(full(side), u64::from(side));
    }
}

#[test]
fn every_one_way_partition_heals() {
    for side in 1..(1 << MEMBERS) - 1 {
        check(mute(side), u64::from(side));
    }
}

/// One member does not hear one other.
#[test]
fn every_single_link_heals() {
    for from in 0..MEMBERS {
        for to in (0..MEMBERS).filter(|&to| to != from) {
            let mut cut = [0; MEMBERS];
            cut[from] = 1 << to;
            check(cut, (from * MEMBERS + to) as u64);
        }
    }
}

/// In a cell with few controllers only the cycle master sends soon: a remote I/O that does not receive it begins its cycles with the Sync of the next
/// rank.
#[test]
fn a_single_link_of_a_small_cell_costs_no_cycle() {
    for programs in 1..=3 {
        let stations = (0..=programs).map(|rank| Member::Station(StationId(rank as u8)));
        let remote_ios = (0..programs).map(|program| Member::RemoteIo(ProgramId(program as u8)));
        let members: Vec<Member> = stations.chain(remote_ios).collect();
        let links = members.iter().flat_map(|&from| members.iter().map(move |&to| (from, to)));
        let links = links.filter(|(from, to)| from != to);
        let cases = links.flat_map(|link| [Turns::Token, Turns::Parallel].map(|it| (link, it)));
        for (((from, to), turns), seed) in cases.flat_map(|it| (0..4).map(move |at| (it, at))) {
            for ways in [&[(from, to)][..], &[(from, to), (to, from)]] {
                let mut parts = press_cell::line(programs, Mode::Full, 1);
                press_cell::take_turns(&mut parts, turns);
                let mut simulation = Simulation::new(parts, Network::default(), seed);
                let phase = seed as f64 * 0.3;
                for &(member, to) in ways {
                    let cut = Fault { at_cycle: 20, phase, member, action: Action::Cut { to } };
                    simulation.schedule(cut);
                    let action = Action::Heal { to };
                    simulation.schedule(Fault { at_cycle: 60, action, ..cut });
                }
                simulation.run(100, 100, &mut |_, _, _, _| {}).expect("the cluster gets ready");
                let what = format!("{programs} programs, {ways:?}, {turns:?} at {phase}");
                assert_eq!(simulation.violations(), [], "{what}");
                for tally in simulation.tallies() {
                    assert_eq!(tally.held + tally.fail_safe, 0, "{what}");
                }
            }
        }
    }
}
