//! What is in the way of a circuit is told by the variable and the statement.

use super::lowered;
use crate::exact;

#[track_caller]
fn check(text: &str, told: &str) {
    let inexact = exact(&lowered(text)).expect_err("no circuit");
    assert_eq!(inexact.to_string(), format!("no bits for {told}"));
}

#[test]
fn a_value_without_bits_is_told_by_its_variable_and_the_statement() {
    let body = |declared: &str, statements: &str| {
        format!(
            "PROGRAM p\nVAR_INPUT a : BOOL; r : REAL; END_VAR\nVAR_OUTPUT q : BOOL; END_VAR\nVAR {declared} END_VAR\n{statements}\nEND_PROGRAM"
        )
    };
    // A value that the program computes, in a branch too.
    check(
        &body("sum : REAL;", "IF a THEN\n  sum := sum + 1.5;\nEND_IF;\nq := sum > 3.0;"),
        "`sum` : REAL (p, line 6), `r` : REAL",
    );
    // An input where it is named first: in a condition, and behind a statement that does not name it.
    check(&body("n : INT;", "n := 3;\nIF r > 1.0 THEN q := a; END_IF;"), "`r` : REAL (p, line 6)");
    check(&body("", "IF a THEN\n  q := TRUE;\n  q := r > 1.0;\nEND_IF;"), "`r` : REAL (p, line 7)");
    // A time that only grows, in a structure.
    let text = "TYPE both : STRUCT done : BOOL; spent : TIME; END_STRUCT; END_TYPE
PROGRAM p
VAR_INPUT a : BOOL; END_VAR
VAR_OUTPUT q : both; END_VAR
IF a THEN q.spent := q.spent + T#1ms; END_IF;
END_PROGRAM";
    check(text, "`q.spent` : TIME (p, line 5)");
    // Two instances of a block have the statements of one: the expression is told, with the line of the block.
    let text = "FUNCTION_BLOCK adder
VAR_INPUT x : BOOL; END_VAR VAR_OUTPUT more : BOOL; END_VAR VAR sum : REAL; END_VAR
IF x THEN sum := sum + 0.5; END_IF;
more := sum > 2.0;
END_FUNCTION_BLOCK
PROGRAM p
VAR_INPUT a : BOOL; END_VAR
VAR_OUTPUT q : BOOL; END_VAR
VAR one : adder; two : adder; END_VAR
one(x := a); two(x := NOT a); q := one.more AND two.more;
END_PROGRAM";
    let inexact = exact(&lowered(text)).expect_err("no circuit").to_string();
    assert!(inexact.contains("(adder, line 3)"), "{inexact}");
}
