//! What is wrong with a map of signals, all of it in one run.

use understudy_diagnostic::{Diagnostic, Report};
use understudy_supervisor::ladder::{Modules, Partition, read_map};
use understudy_supervisor::{Automaton, read_ads};

fn shown(text: &str, diagnostics: Vec<Diagnostic>) -> String {
    let report = Report {
        name: String::new(),
        text: text.to_owned(),
        diagnostics,
    };
    let lines = report.diagnostics.iter().map(|found| {
        let place = report.line_and_column(found.span.start);
        let help = found
            .help
            .as_deref()
            .map_or(String::new(), |help| format!(" ({help})"));
        format!("{place} {} {}{help}", found.code, found.message)
    });
    lines.collect::<Vec<_>>().join("\n")
}

fn supervisor() -> Automaton {
    let text = include_str!("../../examples/motivating-example/supervisor.ADS");
    read_ads(text).automaton.expect("an automaton")
}

#[test]
fn everything_wrong_with_the_form_is_found() {
    let text = r#"
program = 5
strat = "x0"
[events]
a = "zero"
[[input]]
event = "a"
when = "pulse "
[[switch]]
off = "c_cl"
memory = "yes"
[[timer]]
event = "b"
name = "t"
runs_while = "x"
preset = "5 s"
[[pulse]]
event = ["c"]
signal = "y"
"#;
    let read = read_map(text);
    assert_eq!(read.map, None);
    insta::assert_snapshot!(shown(text, read.diagnostics), @r#"
    2:11 U0864 `program` is of type integer
    3:1 U0862 `strat` is no key of this table (did you mean `start`?)
    5:5 U0864 `a` is of type string
    6:1 U0863 `signal` is missing
    8:8 U0865 "pulse " is none of pulse, rising, falling, high, low (did you mean `pulse`?)
    9:1 U0863 `positions` is missing
    11:10 U0864 `memory` is of type string
    16:10 U0865 "5 s" is no time (such as "15s", "1500ms" or "2m")
    18:9 U0864 `event` is of type array
    "#);
}

#[test]
fn everything_wrong_with_the_meaning_is_found() {
    let text = r#"program = "rung"
[events]
a = 0
b = 2
c_hi = 1
c_cl = 5
[[input]]
event = "c_hi"
signal = "x 1"
[[input]]
event = "a"
signal = "x"
[[input]]
event = "b"
signal = "x"
[[input]]
event = "aa"
signal = "z"
[[switch]]
off = "c_cl"
positions = [{ event = "a", signal = "x" }]
[[timer]]
event = "4"
name = "time"
runs_while = "y"
preset = "5s"
"#;
    let read = read_map(text);
    assert_eq!(read.diagnostics, []);
    let supervisor = supervisor();
    let mut found = Partition::new(&read.map.expect("a map"), &Modules::supervisor(&supervisor))
        .expect_err("much is wrong");
    found.sort_by_key(|found| found.span.start);
    insta::assert_snapshot!(shown(text, found), @r#"
    1:1 U0853 the controllable event `3` has no signal (give it a [[switch]] or a [[pulse]])
    1:1 U0853 the uncontrollable event `6` has no signal (give it an [[input]] or a [[timer]])
    1:1 U0853 the controllable event `7` has no signal (give it a [[switch]] or a [[pulse]])
    1:1 U0853 the controllable event `9` has no signal (give it a [[switch]] or a [[pulse]])
    1:11 U0855 "rung" cannot be a name in a ladder (letters, digits and `_`, single dots between its parts, a letter or `_` first, no word of the format)
    8:9 U0854 `c_hi` is controllable (1, an odd label): the PLC generates it
    9:10 U0855 "x 1" cannot be a name in a ladder (letters, digits and `_`, single dots between its parts, a letter or `_` first, no word of the format)
    15:10 U0856 `x` brings two events in the same way (one event for `rising` and one for `falling` are possible)
    17:9 U0851 there is no event `aa` (did you mean `a`?)
    21:24 U0854 `a` is uncontrollable (0, an even label): no PLC can command it
    21:24 U0852 the event `a` has two meanings
    21:38 U0856 `x` is the signal of a position of a switch and of an input
    25:14 U0857 no switch has the signal `y` (did you mean `x`?)
    "#);
}

#[test]
fn an_empty_supervisor_is_said_to_be_one() {
    let empty = Automaton::empty("none", supervisor().alphabet().clone());
    let text = include_str!("../../examples/motivating-example/map.toml");
    let map = read_map(text).map.expect("a map");
    let found = Partition::new(&map, &Modules::supervisor(&empty)).expect_err("no state");
    insta::assert_snapshot!(shown(text, found), @"1:1 U0858 the automaton `none` has no state: there is no supervisor that keeps the specification");
}
