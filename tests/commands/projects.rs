//! A project of several files is one program, in whatever forms its files are.

use std::fs;
use std::path::{Path, PathBuf};

use crate::{Answer, empty_folder, understudy_in};

/// Files of a project: a program, types and a block, each in another form.
const FILES: [&str; 3] = ["main.st", "types.st", "belt.xml"];

/// A folder with the example of a project.
fn conveyor(name: &str) -> PathBuf {
    let folder = empty_folder(name);
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/other-tools/conveyor");
    for file in FILES {
        fs::copy(example.join(file), folder.join(file)).expect("copied");
    }
    folder
}

fn right(folder: &Path, arguments: &[&str]) -> Answer {
    let answer = understudy_in(folder, arguments);
    assert_eq!(answer.status, 0, "{arguments:?}: {}", answer.shown());
    answer
}

fn wrong(folder: &Path, arguments: &[&str], said: &[&str]) {
    let answer = understudy_in(folder, arguments);
    assert_eq!(answer.status, 2, "{arguments:?}: {}", answer.shown());
    for word in said {
        assert!(answer.errors.contains(word), "{arguments:?}: no {word}: {}", answer.shown());
    }
}

#[test]
fn files_in_several_forms_are_one_program() {
    let folder = conveyor("project-forms");
    // Alone they are not complete; together they are, in any order.
    wrong(&folder, &["check", "main.st"], &["U1041", "`Belt`"]);
    for turn in 0..3 {
        let mut files = FILES;
        files.rotate_left(turn);
        let checked = right(&folder, &[&["check"], &files[..]].concat());
        assert!(FILES.iter().all(|file| checked.output.contains(file)), "{}", checked.shown());
        let proposed = format!("understudy init cell --from {}\n", files.join(" "));
        assert!(checked.errors.contains(&proposed), "{}", checked.shown());
    }
    right(&folder, &["check", "."]);
    fs::write(folder.join("inputs.txt"), "# start stop turning\n1 0 0\n0 0 1\n0 1 1\n")
        .expect("written");
    let scanned = right(&folder, &["scan", ".", "--inputs", "inputs.txt"]).output;
    assert_eq!(scanned, "1 0 0 -> 1 0\n0 0 1 -> 1 0\n0 1 1 -> 0 0\n");
    for form in ["all.st", "all.xml"] {
        right(&folder, &["convert", "main.st", form, "--with", "types.st", "belt.xml"]);
        let converted = right(&folder, &["scan", form, "--inputs", "inputs.txt"]).output;
        assert_eq!(converted, scanned, "{form}");
        fs::remove_file(folder.join(form)).expect("a file");
    }
    right(&folder, &["verify", ".", "--property", "lamp only while belt.state = jammed"]);
}

#[test]
fn what_is_wrong_is_said_in_its_file() {
    let folder = conveyor("project-wrong");
    let change = |file: &str, from: &str, to: &str| {
        let text = fs::read_to_string(folder.join(file)).expect("a file");
        assert!(text.contains(from), "{file}");
        fs::write(folder.join(file), text.replace(from, to)).expect("written");
    };
    change("main.st", "belt.motor", "belt.motr");
    change("belt.xml", "PT := run_up", "PT := run_upp");
    for arguments in [&["check", "."][..], &["check", "main.st", "types.st", "belt.xml"]] {
        wrong(&folder, arguments, &["main.st:19:", "motr", "belt.xml:30:", "`run_upp`"]);
    }
    // A name of two files.
    change(
        "types.st",
        "END_VAR",
        "END_VAR\nFUNCTION_BLOCK Belt VAR x : BOOL; END_VAR x := TRUE; END_FUNCTION_BLOCK",
    );
    wrong(&folder, &["check", "."], &["U1042", "`Belt`", "belt.xml:"]);
    wrong(&folder, &["init", "cell", "--from", "main.st", "types.st", "belt.xml"], &["U1042"]);
    assert!(!folder.join("cell").exists());
    fs::write(folder.join("lamp.ladder"), "program lamp\n").expect("written");
    wrong(
        &folder,
        &["convert", "main.st", "all.st", "--with", "lamp.ladder"],
        &["U1092", "lamp.ladder"],
    );
    wrong(&folder, &["convert", "main.st", "all.st", "--with", "none.st"], &["U0601", "none.st"]);
}

/// Files that do not use each other remain programs of their own.
#[test]
fn independent_programs_stay_apart() {
    let folder = conveyor("project-apart");
    let lamp = "PROGRAM lamp VAR_INPUT belt : BOOL; END_VAR VAR_OUTPUT q : BOOL; END_VAR q := belt; END_PROGRAM";
    fs::write(folder.join("lamp.st"), lamp).expect("written");
    let files = ["lamp.st", "types.st", "belt.xml", "main.st"];
    right(&folder, &[&["check"], &files[..]].concat());
    right(&folder, &[&["init", "cell", "--from"], &files[..]].concat());
    let cluster = fs::read_to_string(folder.join("cell/cluster.toml")).expect("a file");
    assert_eq!(cluster.matches("[[controller]]").count(), 2, "{cluster}");
    right(&folder, &["check", "cell/cluster.toml", "cell/kill.toml"]);
    let run = ["simulate", "cell/cluster.toml", "--scenario", "cell/kill.toml", "--seed", "1"];
    right(&folder, &run);
}

#[test]
fn memory_becomes_an_output() {
    let folder = conveyor("project-outputs");
    let text = "VAR_GLOBAL total : INT; END_VAR
PROGRAM count VAR_INPUT go : BOOL; END_VAR VAR n : INT; t : TON; END_VAR n := SEL(go, 0, n + 1); total := total + 1; END_PROGRAM";
    fs::write(folder.join("count.st"), text).expect("written");
    wrong(&folder, &["init", "cell", "--from", "count.st"], &["U0622", "--output", "`total`"]);
    wrong(&folder, &["init", "cell", "--from", "count.st", "--output", "m"], &["U0639", "m"]);
    wrong(&folder, &["init", "cell", "--from", "count.st", "--output", "t"], &["U0639", "`t`"]);
    assert!(!folder.join("cell").exists());
    fs::write(folder.join("inputs.txt"), "1\n1\n0\n").expect("written");
    for (name, output, expected) in [
        ("a", &["n"][..], "1 -> 1\n1 -> 2\n0 -> 0\n"),
        ("b", &["count.n"], "1 -> 1\n1 -> 2\n0 -> 0\n"),
        ("c", &["TOTAL"], "1 -> 1\n1 -> 2\n0 -> 3\n"),
    ] {
        right(&folder, &[&["init", name, "--from", "count.st", "--output"], output].concat());
        let copy = format!("{name}/count.st");
        assert_eq!(right(&folder, &["scan", &copy, "--inputs", "inputs.txt"]).output, expected);
        let cluster = format!("{name}/cluster.toml");
        let kill = format!("{name}/kill.toml");
        right(&folder, &["simulate", &cluster, "--scenario", &kill, "--seed", "1"]);
    }
    // Of a project, beside the outputs that it has.
    right(
        &folder,
        &["init", "belt", "--from", "main.st", "types.st", "belt.xml", "--output", "jams"],
    );
    let cluster = fs::read_to_string(folder.join("belt/cluster.toml")).expect("a file");
    assert!(["motor", "lamp", "jams"].iter().all(|name| cluster.contains(name)), "{cluster}");
}
