//! What is proved of a changed ladder, against stations that change: random ladders, their state converted as stations convert it.

use understudy_bits::{SameNames, Switch};
use understudy_cluster::{ChangeTexts, Cluster, Overrides, nearest_of, origins, read_with};
use understudy_cycle::ProgramChange;
use understudy_executable::{Executable, Scratch};
use understudy_ladder::{Program, print};
use understudy_testing::random::{Dice, random_program};
use understudy_verification::numbers::{Answer, Difference, Run};
use understudy_verification::program::Bounds;

fn cluster(text: &str) -> Option<Cluster> {
    let file = "[cluster]\nname = \"cell\"\nperiod = \"100ms\"\n[[controller]]\nname = \"one\"\nladder = \"one.ladder\"\n";
    let mut open = |_: &str| Ok(text.to_owned());
    read_with("cluster.toml", file, Overrides::default(), &mut open).cluster
}

/// The same with a rung less, two rungs in another order or another coil.
fn changed(program: &Program, dice: &mut Dice) -> Program {
    let mut changed = program.clone();
    let place = dice.below(changed.rungs.len());
    match dice.below(3) {
        0 => drop(changed.rungs.remove(place)),
        1 => changed.rungs.swap(0, place),
        _ => {
            let target = changed.outputs[dice.below(changed.outputs.len())].name.clone();
            changed.rungs[place].coils[0].target = target;
        }
    }
    changed
}

/// Outputs of a scan, which changes the state.
fn scan(executable: &Executable, state: &mut [u64], inputs: &[u64]) -> Vec<u64> {
    let mut outputs = vec![0; executable.output_count().div_ceil(64)];
    executable.step(&mut Scratch::default(), state, inputs, &mut outputs);
    outputs
}

/// Both programs in a scan: the old one, and the new one once it has taken over.
struct Both<'c> {
    change: &'c ProgramChange,
    old: Vec<u64>,
    new: Option<Vec<u64>>,
}

impl<'c> Both<'c> {
    fn new(change: &'c ProgramChange) -> Self {
        Self { change, old: change.before.executable.initial().to_vec(), new: None }
    }

    /// The outputs of both, once the program has changed.
    fn step(&mut self, inputs: &[u64], changes: bool) -> Option<[Vec<u64>; 2]> {
        if changes && self.new.is_none() {
            self.new = Some(self.change.forward.convert(&self.old));
        }
        let left = scan(&self.change.before.executable, &mut self.old, inputs);
        let new = self.new.as_mut()?;
        Some([left, scan(&self.change.after.executable, new, inputs)])
    }
}

#[derive(Debug, Default)]
struct Counts {
    equal: u32,
    differs: u32,
    left_out: u32,
    undecided: u32,
}

fn check(seed: u64, counts: &mut Counts) {
    let mut dice = Dice::new(seed);
    let program = random_program(seed, 6);
    let (before, after) = (print(&program), print(&changed(&program, &mut dice)));
    let (Some(old), Some(new)) = (cluster(&before), cluster(&after)) else { return };
    let Ok(texts) = ChangeTexts::between(&old, &new) else { return };
    let change = texts.load(&old).expect("a change of this cluster");
    let [change] = &change.programs[..] else { return };
    let (code, next) = (&old.controllers()[0].code, &new.controllers()[0].code);
    let told = format!("seed {seed}\n{before}\nto\n{after}");
    if nearest_of(code, next).is_some() {
        counts.left_out += 1;
        return;
    }
    let origins = origins(code, next);
    let switch = Switch::AnyScan { origins: &origins };
    let same = SameNames::by_name(code.typed(), next.typed());
    let difference = Difference::between(code.typed(), next.typed(), switch, &same);
    let difference = difference.unwrap_or_else(|error| panic!("{told}\n{error}"));
    let answers = difference.check(Bounds::default(), &mut || {});
    let points = &old.controllers()[0].interface.outputs;
    let width = change.before.executable.input_count();
    let mut equal = Vec::new();
    for (name, answer) in difference.outputs().zip(answers) {
        let point = points.find(name).expect("an output");
        match answer {
            Answer::Holds(_) => {
                counts.equal += 1;
                equal.push(point);
            }
            Answer::Fails(Some(run)) => {
                counts.differs += 1;
                let last = repeated(change, &old, &difference, &run);
                let [left, right] =
                    last.unwrap_or_else(|| panic!("{told}\n`{name}` never changes"));
                assert_ne!(point.get(&left), point.get(&right), "{told}\n`{name}`: {run:?}");
            }
            Answer::Undecided(_) if !difference.any_values().is_empty() => counts.undecided += 1,
            other => panic!("{told}\n`{name}`: {other:?}"),
        }
    }
    for _ in 0..30 {
        let mut both = Both::new(change);
        let mut inputs = vec![0_u64; width.div_ceil(64)];
        for _ in 0..60 {
            if dice.rarely(3) {
                let place = dice.below(width);
                inputs[place / 64] ^= 1 << (place % 64);
            }
            if let Some([left, right]) = both.step(&inputs, dice.rarely(20)) {
                for point in &equal {
                    assert_eq!(point.get(&left), point.get(&right), "{told}\n`{}`", point.name);
                }
            }
        }
    }
}

/// The outputs of both programs in the last scan of a run that was shown.
fn repeated(
    change: &ProgramChange,
    old: &Cluster,
    difference: &Difference,
    run: &Run,
) -> Option<[Vec<u64>; 2]> {
    let names = difference.circuit().inputs();
    let points = &old.controllers()[0].interface.inputs;
    let mut both = Both::new(change);
    let mut last = None;
    for row in &run.trace.scans {
        let of = |name: &str| {
            let place = names.iter().position(|input| input == name);
            place.is_some_and(|place| row.inputs[place])
        };
        let mut inputs = vec![0; points.width().div_ceil(64)];
        for point in points.iter() {
            point.set(&mut inputs, of(&point.name).into());
        }
        last = both.step(&inputs, of("change"));
    }
    last
}

#[test]
fn what_is_proved_of_changed_ladders_is_what_stations_do() {
    let mut counts = Counts::default();
    (0..400).for_each(|seed| check(seed, &mut counts));
    assert!(counts.equal > 60 && counts.differs > 15, "{counts:?}");
    assert!(counts.left_out < 50, "{counts:?}");
}
