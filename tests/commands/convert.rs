//! `understudy convert`: ladders of other tools in and out.

use std::fs;

use crate::{empty_folder, understudy, understudy_in};

#[test]
fn an_editor_s_ladder_becomes_text_with_all_that_is_not_kept() {
    let answer = understudy(&["convert", "examples/plcopen/pump.xml", "--fidelity"]);
    insta::assert_snapshot!(answer.shown());
}

#[test]
fn what_is_written_is_read_again_by_every_command() {
    let folder = empty_folder("convert");
    let root = env!("CARGO_MANIFEST_DIR");
    let example = |name: &str| format!("{root}/examples/{name}");
    for (from, to) in [
        (example("plcopen/pump.xml"), "pump.ladder"),
        ("pump.ladder".to_owned(), "pump.xml"),
        ("pump.xml".to_owned(), "pump.st"),
        ("pump.st".to_owned(), "again.xml"),
        (example("plcopen/probes.xml"), "probes.xml"),
    ] {
        let answer = understudy_in(&folder, &["convert", &from, to, "--json"]);
        assert_eq!(answer.status, 0, "{from}: {}", answer.shown());
        assert_eq!(answer.json()["result"]["file"], to);
    }
    // Rungs are drawn, and statements are listed.
    for (file, shown) in
        [("pump.xml", "( )"), ("again.xml", ":="), ("probes.xml", ":="), ("pump.st", ":=")]
    {
        assert_eq!(understudy_in(&folder, &["check", file]).status, 0, "{file}");
        let drawn = understudy_in(&folder, &["draw", file]);
        assert!(drawn.output.contains(shown), "{file}: {}", drawn.shown());
    }
    let proved = understudy_in(&folder, &["verify", "again.xml", "--json"]);
    assert_ne!(proved.status, 2, "{}", proved.shown());
}

#[test]
fn a_file_with_errors_is_not_converted() {
    let folder = empty_folder("convert_wrong");
    let pump =
        fs::read_to_string(format!("{}/examples/plcopen/pump.xml", env!("CARGO_MANIFEST_DIR")))
            .expect("an example");
    let wrong = pump.replace("<variable>empty</variable>", "<variable>emty</variable>").replacen(
        "refLocalId=\"15\"",
        "refLocalId=\"150\"",
        1,
    );
    fs::write(folder.join("pump.xml"), wrong).expect("written");
    let answer = understudy_in(&folder, &["convert", "pump.xml", "pump.ladder"]);
    assert_eq!(answer.status, 2);
    assert!(!folder.join("pump.ladder").exists());
    insta::assert_snapshot!(answer.shown());
}

#[test]
fn what_was_lost_is_looked_for_in_what_was_written() {
    let folder = empty_folder("convert_checked");
    let text = "\
program p
input a at %IX0.0
output y at %QX0.0
memory seen at %MX0.2
memory cell.empty  -- a name with a dot
rung
    a ( y ) (S seen )
rung
    /a {TON late 300ms} ( cell.empty )
";
    fs::write(folder.join("memory.ladder"), text).expect("written");
    let answer = understudy_in(&folder, &["convert", "memory.ladder", "memory.st", "--fidelity"]);
    insta::assert_snapshot!(answer.shown());
    insta::assert_snapshot!(fs::read_to_string(folder.join("memory.st")).expect("written"));
    let back = ["convert", "memory.st", "back.ladder", "--json"];
    let back = understudy_in(&folder, &back).json();
    let written = &back["result"]["fidelity"]["written"];
    assert_eq!(written["proved"], true);
    let losses = written["losses"].as_array().expect("a list");
    let interval = "the ladder format does not keep the interval of the task: 10ms";
    assert_eq!(losses.len(), 1, "{losses:?}");
    assert_eq!(losses[0], interval);
}

#[test]
fn what_is_read_is_not_written_over() {
    let folder = empty_folder("converted-over");
    let text =
        "PROGRAM p VAR_INPUT a : BOOL; END_VAR VAR_OUTPUT q : BOOL; END_VAR q := a; END_PROGRAM\n";
    let rungs = "program p\ninput a\noutput q\nrung a (q)\n";
    fs::write(folder.join("p.st"), text).expect("written");
    fs::write(folder.join("p.ladder"), rungs).expect("written");
    fs::create_dir(folder.join("sub")).expect("made");
    for arguments in [
        ["convert", "p.st", "p.st"].as_slice(),
        &["convert", "p.st", "sub/../p.st"],
        &["draw", "p.st", "--output", "p.st"],
        &["verify", "p.ladder", "--draw", "p.ladder"],
    ] {
        let answer = understudy_in(&folder, arguments);
        assert_eq!(answer.status, 2, "{arguments:?}: {}", answer.shown());
        assert!(answer.errors.contains("error[U0603]"), "{arguments:?}: {}", answer.errors);
        for (name, text) in [("p.st", text), ("p.ladder", rungs)] {
            let kept = fs::read_to_string(folder.join(name)).expect("a text");
            assert_eq!(kept, text, "{arguments:?}");
        }
    }
    // Nor are the programs that a cluster file names.
    let cluster = "[cluster]\nname = \"cell\"\n[[controller]]\nname = \"p\"\nladder = \"p.st\"\n[[controller]]\nname = \"other\"\nladder = \"p.ladder\"\n[[understudy]]\nname = \"u\"\n[[remote_io]]\ncontroller = \"p\"\n[remote_io.inputs]\na = { operator = \"level\" }\n[[remote_io]]\ncontroller = \"other\"\n[remote_io.inputs]\na = { operator = \"level\" }\n";
    fs::write(folder.join("cell.toml"), cluster).expect("written");
    for (output, form) in [("p.st", "st"), ("sub/../p.ladder", "ladder")] {
        let arguments = ["parity", "cell.toml", "--as", form, "--output", output];
        let answer = understudy_in(&folder, &arguments);
        assert_eq!(answer.status, 2, "{output}: {}", answer.shown());
        assert!(answer.errors.contains("error[U0603]"), "{output}: {}", answer.errors);
    }
    assert_eq!(fs::read_to_string(folder.join("p.st")).expect("a text"), text);
    assert_eq!(fs::read_to_string(folder.join("p.ladder")).expect("a text"), rungs);
    let answer = understudy_in(&folder, &["convert", "p.st", "q.st"]);
    assert_eq!(answer.status, 0, "{}", answer.shown());
}
