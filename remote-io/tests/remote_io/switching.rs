//! Orders of an online change at the remote I/O of a program: when its history may change to another program, and which settings it has.

use std::sync::Arc;

use understudy_cycle::{
    ChangeOrder, Conversion, FallbackChange, Input, OnlineChange, Output, Program, ProgramChange,
    RemoteIoInput,
};
use understudy_logic::CircuitBuilder;
use understudy_remote_io::Fallback;
use understudy_wire::{
    ConfigurationHash, Configurations, Cycle, Frame, Header, Image, Moment, OrderRefusal,
    ProgramHash, Sample, StationId, StationSet, Step,
};

use crate::bench::{Bench, PERIOD, PROGRAM, Said, held_after, join, sample_of, settings, turn};

const BEFORE: ConfigurationHash = ConfigurationHash(2);
const AFTER: ConfigurationHash = ConfigurationHash(3);
const OLD: ProgramHash = ProgramHash(1);
const NEW: ProgramHash = ProgramHash(5);

#[derive(Debug)]
struct Same;

impl Conversion for Same {
    fn convert(&self, state: &[u64]) -> Vec<u64> {
        state.to_vec()
    }

    fn release(&self, _state: &mut [u64], _inputs: &[u64]) {}
}

fn program(hash: ProgramHash) -> Program {
    let mut builder = CircuitBuilder::new("program");
    let one = builder.input("one");
    builder.input("two");
    builder.output("y", one);
    Program { hash, executable: (&builder.finish().expect("a circuit")).into() }
}

/// The change of the program, and of the fail-safe value and the hold time.
fn change() -> Arc<OnlineChange> {
    let before = settings(1).fallback;
    let fail_safe = Image::from_bits([true]);
    let after = Fallback { hold_cycles: 1, fail_safe, ..before.clone() };
    Arc::new(OnlineChange {
        before: BEFORE,
        after: AFTER,
        programs: vec![ProgramChange {
            program: PROGRAM,
            before: program(OLD),
            after: program(NEW),
            forward: Arc::new(Same),
            back: Arc::new(Same),
            points: None,
            known_by: [settings(1).layout.hash; 2],
        }],
        fallbacks: vec![FallbackChange { program: PROGRAM, before, after }],
    })
}

/// What became of an order.
fn obeyed(said: &Said) -> Result<(), OrderRefusal> {
    let mut outcomes = said.iter().filter_map(|output| match output {
        Output::Obeyed(outcome) => Some(*outcome),
        _ => None,
    });
    let outcome = outcomes.next().expect("an answer");
    assert!(outcomes.next().is_none(), "one answer");
    outcome
}

/// A remote I/O and the station that follows it.
struct Switching {
    bench: Bench,
    sample: Option<Sample>,
}

impl Switching {
    fn new() -> Self {
        Self { bench: Bench::new(settings(1), 100), sample: None }
    }

    fn order(&mut self, order: &ChangeOrder) -> Result<(), OrderRefusal> {
        let now = self.bench.start() + PERIOD * 9 / 10;
        obeyed(&self.bench.give(now, Input::Change(order)))
    }

    /// A cycle in which the controller is received, with these configurations; the step of its sample.
    fn cycle(&mut self, prepared: Option<ConfigurationHash>) -> Option<Step> {
        self.bench.cycle += 1;
        let before = self.bench.moment();
        let body = match &self.sample {
            Some(sample) => {
                let last = Moment { cycle: Cycle(before.cycle.0 - 1), ..before };
                turn(held_after(sample, last))
            }
            None => join(None, None),
        };
        let frame = self.bench.frame(0, false, body);
        let Frame { header, body } = Arc::unwrap_or_clone(frame);
        let frame = Arc::new(Frame { header: Header { prepared, ..header }, body });
        let said = self.bench.give(self.bench.start(), Input::Frame(&frame));
        let sample = sample_of(&said).cloned();
        let step = sample.as_ref().and_then(|sample| sample.history.last().cloned());
        self.sample = sample.or(self.sample.take());
        let sensors = Image::zero(2);
        self.bench.tell(RemoteIoInput::Field(&sensors));
        self.bench.decide();
        step
    }

    fn start(&mut self) {
        let started = (0..60).any(|_| self.cycle(None).is_some());
        assert!(started, "it starts cold");
        for _ in 0..5 {
            assert_eq!(self.cycle(None).expect("a sample").change, None);
        }
    }
}

/// A remote I/O answers for what it has: no change, no history, a station that has not loaded the change. Of the program that runs already it asks
/// nothing, since the stations may have ended the change.
#[test]
fn a_history_changes_where_no_station_would_be_silent() {
    let change = change();
    let name = change.name();
    let [to_old, to_new] = [OLD, NEW].map(|hash| ChangeOrder::Switch(name, hash));
    let mut remote_io = Switching::new();
    assert_eq!(remote_io.order(&to_new), Err(OrderRefusal::NotPrepared));
    assert_eq!(remote_io.order(&to_old), Err(OrderRefusal::NotPrepared));
    assert_eq!(remote_io.order(&ChangeOrder::Prepare(Arc::clone(&change))), Ok(()));
    assert_eq!(remote_io.order(&to_new), Err(OrderRefusal::NotRunning));
    remote_io.start();
    let stations = StationSet::from_bits(1);
    assert!(stations.contains(StationId(0)));
    let refused = Err(OrderRefusal::StationsNotPrepared { stations });
    assert_eq!(remote_io.order(&to_new), refused);
    let other = ChangeOrder::Switch(name, ProgramHash(77));
    assert_eq!(remote_io.order(&other), Err(OrderRefusal::NotPrepared));
    // To the program that runs, although no station has loaded the change; nothing is marked.
    assert_eq!(remote_io.order(&to_old), Ok(()));
    assert_eq!(remote_io.cycle(None).expect("a sample").change, None);
    assert_eq!(remote_io.order(&to_new), refused);
    remote_io.cycle(Some(AFTER));
    assert_eq!(remote_io.order(&to_new), Ok(()));
    assert_eq!(remote_io.cycle(Some(AFTER)).expect("a sample").change, Some(NEW));
    // While the mark is in the history, neither of the two is all of it.
    remote_io.cycle(None);
    assert_eq!(remote_io.order(&to_new), refused);
    assert_eq!(remote_io.order(&to_old), refused);
    for _ in 0..5 {
        assert_eq!(remote_io.cycle(None).expect("a sample").change, None);
    }
    assert_eq!(remote_io.order(&to_new), Ok(()));
    assert_eq!(remote_io.order(&to_old), refused);
}

/// What is driven from the second deadline without a station on.
fn fail_safe(mut bench: Bench) -> Image {
    let mut driven = None;
    for _ in 0..8 {
        bench.cycle += 1;
        let now = bench.start() + PERIOD * 65 / 100;
        for output in bench.give(now, Input::Wakeup) {
            if let Output::Drive { outputs, .. } = output {
                driven = Some(outputs);
            }
        }
    }
    driven.expect("it drives at each deadline")
}

/// The settings are those of its own configuration, and the device is told with which outputs it is left.
#[test]
fn the_settings_are_those_of_its_own_configuration() {
    let change = change();
    let name = change.name();
    let [low, high] = [Image::from_bits([false]), Image::from_bits([true])];
    let mut remote_io = Switching::new();
    remote_io.order(&ChangeOrder::Prepare(Arc::clone(&change))).expect("loaded");
    remote_io.start();
    assert_eq!(fail_safe(remote_io.bench.clone()), low);
    for (configuration, wanted) in [(AFTER, &high), (BEFORE, &low), (AFTER, &high)] {
        let now = remote_io.bench.start() + PERIOD * 9 / 10;
        let order = ChangeOrder::Run(name, configuration);
        let said = remote_io.bench.give(now, Input::Change(&order));
        obeyed(&said).expect("it runs it");
        let ends_with = said.iter().find_map(|output| match output {
            Output::EndWith(outputs) => Some(outputs),
            _ => None,
        });
        assert_eq!(ends_with, Some(wanted));
        assert_eq!(&fail_safe(remote_io.bench.clone()), wanted);
        // Once more it changes nothing.
        let said = remote_io.bench.give(now, Input::Change(&order));
        assert!(!said.iter().any(|output| matches!(output, Output::EndWith(_))));
    }
    // One that starts again has those of the configuration that it had, whichever its file is of.
    for (own, prepared, wanted) in
        [(BEFORE, Some(AFTER), &low), (AFTER, Some(BEFORE), &high), (AFTER, None, &high)]
    {
        let mut bench = Bench::new(settings(1), 100);
        bench.remote_io = bench.remote_io.changed(&change, Configurations { own, prepared });
        assert_eq!(&fail_safe(bench), wanted);
    }
}
