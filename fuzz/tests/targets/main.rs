//! One target for each reader.

#![allow(clippy::print_stderr, reason = "a finding names its file")]

mod attack;
mod members;
mod other_tools;
mod questions;
mod runs;

use std::time::Duration;

use attack::attack;
use understudy_allocation::file;
use understudy_ladder::{MAXIMUM_NESTING, check, parse, print};
use understudy_reconfiguration::{Signals, project, record};

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn ladder() {
    let seeds = [
        "examples/press-cell/robot.ladder",
        "examples/boiler/main.ladder",
        "examples/filling-line/plant.ladder",
    ];
    attack("ladder", &seeds, |bytes| {
        let parsed = parse(&text(bytes));
        let _ = check(&parsed.program);
        let Ok((program, _)) = parsed.into_result() else {
            return;
        };
        // What is right is the same after it was printed, and becomes a circuit.
        let again = parse(&print(&program));
        assert_eq!(again.into_result().map(|(again, _)| print(&again)), Ok(print(&program)));
        let _ = program.lower(Duration::from_millis(10));
    });
}

#[test]
fn plcopen() {
    let seeds = ["examples/plcopen/pump.xml", "examples/plcopen/probes.xml"];
    attack("plcopen", &seeds, |bytes| {
        let reading = understudy_interchange::plcopen::read(&text(bytes), None);
        let Some(program) = reading.program else {
            assert!(!reading.diagnostics.is_empty(), "no program, and no reason");
            return;
        };
        // What was read is sound, and what is written of it is read again.
        let period = Duration::from_millis(10);
        assert!(program.lower(period).is_ok());
        let written = understudy_interchange::plcopen::write(&program, period);
        let again = understudy_interchange::plcopen::read(&written, None);
        assert!(again.program.is_some(), "{:?}", again.diagnostics);
    });
}

#[test]
fn cluster() {
    let seeds = [
        "examples/press-cell/cluster.toml",
        "examples/boiler/cluster.toml",
        "examples/modbus-cell/cluster.toml",
        "examples/modbus-level/cluster.toml",
    ];
    let ladder = include_str!("../../../examples/press-cell/press.ladder");
    attack("cluster", &seeds, |bytes| {
        let _ =
            understudy_cluster::read("cluster.toml", &text(bytes), &mut |_| Ok(ladder.to_owned()));
    });
}

#[test]
fn scenario() {
    let seeds = ["scenarios/kill-each.toml", "scenarios/lossy.toml", "scenarios/table-two.toml"];
    attack("scenario", &seeds, |bytes| {
        let text = text(bytes);
        let _ = understudy_scenarios::looks_like_a_scenario(&text);
        let _ = understudy_scenarios::read("scenario.toml", &text, None);
    });
}

#[test]
fn ads() {
    let seeds = ["examples/motivating-example/supervisor.ADS", "examples/avalanche/TEST.ADS"];
    attack("ads", &seeds, |bytes| {
        let _ = understudy_supervisor::read_ads(&text(bytes));
    });
}

#[test]
fn module() {
    attack("module", &[], |bytes| {
        let Some(model) = understudy_supervisor::read_module(&text(bytes)).model else {
            return;
        };
        // What is right is the same after it was written.
        let written = understudy_supervisor::write_module(&model);
        let again = understudy_supervisor::read_module(&written);
        let again = again.model.map(|again| understudy_supervisor::write_module(&again));
        assert_eq!(again, Some(written));
    });
}

#[test]
fn generator() {
    attack("generator", &[], |bytes| {
        let Some(model) = understudy_supervisor::read_generator(&text(bytes)).model else {
            return;
        };
        let written = understudy_supervisor::write_generator(&model.supervisors[0]);
        let again = understudy_supervisor::read_generator(&written).model;
        let again =
            again.map(|again| understudy_supervisor::write_generator(&again.supervisors[0]));
        assert_eq!(again, Some(written));
    });
}

#[test]
fn model() {
    let seeds = ["examples/small-factory/model.toml", "examples/boiler/pilot.toml"];
    attack("model", &seeds, |bytes| {
        let _ = understudy_supervisor::read_model(&text(bytes), |_| Err("absent".to_owned()));
    });
}

#[test]
fn map() {
    let seeds = ["examples/motivating-example/map.toml", "examples/boiler/main-map.toml"];
    attack("map", &seeds, |bytes| {
        let _ = understudy_supervisor::ladder::read_map(&text(bytes));
    });
}

#[test]
fn chain() {
    attack("chain", &[], |bytes| {
        let _ = understudy_reliability::read_chain("chain.toml", text(bytes));
    });
}

#[test]
fn reconfiguration() {
    let seeds = ["examples/filling-line/reconfiguration.toml"];
    let ladder = include_str!("../../../examples/filling-line/filling-line.ladder");
    attack("reconfiguration", &seeds, |bytes| {
        let _ = project::read("project.toml", &text(bytes), &mut |_| Ok(ladder.to_owned()));
    });
}

#[test]
fn record_of_scans() {
    let names = |text: &str| text.split(' ').map(str::to_owned).collect();
    let signals = Signals { inputs: names("a b"), outputs: names("y") };
    attack("record", &[], |bytes| {
        let _ = record::read("record.csv", &text(bytes), &signals);
    });
}

#[test]
fn nesting_has_a_bound() {
    let deep = MAXIMUM_NESTING * 40;
    for open in ["[ ", "[ a | ", "{SR l R="] {
        let text = format!("program p\ninput a\noutput y\nrung\n    {} ( y )\n", open.repeat(deep));
        assert!(parse(&text).into_result().is_err());
    }
}

#[test]
fn catalogue() {
    let seeds =
        ["engineering/allocation/data/controllers.csv", "engineering/allocation/data/families.csv"];
    attack("catalogue", &seeds, |bytes| {
        let Some(catalogue) = file::read("fuzz", &text(bytes)).catalogue else {
            return;
        };
        // What is right is the same after it was written.
        let again = file::read("fuzz", &file::write(&catalogue));
        assert_eq!(again.report.diagnostics, []);
        assert_eq!(again.catalogue, Some(catalogue));
    });
}
