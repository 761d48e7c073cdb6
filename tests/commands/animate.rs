//! `understudy animate`, and the moving picture of the README: it is drawn from the journal of a real run.
//!
//! `kill/journal.jsonl` holds lines of the journal that `understudy demo --period 50ms` wrote on 2026-11-26: of cycles 70 to 199 what both remote I/Os
//! applied and what all stations published, and what happened until then but for samples and plants. They draw the same picture as the whole journal.

use std::fs;
use std::path::{Path, PathBuf};

use crate::{empty_folder, understudy_in};

/// A folder with the recorded run in it.
fn recorded(name: &str) -> PathBuf {
    let folder = empty_folder(name);
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let cluster = folder.join("run/cluster");
    fs::create_dir_all(&cluster).expect("a folder");
    let cell = root.join("examples/press-cell");
    for file in ["cluster.toml", "robot.ladder", "press.ladder"] {
        fs::copy(cell.join(file), cluster.join(file)).expect("copied");
    }
    let kept = root.join("tests/commands/kill");
    fs::copy(kept.join("kept.json"), cluster.join("kept.json")).expect("copied");
    let journal = folder.join("run/journal.jsonl");
    fs::copy(kept.join("journal.jsonl"), journal).expect("copied");
    folder
}

#[test]
fn the_picture_of_the_readme_is_drawn_from_a_recorded_run() {
    let folder = recorded("animate");
    let drawn = understudy_in(&folder, &["animate", "run", "--output", "kill.svg", "--json"]);
    assert_eq!(drawn.status, 0, "{}", drawn.shown());
    let result = drawn.json()["result"].clone();
    assert_eq!((&result["from"], &result["to"]), (&76.into(), &192.into()));
    let picture = fs::read_to_string(folder.join("kill.svg")).expect("a picture");
    let shown = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/pictures/kill.svg");
    let shown = fs::read_to_string(shown).expect("the picture of the README");
    assert!(
        picture == shown,
        "docs/pictures/kill.svg is not what `understudy animate` draws; the new one is {}",
        folder.join("kill.svg").display()
    );
}

#[test]
fn a_part_of_a_run_is_animated() {
    let folder = recorded("animate_part");
    let draw = |more: &[&str]| {
        let arguments = [&["animate", "run", "--output", "part.svg"], more].concat();
        understudy_in(&folder, &arguments)
    };
    let part = draw(&["--program", "robot", "--from", "80", "--to", "90"]);
    assert_eq!(part.status, 0, "{}", part.shown());
    let picture = fs::read_to_string(folder.join("part.svg")).expect("a picture");
    // All of it is direct: nothing else may be drawn.
    assert!(picture.contains("→ direct") && !picture.contains("reconstructed"), "{picture}");
    assert!(!picture.contains("killed"), "{picture}");
}

#[test]
fn what_is_not_in_the_journal_is_not_drawn() {
    let folder = recorded("animate_wrong");
    let check = |arguments: &[&str], code: &str, words: &str| {
        let arguments = [&["animate", "run", "--output", "none.svg"], arguments].concat();
        let answer = understudy_in(&folder, &arguments);
        assert_eq!(answer.status, 2, "{}", answer.shown());
        let said = &answer.errors;
        assert!(said.contains(code) && said.contains(words), "{said}");
        assert!(!folder.join("none.svg").exists(), "{arguments:?}");
    };
    check(&["--program", "robbot"], "U0577", "robot, press");
    check(&["--from", "5000"], "U0575", "70 to 199");
    check(&["--from", "100", "--to", "90"], "U0579", "90, comes before");
    let journal = folder.join("run/journal.jsonl");
    let text = fs::read_to_string(&journal).expect("a journal");
    let undisturbed = text.lines().filter(|line| !line.contains("\"fault\""));
    let undisturbed: String = undisturbed.flat_map(|line| [line, "\n"]).collect();
    fs::write(&journal, undisturbed).expect("written");
    check(&[], "U0579", "--program");
}
