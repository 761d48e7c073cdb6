//! Looking at a run: `top`, `why`, `journal` and `diff`, from outside.

use std::fs;
use std::path::PathBuf;

use insta::assert_snapshot;

use crate::{empty_folder, understudy_in};

/// The scenario of short kills, simulated in a folder of its own.
fn run(name: &str, seed: &str) -> PathBuf {
    let folder = empty_folder(name);
    let root = env!("CARGO_MANIFEST_DIR");
    fs::create_dir(folder.join("cell")).expect("a folder");
    for file in ["cluster.toml", "robot.ladder", "press.ladder"] {
        let source = format!("{root}/examples/press-cell/{file}");
        fs::copy(source, folder.join("cell").join(file)).expect("copied");
    }
    let scenario = format!("{root}/scenarios/kill-each.toml");
    let arguments =
        ["simulate", "cell/cluster.toml", "--scenario", &scenario, "--seed", seed, "--out", "runs"];
    let answer = understudy_in(&folder, &arguments);
    assert_eq!(answer.status, 0, "{}", answer.shown());
    // The run says itself what it ran.
    fs::remove_dir_all(folder.join("cell")).expect("it goes");
    folder
}

#[test]
fn an_output_is_explained() {
    let folder = run("why", "1");
    let shown = understudy_in(&folder, &["why", "press.move_down", "--at", "133"]);
    assert_snapshot!(shown.shown());
    let json = understudy_in(&folder, &["why", "press.%QX0.0", "--at", "133", "--json"]).json();
    assert_eq!(json["result"]["source"], "reconstructed");
    assert_eq!(json["result"]["reconstructed"]["proved"], true);
    assert_eq!(json["result"]["because"]["rung"], 1);
    let unknown = understudy_in(&folder, &["why", "griip"]);
    assert_eq!(unknown.status, 2);
    assert!(unknown.errors.contains("did you mean `grip`?"), "{}", unknown.errors);
}

#[test]
fn a_journal_is_listed() {
    let folder = run("journal", "1");
    let listed = |arguments: &[&str]| {
        let all = [&["journal"], arguments].concat();
        let answer = understudy_in(&folder, &all);
        assert_eq!(answer.status, 0, "{}", answer.shown());
        answer.output
    };
    assert_snapshot!(listed(&[
        "--event",
        "source",
        "--event",
        "fault",
        "--event",
        "synchronised",
        "--from",
        "0",
        "--to",
        "100"
    ]));
    let ordinary =
        listed(&["--member", "press-io", "--event", "applied", "--from", "119", "--to", "121"]);
    assert_snapshot!(ordinary);
    // A run that is over is followed to its end.
    assert_eq!(listed(&["--follow", "--program", "press"]), listed(&["--program", "press"]));
    let json = understudy_in(&folder, &["journal", "--to", "3", "--json"]).json();
    assert!(json["result"]["lines"].as_array().is_some_and(|lines| !lines.is_empty()));
    let wrong = understudy_in(&folder, &["journal", "--member", "robbot", "--event", "flaged"]);
    assert_eq!(wrong.status, 2);
    for hint in ["did you mean `robot`?", "did you mean `flagged`?"] {
        assert!(wrong.errors.contains(hint), "{}", wrong.errors);
    }
}

#[test]
fn a_run_is_shown_at_once() {
    let folder = run("top", "1");
    let shown = understudy_in(&folder, &["top", "--once"]);
    assert_snapshot!(shown.shown());
    let json = understudy_in(&folder, &["top", "--json"]).json();
    assert_eq!(json["result"]["margin"]["survives"], 1);
    assert_eq!(json["result"]["cycle"], 299);
    let no_terminal = understudy_in(&folder, &["top"]);
    assert_eq!(no_terminal.status, 2);
    assert!(no_terminal.errors.contains("--once"), "{}", no_terminal.errors);
}

#[test]
fn two_runs_are_compared() {
    let folder = run("diff", "1");
    let runs = fs::read_dir(folder.join("runs")).expect("runs");
    let first = runs
        .map(|entry| entry.expect("a run").path())
        .find(|path| !path.is_symlink())
        .expect("a run");
    let cluster = first.join("cluster/cluster.toml").display().to_string();
    let first = first.display().to_string();
    let same = understudy_in(&folder, &["diff", &first, "runs/latest"]);
    assert_snapshot!(same.shown());
    let again = ["simulate", &cluster, "--cycles", "300", "--seed", "1", "--out", "runs"];
    assert_eq!(understudy_in(&folder, &again).status, 0);
    assert_eq!(same.status, 0);
    let other = understudy_in(&folder, &["diff", &first, "runs/latest", "--json"]);
    assert_eq!(other.status, 1, "they differ");
    let other = other.json();
    let differences = other["result"]["differences"].as_array().expect("a list");
    let part = differences.first().expect("one was killed");
    assert_eq!(part["cycle"], 30);
    let images = ["inputs", "outputs"].map(serde_json::Value::from);
    assert!(differences.iter().all(|found| !images.contains(&found["what"])));
}
