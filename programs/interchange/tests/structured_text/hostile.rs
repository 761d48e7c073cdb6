//! Texts that want to be too much: all of them end, with something said or a program.

use understudy_structured_text::parse;

use crate::execution::typed;
use crate::support::{found, read};

/// The codes that are found; nothing may panic.
fn codes(text: &str) -> Vec<&'static str> {
    let reading = read(text);
    assert_eq!(understudy_text::has_errors(&reading.diagnostics), reading.program.is_none());
    // Its circuit ends too, or says why there is none.
    if let Some(program) = typed(text, &parse(text).0) {
        let _ = understudy_bits::exact(&program);
    }
    let mut codes: Vec<_> = found(text).iter().map(|found| found.code).collect();
    codes.dedup();
    codes
}

fn program(declarations: &str, body: &str) -> String {
    format!(
        "PROGRAM p VAR_INPUT a : BOOL; n : DINT; END_VAR VAR_OUTPUT y : BOOL; END_VAR {declarations} {body} END_PROGRAM"
    )
}

#[test]
fn depth_is_bounded() {
    let deep = 100_000;
    for open in ["(", "NOT ", "-", "ABS(", "+", "y(", "SEL(a, "] {
        let text = program("", &format!("y := {}a;", open.repeat(deep)));
        assert!(codes(&text).contains(&"U1035"), "{open}");
    }
    for open in ["IF a THEN ", "CASE n OF 1: ", "FOR n := 1 TO 2 DO ", "WHILE a DO ", "REPEAT "] {
        let text = program("", &open.repeat(deep));
        assert!(codes(&text).contains(&"U1035"), "{open}");
    }
    assert!(codes(&"PROGRAM ".repeat(deep)).contains(&"U1034"));
    assert!(codes(&program("", &"(* ".repeat(deep))).contains(&"U1031"));
}

#[test]
fn length_is_no_depth() {
    let long = 5_000;
    let chain = |operator: &str| {
        program("", &format!("y := a{};", format!(" {operator} NOT y").repeat(long)))
    };
    for operator in ["AND", "OR", "XOR"] {
        assert!(codes(&chain(operator)).is_empty(), "{operator}");
    }
    for operator in ["=", "<>"] {
        let found = codes(&chain(operator));
        assert!(found.len() <= 1, "{operator} {found:?}");
    }
    let sum = program("", &format!("y := n{} > 3;", " - 1".repeat(long)));
    assert!(codes(&sum).len() <= 1);
    let branches =
        format!("IF a THEN y := TRUE; {} END_IF;", "ELSIF NOT a THEN y := FALSE; ".repeat(long));
    assert!(codes(&program("", &branches)).is_empty());
    assert!(codes(&program("", &"y := a; ".repeat(long))).is_empty());
}

#[test]
fn size_is_bounded() {
    let doubling: String = (0..40)
        .map(|level| {
            format!(
                "FUNCTION_BLOCK f{level} VAR one, two : f{}; END_VAR one(); two(); END_FUNCTION_BLOCK\n",
                level + 1
            )
        })
        .collect();
    let blocks = format!(
        "{doubling} FUNCTION_BLOCK f40 END_FUNCTION_BLOCK {}",
        program("VAR f : f0; END_VAR", "f();")
    );
    assert_eq!(codes(&blocks), ["U1033"]);
    let functions: String = (0..40)
        .map(|level| {
            let next = level + 1;
            format!("FUNCTION g{level} : BOOL g{level} := g{next}() AND g{next}(); END_FUNCTION\n")
        })
        .collect();
    let functions = format!(
        "{functions} FUNCTION g40 : BOOL g40 := TRUE; END_FUNCTION {}",
        program("", "y := g0();")
    );
    assert_eq!(codes(&functions), ["U1048"]);
    let nested = "FOR i := 1 TO 30000 DO ".repeat(10);
    let loops =
        program("VAR i : DINT; END_VAR", &format!("{nested} y := a; {}", "END_FOR; ".repeat(10)));
    assert!(codes(&loops).is_empty());
    let empty = program("VAR i : DINT; END_VAR", "FOR i := 1 TO 2000000000 DO END_FOR;");
    assert!(codes(&empty).is_empty());
    let products = program("", &format!("y := n{} > 0;", " * n".repeat(3)));
    assert_eq!(codes(&products), ["U1054"]);
    let many: String = (0..60_000).map(|place| format!("v{place}, ")).collect();
    assert_eq!(codes(&program(&format!("VAR {many} last : BOOL; END_VAR"), "y := a;")), ["U1048"]);
}

/// The bound is that of the whole text, however many units it has.
#[test]
fn many_units_are_bounded() {
    let nested = "FOR i := 1 TO 300 DO ".repeat(2);
    let body = format!("{nested} y := NOT y; {}", "END_FOR; ".repeat(2));
    let units: String = (0..900)
        .map(|place| {
            format!("FUNCTION_BLOCK f{place} VAR i : DINT; y : BOOL; END_VAR {body} END_FUNCTION_BLOCK\n")
        })
        .collect();
    assert!(codes(&format!("{units}{}", program("", "y := a;"))).is_empty());
    let many = "FUNCTION_BLOCK f END_FUNCTION_BLOCK\n".repeat(5_000);
    assert_eq!(codes(&format!("{many}{}", program("", "y := a;"))), ["U1042"]);
}

#[test]
fn what_calls_itself_is_found() {
    let function = format!(
        "FUNCTION f : BOOL f := g(); END_FUNCTION FUNCTION g : BOOL g := f(); END_FUNCTION {}",
        program("", "y := f();")
    );
    assert_eq!(codes(&function), ["U1047"]);
    let block = format!(
        "FUNCTION_BLOCK f VAR other : g; END_VAR END_FUNCTION_BLOCK \
         FUNCTION_BLOCK g VAR other : f; END_VAR END_FUNCTION_BLOCK {}",
        program("VAR one : f; END_VAR", "y := a;")
    );
    assert_eq!(codes(&block), ["U1047"]);
}

#[test]
fn every_beginning_of_a_text_is_read() {
    let text = include_str!("../../../../examples/other-tools/press.st");
    for (end, _) in text.char_indices().step_by(5) {
        read(&text[..end]);
        read(&text[end..]);
    }
    let text = include_str!("texts/full-of-errors.st");
    for (end, _) in text.char_indices().step_by(5) {
        read(&text[..end]);
    }
}
