//! Clusters, and runs of them.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use understudy_cluster::Cluster;
use understudy_cycle::Mode;
use understudy_journal::{Members, Record};
use understudy_scenarios::{Scenario, read, simulate};
pub(crate) use understudy_testing::line;
use understudy_testing::press_cell;
use understudy_view::{Bounds, Model};

/// The cell of section V.
pub(crate) fn cell() -> Cluster {
    press_cell(Mode::Full)
}

/// The example with operator inputs and signals.
pub(crate) fn shuttles() -> Cluster {
    example("two-shuttles")
}

/// The cluster of an example.
pub(crate) fn example(name: &str) -> Cluster {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples");
    let folder = folder.join(name);
    let text = |name: &str| fs::read_to_string(folder.join(name));
    let file = text("cluster.toml").expect("an example");
    let mut open = |name: &str| text(name).map_err(|error| error.to_string());
    let loaded = understudy_cluster::read("cluster.toml", &file, &mut open);
    loaded.cluster.unwrap_or_else(|| panic!("{:?}", loaded.reports))
}

pub(crate) fn scenario(cluster: &Cluster, text: &str) -> Scenario {
    let found = read("scenario.toml", text, Some(&Members::of(cluster)));
    assert_eq!(found.report.diagnostics, []);
    found.scenario.expect("no diagnostics")
}

/// Every record of a simulated run.
pub(crate) fn records(cluster: &Cluster, scenario: &Scenario, seed: u64) -> Vec<Record> {
    let mut records = Vec::new();
    simulate(cluster, scenario, seed, &mut |record| {
        records.push(record.clone());
    })
    .expect("the cluster comes into step");
    records
}

/// What is known of a run from its records, as they are read back from their lines.
pub(crate) fn model(cluster: &Cluster, scenario: &Scenario, seed: u64) -> Model {
    let mut model = Model::new(Arc::new(cluster.clone()), Bounds::default());
    for record in records(cluster, scenario, seed) {
        let line = serde_json::to_string(&record).expect("JSON");
        let read: Record = serde_json::from_str(&line).expect("a record");
        assert_eq!(read, record);
        model.note(&read);
    }
    model
}

pub(crate) const KILL_EACH: &str = include_str!("../../../../scenarios/kill-each.toml");
