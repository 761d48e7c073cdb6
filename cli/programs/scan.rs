//! `understudy scan`: the outputs of a program, scan by scan, for inputs from a file.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use serde::Serialize;
use serde_json::{Map, Value};
use understudy_executable::{Executable, Interface, Scratch, declared, digest};
use understudy_interchange::{Source, USUAL_PERIOD, Wanted, no_program, read_source};
use understudy_text::{Diagnostic, Report, duration, has_errors};
use understudy_typed::{Declared, Elementary, Fault, Point, Points, Program};

use crate::answer::{Answer, Status};
use crate::files::{self, ProgramText};

/// Execute a program on inputs from a file or on random inputs
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy scan examples/press-cell/robot.ladder --inputs examples/press-cell/part-arrives.txt
  understudy scan --json examples/press-cell/robot.ladder --inputs examples/press-cell/part-arrives.txt
  understudy scan examples/heated-tank/level.st --digest 100000

A line of the file holds the values of all inputs, with blanks between: BOOL as 0 or 1, integers and bit strings in decimal, REAL and LREAL
as their hexadecimal bit patterns of 8 and 16 digits or as numbers with a point, times as literals such as T#1s500ms and D#2024-02-29 or in
nanoseconds, values of enumerations by their names. A line `# NAME NAME ...` with the
names of all inputs gives the order of the values below it; without one it is that of the list `inputs` of --json: inputs at addresses and
global ones first, then as they are declared. Empty lines and other lines that begin with # are skipped. Each scan is printed as `inputs -> outputs` in the same notation.
With --digest, the inputs are pseudo-random and the same in every run. The digest of all outputs is equal on every processor and in every
version of Understudy that executes the program alike.")]
pub(crate) struct Arguments {
    #[command(flatten)]
    subject: SubjectArguments,
    /// File with the inputs, one scan a line
    #[arg(long, value_name = "FILE", required_unless_present = "digest")]
    inputs: Option<PathBuf>,
    /// Print only a digest of the outputs of this number of scans with pseudo-random inputs
    #[arg(long, value_name = "SCANS", conflicts_with = "inputs")]
    digest: Option<u64>,
}

/// The program that is executed.
#[derive(Debug, Args)]
pub(crate) struct SubjectArguments {
    /// Program
    #[arg(value_name = "PROGRAM")]
    program_file: PathBuf,
    /// Time from one scan to the next; by default that of the file, else 10ms
    #[arg(long, value_name = "TIME", value_parser = duration::parse_positive)]
    pub(crate) period: Option<Duration>,
    /// The program to execute in a text with several programs and no configuration
    #[arg(long, value_name = "NAME")]
    program: Option<String>,
}

/// The longest file of inputs, in scans.
const MAXIMUM_SCANS: usize = 1_000_000;

/// Faulty lines that are reported one by one.
const MAXIMUM_REPORTED: usize = 20;

#[derive(Serialize)]
struct Result {
    program: String,
    period_ns: u64,
    inputs: Vec<Signal>,
    outputs: Vec<Signal>,
    scans: Vec<Scanned>,
}

#[derive(Serialize)]
struct Digested {
    program: String,
    period_ns: u64,
    scans: u64,
    faults: u64,
    digest: String,
}

#[derive(Serialize)]
struct Signal {
    name: String,
    #[serde(rename = "type")]
    of: String,
}

#[derive(Serialize)]
struct Scanned {
    inputs: Map<String, Value>,
    outputs: Map<String, Value>,
    /// The program fault that stops the program in this scan and in all after it.
    #[serde(skip_serializing_if = "Option::is_none")]
    fault: Option<String>,
}

pub(crate) fn run(arguments: &Arguments) -> Answer {
    match scan(arguments) {
        Ok(answer) | Err(answer) => answer,
    }
}

fn scan(arguments: &Arguments) -> std::result::Result<Answer, Answer> {
    let (subject, reports) = subject(&arguments.subject)?;
    let Some(inputs) = &arguments.inputs else {
        let answer = subject.digested(arguments.digest.unwrap_or_default());
        return Ok(answer.with_used(reports));
    };
    let text = files::text(inputs)?;
    let lines = lines(&text, &subject.interface.inputs).map_err(|diagnostics| {
        Answer::bad_files(vec![Report {
            name: inputs.display().to_string(),
            text: text.clone(),
            diagnostics,
        }])
    })?;
    Ok(subject.executed(&lines).with_used(reports))
}

/// A program that is executed.
pub(crate) struct Subject {
    pub(crate) name: String,
    pub(crate) executable: Executable,
    pub(crate) interface: Interface,
    period: Duration,
    pub(crate) program: std::sync::Arc<Program>,
}

pub(crate) fn subject(
    arguments: &SubjectArguments,
) -> std::result::Result<(Subject, Vec<Report>), Answer> {
    let source = ProgramText::of(&arguments.program_file)?;
    let wanted = Wanted { period: arguments.period, program: arguments.program.as_deref() };
    let mut read = read_source(&source.name, &source.text, wanted);
    let period = arguments.period.or(read.period).unwrap_or(USUAL_PERIOD);
    if let Some(Source::Library(_)) = read.source {
        read.diagnostics.push(no_program());
    }
    let reports = source.reports(read.diagnostics);
    let Some(Source::Program(program)) = read.source else {
        return Err(Answer::bad_files(reports));
    };
    let (executable, interface) = (program.as_ref().into(), program.as_ref().into());
    let name = program.name.clone();
    Ok((Subject { name, executable, interface, period, program }, reports))
}

/// The stored values of each scan.
fn lines(text: &str, inputs: &Points) -> std::result::Result<Vec<Vec<u64>>, Vec<Diagnostic>> {
    let points: Vec<&Point> = declared(inputs).collect();
    // Which input each column of the file is.
    let mut columns: Vec<usize> = (0..points.len()).collect();
    let mut scans = Vec::new();
    let mut diagnostics = Vec::new();
    let mut place = 0;
    for line in text.split_inclusive('\n') {
        let start = place;
        place += line.len();
        let line = line.trim_end();
        if let Some(comment) = line.trim_start().strip_prefix('#') {
            columns = named_columns(comment, &points).unwrap_or(columns);
            continue;
        }
        if line.trim().is_empty() && !points.is_empty() {
            continue;
        }
        if scans.len() >= MAXIMUM_SCANS || diagnostics.len() >= MAXIMUM_REPORTED {
            diagnostics.truncate(MAXIMUM_REPORTED);
            diagnostics.push(Diagnostic::too_many(start));
            break;
        }
        match values(line, start, &points, &columns) {
            Ok(values) => scans.push(values),
            Err(found) => diagnostics.extend(found),
        }
    }
    if has_errors(&diagnostics) {
        return Err(diagnostics);
    }
    Ok(scans)
}

/// Which input each word of a comment is, where they are the names of all inputs; outputs may stand behind an arrow.
fn named_columns(comment: &str, points: &[&Point]) -> Option<Vec<usize>> {
    let words = comment.split("->").next().unwrap_or_default().split_whitespace();
    let place = |word: &str| points.iter().position(|it| it.name.eq_ignore_ascii_case(word));
    let columns: Vec<usize> = words.map(place).collect::<Option<_>>()?;
    let different: BTreeSet<usize> = columns.iter().copied().collect();
    (columns.len() == points.len() && different.len() == columns.len()).then_some(columns)
}

/// The stored values of one scan, in the order of the points.
fn values(
    line: &str,
    start: usize,
    points: &[&Point],
    columns: &[usize],
) -> std::result::Result<Vec<u64>, Vec<Diagnostic>> {
    // The lines of another tool may have the outputs behind an arrow.
    let inputs = line.split("->").next().unwrap_or_default();
    let words: Vec<&str> = inputs.split_whitespace().collect();
    if words.len() != points.len() {
        let message =
            format!("a scan has {} inputs, and this line has {}", points.len(), words.len());
        let named: Vec<String> = columns
            .iter()
            .take(MAXIMUM_REPORTED)
            .map(|&column| points[column])
            .map(|point| format!("{} : {}", point.name, point.declared()))
            .collect();
        let help = format!("in this order: {}", named.join(", "));
        let span = start..start + line.len();
        let diagnostic = Diagnostic::error("U0439", message, span);
        return Err(vec![diagnostic.with_help(help)]);
    }
    let mut read = vec![0; words.len()];
    let mut wrong = Vec::new();
    for (word, &column) in words.into_iter().zip(columns) {
        let point = points[column];
        let declared = point.declared();
        let Some(stored) = declared.read(word) else {
            let at = start + (word.as_ptr() as usize - line.as_ptr() as usize);
            let message = format!("invalid {declared} `{word}` for `{}`", point.name);
            let diagnostic = Diagnostic::error("U0439", message, at..at + word.len());
            wrong.push(diagnostic.with_help(expected(&declared)));
            continue;
        };
        if !declared.contains(stored) {
            let at = start + (word.as_ptr() as usize - line.as_ptr() as usize);
            let message = format!("`{word}` for `{}` is outside {declared}", point.name);
            let diagnostic = Diagnostic::error("U0439", message, at..at + word.len());
            wrong.push(diagnostic.with_help("write a value of the range"));
            continue;
        }
        read[column] = stored;
    }
    if wrong.is_empty() { Ok(read) } else { Err(wrong) }
}

fn expected(declared: &Declared) -> String {
    let of = declared.of;
    if let Some(known) = &declared.values {
        let names = known.values.iter().take(MAXIMUM_REPORTED).map(|(name, _)| name.as_str());
        return format!("write one of {}", names.collect::<Vec<_>>().join(", "));
    }
    match of {
        Elementary::Bool => "write 0 or 1".to_owned(),
        Elementary::Real => "write 8 hexadecimal digits, or a number with a point".to_owned(),
        Elementary::Lreal => "write 16 hexadecimal digits, or a number with a point".to_owned(),
        _ if of.is_time() => {
            format!("write a literal such as {}, or nanoseconds", of.text(1_500_000_000))
        }
        _ => {
            let half = if of.is_signed() { of.mask() >> 1 } else { of.mask() };
            let least = if of.is_signed() { -i128::from(half) - 1 } else { 0 };
            format!("write a decimal number from {least} to {half}")
        }
    }
}

impl Subject {
    fn digested(&self, scans: u64) -> Answer {
        let digest = digest(&self.executable, &self.interface, scans);
        let result = Digested {
            program: self.name.clone(),
            period_ns: u64::try_from(self.period.as_nanos()).unwrap_or(u64::MAX),
            scans,
            faults: digest.faults,
            digest: format!("{:016x}", digest.outputs),
        };
        let Digested { program, faults, digest, .. } = &result;
        let text = format!("{program}: digest {digest} of {scans} scans, {faults} program faults");
        Answer::done(text, result)
    }

    fn executed(&self, lines: &[Vec<u64>]) -> Answer {
        let Interface { inputs, outputs } = &self.interface;
        let mut scratch = Scratch::default();
        let mut state = self.executable.initial().to_vec();
        let mut read = vec![0; inputs.width().div_ceil(64)];
        let mut driven = vec![0; outputs.width().div_ceil(64)];
        let mut text = String::new();
        let mut scans = Vec::new();
        let mut fault = None;
        for values in lines {
            for (point, value) in declared(inputs).zip(values) {
                point.set(&mut read, *value);
            }
            self.executable.step(&mut scratch, &mut state, &read, &mut driven);
            let _ = writeln!(text, "{} -> {}", written(inputs, &read), written(outputs, &driven));
            let found = Fault::read(&state).map(|fault| fault.describe(&self.program));
            if fault.is_none() && found.is_some() {
                fault = found.clone().map(|found| (scans.len() + 1, found));
            }
            scans.push(Scanned {
                inputs: named(inputs, &read),
                outputs: named(outputs, &driven),
                fault: found,
            });
        }
        let signals = |points: &Points| {
            let signals = declared(points)
                .map(|point| Signal { name: point.name.clone(), of: point.declared().to_string() });
            signals.collect()
        };
        let result = Result {
            program: self.name.clone(),
            period_ns: u64::try_from(self.period.as_nanos()).unwrap_or(u64::MAX),
            inputs: signals(inputs),
            outputs: signals(outputs),
            scans,
        };
        let answer = Answer::done(text.trim_end().to_owned(), result);
        match fault {
            None => answer,
            Some((scan, fault)) => {
                let message = format!("program fault in scan {scan}: {fault}");
                answer.and_failure(Status::Failed, "U0440", message)
            }
        }
    }
}

/// The values of an image in the notation of the file.
pub(crate) fn written(points: &Points, image: &[u64]) -> String {
    let values: Vec<String> =
        declared(points).map(|point| point.declared().write(point.get(image))).collect();
    values.join(" ")
}

fn named(points: &Points, image: &[u64]) -> Map<String, Value> {
    let values = declared(points).map(|point| {
        (point.name.clone(), understudy_view::shown(&point.declared(), point.get(image)))
    });
    values.collect()
}
