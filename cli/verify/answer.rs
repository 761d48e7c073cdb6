//! What was proved, for people and for machines.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use schemars::JsonSchema;
use serde::Serialize;
use understudy_logic::Circuit;
use understudy_verification::program::{Answer as Proof, Bounds, Lamp, OutputFinding, Subject};
use understudy_verification::property::Property;
use understudy_verification::scan_table;
use understudy_verification::symbolic::{Resolved, Signal, Trace};

use crate::answer::{Answer, Status};

/// What `verify` answers.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Verification {
    /// One for each ladder.
    programs: Vec<ProgramAnswer>,
    /// Of a cluster: what the proof of the understudy says.
    understudy: Option<String>,
    /// Whether everything was proved.
    proved: bool,
}

/// One ladder.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct ProgramAnswer {
    name: String,
    /// State bits.
    registers: usize,
    /// For each output whether it can be switched on and off for ever.
    switches: Vec<Switch>,
    /// In the order in which they were asked.
    pub(super) properties: Vec<Finding>,
}

/// One output.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Switch {
    output: String,
    /// `free`, `never-on`, `never-off`, `stuck-on`, `stuck-off` or `undecided`.
    verdict: &'static str,
    /// What an engineer reads.
    message: String,
    scans: Option<Scans>,
}

/// One property.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Finding {
    name: Option<String>,
    /// As it was written.
    property: String,
    /// As a formula of CTL.
    formula: String,
    /// `holds`, `fails` or `undecided`.
    verdict: &'static str,
    /// Why it is undecided.
    message: Option<String>,
    /// A run that shows it.
    scans: Option<Scans>,
}

/// A run from the first scan on.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Scans {
    /// How many.
    count: usize,
    /// For each signal that matters its value in each scan.
    signals: BTreeMap<String, Vec<u8>>,
    /// After the last scan all goes on as from this one.
    again_from: Option<usize>,
    #[serde(skip)]
    table: String,
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
            again_from: trace.again_from,
            table: scan_table(circuit, trace),
        }
    }
}

impl ProgramAnswer {
    /// With what is asked of every ladder, and no property yet.
    pub(super) fn of(subject: &Subject, bounds: Bounds) -> Self {
        let circuit = subject.circuit();
        let switches = subject.switches(bounds).into_iter();
        Self {
            name: circuit.name().to_owned(),
            registers: circuit.registers().len(),
            switches: switches
                .map(|(signal, finding)| switch(circuit, signal, &finding))
                .collect(),
            properties: Vec::new(),
        }
    }

    fn proved(&self) -> bool {
        let free = self.switches.iter().all(|switch| switch.verdict == "free");
        free && self
            .properties
            .iter()
            .all(|finding| finding.verdict == "holds")
    }

    fn text(&self) -> String {
        let mut text = format!("{}, {} state bits\n", self.name, self.registers);
        for switch in &self.switches {
            let _ = writeln!(text, "  {:<9} {}", word(switch.verdict), switch.message);
            push_table(&mut text, switch.scans.as_ref());
        }
        for finding in &self.properties {
            let name = finding.name.as_ref().map(|name| format!("{name}: "));
            let name = name.unwrap_or_default();
            let _ = write!(
                text,
                "  {:<9} {name}{}",
                word(finding.verdict),
                finding.property
            );
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

fn word(verdict: &str) -> &str {
    match verdict {
        "holds" | "free" => "proved",
        "undecided" => "undecided",
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
        let named = formula.map(&|signal: &Signal| Some(signal.name(circuit).to_owned()));
        let scans = |trace: Option<Trace>| trace.map(|trace| Scans::of(circuit, &trace));
        let (verdict, scans, message) = match proof {
            Proof::Holds(trace) => ("holds", scans(trace), None),
            Proof::Fails(trace) => ("fails", scans(trace), None),
            Proof::Undecided(error) => ("undecided", None, Some(error.to_string())),
        };
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
        OutputFinding::Free => (
            "free",
            format!("{output} can be switched on and off, again and again"),
            None,
        ),
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
    Switch {
        output,
        verdict,
        message,
        scans,
    }
}

pub(super) fn of_programs(
    programs: Vec<ProgramAnswer>,
    understudy: Option<Result<String, String>>,
) -> Answer {
    let right =
        programs.iter().all(ProgramAnswer::proved) && understudy.as_ref().is_none_or(Result::is_ok);
    let texts: Vec<String> = programs.iter().map(ProgramAnswer::text).collect();
    let mut text = texts.join("\n");
    if let Some(understudy) = &understudy {
        let (word, message) = match understudy {
            Ok(message) => ("proved", message),
            Err(message) => ("FAILS", message),
        };
        let _ = writeln!(text, "\n{word}: {message}");
    }
    let status = if right { Status::Done } else { Status::Failed };
    let result = Verification {
        programs,
        understudy: understudy.map(|proof| proof.unwrap_or_else(|message| message)),
        proved: right,
    };
    Answer::done(text.trim_end().to_owned(), result).with_status(status)
}
