//! Properties of programs with numbers.

mod compared;
mod exhaustive;

use std::time::Duration;

use understudy_bits::Source;
use understudy_structured_text::{Options, lower};
use understudy_typed::Program;

use super::{Answer, Bounds, Member, Model};
use crate::property::{Asked, read_one};

/// From one scan to the next.
const PERIOD: Duration = Duration::from_millis(10);

fn lowered(text: &str) -> Program {
    let (file, _) = understudy_structured_text::parser::parse(text);
    let options = Options { text, ..Options::default() };
    let lowered = lower(&file, &options);
    lowered.program.unwrap_or_else(|| panic!("{:?}", lowered.diagnostics))
}

/// A chart of steps in a number, an enumeration.
const CHART: &str = include_str!("../../../../programs/bits/src/tests/chart.st");

/// Blocks, references, reals that are kept.
const BLOCKS: &str = include_str!("../../../../programs/bits/src/tests/blocks.st");

fn ask(model: &Model, property: &str) -> Answer {
    let property = read_one(property, PERIOD).expect("a property");
    let resolved = model.resolve(&property).expect("known names");
    let mut answers = model.check(&[resolved], &[], Bounds::default(), &mut || {});
    answers.remove(0)
}

#[test]
fn what_holds_for_all_numbers_is_proved() {
    let model = Model::of_program(&lowered(CHART), &Asked::default()).expect("followed");
    assert_eq!(ask(&model, "never pump and program.fault"), Answer::Holds(None));
    assert!(matches!(ask(&model, "never done"), Answer::Fails(Some(_))));
    // Enumerations and step numbers are followed bit by bit, so that what can happen is known as well.
    assert!(matches!(ask(&model, "AG EF pump"), Answer::Holds(_)));
    let model = Model::of_program(&lowered(BLOCKS), &Asked::default()).expect("followed");
    assert_eq!(ask(&model, "AG (alarm -> AX (alarm | !alarm))"), Answer::Holds(None));
}

#[test]
fn the_order_of_comparisons_is_kept() {
    let program = lowered(
        "PROGRAM p
           VAR_INPUT a : REAL; b : REAL; END_VAR
           VAR_OUTPUT high : BOOL; higher : BOOL; END_VAR
           VAR t : REAL; END_VAR
           t := a * b;
           high := t > 80.0;
           higher := t > 90.0;
         END_PROGRAM",
    );
    let model = Model::of_program(&program, &Asked::default()).expect("followed");
    assert_eq!(ask(&model, "never higher and not high"), Answer::Holds(None));
    let Answer::Fails(Some(run)) = ask(&model, "never high and not higher") else {
        panic!("it fails");
    };
    let last = run.trace.scans.len() - 1;
    let number = |name: &str| -> f64 {
        let row = run.numbers.iter().find(|row| row.name == name);
        row.expect("the input is shown").values[last].parse().expect("a number")
    };
    let product = number("a") * number("b");
    assert!(product > 80.0 && product <= 90.0, "{product}");
}

#[test]
fn what_no_number_does_is_undecided_with_the_comparison() {
    let program = lowered(
        "PROGRAM p
           VAR_INPUT a : LREAL; END_VAR
           VAR_OUTPUT odd : BOOL; END_VAR
           odd := a * a < 0.0;
         END_PROGRAM",
    );
    let model = Model::of_program(&program, &Asked::default()).expect("followed");
    let Answer::Undecided(reason) = ask(&model, "never odd") else {
        panic!("no square is negative");
    };
    assert!(reason.contains("a * a < 0.0"), "{reason}");
}

/// No counterexample has an input outside of its declaration, alone or in a cluster.
#[test]
fn inputs_keep_their_subranges() {
    let program = lowered(
        "PROGRAM p
           VAR_INPUT x : INT (10..100); END_VAR
           VAR_OUTPUT low : BOOL; at_end : BOOL; high : BOOL; END_VAR
           low := x < 10;
           at_end := x = 100;
           high := x > 100;
         END_PROGRAM",
    );
    let alone = Model::of_program(&program, &Asked::default()).expect("followed");
    let member = |source| Member { name: "p".to_owned(), program: &program, sources: vec![source] };
    let of_cluster =
        |source| Model::of_cluster("cell", &[member(source)], &Asked::default()).expect("followed");
    let x = program.inputs.find("x").expect("an input");
    // Whatever the source is: a scan makes values of the subrange of all others.
    let models = [
        (alone, ""),
        (of_cluster(Source::declared(x)), "p."),
        (of_cluster(Source::Any(None)), "p."),
    ];
    for (model, prefix) in models {
        let never = |name: &str| ask(&model, &format!("never {prefix}{name}"));
        assert_eq!(never("low"), Answer::Holds(None));
        assert_eq!(never("high"), Answer::Holds(None));
        assert!(matches!(never("at_end"), Answer::Fails(Some(_))), "it is the greatest value");
    }
    let model = Model::of_program(&program, &Asked::default()).expect("followed");
    for property in ["never at_end", "always at_end"] {
        let Answer::Fails(Some(run)) = ask(&model, property) else {
            panic!("{property} fails");
        };
        let values = run.numbers.iter().filter(|row| row.name == "x").flat_map(|row| &row.values);
        for value in values {
            let value: i64 = value.parse().expect("a number");
            assert!((10..=100).contains(&value), "{value}");
        }
    }
}

fn signal(program: usize, output: &str, default: u64) -> Source {
    Source::Signal { program, output: output.to_owned(), default, stale_after: 0 }
}

#[test]
fn two_programs_keep_what_each_alone_does_not() {
    let ask_of = |right: &str| {
        let left = lowered(
            "PROGRAM left
               VAR_INPUT wants : BOOL; right_wants : BOOL; right_inside : BOOL; END_VAR
               VAR_OUTPUT inside : BOOL; grant : BOOL; END_VAR
               VAR granted : BOOL; END_VAR
               granted := grant;
               grant := NOT inside AND (right_wants OR (grant AND right_inside));
               inside := wants AND (inside OR NOT grant AND NOT granted AND NOT right_inside);
             END_PROGRAM",
        );
        let right = lowered(right);
        let members = [
            Member {
                name: "left".to_owned(),
                program: &left,
                sources: vec![Source::Any(None), signal(1, "wants_in", 0), signal(1, "inside", 1)],
            },
            Member {
                name: "right".to_owned(),
                program: &right,
                sources: vec![Source::Any(None), signal(0, "grant", 0)],
            },
        ];
        let model = Model::of_cluster("cell", &members, &Asked::default()).expect("followed");
        ask(&model, "never left.inside and right.inside")
    };
    let careful = "PROGRAM right
           VAR_INPUT wants : BOOL; granted : BOOL; END_VAR
           VAR_OUTPUT inside : BOOL; wants_in : BOOL; END_VAR
           wants_in := wants;
           inside := wants AND (inside OR granted);
         END_PROGRAM";
    assert_eq!(ask_of(careful), Answer::Holds(None));
    let careless = careful.replace("inside OR granted", "inside OR wants_in");
    assert!(matches!(ask_of(&careless), Answer::Fails(Some(_))));
}

/// Three tasks with counters: what a run of 26 scans shows is found without diagrams and lists, for which it is large.
#[test]
fn a_run_that_breaks_an_invariant_soon_is_searched_first() {
    let program = lowered(
        "PROGRAM fast VAR_INPUT go : BOOL; END_VAR VAR_OUTPUT n : INT; f : BOOL; END_VAR
           IF go THEN n := n + 1; END_IF;
           IF n > 1000 THEN n := 0; END_IF;
           f := n = 10;
         END_PROGRAM
         PROGRAM mid VAR_INPUT up : BOOL; END_VAR VAR_OUTPUT m : INT; g : BOOL; END_VAR
           IF up THEN m := m + 2; ELSE m := m - 1; END_IF;
           IF m > 500 THEN m := 0; END_IF;
           g := m > 20;
         END_PROGRAM
         PROGRAM slow VAR_INPUT x : BOOL; END_VAR VAR_OUTPUT k : INT; h : BOOL; END_VAR
           IF x THEN k := k + 3; END_IF;
           IF k > 3000 THEN k := 0; END_IF;
           h := k > 15;
         END_PROGRAM
         CONFIGURATION c RESOURCE r ON PLC
           TASK a(INTERVAL := T#10ms, PRIORITY := 1); TASK b(INTERVAL := T#20ms, PRIORITY := 2); TASK d(INTERVAL := T#50ms, PRIORITY := 3);
           PROGRAM one WITH a : fast; PROGRAM two WITH b : mid; PROGRAM three WITH d : slow;
         END_RESOURCE END_CONFIGURATION",
    );
    let model = Model::of_program(&program, &Asked::default()).expect("followed");
    let bounds = Bounds { nodes: 1_000, states: 10, scans: 1, ..Bounds::default() };
    let property = read_one("never one.f and two.g and three.h", PERIOD).expect("a property");
    let resolved = model.resolve(&property).expect("known names");
    let answers = model.check(&[resolved], &[], bounds, &mut || {});
    let [Answer::Fails(Some(run))] = answers.as_slice() else {
        panic!("{answers:?}");
    };
    assert_eq!(run.trace.scans.len(), 26, "the shortest run");
}
