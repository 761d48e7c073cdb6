//! A replica against the naive run of its program over the true history.

use std::collections::HashMap;

use proptest::prelude::*;
use understudy_logic::{Circuit, CircuitBuilder};
use understudy_wire::{
    ClusterHash, ConfigurationHash, Cycle, Epoch, Header, Member, ProgramHash, SamplesReceived,
    Transfer,
};

use super::*;

const HISTORY: usize = 4;
const SHADOW_CYCLES: u32 = 2;
const HASH: ProgramHash = ProgramHash(11);

/// A three-bit register that shifts its input in, and outputs the sum of its bits.
fn shift_register() -> Circuit {
    let mut builder = CircuitBuilder::new("shift");
    let input = builder.input("u");
    let (first, x1) = builder.register("x1", false);
    let (second, x2) = builder.register("x2", true);
    let (third, x3) = builder.register("x3", false);
    builder.set_next(first, input);
    builder.set_next(second, x1);
    builder.set_next(third, x2);
    let sum = builder.graph().sum([x1, x2, x3, input]);
    builder.output("y", sum);
    builder.finish().expect("a circuit")
}

fn versions(program: &Program) -> Versions<'_> {
    Versions::new(program, None, ProgramId(0))
}

fn program() -> Program {
    Program { hash: HASH, executable: (&shift_register()).into() }
}

fn moment(cycle: u64) -> Moment {
    Moment { epoch: Epoch(1), cycle: Cycle(cycle) }
}

/// The remote I/O's side: the true chain of samples, and the state after each by the naive run.
struct Truth {
    circuit: Circuit,
    /// Never repeated, also when samples become void.
    cycle: u64,
    born: Moment,
    inputs: Vec<Image>,
    lineages: Vec<Lineage>,
    states: Vec<[bool; 3]>,
    outputs: HashMap<Lineage, bool>,
}

impl Truth {
    fn new() -> Self {
        let born = moment(0);
        Self {
            circuit: shift_register(),
            cycle: 0,
            born,
            inputs: Vec::new(),
            lineages: vec![Lineage::genesis(HASH, born)],
            states: vec![[false, true, false]],
            outputs: HashMap::new(),
        }
    }

    fn sample(&mut self, bit: bool) -> Arc<Frame> {
        let input = Image::from_bits([bit]);
        let state = *self.states.last().expect("the initial state");
        let lineage = *self.lineages.last().expect("the genesis");
        let assignment = |variable| match variable {
            understudy_logic::Variable::Input(_) => bit,
            understudy_logic::Variable::Register(register) => state[register as usize],
        };
        let graph = self.circuit.graph();
        let next =
            |register: usize| graph.evaluate(self.circuit.registers()[register].next, assignment);
        self.states.push([next(0), next(1), next(2)]);
        let output = graph.evaluate(self.circuit.outputs()[0].value, assignment);
        let after = lineage.after(&input);
        self.lineages.push(after);
        self.outputs.insert(after, output);
        self.inputs.push(input);
        self.cycle += 1;
        self.frame()
    }

    fn frame(&self) -> Arc<Frame> {
        let first = self.inputs.len().saturating_sub(HISTORY);
        Arc::new(Frame {
            header: Header {
                cluster: ClusterHash(1),
                configuration: ConfigurationHash(1),
                prepared: None,
                moment: moment(self.cycle),
                sender: Member::RemoteIo(ProgramId(0)),
                alone: false,
            },
            body: Body::Sample(Sample {
                born: self.born,
                base: self.lineages[first],
                before: self.lineages[self.inputs.len() - 1],
                after: self.lineages[self.inputs.len()],
                history: self.inputs[first..]
                    .iter()
                    .cloned()
                    .map(understudy_wire::Step::of)
                    .collect(),
                applied: None,
                excluded: StationSet::EMPTY,
                gone: StationSet::EMPTY,
                drives: true,
                writes: Default::default(),
                pulses: Default::default(),
                unforced: None,
                version: None,
            }),
        })
    }

    fn transfer(&self, age: usize) -> Transfer {
        let place = self.states.len() - 1 - age.min(self.states.len() - 1);
        Transfer {
            to: StationId(0),
            program: ProgramId(0),
            hash: HASH,
            born: self.born,
            lineage: self.lineages[place],
            stepped: moment(place as u64),
            digest: Digest(0),
            state: Segment::single(&Image::from_bits(self.states[place])),
        }
    }

    /// The samples of the last `samples` cycles are void.
    fn go_back(&mut self, samples: usize) {
        let kept = self.inputs.len() - samples.min(self.inputs.len());
        self.inputs.truncate(kept);
        self.lineages.truncate(kept + 1);
        self.states.truncate(kept + 1);
    }
}

#[derive(Debug, Clone)]
enum Step {
    /// A sample, and whether it is received.
    Sample { bit: bool, received: bool },
    /// Another station gives a state of so many cycles ago.
    Transfer { age: usize },
    /// It is gone and starts again.
    Restart,
    /// The last samples become void.
    Void { samples: usize },
}

fn step() -> impl Strategy<Value = Step> {
    prop_oneof![
        12 => (any::<bool>(), prop::bool::weighted(0.7)).prop_map(|(bit, received)| Step::Sample { bit, received }),
        2 => (0..8_usize).prop_map(|age| Step::Transfer { age }),
        1 => Just(Step::Restart),
        1 => (0..HISTORY).prop_map(|samples| Step::Void { samples }),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(500) })]

    /// Whatever is lost, transferred, voided or restarted: a replica that is current has the true lineage and the true
    /// output, and a replica that has missed no more than the history is current.
    #[test]
    fn a_current_replica_is_true(steps in prop::collection::vec(step(), 1..60)) {
        let program = program();
        let mut scratch = Scratch::default();
        let mut truth = Truth::new();
        let mut replica = Replica::new(ProgramId(0), &program, HISTORY);
        let mut missed = 0;
        for step in steps {
            match step {
                Step::Sample { bit, received } => {
                    let frame = truth.sample(bit);
                    if !received {
                        missed += 1;
                        continue;
                    }
                    let followed = replica.follow(versions(&program), &mut scratch, &frame, SHADOW_CYCLES);
                    let again = replica.follow(versions(&program), &mut scratch, &frame, SHADOW_CYCLES);
                    let current = replica.is_current(frame.header.moment);
                    prop_assert!(!current || followed != Followed::Lost);
                    prop_assert_eq!(again == Followed::Lost, followed == Followed::Lost);
                    if current {
                        let head = truth.lineages[truth.inputs.len()];
                        prop_assert_eq!(replica.lineage(), Some(head));
                        prop_assert_eq!(replica.outputs().get(0), truth.outputs[&head]);
                        missed = 0;
                    } else {
                        prop_assert!(missed >= HISTORY, "{missed} missed");
                    }
                    replica.close_cycle(frame.header.moment);
                }
                Step::Transfer { age } => {
                    let lost = replica.standing() == Standing::Lost;
                    let adopted = replica.adopt(versions(&program), &mut scratch, (StationId(1), &truth.transfer(age)), SHADOW_CYCLES);
                    prop_assert!(lost || !adopted);
                    if adopted {
                        prop_assert_eq!(replica.standing(), Standing::Shadow(SHADOW_CYCLES));
                    }
                }
                Step::Restart => {
                    replica = Replica::new(ProgramId(0), &program, HISTORY);
                    missed = usize::MAX / 2;
                }
                Step::Void { samples } => {
                    truth.go_back(samples);
                    missed = usize::MAX / 2;
                }
            }
        }
    }
}

#[test]
fn a_transferred_state_is_published_only_after_its_shadow_mode() {
    let program = program();
    let mut scratch = Scratch::default();
    let mut truth = Truth::new();
    for cycle in 0..10 {
        truth.sample(cycle % 3 == 0);
    }
    let mut replica = Replica::new(ProgramId(0), &program, HISTORY);
    let follow = |replica: &mut Replica, scratch: &mut Scratch, frame: &Arc<Frame>| {
        replica.follow(versions(&program), scratch, frame, SHADOW_CYCLES)
    };
    assert_eq!(follow(&mut replica, &mut scratch, &truth.frame()), Followed::Lost);
    let wrong = Transfer { hash: ProgramHash(12), ..truth.transfer(0) };
    assert!(!replica.adopt(
        versions(&program),
        &mut scratch,
        (StationId(1), &wrong),
        SHADOW_CYCLES
    ));
    assert!(!replica.adopt(
        versions(&program),
        &mut scratch,
        (StationId(1), &truth.transfer(7)),
        SHADOW_CYCLES
    ));
    assert!(replica.adopt(
        versions(&program),
        &mut scratch,
        (StationId(1), &truth.transfer(2)),
        SHADOW_CYCLES
    ));
    let mut proved = Vec::new();
    for _ in 0..3 {
        let frame = truth.sample(true);
        assert_eq!(follow(&mut replica, &mut scratch, &frame), Followed::Synchronised);
        assert_eq!(replica.may_publish(frame.header.moment), proved.contains(&true));
        proved.push(replica.close_cycle(frame.header.moment));
    }
    assert_eq!(proved, [false, true, false]);
}

/// A copy of a sample is not a second sample: its outputs may have been proved before a restart.
#[test]
fn a_station_is_a_witness_from_its_second_sample_on() {
    let program = program();
    let mut truth = Truth::new();
    let mut replica = Replica::new(ProgramId(0), &program, HISTORY);
    let mut remember = |frame: &Frame| {
        let Body::Sample(sample) = &frame.body else {
            panic!("a sample");
        };
        replica.remember(versions(&program), frame.header.moment, sample, SamplesReceived::First);
        let recalled = replica.recalled(moment(0)).expect("it was received");
        recalled.received == SamplesReceived::Later
    };
    let first = truth.sample(true);
    assert!(!remember(&first));
    assert!(!remember(&first));
    let second = truth.sample(true);
    assert!(remember(&second));
    assert!(remember(&second));
}
