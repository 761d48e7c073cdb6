//! `understudy convert`: a program from one form into another, with what was kept and what was not.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use understudy_diagnostic::Report;
use understudy_interchange::plcopen::{Fidelity, write};
use understudy_interchange::{Format, digraph, read};
use understudy_ladder::{Program, parse_time, print, structured_text};

use crate::answer::{Answer, Status};
use crate::files;
use crate::kind::Kind;

/// Convert a program from one form into another
#[derive(Debug, Args)]
#[command(after_help = "\
The forms are told by the files: .ladder, .xml (PLCopen XML, or the paper's digraphs), .st
(Structured Text), .ld (LDmicro).

Example:
  understudy convert examples/plcopen/pump.xml pump.ladder --fidelity
  understudy convert examples/press-cell/robot.ladder robot.xml
  understudy convert robot.xml robot.st --period 20ms")]
pub(crate) struct Arguments {
    /// The program
    #[arg(value_name = "IN")]
    from_file: PathBuf,
    /// Where it goes; without it the program goes to standard output
    #[arg(value_name = "OUT")]
    to_file: Option<PathBuf>,
    /// The form of IN
    #[arg(long, value_enum)]
    from: Option<Form>,
    /// The form of OUT
    #[arg(long, value_enum)]
    to: Option<Form>,
    /// The program that is meant, where IN has several
    #[arg(long, value_name = "NAME")]
    unit: Option<String>,
    /// From one scan to the next; as IN says, or 10ms
    #[arg(long, value_name = "TIME", value_parser = time)]
    period: Option<Duration>,
    /// Say what was kept and what was not
    #[arg(long)]
    fidelity: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Form {
    /// The text format of ladders
    Ladder,
    /// PLCopen TC6 XML 2.01 (2.0 too is read)
    Plcopen,
    /// Structured Text of IEC 61131-3
    St,
    /// The paper's digraphs as XML
    Digraph,
    /// LDmicro's files, which are read only
    Ldmicro,
}

impl Form {
    fn format(self) -> Format {
        match self {
            Self::Ladder => Format::Ladder,
            Self::Plcopen => Format::PlcOpen,
            Self::St => Format::StructuredText,
            Self::Digraph => Format::Digraph,
            Self::Ldmicro => Format::LdMicro,
        }
    }
}

fn time(text: &str) -> Result<Duration, String> {
    let time = parse_time(text).filter(|time| !time.is_zero());
    time.ok_or_else(|| format!("{text:?} is no time such as 10ms"))
}

pub(crate) fn run(arguments: &Arguments) -> Answer {
    let read_file = match arguments.from {
        Some(_) => files::text(&arguments.from_file),
        None => files::text_of(Kind::Ladder, &arguments.from_file),
    };
    let source = match read_file {
        Ok(source) => source,
        Err(answer) => return answer,
    };
    let name = arguments.from_file.display().to_string();
    let format = arguments.from.map(Form::format);
    let format = format.unwrap_or_else(|| Format::of(&name, &source));
    let reading = read(format, &name, &source, arguments.unit.as_deref());
    let report = Report {
        name,
        text: source,
        diagnostics: reading.diagnostics,
    };
    let kept = if arguments.fidelity {
        fidelity_text(&reading.fidelity, &report)
    } else {
        String::new()
    };
    let fidelity = fidelity_value(&reading.fidelity, &report);
    let Some(program) = reading.program else {
        let mut answer = Answer::bad_files(vec![report]);
        answer.text = kept;
        answer.result = json!({ "file": null, "text": null, "fidelity": fidelity });
        return answer;
    };
    let period = arguments
        .period
        .or(reading.period)
        .unwrap_or(Duration::from_millis(10));
    let text = match converted(&program, arguments, period) {
        Ok(text) => text,
        Err(message) => {
            return Answer::failed(Status::BadInput, "U1014", message).with_reports(vec![report]);
        }
    };
    let answer = match &arguments.to_file {
        None => {
            let result = json!({ "file": null, "text": text, "fidelity": fidelity });
            Answer::done(format!("{text}{kept}"), result)
        }
        Some(path) => match files::write(path, &text) {
            Ok(()) => {
                let name = path.display().to_string();
                let result = json!({ "file": name, "text": null, "fidelity": fidelity });
                Answer::done(format!("written to {name}\n{kept}"), result)
            }
            Err(answer) => answer,
        },
    };
    answer.with_reports(vec![report])
}

fn converted(program: &Program, arguments: &Arguments, period: Duration) -> Result<String, String> {
    let form = match (arguments.to, &arguments.to_file) {
        (Some(form), _) => form,
        (None, Some(path)) => form_of(path)?,
        (None, None) => Form::Ladder,
    };
    match form {
        Form::Ladder => Ok(print(program)),
        Form::Plcopen => Ok(write(program, period)),
        Form::Digraph => Ok(digraph::write(program)),
        Form::Ldmicro => Err("LDmicro's files are read only".to_owned()),
        Form::St => Ok(structured_text(program, period)),
    }
}

/// By the ending of the file.
fn form_of(path: &Path) -> Result<Form, String> {
    let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
    match ending.to_str() {
        Some("ladder") => Ok(Form::Ladder),
        Some("xml") => Ok(Form::Plcopen),
        Some("st") => Ok(Form::St),
        Some("ld") => Ok(Form::Ldmicro),
        _ => Err(format!(
            "{}: a program is written as .ladder, .xml or .st; --to says the form of a file with another ending",
            path.display()
        )),
    }
}

fn fidelity_text(fidelity: &Fidelity, report: &Report) -> String {
    let mut text = String::from("\n");
    if fidelity.counts.is_empty() && fidelity.notes.is_empty() {
        text.push_str("nothing was lost\n");
    }
    for count in &fidelity.counts {
        let _ = writeln!(
            text,
            "{:<28} {:>5} in the file, {:>5} in the program",
            count.what, count.in_file, count.in_program
        );
    }
    for note in &fidelity.notes {
        let place = report.line_and_column(note.span.start);
        let _ = writeln!(text, "{}:{place}: {}", report.name, note.message);
    }
    text
}

fn fidelity_value(fidelity: &Fidelity, report: &Report) -> Value {
    let counts = fidelity.counts.iter().map(|count| {
        json!({ "what": count.what, "in_file": count.in_file, "in_program": count.in_program })
    });
    let notes = fidelity.notes.iter().map(|note| {
        let place = report.line_and_column(note.span.start);
        json!({ "line": place.line, "column": place.column, "message": note.message })
    });
    json!({ "counts": counts.collect::<Vec<_>>(), "notes": notes.collect::<Vec<_>>() })
}
