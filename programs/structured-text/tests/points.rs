//! The points of a program are those of its declarations: the parts of structures and arrays, with the names of their types.

use understudy_structured_text::{Options, lower, parse};
use understudy_typed::{Machine, Scratch};

#[test]
fn a_point_of_a_long_type_has_its_name() {
    let text = "TYPE
  Span : LTIME;
  Log : STRUCT spent : Span; day : LDATE; short : TIME; when : ARRAY [0..1] OF LDT; END_STRUCT;
END_TYPE
PROGRAM p
  VAR_INPUT a : LTIME; b : TIME; c : Span; d : ARRAY [1..2] OF LTOD; e : Log; f AT %ID4 : LTIME; g : LINT; END_VAR
  VAR_OUTPUT q : LTIME_OF_DAY; r : DT; END_VAR
  q := d[1]; r := e.when[0];
END_PROGRAM
";
    let (file, found) = parse(text);
    assert!(found.is_empty(), "{found:?}");
    let lowered = lower(&file, &Options { text, ..Options::default() });
    let program = lowered.program.unwrap_or_else(|| panic!("{:?}", lowered.diagnostics));
    let shown = program.inputs.iter().chain(&program.outputs).filter(|point| point.slot != 0);
    let shown: Vec<String> =
        shown.map(|point| format!("{} : {}", point.name, point.declared())).collect();
    let expected = [
        "a : LTIME",
        "b : TIME",
        "c : LTIME",
        "d[1] : LTIME_OF_DAY",
        "d[2] : LTIME_OF_DAY",
        "e.spent : LTIME",
        "e.day : LDATE",
        "e.short : TIME",
        "e.when[0] : LDATE_AND_TIME",
        "e.when[1] : LDATE_AND_TIME",
        "f : LTIME",
        "g : LINT",
        "q : LTIME_OF_DAY",
        "r : DATE_AND_TIME",
    ];
    let mut sorted = shown.clone();
    sorted.sort();
    let mut expected: Vec<String> = expected.iter().map(|text| (*text).to_owned()).collect();
    expected.sort();
    assert_eq!(sorted, expected);
    let long = program.inputs.iter().find(|point| point.name == "a").expect("it").declared();
    assert_eq!(long.text(1_500_000_000), "LT#1s500ms");
    assert_eq!(long.write(1_500_000_000), "LT#1s500ms");
    let day = program.inputs.iter().find(|point| point.name == "e.day").expect("it").declared();
    assert_eq!(day.write(1_709_164_800_000_000_000), "LD#2024-02-29");
    for text in ["LD#2024-02-29", "LDATE#2024-02-29", "D#2024-02-29", "2024-02-29"] {
        assert_eq!(day.read(text), Some(1_709_164_800_000_000_000), "{text}");
    }
}

/// Elements that share slots are points too, in a structure and in an array of arrays; of what can have no point the part is told.
#[test]
fn arrays_within_structures_and_arrays_have_points() {
    let text = "TYPE
  Recipe : STRUCT fill : INT (0..50); steps : ARRAY [1..2] OF INT (1..4); go : ARRAY [0..1] OF BOOL; END_STRUCT;
  Named : STRUCT n : INT; words : ARRAY [0..1] OF STRING; END_STRUCT;
  Many : STRUCT a : ARRAY [1..600] OF BOOL; b : ARRAY [1..600] OF BOOL; END_STRUCT;
END_TYPE
PROGRAM p
  VAR_INPUT r : Recipe; table : ARRAY [0..1] OF ARRAY [5..6] OF SINT; named : Named; END_VAR
  VAR_OUTPUT q : Recipe; sum : INT; many : Many; END_VAR
  VAR memory AT %MW3 : INT; bit AT %MX9.0 : BOOL; END_VAR
  q := r; sum := table[1][6];
END_PROGRAM
";
    let (file, found) = parse(text);
    assert!(found.is_empty(), "{found:?}");
    let lowered = lower(&file, &Options { text, ..Options::default() });
    let told: Vec<&str> = lowered.diagnostics.iter().map(|it| it.message.as_str()).collect();
    let expected = [
        "the input `named` is NAMED with `named.words[0]` : STRING[254]: nothing writes it, and it keeps its initial value",
        "the output `many` is MANY with `many.b` : ARRAY [1..600] OF BOOL: only the program itself can read it",
    ];
    let same = |one: &str, other: &str| one.eq_ignore_ascii_case(other);
    assert!(
        told.len() == 2 && told.iter().zip(expected).all(|(one, other)| same(one, other)),
        "{told:?}"
    );
    let program = lowered.program.expect("warnings only");
    let names = |points: &understudy_typed::Points| -> Vec<String> {
        let own = points.iter().filter(|point| point.slot != 0);
        own.map(|point| format!("{} : {}", point.name, point.declared())).collect()
    };
    let recipe = |of: &str| {
        let parts = [
            "fill : INT (0..50)",
            "steps[1] : INT (1..4)",
            "steps[2] : INT (1..4)",
            "go[0] : BOOL",
            "go[1] : BOOL",
        ];
        parts.map(|part| format!("{of}.{part}"))
    };
    let table =
        ["table[0][5] : SINT", "table[0][6] : SINT", "table[1][5] : SINT", "table[1][6] : SINT"];
    let inputs: Vec<String> = recipe("r").into_iter().chain(table.map(str::to_owned)).collect();
    assert_eq!(names(&program.inputs), inputs);
    let outputs: Vec<String> = recipe("q").into_iter().chain(["sum : INT".to_owned()]).collect();
    assert_eq!(names(&program.outputs), outputs);
    // What is sampled reaches the program, and what it computes its outputs.
    let machine = Machine::new(&program);
    let (mut scratch, mut state) = (Scratch::default(), machine.initial().to_vec());
    let mut read = vec![0; program.inputs.width().div_ceil(64)];
    let mut driven = vec![0; program.outputs.width().div_ceil(64)];
    for (name, value) in [("r.fill", 33), ("r.steps[2]", 4), ("r.go[1]", 1), ("table[1][6]", 100)] {
        program.inputs.find(name).expect(name).set(&mut read, value);
    }
    machine.step(&mut scratch, &mut state, &read, &mut driven);
    for (name, value) in [
        ("q.fill", 33),
        ("q.steps[1]", 1),
        ("q.steps[2]", 4),
        ("q.go[0]", 0),
        ("q.go[1]", 1),
        ("sum", 100),
    ] {
        assert_eq!(program.outputs.find(name).expect(name).get(&driven), value, "{name}");
    }
}
