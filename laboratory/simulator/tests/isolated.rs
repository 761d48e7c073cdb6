//! What an isolated station knows of another one ends with its isolation: the other one may have proved newer outputs meanwhile, and have lost its
//! memory together with the remote I/O. The operator is asked then, and the program does not go back.

mod press_cell;

use understudy_cycle::Mode;
use understudy_simulator::{Action, Fault, Network, Simulation};
use understudy_wire::Member;

/// When something happens: a cycle, and the part of it that has passed.
type At = (u64, f64);

struct Cell {
    simulation: Simulation,
}

impl Cell {
    fn new(seed: u64) -> Self {
        let parts = press_cell::parts(Mode::Full, 1);
        Self { simulation: Simulation::new(parts, Network::default(), seed) }
    }

    fn fault(&mut self, (at_cycle, phase): At, member: Member, action: Action) {
        self.simulation.schedule(Fault { at_cycle, phase, member, action });
    }

    /// Both ways between two members.
    fn cut(&mut self, from: At, until: At, one: Member, other: Member) {
        for (member, to) in [(one, other), (other, one)] {
            self.fault(from, member, Action::Cut { to });
            self.fault(until, member, Action::Heal { to });
        }
    }

    fn isolate(&mut self, from: At, until: At, member: Member) {
        for other in press_cell::MEMBERS.into_iter().filter(|other| *other != member) {
            self.cut(from, until, member, other);
        }
    }

    fn restart(&mut self, at: At, member: Member) {
        self.fault(at, member, Action::Crash);
        self.fault(at, member, Action::Restart);
    }

    fn runs_without_going_back(mut self, what: &str) {
        self.simulation.run(160, 100, &mut |_, _, _, _| {}).expect("the cluster gets ready");
        assert_eq!(self.simulation.violations(), [], "{what}");
    }
}

/// Program, one of its stations, and the other one.
fn holders() -> impl Iterator<Item = (Member, Member, Member)> {
    [0, 1].into_iter().flat_map(|program| {
        let own = press_cell::MEMBERS[program];
        let remote_io = press_cell::MEMBERS[3 + program];
        [(remote_io, own, press_cell::MEMBERS[2]), (remote_io, press_cell::MEMBERS[2], own)]
    })
}

/// A station that its remote I/O has not received for long follows the samples that others relay, so it is not gone.
#[test]
fn a_station_that_follows_relayed_samples_is_not_gone() {
    for (remote_io, deaf, isolated) in holders() {
        for (heals, length, phase) in [0.0, 0.1, 0.6, 0.7]
            .into_iter()
            .flat_map(|heals| [1, 2, 4].map(|length| (heals, length)))
            .flat_map(|(heals, length)| [0.0, 0.3, 0.7].map(|phase| (heals, length, phase)))
        {
            for begins in [20, 21, 22] {
                let mut cell = Cell::new(7);
                cell.cut((5, 0.0), (20, heals), remote_io, deaf);
                let ends = (begins + length, phase);
                cell.isolate((begins, phase), ends, isolated);
                cell.restart((ends.0, 0.9), remote_io);
                cell.restart((ends.0, 0.9), deaf);
                let what = format!(
                    "{deaf:?} heals at {heals}, {isolated:?} from {begins} {phase} for {length}"
                );
                cell.runs_without_going_back(&what);
            }
        }
    }
}

/// A station was heard while the remote I/O was silent, with a state that was no newer; then the remote I/O goes on with it alone.
#[test]
fn what_was_heard_before_an_isolation_counts_no_more() {
    for (remote_io, alone, isolated) in holders() {
        for (begins, length, phase) in (21..27)
            .flat_map(|begins| [1, 2, 4, 7].map(|length| (begins, length)))
            .flat_map(|(begins, length)| [0.0, 0.6, 0.8].map(|phase| (begins, length, phase)))
        {
            let mut cell = Cell::new(3);
            cell.restart((20, 0.0), remote_io);
            let ends = (begins + length, phase);
            cell.isolate((begins, phase), ends, isolated);
            cell.restart((ends.0, 0.9), remote_io);
            cell.restart((ends.0, 0.9), alone);
            let what = format!("{isolated:?} from {begins} {phase} for {length}");
            cell.runs_without_going_back(&what);
        }
    }
}

/// A station was gone when another one was isolated; then the program started cold with it.
#[test]
fn a_station_that_was_gone_may_have_started_cold_since() {
    for (remote_io, gone, isolated) in holders() {
        for (length, phase) in (16..40).flat_map(|length| [0.0, 0.7].map(|phase| (length, phase))) {
            let mut cell = Cell::new(11);
            cell.fault((20, 0.8), gone, Action::Crash);
            cell.fault((31, 0.8), gone, Action::Restart);
            let ends = (32 + length, phase);
            cell.isolate((32, 0.7), ends, isolated);
            cell.restart((ends.0, 0.9), remote_io);
            cell.restart((ends.0, 0.9), gone);
            cell.runs_without_going_back(&format!("{isolated:?} for {length} {phase}"));
        }
    }
}
