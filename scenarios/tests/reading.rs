//! What is wrong with a scenario file is all found in one run, with its place and the way out.

use std::fmt::Write as _;

use insta::assert_snapshot;
use understudy_cycle::Mode;
use understudy_journal::Members;
use understudy_scenarios::{Action, looks_like_a_scenario, read, write};
use understudy_testing::press_cell;
use understudy_wire::{Member, ProgramId, StationId, Via};

fn members() -> Members {
    Members::new([
        (Member::Station(StationId(0)), "robot".to_owned()),
        (Member::Station(StationId(1)), "press".to_owned()),
        (Member::Station(StationId(2)), "understudy".to_owned()),
        (Member::RemoteIo(ProgramId(0)), "robot-io".to_owned()),
        (Member::RemoteIo(ProgramId(1)), "press-io".to_owned()),
        (Member::Plant(ProgramId(0)), "arm".to_owned()),
        (Member::Plant(ProgramId(1)), "ram".to_owned()),
    ])
}

/// One line for each finding.
fn check(text: &str) -> String {
    let found = read("scenario.toml", text, Some(&members()));
    let mut lines = String::new();
    for diagnostic in &found.report.diagnostics {
        let place = found.report.line_and_column(diagnostic.span.start);
        let _ = write!(lines, "{place} {} {}", diagnostic.code, diagnostic.message);
        if let Some(label) = &diagnostic.label {
            let _ = write!(lines, " [{label}]");
        }
        if let Some(help) = &diagnostic.help {
            let _ = write!(lines, " ({help})");
        }
        lines.push('\n');
    }
    assert_eq!(found.scenario.is_none(), !lines.is_empty(), "{lines}");
    lines
}

#[test]
fn names_and_keys_that_do_not_exist() {
    assert_snapshot!(check(
        r#"
title = "Misspelt"
cycles = 100
cicles = 100
[[step]]
at = 10
action = "crush"
station = "robott"
wen = 3
[expect]
functional = ["rom", "robot-io"]
finished = { arms = 3 }
[[expect.during]]
from = 0
to = 10
remote_io = "press"
source = "dirct"
"#
    ));
}

#[test]
fn values_of_wrong_types_and_out_of_bounds() {
    assert_snapshot!(check(
        r#"
title = 3
cycles = 0
[network]
loss = 1.5
jitter = "3 parsecs"
[[step]]
at = -1
action = "crash"
station = ["robot"]
[[step]]
at = 5
phase = 1
action = "crash"
station = "robot"
[expect]
held = "none"
finished = 3
"#
    ));
}

#[test]
fn what_is_missing() {
    assert_snapshot!(check("[[step]]\n[[expect.during]]\n"));
}

#[test]
fn steps_that_cannot_be_done() {
    assert_snapshot!(check(
        r#"
title = "Impossible"
cycles = 100
step = [
    { at = 10, action = "restart", station = "robot" },
    { at = 20, action = "crash", station = "press" },
    { at = 30, action = "crash", station = "press" },
    { at = 40, action = "stop", station = "arm" },
    { at = 50, action = "restart", station = "arm" },
    { at = 60, action = "release", station = "press" },
    { at = 100, action = "crash", station = "understudy" },
]
[[expect.during]]
from = 20
to = 20
remote_io = "robot-io"
source = "direct"
"#
    ));
}

#[test]
fn steps_with_numbers_and_peers() {
    assert_snapshot!(check(
        r#"
title = "Keys that belong to other actions, and numbers out of bounds"
cycles = 100
seed = -3
[network]
corruption = 2
from = 50
to = 50
[[step]]
at = 10
action = "cut"
station = "robot"
to = ["press", "pres-io", "robot", "arm"]
both_ways = "yes"
[[step]]
at = 10
action = "slow"
station = "arm"
by = "2ms"
[[step]]
at = 10
action = "slow"
station = "press"
[[step]]
at = 10
action = "slow"
station = "press"
by = "2s"
frames = 3
[[step]]
at = 10
action = "flip-state"
station = "understudy"
bit = 70000
[[step]]
at = 10
action = "flip-state"
station = "understudy"
program = "robot-io"
[[step]]
at = 10
action = "flip-word"
station = "press-io"
[[step]]
at = 10
action = "corrupt"
station = "press-io"
frames = 0
[expect]
protected = 1
"#
    ));
}

/// One step of a file may be many: a cut to several members, both ways.
#[test]
fn a_cut_names_one_or_many_or_nobody() {
    let steps = |keys: &str| {
        let text = format!(
            "title = \"\"\ncycles = 100\n[[step]]\nat = 10\naction = \"cut\"\nstation = \"robot\"\n{keys}"
        );
        let scenario = read("cut.toml", &text, Some(&members())).scenario;
        scenario.expect("no errors").steps.len()
    };
    assert_eq!(steps("to = \"press\""), 1);
    assert_eq!(steps("to = \"press\"\nboth_ways = true"), 2);
    assert_eq!(steps("to = [\"press\", \"press-io\"]"), 2);
    assert_eq!(steps(""), 4);
    assert_eq!(steps("both_ways = true"), 8);
}

#[test]
fn a_text_that_is_no_toml() {
    assert_snapshot!(check("title = \"open\ncycles = = 3\n[expect\n"));
}

#[test]
fn steps_come_in_the_order_of_their_times() {
    let text = r#"
title = "Order"
cycles = 100
step = [
    { at = 30, action = "restart", station = "robot" },
    { at = 10, phase = 0.5, action = "crash", station = "robot" },
    { at = 10, phase = 0.25, action = "stop", station = "press" },
]
"#;
    let found = read("scenario.toml", text, Some(&members()));
    let scenario = found.scenario.expect("it is right");
    let steps = scenario.steps.iter();
    let order: Vec<(u64, f64)> = steps.map(|step| (step.at_cycle, step.phase)).collect();
    assert_eq!(order, [(10, 0.25), (10, 0.5), (30, 0.0)]);
}

#[test]
fn any_text_is_answered() {
    use std::collections::hash_map::DefaultHasher;
    use std::hash::{Hash, Hasher};
    // Every prefix of a file that is right, and every file that lacks one of its characters.
    let text = include_str!("../kill-each.toml");
    let mut seen = DefaultHasher::new();
    for (place, letter) in text.char_indices() {
        let without = format!("{}{}", &text[..place], &text[place + letter.len_utf8()..]);
        for text in [&text[..place], &without] {
            let found = read("scenario.toml", text, Some(&members()));
            found.report.diagnostics.len().hash(&mut seen);
            for diagnostic in &found.report.diagnostics {
                assert!(diagnostic.span.end <= text.len(), "{diagnostic:?}");
            }
        }
    }
    assert_ne!(seen.finish(), DefaultHasher::new().finish());
}

#[test]
fn scenarios_are_told_from_clusters() {
    assert!(looks_like_a_scenario(include_str!("../table-two.toml")));
    assert!(!looks_like_a_scenario("[cluster]\nname = \"a\"\n"));
}

#[test]
fn what_sets_inputs_is_read_as_it_is_written() {
    let members = Members::of(&press_cell(Mode::Full));
    let step = |action: &str, more: &str| {
        format!("[[step]]\nat = 10\naction = \"{action}\"\nstation = \"robot-io\"\n{more}\n")
    };
    let text = "title = \"Set\"\ncycles = 20\n".to_owned()
        + &step("set", "input = \"arm_left\"\nvalue = true")
        + &step("release", "input = \"arm_left\"")
        + &step("release", "");
    let found = read("scenario.toml", &text, Some(&members));
    assert_eq!(found.report.diagnostics, []);
    let scenario = found.scenario.expect("no diagnostics");
    let again = write(&scenario, &members, &[]);
    let again = read("scenario.toml", &again, Some(&members));
    assert_eq!(again.scenario, Some(scenario));
    let wrong = step("set", "input = \"arm_lift\"\nvalue = 3");
    let wrong = format!("title = \"Set\"\ncycles = 20\n{wrong}");
    let wrong = read("scenario.toml", &wrong, Some(&members));
    let codes = wrong.report.diagnostics.iter().map(|found| found.code);
    assert_eq!(codes.collect::<Vec<_>>(), ["U0309"]);
}

/// The direct link of a remote I/O is pulled and plugged in, as it is written; a member without one has none to pull.
#[test]
fn a_direct_link_is_pulled_where_there_is_one() {
    let cluster = "[cluster]\nname = \"linked\"\n[[controller]]\nname = \"pump\"\nladder = \"pump.ladder\"\n\
        [[remote_io]]\nname = \"io\"\ncontroller = \"pump\"\n\
        twin = { name = \"io-2\", wiring = \"exclusive\", direct_link = true }\n";
    let ladder = "program pump\ninput full\noutput run\nrung \"run\"\n  /full ( run )\n";
    let mut open = |_: &str| Ok(ladder.to_owned());
    let cluster = understudy_cluster::read("cluster.toml", cluster, &mut open).cluster;
    let members = Members::of(&cluster.expect("right"));
    let step = |at: u32, action: &str, station: &str, more: &str| {
        format!("[[step]]\nat = {at}\naction = \"{action}\"\nstation = \"{station}\"\n{more}\n")
    };
    let found = |steps: &str| {
        read("s.toml", &format!("title = \"t\"\ncycles = 50\n{steps}"), Some(&members))
    };
    let steps = step(1, "unplug", "io-2", "direct_link = true")
        + &step(9, "plug", "io", "direct_link = true\nothers = true");
    let scenario = found(&steps).scenario.expect("right");
    let done: Vec<(Member, Action)> =
        scenario.steps.iter().map(|step| (step.member, step.action)).collect();
    let (io, twin) = (Member::RemoteIo(ProgramId(0)), Member::Twin(ProgramId(0)));
    let (pulled, plugged) =
        (Action::Unplug { network: Via::Link }, Action::Plug { network: Via::Link });
    assert_eq!(done, [(twin, pulled), (io, plugged), (twin, plugged)]);
    let again = read("s.toml", &write(&scenario, &members, &[]), Some(&members));
    assert_eq!(again.scenario.expect("right").steps, scenario.steps);

    for (station, more, code) in [
        ("pump", "direct_link = true", "U0309"),
        ("io", "", "U0303"),
        ("io", "network = 1", "U0309"),
        ("io", "network = 3", "U0305"),
        ("io", "network = 1\ndirect_link = true", "U0309"),
    ] {
        let report = found(&step(1, "unplug", station, more)).report;
        let codes: Vec<&str> = report.diagnostics.iter().map(|it| it.code).collect();
        assert_eq!(codes, [code], "{station} {more}");
    }
}
