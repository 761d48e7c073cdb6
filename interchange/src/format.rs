//! The forms that programs come in: told apart by what stands in a file, and read by one function.

use std::time::Duration;

use understudy_diagnostic::{Diagnostic, has_errors};
use understudy_ladder::{Parsed, Program, parse};

use crate::plcopen::Fidelity;
use crate::{digraph, ldmicro, plcopen, structured_text};

/// A form of programs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// The project's own text (`*.ladder`).
    Ladder,
    /// PLCopen TC6 XML.
    PlcOpen,
    /// Structured Text of IEC 61131-3.
    StructuredText,
    /// The paper's digraphs as XML.
    Digraph,
    /// LDmicro's files.
    LdMicro,
}

/// What a file of any form says.
#[derive(Debug, Clone, Default)]
pub struct Reading {
    /// The program, where nothing is wrong.
    pub program: Option<Program>,
    /// From one scan to the next, where the file says so.
    pub period: Option<Duration>,
    /// Everything that is wrong or odd, with its place.
    pub diagnostics: Vec<Diagnostic>,
    /// What was kept and what was not, where the form has more than programs here have.
    pub fidelity: Fidelity,
}

impl Format {
    /// What it is called.
    pub fn title(self) -> &'static str {
        match self {
            Self::Ladder => "the ladder format",
            Self::PlcOpen => "PLCopen XML",
            Self::StructuredText => "Structured Text",
            Self::Digraph => "digraph XML",
            Self::LdMicro => "LDmicro",
        }
    }

    /// The form of a file, by its beginning where the end of its name says too little.
    pub fn of(name: &str, text: &str) -> Self {
        let ending = name.rsplit_once('.').map_or("", |(_, ending)| ending);
        let start = text.trim_start_matches('\u{feff}').trim_start();
        let xml = || {
            let root = start
                .split('<')
                .map(str::trim_start)
                .find(|tag| tag.starts_with(|letter: char| letter.is_alphabetic()));
            match root {
                Some(root) if root.starts_with("LadderDiagram") => Self::Digraph,
                _ => Self::PlcOpen,
            }
        };
        match ending.to_ascii_lowercase().as_str() {
            "st" | "iecst" | "scl" => Self::StructuredText,
            "xml" => xml(),
            _ if start.starts_with('<') => xml(),
            "ld" => Self::LdMicro,
            _ => Self::Ladder,
        }
    }
}

/// Reads the program of the file `name`; `unit` chooses one where there are several.
pub fn read(format: Format, name: &str, text: &str, unit: Option<&str>) -> Reading {
    match format {
        Format::Ladder => {
            let parsed = parse(text);
            let is_right = !has_errors(&parsed.diagnostics);
            Reading {
                program: is_right.then_some(parsed.program),
                diagnostics: parsed.diagnostics,
                ..Reading::default()
            }
        }
        Format::PlcOpen => {
            let read = plcopen::read(text, unit);
            Reading {
                program: read.program,
                period: read.period,
                diagnostics: read.diagnostics,
                fidelity: read.fidelity,
            }
        }
        Format::Digraph => {
            let read = digraph::read(text);
            Reading {
                program: read.program,
                diagnostics: read.diagnostics,
                ..Reading::default()
            }
        }
        Format::LdMicro => {
            let read = ldmicro::read(stem(name), text);
            Reading {
                program: read.program,
                period: read.period,
                diagnostics: read.diagnostics,
                ..Reading::default()
            }
        }
        Format::StructuredText => {
            let read = structured_text::read(text);
            let mut reading = Reading {
                period: read.period,
                diagnostics: read.diagnostics,
                ..Reading::default()
            };
            reading.program = one(read.programs, unit, &mut reading.diagnostics);
            reading
        }
    }
}

/// The name of a file without its folder and ending.
fn stem(name: &str) -> &str {
    let file = name.rsplit(['/', '\\']).next().unwrap_or(name);
    file.split('.').next().unwrap_or(file)
}

/// The only program, or the one that is asked for.
fn one(
    mut programs: Vec<Program>,
    unit: Option<&str>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<Program> {
    if has_errors(diagnostics) {
        return None;
    }
    let names: Vec<String> = programs
        .iter()
        .map(|program| format!("`{}`", program.name))
        .collect();
    if let Some(unit) = unit {
        programs.retain(|program| program.name.eq_ignore_ascii_case(unit));
    }
    if programs.len() == 1 {
        return programs.pop();
    }
    let message = match unit {
        Some(unit) => format!("the file has no program `{unit}`"),
        None => format!("the file has {} programs, and one is read", names.len()),
    };
    let error = Diagnostic::error("U1013", message, 0..0);
    diagnostics.push(error.with_help(format!("choose one of {}", names.join(", "))));
    None
}

/// Reads a program wherever a ladder is asked for, whatever its form.
pub fn parse_program(name: &str, text: &str) -> Parsed {
    let format = Format::of(name, text);
    if format == Format::Ladder {
        return parse(text);
    }
    let reading = read(format, name, text, None);
    Parsed {
        program: reading.program.unwrap_or_default(),
        diagnostics: reading.diagnostics,
    }
}
