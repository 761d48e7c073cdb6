//! Programs as texts, executed by both engines, which must agree in every bit.
#![allow(dead_code, reason = "each test uses a part of it")]

use understudy_structured_text::{Lowered, Options, lower, parse};
use understudy_text::{Diagnostic, Report, Severity};
use understudy_typed::{Elementary, Fault, Interpreter, Machine, Point, Program, Scratch};

/// What a text is lowered to, and everything that was found.
pub(crate) fn read(text: &str, program: Option<&str>) -> (Lowered, Vec<Diagnostic>) {
    let (file, mut found) = parse(text);
    let options = Options { text, program, ..Options::default() };
    let lowered = lower(&file, &options);
    found.extend(lowered.diagnostics.iter().cloned());
    (lowered, found)
}

/// The program of a text without errors.
pub(crate) fn program(text: &str) -> Program {
    let (lowered, found) = read(text, None);
    let shown = shown(text, &found, Severity::Error);
    assert!(shown.is_empty(), "{shown}");
    lowered.program.expect("a text without errors has a program")
}

/// The findings of a severity, a line each.
pub(crate) fn shown(text: &str, found: &[Diagnostic], severity: Severity) -> String {
    let report = Report { name: String::new(), text: text.to_owned(), diagnostics: Vec::new() };
    let lines = found.iter().filter(|found| found.severity == severity).map(|found| {
        let place = report.line_and_column(found.span.start);
        let help = found.help.as_deref().unwrap_or("no help");
        format!("{} {place} {} [{help}]\n", found.code, found.message)
    });
    lines.collect()
}

/// One program under both engines.
pub(crate) struct Running {
    program: Program,
    interpreter: Interpreter,
    machine: Machine,
    scratch: Scratch,
    state: Vec<u64>,
    reference: Vec<u64>,
    inputs: Vec<u64>,
    outputs: Vec<u64>,
}

impl Running {
    pub(crate) fn new(program: Program) -> Self {
        let violations = program.validate();
        assert!(violations.is_ok(), "{violations:?}");
        let interpreter = Interpreter::new(&program);
        let machine = Machine::new(&program);
        Self {
            state: machine.initial().to_vec(),
            reference: interpreter.initial().to_vec(),
            inputs: vec![0; machine.input_count().div_ceil(64)],
            outputs: vec![0; machine.output_count().div_ceil(64)],
            scratch: Scratch::default(),
            interpreter,
            machine,
            program,
        }
    }

    pub(crate) fn state(&self) -> &[u64] {
        &self.state
    }

    /// Goes on from a state.
    pub(crate) fn go_on_from(&mut self, state: &[u64]) {
        self.state = state.to_vec();
        self.reference = state.to_vec();
    }

    pub(crate) fn inputs(&self) -> Vec<Point> {
        let points = self.program.inputs.iter();
        points.filter(|point| point.slot != 0).cloned().collect()
    }

    pub(crate) fn outputs(&self) -> Vec<Point> {
        let points = self.program.outputs.iter();
        points.filter(|point| point.slot != 0).cloned().collect()
    }

    /// One scan with these values, as they are stored, in the order of declaration.
    pub(crate) fn scan(&mut self, values: &[u64]) -> Vec<u64> {
        for (point, value) in self.inputs().iter().zip(values) {
            point.set(&mut self.inputs, *value);
        }
        let mut expected = vec![0; self.outputs.len()];
        self.interpreter.step(&mut self.reference, &self.inputs, &mut expected);
        self.machine.step(&mut self.scratch, &mut self.state, &self.inputs, &mut self.outputs);
        assert_eq!(self.outputs, expected, "the engines differ in an output");
        assert_eq!(self.state, self.reference, "the engines differ in a state");
        let points = self.outputs();
        points.iter().map(|point| point.get(&self.outputs)).collect()
    }

    /// A warm start before the next scan.
    pub(crate) fn restart(&mut self) {
        self.state = self.program.restarted(&self.state);
        self.reference.clone_from(&self.state);
    }

    /// What stopped the program.
    pub(crate) fn fault(&self) -> Option<String> {
        Fault::read(&self.state).map(|fault| fault.describe(&self.program))
    }

    pub(crate) fn program(&self) -> &Program {
        &self.program
    }
}

/// A value as the vectors write it: reals as their bits in hexadecimal, everything else in decimal.
pub(crate) fn written(of: Elementary, value: u64) -> String {
    match of {
        Elementary::Real => format!("{value:08x}"),
        Elementary::Lreal => format!("{value:016x}"),
        _ => of.signed(value).to_string(),
    }
}

/// Reads what [`written`] writes.
pub(crate) fn stored(of: Elementary, text: &str) -> u64 {
    if of.is_real() {
        u64::from_str_radix(text, 16).expect("hexadecimal bits")
    } else {
        text.parse::<i128>().expect("a decimal number") as u64 & of.mask()
    }
}

/// Runs a program: a line of inputs for each scan, and the outputs that are expected, as decimal numbers.
pub(crate) fn check(text: &str, scans: &[(&[i64], &str)]) {
    let mut running = Running::new(program(text));
    let (inputs, outputs) = (running.inputs(), running.outputs());
    for (scan, (given, expected)) in scans.iter().enumerate() {
        let values = inputs.iter().zip(*given);
        let values: Vec<u64> = values
            .map(|(point, value)| match point.of {
                of if of.is_real() => (*value as f64).to_bits(),
                of => *value as u64 & of.mask(),
            })
            .collect();
        let found = running.scan(&values);
        assert_eq!(running.fault(), None, "{text}");
        let found = outputs.iter().zip(found).map(|(point, value)| match point.of {
            of if of.bits() == 64 && of.is_real() => f64::from_bits(value).to_string(),
            of if of.is_real() => f32::from_bits(value as u32).to_string(),
            of => written(of, value),
        });
        let found: Vec<String> = found.collect();
        assert_eq!(found.join(" "), *expected, "scan {scan} of {text}");
    }
}

/// One scan of statements over an INT `a` and an INT `b` as inputs.
pub(crate) fn once(outputs: &str, variables: &str, body: &str, expected: &str) {
    let text = format!(
        "PROGRAM main VAR_INPUT a : INT; b : INT; END_VAR VAR_OUTPUT {outputs} END_VAR
         VAR {variables} END_VAR {body} END_PROGRAM"
    );
    check(&text, &[(&[7, -3], expected)]);
}
