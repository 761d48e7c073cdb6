//! Operators on numbers of fewer than 32 bits compute in 32 bits, as C does; what is stored, and what a function is given, is cut to its type.

mod running;

use running::{Running, once, program, read, shown};
use understudy_text::Severity;
use understudy_typed::Elementary;

/// The value of an expression for the values of its variables.
type Value<T> = Box<dyn Fn(&[i32]) -> T>;

/// An operator on two numbers.
type Binary = fn(i32, i32) -> i32;

/// The variables of random expressions: one of each narrow type.
const VARIABLES: [(&str, Elementary); 6] = [
    ("s8", Elementary::Sint),
    ("s16", Elementary::Int),
    ("u8", Elementary::Usint),
    ("u16", Elementary::Uint),
    ("b8", Elementary::Byte),
    ("b16", Elementary::Word),
];

struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn below(&mut self, bound: usize) -> usize {
        (self.next() % bound as u64) as usize
    }
}

/// How many bits a value has.
#[derive(Debug, Clone, Copy)]
enum Form {
    /// Those of the value beside it.
    Literal,
    /// Those of its type.
    Own(Elementary),
    /// 32: it was calculated.
    Wide,
}

impl Form {
    /// The form of two values that are combined bit by bit.
    fn combined(self, other: Self) -> Self {
        match (self, other) {
            (Self::Own(one), Self::Own(two))
                if one == two || !one.is_signed() && !two.is_signed() =>
            {
                Self::Own(if one.bits() < two.bits() { two } else { one })
            }
            (Self::Own(one), Self::Literal) => Self::Own(one),
            _ => Self::Wide,
        }
    }
}

/// An expression as text, and what C computes for it from the variables, each as an `int`; NOT has the bits of what it is of.
struct Tried {
    text: String,
    form: Form,
    value: Value<i32>,
}

/// The number as a variable of a type holds it.
fn cast(value: i32, to: Elementary) -> i32 {
    to.signed(value as u64 & to.mask()) as i32
}

fn leaf(random: &mut Random) -> Tried {
    if random.below(4) == 0 {
        let value = random.below(128) as i32;
        let form = Form::Literal;
        return Tried { text: value.to_string(), form, value: Box::new(move |_| value) };
    }
    variable(random)
}

fn variable(random: &mut Random) -> Tried {
    let at = random.below(VARIABLES.len());
    let (name, of) = VARIABLES[at];
    Tried { text: name.to_owned(), form: Form::Own(of), value: Box::new(move |given| given[at]) }
}

fn expression(random: &mut Random, depth: usize) -> Tried {
    if depth == 0 {
        // A literal alone would give the whole its own type.
        return variable(random);
    }
    let left = expression(random, depth - 1);
    let right = match random.below(3) {
        0 => leaf(random),
        _ => {
            let depth = random.below(depth);
            expression(random, depth)
        }
    };
    let forms = (left.form, right.form);
    let (one, two) = (left.value, right.value);
    let (left, right) = (left.text, right.text);
    let signs: [(&str, Binary); 6] = [
        ("+", i32::wrapping_add),
        ("-", i32::wrapping_sub),
        ("*", i32::wrapping_mul),
        ("AND", |left, right| left & right),
        ("OR", |left, right| left | right),
        ("XOR", |left, right| left ^ right),
    ];
    let mut form = Form::Wide;
    let (text, value): (String, Value<i32>) = match random.below(11) {
        6 => (
            format!("({left} / ({right} OR 1))"),
            Box::new(move |given| one(given).wrapping_div(two(given) | 1)),
        ),
        7 => (
            format!("({left} MOD ({right} OR 1))"),
            Box::new(move |given| one(given).wrapping_rem(two(given) | 1)),
        ),
        8 => (format!("(-{left})"), Box::new(move |given| one(given).wrapping_neg())),
        9 => {
            form = forms.0;
            let value: Value<i32> = match form {
                Form::Own(of) => Box::new(move |given| cast(!one(given), of)),
                _ => Box::new(move |given| !one(given)),
            };
            (format!("(NOT {left})"), value)
        }
        // A function has a type: its inputs and its result are cut to it.
        10 => {
            let of = VARIABLES[random.below(4)].1;
            form = Form::Own(of);
            let text = format!("MUL_{of}({left}, {right})");
            let value = move |given: &[i32]| {
                cast(cast(one(given), of).wrapping_mul(cast(two(given), of)), of)
            };
            (text, Box::new(value))
        }
        sign => {
            if sign >= 3 {
                form = forms.0.combined(forms.1);
            }
            let (sign, apply) = signs[sign];
            let value = move |given: &[i32]| apply(one(given), two(given));
            (format!("({left} {sign} {right})"), Box::new(value))
        }
    };
    Tried { text, form, value }
}

#[test]
fn random_expressions_are_what_c_computes() {
    let mut random = Random(0x5eed);
    for _ in 0..150 {
        let mut outputs = String::new();
        let mut body = String::new();
        let mut wanted: Vec<(Elementary, Value<i64>)> = Vec::new();
        for at in 0..12 {
            let depth = 1 + random.below(4);
            let tried = expression(&mut random, depth);
            let value = tried.value;
            // Stored in each narrow type and in wider ones, compared, and as an index of itself.
            let (of, text, value): (_, _, Value<i64>) = match random.below(9) {
                found @ 0..6 => {
                    let of = VARIABLES[found].1;
                    let value = move |given: &[i32]| i64::from(cast(value(given), of));
                    (of, tried.text, Box::new(value))
                }
                6 => (
                    Elementary::Dint,
                    tried.text,
                    Box::new(move |given: &[i32]| i64::from(value(given))),
                ),
                7 => (
                    Elementary::Lint,
                    tried.text,
                    Box::new(move |given: &[i32]| i64::from(value(given))),
                ),
                _ => {
                    let other = expression(&mut random, 2);
                    let text = format!("{} > {}", tried.text, other.text);
                    let value = move |given: &[i32]| i64::from(value(given) > (other.value)(given));
                    (Elementary::Bool, text, Box::new(value))
                }
            };
            outputs.push_str(&format!("o{at} : {of}; "));
            body.push_str(&format!("o{at} := {text};\n"));
            wanted.push((of, value));
        }
        let inputs = VARIABLES.map(|(name, of)| format!("{name} : {of};")).join(" ");
        let text = format!(
            "PROGRAM main VAR_INPUT {inputs} END_VAR VAR_OUTPUT {outputs} END_VAR\n{body}END_PROGRAM"
        );
        let mut running = Running::new(program(&text));
        for _ in 0..20 {
            let edges = [0, 1, 0x7f, 0x80, 0xff, 0x7fff, 0x8000, 0xffff];
            let given = VARIABLES.map(|(_, of)| {
                let bits = match random.below(2) {
                    0 => edges[random.below(edges.len())],
                    _ => random.next(),
                };
                bits & of.mask()
            });
            let numbers: Vec<i32> = given
                .iter()
                .zip(VARIABLES)
                .map(|(stored, (_, of))| of.signed(*stored) as i32)
                .collect();
            let found = running.scan(&given);
            assert_eq!(running.fault(), None, "{text}");
            for (at, (found, (of, value))) in found.iter().zip(&wanted).enumerate() {
                let expected = value(&numbers) as u64 & of.mask();
                assert_eq!(*found, expected, "o{at} of {numbers:?} in\n{text}");
            }
        }
    }
}

#[test]
fn intermediate_results_have_32_bits() {
    // What was found: 100 % of a converter of 12 bits.
    once("x : INT;", "raw : INT := 4095;", "x := raw * 100 / 4095;", "100");
    once("x : BOOL; y : BOOL;", "u : UINT;", "x := u - 1 > 0; y := u - 1 < 0;", "0 1");
    once("x : USINT;", "p : USINT := 200; q : USINT := 100;", "x := (p + q) / 2;", "150");
    once("x : BOOL;", "p : BYTE := 255;", "x := p + 1 > 255;", "1");
    once("x : DINT;", "p : INT := 30000;", "x := p + p;", "60000");
    once("x : REAL;", "p : INT := 30000;", "x := p * 10;", "300000");
    once("x : INT; y : DINT;", "p : INT := -32768;", "x := -p; y := -p;", "-32768 32768");
    once("x : TIME;", "p : INT := 30000;", "x := T#1ms * (p + p);", "60000000000");
    once("x : LREAL;", "p : INT := 300;", "x := (p * p) ** 1;", "90000");
    once(
        "x : INT; y : INT;",
        "t : ARRAY [0..300] OF INT; u : USINT := 255;",
        "t[256] := 7; x := t[u + 1]; FOR y := 0 TO u + 1 DO ; END_FOR;",
        "7 257",
    );
    for of in ["USINT", "UINT", "UDINT", "ULINT", "BYTE", "WORD"] {
        for (last, wanted) in [(-5, "0 0"), (0, "0 0"), (1, "1 1"), (3, "3 3")] {
            let known = format!("i : {of}; k : INT := {last}; z : {of} := 9;");
            let turns = "FOR i := 0 TO k - 1 DO x := x + 1; END_FOR; FOR z := 0 TO k - 1 BY 1 DO y := y + 1; END_FOR;";
            once("x : INT; y : INT;", &known, turns, wanted);
        }
        // The counter has its first value where no turn is made.
        let known = format!("i : {of} := 9; k : INT := -1;");
        once("x : INT;", &known, "FOR i := 7 TO k DO ; END_FOR; x := TO_INT(i);", "7");
    }
    once("x : INT;", "i : UINT; u : UINT;", "FOR i := 0 TO u - 1 DO x := x + 1; END_FOR;", "0");
    // Functions keep the type of their inputs.
    once("x : INT;", "raw : INT := 4095;", "x := DIV(MUL(raw, 100), 4095);", "3");
    once("x : REAL;", "raw : INT := 4095;", "x := INT_TO_REAL(raw * 100);", "16284");
    once("x : REAL;", "raw : INT := 4095;", "x := DINT_TO_REAL(raw * 100);", "409500");
    once("x : INT;", "raw : INT := 4095;", "x := LIMIT(0, raw * 100, 30000);", "16284");
    once("x : WORD;", "w : WORD := 16#0FF0;", "x := SHR(NOT w, 4);", "3840");
    once(
        "x : INT;",
        "raw : INT := 20000;",
        "CASE raw + raw OF -25536: x := 1; ELSE x := 2; END_CASE;",
        "1",
    );
    // Bits above those of a type.
    once(
        "x : WORD; y : BOOL; z : BOOL;",
        "w : WORD := 16#00FF;",
        "x := NOT w; y := NOT w = 16#FF00; z := NOT (w + 0) = 16#FF00;",
        "65280 1 0",
    );
}

/// For every pattern of bits: NOT, shifts and rotations of a BYTE and a WORD have the bits of their type, whatever is done with the result.
#[test]
fn the_bits_of_a_type_are_all_that_its_inverse_has() {
    let text = "PROGRAM main
        VAR_INPUT w : WORD; b : BYTE; u : USINT; END_VAR
        VAR_OUTPUT n : WORD; d : DWORD; e : BOOL; g : BOOL; m : BYTE; l : DINT; f : BOOL; v : BOOL; s : BOOL; r : BOOL; i : DINT; END_VAR
        VAR t : ARRAY [0..255] OF DINT; k : DINT; END_VAR
        FOR k := 0 TO 255 DO t[k] := k; END_FOR;
        n := NOT w; d := NOT w; e := NOT w = 16#FFFF - w; g := NOT (NOT w) = w;
        m := NOT b; l := NOT b; f := NOT b > b; v := (NOT u) + 1 = 256 - u;
        s := SHL(b, 4) = (b AND 16#0F) * 16; r := ROL(b, 4) = SHR(b, 4) + SHL(b, 4); i := t[NOT u];
        END_PROGRAM";
    let mut running = Running::new(program(text));
    for at in (0..=0xffff_u64).step_by(3).chain(0..=0x1ff) {
        let byte = at & 0xff;
        let (word, inverse) = (at ^ 0xffff, byte ^ 0xff);
        let wanted =
            [word, word, 1, 1, inverse, inverse, u64::from(inverse > byte), 1, 1, 1, inverse];
        assert_eq!(running.scan(&[at, byte, byte]), wanted, "{at:#x}");
    }
}

/// The ends of the ranges: what leaves its type there.
#[test]
fn the_least_number_of_a_type_wraps_where_it_is_stored() {
    once(
        "x : INT; y : DINT; z : INT; n : INT; o : DINT; p : INT; q : INT; r : BOOL; s : BOOL;",
        "i : INT := -32768; w : WORD := 16#FFFF; one : INT := -1;",
        "x := -i; y := -i; z := ABS(i); n := i / one; o := i / one; p := i MOD one; q := -7 MOD 4; r := one = w; s := INT#-1 = WORD#16#FFFF;",
        "-32768 32768 -32768 -32768 32768 0 -3 0 0",
    );
}

#[test]
fn each_instruction_of_a_list_has_the_type_of_its_operands() {
    let list = |body: &str| {
        format!(
            "PROGRAM main\nVAR_OUTPUT x : INT; END_VAR\nVAR raw : INT := 4095; END_VAR\n{body}\nEND_PROGRAM"
        )
    };
    running::check(&list("LD raw\nMUL 100\nDIV 4095\nST x"), &[(&[], "3")]);
    running::check(&list("LD raw\nMUL( 50\nADD 50\n)\nDIV 4095\nST x"), &[(&[], "3")]);
    running::check(&list("LD raw\nADD 1\nADD 2\nSUB 98\nST x"), &[(&[], "4000")]);
    // A list of any length ends in a value or in a finding.
    let long = "SUB 1\nMUL 1\n".repeat(2_000);
    let (_, found) = read(&list(&format!("LD raw\n{long}ST x")), None);
    assert!(found.iter().any(|found| found.code == "U1033"), "{found:?}");
}

fn warnings(declared: &str, body: &str) -> String {
    let text = format!("PROGRAM main VAR {declared} END_VAR {body} END_PROGRAM");
    let (_, found) = read(&text, None);
    shown(&text, &found, Severity::Warning)
}

#[test]
fn numbers_that_no_type_has_are_warned_of() {
    let declared = "a : SINT; b : USINT; ud : UDINT; d : DINT; l : LINT; ul : ULINT; lw : LWORD; n : INT; q : BOOL; u : UINT; i : UINT;";
    for body in [
        "q := ul = l;",
        "q := n < ul;",
        "q := lw >= d;",
        "a := MAX(a, b);",
        "l := MAX(ud, d);",
        "l := SEL(q, ud, d);",
        "n := MUX(n, a, b);",
        "FOR i := 0 TO ABS(n) - TO_INT(i) - 1 DO u := i; END_FOR;",
    ] {
        let found = warnings(declared, body);
        assert!(found.contains("U1080"), "{body} {found}");
    }
    for body in [
        "q := ul > 5;",
        "q := ul = ud;",
        "q := l < ud;",
        "q := ud > d;",
        "n := MAX(n, a);",
        "l := MAX(l, d);",
        "d := LIMIT(0, d, 5);",
        "FOR i := 0 TO u DO n := n + 1; END_FOR;",
        "FOR i := 0 TO n - 1 DO d := d + 1; END_FOR;",
    ] {
        assert_eq!(warnings(declared, body), "", "{body}");
    }
}

#[test]
fn a_misspelt_instance_is_no_list_of_global_variables() {
    let text = |name: &str| {
        format!(
            "VAR_GLOBAL run : BOOL; END_VAR FUNCTION_BLOCK motor VAR_INPUT run : BOOL; END_VAR VAR_OUTPUT on : BOOL; END_VAR on := run; END_FUNCTION_BLOCK
            PROGRAM main VAR_INPUT s : BOOL; END_VAR VAR_OUTPUT q : BOOL; END_VAR VAR pump1 : motor; END_VAR {name}.run := s; pump1(); q := pump1.on; END_PROGRAM"
        )
    };
    for (name, is_known) in [("pump1", true), ("pmup1", false), ("pump", false), ("GVL", true)] {
        let (_, found) = read(&text(name), None);
        let unknown = found.iter().any(|found| found.code == "U1041");
        assert_eq!(unknown, !is_known, "{name}: {found:?}");
    }
}

#[test]
fn a_product_that_can_leave_its_type_is_warned_of_and_a_sum_is_not() {
    let declared = "n : INT; m : INT; u : UINT; s : SINT; w : WORD; v : WORD; d : DINT; r : REAL; t : ARRAY [0..9] OF INT;";
    let quiet = [
        "n := n + 1;",
        "n := n - m + 3;",
        "u := u - 1;",
        "n := -n;",
        "n := n * 100 / 4095;",
        "n := n / 10 * 10;",
        "n := n MOD 100 * 100;",
        "s := n MOD 10;",
        "d := n * m;",
        "d := DINT_TO_INT(n * m);",
        "w := NOT w;",
        "w := NOT w AND v OR 16#FF;",
        "IF NOT w = 16#FF THEN n := 0; END_IF;",
        "d := NOT u;",
        "n := ABS(n - m);",
        "r := n + m;",
        "t[n + 1] := n;",
        "IF n * m > 1000 THEN n := 0; END_IF;",
        "n := LIMIT(0, n, 10) * 100;",
    ];
    for body in quiet {
        assert_eq!(warnings(declared, body), "", "{body}");
    }
    let told = [
        ("n := n * 100;", "U1054"),
        ("n := n * m;", "U1054"),
        ("n := (n + 1) * 2 - 3;", "U1054"),
        ("r := INT_TO_REAL(n * 100);", "U1054"),
        ("n := LIMIT(0, n * 100, 10);", "U1054"),
        ("s := n + 1;", "U1080"),
        ("IF NOT (w + 1) = 16#FF THEN n := 0; END_IF;", "U1080"),
        ("d := NOT (u + 1);", "U1080"),
    ];
    for (body, code) in told {
        let found = warnings(declared, body);
        assert!(found.starts_with(code) && found.lines().count() == 1, "{body}: {found}");
    }
}

#[test]
fn digits_of_base_16_are_bits_where_they_are_stored() {
    once(
        "x : DINT; y : INT; z : SINT;",
        "d : DINT := 16#FFFF_FFFE;",
        "x := d; y := 16#8000; z := 2#1111_1111;",
        "-2 -32768 -1",
    );
    once("x : BOOL;", "y : INT := -1;", "x := y = 16#FFFF;", "0");
    let (_, found) = read(
        "PROGRAM main VAR x : DINT := 16#1_0000_0000; y : INT := 65535; END_VAR END_PROGRAM",
        None,
    );
    assert_eq!(found.iter().filter(|found| found.code == "U1043").count(), 2);
}
