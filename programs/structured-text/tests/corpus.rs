//! Structured Text of other people and other tools: what is legal is read without an error.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use understudy_structured_text::parse;
use understudy_text::{Lines, Severity};

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    let Ok(entries) = fs::read_dir(folder) else {
        return;
    };
    for entry in entries.flatten() {
        let path = entry.path();
        if path.is_dir() {
            sources(&path, found);
        } else if path
            .extension()
            .is_some_and(|extension| extension.eq_ignore_ascii_case("st"))
        {
            found.push(path);
        }
    }
    found.sort();
}

#[test]
fn the_corpus_is_read() {
    let Some(data) = std::env::var_os("UNDERSTUDY_DATA") else {
        understudy_testing::skip("UNDERSTUDY_DATA is not set");
        return;
    };
    let mut files = Vec::new();
    sources(&PathBuf::from(data).join("programs"), &mut files);
    let mut table = String::new();
    let mut codes: BTreeMap<&str, usize> = BTreeMap::new();
    let mut whole = 0;
    for path in &files {
        let bytes = fs::read(path).expect("a readable file");
        let text = String::from_utf8_lossy(&bytes);
        let (_, found) = parse(&text);
        let lines = Lines::new(&text);
        whole += usize::from(!found.iter().any(|found| found.severity == Severity::Error));
        for (index, found) in found.iter().enumerate() {
            *codes.entry(found.code).or_default() += 1;
            if index < 4 {
                let place = lines.position(found.span.start);
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                let _ = writeln!(
                    table,
                    "{name}:{place}: {:?} {} {}",
                    found.severity, found.code, found.message
                );
            }
        }
    }
    let _ = writeln!(
        table,
        "{whole} of {} files without an error; {codes:?}",
        files.len()
    );
    let list = std::env::var_os("UNDERSTUDY_TABLE");
    if let Some(list) = list {
        fs::write(list, &table).expect("a table");
    }
}
