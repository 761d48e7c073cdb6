//! The long types of time have the values of the short ones, and keep their names at the points.

use understudy_structured_text::{Options, lower, parse};

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
