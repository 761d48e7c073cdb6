//! Ramps to fail-safe values, on the heated tank: what is driven in each cycle, judged by the referee.

use std::path::Path;

use understudy_cluster::{Loaded, read as read_cluster};
use understudy_journal::{Happening, Journal, Members};
use understudy_remote_io::Event;
use understudy_scenarios::{Circumstances, Summary, World, read, simulate};
use understudy_wire::{Member, ProgramId, Source};

/// The heated tank with this line below the fail-safe values of the heater.
fn heated_tank(ramp: &str) -> Loaded {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/heated-tank");
    let text =
        |name: &str| std::fs::read_to_string(folder.join(name)).map_err(|error| error.to_string());
    let line = "fail_safe = { heater = 0.0 }\n";
    let file = text("cluster.toml").expect("a cluster file");
    assert!(file.contains(line), "{file}");
    let file = file.replace(line, &format!("{line}{ramp}\n"));
    read_cluster("cluster.toml", &file, &mut |name| text(name))
}

/// Both stations that know the program of the heater fail; one returns.
const SCENARIO: &str = r#"
title = "No station knows the heater"
cycles = 200

[[step]]
at = 100
action = "crash"
station = "understudy"

[[step]]
at = 120
action = "crash"
station = "temperature"

[[step]]
at = 180
action = "restart"
station = "temperature"

[expect]
wrong = 0
"#;

fn circumstances() -> Circumstances {
    Circumstances {
        world: World::Simulator,
        seed: Some(1),
        cluster: "heated-tank".into(),
        configuration: "0".into(),
        mode: "full".into(),
        period_us: 100_000,
        link: "simulated".into(),
        version: "0".into(),
        machine: Vec::new(),
        repeat: "understudy simulate <cluster> & more".into(),
    }
}

#[test]
fn an_output_goes_down_its_ramp_and_the_referee_agrees() {
    let cluster = heated_tank("ramp = { heater = 5.0, stage = 2 }").cluster;
    let cluster = cluster.expect("a cluster");
    let members = Members::of(&cluster);
    let scenario = read("ramps.toml", SCENARIO, Some(&members)).scenario;
    let scenario = scenario.expect("a scenario");
    let mut bytes = Vec::new();
    let journal = Journal::new(&mut bytes);
    let program = &cluster.controllers()[1].interface.outputs;
    let point = |name: &str| program.find(name).expect("an output").clone();
    let (heater, stage) = (point("heater"), point("stage"));
    let mut driven = Vec::new();
    let account = simulate(&cluster, &scenario, 1, &mut |record| {
        if let (Some(Member::RemoteIo(ProgramId(1))), Happening::RemoteIo(event)) =
            (record.member, &record.event)
            && let Event::Applied { outputs, source, .. } = event
        {
            let heat = f32::from_bits(heater.get(outputs.words()) as u32);
            driven.push((*source, heat, stage.get(outputs.words())));
        }
    });
    let account = account.expect("the cluster is synchronised");
    let (summary, _) = Summary::new(account, &scenario, circumstances(), journal.finish());
    assert!(summary.violations.is_empty() && summary.passed);
    let held = driven.iter().position(|(source, ..)| *source == Source::Held);
    let held = held.expect("outputs are held");
    let (_, heat, stage) = driven[held];
    assert!(heat > 10.0 && stage >= 1, "{heat} {stage}");
    let lost = held + 3;
    // 5 per cent per second are 0.5 in a cycle of 100 ms; 2 stages per second are one in five cycles.
    for (deadlines, (source, found, found_stage)) in (1..).zip(&driven[lost..lost + 50]) {
        assert_eq!(*source, Source::FailSafe);
        let expected = (heat - 0.5 * deadlines as f32).max(0.0);
        assert!((found - expected).abs() < 1e-4, "{found} is not {expected}");
        assert_eq!(*found_stage, stage.saturating_sub(deadlines / 5));
    }
    assert_eq!(driven[lost + 49].1, 0.0);
}

#[track_caller]
fn check(ramp: &str, code: &str, expected: &str) {
    let loaded = heated_tank(ramp);
    let found = &loaded.reports[0].diagnostics;
    assert!(found.iter().any(|it| it.code == code && it.message.contains(expected)), "{found:?}");
}

#[test]
fn ramps_that_cannot_be_are_reported() {
    check("ramp = { too_hot = 1.0 }", "U0204", "`too_hot` is BOOL: only a number has a ramp");
    check("ramp = { heater = -5.0 }", "U0204", "the ramp of `heater` is not above 0");
    check("ramp = { heater = true }", "U0204", "the ramp of `heater` is not above 0");
    check("ramp = { heating = 5.0 }", "U0209", "no output `heating`");
}

#[test]
fn members_with_other_ramps_refuse_each_other() {
    let hash = |ramp: &str| {
        let cluster = heated_tank(ramp).cluster.expect("a cluster");
        cluster.agreement().configuration
    };
    let [none, slow, fast, other] =
        ["", "ramp = { heater = 5.0 }", "ramp = { heater = 6.0 }", "ramp = { stage = 5.0 }"]
            .map(hash);
    assert_eq!(none, hash("ramp = {}"));
    assert!(none != slow && slow != fast && slow != other && none != other);
}
