//! Structured Text of other people and other tools: what is legal is read without an error.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use understudy_structured_text::parse;
use understudy_text::{Lines, Severity};

/// Files that have an error on purpose or by what they are, and why.
const REFUSED: [(&str, &str); 3] = [
    ("binary_file-", "no text"),
    ("strings-", "a text of another encoding, read as UTF-8"),
    ("references-", "assignments of references"),
];

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    let Ok(entries) = fs::read_dir(folder) else {
        return;
    };
    for entry in entries.flatten() {
        let path = entry.path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("st")) {
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
    for path in &files {
        let bytes = fs::read(path).expect("a readable file");
        let text = String::from_utf8_lossy(&bytes);
        let (_, found) = parse(&text);
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let is_refused = REFUSED.iter().any(|(refused, _)| name.starts_with(refused));
        let mut errors = found.iter().filter(|found| found.severity == Severity::Error);
        match errors.next() {
            Some(error) if !is_refused => {
                let place = Lines::new(&text).position(error.span.start);
                let _ = writeln!(table, "{name}:{place}: {} {}", error.code, error.message);
            }
            None if is_refused => {
                let _ = writeln!(table, "{name} is read, and was not");
            }
            _ => {}
        }
    }
    assert!(table.is_empty(), "{table}");
    assert!(files.len() >= 100, "{} files", files.len());
}
