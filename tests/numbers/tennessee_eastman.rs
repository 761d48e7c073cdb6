//! The Tennessee Eastman example: what is driven is bit for bit the same, whichever controller fails and whenever.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use understudy_cluster::{Cluster, read as read_cluster};
use understudy_journal::{Happening, Members};
use understudy_remote_io::Event;
use understudy_scenarios::{Action, Fault, Scenario, read, simulate};
use understudy_testing::random::Dice;
use understudy_wire::{Image, Member, Moment, ProgramId, Source, StationId};

const CONTROLLERS: usize = 4;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/tennessee-eastman")
}

fn text(name: &str) -> Result<String, String> {
    std::fs::read_to_string(folder().join(name)).map_err(|error| error.to_string())
}

fn cluster(mode: &str) -> Cluster {
    let file = text("cluster.toml").expect("a cluster file");
    let period = "period = \"100ms\"";
    assert!(file.contains(period), "{file}");
    let file = file.replace(period, &format!("{period}\nmode = \"{mode}\""));
    let loaded = read_cluster("cluster.toml", &file, &mut |name| text(name));
    let found = loaded.cluster;
    found.unwrap_or_else(|| panic!("{:?}", loaded.reports))
}

/// The scenario of the example with other failures of stations.
fn scenario(cluster: &Cluster, failures: Vec<Fault>) -> Scenario {
    let file = text("kill-each.toml").expect("a scenario");
    let members = Members::of(cluster);
    let mut scenario =
        read("kill-each.toml", &file, Some(&members)).scenario.expect("without errors");
    scenario.steps.retain(|step| !matches!(step.action, Action::Crash | Action::Restart));
    assert!(!scenario.steps.is_empty(), "the operator writes a setpoint");
    scenario.steps.extend(failures);
    scenario.steps.sort_by_key(|step| step.at_cycle);
    scenario
}

/// Each controller fails once, one after the other, and is repaired.
fn failures(seed: u64) -> Vec<Fault> {
    let mut dice = Dice::new(seed);
    let mut below = |bound: u64| dice.number() % bound;
    let mut faults = Vec::new();
    for rank in 0..CONTROLLERS {
        let begins = 60 + 270 * rank as u64 + below(60);
        let ends = begins + 20 + below(120);
        for (at_cycle, action) in [(begins, Action::Crash), (ends, Action::Restart)] {
            faults.push(Fault {
                at_cycle,
                phase: below(1000) as f64 / 1000.0,
                member: Member::Station(StationId(rank as u8)),
                action,
            });
        }
    }
    faults
}

/// What each remote I/O applied in each cycle, and the outputs that were reconstructed.
fn run(cluster: &Cluster, failures: Vec<Fault>) -> (BTreeMap<(ProgramId, Moment), Image>, usize) {
    let scenario = scenario(cluster, failures);
    let (mut applied, mut reconstructed) = (BTreeMap::new(), 0);
    let account = simulate(cluster, &scenario, 1, &mut |record| {
        if let (Some(Member::RemoteIo(program)), Happening::RemoteIo(event)) =
            (record.member, &record.event)
            && let Event::Applied { moment, outputs, source, .. } = event
        {
            reconstructed += usize::from(*source == Source::Reconstructed);
            applied.insert((program, *moment), outputs.clone());
        }
    });
    account.expect("the cluster is synchronised");
    (applied, reconstructed)
}

#[test]
fn the_actuators_move_alike_with_and_without_failures() {
    let cluster = cluster("full");
    let (expected, reconstructed) = run(&cluster, Vec::new());
    assert_eq!(reconstructed, 0);
    assert!(expected.len() >= CONTROLLERS * 1200, "{}", expected.len());
    let of_feed = |place: &&(ProgramId, Moment)| place.0 == ProgramId(0);
    let first = expected.keys().find(of_feed).map(|place| &expected[place]);
    let last = expected.keys().rfind(of_feed).map(|place| &expected[place]);
    assert_ne!(first, last, "the valves move");
    for seed in 1..=3 {
        let (found, reconstructed) = run(&cluster, failures(seed));
        assert!(reconstructed > CONTROLLERS * 20, "{reconstructed}");
        assert_eq!(found.len(), expected.len(), "seed {seed}");
        for (place, outputs) in &expected {
            assert_eq!(found.get(place), Some(outputs), "{place:?}, seed {seed}");
        }
    }
    // One parity word over all programs, with numbers too.
    let (found, reconstructed) = run(&self::cluster("paper"), failures(1));
    assert!(reconstructed > CONTROLLERS * 20, "{reconstructed}");
    assert_eq!(found, expected);
}
