//! A system does what the machine does, and its circuit has every run of it.

mod beside;
mod inexact;
mod timers;

use std::collections::BTreeSet;

use understudy_structured_text::{Options, lower};
use understudy_typed::{Elementary, Machine, Program, Scratch};

use crate::{Derivation, Meaning, Node, System, Terms, Variable};

fn lowered(text: &str) -> Program {
    let (file, _) = understudy_structured_text::parser::parse(text);
    let options = Options { text, ..Options::default() };
    let lowered = lower(&file, &options);
    lowered.program.unwrap_or_else(|| panic!("{:?}", lowered.diagnostics))
}

/// Runs machine, system and circuit side by side; whether a fault was among the scans.
fn compare(program: &Program, seed: u64, scans: usize) -> bool {
    let any = System::of_program(program).expect("a program that is followed");
    let within = System::within_subranges(program, BTreeSet::new()).expect("followed too");
    compare_with(program, &within, seed, scans);
    compare_with(program, &any, seed, scans)
}

fn compare_with(program: &Program, system: &System, seed: u64, scans: usize) -> bool {
    let derivation = Derivation::new(system).expect("a circuit");
    for pair in derivation.meanings.windows(2) {
        if let [Meaning::Boundary(one, below), Meaning::Boundary(other, above)] = pair {
            assert!(one != other || below < above, "boundaries are in order");
        }
    }
    let compared = derivation.compared(system, &[program], (seed, scans));
    compared.unwrap_or_else(|differs| panic!("{differs}"))
}

const PROGRAMS: [&str; 11] = [
    // Inputs with subranges, of all widths and signs; one is compared with what it never is.
    "PROGRAM p
       VAR_INPUT a : INT (10..100); b : SINT (-7..-2); c : LINT (-5..5000000000); d : USINT (3..3); e : WORD; END_VAR
       VAR_OUTPUT y : INT; z : LINT; on : BOOL; never : BOOL; END_VAR
       y := a * 2 + b - USINT_TO_INT(d);
       z := c / 3;
       on := c > 4999999999 OR b = -7 AND a < 20;
       never := a > 120 OR a < 5 OR b > -2 OR d <> 3;
     END_PROGRAM",
    // Outputs with subranges, one of them read again.
    "PROGRAM p
       VAR_INPUT a : INT; u : UINT; END_VAR
       VAR_OUTPUT y : INT (-3..7); z : UINT (2..5); on : BOOL; END_VAR
       on := y = 7 OR z = 5;
       IF a > 0 THEN y := a; ELSE y := y - 2; END_IF;
       z := z + u;
     END_PROGRAM",
    // Selections, loops of all kinds, leaving them.
    "FUNCTION count : INT
       VAR_INPUT from : INT; END_VAR
       VAR n : INT; END_VAR
       WHILE TRUE DO
         n := n + 1;
         IF n > 5 THEN EXIT; END_IF;
         IF from MOD 2 = 0 THEN CONTINUE; END_IF;
         IF n = 4 THEN count := n * 10; RETURN; END_IF;
       END_WHILE;
       count := n;
     END_FUNCTION
     PROGRAM p
       VAR_INPUT a : INT; b : INT; go : BOOL; END_VAR
       VAR_OUTPUT y : INT; z : INT; on : BOOL; END_VAR
       VAR i : INT; sum : INT; END_VAR
       CASE a OF
         0: y := 1;
         1, 3..5: y := count(a);
         -10..-1: y := count(b);
       ELSE y := y + 1;
       END_CASE;
       sum := 0;
       FOR i := 1 TO 5 DO
         IF i = 3 AND go THEN CONTINUE; END_IF;
         sum := sum + i * b;
       END_FOR;
       REPEAT sum := sum - 7; i := i + 3; UNTIL i > 12 END_REPEAT;
       z := sum;
       on := z > 100 XOR go;
     END_PROGRAM",
    // Arrays with computed indices, structures, a division that can fail.
    "TYPE pair : STRUCT left : DINT; right : REAL; flags : ARRAY[0..3] OF BOOL; END_STRUCT; END_TYPE
     PROGRAM p
       VAR_INPUT at : INT; v : DINT; x : REAL; END_VAR
       VAR_OUTPUT y : DINT; r : REAL; f : BOOL; END_VAR
       VAR t : ARRAY[1..4] OF pair; c : pair; END_VAR
       t[at MOD 4 + 1].left := v;
       t[2].right := x;
       t[3] := t[at MOD 3 + 1];
       t[1].flags[at MOD 4] := x > 2.5;
       c := t[1];
       y := c.left / t[3].left + t[4].left;
       r := t[3].right;
       f := c.flags[2] OR t[3].flags[1];
     END_PROGRAM",
    // Remainders by what may be 0, which are 0 then and no fault; quotients by what is not.
    "PROGRAM p
       VAR_INPUT a : SINT; b : SINT; c : USINT; d : USINT; e : INT; f : INT (-2..2); g : BYTE; END_VAR
       VAR_OUTPUT v : SINT; w : USINT; x : INT; y : SINT; z : USINT; zero : BOOL; END_VAR
       v := a MOD b;
       w := c MOD d;
       x := e MOD f;
       y := SEL(b = 0, a, 7) / SEL(b = 0, b, SINT#1);
       z := BYTE_TO_USINT(g) MOD (d MOD 3);
       zero := a MOD b = 0 AND b = 0 AND a <> 0;
     END_PROGRAM",
    // Blocks, references, reals that are kept.
    include_str!("tests/blocks.st"),
    // Timers, counters, conversions, bit strings.
    "PROGRAM p
       VAR_INPUT go : BOOL; w : WORD; n : SINT; END_VAR
       VAR_OUTPUT q : BOOL; c : INT; o : WORD; k : DINT; END_VAR
       VAR t : TON; up : CTU; END_VAR
       t(IN := go, PT := T#30ms);
       up(CU := t.Q, R := n > 100, PV := 3);
       q := up.Q;
       c := up.CV;
       o := ROL(w, 3) XOR SHR(w, 2) OR 16#0F0F AND NOT w;
       o.3 := go;
       k := SINT_TO_DINT(n) * 1000 - MAX(INT_TO_DINT(c), 5) + ABS(SINT_TO_DINT(n)) / 7 MOD 3;
     END_PROGRAM",
    // Comparisons of all kinds, NaN, LIMIT, SEL, MUX.
    "PROGRAM p
       VAR_INPUT a : REAL; b : LREAL; i : LINT; s : USINT; END_VAR
       VAR_OUTPUT y1 : BOOL; y2 : BOOL; y3 : BOOL; y4 : BOOL; y5 : BOOL; m : USINT; END_VAR
       VAR r : REAL; root : REAL; END_VAR
       root := SQRT(a);
       y1 := root > 2.0 OR root < 1.0 OR root = 1.5;
       y2 := a <> 3.0 AND a >= -4.25 AND a <= 50.0;
       y3 := i > 5 AND i < 1000000 OR i = -7;
       y4 := LREAL_TO_REAL(b) > r OR b = 0.0;
       r := SEL(s > 3, a, r);
       y5 := r > 10.0;
       m := MUX(s MOD 3, s, 7, s * 2) + LIMIT(2, s, 9);
     END_PROGRAM",
    // The least, the greatest and the amount of reals, NaN at each place.
    "PROGRAM p
       VAR_INPUT a : REAL; b : REAL; go : BOOL; END_VAR
       VAR_OUTPUT y1 : BOOL; y2 : BOOL; y3 : BOOL; y4 : BOOL; y5 : BOOL; y6 : BOOL; m : REAL; END_VAR
       VAR root : REAL; kept : LREAL; END_VAR
       root := SQRT(a);
       y1 := MIN(root, b) > 2.0 OR MAX(root, b) <= -1.5;
       y2 := MIN(b, root, 7.0) = 2.0 OR MAX(b, root, -3.0) < 50.0;
       y3 := LIMIT(-4.25, root, 50.0) >= 3.0;
       y4 := ABS(a) <= 3.0 XOR ABS(b) > 4.25;
       y5 := ABS(root) < 2.0 OR MIN(ABS(b), root) <> MAX(a, b);
       IF go THEN kept := MAX(LREAL#0.0, REAL_TO_LREAL(root)); END_IF;
       y6 := kept > 1.5 AND MIN(kept, LREAL#9.0) <= 2.0;
       m := LIMIT(0.0, 2.0 * (60.0 - b), 40.0);
     END_PROGRAM",
    // Scaled, shifted and converted numbers: their comparisons are those of their operand.
    "PROGRAM p
       VAR_INPUT a : REAL; b : LREAL; n : INT; d : LINT; u : UDINT; END_VAR
       VAR_OUTPUT y1 : BOOL; y2 : BOOL; y3 : BOOL; y4 : BOOL; y5 : BOOL; y6 : BOOL; y7 : BOOL; y8 : BOOL; END_VAR
       VAR sum : REAL; kept : REAL; wide : LREAL; root : REAL; END_VAR
       y1 := 2.0 * (60.0 - a) <= 40.0 OR a * -0.1 > 3.3 OR a / 3.0 = 1.0;
       y2 := INT_TO_REAL(n) * 0.1 <= 5.0 XOR INT_TO_REAL(n) / -7.0 + 1.5 >= 20.0;
       y3 := LREAL_TO_REAL(b * 1.0E30) > 1.0E38 OR LREAL_TO_REAL(b) * 1.0E30 < -1.0E38;
       y4 := REAL_TO_LREAL(a) + 0.1 <= 0.3 AND LINT_TO_LREAL(d) - 0.5 > -7.5;
       y5 := UDINT_TO_REAL(u) > 4.0E9 OR LINT_TO_REAL(d) <= -1.0E15;
       root := SQRT(a) * 2.0 - 1.0;
       y6 := root > 3.0 OR MIN(root, 5.0 - LREAL_TO_REAL(b)) < 1.0;
       sum := sum + 1.0;
       IF sum > 100.0 THEN sum := -3.0; END_IF;
       y7 := sum * 2.0 > 50.0 OR 0.0 - sum > 0.0;
       kept := SEL(y1, a, kept);
       wide := REAL_TO_LREAL(kept);
       y8 := LREAL_TO_REAL(wide) >= 3.0 OR kept * 2.0 < 5.0;
     END_PROGRAM",
    // A chart of steps in a number, an enumeration.
    include_str!("tests/chart.st"),
];

#[test]
fn systems_and_circuits_do_what_the_machine_does() {
    let mut faults = 0;
    for (place, text) in PROGRAMS.iter().enumerate() {
        let program = lowered(text);
        for seed in 0..4 {
            faults += usize::from(compare(&program, 100 * seed + place as u64, 300));
        }
    }
    assert!(faults > 0, "some scans have faults");
}

#[test]
fn examples_do_what_the_machine_does() {
    for text in [
        include_str!("../../../examples/two-shuttles/left.st"),
        include_str!("../../../examples/two-shuttles/right.st"),
        include_str!("../../../examples/two-shuttles/track.st"),
        include_str!("../../../examples/heated-tank/level.st"),
        include_str!("../../../examples/heated-tank/temperature.st"),
        include_str!("../../../examples/heated-tank/tank.st"),
    ] {
        compare(&lowered(text), 7, 300);
    }
}

/// Every value of an input: a scan reads the nearest one of the subrange, and a property of the declared values is about no other.
#[test]
fn inputs_are_within_their_subranges() {
    for (declared, least, most) in [("-5..7", -5, 7), ("3..9", 3, 9), ("-128..127", -128, 127)] {
        let program = lowered(&format!(
            "PROGRAM p VAR_INPUT x : SINT ({declared}); END_VAR VAR_OUTPUT y : SINT; END_VAR y := x; END_PROGRAM"
        ));
        let machine = Machine::new(&program);
        let circuit = crate::exact(&program).expect("finite");
        let system = System::within_subranges(&program, BTreeSet::new()).expect("followed");
        assert_eq!(system.inputs[0].limits, (least, most));
        for stored in 0..256_u64 {
            let mut outputs = [0];
            let mut state = machine.initial().to_vec();
            machine.step(&mut Scratch::default(), &mut state, &[stored], &mut outputs);
            let expected = i128::from(stored as u8 as i8).clamp(least, most);
            assert_eq!(Elementary::Sint.signed(outputs[0] & 255), expected);
            let bits: Vec<bool> = (0..8).map(|bit| stored >> bit & 1 == 1).collect();
            let told = understudy_logic::Running::new(&circuit).step(&bits);
            let told = told.iter().rev().fold(0, |number, &bit| number << 1 | u64::from(bit));
            assert_eq!(Elementary::Sint.signed(told & 255), expected);
        }
    }
}

#[test]
fn terms_are_made_once_and_simplified() {
    let mut terms = Terms::default();
    let one = terms.variable(Elementary::Bool, Variable::Input(0));
    let not = terms.not(one);
    assert_eq!(terms.not(not), one);
    let either = terms.or(one, not);
    assert!(matches!(terms.node(either), Node::Constant(1)));
}

#[test]
fn timers_are_exact() {
    for text in [
        "t : TON; END_VAR t(IN := go, PT := T#30ms); q := t.Q;",
        "t : TON; END_VAR t(IN := go, PT := T#0s); q := t.Q;",
        "t : TOF; END_VAR t(IN := go, PT := T#30ms); q := t.Q;",
        "t : TP; END_VAR t(IN := go, PT := T#30ms); q := t.Q;",
        "t : TP; END_VAR IF stop THEN t(IN := go, PT := T#30ms); END_IF; q := t.Q;",
        "t : TP; END_VAR IF stop THEN t(IN := go, PT := T#30ms); END_IF; t(IN := go); q := t.Q;",
        "t : TON; END_VAR t(IN := go, PT := SEL(stop, T#30ms, T#70ms)); q := t.Q;",
        "t : TON; END_VAR t(IN := go, PT := T#55ms); q := t.ET > T#15ms;",
        "t : TIME; END_VAR IF go THEN t := TIME(); END_IF; q := TIME() - t > T#15ms;",
        "k : BOOL; END_VAR q := TIME() > T#155ms;",
        "k : BOOL; END_VAR IF TIME() >= T#70ms AND go THEN k := NOT k; END_IF; q := k OR T#2s < TIME() OR TIME() = T#1s;",
        "t : TIME; END_VAR IF go THEN t := TIME(); END_IF; q := TIME() - t > T#15ms OR TIME() < T#150ms;",
        "t : TIME; END_VAR IF go THEN t := t + T#10ms; END_IF; IF stop THEN t := T#0s; END_IF; q := t > T#45ms;",
        "t : TIME; END_VAR IF go THEN t := T#10ms + t; END_IF; q := t >= T#1s;",
        "t : TIME := T#20ms; END_VAR IF t < T#90ms THEN t := t + T#5ms; ELSIF stop THEN t := T#0s; END_IF; q := t = T#85ms;",
        "t : TIME; END_VAR IF go THEN t := t + T#10ms; IF t + T#10ms > T#80ms THEN t := T#30ms; q := TRUE; END_IF; ELSE q := FALSE; END_IF;",
        "t : TIME; u : TIME; END_VAR t := t + T#10ms; IF go THEN u := u + T#10ms; END_IF; q := t > T#1s AND u > T#250ms;",
    ] {
        let text = format!(
            "PROGRAM p VAR_INPUT go : BOOL; stop : BOOL; END_VAR VAR_OUTPUT q : BOOL; END_VAR VAR {text} END_PROGRAM"
        );
        let program = lowered(&text);
        let circuit = crate::exact(&program).unwrap_or_else(|error| panic!("{error}\n{text}"));
        assert!(circuit.registers().len() <= 12, "{:?}", circuit.registers());
        compare(&program, 3, 400);
    }
}

#[test]
fn tasks_of_other_intervals_are_exact() {
    let program = lowered(
        "PROGRAM slow VAR_INPUT go : BOOL; END_VAR VAR_OUTPUT n : INT (0..9); q : BOOL; END_VAR VAR t : TON; END_VAR
           t(IN := go, PT := T#90ms);
           q := t.Q;
           IF n < 9 THEN n := n + 1; ELSE n := 0; END_IF;
         END_PROGRAM
         PROGRAM fast VAR_INPUT come : BOOL; END_VAR VAR_OUTPUT k : BOOL; END_VAR k := NOT k AND come; END_PROGRAM
         CONFIGURATION c RESOURCE r ON PLC
           TASK a(INTERVAL := T#30ms, PRIORITY := 1); TASK b(INTERVAL := T#20ms, PRIORITY := 2);
           PROGRAM one WITH a : slow; PROGRAM two WITH b : fast;
         END_RESOURCE END_CONFIGURATION",
    );
    assert!(program.tasks.iter().any(|task| task.every == 3), "{:?}", program.tasks);
    let circuit = crate::exact(&program).expect("a circuit");
    assert!(circuit.registers().len() <= 20, "{:?}", circuit.registers());
    compare(&program, 5, 400);
}

#[test]
fn a_gap_is_named() {
    let gaps = |text: &str| crate::exact(&lowered(text)).expect_err("no circuit").to_string();
    let real = "PROGRAM p VAR_INPUT x : REAL; END_VAR VAR_OUTPUT q : BOOL; END_VAR q := x * x > 2.0; END_PROGRAM";
    assert!(gaps(real).contains("`x * x` : REAL"), "{}", gaps(real));
    let text = "PROGRAM p VAR_OUTPUT q : BOOL; END_VAR VAR t : TIME; END_VAR t := t + TIME(); q := t > T#1h; END_PROGRAM";
    assert!(gaps(text).contains("TIME"), "{}", gaps(text));
}
