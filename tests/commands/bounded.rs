//! What is wrong with a file is said in bounded time and length, whatever the file: text and JSON.

#![allow(
    clippy::disallowed_methods,
    reason = "how long an answer takes is counted on the real clock"
)]

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use crate::{Answer, empty_folder, understudy_in};

/// The most that an answer about one file may say, in bytes.
const MOST: usize = 400_000;

/// Long enough for a loaded machine in the debug profile.
const LONGEST: Duration = Duration::from_secs(120);

/// One line of some megabytes that is wrong in many places.
fn junk(piece: &str, bytes: usize) -> String {
    piece.repeat(bytes / piece.len())
}

fn bounded(folder: &Path, arguments: &[&str]) -> Answer {
    let begin = Instant::now();
    let answer = understudy_in(folder, arguments);
    assert!(begin.elapsed() < LONGEST, "{arguments:?}");
    let said = answer.output.len() + answer.errors.len();
    assert!(said < MOST, "{arguments:?} says {said} bytes");
    for line in answer.errors.lines() {
        assert!(line.chars().count() < 2_500, "{arguments:?}: {line}");
    }
    answer
}

/// Wrong files are refused; each way out says so within bounds.
fn refused(folder: &Path, arguments: &[&str]) {
    let answer = bounded(folder, arguments);
    assert_eq!(answer.status, 2, "{arguments:?}: {}{}", answer.output, answer.errors);
    let mut json = arguments.to_vec();
    json.push("--json");
    let answer = bounded(folder, &json);
    let document = answer.json();
    let found = document["diagnostics"].as_array().expect("a list").len();
    let failures = document["failures"].as_array().expect("a list").len();
    assert!(found + failures > 0, "{arguments:?}");
    assert!(found <= 501 && failures <= 101, "{arguments:?}: {found}, {failures}");
}

#[test]
fn every_reader_of_check_is_bounded() {
    let folder = empty_folder("bounded");
    let contact = r#"<contact localId="2" negated="perhaps"><connectionPointIn><connection refLocalId="99"/></connectionPointIn><variable>a</variable></contact>"#;
    let xml = |body: &str| {
        format!(
            r#"<project xmlns="http://www.plcopen.org/xml/tc6_0201"><types><pous><pou name="p" pouType="program"><body>{body}</body></pou></pous></types></project>"#
        )
    };
    let files = [
        ("signs.ladder", junk("!", 2 << 20)),
        ("words.ladder", junk("stray ( [ word\n", 2 << 20)),
        ("one-word.ladder", junk("a", 2 << 20)),
        ("names.ladder", format!("program p\nrung {}\n", junk("unknown1 /unknown2 ", 1 << 20))),
        ("contacts.xml", xml(&format!("<LD>{}</LD>", junk(contact, 1 << 20)))),
        ("text.xml", xml(&format!("<ST>{}</ST>", junk("y := ; ", 1 << 20)))),
        ("list.xml", xml(&format!("<IL>{}</IL>", junk("LD\nNONSENSE y\n", 1 << 18)))),
        ("one-tag.xml", format!("<{}", junk("a", 2 << 20))),
        ("large.xml", xml(&junk(" ", 17 << 20))),
        ("signs.st", junk("$", 2 << 20)),
        ("words.st", junk("END_IF ", 2 << 20)),
        (
            "statements.st",
            format!("PROGRAM p {} END_PROGRAM", junk("unknown := nothing; ", 1 << 20)),
        ),
        ("lines.ld", format!("LDmicro0.1\nPROGRAM\n{}", junk("stray\n", 1 << 20))),
        ("one-line.ld", format!("LDmicro0.1 {}", junk("stray ", 2 << 20))),
        (
            "edges.xml",
            format!(
                "<LadderDiagram><Graph><Edges>{}</Edges></Graph></LadderDiagram>",
                junk("<Edge type=\"x\"/>", 1 << 20)
            ),
        ),
        ("line.ads", format!("A\n\nState size:\n3\n{}", junk("nonsense ", 5 << 20))),
        ("lines.ads", format!("A\n\nState size:\n3\nTransitions:\n{}", junk("0 x 1\n", 2 << 20))),
        (
            "numbers.ads",
            format!("A\n\nState size:\n3\nMarker states:\n{}", junk("77777 ", 1 << 20)),
        ),
        ("cluster.toml", format!("[cluster]\n{}", junk("x9 = 1\n", 1 << 10))),
        ("one-key.toml", format!("[cluster]\n{} = 1", junk("x", 1 << 19))),
        ("large.toml", format!("[cluster]\nname = \"{}\"", junk("x", 2 << 20))),
        ("scenario.toml", format!("title = \"t\"\ncycles = 10\nname = \"{}\"", junk("x", 1 << 20))),
        ("model.toml", format!("[[plant]]\nname = \"{}\"\n", junk("x", 1 << 20))),
        ("net.toml", format!("[[place]]\nname = \"{}\"\n[[transition]]\n", junk("x", 1 << 20))),
        ("unknown.clp", junk("x", 2 << 20)),
        ("binary.ladder", junk("\u{1}\u{2}", 2 << 20)),
    ];
    for (name, text) in files {
        fs::write(folder.join(name), text).expect("written");
        refused(&folder, &["check", name]);
        fs::remove_file(folder.join(name)).expect("removed");
    }
}

#[test]
fn every_other_reader_is_bounded() {
    let folder = empty_folder("bounded-others");
    let write = |name: &str, text: String| fs::write(folder.join(name), text).expect("written");
    write("p.ladder", "program p\ninput a\noutput y\nrung a ( y )\n".to_owned());
    write("line.properties", junk("always ( ", 1 << 20));
    write("lines.properties", junk("never such (\n", 1 << 20));
    for file in ["line.properties", "lines.properties"] {
        refused(&folder, &["verify", "p.ladder", "--properties", file]);
    }
    write("line.csv", junk("vendor,", 1 << 20));
    write(
        "lines.csv",
        format!(
            "vendor,model,family,kind,digital_inputs,source_url\n{}",
            junk("w,m,f,plc,many,\n", 1 << 18)
        ),
    );
    for file in ["line.csv", "lines.csv"] {
        refused(&folder, &["catalogue", "import", file, "--catalogue", "ours.csv"]);
    }
    write("line.chain", junk("a -> ", 1 << 20));
    write("lines.chain", junk("a -> b nonsense\n", 1 << 20));
    for file in ["line.chain", "lines.chain"] {
        refused(&folder, &["reliability", "--chain", file]);
    }
}

#[test]
fn an_excerpt_is_cut_around_its_place() {
    let folder = empty_folder("excerpts");
    let names: Vec<String> = (0..200).map(|number| format!("/input{number}")).collect();
    let text = format!("program p\noutput y\nrung {} ( y )\n", names.join(" "));
    fs::write(folder.join("long.ladder"), text).expect("written");
    let answer = bounded(&folder, &["check", "long.ladder"]);
    let shown: Vec<&str> = answer.errors.split("error[").collect();
    // The hundredth name, with what is around it.
    let found = shown.iter().find(|shown| shown.contains("`input90`")).expect("found");
    assert!(found.contains("long.ladder:3:"), "{found}");
    assert!(found.contains("…") && found.contains("/input90 /input91"), "{found}");
    assert!(found.contains("/input89") && !found.contains("/input120"), "{found}");
    assert!(
        answer.errors.contains("100 more errors of this file are not shown"),
        "{}",
        answer.errors
    );
    let caret = found.lines().find(|line| line.contains('^')).expect("a mark");
    let line = found.lines().find(|line| line.contains("/input90")).expect("a line");
    let column = |line: &str, sign: &str| line[..line.find(sign).expect(sign)].chars().count();
    assert_eq!(column(caret, "^"), column(line, "input90"), "{found}");
    // The place in the answer for machines is that of the file.
    let json = bounded(&folder, &["check", "long.ladder", "--json"]).json();
    let listed = json["diagnostics"].as_array().expect("a list");
    assert_eq!(listed.len(), 101);
    assert_eq!(json["result"]["errors"], 200);
    let of_90 = listed.iter().find(|found| {
        found["message"].as_str().is_some_and(|message| message.contains("`input90`"))
    });
    let place = of_90.expect("listed")["column"].as_u64().expect("a number");
    assert!(found.contains(&format!("long.ladder:3:{place}\n")), "{found}");
}
