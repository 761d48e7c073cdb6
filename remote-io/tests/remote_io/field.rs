//! What the plant shows and what a remote I/O makes of it: sensors that cannot be seen, and signals that the operator forces.

use std::sync::Arc;

use understudy_cycle::{Input, Machine, Output, RemoteIoInput};
use understudy_remote_io::{
    Event, Fallback, Layout, Missing, OperatorInput, OperatorInputKind, PointPlace, Settings,
};
use understudy_typed::Elementary;
use understudy_wire::{
    Body, Cycle, Force, Image, Lineage, OrderRefusal, PointValue, Role, SignalPlace, Source,
    StateChoice, Time, Unforce, Write, WriteAnswer, WriteId, WriteOutcome, WriteRefusal,
};

use crate::bench::{Bench, PERIOD, Said, join, sample_of, settings};

/// A remote I/O that starts in the first cycle.
fn bench(settings: Settings) -> Bench {
    Bench::new(settings, 1)
}

impl Bench {
    /// One cycle from its Sync to its deadline: the base of what was sampled, what was driven, and why it was not true.
    fn cycle(&mut self) -> (Option<Lineage>, Source, Option<Missing>) {
        let said = self.said();
        let sampled = sample_of(&said).map(|sample| sample.base);
        let applied = said.iter().rev().find_map(|output| match output {
            Output::Report(Event::Applied { source, missing, .. }) => Some((*source, *missing)),
            _ => None,
        });
        let (source, missing) = applied.expect("it drives at every deadline");
        (sampled, source, missing)
    }

    /// All that it says in one cycle.
    fn said(&mut self) -> Said {
        self.cycle += 1;
        let mut said = self.sync(self.start());
        said.extend(self.decide());
        said
    }

    /// The frames of the controller in this cycle, which arrive at `now`.
    fn sync(&mut self, now: Time) -> Said {
        let mut said = self.receive(now, 0, false, Body::Sync);
        said.extend(self.receive(now, 0, false, join(None, None)));
        said
    }
}

#[test]
fn a_forced_signal_is_sampled_and_driven_so_until_its_time_is_over() {
    let mut bench = bench(settings(1));
    bench.tell(RemoteIoInput::Field(&Image::from_bits([true, false])));
    let started = (0..60).find_map(|_| bench.cycle().0);
    assert!(started.is_some(), "it starts cold where no station holds a state");
    let force = |signal, value: bool, seconds| Force {
        signal,
        value: value.into(),
        seconds,
        owner: "anna".to_owned(),
        reason: "a test".to_owned(),
        points: None,
    };
    let (input, output) = (SignalPlace::Input(1), SignalPlace::Output(0));
    let mut said = bench.tell(RemoteIoInput::Force(&force(input, true, 1)));
    said.extend(bench.tell(RemoteIoInput::Force(&force(output, true, 1))));
    // None of these is a force.
    said.extend(bench.tell(RemoteIoInput::Force(&force(SignalPlace::Input(2), true, 1))));
    said.extend(bench.tell(RemoteIoInput::Force(&force(SignalPlace::Output(1), true, 1))));
    said.extend(bench.tell(RemoteIoInput::Force(&force(SignalPlace::Input(0), false, 0))));
    assert_eq!(forced_and_ended(&said), (2, 0), "{said:?}");
    let frames = |bench: &mut Bench| {
        let said = bench.said();
        let sampled = said.iter().find_map(|output| match output {
            Output::Report(Event::Sampled { inputs, .. }) => Some(inputs.clone()),
            _ => None,
        });
        let driven = said.iter().find_map(|output| match output {
            Output::Drive { outputs, .. } => Some(outputs.clone()),
            _ => None,
        });
        let applied = said.iter().find_map(|output| match output {
            Output::Report(Event::Applied { outputs, .. }) => Some(outputs.clone()),
            _ => None,
        });
        let ended = forced_and_ended(&said).1;
        (sampled, driven, applied, ended)
    };
    let image = |bits: &[bool]| Some(Image::from_bits(bits.iter().copied()));
    let (fail_safe, forced) = (image(&[false]), image(&[true]));
    let both = (image(&[true, true]), forced.clone(), fail_safe.clone(), 0);
    assert_eq!(frames(&mut bench), both);
    let unforce = Unforce { signal: output, points: None };
    let mut said = bench.tell(RemoteIoInput::Unforce(&unforce));
    said.extend(bench.tell(RemoteIoInput::Unforce(&unforce)));
    assert_eq!(forced_and_ended(&said), (0, 1), "taken back once");
    let one = (image(&[true, true]), fail_safe.clone(), fail_safe.clone(), 0);
    assert_eq!(frames(&mut bench), one);
    // A second later.
    bench.cycle += 100;
    let none = (image(&[true, false]), fail_safe.clone(), fail_safe, 1);
    assert_eq!(frames(&mut bench), none);
}

/// The outcomes of orders.
fn obeyed(said: &[Output<Event>]) -> Vec<Result<(), OrderRefusal>> {
    let obeyed = said.iter().filter_map(|output| match output {
        Output::Obeyed(obeyed) => Some(*obeyed),
        _ => None,
    });
    obeyed.collect()
}

/// Signals of 1, 16 and 32 bits: every place and every width, as whole signals are, and nothing else.
#[test]
fn a_force_is_of_a_whole_signal_and_of_a_value_that_it_can_have() {
    let points = [
        (0, Elementary::Bool),
        (16, Elementary::Int),
        (32, Elementary::Real),
        (64, Elementary::Lreal),
    ];
    let points: Vec<_> = points.into_iter().map(|(bit, of)| PointPlace { bit, of }).collect();
    let settings = Settings {
        layout: Arc::new(Layout {
            undriven: Image::zero(128),
            input_points: points.clone(),
            output_points: points.clone(),
            ..Layout::booleans(0, 0)
        }),
        fallback: Fallback { fail_safe: Image::zero(128), ..settings(1).fallback },
        ..settings(1)
    };
    let mut bench = bench(settings);
    let values = [0, 1, 0x7f80_0000, 0x7fc0_0000, 0x4148_0000, 0x7ff8_0000_0000_0000, u64::MAX];
    let mut taken = 0;
    for bit in 0..130 {
        for signal in [SignalPlace::Input(bit), SignalPlace::Output(bit)] {
            for (width, stored) in
                [1, 8, 16, 32, 64].into_iter().flat_map(|width| values.map(|value| (width, value)))
            {
                let value = PointValue::new(width, stored);
                let (owner, reason) = ("anna".to_owned(), "a test".to_owned());
                let force = Force { signal, value, seconds: 1, owner, reason, points: None };
                let is_number = match width {
                    32 => f32::from_bits(stored as u32).is_finite(),
                    64 => f64::from_bits(stored).is_finite(),
                    _ => true,
                };
                let point = points.iter().find(|point| point.bit == bit);
                let is_whole = point.is_some_and(|point| point.of.bits() == width);
                let expected = force.check().is_ok() && is_whole && is_number;
                let said = bench.tell(RemoteIoInput::Force(&force));
                let outcomes = obeyed(&said);
                assert_eq!(
                    (outcomes.len(), outcomes[0].is_ok()),
                    (1, expected),
                    "{force:?}: {outcomes:?}"
                );
                let is_recorded = said.iter().any(|output| match output {
                    Output::Report(Event::Forced { .. }) => expected,
                    Output::Report(Event::ForceRefused { .. }) => !expected,
                    _ => false,
                });
                assert!(is_recorded, "{force:?}: {said:?}");
                taken += usize::from(expected);
            }
        }
    }
    assert!(taken > 30, "{taken}");
}

/// No station publishes: a value would be in effect when one does, long after its caller has given up.
#[test]
fn a_write_is_refused_while_no_station_computes_the_program() {
    let level = OperatorInput {
        place: PointPlace { bit: 1, of: Elementary::Bool },
        kind: OperatorInputKind::Level,
        initial: 0,
        role: Role::Operator,
        retains: false,
    };
    let settings = Settings {
        layout: Arc::new(Layout { operator_inputs: vec![level], ..Layout::booleans(2, 1) }),
        ..settings(1)
    };
    let mut bench = bench(settings);
    let started = (0..60).find_map(|_| bench.cycle().0);
    assert!(started.is_some(), "it starts cold where no station holds a state");
    assert_eq!(bench.cycle().1, Source::FailSafe);
    let write = Write {
        id: WriteId { session: 1, number: 1 },
        input: 1,
        value: true.into(),
        role: Role::Operator,
        owner: "anna".to_owned(),
        reason: "a test".to_owned(),
        points: None,
    };
    let said = bench.tell(RemoteIoInput::Write(&write));
    let refused = WriteOutcome::Refused { refusal: WriteRefusal::NotRunning };
    assert!(
        matches!(&said[..], [
            Output::Report(Event::WriteRefused { .. }),
            Output::Answer(WriteAnswer { outcome, .. }),
        ] if *outcome == refused),
        "{said:?}"
    );
}

#[test]
fn an_order_that_changes_nothing_is_refused() {
    let mut bench = bench(settings(1));
    let unforce = Unforce { signal: SignalPlace::Output(0), points: None };
    let no_choice = Err(OrderRefusal::NoChoice);
    for (input, expected) in [
        (RemoteIoInput::Unforce(&unforce), Err(OrderRefusal::NotForced)),
        (RemoteIoInput::Choose(StateChoice::Cold), no_choice),
        (RemoteIoInput::Choose(StateChoice::Newest { cycle: Some(Cycle(5)) }), no_choice),
        (RemoteIoInput::Release, Ok(())),
    ] {
        assert_eq!(obeyed(&bench.tell(input)), [expected], "{input:?}");
    }
}

/// The host suspends the remote I/O in each part of a cycle, for each number of cycles; the frames of these cycles wait in its buffer.
#[test]
fn a_deadline_that_was_slept_through_is_neither_driven_nor_recorded() {
    for (asleep, at_once) in (0..40).flat_map(|asleep| [false, true].map(|once| (asleep, once))) {
        let mut bench = bench(settings(1));
        for _ in 0..60 {
            bench.said();
        }
        let first = bench.cycle + 1;
        let begins = |cycle: u64| Time(0) + PERIOD * cycle as u32;
        let now = begins(first + asleep) + PERIOD / 3;
        let mut said = Vec::new();
        for cycle in first..=first + asleep {
            // In the first of them the sync may have come before the host suspended it.
            let at = if cycle == first && at_once { begins(first) } else { now };
            bench.cycle = cycle;
            said.extend(bench.sync(at));
        }
        let late = bench.remote_io.wakeup().max(now);
        said.extend(bench.give(late, Input::Wakeup));
        let driven = said.iter().filter(|it| matches!(it, Output::Drive { .. })).count();
        let applied: Vec<u64> = said
            .iter()
            .filter_map(|output| match output {
                Output::Report(Event::Applied { moment, .. }) => Some(moment.cycle.0),
                _ => None,
            })
            .collect();
        // The cycle in which it was suspended, late, and the present one.
        let mut expected = vec![first + asleep];
        if at_once && asleep > 0 {
            expected.insert(0, first);
        }
        assert_eq!(applied, expected, "{asleep} cycles, {at_once}");
        assert_eq!(driven, expected.len());
    }
}

/// How many forces began and ended.
fn forced_and_ended(said: &[Output<Event>]) -> (usize, usize) {
    let count = |test: &dyn Fn(&Event) -> bool| {
        let reports = said.iter().filter(|output| match output {
            Output::Report(event) => test(event),
            _ => false,
        });
        reports.count()
    };
    (
        count(&|event| matches!(event, Event::Forced { .. })),
        count(&|event| matches!(event, Event::Unforced { .. })),
    )
}

#[test]
fn without_sensors_nothing_is_sampled_and_the_program_stands_still() {
    let mut bench = bench(settings(1));
    let sensors = Image::from_bits([true, false]);
    bench.tell(RemoteIoInput::Field(&sensors));
    // It listens first whether somebody holds a state.
    let started = (0..60).find_map(|_| bench.cycle().0);
    let genesis = started.expect("it starts cold where no station holds a state");
    bench.tell(RemoteIoInput::FieldLost);
    for _ in 0..5 {
        let (sampled, source, missing) = bench.cycle();
        assert_eq!(sampled, None);
        assert_eq!(source, Source::FailSafe, "nothing was true before");
        assert_eq!(missing, Some(Missing::BadQuality));
    }
    bench.tell(RemoteIoInput::Field(&sensors));
    let (sampled, _, missing) = bench.cycle();
    assert_eq!(sampled, Some(genesis), "the history goes on where it was");
    assert_ne!(missing, Some(Missing::BadQuality));
}
