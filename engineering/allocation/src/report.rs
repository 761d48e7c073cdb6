//! The plan for people: a page that prints well, a table, and lines on a terminal.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use understudy_text::markup::escaped;

use minijinja::value::Serde;
use minijinja::{Environment, Value, context};
use serde::Serialize;

use crate::allocate::{Allocation, BoxOnPlan, Candidate, Placed};
use crate::bill::bill_text;
use crate::csv::line;
use crate::figures::Quantity;
use crate::fit::{Dimension, Verdict};
use crate::modules::{with_modules, words};
use crate::need::Terms;
use crate::resources::Resources;

const TEMPLATE: &str = include_str!("report/report.html");

/// Candidates of each verdict that are shown on a terminal.
const SHOWN: usize = 5;

/// Data of a report that the caller provides.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Provenance {
    /// Title of the plant or the cluster.
    pub title: String,
    /// Version of the program.
    pub version: String,
    /// Date of the report, as the caller writes it.
    pub date: String,
    /// The command that makes it again.
    pub repeat: String,
    /// Origin of the figures.
    pub catalogue: String,
}

/// The page could not be made.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("U1141: the report cannot be made: {0}")]
pub struct ReportError(String);

/// One self-contained page.
///
/// # Errors
/// The template failed.
pub fn html(
    allocation: &Allocation,
    terms: &Terms,
    provenance: &Provenance,
) -> Result<String, ReportError> {
    let refused = |error: minijinja::Error| ReportError(format!("{error:#}"));
    let mut environment = Environment::new();
    environment.add_filter("percent", percent);
    environment.add_filter("words", |name: String| name.replace('_', " "));
    environment.add_filter("links", links);
    environment.add_filter("price", |hundredths: u64| Quantity::Price.text(hundredths));
    let numbered = sources(allocation);
    let numbers: BTreeMap<String, usize> = numbered.iter().cloned().zip(1..).collect();
    environment.add_filter("cite", move |source: String| {
        // Every source of the plan has its number.
        let number = numbers.get(&source).copied().unwrap_or_default();
        Value::from_safe_string(format!("<a href=\"#source-{number}\">{number}</a>"))
    });
    environment.add_template("report.html", TEMPLATE).map_err(refused)?;
    let template = environment.get_template("report.html").map_err(refused)?;
    let requirements = terms.requirements.iter();
    let requirements: Vec<String> = requirements.map(|asked| asked.text.clone()).collect();
    let assumptions = terms.assumptions.iter();
    let assumptions: Vec<String> =
        assumptions.map(|(quantity, value)| format!("{quantity} = {value}")).collect();
    let chosen: Vec<Option<usize>> =
        allocation.items.iter().map(|item| box_of(allocation, item)).collect();
    template
        .render(context! {
            plan => Value::from(Serde(allocation)),
            chosen => Value::from(Serde(&chosen)),
            programs => Value::from(Serde(&counts(allocation))),
            about => Value::from(Serde(provenance)),
            sources => numbered,
            reserve => terms.reserve_percent,
            expansion => terms.expansion,
            requirements => requirements,
            assumptions => assumptions,
        })
        .map_err(refused)
}

/// Every source that a finding of a controller that may do names, in the order in which they are met.
fn sources(allocation: &Allocation) -> Vec<String> {
    let candidates = allocation.items.iter().flat_map(|item| &item.candidates);
    let findings = candidates
        .filter(|candidate| candidate.fit.verdict == Verdict::Fits)
        .flat_map(|candidate| &candidate.fit.findings);
    let mut seen = BTreeSet::new();
    findings
        .flat_map(|finding| &finding.sources)
        .filter(|source| seen.insert(*source))
        .cloned()
        .collect()
}

/// A part, 0 to 1; what is there is not said to be nothing.
fn percent(part: f64) -> String {
    if part > 0.0 && part < 0.005 {
        "under 1 %".to_owned()
    } else {
        format!("{:.0} %", 100.0 * part)
    }
}

/// An address in a source is a link; all else is text.
fn links(source: String) -> Value {
    let mut html = String::new();
    for (place, word) in source.split(' ').enumerate() {
        if place > 0 {
            html.push(' ');
        }
        let text = escaped(word);
        if word.starts_with("https://") || word.starts_with("http://") {
            let _ = write!(html, "<a href=\"{text}\">{text}</a>");
        } else {
            html.push_str(&text);
        }
    }
    Value::from_safe_string(html)
}

/// Counts of each program by name, in the order of the items; nothing for remote I/Os.
fn counts(allocation: &Allocation) -> Vec<(&str, Vec<(&'static str, u64)>)> {
    let items = allocation.items.iter();
    let programs = items.filter_map(|item| Some((item.name.as_str(), item.program?)));
    let (names, programs): (Vec<&str>, Vec<Resources>) = programs.unzip();
    names.into_iter().zip(Resources::table(&programs)).collect()
}

/// The number of the box that an item is on.
fn box_of(allocation: &Allocation, item: &Placed) -> Option<usize> {
    let mut boxes = allocation.boxes.iter();
    boxes.position(|found| found.items.contains(&item.name))
}

/// A line for every criterion of every candidate.
pub fn csv(allocation: &Allocation) -> String {
    let mut text = line(&[
        "for",
        "role",
        "rank",
        "vendor",
        "model",
        "modules",
        "chosen",
        "verdict",
        "criterion",
        "outcome",
        "need",
        "has",
        "margin",
        "message",
        "sources",
    ]);
    for item in &allocation.items {
        let chosen = box_of(allocation, item).map(|place| &allocation.boxes[place].controller);
        for (rank, candidate) in item.candidates.iter().enumerate() {
            let is_chosen = chosen.is_some_and(|chosen| {
                chosen.vendor == candidate.vendor && chosen.model == candidate.model
            });
            let of_candidate = [
                item.name.clone(),
                item.role.to_string(),
                (rank + 1).to_string(),
                candidate.vendor.clone(),
                candidate.model.clone(),
                words(&candidate.modules),
                if is_chosen { "yes" } else { "no" }.to_owned(),
                candidate.fit.verdict.words().to_owned(),
            ];
            let number = |number: Option<u64>| number.map_or(String::new(), |it| it.to_string());
            for finding in &candidate.fit.findings {
                let mut fields = of_candidate.to_vec();
                fields.push(finding.criterion.clone());
                fields.push(finding.verdict.words().to_owned());
                fields.push(number(finding.need));
                fields.push(number(finding.has));
                let margin = finding.margin.map(|margin| format!("{margin:.4}"));
                fields.push(margin.unwrap_or_default());
                fields.push(finding.message.clone());
                fields.push(finding.sources.join(" ; "));
                text.push_str(&line(&fields));
            }
        }
    }
    text
}

/// Lines on a terminal; `all` shows every candidate, otherwise the first few of each verdict.
pub fn text(allocation: &Allocation, all: bool) -> String {
    let mut text = String::new();
    for item in &allocation.items {
        push_item(&mut text, item, if all { usize::MAX } else { SHOWN });
    }
    for (number, taken) in allocation.boxes.iter().enumerate() {
        push_box(&mut text, number + 1, taken);
    }
    for item in &allocation.items {
        if let Some(why) = &item.left_over {
            let _ = writeln!(text, "no box for {}: {why}", item.name);
        }
    }
    text.push_str(&bill_text(&allocation.bill));
    if !allocation.best {
        text.push_str("a better placement may exist: not every combination was compared\n");
    }
    for remark in &allocation.remarks {
        let _ = writeln!(text, "note: {remark}");
    }
    text
}

fn push_item(text: &mut String, item: &Placed, shown: usize) {
    let twin = item.twin_of.as_ref().map_or(String::new(), |of| format!(", twin of {of}"));
    let _ = write!(text, "{} ({}{twin})", item.name, item.role);
    if let Some(program) = &item.program {
        let _ = write!(
            text,
            ": {} rungs, {} elements, {} instructions, {} timers, {} counters, {} retentive bits",
            program.rungs,
            program.elements(),
            program.instructions,
            program.timers,
            program.counters,
            program.data_bits
        );
    }
    if item.inputs + item.outputs > 0 {
        let _ =
            write!(text, "; {} inputs and {} outputs are wired to it", item.inputs, item.outputs);
    }
    text.push('\n');
    if item.program.is_some() {
        let _ = writeln!(text, "  {}", item.verification.message());
    }
    for verdict in [Verdict::Fits, Verdict::Unknown, Verdict::DoesNotFit] {
        let candidates = item.candidates.iter();
        let of_it: Vec<&Candidate> =
            candidates.filter(|found| found.fit.verdict == verdict).collect();
        if of_it.is_empty() {
            continue;
        }
        let _ = writeln!(text, "  {}: {}", verdict.words(), of_it.len());
        for candidate in of_it.iter().take(shown) {
            push_candidate(text, candidate);
        }
        if of_it.len() > shown {
            let _ = writeln!(text, "    and {} more (--all shows them)", of_it.len() - shown);
        }
    }
    text.push('\n');
}

fn push_candidate(text: &mut String, candidate: &Candidate) {
    let model = with_modules(&candidate.model, &candidate.modules);
    let _ = write!(text, "    {} {model}", candidate.vendor);
    let verdict = candidate.fit.verdict;
    if verdict == Verdict::Fits {
        if let Some(margin) = candidate.fit.smallest_margin() {
            let _ = write!(text, ", smallest margin {:.0} %", 100.0 * margin);
        }
        if let Some(scan) = candidate.fit.scan_ns {
            let _ = write!(text, ", scan about {:.1} us", scan as f64 / 1000.0);
        }
    } else {
        let messages: Vec<String> = candidate
            .fit
            .with(verdict)
            .map(|finding| format!("{}: {}", finding.criterion.replace('_', " "), finding.message))
            .collect();
        let _ = write!(text, "; {}", messages.join("; "));
    }
    text.push('\n');
}

fn push_box(text: &mut String, number: usize, taken: &BoxOnPlan) {
    let model = with_modules(&taken.controller.to_string(), &taken.modules);
    let _ = write!(text, "box {number}: {model} for {}", taken.items.join(", "));
    for part in &taken.taken {
        let percent = percent(part.takes as f64 / part.usable.max(1) as f64);
        let name = dimension_words(part.dimension);
        let _ = write!(text, "; {name} {percent}");
    }
    text.push('\n');
}

fn dimension_words(dimension: Dimension) -> &'static str {
    match dimension {
        Dimension::DigitalInputs => "inputs",
        Dimension::DigitalOutputs => "outputs",
        Dimension::AnalogInputs => "analog inputs",
        Dimension::AnalogOutputs => "analog outputs",
        Dimension::Timers => "timers",
        Dimension::Counters => "counters",
        Dimension::ProgramMemory => "program memory",
        Dimension::DataMemory => "data memory",
        Dimension::ScanTime => "processor time",
    }
}
