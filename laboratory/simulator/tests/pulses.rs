//! Pulses while the remote I/O restarts: the program sees one pulse, and it is never longer than it is declared.

use proptest::prelude::*;
use understudy_cluster::read;
use understudy_cycle::RemoteIoInput;
use understudy_remote_io::Event;
use understudy_simulator::{Action, Fault, Network, Parts, Record, Simulation, Violation, parts};
use understudy_wire::{Image, Member, ProgramId, Role, StationId, Write, WriteId};

const CLUSTER: &str = r#"
[cluster]
name = "pulses"

[[controller]]
name = "counter"
ladder = "counter.st"

[[remote_io]]
controller = "counter"

[remote_io.inputs]
press = { operator = "pulse", duration = "200ms" }
"#;

/// Counts the scans of a pulse, and the pulses.
const COUNTER: &str = "
PROGRAM counter
  VAR_INPUT press : BOOL; END_VAR
  VAR_OUTPUT scans : REAL; pulses : REAL; END_VAR
  VAR edge : R_TRIG; END_VAR
  edge(CLK := press);
  IF press THEN scans := scans + 1.0; END_IF;
  IF edge.Q THEN pulses := pulses + 1.0; END_IF;
END_PROGRAM";

const PROGRAM: ProgramId = ProgramId(0);
const REMOTE_IO: Member = Member::RemoteIo(PROGRAM);
/// Scans of the declared duration.
const SCANS: f32 = 20.0;

fn cluster() -> Parts {
    let loaded = read("cluster.toml", CLUSTER, &mut |_| Ok(COUNTER.to_owned()));
    let cluster = loaded.cluster.unwrap_or_else(|| panic!("{:?}", loaded.reports));
    parts(&cluster)
}

/// A REAL in an image.
fn real_at(image: &Image, bit: usize) -> f32 {
    let bits = (0..32).map(|at| u32::from(image.get(bit + at)) << at);
    f32::from_bits(bits.sum::<u32>())
}

struct Bench {
    simulation: Simulation,
    outputs: Option<Image>,
    cold_starts: u32,
    cycle: u64,
}

impl Bench {
    fn new(network: Network, seed: u64) -> Self {
        let mut simulation = Simulation::new(cluster(), network, seed);
        simulation.run(3, 200, &mut |_, _, _, _| {}).expect("it gets ready");
        Self { simulation, outputs: None, cold_starts: 0, cycle: 3 }
    }

    fn pass(&mut self, cycles: u64) {
        let Self { simulation, outputs, cold_starts, cycle } = self;
        *cycle += cycles;
        let mut observe = |_, _, _, record: Record<'_>| match record {
            Record::RemoteIo(Event::Applied { outputs: y, missing: None, .. }) => {
                *outputs = Some(y.clone());
            }
            Record::RemoteIo(Event::StartedCold { .. }) => *cold_starts += 1,
            _ => {}
        };
        simulation.go_on(*cycle, &mut observe, &mut || false);
    }

    fn press(&mut self, number: u32) {
        let write = Write {
            id: WriteId { session: 1, number },
            input: 0,
            value: true.into(),
            role: Role::Operator,
            owner: "anna".to_owned(),
            reason: "a test".to_owned(),
            points: None,
        };
        self.simulation.order(PROGRAM, RemoteIoInput::Write(&write), &mut |_, _, _, _| {});
    }

    fn fault(&mut self, member: Member, action: Action, phase: f64) {
        let at_cycle = self.cycle;
        self.simulation.schedule(Fault { at_cycle, phase, member, action });
    }

    fn scans_and_pulses(&self) -> (f32, f32) {
        let outputs = self.outputs.as_ref().expect("applied");
        (real_at(outputs, 0), real_at(outputs, 32))
    }
}

#[test]
fn a_pulse_continues_where_its_remote_io_restarts() {
    for phase in [0.0, 0.1, 0.2, 0.4, 0.6, 0.66, 0.9] {
        for age in 1..24 {
            for (away, restarts) in [(1, 1), (3, 8), (40, 2)] {
                let mut bench = Bench::new(Network::default(), 1);
                bench.press(1);
                bench.pass(age);
                for _ in 0..restarts {
                    bench.fault(REMOTE_IO, Action::Crash, phase);
                    bench.pass(away);
                    bench.fault(REMOTE_IO, Action::Restart, phase);
                    bench.pass(8);
                }
                bench.pass(60);
                let seen = bench.scans_and_pulses();
                let context = format!("phase {phase}, age {age}, {restarts} times {away} cycles");
                assert_eq!((seen, bench.cold_starts), ((SCANS, 1.0), 0), "{context}");
                // The next one is as long.
                bench.press(2);
                bench.pass(40);
                assert_eq!(bench.scans_and_pulses(), (2.0 * SCANS, 2.0), "{context}");
            }
        }
    }
}

/// Its former life may have proved outputs that no other station knows of: a question is not needless then.
#[test]
fn a_station_that_is_restarted_while_it_runs_has_lost_its_memory() {
    let mut bench = Bench::new(Network::default(), 0);
    bench.press(1);
    let station = Member::Station(StationId(0));
    bench.fault(station, Action::Crash, 0.68);
    bench.pass(1);
    bench.fault(station, Action::Restart, 0.68);
    bench.pass(3);
    bench.fault(station, Action::Restart, 0.0);
    bench.fault(REMOTE_IO, Action::Crash, 0.0);
    bench.pass(1);
    bench.fault(REMOTE_IO, Action::Restart, 0.0);
    bench.pass(120);
    assert_eq!(bench.simulation.violations(), []);
}

fn arbitrary_fault() -> impl Strategy<Value = (Member, Action, Action)> {
    let station = (0..2_u8).prop_map(|rank| Member::Station(StationId(rank)));
    let killed = prop_oneof![2 => Just(REMOTE_IO), 1 => station.clone()]
        .prop_map(|member| (member, Action::Crash, Action::Restart));
    let deaf = station.prop_map(|to| (REMOTE_IO, Action::Cut { to }, Action::Heal { to }));
    let suspended = Just((REMOTE_IO, Action::Stop, Action::Continue));
    prop_oneof![killed, deaf, suspended]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, ..ProptestConfig::default() })]

    /// Faults of all kinds during one pulse, also where a station takes the state of another one without having received
    /// the samples in it.
    #[test]
    fn no_pulse_is_longer_than_declared(
        faults in prop::collection::vec((arbitrary_fault(), 0.0..1.0_f64, 1..30_u64, 0..20_u64), 1..8),
        loss in prop_oneof![Just(0.0), Just(0.2)],
        seed in any::<u64>(),
    ) {
        let mut bench = Bench::new(Network { loss, ..Network::default() }, seed);
        bench.press(1);
        for ((member, fault, repair), phase, cycles, pause) in faults {
            bench.fault(member, fault, phase);
            bench.pass(cycles);
            bench.fault(member, repair, phase);
            bench.pass(pause);
        }
        bench.pass(120);
        // A station that receives nothing for one cycle, by chance, cannot tell what the others have done in it.
        let is_by_chance = |it: &&Violation| {
            loss > 0.0 && matches!(it, Violation::NeedlessQuestion { .. })
        };
        let mut violations = bench.simulation.violations().iter();
        prop_assert_eq!(violations.find(|it| !is_by_chance(it)), None);
        if bench.cold_starts == 0 && let Some(outputs) = &bench.outputs {
            let (scans, pulses) = (real_at(outputs, 0), real_at(outputs, 32));
            prop_assert!(scans <= SCANS && pulses <= 1.0, "{scans} scans, {pulses} pulses");
        }
    }
}
