//! Files, scans, and the tools of the tests.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use understudy_bits::exact;
use understudy_interchange::plcopen::{Reading, read};
use understudy_interchange::{Source, SourceFile, Wanted, read_source};
use understudy_ladder::Program;
use understudy_logic::{Circuit, Running};
use understudy_testing::skip;
use understudy_text::{Report, Severity};

use understudy_testing::random::Dice;

pub(crate) const PERIOD: Duration = Duration::from_millis(100);

/// Public files of other people, where they are at hand: some may be read and not copied.
pub(crate) fn data(path: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("UNDERSTUDY_DATA").unwrap_or_default();
    let found = Some(Path::new(&folder).join(path)).filter(|path| path.exists());
    if found.is_none() {
        skip(format_args!("UNDERSTUDY_DATA names no folder with {path}"));
    }
    found
}

/// Every finding of a reading as a line.
pub(crate) fn findings(text: &str, reading: &Reading) -> Vec<String> {
    let report = Report { name: String::new(), text: text.to_owned(), diagnostics: Vec::new() };
    let line = |found: &understudy_text::Diagnostic| {
        let severity = match found.severity {
            Severity::Error => "error",
            Severity::Warning => "warning",
        };
        let place = report.line_and_column(found.span.start);
        format!("{place} {severity} {} {}", found.code, found.message)
    };
    reading.diagnostics.iter().map(line).collect()
}

/// The program of a file that has nothing wrong.
pub(crate) fn program(text: &str) -> Program {
    let reading = read(text, None);
    let found = findings(text, &reading);
    reading.program.unwrap_or_else(|| panic!("no program: {found:#?}"))
}

/// The circuit of a file that has nothing wrong.
pub(crate) fn circuit(text: &str) -> Circuit {
    let wanted = Wanted { period: Some(PERIOD), program: None };
    let SourceFile { source, diagnostics, .. } = read_source("file.xml", text, wanted);
    match source {
        Some(Source::Program(program)) => exact(&program).expect("a circuit"),
        other => panic!("no program: {other:?} {diagnostics:#?}\n{text}"),
    }
}

/// Outputs of `scans` scans under random inputs that change now and then.
pub(crate) fn outputs(circuit: &Circuit, seed: u64, scans: usize) -> Vec<Vec<bool>> {
    let mut dice = Dice::new(seed);
    let mut inputs = vec![false; circuit.inputs().len()];
    let mut run = Running::new(circuit);
    let mut shown = Vec::new();
    for _ in 0..scans {
        for input in &mut inputs {
            *input ^= dice.rarely(3);
        }
        shown.push(run.step(&inputs));
    }
    shown
}

/// What `xmllint` says about a text and the schema; `None` where one of them is not at hand.
pub(crate) fn xmllint(name: &str, text: &str) -> Option<bool> {
    let schema = data("plcopen/tc6_xml_v201.xsd")?;
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.xml"));
    fs::write(&file, text).expect("the folder of the tests can be written");
    let status = Command::new("xmllint")
        .args(["--noout", "--nonet", "--schema"])
        .args([&schema, &file])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .ok()?;
    Some(status.success())
}
