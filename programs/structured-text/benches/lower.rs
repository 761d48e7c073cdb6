//! How long a text of 10,000 statements takes to be read, lowered and compiled.

use std::fmt::Write as _;

use understudy_structured_text::{Options, lower, parse};
use understudy_typed::Machine;

fn main() {
    divan::main();
}

/// A thousand instances of a block, and as many groups of ten statements.
fn text() -> String {
    let mut text = String::from(
        "FUNCTION_BLOCK cell VAR_INPUT x : LREAL; END_VAR VAR_OUTPUT y : LREAL; END_VAR
         VAR timer : TON; END_VAR timer(IN := x > 1.0, PT := T#1s); y := y + 0.1 * (x - y); END_FUNCTION_BLOCK
         PROGRAM main VAR_INPUT u : LREAL; END_VAR VAR_OUTPUT y : LREAL; n : DINT; END_VAR
         VAR c : ARRAY [0..999] OF cell; k : DINT; a : ARRAY [0..999] OF INT; b : BOOL; w : WORD; END_VAR\n",
    );
    for at in 0..1_000 {
        let _ = writeln!(
            text,
            "c[{at}](x := u * {at}.5); y := y + c[{at}].y; IF y > {at}.0 AND NOT b THEN n := n + 1; ELSE n := n - 1; END_IF;
             a[{at}] := a[{at}] + 1; w := SHL(w, 1) XOR INT_TO_WORD(a[{at}]); b := a[{at}] > 100 OR w.3;
             FOR k := 0 TO 3 DO a[k] := a[k] - 1; END_FOR; n := LIMIT(-1000, n, 1000);"
        );
    }
    text.push_str("END_PROGRAM\n");
    text
}

#[divan::bench]
fn ten_thousand_statements(bencher: divan::Bencher<'_, '_>) {
    let text = text();
    bencher.bench(|| {
        let (file, found) = parse(&text);
        assert!(found.is_empty());
        let options = Options { text: &text, ..Options::default() };
        let lowered = lower(&file, &options);
        Machine::new(&lowered.program.expect("a program"))
    });
}
