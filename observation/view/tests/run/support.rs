//! Clusters, and runs of them.

use std::sync::Arc;

use understudy_cluster::{Cluster, Overrides, press_cell, read_with};
use understudy_cycle::Mode;
use understudy_journal::{Members, Record};
use understudy_scenarios::{Scenario, read, simulate};
use understudy_view::{Bounds, Model};

/// A robot, the press that it feeds, and so on in turn: so many controllers and understudies.
pub(crate) fn line(controllers: usize, understudies: usize, mode: Mode) -> Cluster {
    let mut text = "[cluster]\nname = \"line\"\nperiod = \"10ms\"\n".to_owned();
    let kinds = ["robot", "press"];
    for place in 0..controllers {
        let kind = kinds[place % 2];
        text += &format!(
            "[[controller]]\nname = \"c{place}\"\nladder = \"{kind}.ladder\"\n\
             [[remote_io]]\nname = \"io{place}\"\ncontroller = \"c{place}\"\n\
             [[plant]]\nname = \"p{place}\"\ncontroller = \"c{place}\"\nmodel = \"{kind}\"\n"
        );
        if place % 2 == 1 {
            text += &format!("fed_by = \"p{}\"\n", place - 1);
        }
    }
    if understudies == 0 {
        text = text.replacen("[cluster]", "understudy = []\n[cluster]", 1);
    }
    for place in 0..understudies {
        text += &format!("[[understudy]]\nname = \"u{place}\"\n");
    }
    cluster(&text, mode)
}

/// The cell of section V.
pub(crate) fn cell() -> Cluster {
    cluster(press_cell()[0].text, Mode::Full)
}

pub(crate) fn cluster(text: &str, mode: Mode) -> Cluster {
    let overrides = Overrides {
        mode: Some(mode),
        ..Overrides::default()
    };
    let files = press_cell();
    let loaded = read_with("cluster.toml", text, overrides, &mut |name| {
        let file = files.iter().find(|file| file.name == name);
        file.map(|file| file.text.to_owned())
            .ok_or_else(|| "no such file".to_owned())
    });
    let found: Vec<String> = loaded
        .reports
        .iter()
        .flat_map(|report| &report.diagnostics)
        .map(|found| found.message.clone())
        .collect();
    loaded.cluster.unwrap_or_else(|| panic!("{found:?}"))
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
