//! Writes of operators while members are killed, cut off and restarted: each has exactly one effect, or an answer that it had none.

use std::collections::BTreeMap;

use proptest::prelude::*;
use understudy_cluster::read;
use understudy_cycle::RemoteIoInput;
use understudy_remote_io::{Event, OldInputs};
use understudy_simulator::{Action, Fault, Network, Parts, Record, Simulation, parts};
use understudy_wire::{
    Image, Member, PointValue, ProgramId, Role, StateChoice, StationId, Write, WriteId,
    WriteOutcome, WriteRefusal,
};

const CLUSTER: &str = r#"
[cluster]
name = "writes"

[[controller]]
name = "counter"
ladder = "counter.st"

[[controller]]
name = "reader"
ladder = "reader.st"

[[remote_io]]
controller = "counter"

[remote_io.inputs]
press = { operator = "pulse", duration = "30ms" }
value = { operator = "setpoint", low = -5.0, high = 30000.0, initial = 7.0 }
service = { operator = "level", role = "engineer" }

[[remote_io]]
controller = "reader"

[remote_io.inputs]
count = { from = "counter.count", default = -1.0, stale_after = 2 }
far = { from = "line-9/press.level", default = -2.0, stale_after = 100 }
"#;

const COUNTER: &str = "
PROGRAM counter
  VAR_INPUT press : BOOL; value : REAL; service : BOOL; END_VAR
  VAR_OUTPUT count : REAL; echo : REAL; END_VAR
  VAR edge : R_TRIG; END_VAR
  edge(CLK := press);
  IF edge.Q THEN count := count + 1.0; END_IF;
  echo := value;
END_PROGRAM";

const READER: &str = "
PROGRAM reader
  VAR_INPUT count : REAL; far : REAL; END_VAR
  VAR_OUTPUT seen : REAL; far_seen : REAL; END_VAR
  seen := count;
  far_seen := far;
END_PROGRAM";

const PROGRAM: ProgramId = ProgramId(0);
const READER_PROGRAM: ProgramId = ProgramId(1);
/// The controllers and the understudy that the cluster has by itself.
const STATIONS: [StationId; 3] = [StationId(0), StationId(1), StationId(2)];
/// First bit of the signal of another group.
const FAR: u16 = 32;
/// First bits of the inputs.
const PRESS: u16 = 0;
const VALUE: u16 = 32;
const SERVICE: u16 = 64;
/// Cycles after which a caller asks again.
const PATIENCE: u64 = 12;

fn cluster() -> Parts {
    cluster_of(CLUSTER, COUNTER)
}

fn cluster_of(text: &str, counter: &str) -> Parts {
    let loaded = read("cluster.toml", text, &mut |name| match name {
        "counter.st" => Ok(counter.to_owned()),
        _ => Ok(READER.to_owned()),
    });
    let cluster = loaded.cluster.unwrap_or_else(|| panic!("{:?}", loaded.reports));
    parts(&cluster)
}

fn write(session: u64, number: u32, input: u16, value: PointValue) -> Write {
    Write {
        id: WriteId { session, number },
        input,
        value,
        role: Role::Operator,
        owner: "anna".to_owned(),
        reason: "a test".to_owned(),
        points: None,
    }
}

fn real(value: f32) -> PointValue {
    PointValue::new(32, u64::from(value.to_bits()))
}

/// A REAL in an image.
fn real_at(image: &Image, bit: usize) -> f32 {
    let bits = (0..32).map(|at| u32::from(image.get(bit + at)) << at);
    f32::from_bits(bits.sum::<u32>())
}

/// What is seen of a run.
#[derive(Default)]
struct Seen {
    /// The newest outcome of each write.
    outcomes: BTreeMap<WriteId, WriteOutcome>,
    /// y of the newest applied true output, by program.
    outputs: [Option<Image>; 2],
    cold_starts: u32,
    /// Warm starts of the first program.
    warm_starts: u32,
    /// What its questions and warm starts say of retained inputs.
    inputs: Vec<Option<OldInputs>>,
}

impl Seen {
    fn observe(&mut self, member: Member, record: Record<'_>) {
        let (Member::RemoteIo(program), Record::RemoteIo(event)) = (member, record) else {
            return;
        };
        let refused = |refusal| WriteOutcome::Refused { refusal };
        match event {
            Event::WriteInEffect { id, since, .. } => {
                let outcome = WriteOutcome::InEffect { since: *since };
                self.outcomes.insert(*id, outcome);
            }
            Event::WriteRefused { write, refusal, .. } => {
                self.outcomes.insert(write.id, refused(*refusal));
            }
            Event::WriteVoid { id, refusal, .. } => {
                self.outcomes.insert(*id, refused(*refusal));
            }
            Event::Applied { outputs, missing: None, .. } => {
                self.outputs[program.index()] = Some(outputs.clone())
            }
            Event::StartedCold { .. } => self.cold_starts += 1,
            Event::StartedWarm { inputs, .. } if member == Member::RemoteIo(PROGRAM) => {
                self.warm_starts += 1;
                self.inputs.push(*inputs);
            }
            Event::StateLost { inputs, .. } if member == Member::RemoteIo(PROGRAM) => {
                self.inputs.push(*inputs);
            }
            _ => {}
        }
    }
}

struct Bench {
    simulation: Simulation,
    seen: Seen,
    cycle: u64,
}

impl Bench {
    fn new(network: Network, seed: u64) -> Self {
        Self::of(cluster(), network, seed)
    }

    fn of(parts: Parts, network: Network, seed: u64) -> Self {
        let mut seen = Seen::default();
        let mut simulation = Simulation::new(parts, network, seed);
        let mut observe = |_, _, member, record: Record<'_>| seen.observe(member, record);
        simulation.run(3, 200, &mut observe).expect("it gets ready");
        // The first start.
        seen.cold_starts = 0;
        Self { simulation, seen, cycle: 3 }
    }

    fn pass(&mut self, cycles: u64) {
        let seen = &mut self.seen;
        let mut observe = |_, _, member, record: Record<'_>| seen.observe(member, record);
        self.cycle += cycles;
        self.simulation.go_on(self.cycle, &mut observe, &mut || false);
    }

    fn write(&mut self, write: &Write) {
        self.write_to(PROGRAM, write);
    }

    fn write_to(&mut self, program: ProgramId, write: &Write) {
        let seen = &mut self.seen;
        let mut observe = |_, _, member, record: Record<'_>| seen.observe(member, record);
        self.simulation.order(program, RemoteIoInput::Write(write), &mut observe);
    }

    fn far_seen(&self) -> f32 {
        real_at(self.seen.outputs[1].as_ref().expect("applied"), 32)
    }

    fn outcome(&self, write: &Write) -> Option<WriteOutcome> {
        self.seen.outcomes.get(&write.id).copied()
    }

    fn count(&self) -> f32 {
        real_at(self.seen.outputs[0].as_ref().expect("applied"), 0)
    }

    fn echo(&self) -> f32 {
        real_at(self.seen.outputs[0].as_ref().expect("applied"), 32)
    }

    /// All members fail and return.
    fn power_fails(&mut self) {
        let remote_ios = [PROGRAM, READER_PROGRAM].map(Member::RemoteIo);
        for action in [Action::Crash, Action::Restart] {
            for member in STATIONS.map(Member::Station).into_iter().chain(remote_ios) {
                self.fault(member, action);
            }
            self.pass(60);
            self.seen.outputs = [None, None];
        }
        self.pass(100);
    }

    fn fault(&mut self, member: Member, action: Action) {
        self.simulation.schedule(Fault { at_cycle: 0, phase: 0.0, member, action });
    }
}

fn is_in_effect(outcome: WriteOutcome) -> bool {
    matches!(outcome, WriteOutcome::InEffect { .. })
}

#[test]
fn a_write_is_in_effect_and_read_by_another_program() {
    let mut bench = Bench::new(Network::default(), 1);
    let press = write(1, 1, PRESS, true.into());
    bench.write(&press);
    bench.write(&write(2, 1, VALUE, real(-3.0)));
    bench.pass(2);
    let in_effect = |outcome| matches!(outcome, Some(WriteOutcome::InEffect { .. }));
    assert!(in_effect(bench.outcome(&press)), "{:?}", bench.seen.outcomes);
    assert_eq!((bench.count(), bench.echo()), (1.0, -3.0));
    bench.pass(2);
    let seen = bench.seen.outputs[1].as_ref().expect("applied");
    assert_eq!(real_at(seen, 0), 1.0, "the other program, a cycle later");
    // The same write again is answered, and has no second effect.
    bench.seen.outcomes.clear();
    bench.write(&press);
    bench.pass(8);
    assert!(in_effect(bench.outcome(&press)));
    assert_eq!(bench.count(), 1.0);
    // A pulse ends, and the next one counts.
    bench.write(&write(1, 2, PRESS, true.into()));
    bench.pass(8);
    assert_eq!(bench.count(), 2.0);
}

#[test]
fn a_signal_of_another_group_ends_where_nobody_writes_it_again() {
    let mut bench = Bench::new(Network::default(), 1);
    let far = |number, value| write(1, number, FAR, real(value));
    assert_eq!(bench.far_seen(), -2.0);
    bench.write_to(READER_PROGRAM, &far(1, 5.0));
    bench.pass(90);
    assert_eq!(bench.far_seen(), 5.0);
    // Written again before it ends, and with another value.
    bench.write_to(READER_PROGRAM, &far(2, 5.0));
    bench.pass(60);
    assert_eq!(bench.far_seen(), 5.0);
    bench.write_to(READER_PROGRAM, &far(3, 6.0));
    bench.pass(97);
    assert_eq!(bench.far_seen(), 6.0);
    bench.pass(6);
    assert_eq!(bench.far_seen(), -2.0);
    // A restart of the remote I/O ends it: nobody knows how old the value is.
    bench.write_to(READER_PROGRAM, &far(4, 7.0));
    bench.pass(10);
    assert_eq!(bench.far_seen(), 7.0);
    let reader = Member::RemoteIo(READER_PROGRAM);
    bench.fault(reader, Action::Crash);
    bench.pass(3);
    bench.fault(reader, Action::Restart);
    bench.pass(60);
    assert_eq!(bench.far_seen(), -2.0);
    assert_eq!(bench.seen.cold_starts, 0);
}

#[test]
fn what_is_wrong_is_refused_and_has_no_effect() {
    let mut bench = Bench::new(Network::default(), 1);
    let mut check = |write: Write, expected: WriteRefusal| {
        bench.write(&write);
        let refused = WriteOutcome::Refused { refusal: expected };
        assert_eq!(bench.outcome(&write), Some(refused), "{write:?}");
        bench.seen.outcomes.clear();
    };
    check(write(1, 1, VALUE, real(-6.0)), WriteRefusal::Limits);
    check(write(1, 1, VALUE, real(30_001.0)), WriteRefusal::Limits);
    check(write(1, 1, VALUE, true.into()), WriteRefusal::Type);
    check(write(1, 1, PRESS, real(1.0)), WriteRefusal::Type);
    check(write(1, 1, VALUE + 1, real(1.0)), WriteRefusal::NotWritable);
    let required = Role::Engineer;
    check(write(1, 1, SERVICE, true.into()), WriteRefusal::Role { required });
    check(write(1, 2, VALUE, real(1.0)), WriteRefusal::Order { expected: 1 });
    bench.write(&write(1, 1, VALUE, real(1.0)));
    let mut check = |write: Write, expected: WriteRefusal| {
        bench.write(&write);
        let refused = WriteOutcome::Refused { refusal: expected };
        assert_eq!(bench.outcome(&write), Some(refused), "{write:?}");
    };
    // One write of an input at a time, and none before the one before it is decided.
    check(write(2, 1, VALUE, real(2.0)), WriteRefusal::Busy);
    check(write(1, 2, PRESS, true.into()), WriteRefusal::Busy);
    check(write(1, 1, VALUE, real(2.0)), WriteRefusal::Order { expected: 2 });
    bench.pass(2);
    assert_eq!((bench.count(), bench.echo()), (0.0, 1.0));
}

#[test]
fn a_person_who_opens_many_sessions_locks_out_no_other_person() {
    let mut bench = Bench::new(Network::default(), 1);
    let of = |owner: &str, session| Write {
        owner: owner.to_owned(),
        ..write(session, 1, VALUE, real(session as f32))
    };
    let mut taken = 0;
    for session in 0..600 {
        bench.write(&of("anna", session));
        bench.pass(1);
        taken += u32::from(bench.outcome(&of("anna", session)).is_none_or(is_in_effect));
        // The first write, asked for again, has no second effect.
        if session % 100 == 50 {
            bench.write(&of("anna", 0));
            assert!(bench.outcome(&of("anna", 0)).is_some_and(is_in_effect));
            bench.pass(1);
            assert_eq!(bench.echo(), session.min(511) as f32);
        }
    }
    assert_eq!(taken, 512, "half of the sessions that are remembered");
    let check = |bench: &mut Bench, write: &Write| {
        bench.write(write);
        bench.pass(2);
        assert!(bench.outcome(write).is_some_and(is_in_effect), "{:?}", bench.outcome(write));
    };
    check(&mut bench, &of("ben", 10_000));
    assert_eq!(bench.echo(), 10_000.0);
    // Known sessions continue, and a minute later anna opens others again.
    check(&mut bench, &write(1, 2, PRESS, true.into()));
    bench.pass(6_000);
    check(&mut bench, &of("anna", 20_000));
}

/// An operator input with `retain` has its value after each start, warm or cold, and the newest one: not that of the note before.
#[test]
fn an_input_keeps_its_value_over_a_power_failure() {
    let retains = |line: &str| {
        let text = CLUSTER.replace("initial = 7.0", "initial = 7.0, retain = true");
        let text = text.replace("name = \"writes\"", "name = \"writes\"\nhistory = 2");
        text.replacen("controller = \"counter\"\n", &format!("controller = \"counter\"\n{line}"), 1)
    };
    let retentive = COUNTER.replace("VAR_OUTPUT", "VAR_OUTPUT RETAIN");
    for (line, warm) in [("restart = \"cold\"\n", false), ("", true)] {
        let parts = cluster_of(&retains(line), &retentive);
        let mut bench = Bench::of(parts, Network::default(), 1);
        bench.write(&write(1, 1, VALUE, real(-3.0)));
        bench.write(&write(2, 1, PRESS, true.into()));
        bench.pass(8);
        assert_eq!((bench.count(), bench.echo()), (1.0, -3.0));
        bench.power_fails();
        let count = if warm { 1.0 } else { 0.0 };
        assert_eq!((bench.count(), bench.echo()), (count, -3.0), "{line}");
        // A write that is sent again has no second effect.
        bench.write(&write(2, 1, PRESS, true.into()));
        bench.write(&write(1, 2, VALUE, real(-4.0)));
        bench.pass(8);
        assert_eq!((bench.count(), bench.echo()), (count, -4.0), "{line}");
        if !warm {
            continue;
        }
        // The stations alone fail, with what they kept last: the remote I/O has the newest values.
        // The last whole state is older than the steps that are lost.
        bench.pass(4);
        for station in STATIONS {
            bench.fault(Member::Station(station), Action::Crash);
        }
        bench.pass(2);
        for station in STATIONS {
            bench.simulation.lose_steps(station, 4);
            bench.fault(Member::Station(station), Action::Restart);
        }
        bench.pass(100);
        assert_eq!(bench.seen.warm_starts, 1);
        let choice = StateChoice::Newest { cycle: None };
        bench.fault(Member::RemoteIo(PROGRAM), Action::Choose { choice });
        bench.seen.outputs = [None, None];
        bench.pass(60);
        assert_eq!(bench.seen.warm_starts, 2);
        assert_eq!((bench.count(), bench.echo()), (1.0, -4.0));
    }
}

/// The notes of the remote I/O are lost, or end before the states: the operator reads, before the choice and after it, that the inputs have not the values that
/// they had in the state.
#[test]
fn an_input_whose_value_is_lost_is_said() {
    for is_lost in [true, false] {
        let text = CLUSTER.replace("initial = 7.0", "initial = 7.0, retain = true");
        let retentive = COUNTER.replace("VAR_OUTPUT", "VAR_OUTPUT RETAIN");
        let mut bench = Bench::of(cluster_of(&text, &retentive), Network::default(), 1);
        bench.write(&write(1, 1, VALUE, real(-3.0)));
        bench.pass(8);
        if !is_lost {
            bench.power_fails();
            assert_eq!((bench.seen.warm_starts, bench.seen.inputs.as_slice()), (1, &[None][..]));
            bench.simulation.write_protect(PROGRAM);
        }
        bench.write(&write(1, 2, VALUE, real(-4.0)));
        bench.pass(60);
        assert_eq!(bench.echo(), -4.0);
        if is_lost {
            bench.simulation.damage_notes(PROGRAM);
            bench.simulation.write_protect(PROGRAM);
        }
        bench.seen.inputs.clear();
        bench.power_fails();
        let choice = StateChoice::Newest { cycle: None };
        bench.fault(Member::RemoteIo(PROGRAM), Action::Choose { choice });
        bench.pass(60);
        // A note that is not the newest one asks nothing: nothing shows that newer outputs were applied.
        let (echo, old, times) =
            if is_lost { (7.0, "Some(Initial)", 2) } else { (-3.0, "Some(Of(", 1) };
        assert_eq!(bench.echo(), echo, "{is_lost}");
        let said: Vec<String> = bench.seen.inputs.iter().map(|it| format!("{it:?}")).collect();
        assert!(said.len() == times && said.iter().all(|it| it.starts_with(old)), "{said:?}");
    }
}

/// A fault and its repair, with the cycles between.
fn arbitrary_fault() -> impl Strategy<Value = (Member, Action, Action, u64)> {
    let station = (0..4_u8).prop_filter_map("no third controller", |rank| {
        (rank < 3).then_some(Member::Station(StationId(rank)))
    });
    let remote_io = Just(Member::RemoteIo(PROGRAM));
    let killed = prop_oneof![station.clone(), remote_io]
        .prop_map(|member| (member, Action::Crash, Action::Restart));
    let suspended = prop_oneof![station.clone(), Just(Member::RemoteIo(PROGRAM))]
        .prop_map(|member| (member, Action::Stop, Action::Continue));
    let deaf = station.prop_map(|member| {
        let to = Member::RemoteIo(PROGRAM);
        (member, Action::Cut { to }, Action::Heal { to })
    });
    let cut = (0..3_u8).prop_map(|rank| {
        let to = Member::Station(StationId(rank));
        let (from, cut, heal) =
            (Member::RemoteIo(PROGRAM), Action::Cut { to }, Action::Heal { to });
        (from, cut, heal)
    });
    (prop_oneof![killed, suspended, deaf, cut], 1..40_u64)
        .prop_map(|((member, fault, repair), cycles)| (member, fault, repair, cycles))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 192, ..ProptestConfig::default() })]

    /// A caller presses a button again and again, and asks under the same identifier until it has an answer, while faults
    /// come one after the other. The program counts exactly the presses that were answered to be in effect.
    #[test]
    fn each_write_has_one_effect_or_none(
        faults in prop::collection::vec((arbitrary_fault(), 5..60_u64), 1..8),
        loss in prop_oneof![Just(0.0), Just(0.1)],
        seed in any::<u64>(),
    ) {
        let mut bench = Bench::new(Network { loss, ..Network::default() }, seed);
        let (mut session, mut number) = (1, 1);
        let (mut effects, mut undecided) = (0, 0_u32);
        let mut asked: Option<(Write, u64)> = None;
        let mut plan = faults.iter();
        let mut repair: Option<(u64, Member, Action)> = None;
        let mut next = 5;
        let mut quiet = 0;
        while quiet < 400 {
            bench.pass(1);
            match (repair, plan.as_slice().first()) {
                (Some((at, member, action)), _) if bench.cycle >= at => {
                    bench.fault(member, action);
                    repair = None;
                    next = bench.cycle + plan.next().map_or(0, |(_, pause)| *pause);
                }
                (None, Some(((member, fault, back, cycles), _))) if bench.cycle >= next => {
                    bench.fault(*member, *fault);
                    repair = Some((bench.cycle + cycles, *member, *back));
                }
                (None, None) => quiet += 1,
                _ => {}
            }
            let outcome = asked.as_ref().and_then(|(write, _)| bench.outcome(write));
            match (&asked, outcome) {
                (Some(_), Some(WriteOutcome::InEffect { .. })) => {
                    effects += 1;
                    number += 1;
                    asked = None;
                }
                (Some(_), Some(WriteOutcome::Refused { refusal })) => {
                    bench.seen.outcomes.clear();
                    if let WriteRefusal::Order { .. } = refusal {
                        // The remote I/O does not know this session any more.
                        undecided += 1;
                        (session, number) = (session + 1, 1);
                    }
                    asked = None;
                }
                (Some((write, since)), None) if bench.cycle - since >= PATIENCE => {
                    let write = write.clone();
                    bench.write(&write);
                    asked = Some((write, bench.cycle));
                }
                (None, _) if quiet < 300 => {
                    let press = write(session, number, PRESS, true.into());
                    bench.write(&press);
                    asked = Some((press, bench.cycle));
                }
                _ => {}
            }
        }
        prop_assert_eq!(bench.simulation.violations().first(), None);
        prop_assert!(effects > 20 || bench.seen.cold_starts > 0, "{} effects", effects);
        // A history that was lost takes its count with it; it is announced by a cold start.
        if bench.seen.cold_starts == 0 {
            prop_assert!(asked.is_none(), "the last one has no answer: {:?}", asked);
            prop_assert_eq!(undecided, 0, "a session was forgotten");
            prop_assert_eq!(bench.count() as i32, effects);
        }
    }
}
