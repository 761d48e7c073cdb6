//! Writes of inputs that are forced: every order of forces, writes, ends of forces, and cycles with and without proved outputs.

use std::collections::BTreeMap;
use std::sync::Arc;

use understudy_cycle::{Output, RemoteIoInput};
use understudy_remote_io::{
    Event, Fallback, Layout, Missing, OperatorInput, OperatorInputKind, PointPlace, RemoteIo,
    Settings, StopPoints,
};
use understudy_typed::Elementary;
use understudy_wire::{
    Body, Force, Holding, Image, Lineage, Moment, PointValue, Recalled, Role, Sample, SignalPlace,
    StateChoice, Unforce, Write, WriteAnswer, WriteId, WriteOutcome, WriteRefusal,
};

use crate::bench::{
    Bench, HISTORY, Said, held_after, join, recalled_of, sample_of, settings, turn, turn_with,
};

const INITIAL: u64 = 7;

/// One step of a sequence.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    /// The input is forced to FALSE, or to a number that no one writes.
    ForceOff,
    /// The input is forced to TRUE, or to another number that no one writes.
    ForceOn,
    /// Its force ends.
    Unforce,
    /// A caller writes the input, in a session of its own.
    Write,
    /// A cycle whose output is proved.
    Proved,
    /// A cycle that no station follows.
    Unfollowed,
    /// Cycles that no station follows, until their samples become void.
    Void,
    /// Cycles that the stations follow without a proof of an output, until their samples leave the history.
    Unproved,
    /// A cycle whose output is proved, and says that a fault has stopped the program.
    Stopped,
    /// The stations come back with another state, and the operator accepts it.
    Replaced,
    /// The remote I/O starts again, and callers without an answer ask again.
    Restart,
}

use Step::*;

const IN_ONE_LIFE: [Step; 8] =
    [ForceOff, ForceOn, Unforce, Write, Proved, Unfollowed, Void, Replaced];

const WITH_RESTARTS: [Step; 7] = [ForceOff, ForceOn, Unforce, Write, Proved, Unfollowed, Restart];

const WITHOUT_PROOFS: [Step; 7] = [ForceOff, Unforce, Write, Proved, Unfollowed, Void, Unproved];

const WITH_FAULTS: [Step; 6] = [ForceOff, Unforce, Write, Proved, Unfollowed, Stopped];

/// What the stations hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stations {
    Follow,
    FollowStopped,
    FollowLate,
    StayBehind,
    Hold(Lineage),
}

/// A sample as it was sent.
#[derive(Debug, Clone, Copy)]
struct Sampled {
    moment: Moment,
    value: u64,
    forced: bool,
    void: bool,
    /// Whether a program that runs has executed it.
    executed: bool,
}

impl Sampled {
    fn counts(&self) -> bool {
        !self.void && self.executed
    }
}

/// A remote I/O with one operator input.
#[derive(Clone)]
struct Operated {
    bench: Bench,
    settings: Settings,
    kind: OperatorInputKind,
    sample: Option<Sample>,
    /// What the stations recall of the newest sample that they received.
    recalled: Option<Recalled>,
    /// The newest state that the stations have proved.
    held: Option<Holding>,
    applied: Moment,
    forced: bool,
    trace: Vec<Sampled>,
    /// Stored values by session.
    writes: Vec<u64>,
    outcomes: BTreeMap<u64, WriteOutcome>,
    steps: Vec<Step>,
}

fn place(kind: OperatorInputKind) -> PointPlace {
    let of = match kind {
        OperatorInputKind::Setpoint { .. } => Elementary::Int,
        _ => Elementary::Bool,
    };
    PointPlace { bit: 16, of }
}

impl Operated {
    fn new(kind: OperatorInputKind) -> Self {
        let place = place(kind);
        let initial = if place.of == Elementary::Bool { 0 } else { INITIAL };
        let settings = Settings {
            layout: Arc::new(Layout {
                undriven: Image::zero(32),
                input_points: vec![place],
                operator_inputs: vec![OperatorInput {
                    place,
                    kind,
                    initial,
                    role: Role::Operator,
                    retains: false,
                }],
                stop: Some(StopPoints { stopped: 0, reset: 0 }),
                ..Layout::booleans(0, 1)
            }),
            // Writes are taken while outputs are held.
            fallback: Fallback { hold_cycles: 1000, ..settings(1).fallback },
            ..settings(1)
        };
        let mut bench = Self {
            bench: Bench::new(settings.clone(), 101),
            settings,
            kind,
            sample: None,
            recalled: None,
            held: None,
            applied: Moment::default(),
            forced: false,
            trace: Vec::new(),
            writes: Vec::new(),
            outcomes: BTreeMap::new(),
            steps: Vec::new(),
        };
        for _ in 0..20 {
            bench.pass(Stations::Follow);
        }
        assert!(bench.held.is_some(), "the program runs");
        bench
    }

    fn hear(&mut self, said: Said) {
        if let Some(sample) = sample_of(&said) {
            self.sample = Some(sample.clone());
        }
        let mut answers = Vec::new();
        for output in said {
            match output {
                Output::Report(event) => self.observe(&event),
                Output::Answer(answer) => answers.push(answer),
                _ => {}
            }
        }
        answers.into_iter().for_each(|answer| self.answered(answer));
    }

    fn observe(&mut self, event: &Event) {
        match event {
            Event::Voided { samples, .. } => {
                let valid = self.trace.iter_mut().rev().filter(|sampled| !sampled.void);
                valid.take(*samples).for_each(|sampled| sampled.void = true);
            }
            Event::AdoptedLineage { .. } => {
                let applied = self.applied;
                let newer = self.trace.iter_mut().filter(|sampled| sampled.moment > applied);
                newer.for_each(|sampled| sampled.void = true);
                if let OperatorInputKind::Pulse(_) = self.kind {
                    // The other state may have seen the button pressed.
                    let moment = self.bench.moment();
                    self.trace.push(Sampled {
                        moment,
                        value: 1,
                        forced: true,
                        void: false,
                        executed: true,
                    });
                }
            }
            Event::Sampled { moment, inputs, .. } => {
                let (value, forced) = (place(self.kind).get(inputs), self.forced);
                self.trace.push(Sampled {
                    moment: *moment,
                    value,
                    forced,
                    void: false,
                    executed: true,
                });
            }
            Event::Applied { moment, missing: None, .. } => self.applied = *moment,
            Event::Applied { moment, missing: Some(Missing::ProgramFault), .. } => {
                let sampled = self.trace.iter_mut().rev().find(|it| it.moment == *moment);
                sampled.expect("it is proved").executed = false;
            }
            _ => {}
        }
    }

    /// Every answer is true when it is given.
    fn answered(&mut self, WriteAnswer { id, outcome }: WriteAnswer) {
        let before = self.outcomes.insert(id.session, outcome);
        assert_eq!(before, None, "{:?}: answered twice", self.steps);
        let written = self.writes[id.session as usize];
        match outcome {
            WriteOutcome::InEffect { since } => {
                let at = self.trace.iter().rposition(|sampled| sampled.moment == since);
                let sampled = at.map(|at| self.trace[at]);
                let has_effect = self.applied >= since
                    && sampled.is_some_and(|it| it.value == written && !it.forced && it.counts());
                assert!(has_effect, "{:?}: {sampled:?}", self.steps);
            }
            WriteOutcome::Refused { refusal: WriteRefusal::Forced { seconds } } => {
                assert!(self.forced && (1..=60).contains(&seconds), "{:?}: {seconds}", self.steps);
            }
            WriteOutcome::Refused { .. } => {}
        }
    }

    fn pass(&mut self, stations: Stations) {
        self.bench.cycle += 1;
        self.sample = None;
        self.receive(0, Body::Sync);
        let sample = self.sample.clone();
        let follow = [Stations::Follow, Stations::FollowStopped, Stations::FollowLate];
        if let Some(sample) = sample.as_ref().filter(|_| follow.contains(&stations)) {
            self.held = Some(held_after(sample, self.bench.moment()));
            self.recalled = Some(recalled_of(sample, self.bench.moment()));
        }
        for rank in [0, 1] {
            let body = match (stations, sample.is_some(), self.held) {
                (Stations::Follow, true, Some(held)) => turn(held),
                (Stations::FollowStopped, true, Some(held)) => turn_with(held, [true]),
                (Stations::Hold(lineage), _, Some(held)) => {
                    join(Some(Holding { lineage, ..held }), None)
                }
                (_, true, held) => join(held, None),
                (_, false, held) => join(held, self.recalled.clone()),
            };
            self.receive(rank, body);
        }
        let said = self.bench.decide();
        self.hear(said);
    }

    fn receive(&mut self, rank: u8, body: Body) {
        let said = self.bench.receive(self.bench.start(), rank, false, body);
        self.hear(said);
    }

    fn order(&mut self, input: RemoteIoInput<'_>) {
        let said = self.bench.tell(input);
        self.hear(said);
    }

    fn value(&self, stored: u64) -> PointValue {
        PointValue::new(place(self.kind).of.bits(), stored)
    }

    fn force(&mut self, on: bool) {
        let stored = match place(self.kind).of {
            Elementary::Bool => u64::from(on),
            _ => 90 + u64::from(on),
        };
        let (owner, reason) = ("anna".to_owned(), "a test".to_owned());
        let signal = SignalPlace::Input(place(self.kind).bit);
        let force =
            Force { signal, value: self.value(stored), seconds: 60, owner, reason, points: None };
        self.order(RemoteIoInput::Force(&force));
        self.forced = true;
    }

    fn unforce(&mut self) {
        let signal = SignalPlace::Input(place(self.kind).bit);
        self.order(RemoteIoInput::Unforce(&Unforce { signal, points: None }));
        self.forced = false;
    }

    fn write(&mut self) {
        let session = self.writes.len() as u64;
        let stored = match self.kind {
            OperatorInputKind::Setpoint { .. } => 10 + session,
            _ => 1,
        };
        self.writes.push(stored);
        self.ask(session);
    }

    /// The caller of a session asks for its write, once more or for the first time.
    fn ask(&mut self, session: u64) {
        let write = Write {
            id: WriteId { session, number: 1 },
            input: place(self.kind).bit,
            value: self.value(self.writes[session as usize]),
            role: Role::Operator,
            owner: "anna".to_owned(),
            reason: "a test".to_owned(),
            points: None,
        };
        self.order(RemoteIoInput::Write(&write));
    }

    fn step(&mut self, step: Step) {
        self.steps.push(step);
        match step {
            ForceOff => self.force(false),
            ForceOn => self.force(true),
            Unforce => self.unforce(),
            Write => self.write(),
            Proved => self.pass(Stations::Follow),
            Stopped => self.pass(Stations::FollowStopped),
            Unfollowed => self.pass(Stations::StayBehind),
            Unproved => (0..=HISTORY).for_each(|_| self.pass(Stations::FollowLate)),
            Void => (0..=HISTORY).for_each(|_| self.pass(Stations::StayBehind)),
            Replaced => {
                let other = Stations::Hold(Lineage(self.bench.cycle));
                while !self.bench.remote_io.asks_operator() {
                    self.pass(other);
                }
                self.order(RemoteIoInput::Choose(StateChoice::Newest { cycle: None }));
                if let Some(held) = &mut self.held {
                    let Stations::Hold(lineage) = other else { return };
                    held.lineage = lineage;
                }
            }
            Restart => {
                self.bench.remote_io = RemoteIo::new(self.bench.start(), self.settings.clone());
                self.forced = false;
                let before = self.trace.len();
                while self.trace[before..].iter().all(|sampled| sampled.forced) {
                    self.pass(Stations::Follow);
                }
                let sessions = 0..self.writes.len() as u64;
                let open: Vec<u64> =
                    sessions.filter(|session| !self.outcomes.contains_key(session)).collect();
                open.into_iter().for_each(|session| self.ask(session));
            }
        }
    }

    /// The force ends, cycles are proved, and every write has had one effect or none.
    fn settle(mut self) -> Outcomes {
        self.unforce();
        (0..8).for_each(|_| self.pass(Stations::Follow));
        let steps = &self.steps;
        assert_eq!(self.outcomes.len(), self.writes.len(), "{steps:?}: a write has no answer");
        let valid: Vec<&Sampled> = self.trace.iter().filter(|it| it.counts()).collect();
        let effects = self.outcomes.iter().filter_map(|(session, outcome)| match outcome {
            WriteOutcome::InEffect { since } => Some((*since, self.writes[*session as usize])),
            WriteOutcome::Refused { .. } => None,
        });
        let effects: BTreeMap<Moment, u64> = effects.collect();
        let last = self.trace.last().expect("a sample").value;
        if let OperatorInputKind::Pulse(_) = self.kind {
            let pairs = valid.windows(2);
            let edges = pairs.filter(|it| !it[1].forced && it[1].value > 0 && it[0].value == 0);
            let edges: Vec<Moment> = edges.map(|it| it[1].moment).collect();
            let expected: Vec<Moment> = effects.keys().copied().collect();
            assert_eq!(edges, expected, "{steps:?}: one edge for each pulse: {valid:?}");
            assert_eq!(last, 0, "{steps:?}");
        } else {
            let initial = if place(self.kind).of == Elementary::Bool { 0 } else { INITIAL };
            let expected = effects.last_key_value().map_or(initial, |(_, value)| *value);
            assert_eq!(last, expected, "{steps:?}: {valid:?}");
            for sampled in valid.iter().filter(|it| !it.forced && it.value != initial) {
                let is_of_effect = effects
                    .range(..=sampled.moment)
                    .next_back()
                    .is_some_and(|(_, value)| *value == sampled.value);
                assert!(is_of_effect, "{steps:?}: {sampled:?} of a write without an effect");
            }
        }
        let mut outcomes = Outcomes::default();
        for outcome in self.outcomes.values() {
            match outcome {
                WriteOutcome::InEffect { .. } => outcomes.in_effect += 1,
                WriteOutcome::Refused { refusal: WriteRefusal::Forced { .. } } => {
                    outcomes.forced += 1;
                }
                WriteOutcome::Refused { .. } => outcomes.refused += 1,
            }
        }
        outcomes
    }
}

/// The number of writes by outcome.
#[derive(Debug, Default, Clone, Copy)]
struct Outcomes {
    in_effect: u32,
    forced: u32,
    refused: u32,
}

/// All sequences of these steps that continue one, each to its end.
fn explore(bench: &Operated, alphabet: &[Step], steps: u32, total: &mut Outcomes) {
    if steps == 0 {
        let outcomes = bench.clone().settle();
        total.in_effect += outcomes.in_effect;
        total.forced += outcomes.forced;
        total.refused += outcomes.refused;
        return;
    }
    // What changes nothing is left out.
    let changes = |step: &Step| match step {
        ForceOff => !bench.forced || bench.steps.last() == Some(&ForceOn),
        ForceOn => !bench.forced || bench.steps.last() == Some(&ForceOff),
        Unforce => bench.forced,
        _ => true,
    };
    for step in alphabet.iter().copied().filter(changes) {
        let mut next = bench.clone();
        next.step(step);
        explore(&next, alphabet, steps - 1, total);
    }
}

/// A write that is in effect was sampled with its value, and one that is refused never has an effect, in every order of the steps.
#[test]
fn every_write_of_an_input_that_is_forced_has_a_true_answer() {
    for (kind, steps) in [
        (OperatorInputKind::Level, 5),
        (OperatorInputKind::Pulse(2), 6),
        (OperatorInputKind::Setpoint { low: 0, high: 80 }, 5),
    ] {
        let mut total = Outcomes::default();
        explore(&Operated::new(kind), &IN_ONE_LIFE, steps, &mut total);
        let Outcomes { in_effect, forced, refused } = total;
        assert!(in_effect > 1000 && forced > 1000 && refused > 100, "{kind:?}: {total:?}");
    }
}

/// A sample that has left the history is part of every state: a write in it is not lost, and takes effect once.
#[test]
fn a_write_takes_effect_once_where_no_output_is_proved_for_long() {
    for kind in [
        OperatorInputKind::Level,
        OperatorInputKind::Pulse(2),
        OperatorInputKind::Pulse(6),
        OperatorInputKind::Setpoint { low: 0, high: 80 },
    ] {
        let mut total = Outcomes::default();
        explore(&Operated::new(kind), &WITHOUT_PROOFS, 5, &mut total);
        assert!(total.in_effect > 1000 && total.refused > 100, "{kind:?}: {total:?}");
    }
}

/// No program that runs has executed a sample whose output says that it is stopped: an online change is taken back to before this scan, and the operator
/// starts the program anew. So a pulse that lasted no longer had no effect, and what holds is in effect from the first sample that was executed.
#[test]
fn a_write_that_only_a_stopped_program_has_seen_is_not_in_effect() {
    for kind in [
        OperatorInputKind::Level,
        OperatorInputKind::Pulse(1),
        OperatorInputKind::Pulse(3),
        OperatorInputKind::Setpoint { low: 0, high: 80 },
    ] {
        let mut total = Outcomes::default();
        explore(&Operated::new(kind), &WITH_FAULTS, 6, &mut total);
        assert!(total.in_effect > 1000 && total.refused > 100, "{kind:?}: {total:?}");
    }
}

/// A force ends with the process of its remote I/O: what was written before it holds again, and nothing of the force.
#[test]
fn no_forced_value_is_left_after_a_restart() {
    for kind in [
        OperatorInputKind::Level,
        OperatorInputKind::Pulse(2),
        OperatorInputKind::Setpoint { low: 0, high: 80 },
    ] {
        let mut total = Outcomes::default();
        explore(&Operated::new(kind), &WITH_RESTARTS, 5, &mut total);
        assert!(total.in_effect > 1000 && total.forced > 100, "{kind:?}: {total:?}");
    }
}
