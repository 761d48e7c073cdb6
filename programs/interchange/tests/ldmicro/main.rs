//! Programs of LDmicro, from outside.

mod random;
#[path = "../structured_text/support.rs"]
#[allow(dead_code, reason = "other tests use the rest")]
mod support;

use std::sync::Arc;
use std::time::Duration;

use understudy_interchange::{Bodies, Format, Source, SourceFile, Wanted, read_source, typed_text};
use understudy_typed::{Interpreter, Points, Program};

use support::findings;

/// Reads a file of that name.
pub(crate) fn read(name: &str, text: &str) -> SourceFile {
    read_source(&format!("{name}.ld"), text, Wanted::default())
}

/// The program of a file without errors.
pub(crate) fn program(text: &str) -> Arc<Program> {
    let found = read("program", text);
    match found.source {
        Some(Source::Program(program)) => program,
        _ => panic!("{:#?}\n{text}", found.diagnostics),
    }
}

/// A program in execution, with BOOLs for its inputs and outputs.
pub(crate) struct Running {
    program: Arc<Program>,
    state: Vec<u64>,
}

impl Running {
    pub(crate) fn new(program: Arc<Program>) -> Self {
        let state = Interpreter::new(&program).initial().to_vec();
        Self { program, state }
    }

    /// The outputs of one scan.
    pub(crate) fn scan(&mut self, inputs: &[bool]) -> Vec<bool> {
        let own = |points: &Points| {
            let own = points.iter().enumerate().filter(|(_, point)| point.slot != 0);
            own.map(|(place, _)| place).collect::<Vec<usize>>()
        };
        let mut image = vec![0_u64];
        for (place, bit) in own(&self.program.inputs).into_iter().zip(inputs) {
            image[0] |= u64::from(*bit) << place;
        }
        let mut outputs = vec![0_u64];
        Interpreter::new(&self.program).step(&mut self.state, &image, &mut outputs);
        let places = own(&self.program.outputs).into_iter();
        places.map(|place| outputs[0] >> place & 1 == 1).collect()
    }
}

#[test]
fn a_program_as_a_text() {
    let text = include_str!("../../../../examples/other-tools/light.ld");
    let reading = read("light", text);
    assert_eq!(reading.period, Some(Duration::from_millis(10)));
    let written =
        typed_text("light.ld", text, Wanted::default(), Format::StructuredText, Bodies::AsRead);
    let (written, _) = written.expect("the text of the program");
    let written = written.expect("a program without errors").text;
    insta::assert_snapshot!(format!("{written}\n{}", findings(text, reading.diagnostics)));
}

#[test]
fn everything_is_said_in_one_run() {
    let text = include_str!("full-of-errors.ld");
    let reading = read("errors", text);
    assert!(reading.source.is_none());
    insta::assert_snapshot!(findings(text, reading.diagnostics));
    // What can only be said of a whole that was read.
    let text = "LDmicro0.1\nPROGRAM\nRUNG\nCONTACTS Ry 0\nMOVE Ry 3\nTON Ta 9\nTON Ta 9\nADD n 1 99999\nDIV n n n\nEND\n";
    insta::assert_snapshot!(findings(text, read("late", text).diagnostics));
}

#[test]
fn a_retentive_timer_keeps_its_time() {
    let text = "LDmicro0.1\nCYCLE=10000\nIO LIST\nXrun at 1\nXreset at 2\nYdone at 3\nEND\nPROGRAM\n\
                RUNG\nCONTACTS Xrun 0\nRTO Tsum 30000\nCOIL Ydone 0 0 0\nEND\n\
                RUNG\nCONTACTS Xreset 0\nRES Tsum\nEND\n";
    let mut running = Running::new(program(text));
    let mut outputs = Vec::new();
    for (run, reset) in [(1, 0), (1, 0), (0, 0), (1, 0), (0, 0), (0, 1), (1, 0)] {
        outputs.push(u8::from(running.scan(&[run == 1, reset == 1])[0]));
    }
    assert_eq!(outputs, [0, 0, 0, 0, 1, 1, 0]);
}

#[test]
fn what_persist_names_is_retentive() {
    let text = "LDmicro0.1\nCYCLE=10000\nIO LIST\nXrun at 1\nYdone at 3\nYmore at 4\nEND\nPROGRAM\n\
                RUNG\nCONTACTS Xrun 0\nPERSIST Cn\nCOIL Rseen 0 1 0\nEND\nRUNG\nPERSIST Xrun\nCTU Cn 3\n\
                COIL Ydone 0 0 0\nEND\nRUNG\nPERSIST Ymore\nCONTACTS Rseen 0\nCOIL Ymore 0 0 0\nEND\n\
                RUNG\nPERSIST Rseen\nPERSIST Cx\nEND\n";
    let reading = read("kept", text);
    insta::assert_snapshot!(findings(text, reading.diagnostics), @r"
    15:1: U1075 Warning: PERSIST of `Xrun` has no effect: it is no output, bit or number that the program uses
    26:1: U1075 Warning: PERSIST of `Cx` has no effect: it is no output, bit or number that the program uses
    ");
    assert_eq!(program(text).retentive_names(), ["Ymore", "Cn", "Rseen"]);
}

#[test]
fn hostile_files_end() {
    let deep = format!("LDmicro0.1\nPROGRAM\nRUNG\n{}", "PARALLEL\nSERIES\n".repeat(50_000));
    assert!(read("deep", &deep).source.is_none());
    let many = format!("LDmicro0.1\nPROGRAM\nRUNG\n{}END\n", "CONTACTS Xa 0\n".repeat(100_000));
    assert!(read("many", &many).source.is_none());
    let long = format!(
        "LDmicro0.1\nPROGRAM\nRUNG\n{}COIL Ya 0 0 0\nEND\n",
        "CONTACTS Xa 0\n".repeat(5_000)
    );
    assert!(read("long", &long).source.is_some());
    let text = include_str!("../../../../examples/other-tools/light.ld");
    for (end, _) in text.char_indices() {
        read("beginning", &text[..end]);
        read("end", &text[end..]);
    }
}
