//! The format of nets: what is accepted, and everything that is wrong in one run.

use understudy_supervisor::Label;
use understudy_supervisor::petri::{ReadNet, draw_net_dot, draw_net_svg, read_net, write_net};
use understudy_text::{Diagnostic, Report};

fn shown(text: &str, diagnostics: Vec<Diagnostic>) -> String {
    let report = Report { name: String::new(), text: text.to_owned(), diagnostics };
    let lines = report.diagnostics.iter().map(|found| {
        let place = report.line_and_column(found.span.start);
        let help = found.help.as_deref();
        let help = help.map_or(String::new(), |help| format!(" [{help}]"));
        format!("{place} {} {}{help}", found.code, found.message)
    });
    lines.collect::<Vec<_>>().join("\n")
}

const NET: &str = r#"name = "store"

[events]
take = { controllable = false, label = 2 }
bring = { controllable = true, label = 3 }

[[place]]
name = "free"
tokens = 3

[[place]]
name = "held"
capacity = 3
level = ["full", "lamp"]
impulse = "bell"

[[transition]]
name = "bring"
takes = "2 free"
gives = "2 held"
inhibited_by = "2 held"
when = "there /stop [ +key | -door [ a | b ] c ]"

[[transition]]
name = "fetch"
event = "take"
takes = "held"
gives = "free"
enabled_by = ["held", "2 free"]
when = "arm"
after = "1s500ms"

[addresses]
full = "%QX0.1"
"#;

#[test]
fn a_net_is_read_and_written() {
    let read = read_net(NET);
    assert_eq!(read.diagnostics, []);
    let file = read.file.expect("right");
    assert_eq!(write_net(&file), NET);
    let labels: Vec<Option<Label>> = file.net.transitions().iter().map(|t| t.label).collect();
    assert_eq!(labels, [Some(Label::new(3)), Some(Label::new(2))]);
    assert_eq!(file.net.transitions()[1].enablers[1].weight, 2);
}

#[test]
fn everything_wrong_with_a_net_is_found_with_its_place() {
    let text = r#"
title = "store"
[events]
bring = { controllable = true, label = 2, signal = "x" }
[[place]]
name = "free"
tokens = -1
level = "not a name"
[[place]]
name = "held"
tokens = 4
capacity = 3
level = ["door", 5]
[[place]]
name = "held"
[[place]]
capacity = 0
[[transition]]
name = "bring"
event = "brign"
takes = ["2 fre", "0 free", "x free", "free or held"]
when = "a [ b | ] c"
[[transition]]
name = "fetch"
taks = "free"
when = "+door [ a | b"
after = "5"
[[transition]]
name = "wait"
when = "-a b] c"
after = "5s"
[[transition]]
when = "/ a"
[addresses]
door = "%IX"
"#;
    let ReadNet { file, diagnostics } = read_net(text);
    assert_eq!(file, None);
    insta::assert_snapshot!(shown(text, diagnostics), @r#"
    2:1 U0862 a net has no key `title` [known: name, events, place, transition, addresses]
    4:40 U0827 label 2: odd labels are controllable, even ones are not
    4:43 U0862 an event has no key `signal` [known: controllable, label]
    7:10 U0865 `tokens` is -1
    8:9 U0855 this cannot be a name in a ladder [letters, digits and `_`, single dots between its parts, a letter or `_` first, no word of the format]
    10:8 U0894 `held` begins with 4 tokens, its capacity is 3
    13:11 U0856 `door` is the signal of a condition and of an action
    13:18 U0864 `level` is the number 5
    15:8 U0891 `held` is the name of two places or two transitions
    16:1 U0863 a place needs `name`
    17:12 U0865 `capacity` is 0
    20:9 U0824 there is no event brign [did you mean `bring`?]
    21:13 U0892 there is no place `fre` [did you mean `free`?]
    21:19 U0893 an arc of weight 0 to `free` says nothing
    21:30 U0865 the weight of an arc is a number from 1 to 32767
    21:39 U0865 an arc is a place, or a weight and a place
    22:17 U0888 this is no condition: a branch is empty [a condition looks like "body_present /stop [ +start | -door ]"]
    25:1 U0862 a transition has no key `taks` [did you mean `takes`?]
    26:15 U0888 this is no condition: this bracket is not closed [a condition looks like "body_present /stop [ +start | -door ]"]
    27:9 U0865 invalid duration `5`: expected a number with a unit, such as `10ms`
    29:8 U0890 `wait` has a delay and a condition on an edge, which holds for one scan only
    30:13 U0888 this is no condition: a `]` or `|` without its `[` [a condition looks like "body_present /stop [ +start | -door ]"]
    32:1 U0863 a transition needs `name`
    35:8 U0867 "%IX" is no address of a bit [addresses look like %IX0.3, %QX1.0 or %MX2.7]
    35:13 U0863 a net needs `name`
    "#);
    let text = "name = \"a\"\n[[place]";
    insta::assert_snapshot!(shown(text, read_net(text).diagnostics), @r#"
2:9 U0861 invalid TOML: unclosed array table, expected `]`
"#);
    insta::assert_snapshot!(shown("", read_net("").diagnostics), @r#"
1:1 U0863 a net needs `name`
"#);
}

#[test]
fn a_net_is_drawn() {
    let net = read_net(NET).file.expect("right").net;
    insta::assert_snapshot!(draw_net_dot(&net), @r#"
digraph "store" {
    rankdir=LR; edge [arrowsize=0.7];
    p0 [shape=circle, label="●●●", xlabel="free"];
    p1 [shape=circle, label="", xlabel="held ≤ 3\n/ full\n/ lamp\n/ bell once"];
    t0 [shape=box, width=0.1, height=0.5, label="", xlabel="bring\nthere /stop [ +key | -door [ a | b ] c ]", style=filled, fillcolor=black];
    p0 -> t0 [label="2" style=solid];
    t0 -> p1 [label="2" style=solid];
    p1 -> t0 [label="2" arrowhead=odot];
    t1 [shape=box, width=0.1, height=0.5, label="", xlabel="fetch\narm\nafter 1s500ms"];
    p1 -> t1 [style=solid];
    t1 -> p0 [style=solid];
    p1 -> t1 [style=dashed];
    p0 -> t1 [label="2" style=dashed];
}
"#);
    let picture = draw_net_svg(&net).expect("it fits");
    // The page, a bar for each transition, and a circle for each place.
    assert_eq!(picture.matches("<rect").count(), 3);
    assert_eq!(picture.matches("<ellipse").count(), 2);
    for text in [">held ≤ 3<", ">/ bell once<", ">after 1s500ms<", ">●●●<", "url(#circle)"]
    {
        assert!(picture.contains(text), "{text}\n{picture}");
    }
}
