//! Every example of `--help` is pasted into a shell, in a folder with the examples of the project.

use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::{empty_folder, understudy, understudy_in};

/// Examples that this test does not run, by a part of each, and why. The command line understands them all (`cli/commands.rs`).
const NOT_RUN: [(&str, &str); 34] = [
    ("new/cluster.toml ", "changes a cluster that runs"),
    ("fails.toml", "ends with 1, since a property fails"),
    ("TcPOU", "names the files of a project of another tool"),
    ("understudy demo", "runs for a minute; the tests of the page run it"),
    ("understudy lab ", "runs for a minute; the tests of the laboratory run it"),
    ("understudy watch ", "serves until it is interrupted"),
    ("understudy top", "follows a run until it ends"),
    ("--follow", "follows a run until it ends"),
    ("understudy device ", "serves until it is interrupted"),
    ("understudy proxy ", "serves until it is interrupted"),
    ("gateway metrics runs/latest --listen", "serves until it is interrupted"),
    ("gateway modbus ", "serves until it is interrupted"),
    ("gateway zenoh ", "serves until it is interrupted"),
    ("gateway signals ", "serves until it is interrupted"),
    ("gateway notify ", "needs a cluster file with a command"),
    ("understudy node ", "is a member of a cluster"),
    ("understudy remote-io ", "is a member of a cluster"),
    ("understudy plant ", "is a member of a cluster"),
    ("understudy spare ", "serves until it is interrupted"),
    ("gateway metrics plant.toml", "serves until it is interrupted"),
    ("understudy retained show ", "needs what members have kept"),
    ("understudy operate ", "commands a cluster that runs"),
    ("understudy measure ", "runs for minutes"),
    ("--runs 2000 ", "runs for a minute in a debug build"),
    ("model-check", "runs for minutes in a debug build"),
    ("complete.ladder", "runs for its budget of a minute"),
    ("sudo ", "is for the administrator of a machine"),
    ("/etc/understudy", "examines the machine of a member"),
    ("understudy doctor", "finds what this machine has"),
    ("diff runs/2026", "names a run by its time"),
    ("--report", "is run by the tests of reports"),
    ("| man", "shows a page in a terminal"),
    ("~/", "writes to the home folder of a person"),
    ("outlook", "needs a run with a finished repair"),
];

/// The examples of a command line's help.
fn examples(help: &str) -> Vec<String> {
    let behind = help.split_once("Example:\n").map_or("", |(_, behind)| behind);
    let lines = behind.lines().take_while(|line| line.starts_with("  "));
    // An explanation stands behind several blanks.
    lines.filter_map(|line| Some(line.trim().split("   ").next()?.to_owned())).collect()
}

/// The names below a heading of a help text.
fn names(help: &str, is_whole: bool) -> Vec<String> {
    let list = match is_whole {
        true => help.split("Options:").next().unwrap_or_default(),
        false => help.split_once("Commands:\n").map_or("", |(_, behind)| behind),
    };
    let lines = list.lines().take_while(|line| is_whole || !line.is_empty());
    let names = lines.filter_map(|line| line.strip_prefix("  ")?.split_whitespace().next());
    names.filter(|name| *name != "help").map(str::to_owned).collect()
}

/// A folder of a help text, with what its examples find: the examples of the project, a run, a cluster, and files of a person.
fn folder_of(title: &str, lines: &[String], runs: &Path) -> PathBuf {
    let folder = empty_folder(&format!("pasted-{}", title.replace(' ', "-")));
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for name in ["examples", "scenarios"] {
        symlink(root.join(name), folder.join(name)).expect("linked");
    }
    symlink(runs, folder.join("runs")).expect("linked");
    let needs = |what: &str| lines.iter().any(|line| line.contains(what));
    let run = |arguments: &[&str]| {
        let made = understudy_in(&folder, arguments);
        assert_eq!(made.status, 0, "{title}: {arguments:?}: {}", made.shown());
    };
    if needs(" cell/") {
        run(&["init", "cell"]);
    }
    if needs("cell/keys") && !needs("keys init") {
        run(&["keys", "init", "cell/cluster.toml", "--folder", "cell/keys"]);
    }
    if needs("prices.csv") {
        run(&["catalogue", "export", "--output", "prices.csv"]);
    }
    if needs("plant.chain") {
        let page = fs::read_to_string(root.join("docs/reference/reliability.md")).expect("a page");
        let (_, chain) = page.split_once("```text plant.chain\n").expect("a chain");
        let (chain, _) = chain.split_once("```").expect("its end");
        fs::write(folder.join("plant.chain"), chain).expect("written");
    }
    folder
}

fn paste(folder: &Path, line: &str) -> Result<(), String> {
    let binary = Path::new(env!("CARGO_BIN_EXE_understudy")).parent().expect("a folder");
    let path = std::env::var("PATH").unwrap_or_default();
    let pasted = Command::new("sh")
        .args(["-c", line])
        .current_dir(folder)
        .env("PATH", format!("{}:{path}", binary.display()))
        .stdin(Stdio::null())
        .output()
        .expect("a shell");
    if pasted.status.success() {
        return Ok(());
    }
    let said = String::from_utf8_lossy(&pasted.stderr);
    Err(format!("{line}: {}: {said:.600}", pasted.status))
}

#[test]
fn every_example_of_the_help_runs() {
    let runs = empty_folder("pasted-runs");
    let recorded = understudy(&[
        "simulate",
        "examples/press-cell/cluster.toml",
        "--scenario",
        "scenarios/kill-each.toml",
        "--seed",
        "7",
        "--out",
        runs.to_str().expect("text"),
    ]);
    assert_eq!(recorded.status, 0, "{}", recorded.shown());
    let mut texts = Vec::new();
    for command in names(&understudy(&["--help"]).output, true) {
        let help = understudy(&[&command, "--help"]).output;
        for below in names(&help, false) {
            let help = understudy(&[&command, &below, "--help"]).output;
            texts.push((format!("{command} {below}"), examples(&help)));
        }
        texts.push((command, examples(&help)));
    }
    let (mut pasted, mut failed, mut left_out) = (0, Vec::new(), BTreeSet::new());
    for (title, lines) in &texts {
        assert!(!lines.is_empty(), "`understudy {title} --help` has no example");
        let folder = folder_of(title, lines, &runs);
        for line in lines {
            let reason = NOT_RUN.iter().find(|(part, _)| line.contains(part));
            if let Some((part, _)) = reason {
                left_out.insert(*part);
                continue;
            }
            pasted += 1;
            failed.extend(paste(&folder, line).err());
        }
    }
    assert!(failed.is_empty(), "{} of {pasted}:\n{}", failed.len(), failed.join("\n"));
    assert!(pasted > 90, "{pasted}");
    assert_eq!(left_out.len(), NOT_RUN.len(), "a reason is of no example: {left_out:?}");
}
