//! The units of a library that other people wrote, one by one: how many have no error.
//!
//! `UNDERSTUDY_OSCAT=FOLDER cargo test -p understudy-structured-text --test units -- --nocapture`, where the folder is a checkout of the
//! public repository `PLC-lang/oscat`.

mod running;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

use running::read;
use understudy_structured_text::parse;
use understudy_text::{Lines, Severity, decode};

#[test]
fn nine_of_ten_units_of_oscat_are_taken() {
    let Some(folder) = std::env::var_os("UNDERSTUDY_OSCAT") else {
        understudy_testing::skip("UNDERSTUDY_OSCAT is not set");
        return;
    };
    let folder = PathBuf::from(folder);
    let mut text = String::new();
    for name in ["stubs.st", "oscat.st"] {
        let bytes = fs::read(folder.join(name)).expect("a readable file");
        text += &decode(bytes).expect("a text");
        text.push('\n');
    }
    let (file, _) = parse(&text);
    let (_, found) = read(&text, None);
    let lines = Lines::new(&text);
    let mut refused: BTreeMap<&str, BTreeSet<String>> = BTreeMap::new();
    for error in found.iter().filter(|found| found.severity == Severity::Error) {
        let place = error.span.start;
        let mut units = file.units.iter();
        if let Some(unit) = units.find(|unit| unit.span.contains(&place)) {
            let line = format!("{} {} {}", lines.position(place), error.code, error.message);
            refused.entry(unit.name.as_str()).or_default().insert(line);
        }
    }
    let mut table = String::new();
    for (unit, errors) in &refused {
        let _ = writeln!(table, "{unit}");
        for error in errors.iter().take(3) {
            let _ = writeln!(table, "    {error}");
        }
    }
    let (all, taken) = (file.units.len(), file.units.len() - refused.len());
    let _ = writeln!(table, "{taken} of {all} units taken");
    std::io::Write::write_all(&mut std::io::stdout(), table.as_bytes()).expect("an output");
    assert!(taken * 100 >= all * 95, "{taken} of {all}");
}
