//! Every command has help with an example.

use insta::assert_snapshot;

use crate::understudy;

const COMMANDS: [&str; 33] = [
    "allocate",
    "catalogue",
    "resources",
    "campaign",
    "demo",
    "lab",
    "watch",
    "simulate",
    "check",
    "explain",
    "parity",
    "draw",
    "supervisor-to-ladder",
    "reconfigure",
    "reliability",
    "measure",
    "top",
    "why",
    "journal",
    "diff",
    "init",
    "keys",
    "operate",
    "doctor",
    "gateway",
    "node",
    "remote-io",
    "plant",
    "proxy",
    "bench",
    "schema",
    "completions",
    "man",
];

#[test]
fn the_command_explains_itself() {
    assert_snapshot!(understudy(&["--help"]).shown());
}

#[test]
fn every_command_has_an_example() {
    for command in COMMANDS {
        let help = understudy(&[command, "--help"]);
        assert_eq!(help.status, 0, "{command}");
        assert!(
            help.output.contains("Example:\n  understudy "),
            "{command}:\n{}",
            help.output
        );
    }
}

#[test]
fn lab_explains_itself() {
    assert_snapshot!(understudy(&["lab", "--help"]).shown());
}

#[test]
fn a_misspelt_command_is_bad_input() {
    let answer = understudy(&["chek"]);
    assert_eq!(answer.status, 2);
    assert!(answer.errors.contains("'check'"), "{}", answer.errors);
}
