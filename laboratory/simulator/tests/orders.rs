//! Orders of operators at any phase of an online change of points, by people who know the points before, those after, or say nothing of points: none
//! reaches another signal than the one that was meant.

use std::sync::Arc;

use understudy_cluster::{Cluster, change_with_points, read};
use understudy_cycle::RemoteIoInput;
use understudy_remote_io::Event;
use understudy_simulator::{Action, ChangeStep, Fault, Network, Parts, Record, Simulation, parts};
use understudy_wire::{
    Force, Image, Member, PointValue, PointsHash, ProgramId, Role, SignalPlace, StationId, Write,
    WriteId,
};

/// `a` is shown by `x`, and the others by others.
const BEFORE: &str = "
PROGRAM shown
  VAR_INPUT a : INT; b : INT; END_VAR
  VAR_OUTPUT x : INT; y : INT; END_VAR
  x := a; y := b;
END_PROGRAM";

/// Where `a` and `x` were are `b` and `y` now.
const AFTER: &str = "
PROGRAM shown
  VAR_INPUT b : INT; c : INT; a : INT; END_VAR
  VAR_OUTPUT y : INT; z : INT; x : INT; END_VAR
  x := a; y := b; z := c;
END_PROGRAM";

/// First bits of `a` and of `x`.
const PLACES: [u16; 2] = [0, 32];
const WANTED: i16 = 7;
const PROGRAM: ProgramId = ProgramId(0);
const REMOTE_IO: Member = Member::RemoteIo(PROGRAM);
const MEMBERS: [Member; 3] =
    [Member::Station(StationId(0)), Member::Station(StationId(1)), REMOTE_IO];

/// Cycles in which the program is switched there and back.
const THERE: u64 = 30;
const BACK: u64 = 36;

fn cluster(program: &str, inputs: &[&str]) -> Cluster {
    let keys = inputs.iter().map(|name| {
        format!("{name} = {{ operator = \"setpoint\", low = 0, high = 9, initial = 0 }}")
    });
    let inputs = keys.collect::<Vec<_>>().join(", ");
    let text = format!(
        "[cluster]\nname = \"orders\"\n[[controller]]\nname = \"shown\"\nladder = \"shown.st\"\n\
         [[remote_io]]\ncontroller = \"shown\"\ninputs = {{ {inputs} }}\n"
    );
    let loaded = read("cluster.toml", &text, &mut |_| Ok(program.to_owned()));
    loaded.cluster.unwrap_or_else(|| panic!("{:?}", loaded.reports))
}

/// The change, and the points of both sides.
fn changing() -> (Parts, [PointsHash; 2]) {
    let (before, after) = (cluster(BEFORE, &["a", "b"]), cluster(AFTER, &["a", "b", "c"]));
    let hashes = [&before, &after].map(|it| it.points_hash(PROGRAM).expect("it has the program"));
    let change = change_with_points(&before, &after).expect("an online change");
    (Parts { change: Some(Arc::new(change)), ..parts(&before) }, hashes)
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Write,
    ForceInput,
    ForceOutput,
}

/// Who gives the order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Knows {
    Before,
    After,
    Nothing,
}

/// What became of an order.
#[derive(Debug, Default)]
struct Seen {
    is_new: bool,
    refused: u32,
    taken: u32,
    /// Values of `x` that were driven, and of all other outputs.
    shown: Vec<i16>,
    others: Vec<i16>,
}

impl Seen {
    fn note(&mut self, event: &Event) {
        match event {
            Event::PointsChanged { .. } => self.is_new = !self.is_new,
            Event::Written { .. } | Event::Forced { .. } => self.taken += 1,
            Event::WriteRefused { refusal, .. } => self.refuse(refusal.code()),
            Event::ForceRefused { refusal, .. } => self.refuse(refusal.code()),
            Event::Applied { outputs, driven, .. } => {
                let driven = driven.as_ref().unwrap_or(outputs);
                let own = PLACES[usize::from(self.is_new)];
                for first in (0..driven.width() as u16).step_by(16) {
                    let values = if first == own { &mut self.shown } else { &mut self.others };
                    values.push(number(driven, first));
                }
            }
            _ => {}
        }
    }

    fn refuse(&mut self, code: &str) {
        assert_eq!(code, "U0638");
        self.refused += 1;
    }
}

fn number(image: &Image, first: u16) -> i16 {
    let bits = (0..16).map(|bit| i16::from(image.get(usize::from(first + bit))) << bit);
    bits.fold(0, |number, bit| number | bit)
}

/// A run of the change in which the order is given at this place.
fn run(kind: Kind, knows: Knows, (cycle, phase): (u64, f64)) -> Seen {
    let (parts, [before, after]) = changing();
    let mut simulation = Simulation::new(parts, Network::default(), 3);
    let mut step = |cycle, member, step| {
        let action = Action::Change { step };
        simulation.schedule(Fault { at_cycle: cycle, phase: 0.3, member, action });
    };
    MEMBERS.into_iter().for_each(|member| step(20, member, ChangeStep::Prepare));
    step(THERE, REMOTE_IO, ChangeStep::Switch);
    step(BACK, REMOTE_IO, ChangeStep::SwitchBack);
    let mut seen = Seen::default();
    let mut observe = |_, _, _, record: Record<'_>| {
        if let Record::RemoteIo(event) = record {
            seen.note(event);
        }
    };
    simulation.run(10, 300, &mut observe).expect("everybody comes");
    simulation.go_to(cycle, phase, &mut observe);
    let (points, place) = match knows {
        Knows::Before => (Some(before), PLACES[0]),
        Knows::After => (Some(after), PLACES[1]),
        Knows::Nothing => (None, PLACES[0]),
    };
    let value = PointValue::new(16, WANTED as u64);
    let (owner, reason) = ("anna".to_owned(), "a test".to_owned());
    let forced = |signal| Force {
        signal,
        value,
        seconds: 60,
        owner: owner.clone(),
        reason: reason.clone(),
        points,
    };
    match kind {
        Kind::Write => {
            let (id, role) = (WriteId { session: 5, number: 1 }, Role::Engineer);
            let write = Write { id, input: place, value, role, owner, reason, points };
            simulation.order(PROGRAM, RemoteIoInput::Write(&write), &mut observe);
        }
        Kind::ForceInput => {
            let force = forced(SignalPlace::Input(place));
            simulation.order(PROGRAM, RemoteIoInput::Force(&force), &mut observe);
        }
        Kind::ForceOutput => {
            let force = forced(SignalPlace::Output(place));
            simulation.order(PROGRAM, RemoteIoInput::Force(&force), &mut observe);
        }
    }
    simulation.go_on(50, &mut observe, &mut || false);
    assert!(simulation.violations().is_empty(), "{:?}", simulation.violations());
    seen
}

#[test]
fn no_order_reaches_another_signal_at_any_phase_of_a_change_of_points() {
    let phases = [0.02, 0.1, 0.2, 0.29, 0.31, 0.5, 0.66, 0.8, 0.99];
    for kind in [Kind::Write, Kind::ForceInput, Kind::ForceOutput] {
        for knows in [Knows::Before, Knows::After, Knows::Nothing] {
            let (mut taken, mut refused) = (0, 0);
            for cycle in (18..22).chain(THERE - 1..THERE + 3).chain(BACK - 1..BACK + 3) {
                for phase in phases {
                    let at = (cycle, phase);
                    let seen = run(kind, knows, at);
                    let case = format!("{kind:?} {knows:?} {at:?}: {seen:?}");
                    assert_eq!(seen.taken + seen.refused, 1, "{case}");
                    assert!(seen.others.iter().all(|value| *value == 0), "{case}");
                    let is_shown = seen.shown.contains(&WANTED);
                    // A force ends with the points: one that is given just before may have been in no cycle.
                    let may_end = kind != Kind::Write && seen.taken == 1;
                    assert!(is_shown == (seen.taken == 1) || may_end, "{case}");
                    taken += seen.taken;
                    refused += seen.refused;
                }
            }
            assert!(taken > 10 && refused > 10, "{kind:?} {knows:?}: {taken} {refused}");
        }
    }
}
