//! Files, scans, and the tools of the tests.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use understudy_diagnostic::{Report, Severity};
use understudy_interchange::plcopen::{Reading, read};
use understudy_ladder::Program;
use understudy_logic::{Circuit, Scan, Scratch};

use crate::random::Dice;

pub(crate) const PERIOD: Duration = Duration::from_millis(100);

/// Public files of other people, where they are at hand: some may be read and not copied.
pub(crate) fn data(path: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("UNDERSTUDY_DATA")?;
    Some(Path::new(&folder).join(path)).filter(|path| path.exists())
}

/// Every finding of a reading as a line.
pub(crate) fn findings(text: &str, reading: &Reading) -> Vec<String> {
    let report = Report {
        name: String::new(),
        text: text.to_owned(),
        diagnostics: Vec::new(),
    };
    let line = |found: &understudy_diagnostic::Diagnostic| {
        let severity = match found.severity {
            Severity::Error => "error",
            Severity::Warning => "warning",
        };
        let place = report.line_and_column(found.span.start);
        format!("{place} {severity} {} {}", found.code, found.message)
    };
    reading.diagnostics.iter().map(line).collect()
}

/// The program of a file that has nothing wrong.
pub(crate) fn program(text: &str) -> Program {
    let reading = read(text, None);
    let found = findings(text, &reading);
    reading
        .program
        .unwrap_or_else(|| panic!("no program: {found:#?}"))
}

/// Outputs of `scans` scans under random inputs that change now and then.
pub(crate) fn outputs(circuit: &Circuit, seed: u64, scans: usize) -> Vec<Vec<bool>> {
    let mut dice = Dice::new(seed);
    let mut inputs = vec![false; circuit.inputs().len()];
    let mut run = Run::new(circuit);
    let mut shown = Vec::new();
    for _ in 0..scans {
        for input in &mut inputs {
            *input ^= dice.rarely(3);
        }
        shown.push(run.step(&inputs));
    }
    shown
}

/// A running circuit.
pub(crate) struct Run {
    scan: Scan,
    scratch: Scratch,
    registers: Vec<u64>,
    outputs: Vec<u64>,
    width: usize,
}

impl Run {
    pub(crate) fn new(circuit: &Circuit) -> Self {
        let scan = Scan::new(circuit);
        Self {
            scratch: Scratch::default(),
            registers: scan.initial().to_vec(),
            outputs: vec![0; scan.output_count().div_ceil(64)],
            width: scan.output_count(),
            scan,
        }
    }

    /// How many inputs there are.
    pub(crate) fn width(&self) -> usize {
        self.scan.input_count()
    }

    /// The registers, packed.
    pub(crate) fn state(&self) -> &[u64] {
        &self.registers
    }

    /// Goes on from another state.
    pub(crate) fn go_to(&mut self, state: &[u64]) {
        self.registers.copy_from_slice(state);
    }

    pub(crate) fn step(&mut self, inputs: &[bool]) -> Vec<bool> {
        let mut words = vec![0_u64; inputs.len().div_ceil(64)];
        for (place, _) in inputs.iter().enumerate().filter(|(_, on)| **on) {
            words[place / 64] |= 1 << (place % 64);
        }
        self.scan.step(
            &mut self.scratch,
            &mut self.registers,
            &words,
            &mut self.outputs,
        );
        (0..self.width)
            .map(|place| self.outputs[place / 64] >> (place % 64) & 1 == 1)
            .collect()
    }
}

/// What `xmllint` says about a text and the schema; `None` where one of them is not at hand.
pub(crate) fn xmllint(name: &str, text: &str) -> Option<bool> {
    let schema = data("plcopen/tc6_xml_v201.xsd")?;
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.xml"));
    fs::write(&file, text).expect("the folder of the tests can be written");
    let status = Command::new("xmllint")
        .args(["--noout", "--nonet", "--schema"])
        .args([&schema, &file])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .ok()?;
    Some(status.success())
}
