//! `understudy convert`: program formats and a report on unsupported elements.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use understudy_interchange::plcopen::{Fidelity, fidelity_with_numbers};
use understudy_interchange::{
    Bodies, Compared, Format, Reading, Wanted, WriteError, Written, read, read_source, typed_text,
    unknown_form, write,
};
use understudy_text::duration::parse_positive;
use understudy_text::{Lines, MAXIMUM_SHOWN, Report, has_errors, shortened};

use crate::answer::{Answer, Status};
use crate::files::{self, ProgramText};

/// Convert a program between formats
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy convert examples/plcopen/pump.xml pump.ladder --fidelity
  understudy convert examples/press-cell/robot.ladder robot.xml
  understudy convert robot.xml robot.st --period 20ms
  understudy convert examples/other-tools/conveyor conveyor.st

The file extension determines the format: .ladder, .xml (PLCopen XML or digraph XML), .st (Structured Text), .ld (LDmicro).")]
pub(crate) struct Arguments {
    /// Input file
    #[arg(value_name = "IN")]
    from_file: PathBuf,
    /// Output file; default: standard output
    #[arg(value_name = "OUT")]
    to_file: Option<PathBuf>,
    /// Further files of the project of IN, which are converted with it
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with = "from")]
    with: Vec<PathBuf>,
    /// Format of IN
    #[arg(long, value_enum)]
    from: Option<Form>,
    /// Format of OUT
    #[arg(long, value_enum)]
    to: Option<Form>,
    /// Program to convert, if IN contains several
    #[arg(long, value_name = "NAME")]
    unit: Option<String>,
    /// Scan period; default: as in IN, otherwise 10ms
    #[arg(long, value_name = "TIME", value_parser = parse_positive)]
    period: Option<Duration>,
    /// Report which elements were converted and which are unsupported
    #[arg(long)]
    fidelity: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Form {
    /// Ladder text
    Ladder,
    /// PLCopen TC6 XML 2.01 (also reads 2.0)
    Plcopen,
    /// PLCopen XML with statements as function block diagrams where these can hold them
    PlcopenFbd,
    /// IEC 61131-3 Structured Text
    St,
    /// Digraph XML of the paper
    Digraph,
    /// LDmicro (input only)
    Ldmicro,
}

impl Form {
    fn format(self) -> Format {
        match self {
            Self::Ladder => Format::Ladder,
            Self::Plcopen | Self::PlcopenFbd => Format::PlcOpen,
            Self::St => Format::StructuredText,
            Self::Digraph => Format::Digraph,
            Self::Ldmicro => Format::LdMicro,
        }
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Answer> {
    let first = &arguments.from_file;
    let joined = match arguments.from {
        None if !arguments.with.is_empty() => {
            let files = [std::slice::from_ref(first), &arguments.with].concat();
            ProgramText::together(first.display().to_string(), &files)?
        }
        None => ProgramText::expected(first)?,
        Some(_) => ProgramText::of(first)?,
    };
    let (name, source) = (joined.name.clone(), joined.text.clone());
    let form_named = arguments.from.map(Form::format);
    let reading = match form_named.or_else(|| Format::of(&name, &source)) {
        Some(format) => read(format, &name, &source, arguments.unit.as_deref()),
        None => Reading { diagnostics: vec![unknown_form(&source)], ..Reading::default() },
    };
    let mut report = Report { name, text: source, diagnostics: reading.diagnostics };
    let mut fidelity = reading.fidelity;
    let wanted = Wanted { program: arguments.unit.as_deref(), period: arguments.period };
    let form = form_of_output(arguments);
    let failed = |error: WriteError| (code(&error), error.to_string());
    let as_it_is = Wanted { period: None, ..wanted };
    let as_it_is = read_source(&report.name, &report.text, as_it_is);
    // Statements are written as they are in each form that has statements.
    let of_statements = match form {
        Ok(form @ (Form::St | Form::Plcopen | Form::PlcopenFbd)) => {
            let bodies = match form {
                Form::PlcopenFbd => Bodies::Blocks,
                _ => Bodies::AsRead,
            };
            typed_text(&report.name, &report.text, wanted, form.format(), bodies)
        }
        _ => Ok((None, Vec::new())),
    };
    let written = match (of_statements, &reading.program) {
        (Ok((Some(written), diagnostics)), _) => {
            report.diagnostics = diagnostics;
            // That of the ladder is of another reading.
            fidelity = fidelity_with_numbers(&report.text, wanted.program);
            Some(Ok(written))
        }
        (Err(error), _) => {
            report.diagnostics.clone_from(&as_it_is.diagnostics);
            Some(Err(failed(error)))
        }
        (Ok((None, found)), Some(program)) if !has_errors(&found) => {
            let period = arguments.period.or(reading.period);
            let written = |form: Form| write(form.format(), program, period).map_err(failed);
            Some(form.and_then(written))
        }
        (Ok((None, _)), _) => None,
    };
    let mut kept =
        if arguments.fidelity { fidelity_text(&fidelity, &report) } else { String::new() };
    let Some(written) = written else {
        let fidelity = fidelity_value(&fidelity, &report, None);
        // The errors of the whole file, as `check` has them; it has those of another form where one is named.
        let found = match form_named.is_none() && has_errors(&as_it_is.diagnostics) {
            true => as_it_is.diagnostics,
            false => report.diagnostics,
        };
        let mut answer = Answer::bad_files(joined.reports(found));
        answer.text = kept;
        answer.result = json!({ "file": null, "text": null, "fidelity": fidelity });
        return Err(answer);
    };
    let written = match written {
        Ok(written) => written,
        Err((code, message)) => {
            let answer = Answer::failed(Status::BadInput, code, message);
            return Err(answer.with_reports(joined.reports(report.diagnostics)));
        }
    };
    if arguments.fidelity {
        kept.push_str(&written_text(&written));
    }
    let fidelity = fidelity_value(&fidelity, &report, Some(&written));
    report.diagnostics.extend(written.losses);
    let text = written.text;
    let answer = match &arguments.to_file {
        None => {
            let result = json!({ "file": null, "text": text, "fidelity": fidelity });
            Answer::done(format!("{text}{kept}"), result)
        }
        Some(path) => {
            files::write_output(path, &text)?;
            let name = path.display().to_string();
            let result = json!({ "file": name, "text": null, "fidelity": fidelity });
            Answer::done(format!("written to {name}\n{kept}"), result).and_next(&[&"check", path])
        }
    };
    Ok(answer.with_reports(joined.reports(report.diagnostics)))
}

/// Code of the error that prevented the conversion.
pub(crate) fn code(error: &WriteError) -> &'static str {
    match error {
        WriteError::Program(error) => error.code_or("U1014"),
        WriteError::ReadOnly | WriteError::NotHeld(_) => "U1014",
        WriteError::Different(_) => "U1019",
    }
}

fn form_of_output(arguments: &Arguments) -> Result<Form, (&'static str, String)> {
    match (arguments.to, &arguments.to_file) {
        (Some(form), _) => Ok(form),
        (None, Some(path)) => form_of(path).map_err(|message| ("U1014", message)),
        (None, None) => Ok(Form::Ladder),
    }
}

/// Format by file extension.
fn form_of(path: &Path) -> Result<Form, String> {
    match Format::of_ending(&path.to_string_lossy()) {
        Some(Format::Ladder) => Ok(Form::Ladder),
        Some(Format::PlcOpen | Format::Digraph) => Ok(Form::Plcopen),
        Some(Format::StructuredText) => Ok(Form::St),
        Some(Format::LdMicro) => Ok(Form::Ldmicro),
        None => Err(format!(
            "{}: output formats are .ladder, .xml and .st; give --to for another file extension",
            path.display()
        )),
    }
}

/// Maximum length of a printed note, in characters.
const MAXIMUM_NOTE: usize = 300;

fn fidelity_text(fidelity: &Fidelity, report: &Report) -> String {
    let mut text = String::from("\n");
    for count in &fidelity.counts {
        let _ = writeln!(
            text,
            "{:<28} {:>5} in the file, {:>5} in the program",
            count.what, count.in_file, count.in_program
        );
    }
    let lines = Lines::new(&report.text);
    for note in fidelity.notes.iter().take(MAXIMUM_SHOWN) {
        let place = lines.position(note.span.start);
        let message = shortened(&note.message, MAXIMUM_NOTE);
        let _ = writeln!(text, "{}:{place}: {message}", report.name);
    }
    match fidelity.notes.len().saturating_sub(MAXIMUM_SHOWN) {
        0 => {}
        more => {
            let _ = writeln!(text, "and {more} more");
        }
    }
    text
}

/// Findings from reading the written text back.
fn written_text(written: &Written) -> String {
    let Compared { signals, blocks, comments, scans, proved } = written.compared;
    let lost = match written.losses.len() {
        0 => "written completely".to_owned(),
        1 => "not written completely: see the warning".to_owned(),
        count => format!("not written completely: see the {count} warnings"),
    };
    let behaviour = if proved {
        "proved equal in every scan".to_owned()
    } else {
        format!("equal in {scans} scans, not proved")
    };
    format!(
        "read back and compared: {signals} signals, {blocks} blocks, {comments} comments; {lost}\nbehaviour: {behaviour}\n"
    )
}

fn fidelity_value(fidelity: &Fidelity, report: &Report, written: Option<&Written>) -> Value {
    let counts = fidelity.counts.iter().map(|count| {
        json!({ "what": count.what, "in_file": count.in_file, "in_program": count.in_program })
    });
    let lines = Lines::new(&report.text);
    let notes = fidelity.notes.iter().take(MAXIMUM_SHOWN).map(|note| {
        let place = lines.position(note.span.start);
        let message = shortened(&note.message, MAXIMUM_NOTE);
        json!({ "line": place.line, "column": place.column, "message": message })
    });
    let written = written.map(|written| {
        let losses = written.losses.iter().map(|found| found.message.as_str());
        json!({
            "losses": losses.collect::<Vec<_>>(),
            "signals": written.compared.signals,
            "blocks": written.compared.blocks,
            "comments": written.compared.comments,
            "scans": written.compared.scans,
            "proved": written.compared.proved,
        })
    });
    let notes: Vec<Value> = notes.collect();
    let more = fidelity.notes.len() - notes.len();
    json!({
        "counts": counts.collect::<Vec<_>>(),
        "notes": notes,
        "more_notes": more,
        "written": written,
    })
}
