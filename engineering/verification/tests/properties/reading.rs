//! What is written, and what it means.

use std::time::Duration;

use understudy_verification::property::{read, read_one};

/// From one scan to the next.
const PERIOD: Duration = Duration::from_millis(10);

fn check(text: &str, meaning: &str) {
    let property = read_one(text, PERIOD).unwrap_or_else(|wrong| panic!("{text}: {wrong:?}"));
    assert_eq!(property.formula.to_string(), meaning, "{text}");
    // What is printed means the same again.
    let again = read_one(meaning, PERIOD).unwrap_or_else(|wrong| panic!("{meaning}: {wrong:?}"));
    assert_eq!(again.formula.to_string(), meaning);
}

#[test]
fn sentences_and_formulas_mean_the_same() {
    check("never a and b", "AG !(a & b)");
    check("never a and b and c together", "AG !((a & b) & c)");
    check("never a & !b", "AG !(a & !b)");
    check("always a | b", "AG (a | b)");
    check("a only while b", "AG (a -> b)");
    check("a is followed by b", "AG (a -> (AF b))");
    check("a is followed by b within 5 scans", "AG (a -> (ABF 0..5 b))");
    check("a can be reached", "EF a");
    check("a & b can always be reached", "AG (EF (a & b))");
    check("a stays until b", "AG (a -> !(E[!b U (!a & !b)]))");
    check("not a", "!a");
    check("/a & pause.Q", "!a & pause.Q");
    check("a -> b -> c", "a -> (b -> c)");
    check("a <-> EX b", "a <-> (EX b)");
    check("A[a U E[b U c]]", "A[a U (E[b U c])]");
    check("AG true", "AG TRUE");
    // Numbers are compared, from either side; a duration is the whole scans in it.
    check("never t > 50.0", "AG !(t > 50.0)");
    check("always -5 <= n & n<>16#FF", "AG ((n >= -5) & (n <> 16#FF))");
    check("a.b[3].c = red | /on", "(a.b[3].c = red) | !on");
    check("mode = Colour#red only while t >= T#1.5s", "AG ((mode = Colour#red) -> (t >= T#1.5s))");
    check("1e-3 < x <-> x > y", "(x > 1e-3) <-> (x > y)");
    check("a is followed by n = 3 within 25ms", "AG (a -> (ABF 0..2 (n = 3)))");
    check("within 2s of a & b: c", "AG ((a & b) -> (ABF 0..200 c))");
    check("within 3 scans of n >= 4: c", "AG ((n >= 4) -> (ABF 0..3 c))");
    check("ABF 0..5 n=0", "ABF 0..5 (n = 0)");
    // Words of sentences are names elsewhere.
    check("AG (never -> until)", "AG (never -> until)");
}

#[test]
fn everything_that_is_wrong_is_said_in_one_run() {
    let text = "\
AG (a
exclusion: never a and
# a comment
a ? b
fair: AG a
a is followed by b within 5
AG a b
ABF 1..2 a
E[a b]
a is followed by b within 123456 scans
a is followed by b within 2 hours
a is followed by b within 200s
never n >
never 5
never 5 > 6
never -n > 5
never a > 1 > 2
assume: AG a
within 2s a: b
right: AG a
assume: n < 5
within 2s of a: b
";
    let found = read(text, PERIOD);
    let names: Vec<_> = found.properties.iter().map(|read| read.name.as_deref()).collect();
    assert_eq!(names, [Some("right"), None]);
    assert_eq!(found.assumed.len(), 1);
    let lines: Vec<String> = found
        .diagnostics
        .iter()
        .map(|wrong| {
            let line = text[..wrong.span.start].matches('\n').count() + 1;
            let label = wrong.label.as_deref().unwrap_or_default();
            format!("{line}: {} {} {label}", wrong.code, wrong.message)
        })
        .collect();
    insta::assert_snapshot!(lines.join("\n"));
}

#[test]
fn deep_nesting_is_an_error_and_no_crash() {
    let long = |sign: &str| format!("never a{}", sign.repeat(100_000));
    let deep = ["(".repeat(100_000), "!".repeat(100_000), "AG ".repeat(100_000)];
    for text in deep.into_iter().chain([long(" & a"), long(" | a"), long(" and a")]) {
        let wrong = read_one(&text, PERIOD).expect_err("too deep");
        assert_eq!(wrong[0].code, "U0432");
    }
}
