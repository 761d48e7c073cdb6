//! Programs with numbers: program faults, causes and values.

use std::collections::BTreeSet;
use std::sync::Arc;

use serde_json::{Value, json};
use understudy_cluster::{Cluster, Overrides, read_with};
use understudy_view::{Bounds, Filter, Level, Listing, Model, NamedValue, Reason, diff};
use understudy_wire::ProgramId;

use crate::support::{records, scenario};

const CLUSTER: &str = "\
[cluster]
name = \"feed\"
period = \"10ms\"

[[controller]]
name = \"feed\"
ladder = \"feed.st\"

[[controller]]
name = \"other\"
ladder = \"feed.st\"

[[remote_io]]
controller = \"feed\"
hold_cycles = 5
fail_safe = { rate = 0.5 }

[[plant]]
controller = \"feed\"
ladder = \"belt.st\"

[[plant]]
controller = \"other\"
ladder = \"steady.st\"
";

/// Divides by an input.
const FEED: &str = "\
(* Shares 600 among the parts of a belt. *)
PROGRAM feed
  VAR_INPUT
    speed : INT;
    run : BOOL;
  END_VAR
  VAR_OUTPUT
    share : INT;
    rate : REAL;
    busy : BOOL;
  END_VAR
  VAR sum : REAL; END_VAR
  VAR_TEMP part : REAL; END_VAR
  IF run THEN
    share := 600 / speed;
    part := INT_TO_REAL(share) * 0.5;
    sum := sum + part;
    rate := part;
    busy := TRUE;
  END_IF;
END_PROGRAM
";

/// Stands still in one scan.
const BELT: &str = "\
PROGRAM belt
  VAR_INPUT share : INT; rate : REAL; busy : BOOL; END_VAR
  VAR_OUTPUT speed : INT := 30; run : BOOL := TRUE; END_VAR
  VAR n : INT; END_VAR
  n := n + 1;
  run := TRUE;
  IF n = 60 THEN speed := 0; ELSE speed := 30; END_IF;
END_PROGRAM
";

fn feed() -> Cluster {
    cluster_of(FEED, BELT)
}

fn cluster_of(feed: &str, belt: &str) -> Cluster {
    let steady = BELT.replace("n = 60", "n = -1");
    let loaded = read_with("cluster.toml", CLUSTER, Overrides::default(), &mut |name| match name {
        "feed.st" => Ok(feed.to_owned()),
        "belt.st" => Ok(belt.to_owned()),
        "steady.st" => Ok(steady.clone()),
        _ => Err("no such file".to_owned()),
    });
    let reports = loaded.reports.iter().flat_map(|it| &it.diagnostics);
    let found: Vec<String> = reports.map(|found| found.message.clone()).collect();
    loaded.cluster.unwrap_or_else(|| panic!("{found:?}"))
}

const RELEASED: &str = "\
title = \"A program fault and its release\"
cycles = 200

[[step]]
at = 20
action = \"crash\"
station = \"feed\"

[[step]]
at = 40
action = \"restart\"
station = \"feed\"

[[step]]
at = 120
action = \"release\"
station = \"feed-io\"
";

fn seen(cluster: &Cluster, text: &str) -> Model {
    let mut model = Model::new(Arc::new(cluster.clone()), Bounds::default());
    for record in records(cluster, &scenario(cluster, text), 1) {
        model.note(&record);
    }
    model
}

const FAULT: &str = "program fault in feed: feed, line 15: division of 600 by zero";

#[test]
fn a_program_fault_is_an_alarm_until_the_release() {
    let cluster = feed();
    let model = seen(&cluster, RELEASED);
    let events: Vec<_> = model.events().filter(|event| event.event == "program-fault").collect();
    let [event] = events.as_slice() else {
        panic!("{events:?}");
    };
    assert_eq!((event.text.as_str(), event.level), (FAULT, Level::Alarm));
    let alarms: Vec<_> = model.alarms().filter(|alarm| alarm.alarm == "program-fault").collect();
    let [alarm] = alarms.as_slice() else {
        panic!("{alarms:?}");
    };
    assert_eq!((alarm.text.as_str(), alarm.name.as_str()), (FAULT, "feed-io"));
    assert_eq!(alarm.cycle, event.cycle);
    let over = alarm.over.expect("the operator released it");
    assert!((119..=122).contains(&over), "{alarm:?}");

    let stopped = model.snapshot_at(100).expect("remembered");
    assert_eq!(stopped.programs[0].fault.as_deref(), Some(FAULT));
    assert_eq!(stopped.programs[0].source, Some("fail-safe"));
    assert_eq!(stopped.programs[0].values["rate"], json!(0.5));
    assert_eq!(stopped.programs[1].fault, None);
    let running = model.snapshot_at(190).expect("remembered");
    assert_eq!(running.programs[0].fault, None);
    assert_eq!(running.programs[0].source, Some("direct"));
    let values = &running.programs[0].values;
    assert_eq!(values["share"], json!(20));
    assert_eq!(values["rate"], json!(10.0));
    assert_eq!(values["busy"], json!(true));
    assert_eq!(values["speed"], json!(30));

    let mut listing = Listing::new(&cluster, Filter::default()).expect("no names");
    let records = records(&cluster, &scenario(&cluster, RELEASED), 1);
    let lines = records.iter().flat_map(|record| listing.take(record));
    let faults: Vec<_> = lines.filter(|line| line.event == "program-fault").collect();
    assert_eq!(faults.len(), 1, "{faults:?}");
    assert_eq!((faults[0].text.as_str(), faults[0].cycle), (FAULT, Some(event.cycle)));
}

fn find<'r>(reason: &'r Reason, signal: &str) -> Option<&'r Reason> {
    let mut below = reason.because.iter();
    match reason.signal == signal {
        true => Some(reason),
        false => below.find_map(|below| find(below, signal)),
    }
}

#[test]
fn an_output_is_explained_by_statements_and_inputs() {
    let model = seen(&feed(), RELEASED);
    let why = model.why("feed.rate", Some(30)).expect("known");
    assert_eq!((&why.value, why.source), (&json!(10.0), Some("reconstructed")));
    assert_eq!(why.inputs["speed"], json!(30));
    let reconstructed = why.reconstructed.as_ref().expect("feed is killed");
    assert!(reconstructed.proved);
    assert_eq!(reconstructed.values["rate"], json!(10.0));
    let root = why.because.as_ref().expect("a statement");
    assert_eq!((root.line, root.statement.as_deref()), (Some(18), Some("rate := part;")));
    let part = find(root, "part").expect("read");
    assert_eq!((part.line, &part.value), (Some(16), &json!(10.0)));
    let share = find(part, "share").expect("read");
    assert_eq!((share.line, &share.value), (Some(15), &json!(20)));
    let speed = find(share, "speed").expect("read");
    assert!(speed.text.starts_with("input"), "{}", speed.text);
    let run = find(root, "run").expect("the condition");
    assert!(run.text.ends_with("read by the condition in line 14"), "{}", run.text);

    let sum = model.why("feed.sum", Some(30)).expect("known");
    let root = sum.because.expect("a statement");
    assert_eq!(root.value, sum.value);
    let before = root.because.iter().find(|it| it.signal == "sum").expect("read");
    assert_eq!(before.text, "assigned in cycle 29");
    let input = model.why("feed.speed", Some(30)).expect("known");
    assert_eq!(input.value, json!(30));

    let stopped = model.why("feed.rate", Some(100)).expect("known");
    assert_eq!((&stopped.value, stopped.source), (&json!(0.5), Some("fail-safe")));
    let fault = stopped.because.as_ref().expect("the program fault");
    assert_eq!(fault.line, Some(15));
    assert_eq!(find(fault, "speed").map(|speed| &speed.value), Some(&json!(0)));
    let text = stopped.to_text(understudy_view::Zone::UTC);
    assert!(text.contains("division of 600 by zero"), "{text}");
    let error = model.why("feed.rat", None).expect_err("no such variable");
    assert_eq!(error.code(), "U0573");
}

/// In every cycle of both programs: the values beside the text are those that were applied.
#[test]
fn the_text_shows_the_values_of_its_scan() {
    let model = seen(&feed(), RELEASED);
    for cycle in [10, 30, 50, 190] {
        for program in [0, 1] {
            let program = ProgramId(program);
            let (lines, error) = model.text_at(program, cycle).expect("it has numbers");
            assert!(error.is_none());
            assert_eq!(lines.len(), FEED.lines().count());
            let values = &model.snapshot_at(cycle).expect("known").programs[program.index()].values;
            let line = |number: usize| &lines[number - 1];
            let shown = |place: usize| {
                let NamedValue { name, value, .. } = &line(15).values[place];
                (name.as_str(), value)
            };
            assert_eq!(shown(0), ("share", &values["share"]));
            assert_eq!(shown(1), ("speed", &values["speed"]));
            assert!(line(15).executed && !line(13).executed);
            let part: Vec<&Value> = line(16).values.iter().map(|shown| &shown.value).collect();
            assert_eq!(part, [&values["rate"], &values["share"]]);
        }
    }
    let (lines, _) = model.text_at(ProgramId(0), 60).expect("it has numbers");
    let stop = model.events().find(|event| event.event == "program-fault");
    let stop = stop.expect("one").cycle;
    let (at_stop, _) = model.text_at(ProgramId(0), stop).expect("it has numbers");
    assert!(at_stop[14].failed && !lines[13].failed);
    let uses = model.uses(ProgramId(0)).expect("it has numbers");
    let share = uses.iter().find(|own| own.name == "share").expect("declared");
    assert_eq!((&share.written, &share.read), (&vec![15], &vec![16]));
}

#[test]
fn runs_that_part_show_values() {
    let cluster = feed();
    let quiet = "title = \"quiet\"\ncycles = 200\n";
    let found = diff(&seen(&cluster, RELEASED), &seen(&cluster, quiet));
    let text = found.to_text();
    assert!(!text.contains("00000000"), "{text}");
}

/// A shuttle that stands: the conditions that were false are the answer.
const SHUTTLE: &str = "\
PROGRAM feed
  VAR_INPUT speed : INT; run : BOOL; END_VAR
  VAR_OUTPUT share : INT; rate : REAL; busy : BOOL; END_VAR
  VAR n : INT; kept : INT; END_VAR
  n := n + 1;
  share := 0;
  IF n < 0 THEN
    share := speed;
  ELSIF NOT run THEN
    IF speed > 40 THEN
      share := 2;
    END_IF;
    rate := 1.0;
  END_IF;
  IF n = 5 THEN
    kept := speed;
  END_IF;
  busy := kept > 0;
END_PROGRAM
";

#[test]
fn the_conditions_that_were_false_explain_a_default() {
    let cluster = cluster_of(SHUTTLE, &BELT.replace("run := TRUE;", "run := n MOD 40 < 20;"));
    let model = seen(&cluster, "title = \"stands\"\ncycles = 100\n");
    let mut found = BTreeSet::new();
    for cycle in 50..95 {
        let why = model.why("feed.share", Some(cycle)).expect("known").because.expect("a reason");
        assert_eq!((why.value.clone(), why.line), (json!(0), Some(6)), "{why:#?}");
        let [other] = &why.because[..] else { panic!("{why:#?}") };
        let names: Vec<&str> = other.because.iter().map(|read| read.signal.as_str()).collect();
        found.insert((other.line, other.text.clone(), names.join(" ")));
    }
    let untaken = |line, lines: &str, reads: &str| {
        let text = format!("not assigned in {lines}: this condition did not lead there");
        (Some(line), text, reads.to_owned())
    };
    // While it runs, the outer condition; otherwise the inner one, to which the outer one led.
    let expected = [untaken(7, "lines 8, 11", "n run"), untaken(10, "line 11", "speed")];
    assert_eq!(found, BTreeSet::from(expected));
    // A value that was kept: what could have assigned it in this cycle.
    let kept = model.why("feed.kept", Some(90)).expect("known").because.expect("a reason");
    assert!(kept.text.contains("and unchanged since"), "{kept:#?}");
    let other = &kept.because[0];
    assert_eq!((other.line, other.cycle), (Some(15), 90), "{kept:#?}");
    assert_eq!(other.because[0].signal, "n", "{kept:#?}");
}

/// Assigns one value in each scan, by one statement and then by another one.
const AGAIN: &str = "\
PROGRAM feed
  VAR_INPUT speed : INT; run : BOOL; END_VAR
  VAR_OUTPUT share : INT; rate : REAL; busy : BOOL; END_VAR
  VAR n : INT; on : BOOL; END_VAR
  busy := on;
  n := n + 1;
  IF n > 20 THEN
    on := TRUE;
  END_IF;
  IF n > 40 THEN
    on := TRUE;
  END_IF;
  IF n > 60 THEN
    n := 61;
  END_IF;
END_PROGRAM
";

#[test]
fn a_value_that_was_assigned_again_is_none_that_was_kept() {
    let model = seen(&cluster_of(AGAIN, BELT), "title = \"again\"\ncycles = 100\n");
    let text = |cycle: i64| {
        let because = model.why("feed.busy", Some(cycle)).expect("known").because;
        let because = because.expect("a reason").because;
        let on = because.iter().find(|reason| reason.signal == "on").expect("it is read");
        assert_eq!((&on.value, on.line), (&json!(true), Some(8)), "{on:#?}");
        on.text.clone()
    };
    // It became true in a cycle near the 20th, by line 8, and is assigned in every one since.
    let first = (10..40).find(|cycle| {
        let why = model.why("feed.busy", Some(*cycle)).expect("known");
        why.value == json!(true)
    });
    let set = first.expect("it is set") - 1;
    assert_eq!(text(set + 1), format!("assigned in cycle {set}"));
    let again = format!("assigned in cycle {set}, and again with the same value, last in cycle");
    assert_eq!(text(set + 5), format!("{again} {}", set + 4));
    assert_eq!(text(set + 30), format!("{again} {} by line 11", set + 29));
}

/// Copies arrays and structures as wholes, on the way to its outputs and into variables that it keeps.
const COPIES: &str = "\
TYPE pair : STRUCT left : INT; on : BOOL; END_STRUCT; END_TYPE
FUNCTION_BLOCK keeper
  VAR_INPUT given : pair; END_VAR
  VAR_OUTPUT kept : pair; END_VAR
  kept := given;
END_FUNCTION_BLOCK
PROGRAM feed
  VAR_INPUT speed : INT; run : BOOL; END_VAR
  VAR_OUTPUT share : INT; rate : REAL; busy : BOOL; END_VAR
  VAR n : INT; first, second, early : pair; one, other : ARRAY[0..2] OF INT; keep : keeper; END_VAR
  n := n + 1;
  first.left := speed * 2;
  first.on := run;
  keep(given := first, kept => second);
  one[1] := second.left + 1;
  other := one;
  IF n = 5 THEN
    early := second;
  END_IF;
  share := other[1];
  busy := second.on AND early.on;
END_PROGRAM
";

#[test]
fn a_part_of_what_was_copied_as_a_whole_is_explained() {
    let model = seen(&cluster_of(COPIES, BELT), "title = \"copies\"\ncycles = 40\n");
    let why = |signal: &str| {
        let why = model.why(signal, Some(30)).expect("known");
        let because = why.because.expect("a reason");
        assert_eq!(why.value, because.value, "{because:#?}");
        because
    };
    let share = why("feed.share");
    // Each name on the way from the input, its value, and the line that assigned it.
    let way = [
        ("share", 61, Some(20)),
        ("other[1]", 61, Some(16)),
        ("one[1]", 61, Some(15)),
        ("second.left", 60, Some(14)),
        ("keep.kept.left", 60, Some(5)),
        ("keep.given.left", 60, Some(14)),
        ("first.left", 60, Some(12)),
        ("speed", 30, None),
    ];
    let mut at = &share;
    for (signal, value, line) in way {
        at = find(at, signal).unwrap_or_else(|| panic!("{signal} in {share:#?}"));
        assert_eq!((&at.value, at.line), (&json!(value), line), "{at:#?}");
    }
    assert_eq!(why("feed.second.on").value, json!(true));
    // Never assigned alone, and unchanged since the scan that copied it.
    let early = why("feed.early.left");
    assert_eq!(early.value, json!(60));
    assert!(early.text.contains("and unchanged since"), "{early:#?}");
    assert!(find(&early, "speed").is_some(), "{early:#?}");
    // Not assigned at all but within its whole.
    assert_eq!(why("feed.other[0]").because[0].text, "its initial value");
}
