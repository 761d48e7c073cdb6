//! A store has the findings of its seeds, whichever processes ran them, in any order, into any number of folders.

use understudy_cycle::Mode;
use understudy_testing::press_cell;

use super::super::{Kind, Property};
use super::*;

/// Runs in which loss holds cycles, so that there are failures to keep.
fn plan() -> InjectionPlan {
    InjectionPlan {
        runs: 2,
        seed: 77,
        cycles: MINIMUM_RUN_CYCLES,
        property: Property::Held,
        kinds: vec![Kind::Isolation, Kind::Crash],
        shard: Shard::WHOLE,
        spare_after: None,
    }
}

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("understudy-{}-{name}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    folder
}

fn open(folder: &Path, salt: u64) -> Store {
    Store::open(folder, &press_cell(Mode::Full), &plan(), salt).expect("an empty folder")
}

fn run(store: &Store, seed: u64) -> Findings {
    let cell = press_cell(Mode::Full);
    inject(&cell, &store.plan(seed), 1, &|| true).expect("the cell comes into step")
}

fn texts(errors: &[StoreError]) -> Vec<(&'static str, String)> {
    errors.iter().map(|error| (error.code(), error.to_string())).collect()
}

/// More than a block: whole blocks are one file, and nothing changes by it.
#[test]
fn blocks_orders_and_folders_change_nothing() {
    const SEEDS: u64 = BLOCK + 3;
    let folders = ["blocks", "first", "second"].map(folder);
    let [mut all, mut first, mut second] = folders.each_ref().map(|folder| open(folder, 1));
    let mut turn = 0;
    while let Some(seed) = all.next_seed(SEEDS).expect("it is read") {
        let findings = run(&all, seed);
        all.keep(findings.clone()).expect("it is kept");
        turn += 1;
        // Some seeds are in one of the other stores, some in both.
        if turn % 3 != 0 {
            first.keep(findings.clone()).expect("it is kept");
        }
        if turn % 3 != 1 {
            second.keep(findings).expect("it is kept");
        }
    }
    let whole = Store::merged(&[all]).expect("a store");
    assert_eq!((whole.seeds.clone(), whole.runs_made), (Seeds::range(0, SEEDS - 1), 2 * SEEDS));
    assert!(whole.runs_failed > 0 && !whole.failures.is_empty(), "{whole}");
    let mut listed = entries(&folders[0]).expect("it is read");
    listed.sort_by_key(Seeds::first);
    let expected = [
        Seeds::range(0, BLOCK - 1),
        Seeds::range(BLOCK, BLOCK),
        Seeds::range(BLOCK + 1, BLOCK + 1),
        Seeds::range(BLOCK + 2, BLOCK + 2),
    ];
    assert_eq!(listed, expected);
    assert!(first.next_seed(SEEDS).expect("it is read").is_some());
    assert!(second.next_seed(SEEDS).expect("it is read").is_some());
    let stores = || folders[1..].iter().map(|folder| Store::read(folder, 0).expect("a store"));
    let merged = Store::merged(&stores().collect::<Vec<_>>()).expect("one campaign");
    assert_eq!(merged.to_json(), whole.to_json());
    let again: Vec<Store> = stores().chain([open(&folders[0], 2)]).rev().collect();
    assert_eq!(Store::merged(&again).expect("one campaign").to_json(), whole.to_json());
    for failure in &whole.failures {
        let better = |other: &&super::super::Failure| {
            other.kinds == failure.kinds
                && other.faults < failure.faults
                && other.cycles < failure.cycles
        };
        assert_eq!(whole.failures.iter().find(better), None);
    }
    folders.iter().for_each(|folder| std::fs::remove_dir_all(folder).expect("its own"));
}

/// What a process has left that was killed while it wrote does not count, and goes when the file is written.
#[test]
fn a_file_that_was_begun_does_not_count() {
    let folder = folder("begun");
    let mut store = open(&folder, 1);
    let begun = folder.join(".seeds-0-0.json.0000000000000001");
    std::fs::write(&begun, "{ \"form").expect("written");
    assert_eq!(store.next_seed(1).expect("it is read"), Some(0));
    let findings = run(&store, 0);
    store.keep(findings).expect("it is kept");
    assert!(!begun.exists());
    assert_eq!(store.next_seed(1).expect("it is read"), None);
    std::fs::remove_dir_all(&folder).expect("its own");
}

#[test]
fn other_stores_are_refused_with_all_differences() {
    let folder = folder("other");
    let cell = press_cell(Mode::Full);
    let store = open(&folder, 1);
    let other = InjectionPlan { runs: 3, cycles: 160, property: Property::Wrong, ..plan() };
    let errors = Store::open(&folder, &cell, &other, 1).expect_err("another plan");
    let found = texts(&errors);
    assert_eq!(found.len(), 3, "{found:?}");
    assert!(found.iter().all(|(code, _)| *code == "U0628"), "{found:?}");
    assert!(found[0].1.ends_with("--runs is 2 there and 3 here"), "{found:?}");
    let errors = Store::open(&folder, &press_cell(Mode::Paper), &plan(), 1);
    let found = texts(&errors.expect_err("another cluster"));
    assert!(found.iter().any(|(_, text)| text.contains("the configuration is")), "{found:?}");

    // A build that behaves otherwise, and another version.
    let path = folder.join(STORE_FILE);
    let text = std::fs::read_to_string(&path).expect("text");
    let mut header = store.header.clone();
    header.behaviour.direct += 1;
    std::fs::write(&path, json(&header)).expect("written");
    let found = texts(&Store::open(&folder, &cell, &plan(), 1).expect_err("another build"));
    assert!(found[0].1.contains("made by another build of this version"), "{found:?}");
    header.version = "0.0.1".to_owned();
    std::fs::write(&path, json(&header)).expect("written");
    let found = texts(&Store::open(&folder, &cell, &plan(), 1).expect_err("another version"));
    assert!(found[0].1.contains("the version is 0.0.1 there"), "{found:?}");
    std::fs::write(&path, text.replace("\"format\": 1", "\"format\": 7")).expect("written");
    let found = texts(&Store::open(&folder, &cell, &plan(), 1).expect_err("another format"));
    assert!(found[0].1.contains("the format is 7 there and 1 here"), "{found:?}");
    std::fs::write(&path, &text[..text.len() / 2]).expect("written");
    let found = texts(&Store::open(&folder, &cell, &plan(), 1).expect_err("half a file"));
    assert_eq!(found[0].0, "U0629", "{found:?}");
    std::fs::remove_file(&path).expect("its own");
    std::fs::write(folder.join("cluster.toml"), "").expect("written");
    let found = texts(&Store::open(&folder, &cell, &plan(), 1).expect_err("no store"));
    assert!(found[0].1.contains("is not a store"), "{found:?}");
    std::fs::remove_dir_all(&folder).expect("its own");
}

/// Findings are a function of their seed: a file that was changed, and two stores that disagree, are found.
#[test]
fn changed_findings_are_refused() {
    let folders = ["one", "two"].map(folder);
    for folder in &folders {
        let store = open(folder, 1);
        let findings = run(&store, 4);
        store.keep(findings).expect("it is kept");
    }
    let path = folders[1].join("seeds-4-4.json");
    let text = std::fs::read_to_string(&path).expect("text");
    let read = || {
        folders.iter().map(|folder| Store::read(folder, 0).expect("a store")).collect::<Vec<_>>()
    };
    let check = |changed: &str, expected: &str| {
        std::fs::write(&path, changed).expect("written");
        let found = texts(&Store::merged(&read()).expect_err("changed"));
        assert!(found[0].1.contains(expected), "{found:?}");
    };
    let failed =
        format!("\"runs_failed\": {}", Findings::parse(&text).expect("findings").runs_failed);
    assert!(text.contains(&failed));
    check(&text.replace(&failed, "\"runs_failed\": 99"), "findings of seed 4 differ between");
    check(&text.replace("\"runs_made\": 2", "\"runs_made\": 1"), "does not have all runs");
    check(&text.replace("\"cycles\": 150", "\"cycles\": 160"), "of another campaign");
    check(&text[..text.len() / 2], "is damaged");
    check(&text.replace("\"format\": 2", "\"format\": 1"), "has format 1");
    folders.iter().for_each(|folder| std::fs::remove_dir_all(folder).expect("its own"));
}
