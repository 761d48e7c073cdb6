//! What the variables say of simulated runs, and how far they say that it can be trusted.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::{Duration, Instant};

use understudy_cycle::Mode;
use understudy_gateway::BOUNDS;
use understudy_journal::Members;
use understudy_scenarios::{read as read_scenario, simulate};
use understudy_testing::points::{self, POINTS};
use understudy_view::{Model, RunState, Snapshot};

use super::*;
use crate::trust::level;

fn cell() -> Cluster {
    understudy_testing::press_cell(Mode::Full)
}

/// What was the case when `cycle` of a run with these faults was over.
fn observed(cluster: &Cluster, faults: &str, cycle: i64) -> Observation {
    let text = format!("title = \"Faults\"\ncycles = 60\n{faults}");
    let scenario = read_scenario("faults.toml", &text, Some(&Members::of(cluster)));
    assert_eq!(scenario.report.diagnostics, []);
    let scenario = scenario.scenario.expect("no diagnostics");
    let mut model = Model::new(Arc::new(cluster.clone()), BOUNDS);
    simulate(cluster, &scenario, 1, &mut |record| {
        if model.cycle().is_none_or(|now| now <= cycle) || !model.has_origin() {
            model.note(record);
        }
    })
    .expect("the cluster comes into step");
    Observation::new(&model, model.snapshot(), Instant::now())
}

fn reading(cluster: &Cluster, seen: &Seen<'_>, path: &str) -> Reading {
    let variables = variables(cluster);
    let found = variables.iter().find(|variable| variable.path() == path);
    found.unwrap_or_else(|| panic!("no {path}")).read(seen)
}

/// The source of the robot's outputs, and the statuses of an output, an input and a marker of it.
fn check(faults: &str, cycle: i64, feed: Feed, source: &str, statuses: [StatusCode; 3]) {
    let cluster = cell();
    let observation = observed(&cluster, faults, cycle);
    let seen = Seen { observation: &observation, feed };
    let of = |path: &str| reading(&cluster, &seen, path);
    assert_eq!(of("Programs/robot/Source").value, Some(text(source)));
    let robot = cluster.controllers()[0].circuit().expect("a ladder");
    let paths = [
        format!("Programs/robot/Outputs/{}", robot.outputs()[0].name),
        format!("Programs/robot/Inputs/{}", robot.inputs()[0]),
        format!("Programs/robot/Markers/{}", robot.registers()[0].name),
    ];
    for (path, status) in paths.iter().zip(statuses) {
        let reading = of(path);
        assert_eq!(reading.status, status, "{path}");
        assert!(reading.value.is_some(), "{path} keeps its value");
    }
}

const GOOD: StatusCode = StatusCode::Good;
const LAST: StatusCode = StatusCode::UncertainLastUsableValue;

#[test]
fn a_status_says_how_far_a_value_can_be_trusted() {
    check("", 30, Feed::Live, "direct", [GOOD, GOOD, GOOD]);
    let one = "[[step]]\nat = 20\naction = \"crash\"\nstation = \"robot\"\n";
    check(one, 30, Feed::Live, "reconstructed", [GOOD, GOOD, GOOD]);
    let both = format!("{one}[[step]]\nat = 20\naction = \"crash\"\nstation = \"understudy\"\n");
    check(&both, 21, Feed::Live, "held", [LAST, GOOD, LAST]);
    let failed = StatusCode::BadDeviceFailure;
    check(&both, 50, Feed::Live, "fail-safe", [failed, GOOD, LAST]);
    let silent = StatusCode::BadNoCommunication;
    check("", 30, Feed::Silent, "direct", [silent; 3]);
    let ended = StatusCode::UncertainNoCommunicationLastUsableValue;
    check("", 30, Feed::Ended, "direct", [ended; 3]);
    check(&both, 50, Feed::Ended, "fail-safe", [failed, ended, ended]);
}

#[test]
fn what_is_silent_is_found_out() {
    let cluster = cell();
    let mut observation = observed(&cluster, "", 30);
    let now = observation.heard;
    let check = |observation: &Observation, after: u64, feed: Feed| {
        let found = observation.feed(now + Duration::from_millis(after));
        assert_eq!(found, feed, "after {after} ms");
    };
    check(&observation, 1_900, Feed::Live);
    check(&observation, 2_100, Feed::Silent);
    let mut slow = (*observation.snapshot).clone();
    slow.period_us = 1_000_000;
    observation.snapshot = Arc::new(slow.clone());
    check(&observation, 19_900, Feed::Live);
    check(&observation, 20_100, Feed::Silent);
    slow.run = RunState::Finished;
    observation.snapshot = Arc::new(slow);
    check(&observation, 20_100, Feed::Ended);
}

#[test]
fn the_service_level_is_that_of_the_worst_that_is_so() {
    let cluster = cell();
    let check = |observation: &Observation, feed: Feed, level: u8| {
        let found = trust::service_level(Some((observation, feed)));
        assert_eq!(found, level, "{feed:?}");
    };
    let robot = "[[step]]\nat = 20\naction = \"crash\"\nstation = \"robot\"\n";
    let both = format!("{robot}[[step]]\nat = 20\naction = \"crash\"\nstation = \"understudy\"\n");
    let mut whole = observed(&cluster, "", 30);
    check(&whole, Feed::Live, level::PROTECTED);
    check(&whole, Feed::Silent, level::NO_DATA);
    check(&whole, Feed::Waiting, level::NO_DATA);
    check(&whole, Feed::Ended, level::ENDED);
    assert_eq!(trust::service_level(None), level::NO_DATA);
    check(&observed(&cluster, robot, 30), Feed::Live, level::UNPROTECTED);
    let lost = observed(&cluster, &both, 30);
    check(&lost, Feed::Live, level::WITHOUT_OUTPUTS);

    // What each part of a snapshot does, alone.
    let with = |change: &dyn Fn(&mut Snapshot)| {
        let mut snapshot = (*whole.snapshot).clone();
        change(&mut snapshot);
        let mut observation = whole.clone();
        observation.snapshot = Arc::new(snapshot);
        observation
    };
    let not_reported = with(&|of| of.programs[1].protection = None);
    check(&not_reported, Feed::Live, level::UNPROTECTED);
    let detached = with(&|of| of.remote_ios[1].link.detached = true);
    check(&detached, Feed::Live, level::NOT_RECEIVED);
    let unknown = with(&|of| of.programs[1].source = None);
    check(&unknown, Feed::Live, level::WITHOUT_OUTPUTS);
    let stopped = with(&|of| of.programs[1].fault = Some("division by zero".to_owned()));
    check(&stopped, Feed::Live, level::WITHOUT_OUTPUTS);
    let waits = with(&|of| of.programs[0].awaits_release = true);
    check(&waits, Feed::Live, level::WITHOUT_OUTPUTS);

    // Records that arrive without a new cycle are not the present of the programs.
    let start = whole.heard;
    whole.heard = start + Duration::from_secs(60);
    assert_eq!(whole.feed(whole.heard), Feed::Silent);
    assert_eq!(whole.state(Feed::Silent), "not-current");
    whole.advanced = whole.heard;
    assert_eq!(whole.feed(whole.heard), Feed::Live);
    assert_eq!(whole.state(Feed::Live), "running");
}

#[test]
fn before_a_run_nothing_is_known() {
    let cluster = cell();
    let model = Model::new(Arc::new(cluster.clone()), BOUNDS);
    let observation = Observation::new(&model, model.snapshot(), Instant::now());
    let seen = Seen { observation: &observation, feed: observation.feed(observation.heard) };
    assert_eq!(seen.feed, Feed::Waiting);
    for variable in variables(&cluster) {
        let reading = variable.read(&seen);
        let is_now = ["Inputs", "Outputs", "Markers", "Source"];
        if is_now.iter().any(|part| variable.path().contains(part)) {
            let waits = StatusCode::BadWaitingForInitialData;
            assert_eq!(reading.status, waits, "{}", variable.path());
        }
    }
}

#[test]
fn every_signal_has_one_place_and_a_value_of_its_kind() {
    let cluster = cell();
    let observation = observed(&cluster, "", 30);
    let seen = Seen { observation: &observation, feed: Feed::Live };
    let variables = variables(&cluster);
    let paths: BTreeSet<String> = variables.iter().map(Variable::path).collect();
    assert_eq!(paths.len(), variables.len());
    for controller in cluster.controllers() {
        for (kind, count) in [
            ("Inputs", controller.interface.inputs.len()),
            ("Outputs", controller.interface.outputs.len()),
        ] {
            let folder = format!("Programs/{}/{kind}/", controller.name);
            let found = paths.iter().filter(|path| path.starts_with(&folder));
            assert_eq!(found.count(), count, "{folder}");
        }
    }
    for variable in &variables {
        let value = variable.read(&seen).value;
        let of_kind = match (variable.kind(), value) {
            (Kind::Boolean, Some(Variant::Boolean(_)))
            | (Kind::Int64, Some(Variant::Int64(_)))
            | (Kind::UInt64, Some(Variant::UInt64(_)))
            | (Kind::String, Some(Variant::String(_)))
            | (Kind::Strings, Some(Variant::Array(_))) => true,
            (_, value) => panic!("{}: {value:?}", variable.path()),
        };
        assert!(of_kind);
    }
}

/// Operators write each point of the table, and its variables have the type, the value and the names of its declaration.
#[test]
fn a_variable_is_what_the_author_of_its_point_declared() {
    let cluster = points::cluster();
    let steps = points::writes(60);
    let steps = steps.split_once("[[step]]").expect("steps").1;
    let observation = observed(&cluster, &format!("[[step]]{steps}"), 30);
    let seen = Seen { observation: &observation, feed: Feed::Live };
    let variables = variables(&cluster);
    for row in &POINTS {
        let (kind, value) = match row.is_bool() {
            true => (Kind::Boolean, Variant::from(row.number != 0)),
            false => (Kind::Int64, Variant::from(row.number)),
        };
        let names: &[&str] = match row.of {
            "Mode" => &["Off", "", "", "Manual", "", "", "", "Auto"],
            _ => &[],
        };
        for path in ["Inputs/", "Outputs/q"] {
            let path = format!("Programs/one/{path}{}", row.name);
            let found = variables.iter().find(|variable| variable.path() == path);
            let variable = found.unwrap_or_else(|| panic!("no {path}"));
            let reading = variable.read(&seen);
            assert_eq!(
                (variable.kind(), reading.status, reading.value.as_ref()),
                (kind, GOOD, Some(&value)),
                "{path}"
            );
            assert_eq!(variable.names(), names, "{path}");
            let is_time = ["TIME", "LTIME", "DATE"].contains(&row.of);
            assert_eq!(variable.meaning().contains("nanoseconds"), is_time, "{path}");
            assert_eq!(variable.is_writable(), path.contains("Inputs"), "{path}");
        }
    }
}
