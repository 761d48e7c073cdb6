//! Whole runs are functions of their parts, faults and seed: the digest of all their records is known.
//!
//! A digest that differs after a change of the protocol is expected, and is then replaced here. One that differs after a change of the
//! simulator's or a member's implementation alone is a defect.

mod press_cell;

use std::time::Duration;

use understudy_cycle::Mode;
use understudy_simulator::{Action, Disturbance, Fault, Network, Simulation};
use understudy_wire::{Member, ProgramId, StationId};

const CONTROLLER: Member = Member::Station(StationId(0));
const REMOTE_IO: Member = Member::RemoteIo(ProgramId(1));

/// FNV-1a, which is the same in every version of the compiler.
struct Digest(u64);

impl Digest {
    fn take(&mut self, text: &str) {
        for byte in text.bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}

/// Faults of each kind that members and links have, one after another.
fn faults() -> Vec<Fault> {
    let understudy = Member::Station(StationId(3));
    let by = Duration::from_millis(3);
    let on_time = Duration::ZERO;
    let actions = [
        (CONTROLLER, Action::Crash),
        (CONTROLLER, Action::Restart),
        (understudy, Action::Stop),
        (understudy, Action::Continue),
        (CONTROLLER, Action::Cut { to: REMOTE_IO }),
        (CONTROLLER, Action::Heal { to: REMOTE_IO }),
        (REMOTE_IO, Action::Cut { to: understudy }),
        (REMOTE_IO, Action::Heal { to: understudy }),
        (CONTROLLER, Action::Slow { by }),
        (CONTROLLER, Action::Slow { by: on_time }),
        (understudy, Action::Corrupt { frames: 3 }),
        (REMOTE_IO, Action::Replay { age: 9 }),
        (understudy, Action::Forge),
        (CONTROLLER, Action::FlipWord { bit: 1, frames: 1 }),
        (REMOTE_IO, Action::FlipSample { bit: 0, frames: 1 }),
        (REMOTE_IO, Action::Crash),
        (REMOTE_IO, Action::Restart),
    ];
    let scheduled = (0..).zip(actions).map(|(place, (member, action))| Fault {
        at_cycle: 20 + 12 * place,
        phase: place as f64 / 17.0,
        member,
        action,
    });
    scheduled.collect()
}

fn check(programs: usize, mode: Mode, network: Network, faults: &[Fault], expected: u64) {
    let mut simulation =
        Simulation::new(press_cell::line(programs, mode, 1), Network::default(), 7);
    simulation.disturb(Disturbance { network, cycles: Some(40..200) });
    for fault in faults {
        simulation.schedule(*fault);
    }
    let mut digest = Digest(0xcbf2_9ce4_8422_2325);
    simulation
        .run(260, 1000, &mut |time, cycle, member, record| {
            digest.take(&format!("{time:?} {cycle:?} {member:?} {record:?}\n"));
        })
        .expect("the cluster gets ready");
    digest.take(&format!("{:?}", simulation.tallies()));
    assert_eq!(digest.0, expected, "{programs} {mode:?}: {:#018x}", digest.0);
}

const QUIET: Duration = Duration::ZERO;

fn network(loss: f64, duplicate: f64, jitter: Duration) -> Network {
    Network { loss, duplicate, jitter, corruption: loss / 2.0, ..Network::default() }
}

#[test]
fn undisturbed_runs_have_known_outcomes() {
    check(2, Mode::Full, network(0.0, 0.0, QUIET), &[], 0x8249_0fdc_7ccf_99c9);
    check(2, Mode::Paper, network(0.0, 0.0, QUIET), &[], 0xd7f4_ac38_cd36_6ff3);
    check(16, Mode::Full, network(0.0, 0.0, QUIET), &[], 0xd8f8_d5be_5e21_f2a3);
}

#[test]
fn faulty_runs_have_known_outcomes() {
    check(3, Mode::Full, network(0.0, 0.0, QUIET), &faults(), 0xa2d7_8c3c_98a7_c351);
    check(3, Mode::Paper, network(0.0, 0.0, QUIET), &faults(), 0x2338_a406_8540_9bb4);
}

#[test]
fn lossy_runs_have_known_outcomes() {
    let jitter = Duration::from_millis(2);
    check(3, Mode::Full, network(0.1, 0.1, jitter), &[], 0x2d8b_0e0a_f154_cc3a);
    check(8, Mode::Full, network(0.05, 0.1, jitter), &faults(), 0x4ab3_2692_afb6_87f3);
}
