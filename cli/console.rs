//! All printing: answers on standard output, diagnostics and progress on standard error.

use std::io::{self, IsTerminal, Write};
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

use codespan_reporting::diagnostic::Diagnostic as Drawn;
use codespan_reporting::term::termcolor::{
    BufferedStandardStream, ColorChoice, ColorSpec, WriteColor,
};
use codespan_reporting::term::{self, Config};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use understudy_interchange::is_part;
use understudy_processes::Progress;
use understudy_text::{Diagnostic, Lines, Report, Severity, visible, visible_json};

use crate::answer::{Answer, Envelope, Status, shown};
use crate::excerpt::Shown;
use crate::files::listed_by_check;

/// Columns of the terminal on standard output; `None` where that is a file or a pipe.
pub(crate) fn terminal_columns() -> Option<usize> {
    let size = ratatui::crossterm::terminal::size();
    let (columns, _) = size.ok().filter(|_| io::stdout().is_terminal())?;
    Some(usize::from(columns))
}

/// Output of a command.
pub struct Console {
    json: bool,
    progress: Option<ProgressBar>,
    /// Whether the cycles of the scenario have begun.
    synchronised: bool,
    said: String,
}

impl Console {
    /// Prints text and progress, or one JSON document at the end.
    pub fn new(json: bool) -> Self {
        Self { json, progress: None, synchronised: false, said: String::new() }
    }

    /// Whether the answer is JSON.
    pub(crate) fn is_json(&self) -> bool {
        self.json
    }

    /// Prints the answer and returns the exit status.
    pub fn finish(self, command: &str, mut answer: Answer) -> ExitCode {
        answer.bound();
        // The reader may have closed the pipe.
        let _ = if self.json { print_json(command, &answer) } else { print_text(&answer) };
        ExitCode::from(answer.status.code())
    }

    /// Shows the progress of a run: a bar on a terminal, otherwise lines; nothing with `--json`.
    pub(crate) fn show(&mut self, progress: &Progress) {
        if self.json {
            return;
        }
        let bar = io::stderr().is_terminal();
        match progress {
            Progress::Cycle { cycle, cycles } if bar => {
                let words = "cycle {pos} of {len}, {eta} left";
                let bar = self.progress.get_or_insert_with(|| progress_bar(*cycles, words));
                bar.set_position(*cycle);
            }
            Progress::Failure { done, of } if bar => {
                let words = "failure {pos} of {len}, {eta} left";
                let bar = self.progress.get_or_insert_with(|| progress_bar(*of, words));
                bar.set_position(*done);
            }
            Progress::Failure { done, of } => {
                // About ten lines in total.
                if done == of || done % of.div_ceil(10).max(1) == 0 {
                    self.say(&format!("{done} of {of} failures"));
                }
            }
            Progress::Cycle { .. } if self.synchronised => {}
            Progress::Cycle { .. } => {
                self.synchronised = true;
                self.say("synchronised: the cycles of the scenario begin");
            }
            Progress::Starting { members, .. } => {
                self.say(&format!("starting {members} processes"));
            }
            Progress::ComingIntoStep { .. } => {
                self.say("waiting until all members are synchronised")
            }
            Progress::Step { cycle, what } => self.say(&format!("cycle {cycle:>5}: {what}")),
            Progress::Ending => {
                if let Some(bar) = self.progress.take() {
                    bar.finish_and_clear();
                }
            }
        }
    }

    /// Prints a line while the command runs; nothing with `--json`.
    pub fn note(&mut self, line: &str) {
        if !self.json {
            self.say(line);
        }
    }

    /// Progress bar of `length` steps with the template `words`; hidden without a terminal.
    pub(crate) fn bar(&self, length: u64, words: &str) -> ProgressBar {
        if self.json || !io::stderr().is_terminal() {
            return ProgressBar::hidden();
        }
        progress_bar(length, words)
    }

    /// Prints a line unless it repeats the last one.
    fn say(&mut self, line: &str) {
        if self.said == line {
            return;
        }
        line.clone_into(&mut self.said);
        let line = visible(line);
        match &self.progress {
            Some(bar) => bar.println(line.as_ref()),
            None => {
                let _ = writeln!(io::stderr(), "{line}");
            }
        }
    }
}

fn progress_bar(length: u64, words: &str) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::stderr_with_hz(10));
    if let Ok(style) = ProgressStyle::with_template(&format!("{{bar:40}} {words}")) {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

fn print_json(command: &str, answer: &Answer) -> io::Result<()> {
    let text = serde_json::to_string(&Envelope::new(command, answer))?;
    writeln!(io::stdout(), "{}", visible_json(&text))
}

fn print_text(answer: &Answer) -> io::Result<()> {
    let has_errors = answer.reports.iter().any(Report::has_errors);
    if answer.counts_warnings && !has_errors {
        print_count(answer)?;
    } else {
        for (report, found) in shown(&answer.reports) {
            print_report(report, &found)?;
        }
    }
    let mut output = io::stdout().lock();
    output.write_all(visible(&answer.text).as_bytes())?;
    if !answer.text.is_empty() && !answer.text.ends_with('\n') {
        writeln!(output)?;
    }
    output.flush()?;
    let mut errors = io::stderr().lock();
    for failure in &answer.failures {
        // Messages of other crates begin with their code.
        let message = visible(without_code(&failure.message));
        writeln!(errors, "error[{}]: {message}", failure.code)?;
    }
    if answer.status == Status::Done {
        for (count, line) in answer.about.next.iter().enumerate() {
            let head = if count == 0 { "next:" } else { "     " };
            writeln!(errors, "{head} {}", visible(line))?;
        }
    }
    if let Some(failure) = answer.failures.first()
        && errors.is_terminal()
    {
        writeln!(errors, "`understudy explain {}` describes it", failure.code)?;
    }
    Ok(())
}

/// Removes the code at the beginning of a message.
fn without_code(message: &str) -> &str {
    let Some((code, rest)) = message.split_once(": ") else {
        return message;
    };
    let digits = code.strip_prefix('U').unwrap_or_default();
    if digits.len() == 4 && digits.bytes().all(|byte| byte.is_ascii_digit()) {
        rest
    } else {
        message
    }
}

/// Prints the number of the warnings that `check` lists of the same files, and that command. The others depend on what this command
/// was asked, or on what it wrote: they are printed.
fn print_count(answer: &Answer) -> io::Result<()> {
    let (counted, own) = counted(answer);
    for (report, found) in shown(&own) {
        print_report(report, &found)?;
    }
    let count: usize = counted.iter().map(|(_, count)| count).sum();
    let (warnings, them) = match count {
        0 => return Ok(()),
        1 => ("1 warning".to_owned(), "it"),
        _ => (format!("{count} warnings"), "them"),
    };
    let files: Vec<&str> = counted.iter().map(|(file, _)| file.as_str()).collect();
    let files = files.join(" ");
    let files = visible(&files);
    writeln!(io::stderr(), "{warnings}; `understudy check {files}` lists {them}")
}

/// The files of which `check` lists warnings of an answer, with their number, and the reports of all other ones.
fn counted(answer: &Answer) -> (Vec<(String, usize)>, Vec<Report>) {
    let mut left: Vec<Report> = answer.reports.clone();
    for report in &mut left {
        report.diagnostics.retain(|found| !answer.about.told.contains(found));
    }
    left.retain(|report| !report.diagnostics.is_empty());
    // A file that names the others lists theirs.
    let is_naming = |name: &&String| name.ends_with(".toml");
    let all = || answer.reports.iter().map(|report| &report.name);
    // `check` reads several files of a TwinCAT project as one.
    let parts = all().filter(|name| is_part(name)).count();
    let is_alone = |name: &&String| parts == 1 || !is_part(name);
    let named = all().filter(is_naming).chain(all().filter(is_alone));
    let mut counted: Vec<(String, usize)> = Vec::new();
    for name in named {
        if left.is_empty() || counted.iter().any(|(known, _)| known == name) {
            continue;
        }
        let listed = listed_by_check(Path::new(name));
        let mut count = 0;
        for report in &mut left {
            let same = |known: &&Report| known.name == report.name;
            let Some(known) = listed.iter().find(same) else {
                continue;
            };
            let before = report.diagnostics.len();
            report.diagnostics.retain(|found| !known.diagnostics.contains(found));
            count += before - report.diagnostics.len();
        }
        left.retain(|report| !report.diagnostics.is_empty());
        if count > 0 {
            counted.push((name.clone(), count));
        }
    }
    (counted, left)
}

/// Prints all findings of a file at once.
fn print_report(report: &Report, found: &[Diagnostic]) -> io::Result<()> {
    if found.is_empty() {
        return Ok(());
    }
    let choice = if io::stderr().is_terminal() { ColorChoice::Auto } else { ColorChoice::Never };
    let lines = Lines::new(&report.text);
    let config = Config::default();
    let mut errors = VisibleStream(BufferedStandardStream::stderr(choice));
    for diagnostic in found {
        let shown = Shown::new(&report.name, &report.text, &lines, diagnostic);
        let drawn = match diagnostic.severity {
            Severity::Error => Drawn::error(),
            Severity::Warning => Drawn::warning(),
        };
        let help = diagnostic.help.iter().map(|help| format!("help: {help}"));
        let drawn = drawn
            .with_code(diagnostic.code)
            .with_message(&diagnostic.message)
            .with_labels(shown.labels)
            .with_notes(shown.notes.into_iter().chain(help).collect());
        term::emit_to_write_style(&mut errors, &config, &shown.excerpt, &drawn)
            .map_err(io::Error::other)?;
    }
    errors.flush()
}

/// A stream with colours whose text is made [`visible`].
struct VisibleStream(BufferedStandardStream);

impl Write for VisibleStream {
    /// Takes whole texts, as formatting writes them.
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.write_all(visible(&String::from_utf8_lossy(bytes)).as_bytes())?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

impl WriteColor for VisibleStream {
    fn supports_color(&self) -> bool {
        self.0.supports_color()
    }

    fn set_color(&mut self, colour: &ColorSpec) -> io::Result<()> {
        self.0.set_color(colour)
    }

    fn reset(&mut self) -> io::Result<()> {
        self.0.reset()
    }
}
