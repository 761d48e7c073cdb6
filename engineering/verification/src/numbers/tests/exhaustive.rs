//! The reference: all states of small programs, scan by scan on the register machine.

use std::collections::HashMap;

use understudy_testing::random::Dice;
use understudy_typed::{Machine, Program, Scratch};

use super::{PERIOD, ask, lowered};
use crate::numbers::{Answer, Driven, Model};
use crate::property::{Asked, Properties, read_one};

/// Parts of a program, in any order.
const PARTS: [&str; 7] = [
    "IF a THEN x := x + 1; END_IF; IF x > 5 THEN x := 0; END_IF;",
    "IF n > x THEN t := TRUE; ELSIF n = x THEN t := FALSE; END_IF;",
    "x := LIMIT(0, x + n - 1, 5);",
    "IF t AND NOT a THEN x := n; END_IF;",
    "y := x * 2 - n;",
    "IF x = 3 THEN y := y + 1; END_IF; IF y > 4 THEN y := -2; END_IF;",
    "CASE x OF 0: t := a; 1..2: y := n; ELSE t := FALSE; END_CASE;",
];

/// What a scan shows: a, n, x, t, y.
type Values = [i64; 5];

type Holds = fn(&Values) -> bool;

/// What a property says.
enum Said {
    Never(Holds),
    /// The first is followed by the second within so many scans.
    Within(Holds, usize, Holds),
    Reached(Holds),
}

const PROPERTIES: [(&str, Said); 10] = [
    ("never x > 4", Said::Never(|[_, _, x, ..]| *x > 4)),
    ("never x = 5 and t", Said::Never(|[_, _, x, t, _]| *x == 5 && *t == 1)),
    ("never y > 6", Said::Never(|[.., y]| *y > 6)),
    ("always y <= x", Said::Never(|[_, _, x, _, y]| y > x)),
    ("x > n only while t", Said::Never(|[_, n, x, t, _]| x > n && *t == 0)),
    ("never y < -2 and a", Said::Never(|[a, .., y]| *y < -2 && *a == 1)),
    ("within 20ms of t: x > 2", Said::Within(|[_, _, _, t, _]| *t == 1, 2, |[_, _, x, ..]| *x > 2)),
    (
        "within 50ms of t: x >= n",
        Said::Within(|[_, _, _, t, _]| *t == 1, 5, |[_, n, x, ..]| x >= n),
    ),
    ("x = 5 can be reached", Said::Reached(|[_, _, x, ..]| *x == 5)),
    ("y > 8 can be reached", Said::Reached(|[.., y]| *y > 8)),
];

/// All states of a program that can be reached, and what each scan from them shows.
struct Reference<'a> {
    program: &'a Program,
    machine: Machine,
    /// For each state and each of the 8 values of the inputs, what the scan shows and the state behind it.
    scans: Vec<Vec<(Values, usize)>>,
    /// The scans before a state, at least.
    depths: Vec<usize>,
}

impl<'a> Reference<'a> {
    fn new(program: &'a Program) -> Self {
        let machine = Machine::new(program);
        let mut reference = Self { program, machine, scans: Vec::new(), depths: vec![0] };
        let key = |state: &[u64]| state[Program::HEADER as usize..].to_vec();
        let initial = reference.machine.initial().to_vec();
        let mut known = HashMap::from([(key(&initial), 0)]);
        let mut states = vec![initial];
        while reference.scans.len() < states.len() {
            let at = reference.scans.len();
            let mut scans = Vec::new();
            for inputs in 0..8 {
                let mut state = states[at].clone();
                let shown = reference.step(&mut state, inputs & 1, inputs >> 1);
                let next = *known.entry(key(&state)).or_insert(states.len());
                assert!(states.len() < 10_000, "too many states");
                if next == states.len() {
                    states.push(state);
                    reference.depths.push(reference.depths[at] + 1);
                }
                scans.push((shown, next));
            }
            reference.scans.push(scans);
        }
        reference
    }

    fn step(&self, state: &mut [u64], a: u64, n: u64) -> Values {
        let mut image = vec![0; self.machine.input_count().div_ceil(64)];
        let mut outputs = vec![0; self.machine.output_count().div_ceil(64)];
        let set = |image: &mut Vec<u64>, name: &str, value| {
            self.program.inputs.find(name).expect("an input").set(image, value);
        };
        set(&mut image, "a", a);
        set(&mut image, "n", n);
        self.machine.step(&mut Scratch::default(), state, &image, &mut outputs);
        let output = |name: &str| {
            let point = self.program.outputs.find(name).expect("an output");
            point.of.signed(point.get(&outputs)) as i64
        };
        let flag = |name: &str| i64::from(output(name) != 0);
        [a as i64, n as i64, output("x"), flag("t"), output("y")]
    }

    /// Whether a property holds, and the scans of the shortest run that ends where a signal is so.
    fn judge(&self, said: &Said) -> (bool, Option<usize>) {
        let shortest = |is: &dyn Fn(&(Values, usize)) -> bool| {
            let states = self.scans.iter().zip(&self.depths);
            let ending = states.filter(|(scans, _)| scans.iter().any(is));
            ending.map(|(_, depth)| depth + 1).min()
        };
        match said {
            Said::Never(is) => {
                let found = shortest(&|(shown, _)| is(shown));
                (found.is_none(), found)
            }
            Said::Reached(is) => (shortest(&|(shown, _)| is(shown)).is_some(), None),
            Said::Within(first, scans, second) => {
                // Whether some run from a state is without the second for one scan more, and more.
                let mut without = vec![true; self.scans.len()];
                for _ in 0..*scans {
                    let is = |(shown, next): &(Values, usize)| !second(shown) && without[*next];
                    without = self.scans.iter().map(|scans| scans.iter().any(is)).collect();
                }
                let found =
                    shortest(&|(shown, next)| first(shown) && !second(shown) && without[*next]);
                (found.is_none(), None)
            }
        }
    }

    /// Whether what may never be is so in the last scan of a run, on the machine.
    fn ends_with(&self, inputs: &[Driven], is: Holds) -> bool {
        let values = |name: &str| {
            let driven = inputs.iter().find(|driven| driven.name == name);
            driven.map(|driven| driven.values.clone()).unwrap_or_default()
        };
        let mut state = self.machine.initial().to_vec();
        let rows = values("a").into_iter().zip(values("n"));
        let shown: Vec<Values> = rows.map(|(a, n)| self.step(&mut state, a, n)).collect();
        shown.last().is_some_and(is)
    }
}

#[test]
fn verdicts_are_those_of_all_states() {
    let mut dice = Dice::new(11);
    let (mut held, mut failed) = (0, 0);
    for _ in 0..40 {
        let count = 2 + dice.below(3);
        let parts: Vec<&str> = (0..count).map(|_| dice.pick(&PARTS)).collect();
        let text = format!(
            "PROGRAM p VAR_INPUT a : BOOL; n : INT (0..3); END_VAR VAR_OUTPUT x : INT; t : BOOL; y : INT; END_VAR\n{}\nEND_PROGRAM",
            parts.join("\n")
        );
        let program = lowered(&text);
        let reference = Reference::new(&program);
        let read = PROPERTIES.iter().map(|(property, _)| read_one(property, PERIOD));
        let properties = read.map(|read| read.expect("a property")).collect();
        let asked = Properties { properties, ..Properties::default() };
        let model = Model::of_program(&program, &Asked::of([&asked])).expect("followed");
        for (property, said) in &PROPERTIES {
            let (holds, shortest) = reference.judge(said);
            match (ask(&model, property), said) {
                (Answer::Holds(_), _) => assert!(holds, "{property} is not so:\n{text}"),
                (Answer::Fails(Some(run)), Said::Never(is)) => {
                    assert!(!holds, "{property} is so:\n{text}");
                    assert!(reference.ends_with(&run.inputs, *is), "{property}: {run:?}\n{text}");
                    assert_eq!(Some(run.trace.scans.len()), shortest, "{property}:\n{text}");
                }
                (Answer::Fails(_), _) => assert!(!holds, "{property} is so:\n{text}"),
                (undecided, _) => panic!("{property}: {undecided:?}\n{text}"),
            }
            held += usize::from(holds);
            failed += usize::from(!holds);
        }
    }
    assert!(held > 80 && failed > 80, "{held} hold, {failed} fail");
}
