//! Runs drawn into their ladder, scan by scan: what is read is what the interpreter did on the inputs that were found.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::time::Duration;
use understudy_text::markup::escaped;

use understudy_ladder::{Evaluation, Interpreter, LowerError, Program, Rung, draw_svg_rungs};
use understudy_logic::Circuit;

use crate::symbolic::Trace;
use crate::table::{Part, parts, scan_table};

/// Scans of one run that are drawn, those without a change folded; of a longer run, the first and the last ones.
pub const MAXIMUM_DRAWN: usize = 60;

/// A run that a page shows.
#[derive(Debug, Clone, Copy)]
pub struct Shown<'a> {
    /// What it shows, such as the property.
    pub title: &'a str,
    /// What was found out about that.
    pub verdict: &'a str,
    /// The run.
    pub trace: &'a Trace,
}

/// A page in HTML with every run: its table, and the rungs that its signals depend on, with power in each scan.
///
/// `circuit` is that of which the traces are, lowered from `program` with `period`.
///
/// # Errors
/// As [`Interpreter::new`].
pub fn draw_runs(
    program: &Program,
    period: Duration,
    circuit: &Circuit,
    runs: &[Shown<'_>],
) -> Result<String, LowerError> {
    let mut body = String::new();
    for run in runs {
        let _ = writeln!(
            body,
            "<section>\n<h2>{}</h2>\n<p>{}</p>\n<pre>{}</pre>",
            escaped(run.title),
            escaped(run.verdict),
            escaped(&scan_table(circuit, run.trace))
        );
        let names = run.trace.signals.iter().map(|signal| signal.name(circuit));
        let rungs = rungs_behind(program, names);
        let evaluations = evaluations(program, period, run.trace)?;
        let last = evaluations.len().saturating_sub(1);
        let parts = parts(run.trace);
        let half = MAXIMUM_DRAWN / 2;
        for (place, part) in parts.iter().enumerate() {
            if parts.len() > MAXIMUM_DRAWN && (half..parts.len() - half).contains(&place) {
                if place == half {
                    body.push_str("<p>What comes here is not drawn.</p>\n");
                }
                continue;
            }
            let scan = match *part {
                Part::Scan(scan) => scan,
                Part::Again(..) => {
                    let _ = writeln!(body, "<h3>{}</h3>", part.told().unwrap_or_default());
                    continue;
                }
            };
            let evaluation = &evaluations[scan];
            let again = match run.trace.again_from {
                Some(again) if scan == last => format!("; all goes on as from scan {again}"),
                _ => String::new(),
            };
            let _ = writeln!(
                body,
                "<h3>scan {scan}{again}</h3>\n<div class=\"scroll\">{}</div>",
                draw_svg_rungs(program, &rungs, Some(evaluation))
            );
        }
        body.push_str("</section>\n");
    }
    if runs.is_empty() {
        body.push_str("<p>There is no run to show.</p>\n");
    }
    Ok(format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>Runs of {name}</title>\n<style>\n{STYLE}\n</style>\n</head>\n\
         <body>\n<main>\n<h1>Runs of {name}</h1>\n<p class=\"soft\">Thick lines have power. A filled contact or coil is closed, or on. Values stand behind the \
         names, as they were in that place of the scan.</p>\n{body}</main>\n</body>\n</html>\n",
        name = escaped(&program.name)
    ))
}

const STYLE: &str = "\
:root{color-scheme:light dark;--paper:#fff;--ink:#1c2733;--soft:#667788;--line:#d5dde5}
@media(prefers-color-scheme:dark){:root{--paper:#12181f;--ink:#e4eaf0;--soft:#93a3b3;--line:#2c3742}}
body{background:var(--paper);color:var(--ink);font:15px/1.5 system-ui,sans-serif;margin:2rem auto;max-width:76rem;padding:0 1rem}
section{border-top:1px solid var(--line);margin-top:2rem}
.soft{color:var(--soft)}
.scroll,pre{overflow-x:auto}
pre{font:13px ui-monospace,'DejaVu Sans Mono',monospace}
h3{font-size:1rem;margin:1.5rem 0 0}";

/// Each scan of the run as the interpreter does it.
fn evaluations(
    program: &Program,
    period: Duration,
    trace: &Trace,
) -> Result<Vec<Evaluation>, LowerError> {
    let mut interpreter = Interpreter::new(program, period)?;
    let scans = trace.scans.iter();
    Ok(scans.map(|scan| interpreter.scan_observed(&scan.inputs)).collect())
}

/// The rungs on which signals depend, now and later, by what they write and read; by their place.
fn rungs_behind<'a>(program: &Program, names: impl IntoIterator<Item = &'a str>) -> Vec<usize> {
    let mut wanted: BTreeSet<String> = names.into_iter().map(stem).collect();
    let mut rungs = BTreeSet::new();
    loop {
        let before = rungs.len();
        for (place, rung) in program.rungs.iter().enumerate() {
            let (reads, writes) = names_of(rung);
            if !rungs.contains(&place) && writes.iter().any(|name| wanted.contains(name)) {
                rungs.insert(place);
                wanted.extend(reads);
            }
        }
        if rungs.len() == before {
            return rungs.into_iter().collect();
        }
    }
}

/// A pin belongs to its block.
fn stem(name: &str) -> String {
    name.split('.').next().unwrap_or(name).to_owned()
}

/// What a rung reads, and what it writes.
fn names_of(rung: &Rung) -> (Vec<String>, Vec<String>) {
    let (read, written) = rung.names();
    let written = written.into_iter().map(str::to_owned);
    (read.into_iter().map(stem).collect(), written.collect())
}
