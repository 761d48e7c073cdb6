//! Files of all forms that other people wrote: each is taken whole, or refused with the reason.
//!
//! `UNDERSTUDY_SURVEY=FOLDER cargo test -p understudy-interchange --test people -- --nocapture` prints the same table
//! of any folder.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use understudy_interchange::{Source, Wanted, read_source};
use understudy_text::{Diagnostic, Lines, MAXIMUM_FINDINGS, Severity, decode};

/// Ends of the names of files with programs.
const FORMS: [&str; 9] = ["st", "il", "xml", "iecst", "scl", "tcpou", "tcgvl", "tcdut", "exp"];

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    for path in entries.map(|entry| entry.path()) {
        let extension = path.extension().and_then(|end| end.to_str());
        if path.is_dir() {
            sources(&path, found);
        } else if extension.is_some_and(|end| FORMS.contains(&end.to_lowercase().as_str())) {
            found.push(path);
        }
    }
    found.sort();
}

/// What became of a file, in one word, and its errors.
fn outcome(path: &Path) -> (String, Vec<String>) {
    let bytes = fs::read(path).expect("a readable file");
    let Ok(text) = decode(bytes) else {
        return ("refused".to_owned(), vec!["it is not a text in UTF-8".to_owned()]);
    };
    let name = path.to_string_lossy();
    let read = |program| {
        let wanted = Wanted { program, period: None };
        read_source(&name, &text, wanted)
    };
    let mut files = vec![read(None)];
    // Of several programs without a CONFIGURATION, each is chosen.
    let is_choice =
        |found: &&Diagnostic| found.code == "U1013" && found.message.contains("no CONFIGURATION");
    if let Some(choice) = files[0].diagnostics.iter().find(is_choice)
        && let Some((_, names)) = choice.help.as_deref().unwrap_or_default().rsplit_once(" of ")
    {
        files = names.split(", ").map(|name| read(Some(name))).collect();
    }
    let mut errors = Vec::new();
    let mut what = Vec::new();
    for file in &files {
        assert!(
            file.diagnostics.len() <= 2 * MAXIMUM_FINDINGS + 2,
            "{name} floods: {} findings",
            file.diagnostics.len()
        );
        let found = file.diagnostics.iter();
        let found = found.filter(|found| found.severity == Severity::Error);
        errors.extend(found.map(|found| {
            let place = Lines::new(&text).position(found.span.start);
            format!("{place}: {} {}", found.code, found.message)
        }));
        what.push(match file.source {
            Some(Source::Program(_)) if file.ladder().is_some() => "ladder",
            Some(Source::Program(_)) => "program",
            Some(Source::Library(_)) => "library",
            None => "refused",
        });
    }
    if errors.is_empty() && what.contains(&"refused") {
        errors.push("no program and no reason".to_owned());
    }
    if !errors.is_empty() {
        what = vec!["refused"];
    }
    (what.join(", "), errors)
}

/// The files of a folder that are refused; the table of all is printed.
fn survey(folder: &Path) -> Vec<String> {
    let mut files = Vec::new();
    sources(folder, &mut files);
    let (mut table, mut refused) = (String::new(), Vec::new());
    for path in &files {
        let (what, errors) = outcome(path);
        let name = path.strip_prefix(folder).unwrap_or(path).display();
        if !errors.is_empty() {
            refused.push(name.to_string());
        }
        let _ = writeln!(table, "{name}: {what}");
        for error in errors.iter().take(6) {
            let _ = writeln!(table, "    {error}");
        }
    }
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    let taken = files.len() - refused.len();
    let _ = writeln!(table, "{name}: {taken} of {} taken", files.len());
    std::io::Write::write_all(&mut std::io::stdout(), table.as_bytes()).expect("an output");
    refused
}

#[test]
fn files_of_other_people_are_taken_or_refused_with_a_reason() {
    if let Some(folder) = std::env::var_os("UNDERSTUDY_SURVEY") {
        survey(Path::new(&folder));
        return;
    }
    let Some(data) = std::env::var_os("UNDERSTUDY_DATA") else {
        understudy_testing::skip("UNDERSTUDY_DATA is not set");
        return;
    };
    let programs = PathBuf::from(data).join("programs");
    let refused = |names: &[&str]| {
        let found = names.iter().flat_map(|name| survey(&programs.join(name)));
        found.collect::<Vec<String>>()
    };
    let editors =
        ["beremiz+beremiz", "gracesrm+OpenPLC_Sample_Programs", "virajdesai0309+OpenPLC_Tutorials"];
    expect(&refused(&editors), &EDITORS);
    expect(&refused(&["iec-checker+iec-checker", "ironplc+ironplc"]), &COMPILERS);
    let objects = refused(&["tcunit+TcUnit"]);
    assert!(objects.len() <= OBJECTS, "{objects:?}");
}

/// Exactly these files are refused.
fn expect(refused: &[String], expected: &[(&str, &str)]) {
    let is_expected = |name: &&String| expected.iter().any(|(known, _)| name.starts_with(known));
    let others: Vec<&String> = refused.iter().filter(|name| !is_expected(name)).collect();
    assert!(others.is_empty(), "refused without a known reason: {others:?}");
    assert!(
        refused.len() == expected.len(),
        "{refused:?} are refused, and {} are expected",
        expected.len()
    );
}

/// Of the 71 files of OpenPLC and Beremiz those that are refused, and why.
const EDITORS: [(&str, &str); 6] = [
    ("plc-0838c4", "a structure with texts at %I"),
    ("plc-6ca127", "files of the controller (CSV)"),
    ("plc-981f90", "answers of Python, and C code that writes variables"),
    ("pous-0c3725", "Python, and C code that writes variables"),
    ("Additional_Function_Blocks-aa71a4", "the clock RTC"),
    ("pous-c48922", "C code that writes variables: blocks that execute Python"),
];

/// Of the 69 files of iec-checker and ironplc those that are refused: almost all are not legal by themselves, on purpose.
const COMPILERS: [(&str, &str); 33] = [
    ("array-use", "`gvl` is not declared"),
    ("comments-86b512", "undeclared variables"),
    ("control-statements", "undeclared variables, and a condition that is a number"),
    ("function-declaration", "one variable is declared twice"),
    ("generic-types", "variables of type ANY"),
    ("literals-e23d9e", "names that differ in capitals only"),
    ("multiple-variables", "variables are declared twice, and VAR_EXTERNAL without a VAR_GLOBAL"),
    ("plcopen-cp1-", "`%B0` is not an address"),
    ("plcopen-cp16", "a configuration runs a function block"),
    ("plcopen-cp25", "a REAL goes to an INT"),
    ("plcopen-cp3-", "`%B0` is not an address"),
    ("plcopen-cp4", "addresses that overlap"),
    ("references-", "references to what is none"),
    ("struct-declaration", "a text goes to a WORD within a structure"),
    ("user1-", "`func1` is not declared"),
    ("F_DegreesToRadians", "`PI` of another library"),
    ("a_types", "a TYPE without a type"),
    ("array-7282f5", "`i` is not declared"),
    ("array_rendered", "`i` is not declared"),
    ("binary_file", "not a text"),
    ("comment-d22acb", "undeclared variables"),
    ("conditional-", "undeclared variables"),
    ("configuration-", "`plc_prg` is not declared"),
    ("expressions-", "undeclared variables"),
    ("first_steps_function_block_logger", "a type of another file"),
    ("first_steps_program", "blocks of other files"),
    ("if-cec224", "undeclared variables"),
    ("inout_var_decl", "undeclared variables"),
    ("input_var_decl", "undeclared variables"),
    ("pointer_to", "pointers without a purpose, which the standard does not have"),
    ("strings-", "a character that is none"),
    ("textual-", "undeclared variables"),
    ("type_decl", "undeclared types"),
];

/// Files of TcUnit that are refused at most: units of one library, each of which needs the others.
const OBJECTS: usize = 23;
