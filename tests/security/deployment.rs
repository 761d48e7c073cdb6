//! The units and the services of `deployment/` start what there is to start.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use super::{answer, codes};

#[test]
fn units_call_commands_as_they_are() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("deployment");
    for (kind, name) in [("node", "robot"), ("remote-io", "robot-io"), ("plant", "arm")] {
        let path = folder.join(format!("understudy-{kind}@.service"));
        let unit = fs::read_to_string(&path).expect("there is one for each kind");
        let value = |key: &str| {
            let line = unit.lines().find_map(|line| line.strip_prefix(key));
            line.unwrap_or_else(|| panic!("{kind} has no {key}"))
        };
        let called = value("ExecStart=/usr/local/bin/understudy-runtime ").replace("%i", name);
        let arguments: Vec<&str> = called.split_whitespace().collect();
        assert_eq!(arguments[0], kind);
        // Its arguments are understood; only the cluster file is not here.
        let (status, document, _) = answer(&arguments);
        assert_eq!((status, codes(&document)), (2, vec!["U0601"]), "{called}");
        assert_eq!(value("Type="), "notify");
        assert_eq!(value("User="), "understudy");
        assert_eq!(value("CapabilityBoundingSet="), "CAP_SYS_NICE");
        assert_eq!(value("RestartPreventExitStatus="), "2");
    }
}

/// Every member of the press cell, which is the cell of the compose file, is one service of its own kind.
#[test]
fn services_call_commands_as_they_are() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = |path: &str| fs::read_to_string(root.join(path)).expect("it is there");
    let mut members = BTreeSet::new();
    let mut kind = "";
    for line in text("examples/press-cell/cluster.toml").lines() {
        kind = match line {
            "[[controller]]" | "[[understudy]]" => "node",
            "[[remote_io]]" => "remote-io",
            "[[plant]]" => "plant",
            _ => kind,
        };
        if let Some(name) = line.strip_prefix("name = ").filter(|_| !kind.is_empty()) {
            members.insert((kind.to_owned(), name.trim_matches('"').to_owned()));
        }
    }
    let mut services = BTreeSet::new();
    for line in text("deployment/compose.yaml").lines() {
        let Some(called) = line.trim_start().strip_prefix("command: ") else {
            continue;
        };
        let arguments: Vec<&str> = called.split_whitespace().collect();
        // Its arguments are understood; only the cluster file is not here.
        let (status, document, _) = answer(&arguments);
        assert_eq!((status, codes(&document)), (2, vec!["U0601"]), "{called}");
        if let [kind, _, "--name", name, "--keys", keys] = arguments[..] {
            assert_eq!(Path::new(keys).file_name(), Some(name.as_ref()), "{called}");
            services.insert((kind.to_owned(), name.to_owned()));
        }
    }
    assert_eq!(members.len(), 7);
    assert_eq!(services, members);
}
