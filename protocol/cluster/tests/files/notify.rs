//! The command that passes alarms on.

use std::time::Duration;

use crate::common::{findings, load};
use understudy_cluster::Notify;

const FILES: [(&str, &str); 1] = [(
    "pump.st",
    "PROGRAM pump VAR_INPUT on : BOOL; END_VAR VAR_OUTPUT run : BOOL; END_VAR run := on; END_PROGRAM",
)];

const HEAD: &str = "
[cluster]
name = \"cell\"
[[controller]]
name = \"pump\"
ladder = \"pump.st\"
";

fn notify(text: &str) -> Option<Notify> {
    let loaded = load(&format!("{HEAD}{text}"), &FILES);
    let findings = findings(&loaded.reports);
    loaded.cluster.unwrap_or_else(|| panic!("{findings}")).notify().cloned()
}

#[test]
fn a_command_has_arguments_and_a_timeout() {
    assert_eq!(notify(""), None);
    let command = |timeout| Notify {
        program: "logger".to_owned(),
        arguments: vec!["-t".to_owned(), "a b".to_owned()],
        timeout,
    };
    let text = "[notify]\ncommand = [\"logger\", \"-t\", \"a b\"]\n";
    assert_eq!(notify(text), Some(command(Duration::from_secs(10))));
    let text = format!("{text}timeout = \"500ms\"\n");
    assert_eq!(notify(&text), Some(command(Duration::from_millis(500))));
}

#[test]
fn a_command_that_cannot_run_is_reported() {
    let check = |notify: &str, wanted: &str| {
        let text = format!("{HEAD}[notify]\n{notify}");
        let findings = findings(&load(&text, &FILES).reports);
        assert!(findings.contains(wanted), "{notify}: {findings}");
    };
    check("", "U0203 [notify] has no `command`");
    check("command = []", "U0205 `command` names no program");
    check("command = [\"\"]", "U0205 `command` names no program");
    check("command = \"logger -t x\"", "U0204 `command` is the text \"logger -t x\"");
    check("command = [1]", "U0204");
    check("command = [\"logger\"]\ntimeout = \"1ms\"", "U0205");
    check("command = [\"logger\"]\ntimeout = \"11m\"", "U0205");
    check("commands = [\"logger\"]", "U0202");
}

#[test]
fn the_command_is_not_part_of_the_configuration_of_the_members() {
    let of = |text: &str| {
        let cluster = load(&format!("{HEAD}{text}"), &FILES).cluster.expect("a cluster");
        cluster.agreement().configuration
    };
    assert_eq!(of(""), of("[notify]\ncommand = [\"logger\"]\n"));
}
