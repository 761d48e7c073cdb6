//! Whether a controller has what a box needs: yes, no, or not known.
//!
//! Invariant: a criterion that is not decided by figures of the catalogue is [`Verdict::Unknown`] and names what is missing; nothing unknown
//! counts as 0 or as enough. A controller fits when every criterion fits, fails when one fails, and is unknown otherwise.

mod asked;
mod judge;

use std::collections::BTreeMap;

use serde::Serialize;

use crate::controller::{Controller, Family};
use crate::ethernet::{Ethernet, ethernet};
use crate::figures::{FamilyQuantity, Quantity, Statement};
use crate::memory::{Bytes, Memory, memory};
use crate::need::{Need, Terms};
use crate::requirement::Asked;
use judge::Judge;

/// Three-valued; the better is the smaller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Every figure is there, and enough.
    Fits,
    /// Some figure is missing.
    Unknown,
    /// Some figure is not enough.
    DoesNotFit,
}

impl Verdict {
    /// The verdict in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Fits => "fits",
            Self::Unknown => "unknown",
            Self::DoesNotFit => "does not fit",
        }
    }
}

/// A resource that programs on one controller share.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Dimension {
    /// Terminals.
    DigitalInputs,
    /// Terminals.
    DigitalOutputs,
    /// Terminals.
    AnalogInputs,
    /// Terminals.
    AnalogOutputs,
    /// Timers of the program.
    Timers,
    /// Counters of the program.
    Counters,
    /// Bytes for programs.
    ProgramMemory,
    /// Bytes for data.
    DataMemory,
    /// Millionths of the processor's time.
    ScanTime,
}

/// A part of a box that a program takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Load {
    /// Amount that the program takes.
    pub takes: u64,
    /// Usable amount of the controller.
    pub usable: u64,
}

/// One criterion.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// Name of the criterion, such as `digital_inputs`.
    pub criterion: String,
    /// Verdict on the criterion.
    pub verdict: Verdict,
    /// The amount that is needed, where it is one.
    pub need: Option<u64>,
    /// The amount that is there, where it is known.
    pub has: Option<u64>,
    /// Part of what is there that is left, 0 to 1.
    pub margin: Option<f64>,
    /// Message with the numbers, or with the missing figure.
    pub message: String,
    /// Sources of the figures.
    pub sources: Vec<String>,
}

/// Compares a controller with the requirements of a position.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fit {
    /// Verdict on all criteria.
    pub verdict: Verdict,
    /// Findings by criterion.
    pub findings: Vec<Finding>,
    /// An estimate: instructions times the time of an instruction on bits; nothing where that time is not known.
    pub scan_ns: Option<u64>,
    /// Loads of shared resources.
    #[serde(skip)]
    pub loads: BTreeMap<Dimension, Load>,
}

impl Fit {
    /// The smallest margin of its criteria.
    pub fn smallest_margin(&self) -> Option<f64> {
        let margins = self.findings.iter().filter_map(|finding| finding.margin);
        margins.min_by(f64::total_cmp)
    }

    /// The findings with this verdict.
    pub fn with(&self, verdict: Verdict) -> impl Iterator<Item = &Finding> {
        self.findings.iter().filter(move |finding| finding.verdict == verdict)
    }
}

/// Compares a controller with a need.
pub fn fit(controller: &Controller, family: Option<&Family>, need: &Need, terms: &Terms) -> Fit {
    let mut judge = Judge::new(controller, family, terms);
    judge.points(Quantity::DigitalInputs, need.inputs, Dimension::DigitalInputs);
    judge.points(Quantity::DigitalOutputs, need.outputs, Dimension::DigitalOutputs);
    judge.points(Quantity::AnalogIn, need.analog_inputs, Dimension::AnalogInputs);
    judge.points(Quantity::AnalogOut, need.analog_outputs, Dimension::AnalogOutputs);
    let mut scan_ns = None;
    if let Some(program) = &need.program {
        let by_memory = terms.of_family(family, FamilyQuantity::TimersByMemory);
        let by_memory = by_memory.filter(|figure| figure.value > 0);
        let by_memory = by_memory.as_ref().map(|figure| figure.source.as_str());
        judge.count(Quantity::Timers, program.timers, Dimension::Timers, by_memory);
        judge.count(Quantity::Counters, program.counters, Dimension::Counters, by_memory);
        match memory(program, family, terms) {
            Memory::Apart { program, data } => {
                let capacity = Quantity::ProgramMemoryBytes;
                memory_of(&mut judge, capacity, Dimension::ProgramMemory, &program);
                let capacity = Quantity::DataMemoryBytes;
                memory_of(&mut judge, capacity, Dimension::DataMemory, &data);
            }
            Memory::Together(bytes) => {
                let capacity = Quantity::ProgramMemoryBytes;
                memory_of(&mut judge, capacity, Dimension::ProgramMemory, &bytes);
            }
        }
        let instruction = judge.instruction_time();
        scan_ns = instruction.map(|time| time.value.saturating_mul(program.instructions));
        if let Some(within) = need.scan_within {
            judge.scan_time(program.instructions, within);
        }
    }
    if need.ethernet {
        network(&mut judge);
    }
    for requirement in &terms.requirements {
        // The network of a plant asks for Ethernet by itself; once is enough.
        let is_asked = need.ethernet && requirement.asked == Asked::Ethernet;
        if requirement.is_of(need.role) && !is_asked {
            asked::judge(&mut judge, requirement, need);
        }
    }
    let Judge { findings, loads, .. } = judge;
    let verdicts = findings.iter().map(|finding| finding.verdict);
    Fit { verdict: verdicts.max().unwrap_or(Verdict::Fits), findings, scan_ns, loads }
}

fn memory_of(judge: &mut Judge<'_>, capacity: Quantity, dimension: Dimension, bytes: &Bytes) {
    match bytes {
        Bytes::Known { bytes: 0, .. } => {}
        Bytes::Known { bytes, fixed, sources } => {
            judge.memory(capacity, dimension, *bytes, *fixed, sources)
        }
        Bytes::Unknown { missing, units } => {
            let missing: Vec<String> = missing.iter().map(FamilyQuantity::to_string).collect();
            judge.memory_unknown(capacity, &missing.join(", "), *units);
        }
    }
}

fn network(judge: &mut Judge<'_>) {
    let controller = judge.controller;
    let Some(figure) = controller.texts.get(&Statement::CommPorts) else {
        judge.unknown("ethernet", "needs an Ethernet port; its ports are unknown".into());
        return;
    };
    let sources = vec![figure.source.clone()];
    let ports = &figure.value;
    match ethernet(ports) {
        Ethernet::Present => judge.said(
            "ethernet",
            Verdict::Fits,
            format!("has an Ethernet port ({ports})"),
            sources,
        ),
        Ethernet::Absent => judge.said(
            "ethernet",
            Verdict::DoesNotFit,
            format!("needs an Ethernet port and has {ports}"),
            sources,
        ),
        Ethernet::Undecided => judge.said(
            "ethernet",
            Verdict::Unknown,
            format!("needs an Ethernet port; its ports are said to be \"{ports}\""),
            sources,
        ),
    }
}
