//! A model that begins in the middle of a journal knows the present as one that has read everything.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use rand::RngExt;
use rand::seq::IndexedRandom;
use rand_pcg::Pcg64;
use serde_json::Value;
use understudy_cluster::{Cluster, press_cell};
use understudy_journal::{Journal, Record, keep_cluster};
use understudy_testing::Folder;
use understudy_view::{Bounds, Following, Model, RemoteIoState, Run, Source};

use crate::support::{cell, example, records, scenario};

const CYCLES: u64 = 1200;

/// Steps that no member refuses, at random cycles.
pub(crate) fn random_scenario(random: &mut Pcg64) -> String {
    let stations = ["press", "robot", "understudy"];
    let remote_ios = ["press-io", "robot-io"];
    let mut text = format!("title = \"at random\"\ncycles = {CYCLES}\nseed = 1\n");
    let mut step = |at: u64, action: &str, station: &str, more: &str| {
        text += &format!(
            "[[step]]\nat = {at}\naction = \"{action}\"\nstation = \"{station}\"\n{more}\n"
        );
    };
    // What each member is, and the action that ends it.
    let mut down: BTreeMap<&str, &str> = BTreeMap::new();
    let mut cut: Vec<(&str, &str)> = Vec::new();
    let mut at = 20;
    while at < CYCLES - 20 {
        at += random.random_range(3..20);
        let any: Vec<&str> = stations.iter().chain(&remote_ios).copied().collect();
        let member = *any.choose(random).expect("some");
        let station = *stations.choose(random).expect("some");
        let remote_io = *remote_ios.choose(random).expect("some");
        match random.random_range(0..12) {
            0..4 if !down.contains_key(member) && (down.is_empty() || random.random_bool(0.2)) => {
                let (action, end) = [("crash", "restart"), ("stop", "continue")]
                    [usize::from(random.random_bool(0.3))];
                step(at, action, member, "");
                down.insert(member, end);
            }
            0..7 => {
                if let Some((member, end)) = down.pop_first() {
                    step(at, end, member, "");
                }
            }
            7 if !cut.contains(&(station, remote_io)) => {
                step(at, "cut", station, &format!("to = \"{remote_io}\""));
                cut.push((station, remote_io));
            }
            7 | 8 => {
                if let Some((station, remote_io)) = cut.pop() {
                    step(at, "heal", station, &format!("to = \"{remote_io}\""));
                }
            }
            9 if !down.contains_key(station) => {
                let more = "program = \"press\"\nbit = 0";
                if station != "robot" {
                    step(at, "flip-state", station, more);
                }
            }
            10 if !down.contains_key("robot-io") => {
                let more = "input = \"part_present\"\nvalue = true";
                step(at, "set", "robot-io", more);
            }
            _ if !down.contains_key(remote_io) => step(at, "release", remote_io, ""),
            _ => {}
        }
    }
    text
}

/// A run of the press cell.
fn run_of(folder: &Folder, cell: &Cluster, records: &[Record]) -> Run {
    let source = folder.join("source");
    fs::create_dir_all(&source).expect("a folder");
    for file in press_cell() {
        fs::write(source.join(file.name), file.text).expect("written");
    }
    run_of_file(folder, &source.join("cluster.toml"), cell, records)
}

/// A run of a journal in small segments, of which the oldest may be gone.
fn run_of_file(folder: &Folder, file: &Path, cell: &Cluster, records: &[Record]) -> Run {
    let path = folder.join("run");
    fs::create_dir_all(&path).expect("a folder");
    keep_cluster(&path, file, cell).expect("kept");
    let mut writer = Journal::create(&path.join("journal.jsonl"), 1_200_000).expect("created");
    records.iter().for_each(|record| writer.write(record));
    assert_eq!(writer.finish().lost, 0);
    Run::open(&path).expect("a run")
}

fn read(run: &Run, mut source: Source) -> Model {
    let mut model = run.model(Bounds::default());
    while source.poll(&mut |record| model.note(&record.expect("a record"))) > 0 {}
    model
}

/// What a model says of its newest cycle, without what it says only of what it has read.
fn present(model: &Model) -> Value {
    let mut snapshot = serde_json::to_value(model.snapshot()).expect("JSON");
    let fields = snapshot.as_object_mut().expect("an object");
    let of_what_was_read =
        ["alarms", "events", "host_stalls", "left_out", "read_from", "records", "timing"];
    for of_what_was_read in of_what_was_read {
        assert!(fields.remove(of_what_was_read).is_some());
    }
    // Whether another remote I/O received the station when it was said: otherwise both causes are named.
    let programs = snapshot["programs"].as_array_mut().expect("a list");
    for program in programs {
        let lacking = program["protection"]["lacking"].as_array_mut();
        for lacking in lacking.into_iter().flatten() {
            lacking["text"].take();
            lacking["link"].take();
        }
    }
    snapshot
}

/// Alarms that last, without when they were raised. Wrong outputs and words of before are found only by who has read the samples of then.
fn lasting(model: &Model) -> Vec<(String, &'static str, Option<String>)> {
    let found_with_samples = ["wrong", "word-differs"];
    let alarms = model
        .alarms()
        .filter(|alarm| alarm.over.is_none() && !found_with_samples.contains(&alarm.alarm));
    let snapshot = model.snapshot();
    let programs = snapshot.programs.iter().map(|program| &program.program);
    let is_away = [RemoteIoState::Suspended, RemoteIoState::Killed, RemoteIoState::NotReporting];
    let reporting = programs.zip(&snapshot.remote_ios);
    let reporting: Vec<&String> = reporting
        .filter(|(_, remote_io)| !is_away.contains(&remote_io.state))
        .map(|(program, _)| program)
        .collect();
    let mut found = Vec::new();
    for alarm in alarms {
        // Stations that fail or return after the report are found from what its remote I/O receives.
        for program in &alarm.programs {
            let is_known = alarm.alarm != "unprotected" || reporting.contains(&program);
            let cause = is_known.then(|| alarm.name.clone());
            found.push((program.clone(), alarm.alarm, cause));
        }
        if alarm.programs.is_empty() {
            found.push((alarm.name.clone(), alarm.alarm, None));
        }
    }
    found.sort();
    found.dedup();
    found
}

#[test]
fn the_present_is_known_from_the_middle_of_a_journal() {
    let cell = cell();
    for seed in 0..4 {
        let folder = Folder::new("run-past");
        let text = random_scenario(&mut Pcg64::new(seed, 1));
        let records = records(&cell, &scenario(&cell, &text), 1);
        let run = run_of(&folder, &cell, &records);
        let mut whole = run.model(Bounds::default());
        records.iter().for_each(|record| whole.note(record));
        assert_eq!(whole.read_from(), None);
        let mut begun = Vec::new();
        for cycle in (0..CYCLES as i64 + 500).step_by(50) {
            let Some(source) = run.follow_from(cycle) else {
                continue;
            };
            let model = read(&run, source);
            let from = model.read_from().expect("not from the first record");
            if begun.last() == Some(&from) {
                continue;
            }
            begun.push(from);
            // Nothing is present where all remote I/Os have ended before.
            let Some(oldest) = model.oldest() else {
                continue;
            };
            let context = format!("seed {seed} from cycle {from}:\n{text}");
            pretty(&present(&whole), &present(&model), &context);
            assert_eq!(lasting(&whole), lasting(&model), "{context}");
            // The same also of cycles that are past.
            let known = from.max(oldest);
            for cycle in (known + 80..CYCLES as i64).step_by(7) {
                let at = |model: &Model| model.snapshot_at(cycle).map(|found| found.stations);
                assert_eq!(at(&whole), at(&model), "cycle {cycle} {context}");
            }
        }
        assert!(begun.len() > 1, "{begun:?}");
    }
}

/// Deadlines of a twin count as those of its remote I/O, for a reader that begins where either of the two is the author.
#[test]
fn the_present_is_known_whichever_remote_io_drives() {
    let cell = example("twin-remote-io");
    let file =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/twin-remote-io/cluster.toml");
    let mut text = format!("title = \"switchovers\"\ncycles = {CYCLES}\nseed = 1\n");
    for (at, action, station) in [
        (100, "crash", "robot-io"),
        (500, "restart", "robot-io"),
        (800, "stop", "robot-io-2"),
        (830, "continue", "robot-io-2"),
        (900, "crash", "press-io"),
    ] {
        text += &format!("[[step]]\nat = {at}\naction = \"{action}\"\nstation = \"{station}\"\n");
    }
    let records = records(&cell, &scenario(&cell, &text), 1);
    let folder = Folder::new("run-past-twins");
    let run = run_of_file(&folder, &file, &cell, &records);
    let mut whole = run.model(Bounds::default());
    records.iter().for_each(|record| whole.note(record));
    let mut begun = Vec::new();
    for cycle in (0..CYCLES as i64 + 500).step_by(50) {
        let Some(source) = run.follow_from(cycle) else {
            continue;
        };
        let model = read(&run, source);
        begun.extend(model.read_from());
        let context = format!("from cycle {:?}:\n{text}", model.read_from());
        pretty(&present(&whole), &present(&model), &context);
        assert_eq!(lasting(&whole), lasting(&model), "{context}");
    }
    begun.dedup();
    let drives = |twin: bool| begun.iter().any(|from| (150..800).contains(from) == twin);
    assert!(begun.len() > 2 && drives(true) && drives(false), "{begun:?}");
}

#[test]
fn the_past_of_a_long_run_is_read_behind_its_present() {
    let cell = cell();
    let folder = Folder::new("run-behind");
    let text = random_scenario(&mut Pcg64::new(7, 1));
    let records = records(&cell, &scenario(&cell, &text), 1);
    let run = run_of(&folder, &cell, &records);
    let whole = run.read(Bounds::default()).expect("readable");
    let (mut model, mut following) = Following::of(&run, Bounds::default());
    while following.poll(&mut |found| model.take_found(found)) > 0 {}
    assert!(following.progress().is_at_end());
    assert!(model.read_from() > whole.read_from(), "{model:?}");
    pretty(&present(&whole), &present(&model), &text);
    assert!(following.past_percent().is_some_and(|percent| percent < 100));
    let read = loop {
        if let Some(read) = following.read_past() {
            break read;
        }
    };
    assert_eq!(read.snapshot(), whole.snapshot());
    assert_eq!(following.past_percent(), None);
    assert_eq!(following.poll(&mut |_| ()), 0);
    assert!(following.progress().is_at_end());
}

/// Compares member by member, so that a difference can be read.
fn pretty(whole: &Value, part: &Value, context: &str) {
    for (key, of_whole) in whole.as_object().expect("an object") {
        assert_eq!(of_whole, &part[key], "{key} {context}");
    }
}
