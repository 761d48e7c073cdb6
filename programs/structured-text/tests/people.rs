//! Programs that other people wrote: taken whole, or refused with the reason.

mod running;

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use understudy_structured_text::syntax::UnitKind;
use understudy_text::{Severity, decode};
use understudy_typed::Program;

/// Files that are taken whole today; the number may rise, and not fall.
const TAKEN: usize = 78;

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    for path in entries.map(|entry| entry.path()) {
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "st") {
            found.push(path);
        }
    }
    found.sort();
}

/// Some scans with changing inputs: both engines agree, whatever the program does.
fn exercise(program: Program) {
    let mut running = running::Running::new(program);
    let inputs = running.inputs();
    for scan in 0..20_u64 {
        let values = inputs.iter().enumerate().map(|(at, point)| {
            let mixed = (scan * 31 + at as u64 * 7 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            match point.of.is_real() {
                true => 0,
                false => mixed >> 17 & point.of.mask(),
            }
        });
        let values: Vec<u64> = values.collect();
        running.scan(&values);
        if running.fault().is_some() {
            return;
        }
    }
}

#[test]
fn files_of_other_people_are_taken_or_refused_with_a_reason() {
    let Some(data) = std::env::var_os("UNDERSTUDY_DATA") else {
        understudy_testing::skip("UNDERSTUDY_DATA is not set");
        return;
    };
    let folder = PathBuf::from(data).join("programs");
    let mut files = Vec::new();
    sources(&folder, &mut files);
    let (mut table, mut taken) = (String::new(), 0);
    for path in &files {
        let name = path.strip_prefix(&folder).unwrap_or(path).display();
        let bytes = fs::read(path).expect("a readable file");
        let Ok(text) = decode(bytes) else {
            let _ = writeln!(table, "{name}: not a text");
            continue;
        };
        // Of several programs without a CONFIGURATION, each is chosen.
        let (file, _) = understudy_structured_text::parse(&text);
        let programs = file.units.iter().filter(|unit| unit.kind == UnitKind::Program);
        let mut choices: Vec<Option<&str>> =
            programs.map(|unit| Some(unit.name.as_str())).collect();
        if choices.len() < 2 || !file.instances.is_empty() {
            choices = vec![None];
        }
        let (mut errors, mut warnings, mut is_program) = (String::new(), 0, false);
        for choice in choices {
            let (lowered, found) = running::read(&text, choice);
            errors.push_str(&running::shown(&text, &found, Severity::Error));
            warnings += running::shown(&text, &found, Severity::Warning).lines().count();
            if let Some(program) = lowered.program {
                exercise(program);
                is_program = true;
            }
        }
        if errors.is_empty() {
            taken += 1;
            let what = if is_program { "program" } else { "library" };
            let _ = writeln!(table, "{name}: {what}, {warnings} warnings");
        } else {
            let _ = writeln!(table, "{name}: refused");
            for error in errors.lines().take(4) {
                let _ = writeln!(table, "    {error}");
            }
        }
    }
    let _ = writeln!(table, "{taken} of {} taken", files.len());
    std::io::Write::write_all(&mut std::io::stdout(), table.as_bytes()).expect("an output");
    assert!(taken >= TAKEN, "{taken} of {} taken", files.len());
}
