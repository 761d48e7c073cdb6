//! Every command has help with an example.

use std::process::Command;

use insta::assert_snapshot;

use crate::understudy;

/// The commands that the help lists, under the headings of their groups.
fn commands() -> Vec<String> {
    let help = understudy(&["--help"]).output;
    let lists = help.split("Options:").next().unwrap_or_default();
    let lines = lists.lines().filter_map(|line| line.strip_prefix("  "));
    let names = lines.filter_map(|line| line.split_whitespace().next());
    names.map(str::to_owned).collect()
}

#[test]
fn the_command_explains_itself() {
    assert_snapshot!(understudy(&["--help"]).shown());
}

#[test]
fn the_runtime_has_the_commands_of_a_machine_of_the_plant() {
    let runtime = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_understudy-runtime"));
        let found = command.args(arguments).output().expect("it runs");
        let text = |bytes| String::from_utf8(bytes).expect("text");
        (found.status.code(), text(found.stdout), text(found.stderr))
    };
    let (status, help, _) = runtime(&["--help"]);
    assert_eq!(status, Some(0));
    for command in ["doctor", "node", "remote-io", "plant"] {
        assert!(help.contains(&format!("\n  {command} ")), "{help}");
        assert_eq!(runtime(&[command, "--help"]).0, Some(0));
    }
    let (status, _, error) = runtime(&["lab", "cluster.toml"]);
    assert_eq!(status, Some(2));
    assert!(error.contains("error[U0600]"), "{error}");
    let (status, _, error) = runtime(&["node", "none.toml", "--name", "pump"]);
    assert_eq!(status, Some(2));
    assert!(error.contains("error[U0601]"), "{error}");
}

#[test]
fn every_command_has_an_example() {
    let commands = commands();
    assert!(commands.len() > 35, "{commands:?}");
    for command in &commands {
        let help = understudy(&[command, "--help"]);
        assert_eq!(help.status, 0, "{command}");
        assert!(help.output.contains("Example:\n  understudy "), "{command}:\n{}", help.output);
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

#[test]
fn wrong_arguments_have_a_code() {
    for arguments in [
        &["check"][..],
        &["check", "--perod", "10ms"],
        &["reliability", "--controllers", "two"],
        &["chek"],
    ] {
        let answer = understudy(arguments);
        assert_eq!(answer.status, 2, "{arguments:?}: {}", answer.errors);
        let said = &answer.errors;
        assert!(said.starts_with("error[U0600]: "), "{arguments:?}: {said}");
        assert!(said.contains("--help"), "{arguments:?}: {said}");
        let document = understudy(&[arguments, &["--json"]].concat());
        assert_eq!((document.status, document.errors.as_str()), (2, ""));
        let document = document.json();
        assert_eq!(document["failures"][0]["code"], "U0600", "{document}");
        assert_eq!(document["command"], arguments[0]);
    }
    // Help and the version are no misuse.
    for arguments in [&["--help"][..], &["--version"], &["check", "--help"]] {
        assert_eq!(understudy(arguments).status, 0, "{arguments:?}");
    }
}

#[test]
fn a_page_that_asks_nobody_who_he_is_ends_as_a_wrong_input_does() {
    let folder = crate::empty_folder("no_logins");
    let answer = crate::understudy_in(&folder, &["init", "."]);
    assert_eq!(answer.status, 0, "{}", answer.errors);
    let page = ["watch", "cluster.toml", "--address", "0.0.0.0:0"];
    let answer = crate::understudy_in(&folder, &page);
    assert_eq!(answer.status, 2, "{}", answer.errors);
    assert!(answer.errors.contains("error[U0674]"), "{}", answer.errors);
}

#[test]
fn keys_without_addresses_are_said_to_be_for_one_machine() {
    let folder = crate::empty_folder("keys_without_addresses");
    assert_eq!(crate::understudy_in(&folder, &["init", "."]).status, 0);
    let made = crate::understudy_in(&folder, &["keys", "init", "cluster.toml", "--json"]).json();
    let lacking = made["result"]["without_address"].as_array().map(Vec::len);
    assert!(lacking.is_some_and(|lacking| lacking > 0), "{made}");
    let renewed = crate::understudy_in(&folder, &["keys", "issue", "cluster.toml", "tank"]);
    let warning = "warning[U0915]: no address in the cluster file for tank;";
    assert!(renewed.output.starts_with(warning), "{}", renewed.output);
    let revoked = crate::understudy_in(&folder, &["keys", "revoke", "tank"]);
    assert!(!revoked.output.contains("U0915"), "{}", revoked.output);
}

#[test]
fn manual_and_completions_have_the_groups_of_the_help() {
    let manual = understudy(&["man"]).output;
    for heading in ["Run and test clusters", "Inspect runs", "Tools"] {
        assert!(
            manual.contains(&format!(".SH \"{heading}\""))
                || manual.contains(&format!(".SH {heading}"))
        );
    }
    let script = understudy(&["completions", "fish"]).output;
    assert!(script.contains("inspect: "), "{script}");
}

#[test]
fn the_reference_lists_every_command() {
    let page = std::fs::read_to_string("docs/reference/commands.md").expect("a page");
    let rows = page.lines().filter_map(|line| line.strip_prefix("| `"));
    let names: Vec<&str> = rows.filter_map(|row| row.split('`').next()).collect();
    assert_eq!(names, commands());
}
