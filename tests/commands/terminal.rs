//! What comes from a file or from another person cannot command the terminal that shows it.

use std::fs::{self, OpenOptions};
use std::io::Write as _;

use crate::{empty_folder, understudy_in};

/// Sets the title, clears the screen, and turns the text.
const HOSTILE: &str = "\u{1b}]0;owned\u{7}\u{9b}2J\u{202e}\r\u{8}";

fn is_obeyed(character: char) -> bool {
    let is_shown = matches!(character, '\n' | '\t');
    matches!(character, '\u{202a}'..='\u{202e}') || character.is_control() && !is_shown
}

#[test]
fn a_record_or_a_file_cannot_command_the_terminal() {
    let folder = empty_folder("terminal");
    let run = |arguments: &[&str]| understudy_in(&folder, arguments);
    assert_eq!(run(&["init", "cell"]).status, 0);
    let simulated =
        run(&["simulate", "cell/cluster.toml", "--cycles", "20", "--seed", "1", "--out", "runs"]);
    assert_eq!(simulated.status, 0, "{}", simulated.errors);
    let journal = fs::read_dir(folder.join("runs"))
        .expect("runs")
        .filter_map(|entry| Some(entry.ok()?.path().join("journal.jsonl")))
        .find(|path| path.is_file())
        .expect("a journal");
    // A line that is no record, and a record whose reason is hostile.
    let quoted = serde_json::to_string(HOSTILE).expect("JSON");
    let record = |event: &str| {
        format!("{{\"at_ns\":1,\"name\":\"laboratory\",\"member\":null,\"event\":{{{event}}}}}")
    };
    let commanded = record(&format!(
        "\"event\":\"commanded\",\"member\":{{\"station\":0}},\"command\":{{\"command\":\"kill\"}},\
         \"owner\":{quoted},\"reason\":{quoted},\"refused\":{quoted}"
    ));
    let unknown = record(&format!("\"event\":{quoted}"));
    let mut file = OpenOptions::new().append(true).open(&journal).expect("a journal");
    writeln!(file, "{{\"{HOSTILE}\": 1}}\nno record {HOSTILE}\n{commanded}\n{unknown}")
        .expect("written");
    drop(file);
    fs::write(folder.join("hostile.ladder"), format!("program p\n-- {HOSTILE}\ninput {HOSTILE}\n"))
        .expect("written");
    fs::write(folder.join("hostile.st"), format!("PROGRAM p\nx := '{HOSTILE}' {HOSTILE};\n"))
        .expect("written");
    fs::write(
        folder.join("hostile.toml"),
        format!("[cluster]\nname = {quoted}\n[[controller]]\nname = {quoted}\nladder = {quoted}\n"),
    )
    .expect("written");
    let name = format!("{HOSTILE}.ladder");
    fs::write(folder.join(&name), format!("program p {HOSTILE}\n")).expect("written");
    let cases: [(&[&str], bool); 11] = [
        (&["journal", "runs/latest"], true),
        (&["journal", "runs/latest", "--all"], true),
        (&["journal", "runs/latest", "--follow"], true),
        (&["top", "runs/latest", "--once"], false),
        (&["check", "hostile.ladder"], true),
        (&["check", "hostile.st"], true),
        (&["check", "hostile.toml"], true),
        (&["check", &name], true),
        (&["check", HOSTILE], true),
        (&["convert", "hostile.ladder"], true),
        (&["operate", "runs/latest", "--name", HOSTILE, "kill"], true),
    ];
    for (arguments, is_quoted) in cases {
        for json in [&[][..], &["--json"]] {
            let answer = run(&[arguments, json].concat());
            let said = answer.output + &answer.errors;
            let obeyed: Vec<char> = said.chars().filter(|letter| is_obeyed(*letter)).collect();
            assert!(obeyed.is_empty(), "{arguments:?} {json:?}: {obeyed:?} in {said:?}");
            let is_found = said.contains("u{1b}") || said.contains("u001b");
            assert!(!is_quoted || is_found, "{arguments:?} {json:?}: {said}");
        }
    }
}
