//! Differences after an online change, against runs of both programs: random pairs of small programs, from every state and from one.

use std::collections::{HashMap, HashSet};
use std::fmt::Write as _;

use understudy_bits::{SameNames, Switch};
use understudy_structured_text::{Options, lower, parser};
use understudy_typed::{Interpreter, Program, Successor, Told};
use understudy_verification::numbers::{Answer, Difference, Run};
use understudy_verification::program::Bounds;

/// Scans of the runs that are all tried.
const DEPTH: usize = 8;
/// Pairs of states of one depth that are followed.
const PAIRS: usize = 1_500;

fn lowered(text: &str) -> Program {
    let (file, _) = parser::parse(text);
    let lowered = lower(&file, &Options { text, ..Options::default() });
    lowered.program.unwrap_or_else(|| panic!("{text}\n{:?}", lowered.diagnostics))
}

/// Numbers from a seed (SplitMix64).
struct Dice(u64);

impl Dice {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ (mixed >> 31)) % bound as u64) as usize
    }

    fn one<'a>(&mut self, of: &[&'a str]) -> &'a str {
        of[self.below(of.len())]
    }

    fn condition(&mut self) -> String {
        let signals = ["a", "b", "m", "x", "y", "t.Q", "e.Q", "k >= 1", "t.ET >= T#20ms"];
        let not = self.one(&["", "", "NOT "]);
        let first = self.one(&signals);
        match self.below(3) {
            0 => format!("{not}({first})"),
            _ => {
                let between = self.one(&["AND", "OR", "XOR"]);
                format!("{not}({first}) {between} ({})", self.one(&signals))
            }
        }
    }
}

/// A program before it is written.
#[derive(Clone)]
struct Sketch {
    types: HashMap<&'static str, &'static str>,
    statements: Vec<String>,
}

impl Sketch {
    fn new(dice: &mut Dice) -> Self {
        let kind = dice.one(&["TON", "TON", "TOF", "TP"]);
        let types = HashMap::from([("m", "BOOL"), ("k", "INT"), ("t", kind), ("e", "R_TRIG")]);
        let mut statements: Vec<String> =
            (0..3 + dice.below(3)).map(|_| Self::statement(dice)).collect();
        let shown =
            |dice: &mut Dice| dice.one(&["m", "t.Q", "e.Q", "k >= 1", "m XOR t.Q"]).to_owned();
        statements.push(format!("x := {};", shown(dice)));
        statements.push(format!("y := {};", shown(dice)));
        statements.push("n := k;".to_owned());
        Self { types, statements }
    }

    fn statement(dice: &mut Dice) -> String {
        let condition = dice.condition();
        match dice.below(5) {
            0 => format!("m := {condition};"),
            1 => {
                let last = 1 + dice.below(3);
                format!(
                    "IF {condition} THEN k := k + 1; END_IF; IF k > {last} THEN k := 0; END_IF;"
                )
            }
            2 | 3 => format!("t(IN := {condition}, PT := T#{}0ms);", 1 + dice.below(4)),
            _ => format!("e(CLK := {condition}); IF e.Q THEN m := NOT m; END_IF;"),
        }
    }

    /// Another program, mostly with the same variables.
    fn changed(&self, dice: &mut Dice) -> Self {
        let mut changed = self.clone();
        let place = dice.below(changed.statements.len());
        match dice.below(10) {
            0 => drop(changed.types.insert("t", "TON")),
            1 => drop(changed.types.insert("k", "DINT")),
            2 => {
                changed.types.remove("m");
                changed.types.insert("other", "BOOL");
                for statement in &mut changed.statements {
                    *statement = statement.replace('m', "other").replace("others", "ms");
                }
            }
            3 => changed.statements.swap(0, place),
            4 | 5 => {
                let [short, long] = ["T#10ms", "T#40ms"];
                let turn =
                    |statement: &String| statement.replace(short, "T#30ms").replace(long, short);
                changed.statements = changed.statements.iter().map(turn).collect();
            }
            6 => changed.statements.insert(place, changed.statements[place].clone()),
            _ => changed.statements[place] = Self::statement(dice),
        }
        changed
    }

    /// The same with a preset that the timer has from its declaration, or from a variable; what the online change keeps is that of the old program.
    fn with_kept_preset(mut self, dice: &mut Dice, in_variable: bool) -> Self {
        let (of, preset) = match in_variable {
            true => ("p", ["TIME := T#10ms", "TIME := T#30ms", "TIME := T#40ms"]),
            false => {
                let of_timer =
                    ["TON := (PT := T#10ms)", "TON := (PT := T#30ms)", "TON := (PT := T#40ms)"];
                ("t", of_timer)
            }
        };
        self.types.insert(of, dice.one(&preset));
        for statement in &mut self.statements {
            for tens in 1..=4 {
                let given = format!(", PT := T#{tens}0ms");
                *statement = statement.replace(&given, if in_variable { ", PT := p" } else { "" });
            }
        }
        if in_variable && dice.below(3) == 0 {
            let preset = 1 + dice.below(5);
            self.statements.insert(0, format!("IF a AND b THEN p := T#{preset}0ms; END_IF;"));
        }
        self
    }

    /// The same with a preset that grows without an end.
    fn with_growing_preset(mut self) -> Self {
        self.types.insert("p", "TIME := T#10ms");
        for statement in &mut self.statements {
            for tens in 1..=4 {
                *statement = statement.replace(&format!(", PT := T#{tens}0ms"), ", PT := p");
            }
        }
        self.statements.insert(0, "IF a AND b THEN p := p + T#10ms; END_IF;".to_owned());
        self
    }

    fn program(&self) -> Program {
        let mut text = String::from(
            "PROGRAM p\n VAR_INPUT a, b : BOOL; END_VAR\n VAR_OUTPUT x, y : BOOL; n : DINT; END_VAR\n VAR ",
        );
        let mut types: Vec<_> = self.types.iter().collect();
        types.sort_unstable();
        for (name, of) in types {
            let _ = write!(text, "{name} : {of}; ");
        }
        let _ = write!(text, "END_VAR\n {}\nEND_PROGRAM", self.statements.join("\n "));
        lowered(&text)
    }
}

/// Both programs, and how the state of one becomes that of the other.
struct Pair {
    old: Program,
    new: Program,
    engines: [Interpreter; 2],
    successor: Successor,
}

impl Pair {
    fn new(old: Program, new: Program) -> Self {
        let engines = [Interpreter::new(&old), Interpreter::new(&new)];
        let successor = Successor::new(&old, &new, &HashMap::new(), Vec::new());
        Self { old, new, engines, successor }
    }

    fn converted(&self, state: &[u64]) -> Vec<u64> {
        self.successor.state(state, Told::ALL)
    }

    /// The state of one of the programs after a scan, and its outputs in the order of its points.
    fn scan(&self, which: usize, state: &[u64], inputs: [bool; 2]) -> (Vec<u64>, Vec<u64>) {
        let program = [&self.old, &self.new][which];
        let mut image = program.inputs.initial_image();
        for (name, value) in ["a", "b"].into_iter().zip(inputs) {
            let point = program.inputs.find(name).expect("an input");
            point.set(&mut image, value.into());
        }
        let mut outputs = vec![0; program.outputs.width().div_ceil(64)];
        let mut state = state.to_vec();
        self.engines[which].step(&mut state, &image, &mut outputs);
        let values = program.outputs.iter().map(|point| point.get(&outputs));
        (state, values.collect())
    }

    /// For each output the fewest scans after which it can differ, of those that were tried; and whether all were.
    fn naive(&self, start: Option<&[u64]>) -> (Vec<Option<usize>>, bool) {
        let mut olds: HashSet<Vec<u64>> = HashSet::new();
        let mut pairs: HashSet<[Vec<u64>; 2]> = HashSet::new();
        match start {
            Some(state) => {
                pairs.insert([state.to_vec(), self.converted(state)]);
            }
            None => {
                olds.insert(self.engines[0].initial().to_vec());
            }
        }
        let mut found = vec![None; self.new.outputs.len()];
        let mut is_whole = true;
        for scans in 1..=DEPTH {
            pairs.extend(olds.iter().map(|state| [state.clone(), self.converted(state)]));
            is_whole &= pairs.len() <= PAIRS && olds.len() <= PAIRS;
            let mut next = HashSet::new();
            for [one, other] in pairs.iter().take(PAIRS) {
                for inputs in INPUTS {
                    let [(one, left), (other, right)] =
                        [self.scan(0, one, inputs), self.scan(1, other, inputs)];
                    for (output, known) in found.iter_mut().enumerate() {
                        if known.is_none() && left[output] != right[output] {
                            *known = Some(scans);
                        }
                    }
                    next.insert([one, other]);
                }
            }
            pairs = next;
            let after = olds
                .iter()
                .take(PAIRS)
                .flat_map(|state| INPUTS.map(|inputs| self.scan(0, state, inputs).0));
            olds = after.collect();
        }
        (found, is_whole)
    }

    /// Whether an output differs in the last scan of a run.
    fn differs(
        &self,
        difference: &Difference,
        run: &Run,
        start: Option<&[u64]>,
        output: usize,
    ) -> bool {
        let circuit = difference.circuit();
        let mut old = start.unwrap_or(self.engines[0].initial()).to_vec();
        let mut new = start.map(|state| self.converted(state));
        let mut is_apart = false;
        for row in &run.trace.scans {
            let of = |name: &str| {
                let place = circuit.inputs().iter().position(|input| input == name);
                place.is_some_and(|place| row.inputs[place])
            };
            if of("change") && new.is_none() {
                new = Some(self.converted(&old));
            }
            let inputs = ["a", "b"].map(of);
            let (after, left) = self.scan(0, &old, inputs);
            old = after;
            is_apart = false;
            if let Some(state) = &mut new {
                let (after, right) = self.scan(1, state, inputs);
                is_apart = left[output] != right[output];
                *state = after;
            }
        }
        is_apart
    }
}

const INPUTS: [[bool; 2]; 4] = [[false, false], [false, true], [true, false], [true, true]];

/// Verdicts of the outputs of random pairs.
#[derive(Debug, Default)]
struct Counts {
    equal: u32,
    differs: u32,
    undecided: u32,
}

fn check(seed: u64, from_one_state: bool, counts: &mut Counts) {
    let mut dice = Dice(seed);
    let old = Sketch::new(&mut dice);
    let new = old.changed(&mut dice);
    check_pair(seed, (old, new), dice, from_one_state, counts);
}

fn check_pair(
    seed: u64,
    (old, new): (Sketch, Sketch),
    mut dice: Dice,
    from_one_state: bool,
    counts: &mut Counts,
) {
    let pair = Pair::new(old.program(), new.program());
    let told =
        format!("seed {seed}\n{}\nto\n{}", old.statements.join("\n"), new.statements.join("\n"));
    let mut state = pair.engines[0].initial().to_vec();
    for _ in 0..dice.below(12) {
        state = pair.scan(0, &state, INPUTS[dice.below(4)]).0;
    }
    compare(&told, &pair, from_one_state.then_some(state.as_slice()), counts);
}

/// Compares what is proved of a pair with its runs, from every state or from one; the outputs that are proved to be alike.
fn compare(told: &str, pair: &Pair, start: Option<&[u64]>, counts: &mut Counts) -> Vec<String> {
    let origins = pair.successor.origins();
    let after = start.map(|state| pair.converted(state));
    let switch = match (start, &after) {
        (Some(before), Some(after)) => Switch::Now { before, after },
        _ => Switch::AnyScan { origins: &origins },
    };
    let same = SameNames::by_name(&pair.old, &pair.new);
    let difference = Difference::between(&pair.old, &pair.new, switch, &same);
    let difference = difference.unwrap_or_else(|error| panic!("{told}\n{error}"));
    let is_exact = difference.inexact().is_none();
    assert!(is_exact || start.is_none(), "{told}");
    let (found, is_whole) = pair.naive(start);
    let answers = difference.check(Bounds::default(), &mut || {});
    let mut alike = Vec::new();
    for (output, (answer, found)) in answers.into_iter().zip(found).enumerate() {
        let name = &pair.new.outputs.iter().nth(output).expect("an output").name;
        match answer {
            Answer::Holds(_) => {
                counts.equal += 1;
                assert_eq!(found, None, "{told}\n`{name}` differs");
                alike.push(name.clone());
            }
            Answer::Fails(Some(run)) => {
                counts.differs += 1;
                assert!(pair.differs(&difference, &run, start, output), "{told}\n`{name}` {run:?}");
                let scans = run.trace.scans.len();
                if is_exact && is_whole && scans <= DEPTH {
                    assert_eq!(found, Some(scans), "{told}\n`{name}`: the run is no shortest one");
                }
                assert!(found.is_none_or(|found| found <= scans || !is_whole), "{told}\n`{name}`");
            }
            Answer::Undecided(_) if !is_exact => counts.undecided += 1,
            other => panic!("{told}\n`{name}`: {other:?}"),
        }
    }
    alike
}

#[test]
fn differences_from_any_scan_are_those_of_runs() {
    let mut counts = Counts::default();
    (0..200).for_each(|seed| check(seed, false, &mut counts));
    assert!(counts.equal > 80 && counts.differs > 80, "{counts:?}");
    assert!(counts.undecided < 80, "{counts:?}");
}

#[test]
fn differences_from_one_state_are_those_of_runs() {
    let mut counts = Counts::default();
    (1_000..1_200).for_each(|seed| check(seed, true, &mut counts));
    assert!(counts.equal > 80 && counts.differs > 80, "{counts:?}");
    assert!(counts.undecided == 0, "{counts:?}");
}

/// A preset that no statement writes is not that of the new program: the old one's is kept.
#[test]
fn presets_that_are_kept_are_those_of_before() {
    let mut counts = Counts::default();
    for seed in 2_000..2_200 {
        let mut dice = Dice(seed);
        let old = Sketch::new(&mut dice);
        let new = if seed % 4 < 2 { old.clone() } else { old.changed(&mut dice) };
        let in_variable = seed % 8 < 4;
        let [old, new] = [old, new].map(|it| it.with_kept_preset(&mut dice, in_variable));
        check_pair(seed, (old, new), dice, seed % 2 == 0, &mut counts);
    }
    assert!(counts.equal > 80 && counts.differs > 50, "{counts:?}");
}

/// A preset that grows without an end: the time since the start of its timer is not counted.
#[test]
fn times_without_an_end_prove_nothing_that_is_wrong() {
    let mut counts = Counts::default();
    for seed in 3_000..3_040 {
        let mut dice = Dice(seed);
        let old = Sketch::new(&mut dice);
        let new = if seed % 4 < 2 { old.clone() } else { old.changed(&mut dice) };
        let [old, new] = [(old, seed % 3 != 1), (new, seed % 3 != 0)]
            .map(|(it, grows)| if grows { it.with_growing_preset() } else { it });
        check_pair(seed, (old, new), dice, false, &mut counts);
    }
    assert!(counts.equal > 15 && counts.differs > 10, "{counts:?}");
}

/// What a timer has counted in the old program counts in the new one, in whatever way each of them counts it; and what does not depend on the timer is
/// proved all the same.
#[test]
fn times_go_on_where_two_programs_count_them_in_another_way() {
    let program = |variables: &str, body: &str| {
        lowered(&format!(
            "PROGRAM p\n VAR_INPUT a, b : BOOL; END_VAR\n VAR_OUTPUT x, y : BOOL; END_VAR\n VAR t : TON; s : TIME; m : BOOL; {variables} END_VAR\n {body} y := b;\nEND_PROGRAM"
        ))
    };
    let grows = "IF b THEN p := p + T#10ms; END_IF;";
    let once = "k : INT;";
    let twice = "IF k < 2 THEN k := k + 1; END_IF;";
    let since = "IF a AND NOT m THEN s := TIME(); END_IF; m := a;";
    let cases = [
        // Not counted, and then counted.
        (
            ("p : TIME := T#20ms;", format!("{grows} t(IN := a, PT := p); x := b;")),
            (once, format!("{twice} t(IN := a, PT := T#30ms); x := b XOR (t.Q AND k < 2);")),
        ),
        // Counted in scans, and then not.
        (
            ("", "t(IN := a, PT := T#40ms); x := b;".to_owned()),
            (
                "p : TIME := T#10ms; k : INT;",
                format!("{grows} {twice} t(IN := a, PT := p); x := b XOR (t.Q AND k < 2);"),
            ),
        ),
        // Since the start, of which the old program asks without an end.
        (
            ("p : TIME := T#20ms;", format!("{grows} x := b; m := TIME() >= p;")),
            (once, format!("{twice} x := b XOR (TIME() >= T#30ms AND k < 2);")),
        ),
        // Counted as far as it is compared, and then without an end.
        (
            ("", format!("{since} x := b OR TIME() - s >= T#20ms;")),
            (
                "p : TIME := T#50ms; k : INT;",
                format!(
                    "{grows} {twice} {since} x := b OR TIME() - s >= T#20ms AND NOT (TIME() - s >= p AND k < 2);"
                ),
            ),
        ),
        // Of a program that can stop, a timer that only the new one has.
        (
            ("k : INT;", "k := 10 / (k + 1); x := b;".to_owned()),
            (
                "k : INT; u : TON;",
                "k := 10 / (k + 1); u(IN := a, PT := T#30ms); x := b XOR (u.Q AND NOT m);"
                    .to_owned(),
            ),
        ),
    ];
    for ((of_old, old), (of_new, new)) in cases {
        let pair = Pair::new(program(of_old, &old), program(of_new, &new));
        let (told, mut counts) = (format!("{old}\nto\n{new}"), Counts::default());
        let alike = compare(&told, &pair, None, &mut counts);
        assert!(alike.contains(&"y".to_owned()), "{told}\n{alike:?}");
        assert!(pair.naive(None).0[0].is_some(), "{told}\nno run shows that `x` differs");
        assert!(!alike.contains(&"x".to_owned()), "{told}");
    }
}
