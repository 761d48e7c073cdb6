//! Whatever a text is, it is answered with diagnostics and never with a panic; every program that comes out is valid.

mod running;

use proptest::prelude::*;

use understudy_structured_text::{Options, lower, parse};

const WORDS: [&str; 60] = [
    "PROGRAM p ",
    "END_PROGRAM ",
    "FUNCTION f : INT ",
    "END_FUNCTION ",
    "FUNCTION_BLOCK b ",
    "END_FUNCTION_BLOCK ",
    "EXTENDS b ",
    "METHOD m : INT ",
    "END_METHOD ",
    "VAR ",
    "VAR_INPUT ",
    "VAR_OUTPUT ",
    "VAR_IN_OUT ",
    "VAR_GLOBAL ",
    "CONSTANT ",
    "END_VAR ",
    "TYPE t : ",
    "END_TYPE ",
    "STRUCT ",
    "END_STRUCT; ",
    "a : INT; ",
    "c : t; ",
    "d : b; ",
    "e : ARRAY [0..3] OF INT; ",
    "s : STRING[5]; ",
    "x : REAL := 1.5; ",
    "w : WORD; ",
    "a := ",
    "e[a] := ",
    "c := ",
    "w.3 := ",
    "d(a := 1); ",
    "f(a) ",
    "m() ",
    "THIS^.m() ",
    "SUPER^(); ",
    "1 ",
    "2.5 ",
    "TRUE ",
    "'text' ",
    "T#5s ",
    "+ ",
    "* ",
    "/ 0 ",
    "AND ",
    "= ",
    "NOT ",
    "( ",
    ") ",
    "; ",
    "IF a > 1 THEN ",
    "END_IF; ",
    "FOR a := 0 TO 9 DO ",
    "END_FOR; ",
    "CASE a OF 1: ",
    "END_CASE; ",
    "INITIAL_STEP s1: END_STEP ",
    "TRANSITION FROM s1 TO s1 := a = 1; END_TRANSITION ",
    "LD a\n",
    "ST a\n",
];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1_000))]
    #[test]
    fn any_row_of_words_is_answered(row in prop::collection::vec(0..WORDS.len(), 0..60), whole in any::<bool>()) {
        let mut text: String = row.iter().map(|word| WORDS[*word]).collect();
        if whole {
            text = format!("PROGRAM p VAR a : INT; e : ARRAY [0..3] OF INT; x : REAL; w : WORD; s : STRING[5]; END_VAR {text} END_PROGRAM");
        }
        let (file, _) = parse(&text);
        let options = Options { text: &text, ..Options::default() };
        let lowered = lower(&file, &options);
        if let Some(program) = lowered.program {
            prop_assert!(program.validate().is_ok(), "{:?} {text}", program.validate());
        }
    }
}

/// Texts that would take a careless reader down.
#[test]
fn large_and_deep_texts_are_bounded() {
    let chain = |count: usize, between: &str| {
        let mut text = String::from("PROGRAM p VAR a : BOOL; r : REAL; END_VAR a := a");
        for _ in 0..count {
            text.push_str(between);
        }
        text + "; END_PROGRAM"
    };
    let taken = |text: &str| {
        let (_, found) = running::read(text, None);
        running::shown(text, &found, understudy_text::Severity::Error)
    };
    assert_eq!(taken(&chain(20_000, " OR a")), "");
    assert!(taken(&chain(20_000, " + 1")).starts_with("U1033"));
    let types: String = (0..500).map(|at| format!("t{at} : t{};", at + 1)).collect();
    assert!(taken(&format!("TYPE {types} t500 : INT; END_TYPE")).contains("U1033"));
    assert!(taken("TYPE t : STRUCT a : t; END_STRUCT; END_TYPE").starts_with("U1047"));
    let large = "PROGRAM p VAR a : ARRAY [0..99999] OF LREAL; END_VAR END_PROGRAM";
    assert_eq!(
        taken(large),
        "U1048 1:19 the variables take 782 KiB; a program has at most 256 KiB of state [use smaller arrays]\n"
    );
    let huge = "PROGRAM p VAR a : ARRAY [-9000000000000000000..9000000000000000000, 0..9000000000000000000] OF STRING[60000]; END_VAR END_PROGRAM";
    assert!(taken(huge).starts_with("U1048"));
    let functions: String = (0..3_000)
        .map(|at| format!("FUNCTION f{at} : INT f{at} := f{}(); END_FUNCTION ", at + 1))
        .collect();
    let text = format!(
        "{functions} FUNCTION f3000 : INT f3000 := 1; END_FUNCTION PROGRAM p VAR a : INT; END_VAR a := f0(); END_PROGRAM"
    );
    assert_eq!(taken(&text), "");
    let text = "FUNCTION f : INT f := g(); END_FUNCTION FUNCTION g : INT g := f(); END_FUNCTION PROGRAM p VAR a : INT; END_VAR a := f(); END_PROGRAM";
    assert!(taken(text).starts_with("U1047"));
}
