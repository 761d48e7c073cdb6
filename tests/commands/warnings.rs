//! Every warning that a command finds is said: the command prints it, or it counts it and names the `check` that lists it.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::{Answer, empty_folder, understudy_in};

/// A program whose task has an interval, and whose counter leaves its type.
const COUNTING: &str = "\
PROGRAM counting
VAR_INPUT a : BOOL; END_VAR
VAR_OUTPUT n : INT; END_VAR
n := n + 1;
END_PROGRAM
CONFIGURATION c RESOURCE r ON plc
TASK t(INTERVAL := T#20ms, PRIORITY := 0);
PROGRAM i WITH t : counting;
END_RESOURCE END_CONFIGURATION
";

/// Two Boolean programs whose tasks have other intervals.
const BOTH: &str = "\
PROGRAM fast
VAR_INPUT a : BOOL; END_VAR
VAR_OUTPUT x : BOOL; END_VAR
x := a AND NOT x;
END_PROGRAM
PROGRAM slow
VAR_INPUT b : BOOL; END_VAR
VAR_OUTPUT y : BOOL; END_VAR
y := b AND NOT y;
END_PROGRAM
CONFIGURATION c RESOURCE r ON plc
TASK t(INTERVAL := T#10ms, PRIORITY := 0);
TASK u(INTERVAL := T#25ms, PRIORITY := 1);
PROGRAM i WITH t : fast;
PROGRAM j WITH u : slow;
END_RESOURCE END_CONFIGURATION
";

/// A ladder with a preset that is no multiple of most periods, and a rung without effect.
const LADDER: &str = "\
program waiting
input a
output y
output z
rung
    a {TON wait 25ms} ( y )
rung
    a ( z )
rung
    a ( z )
";

/// The places of findings in a document.
fn findings(answer: &Answer) -> Vec<(String, String, String)> {
    let document = answer.json();
    let found = document["diagnostics"].as_array().expect("a list").iter();
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    found.map(|it| (text(&it["file"]), text(&it["code"]), text(&it["message"]))).collect()
}

/// Runs a command, and checks that it says each of its warnings; how many it counts, and how many it prints.
fn said(folder: &Path, command: &[&str]) -> (usize, usize) {
    let all = findings(&understudy_in(folder, &[command, &["--json"]].concat()));
    // What was written is written again.
    let _ = fs::remove_dir_all(folder.join("cell"));
    let answer = understudy_in(folder, command);
    assert_eq!(answer.status, 0, "{command:?}: {}", answer.shown());
    let sentence = answer.errors.lines().find_map(|line| {
        let (count, rest) = line.split_once(" warning")?;
        let (_, files) = rest.split_once("; `understudy check ")?;
        let (files, _) = files.split_once("` lists")?;
        Some((count.parse::<usize>().ok()?, files.to_owned()))
    });
    let (count, files) = sentence.unwrap_or_default();
    let files: Vec<&str> = files.split_whitespace().collect();
    let listed = match files.as_slice() {
        [] => Vec::new(),
        files => {
            let check = [&["check", "--budget", "0s", "--json"], files].concat();
            findings(&understudy_in(folder, &check))
        }
    };
    let is_counted = |found: &&(String, String, String)| listed.contains(found);
    let printed = answer.errors.lines().filter(|line| line.starts_with("warning[")).count();
    assert_eq!(all.iter().filter(is_counted).count(), count, "{command:?}: {}", answer.shown());
    for found in all.iter().filter(|found| !is_counted(found)) {
        let is_said = answer.errors.contains(&found.2) || answer.output.contains(&found.2);
        assert!(is_said, "{command:?}: {found:?} is not in {}", answer.shown());
    }
    (count, printed)
}

#[test]
fn every_warning_is_printed_or_listed_by_the_check_that_is_named() {
    let folder = empty_folder("warnings");
    let write = |name: &str, text: &str| fs::write(folder.join(name), text).expect("written");
    write("counting.st", COUNTING);
    write("both.st", BOTH);
    write("waiting.ladder", LADDER);
    let drafted = understudy_in(
        &folder,
        &["init", "plant", "--from", "counting.st", "both.st", "waiting.ladder"],
    );
    assert_eq!(drafted.status, 0, "{}", drafted.shown());
    let cluster = "plant/cluster.toml";
    let check = |command: &[&str], expected: (usize, usize)| {
        assert_eq!(said(&folder, command), expected, "{command:?}");
    };
    check(&["scan", "counting.st", "--digest", "9"], (0, 0));
    check(&["scan", "counting.st", "--digest", "9", "--period", "10ms"], (0, 0));
    check(&["scan", "counting.st", "--digest", "9", "--period", "30ms"], (0, 1));
    check(&["scan", "both.st", "--digest", "9", "--period", "10ms"], (0, 1));
    check(&["scan", "both.st", "--digest", "9", "--program", "slow"], (0, 0));
    check(&["verify", "both.st", "--period", "10ms"], (0, 1));
    check(&["verify", "both.st", "--program", "slow", "--period", "5ms"], (0, 0));
    // Two coils of one output; remarks of `verify` are in its answer.
    check(&["verify", "waiting.ladder"], (1, 0));
    check(&["resources", "waiting.ladder"], (1, 0));
    check(&["init", "cell", "--from", "counting.st", "both.st", "waiting.ladder"], (1, 0));
    check(&["device", "both.st", "--registers", "--period", "10ms"], (0, 1));
    let places = said(&folder, &["verify", cluster]).0;
    assert!(places > 0);
    let simulate = ["simulate", cluster, "--cycles", "5", "--seed", "1"];
    check(&simulate, (places, 0));
    let (count, printed) = said(&folder, &[&simulate[..], &["--period", "20ms"]].concat());
    assert_eq!(count, places);
    assert!(printed >= 2, "{printed} of the two programs whose intervals 20ms does not divide");
}

/// Programs of one file that are drafted for controllers of their own keep their intervals, and the drafted period divides all.
#[test]
fn drafted_programs_keep_their_intervals() {
    let folder = empty_folder("warnings_drafted");
    fs::write(folder.join("both.st"), BOTH).expect("written");
    let drafted = understudy_in(&folder, &["init", "cell", "--from", "both.st"]);
    assert_eq!(drafted.status, 0, "{}", drafted.shown());
    let cluster = fs::read_to_string(folder.join("cell/cluster.toml")).expect("written");
    assert!(cluster.contains("period = \"5ms\""), "{cluster}");
    for (file, interval) in [("fast.st", "T#10ms"), ("slow.st", "T#25ms")] {
        let text = fs::read_to_string(folder.join("cell").join(file)).expect("written");
        assert!(text.contains(&format!("INTERVAL := {interval}")), "{text}");
    }
}
