//! The units of `deployment/` start what there is to start.

use std::fs;
use std::path::Path;

use super::{answer, codes};

#[test]
fn units_call_commands_as_they_are() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("deployment");
    for (kind, name) in [
        ("node", "robot"),
        ("remote-io", "robot-io"),
        ("plant", "arm"),
    ] {
        let path = folder.join(format!("understudy-{kind}@.service"));
        let unit = fs::read_to_string(&path).expect("there is one for each kind");
        let value = |key: &str| {
            let line = unit.lines().find_map(|line| line.strip_prefix(key));
            line.unwrap_or_else(|| panic!("{kind} has no {key}"))
        };
        let called = value("ExecStart=/usr/local/bin/understudy ").replace("%i", name);
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
