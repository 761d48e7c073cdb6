//! Inputs that operators write, and signals of other programs.

use std::time::Duration;

use crate::common::{findings, load, load_with};
use understudy_cluster::Overrides;
use understudy_remote_io::{
    OperatorInput, OperatorInputKind, PointPlace, SignalInput, SignalSource,
};
use understudy_typed::Elementary;
use understudy_wire::{Member, ProgramId, Role};

const LEFT: &str = "PROGRAM left
VAR_INPUT there : BOOL; start : BOOL; speed : REAL; ready : BOOL; END_VAR
VAR_OUTPUT velocity : REAL; END_VAR
velocity := speed;
END_PROGRAM";

const RIGHT: &str = "PROGRAM right
VAR_INPUT level : REAL; END_VAR
VAR_OUTPUT level_out : REAL; done : BOOL; END_VAR
level_out := level;
done := level > 1.0;
END_PROGRAM";

const FILES: [(&str, &str); 2] = [("left.st", LEFT), ("right.st", RIGHT)];

const HEAD: &str = r#"
[cluster]
name = "cell"
period = "20ms"
[[controller]]
name = "left"
ladder = "left.st"
[[controller]]
name = "right"
ladder = "right.st"
"#;

fn with_inputs(inputs: &str) -> String {
    format!("{HEAD}[[remote_io]]\ncontroller = \"left\"\n[remote_io.inputs]\n{inputs}")
}

fn check(inputs: &str) -> String {
    findings(&load(&with_inputs(inputs), &FILES).reports)
}

/// An error elsewhere, or one in the section itself: no finding follows that is not there without it.
#[test]
fn an_error_makes_no_source_of_an_input_a_second_one() {
    let plant = "PROGRAM plant
VAR_INPUT velocity : REAL; END_VAR
VAR_OUTPUT there : BOOL; END_VAR
there := velocity > 1.0;
END_PROGRAM";
    let files = [FILES[0], FILES[1], ("plant.st", plant)];
    let inputs = "start = { operator = \"level\" }\nspeed = { operator = \"setpoint\", low = 0, high = 9 }\nready = { from = \"right.done\", default = false }\n";
    let plant = "[[plant]]\ncontroller = \"left\"\nladder = \"plant.st\"\n";
    let text = with_inputs(inputs) + plant;
    let right = load(&text, &files);
    assert!(right.cluster.is_some(), "{}", findings(&right.reports));
    for (from, to) in [
        ("period = \"20ms\"", "period = \"20\""),
        ("ladder = \"right.st\"", "ladder = \"none.st\""),
        ("default = false", "default = 7"),
        (
            "[[plant]]",
            "[[alarm]]\nsignal = \"left.none\"\nname = \"a\"\nwhen = true\ntext = \"b\"\n[[plant]]",
        ),
    ] {
        assert!(text.contains(from), "{from}");
        let found = findings(&load(&text.replace(from, to), &files).reports);
        assert!(found.contains("error") && !found.contains("U0224"), "{to}: {found}");
    }
}

#[test]
fn a_remote_io_is_told_the_sources_of_its_inputs() {
    let text = with_inputs(
        r#"start = { operator = "pulse", duration = "50ms", role = "engineer" }
speed = { operator = "setpoint", low = -5, high = 12.5 }
ready = { from = "right.done", default = true, stale_after = 7 }
"#,
    );
    let cluster = load(&text, &FILES).cluster.expect("it is right");
    let settings = cluster.remote_io_settings(ProgramId(0)).expect("it is there");
    let place = |bit, of| PointPlace { bit, of };
    let bits = |value: f32| u64::from(value.to_bits());
    let start = OperatorInput {
        place: place(1, Elementary::Bool),
        // Rounded up to whole cycles.
        kind: OperatorInputKind::Pulse(3),
        initial: 0,
        role: Role::Engineer,
        retains: false,
    };
    let speed = OperatorInput {
        place: place(32, Elementary::Real),
        kind: OperatorInputKind::Setpoint { low: bits(-5.0), high: bits(12.5) },
        initial: bits(-5.0),
        role: Role::Operator,
        retains: false,
    };
    assert_eq!(settings.layout.operator_inputs, [start, speed]);
    let ready = SignalInput {
        from: ProgramId(1),
        output: 32,
        place: place(64, Elementary::Bool),
        valid: None,
        default: 1,
        stale_after: 7,
    };
    assert_eq!(settings.layout.signals, [ready]);
    let source = SignalSource { program: ProgramId(1), outputs: 34, stopped: Some(33) };
    assert_eq!(settings.layout.signal_sources, [source]);
    let pair = [1, 0].map(|program| Member::RemoteIo(ProgramId(program)));
    let roster = cluster.roster();
    assert!(roster.is_received(pair[0], pair[1]) && !roster.is_received(pair[1], pair[0]));
}

#[test]
fn a_signal_of_another_group_is_an_input_that_ends() {
    let declared = |from: &str, stale_after: u32| {
        let default = if from.contains("level") { "-1.5" } else { "true" };
        let name = if from.contains("level") { "speed" } else { "ready" };
        format!(
            "{name} = {{ from = \"{from}\", default = {default}, stale_after = {stale_after} }}\n"
        )
    };
    let inputs = declared("line-1/press.done", 50) + &declared("line-1/press.level", 75);
    let cluster = load(&with_inputs(&inputs), &FILES).cluster.expect("it is right");
    let settings = cluster.remote_io_settings(ProgramId(0)).expect("it is there");
    let kinds: Vec<OperatorInputKind> =
        settings.layout.operator_inputs.iter().map(|it| it.kind).collect();
    let group = |stale_after| OperatorInputKind::Group { stale_after, valid: None };
    assert_eq!(kinds, [group(50), group(75)]);
    assert_eq!(settings.layout.operator_inputs[0].initial, 1);
    assert!(settings.layout.signals.is_empty());
    insta::assert_snapshot!(check(
        "ready = { from = \"line-1/press\", default = false }\n\
         speed = { from = \"line-1/press.level\", default = 0.0, stale_after = 49 }\n"
    ));
}

#[test]
fn structured_text_reads_whether_a_signal_is_valid() {
    let left = LEFT.replace("ready : BOOL;", "ready : BOOL; ready_valid : BOOL;");
    let left = left
        .replace("velocity := speed;", "IF ready AND ready_valid THEN velocity := speed; END_IF;");
    let files = [("left.st", left.as_str()), FILES[1]];
    let signal = "ready = { from = \"right.done\", default = false }\n";
    let settings = |inputs: &str| {
        let cluster = load(&with_inputs(inputs), &files).cluster.expect("it is right");
        cluster.remote_io_settings(ProgramId(0)).expect("it is there")
    };
    assert_eq!(settings(signal).layout.signals[0].valid, Some(65));
    // An input with a source of its own is another one.
    let level = format!("{signal}ready_valid = {{ operator = \"level\" }}\n");
    assert_eq!(settings(&level).layout.signals[0].valid, None);
}

#[test]
fn what_is_declared_wrongly_is_said() {
    insta::assert_snapshot!(check(
        r#"starts = { operator = "pulse" }
start = { operator = "puls" }
there = { operator = "setpoint", low = 0, high = 3 }
speed = { operator = "setpoint", low = 10.0, high = 2.0, duration = "1s" }
ready = { from = "rigth.done", default = false }
"#
    ));
    insta::assert_snapshot!(check(
        r#"start = { title = "x", operator = "level", low = 3 }
there = { from = "right.level_out", default = true }
speed = { from = "left.velocity", default = 0.0 }
ready = { from = "right", stale_after = -1 }
"#
    ));
    insta::assert_snapshot!(check(
        "start = 5\nspeed = { operator = \"setpoint\", initial = 7.0 }\n"
    ));
    insta::assert_snapshot!(check(
        "start = { operator = \"level\" }\nspeed = { operator = \"setpoint\", low = 0, high = 1, initial = 7.0 }\n\
         [remote_io.field]\nmodbus = \"127.0.0.1:502\"\ninputs = { start = \"discrete:0\" }\n"
    ));
}

#[test]
fn behaviour_is_in_the_hash_and_texts_for_people_are_not() {
    let hash = |inputs: &str| {
        let loaded = load_with(&with_inputs(inputs), &FILES, Overrides::default());
        loaded.cluster.expect("it is right").agreement().configuration
    };
    let plain = hash("start = { operator = \"level\" }");
    let titled = hash("start = { operator = \"level\", title = \"Start\", confirm = true }");
    assert_eq!(plain, titled);
    let others = [
        "",
        "start = { operator = \"pulse\" }",
        "start = { operator = \"level\", initial = true }",
        "start = { operator = \"level\", role = \"engineer\" }",
        "there = { operator = \"level\" }",
        "start = { from = \"right.done\", default = false }",
        "start = { from = \"right.done\", default = true }",
        "start = { from = \"right.done\", default = false, stale_after = 4 }",
    ];
    let mut hashes: Vec<_> = others.into_iter().map(hash).chain([plain]).collect();
    let period = Some(Duration::from_millis(40));
    let overrides = Overrides { period, ..Overrides::default() };
    let slower = load_with(&with_inputs(others[1]), &FILES, overrides);
    hashes.push(slower.cluster.expect("it is right").agreement().configuration);
    let count = hashes.len();
    hashes.sort_unstable();
    hashes.dedup();
    assert_eq!(hashes.len(), count);
}
