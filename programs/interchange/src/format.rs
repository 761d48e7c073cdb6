//! The forms that programs come in: recognised by their content, and read by one function.

use std::ops::Range;
use std::time::Duration;

use understudy_bits::{Inexact, exact};
use understudy_ladder::{Program, from_circuit, parse};
use understudy_text::{Diagnostic, Lines, has_errors};
use understudy_typed::{Elementary, Program as Typed};

use crate::plcopen::Fidelity;
use crate::source::{Rungs, Source, SourceFile, Wanted, no_program, read_source};
use crate::text::whole;
use crate::{digraph, ldmicro, plcopen, text as written, twincat};

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

/// The endings of files that hold programs. XML has several forms, which its root tells apart.
const ENDINGS: [(&str, Format); 6] = [
    ("ladder", Format::Ladder),
    ("xml", Format::PlcOpen),
    ("st", Format::StructuredText),
    ("iecst", Format::StructuredText),
    ("scl", Format::StructuredText),
    ("ld", Format::LdMicro),
];

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

    /// The form of a file, by the ending of its name and its beginning; none where neither tells it.
    pub fn of(name: &str, text: &str) -> Option<Self> {
        let start = text.trim_start_matches('\u{feff}').trim_start();
        match Self::of_ending(name) {
            // The document of a project may have the name of one of its files.
            _ if twincat::is_one(start) => Some(Self::PlcOpen),
            Some(Self::StructuredText) => Some(Self::StructuredText),
            Some(Self::PlcOpen) => Some(Self::of_xml(start)),
            _ if start.starts_with('<') => Some(Self::of_xml(start)),
            Some(known) => Some(known),
            None => Self::of_text(start),
        }
    }

    /// The form that the extension of a file name means.
    pub fn of_ending(name: &str) -> Option<Self> {
        let (_, ending) = name.rsplit_once('.')?;
        let mut endings = ENDINGS.into_iter();
        let found = endings.find(|(known, _)| known.eq_ignore_ascii_case(ending));
        found.map(|(_, format)| format)
    }

    /// The usual ending of its files.
    pub fn ending(self) -> &'static str {
        let known = if self == Self::Digraph { Self::PlcOpen } else { self };
        let found = ENDINGS.iter().find(|(_, format)| *format == known);
        found.map_or("", |(ending, _)| ending)
    }

    fn of_xml(start: &str) -> Self {
        let mut tags = start.split('<').map(str::trim_start);
        match tags.find(|tag| tag.starts_with(|letter: char| letter.is_alphabetic())) {
            Some(root) if root.starts_with("LadderDiagram") => Self::Digraph,
            _ => Self::PlcOpen,
        }
    }

    /// By words that only one form has.
    fn of_text(start: &str) -> Option<Self> {
        let ends = |word: &str| {
            let words = ["END_PROGRAM", "END_FUNCTION_BLOCK", "END_FUNCTION"];
            words.iter().any(|end| end.eq_ignore_ascii_case(word))
        };
        let mut words = start.split(|letter: char| !letter.is_alphanumeric() && letter != '_');
        let mut lines = start.lines().map(str::trim);
        let first = lines.find(|line| !line.is_empty() && !line.starts_with("--"));
        let first = first.and_then(|line| line.split_whitespace().next());
        if start.starts_with("LDmicro") {
            Some(Self::LdMicro)
        } else if words.any(ends) {
            Some(Self::StructuredText)
        } else {
            (first == Some("program")).then_some(Self::Ladder)
        }
    }
}

/// Reads the program of the file `name`; `unit` chooses one where there are several.
pub fn read(format: Format, name: &str, text: &str, unit: Option<&str>) -> Reading {
    let (mut reading, runs) = read_form(format, name, text, unit);
    if let [(read, _), others @ ..] = runs.as_slice() {
        reading.diagnostics.extend(others.iter().map(|(other, span)| {
            let message = format!("a task runs `{other}` too, and only `{read}` is read");
            let help = "`--unit NAME` of `understudy convert` reads another program; each controller runs one";
            Diagnostic::warning("U1023", message, span.clone()).with_help(help)
        }));
        reading.diagnostics.sort_by_key(|found| found.span.start);
    }
    reading
}

/// As [`read`], with all that the tasks run where this is more than the program that was read, which is the first.
fn read_form(
    format: Format,
    name: &str,
    text: &str,
    unit: Option<&str>,
) -> (Reading, Vec<(String, Range<usize>)>) {
    let mut runs = Vec::new();
    let mut reading = match format {
        Format::Ladder => {
            let parsed = parse(text);
            let is_right = !has_errors(&parsed.diagnostics);
            Reading {
                program: is_right.then_some(parsed.program),
                diagnostics: parsed.diagnostics,
                ..Reading::default()
            }
        }
        Format::PlcOpen => match twincat::read(text) {
            Some(parsed) => whole(text, parsed, unit, None).reading(text),
            None => {
                let read = plcopen::read(text, unit);
                runs = read.runs;
                Reading {
                    program: read.program,
                    period: read.period,
                    diagnostics: read.diagnostics,
                    fidelity: read.fidelity,
                }
            }
        },
        Format::Digraph => {
            let read = digraph::read(text);
            Reading { program: read.program, diagnostics: read.diagnostics, ..Reading::default() }
        }
        Format::LdMicro => whole(text, ldmicro::read(stem(name), text), unit, None).reading(text),
        Format::StructuredText => written::read(text, unit),
    };
    // Who writes a ladder sees what it has; from a digraph, it may have been lost on the way.
    if let Some(program) = &reading.program
        && format == Format::Digraph
        && program.rungs.is_empty()
    {
        let message = format!("the program `{}` has no rungs: it does nothing", program.name);
        let found = Diagnostic::warning("U1023", message, program.name.span());
        reading.diagnostics.push(found);
    }
    (reading, runs)
}

/// The name of a file without its folder and ending.
pub(crate) fn stem(name: &str) -> &str {
    let file = name.rsplit(['/', '\\']).next().unwrap_or(name);
    file.split('.').next().unwrap_or(file)
}

/// Reads a program wherever a ladder is asked for, whatever its form; `period` is from one scan to the next, where that is known. A program that is
/// not drawn is that of its statements where its points are BOOLs and rungs hold them, else that of its circuit, where its values are finite; see
/// [`exact`]. It is all that the file runs.
pub fn read_ladder(name: &str, text: &str, period: Option<Duration>) -> Reading {
    let SourceFile { source, rungs, period: stated, mut diagnostics } =
        read_source(name, text, Wanted { program: None, period });
    let written = rungs.and_then(Rungs::written);
    let program = match source {
        Some(Source::Program(_)) if written.is_some() => written,
        Some(Source::Program(typed)) => {
            of_statements(name, text, &typed).or_else(|| match exact(&typed) {
                Ok(circuit) => Some(from_circuit(&circuit)),
                Err(inexact) => {
                    diagnostics.push(no_circuit(text, &typed.name, &inexact));
                    None
                }
            })
        }
        Some(Source::Library(_)) => {
            diagnostics.push(no_program());
            None
        }
        None => None,
    };
    Reading { program, period: stated, diagnostics, ..Reading::default() }
}

/// The rungs of a program whose points are BOOLs and that runs in every scan, where rungs hold its statements.
fn of_statements(name: &str, text: &str, typed: &Typed) -> Option<Program> {
    let mut points = typed.inputs.iter().chain(&typed.outputs);
    let is_every_scan = typed.tasks.iter().all(|task| task.every == 1);
    if !is_every_scan
        || typed.tasks.len() > 1
        || points.any(|point| point.of != Elementary::Bool || point.slot == 0)
    {
        return None;
    }
    let (reading, _) = read_form(Format::of(name, text)?, name, text, None);
    reading.program
}

/// The finding on a program without a circuit where one is asked for.
fn no_circuit(text: &str, name: &str, inexact: &Inexact) -> Diagnostic {
    let at = match inexact {
        Inexact::Unsupported(reason) => Some((&reason.routine, reason.line)),
        Inexact::Differs(_) => None,
        Inexact::Gaps(gaps) => {
            gaps.iter().find_map(|gap| gap.at.as_ref()).map(|(routine, line)| (routine, *line))
        }
    };
    // That of a library block is not in the text.
    let line = at.filter(|(routine, line)| routine.eq_ignore_ascii_case(name) && *line > 0);
    let span = line.map_or(0..0, |(_, line)| {
        let whole = Lines::new(text).range(line as usize - 1);
        let written = text.get(whole.clone()).unwrap_or_default();
        let start = whole.start + (written.len() - written.trim_start().len());
        start..start + written.trim().len()
    });
    let message = format!("`{name}` is wanted as a circuit, and has none: {inexact}");
    Diagnostic::error(inexact.code_or("U0438"), message, span).with_help(
        "a circuit has BOOLs, bit strings, integers, timers and counters; scan, verify and stations take the program as it is",
    )
}

/// The finding on a file of which neither name nor contents tell the form.
pub fn unknown_form(text: &str) -> Diagnostic {
    let endings: Vec<String> = ENDINGS.iter().map(|(end, _)| format!(".{end}")).collect();
    let message = format!(
        "the form of this program is unknown: its name does not end in {}, and it does not begin as any of these forms",
        endings.join(", ")
    );
    let start = text.len() - text.trim_start().len();
    Diagnostic::error("U0619", message, start..start)
        .with_help("`understudy convert --from FORM` reads a file with another ending")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_form_is_told_by_ending_and_beginning() {
        let check = |name: &str, text: &str, expected: Option<Format>| {
            assert_eq!(Format::of(name, text), expected, "{name} {text:?}");
        };
        check("a.ladder", "", Some(Format::Ladder));
        check("A.LADDER", "nonsense", Some(Format::Ladder));
        check("a.st", "<", Some(Format::StructuredText));
        check("a.scl", "", Some(Format::StructuredText));
        check("a.ld", "LDmicro0.1", Some(Format::LdMicro));
        check("a.ld", "\u{feff}<project/>", Some(Format::PlcOpen));
        check("a.xml", "<?xml?><!-- a --><LadderDiagram>", Some(Format::Digraph));
        check("a.xml", "", Some(Format::PlcOpen));
        check("a.clp", "_FILES_CLASSICLADDER\n", None);
        check("a", "", None);
        check("a.txt", "-- a pump\n\nprogram pump\n", Some(Format::Ladder));
        check("a.txt", "program p VAR END_VAR end_program", Some(Format::StructuredText));
        check("a.txt", "LDmicro0.2\n", Some(Format::LdMicro));
        check("a.txt", "programs of all kinds\n", None);
        check("a.b/c", "", None);
    }

    #[test]
    fn a_file_of_no_known_form_is_one_error() {
        let found = read_ladder("a.clp", "_FILES_CLASSICLADDER\n_FILE-a\n#1\n", None).diagnostics;
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!(found[0].code, "U0619");
    }
}
