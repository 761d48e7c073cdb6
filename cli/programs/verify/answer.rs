//! Results of `verify` as text and JSON.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use schemars::JsonSchema;
use serde::Serialize;
use understudy_logic::Circuit;
use understudy_verification::numbers::{Answer as NumbersProof, Driven, Model, Run};
use understudy_verification::program::{
    Answer as Proof, Bounds, Lamp, OutputFinding, Remarks, Subject,
};
use understudy_verification::property::Property;
use understudy_verification::symbolic::{Resolved, Signal, Trace};
use understudy_verification::{Shown, scan_table};

use crate::answer::{Answer, Status};
use crate::patience::Resources;

/// Result of `verify`.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Verification {
    /// One entry for each program; of a cluster with given properties, one for all programs together.
    programs: Vec<ProgramAnswer>,
    /// Result of the proof of a cluster's understudy.
    understudy: Option<String>,
    /// `proved`, `fails`, `undecided`, or `left-out` where no parity controller is generated, so that there is nothing to compare.
    understudy_verdict: Option<&'static str>,
    /// Whether everything was proved.
    proved: bool,
    /// Page of runs.
    page: Option<String>,
    /// Scenario in which a property of a cluster fails, with `--scenario`.
    file: Option<String>,
    /// What the proofs took, with `--resources`.
    resources: Option<Resources>,
}

/// Whether the understudy of a cluster is the sum of its members, and what was compared or was in the way.
pub(super) enum UnderstudyProof {
    Proved(String),
    Fails(String),
    Undecided(String),
    /// There is no generated controller.
    LeftOut(String),
}

impl UnderstudyProof {
    /// The verdict in JSON, the word in the text, and what was found.
    fn told(self) -> (&'static str, &'static str, String) {
        match self {
            Self::Proved(message) => ("proved", "proved", message),
            Self::Fails(message) => ("fails", "FAILS", message),
            Self::Undecided(message) => ("undecided", "undecided", message),
            Self::LeftOut(message) => ("left-out", "LEFT OUT", message),
        }
    }
}

/// Results for one program.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct ProgramAnswer {
    name: String,
    /// Number of state bits.
    registers: usize,
    /// Inputs that are assumed to be finite numbers.
    finite_inputs: Vec<String>,
    /// Inputs that are 1 in the first scan of a warm start, of programs with retentive variables.
    restarted_by: Vec<String>,
    /// Whether it is assumed that no program starts again, from its initial state, while another one continues: of several programs together.
    pub(super) starts_together: bool,
    /// For each output of a ladder program, whether it can always be switched on and off again.
    switches: Vec<Switch>,
    /// Remarks on the order and the effect of its rungs; they do not affect the verdict.
    remarks: Vec<RemarkAnswer>,
    /// Number of questions left undecided within the bounds.
    undecided_remarks: usize,
    /// Requested properties, in their order.
    pub(super) properties: Vec<Finding>,
}

/// Remark on suspicious rungs.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct RemarkAnswer {
    /// Stable code, such as `U0445`.
    code: &'static str,
    /// Description.
    message: String,
    /// Run that ends with it.
    scans: Option<Scans>,
}

/// Result for one output.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Switch {
    output: String,
    /// `free`, `never-on`, `never-off`, `stuck-on`, `stuck-off` or `undecided`.
    verdict: &'static str,
    /// Description.
    message: String,
    scans: Option<Scans>,
}

/// Result for one property.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Finding {
    name: Option<String>,
    /// The property as written.
    property: String,
    /// The property as a CTL formula.
    formula: String,
    /// `holds`, `fails` or `undecided`.
    verdict: &'static str,
    /// Reason why it is undecided, or why no program can keep it.
    message: Option<String>,
    /// Counterexample or witness.
    scans: Option<Scans>,
}

/// Run from the first scan on.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Scans {
    /// Number of scans.
    count: usize,
    /// Values of each relevant signal by scan.
    signals: BTreeMap<String, Vec<u8>>,
    /// Numbers by scan, as IEC 61131-3 writes them.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    numbers: BTreeMap<String, Vec<String>>,
    /// Scan to which the run returns after the last one.
    again_from: Option<usize>,
    #[serde(skip)]
    table: String,
    #[serde(skip)]
    trace: Trace,
    #[serde(skip)]
    inputs: Vec<Driven>,
}

impl Scans {
    fn of(circuit: &Circuit, trace: &Trace) -> Self {
        let signals = trace.signals.iter().map(|&signal| {
            let values = trace.values(signal).map(u8::from).collect();
            (signal.name(circuit).to_owned(), values)
        });
        Self {
            count: trace.scans.len(),
            signals: signals.collect(),
            numbers: BTreeMap::new(),
            again_from: trace.again_from,
            table: scan_table(circuit, trace),
            trace: trace.clone(),
            inputs: Vec::new(),
        }
    }

    /// A run with numbers.
    fn with_numbers(circuit: &Circuit, run: &Run) -> Self {
        let mut scans = Self::of(circuit, &run.trace);
        for row in &run.numbers {
            let _ = writeln!(scans.table, "{}: {}", row.name, values(&row.values));
            scans.numbers.insert(row.name.clone(), row.values.clone());
        }
        scans.inputs.clone_from(&run.inputs);
        scans
    }
}

/// Values of a number from scan 0 on, the last ones where there are many.
fn values(values: &[String]) -> String {
    const SHOWN: usize = 8;
    let hidden = values.len().saturating_sub(SHOWN);
    let shown = values[hidden..].join(", ");
    match hidden {
        0 => shown,
        _ => format!("…, {shown}"),
    }
}

impl ProgramAnswer {
    /// A program with numbers, or several together, without results.
    pub(super) fn of_numbers(name: &str, model: &Model) -> Self {
        Self {
            name: name.to_owned(),
            registers: model.circuit().registers().len(),
            finite_inputs: model.finite_inputs().map(str::to_owned).collect(),
            restarted_by: model.restarting().map(str::to_owned).collect(),
            starts_together: false,
            switches: Vec::new(),
            remarks: Vec::new(),
            undecided_remarks: 0,
            properties: Vec::new(),
        }
    }

    /// Results of the standard questions, without properties.
    pub(super) fn of(subject: &Subject, bounds: Bounds<'_>, remarks: &Remarks) -> Self {
        let circuit = subject.circuit();
        let switches = subject.switches(bounds).into_iter();
        let remarked = remarks.found.iter().map(|remark| RemarkAnswer {
            code: remark.diagnostic.code,
            message: remark.diagnostic.message.clone(),
            scans: remark.trace.as_ref().map(|trace| Scans::of(circuit, trace)),
        });
        Self {
            name: circuit.name().to_owned(),
            registers: circuit.registers().len(),
            finite_inputs: Vec::new(),
            restarted_by: subject.restarting().map(str::to_owned).collect(),
            starts_together: false,
            switches: switches.map(|(signal, finding)| switch(circuit, signal, &finding)).collect(),
            remarks: remarked.collect(),
            undecided_remarks: remarks.undecided,
            properties: Vec::new(),
        }
    }

    /// Adds what was found about the outputs.
    pub(super) fn switched(&mut self, circuit: &Circuit, found: &[(Signal, OutputFinding)]) {
        let found = found.iter().map(|(signal, finding)| switch(circuit, *signal, finding));
        self.switches.extend(found);
    }

    /// All counterexamples and witnesses with their titles.
    pub(super) fn runs(&self) -> Vec<Shown<'_>> {
        let switches =
            self.switches.iter().map(|switch| (&switch.message, switch.verdict, &switch.scans));
        let properties = self
            .properties
            .iter()
            .map(|finding| (&finding.property, finding.verdict, &finding.scans));
        let remarks = self.remarks.iter().map(|remark| (&remark.message, "remark", &remark.scans));
        let shown = switches.chain(remarks).chain(properties);
        let shown = shown.filter_map(|(title, verdict, scans)| {
            let trace = &scans.as_ref()?.trace;
            Some(Shown { title, verdict: word(verdict), trace })
        });
        shown.collect()
    }

    fn proved(&self) -> bool {
        let free = self.switches.iter().all(|switch| switch.verdict == "free");
        free && self.properties.iter().all(|finding| finding.verdict == "holds")
    }

    fn text(&self) -> String {
        let mut text = format!("{}, {} state bits\n", self.name, self.registers);
        for switch in &self.switches {
            let _ = writeln!(text, "  {:<9} {}", word(switch.verdict), switch.message);
            push_table(&mut text, switch.scans.as_ref());
        }
        for remark in &self.remarks {
            let _ = writeln!(text, "  {:<9} {} {}", word("remark"), remark.code, remark.message);
            push_table(&mut text, remark.scans.as_ref());
        }
        if self.undecided_remarks > 0 {
            let _ = writeln!(
                text,
                "  {:<9} {} questions on the order and the effect of rungs",
                "undecided", self.undecided_remarks
            );
        }
        if !self.finite_inputs.is_empty() {
            let names = listed(&self.finite_inputs);
            let _ = writeln!(text, "  {:<9} finite: {names}", "assumed");
        }
        if !self.restarted_by.is_empty() {
            let names = listed(&self.restarted_by);
            let what = "the power may return in any scan, as a warm start";
            let _ = writeln!(text, "  {:<9} {what}: {names}", "assumed");
        }
        if self.starts_together {
            let what = "no program starts cold while another one continues";
            let _ = writeln!(text, "  {:<9} {what}", "assumed");
        }
        for finding in &self.properties {
            let name = finding.name.as_ref().map(|name| format!("{name}: "));
            let name = name.unwrap_or_default();
            let _ = write!(text, "  {:<9} {name}{}", word(finding.verdict), finding.property);
            if finding.formula != finding.property {
                let _ = write!(text, "   [{}]", finding.formula);
            }
            text.push('\n');
            if let Some(message) = &finding.message {
                let _ = writeln!(text, "            {message}");
            }
            push_table(&mut text, finding.scans.as_ref());
        }
        text
    }
}

/// The first of some names and how many more there are.
fn listed(names: &[String]) -> String {
    const SHOWN: usize = 5;
    let shown: Vec<String> = names.iter().take(SHOWN).map(|name| format!("`{name}`")).collect();
    match names.len().saturating_sub(SHOWN) {
        0 => shown.join(", "),
        more => format!("{} and {more} more", shown.join(", ")),
    }
}

fn word(verdict: &str) -> &str {
    match verdict {
        "holds" | "free" => "proved",
        "undecided" => "undecided",
        "remark" => "remark",
        _ => "FAILS",
    }
}

fn push_table(text: &mut String, scans: Option<&Scans>) {
    for line in scans.map(|scans| scans.table.lines()).into_iter().flatten() {
        let _ = writeln!(text, "            {line}");
    }
}

impl Finding {
    pub(super) fn new(
        circuit: &Circuit,
        property: &Property,
        formula: &Resolved,
        proof: Proof,
    ) -> Self {
        let scans = |trace: Option<Trace>| trace.map(|trace| Scans::of(circuit, &trace));
        let (verdict, scans, message) = match proof {
            Proof::Holds(trace) => ("holds", scans(trace), None),
            Proof::Fails(trace) => ("fails", scans(trace), None),
            Proof::Undecided(error) => ("undecided", None, Some(error.to_string())),
        };
        Self::told(circuit, property, formula, verdict, message, scans)
    }

    /// The result for a property of programs with numbers.
    pub(super) fn of_numbers(
        circuit: &Circuit,
        property: &Property,
        formula: &Resolved,
        proof: NumbersProof,
    ) -> Self {
        let scans = |run: Option<Run>| run.map(|run| Scans::with_numbers(circuit, &run));
        let (verdict, scans, message) = match proof {
            NumbersProof::Holds(run) => ("holds", scans(run), None),
            NumbersProof::Fails(run) => ("fails", scans(run), None),
            NumbersProof::Undecided(reason) => ("undecided", None, Some(reason)),
        };
        Self::told(circuit, property, formula, verdict, message, scans)
    }

    /// All inputs of the run in which it fails, and the scan to which it returns.
    pub(super) fn counterexample(&self) -> Option<(&[Driven], Option<usize>)> {
        let scans = self.scans.as_ref().filter(|_| self.verdict == "fails")?;
        Some((scans.inputs.as_slice(), scans.again_from))
    }

    /// Says of a property that fails that it is about inputs alone, where it is.
    pub(super) fn of_inputs(mut self, is_of_inputs: bool) -> Self {
        if is_of_inputs && self.verdict == "fails" {
            let reason = "it is about inputs alone, and no program keeps it; --assume states what the field keeps";
            self.message = Some(reason.to_owned());
        }
        self
    }

    fn told(
        circuit: &Circuit,
        property: &Property,
        formula: &Resolved,
        verdict: &'static str,
        message: Option<String>,
        scans: Option<Scans>,
    ) -> Self {
        let named = formula.map(&|signal: &Signal| Some(signal.name(circuit).to_owned()));
        Self {
            name: property.name.clone(),
            property: property.text.clone(),
            formula: named.map(|formula| formula.to_string()).unwrap_or_default(),
            verdict,
            message,
            scans,
        }
    }
}

fn switch(circuit: &Circuit, signal: Signal, finding: &OutputFinding) -> Switch {
    let output = signal.name(circuit).to_owned();
    let lamp = |lamp: Lamp, on, off| match lamp {
        Lamp::On => on,
        Lamp::Off => off,
    };
    let (verdict, message, scans) = match finding {
        OutputFinding::Free => {
            ("free", format!("{output} can always be switched on and off again"), None)
        }
        OutputFinding::Never(which) => (
            lamp(*which, "never-on", "never-off"),
            format!("{output} is never {}", lamp(*which, "on", "off")),
            None,
        ),
        OutputFinding::Stuck(which, trace) => (
            lamp(*which, "stuck-off", "stuck-on"),
            format!(
                "after these scans {output} can never be switched {} again",
                lamp(*which, "on", "off")
            ),
            Some(Scans::of(circuit, trace)),
        ),
        OutputFinding::Undecided(message) => ("undecided", format!("{output}: {message}"), None),
    };
    Switch { output, verdict, message, scans }
}

pub(super) fn of_programs(
    programs: Vec<ProgramAnswer>,
    understudy: Option<UnderstudyProof>,
    page: Option<String>,
    resources: Option<Resources>,
) -> Answer {
    let understudy = understudy.map(UnderstudyProof::told);
    let understudy_verdict = understudy.as_ref().map(|(verdict, ..)| *verdict);
    let right = programs.iter().all(ProgramAnswer::proved)
        && !matches!(understudy_verdict, Some("fails" | "undecided"));
    let texts: Vec<String> = programs.iter().map(ProgramAnswer::text).collect();
    let mut text = texts.join("\n");
    if let Some((_, word, message)) = &understudy {
        let _ = writeln!(text, "\n{word}: {message}");
    }
    if let Some(page) = &page {
        let _ = writeln!(text, "\nruns are drawn in {page}");
    }
    if let Some(resources) = &resources {
        let _ = writeln!(text, "\nresources: {resources}");
    }
    let status = if right { Status::Done } else { Status::Failed };
    let result = Verification {
        programs,
        understudy: understudy.map(|(.., message)| message),
        understudy_verdict,
        proved: right,
        page,
        file: None,
        resources,
    };
    Answer::done(text.trim_end().to_owned(), result).with_status(status)
}
