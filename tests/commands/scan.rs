//! `understudy scan`.

use std::fs;

use crate::{empty_folder, understudy, understudy_in};

/// Outputs of the examples with numbers, bit for bit, as they were on x86-64 and on aarch64 (docs/evidence/performance.md).
#[test]
fn digests_of_numeric_programs_are_those_of_every_processor() {
    let mut lines = Vec::new();
    for example in ["heated-tank", "modbus-level", "tennessee-eastman", "two-shuttles"] {
        let folder = format!("{}/examples/{example}", env!("CARGO_MANIFEST_DIR"));
        let files = fs::read_dir(folder).expect("a folder");
        let names = files.map(|file| file.expect("a file").file_name());
        let mut names: Vec<String> = names.filter_map(|name| name.into_string().ok()).collect();
        names.retain(|name| name.ends_with(".st"));
        names.sort();
        for name in names {
            let file = format!("examples/{example}/{name}");
            let answer = understudy(&["scan", &file, "--digest", "1000"]);
            assert_eq!(answer.status, 0, "{file}\n{}", answer.errors);
            lines.push(format!("{file}: {}", answer.output.trim_end()));
        }
    }
    insta::assert_snapshot!(lines.join("\n"));
}

#[test]
fn an_input_outside_its_subrange_is_refused() {
    let folder = empty_folder("scan_subrange");
    let text = "PROGRAM p VAR_INPUT s : INT (0..9); u : UINT (3..5); END_VAR VAR_OUTPUT q : INT; END_VAR q := s + UINT_TO_INT(u); END_PROGRAM";
    fs::write(folder.join("p.st"), text).expect("written");
    for (line, expected) in
        [("0 3", 0), ("9 5", 0), ("10 3", 1), ("-1 3", 1), ("9 6", 1), ("-1 2", 2)]
    {
        fs::write(folder.join("inputs.txt"), line).expect("written");
        let answer = understudy_in(&folder, &["scan", "p.st", "--inputs", "inputs.txt"]);
        assert_eq!(answer.errors.matches("U0439").count(), expected, "{line}: {}", answer.shown());
        assert_eq!(answer.status, if expected == 0 { 0 } else { 2 }, "{line}");
    }
}

/// Inputs at addresses come first, whatever the order of the declarations; a line with their names gives the file another order.
#[test]
fn a_line_with_names_gives_the_order_of_the_inputs() {
    let folder = empty_folder("scan_named");
    let text = "PROGRAM p VAR_INPUT i : INT; END_VAR VAR_OUTPUT o : INT; END_VAR
        VAR x AT %IX0.0 : BOOL; y AT %QX0.0 : BOOL; END_VAR o := i; y := x; END_PROGRAM";
    fs::write(folder.join("p.st"), text).expect("written");
    let scanned = |lines: &str| {
        fs::write(folder.join("inputs.txt"), lines).expect("written");
        understudy_in(&folder, &["scan", "p.st", "--inputs", "inputs.txt"])
    };
    assert_eq!(scanned("1 7\n").output, "1 7 -> 1 7\n");
    assert_eq!(scanned("# i X -> any\n7 1\n# x i\n0 8\n").output, "1 7 -> 1 7\n0 8 -> 0 8\n");
    // Other comments are only that.
    assert_eq!(scanned("# i i\n# i\n# i x y\n1 7\n").output, "1 7 -> 1 7\n");
    let wrong = scanned("# i x\n7 1 1\n");
    assert!(wrong.errors.contains("in this order: i : INT, x : BOOL"), "{}", wrong.shown());
}

/// What sees the edges of an element of an array has a name that can be written.
#[test]
fn edges_of_elements_are_converted() {
    let folder = empty_folder("scan_edges_of_elements");
    let object = |name: &str, id: u32, from: u32, edge: &str, variable: &str| {
        format!(
            r#"<{name} localId="{id}" negated="false"{edge}><position x="{id}0" y="20"/>
            <connectionPointIn><connection refLocalId="{from}"/></connectionPointIn><connectionPointOut/>
            <variable>{variable}</variable></{name}>"#
        )
    };
    let array = |name: &str, address: &str| {
        format!(
            r#"<variable name="{name}" address="{address}"><type><array><dimension lower="0" upper="1"/>
            <baseType><BOOL/></baseType></array></type></variable>"#
        )
    };
    let text = format!(
        r#"<?xml version="1.0" encoding="utf-8"?>
        <project xmlns="http://www.plcopen.org/xml/tc6_0201">
        <fileHeader companyName="c" productName="p" productVersion="1" creationDateTime="2020-01-01T00:00:00"/>
        <contentHeader name="n"><coordinateInfo><fbd><scaling x="1" y="1"/></fbd><ld><scaling x="1" y="1"/></ld>
        <sfc><scaling x="1" y="1"/></sfc></coordinateInfo></contentHeader>
        <types><dataTypes/><pous><pou name="main" pouType="program"><interface><localVars>{}{}</localVars></interface>
        <body><LD><leftPowerRail localId="1"><position x="0" y="0"/><connectionPointOut formalParameter=""/></leftPowerRail>
        {}{}</LD></body></pou></pous></types><instances><configurations/></instances></project>"#,
        array("ia", "%IX0.0"),
        array("oa", "%QX0.0"),
        object("contact", 2, 1, r#" edge="rising""#, "ia[1]"),
        object("coil", 3, 2, r#" edge="falling""#, "oa[0]"),
    );
    fs::write(folder.join("edges.xml"), text).expect("written");
    fs::write(folder.join("inputs.txt"), "0 1\n0 1\n0 0\n1 0\n0 1\n").expect("written");
    let scanned = |file: &str| {
        let answer = understudy_in(&folder, &["scan", file, "--inputs", "inputs.txt"]);
        assert_eq!(answer.status, 0, "{}", answer.shown());
        answer.output
    };
    let expected = scanned("edges.xml");
    assert!(expected.contains("-> 1 0"), "{expected}");
    for (from, to) in
        [("edges.xml", "edges.st"), ("edges.st", "again.xml"), ("edges.xml", "more.xml")]
    {
        let answer = understudy_in(&folder, &["convert", from, to]);
        assert_eq!(answer.status, 0, "{}", answer.shown());
        assert_eq!(scanned(to), expected, "{to}");
    }
}

/// A task without a priority runs after those with one, in every form.
#[test]
fn tasks_without_a_priority_are_converted() {
    let folder = empty_folder("scan_priority");
    let text = "PROGRAM one VAR_INPUT a : BOOL; END_VAR VAR_OUTPUT y : BOOL; END_VAR y := a; END_PROGRAM
        PROGRAM two VAR_INPUT b : BOOL; END_VAR VAR_OUTPUT q : BOOL; END_VAR q := NOT b; END_PROGRAM
        CONFIGURATION c RESOURCE r ON x TASK t(INTERVAL := T#10ms); TASK u(INTERVAL := T#10ms, PRIORITY := 1);
        PROGRAM first WITH t : one; PROGRAM second WITH u : two; END_RESOURCE END_CONFIGURATION";
    fs::write(folder.join("tasks.st"), text).expect("written");
    fs::write(folder.join("inputs.txt"), "# second.b first.a\n1 0\n0 1\n").expect("written");
    let converted = understudy_in(&folder, &["convert", "tasks.st", "tasks.xml"]);
    assert_eq!(converted.status, 0, "{}", converted.shown());
    for file in ["tasks.st", "tasks.xml"] {
        let scanned = understudy_in(&folder, &["scan", file, "--inputs", "inputs.txt"]);
        assert_eq!(scanned.output, "1 0 -> 0 0\n0 1 -> 1 1\n", "{file}: {}", scanned.shown());
    }
}

/// What runs together is named, proved and drawn together, in each form.
#[test]
fn all_programs_of_a_file_are_meant() {
    let folder = empty_folder("scan_several");
    let text =
        "PROGRAM one VAR_INPUT a : BOOL; END_VAR VAR_OUTPUT p : BOOL; END_VAR p := a; END_PROGRAM
        PROGRAM two VAR_INPUT b : BOOL; END_VAR VAR_OUTPUT q : BOOL; END_VAR q := b; END_PROGRAM
        CONFIGURATION c RESOURCE r ON x TASK t(INTERVAL := T#20ms, PRIORITY := 0);
        PROGRAM one WITH t : one; PROGRAM two WITH t : two; END_RESOURCE END_CONFIGURATION";
    fs::write(folder.join("two.st"), text).expect("written");
    let run = |arguments: &[&str]| understudy_in(&folder, arguments);
    assert_eq!(run(&["convert", "two.st", "two.xml"]).status, 0);
    for file in ["two.st", "two.xml"] {
        // What one of them does shows in the proof, and what counts rungs takes no part of a file.
        let refuted = run(&["verify", file, "--property", "never two.q"]);
        assert_eq!(refuted.status, 1, "{file}: {}", refuted.shown());
        for command in ["allocate", "resources"] {
            let counted = run(&[command, file]);
            assert_eq!(counted.status, 0, "{command} {file}: {}", counted.shown());
        }
        for command in ["scan --digest 10", "verify", "draw"] {
            let words: Vec<&str> = command.split(' ').collect();
            let answer = run(&[&words[..1], &[file], &words[1..]].concat());
            assert_eq!(answer.status, 0, "{command} {file}: {}", answer.shown());
            let is_all = answer.output.contains("one") && answer.output.contains("two");
            assert!(
                is_all && !answer.errors.contains("U1023"),
                "{command} {file}: {}",
                answer.shown()
            );
        }
    }
}
