//! Programs of LDmicro, from outside.

mod random;
#[path = "../structured_text/support.rs"]
#[allow(dead_code, reason = "other tests use the rest")]
mod support;

use std::time::Duration;

use understudy_interchange::ldmicro::read;
use understudy_ladder::{Interpreter, print};

use support::findings;

#[test]
fn a_program_as_a_ladder() {
    let text = include_str!("../../../../examples/other-tools/light.ld");
    let reading = read("light", text);
    assert_eq!(reading.period, Some(Duration::from_millis(10)));
    let ladder = print(&reading.program.expect("a program without errors"));
    insta::assert_snapshot!(format!("{ladder}\n{}", findings(text, reading.diagnostics)));
}

#[test]
fn everything_is_said_in_one_run() {
    let text = include_str!("full-of-errors.ld");
    let reading = read("errors", text);
    assert!(reading.program.is_none());
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
    let reading = read("sum", text);
    let program = reading.program.expect("a program without errors");
    let mut scans = Interpreter::new(&program, Duration::from_millis(10)).expect("a sound program");
    let mut outputs = Vec::new();
    for (run, reset) in [(1, 0), (1, 0), (0, 0), (1, 0), (0, 0), (0, 1), (1, 0)] {
        outputs.push(u8::from(scans.scan(&[run == 1, reset == 1])[0]));
    }
    assert_eq!(outputs, [0, 0, 0, 0, 1, 1, 0]);
}

#[test]
fn hostile_files_end() {
    let deep = format!("LDmicro0.1\nPROGRAM\nRUNG\n{}", "PARALLEL\nSERIES\n".repeat(50_000));
    assert!(read("deep", &deep).program.is_none());
    let many = format!("LDmicro0.1\nPROGRAM\nRUNG\n{}END\n", "CONTACTS Xa 0\n".repeat(100_000));
    assert!(read("many", &many).program.is_none());
    let long = format!(
        "LDmicro0.1\nPROGRAM\nRUNG\n{}COIL Ya 0 0 0\nEND\n",
        "CONTACTS Xa 0\n".repeat(5_000)
    );
    assert!(read("long", &long).program.is_some());
    let text = include_str!("../../../../examples/other-tools/light.ld");
    for (end, _) in text.char_indices() {
        read("beginning", &text[..end]);
        read("end", &text[end..]);
    }
}
