//! Files of all forms that other people wrote: each is taken whole, or refused with the reason.
//!
//! `UNDERSTUDY_SURVEY=FOLDER cargo test -p understudy-interchange --test people -- --nocapture` prints the same table of any folder.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use understudy_interchange::{Source, Wanted, read_source};
use understudy_text::{Diagnostic, Lines, MAXIMUM_FINDINGS, Severity, decode};

/// Ends of the names of files with programs.
const FORMS: [&str; 9] = [
    "st", "il", "xml", "iecst", "scl", "tcpou", "tcgvl", "tcdut", "exp",
];

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
        return (
            "refused".to_owned(),
            vec!["it is not a text in UTF-8".to_owned()],
        );
    };
    let name = path.to_string_lossy();
    let read = |program| {
        let wanted = Wanted {
            program,
            period: None,
        };
        read_source(&name, &text, wanted)
    };
    let mut files = vec![read(None)];
    // Of several programs without a CONFIGURATION, each is chosen.
    let is_choice =
        |found: &&Diagnostic| found.code == "U1013" && found.message.contains("no CONFIGURATION");
    if let Some(choice) = files[0].diagnostics.iter().find(is_choice)
        && let Some((_, names)) = choice
            .help
            .as_deref()
            .unwrap_or_default()
            .rsplit_once(" of ")
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
            Some(Source::Ladder(_)) => "ladder",
            Some(Source::Typed(_)) => "program",
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

/// How many files of a folder are taken, of how many; their table is printed.
fn survey(folder: &Path) -> (usize, usize) {
    let mut files = Vec::new();
    sources(folder, &mut files);
    let (mut table, mut taken) = (String::new(), 0);
    for path in &files {
        let (what, errors) = outcome(path);
        taken += usize::from(errors.is_empty());
        let name = path.strip_prefix(folder).unwrap_or(path).display();
        let _ = writeln!(table, "{name}: {what}");
        for error in errors.iter().take(6) {
            let _ = writeln!(table, "    {error}");
        }
    }
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    let _ = writeln!(table, "{name}: {taken} of {} taken", files.len());
    std::io::Write::write_all(&mut std::io::stdout(), table.as_bytes()).expect("an output");
    (taken, files.len())
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
    let taken = |names: &[&str]| {
        let counts = names.iter().map(|name| survey(&programs.join(name)).0);
        counts.sum::<usize>()
    };
    let editors = taken(&[
        "beremiz+beremiz",
        "gracesrm+OpenPLC_Sample_Programs",
        "virajdesai0309+OpenPLC_Tutorials",
    ]);
    let compilers = taken(&["iec-checker+iec-checker", "ironplc+ironplc"]);
    let objects = taken(&["tcunit+TcUnit"]);
    assert!(editors >= EDITORS, "{editors} of 71");
    assert!(compilers >= COMPILERS, "{compilers} of 69");
    assert!(objects >= OBJECTS, "{objects} of 33");
}

/// Files of OpenPLC and Beremiz that are taken whole: the number may rise, and not fall.
const EDITORS: usize = 1;
/// The same of iec-checker and ironplc.
const COMPILERS: usize = 1;
/// The same of TcUnit, a library for TwinCAT.
const OBJECTS: usize = 0;
