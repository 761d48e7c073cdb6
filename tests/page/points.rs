//! The page of a run in which an online change has replaced inputs and outputs: each cycle by those that counted in it.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use understudy_cluster::{ChangeTexts, Cluster};
use understudy_journal::{Happening, Journal, Members, Record, RunEvent, keep_cluster};
use understudy_remote_io::Event;
use understudy_typed::Points;
use understudy_wire::{Cycle, Epoch, Image, Member, Moment, ProgramId, Source, StationSet};

use crate::browser::{browser, drive_page};
use crate::{Page, empty_folder, one_at_a_time};

const FILE: &str = "[cluster]\nname = \"points\"\nsecurity = \"off\"\n\n[[controller]]\nname = \"one\"\nladder = \"one.st\"\n\n[[remote_io]]\ncontroller = \"one\"\n";
const BEFORE: &str = "PROGRAM one\n  VAR_INPUT go : BOOL; step : INT; END_VAR\n  VAR_OUTPUT shown : INT; done : BOOL; END_VAR\n  shown := step;\n  done := go;\nEND_PROGRAM\n";
const AFTER: &str = "PROGRAM one\n  VAR_INPUT more : INT; step : INT; END_VAR\n  VAR_OUTPUT alarm : BOOL; shown : INT; END_VAR\n  shown := step + more;\nEND_PROGRAM\n";

/// The first cycle of the new program, and the one after the last.
const SWITCH: u64 = 100;
const END: u64 = 200;

/// The values of a cycle by name: those of the version of the program that ran in it.
fn values(cycle: u64) -> Vec<(&'static str, u64)> {
    let step = cycle % 50;
    match cycle < SWITCH {
        true => vec![("go", 1), ("step", step), ("shown", step), ("done", 1)],
        false => vec![("more", 1000), ("step", step), ("alarm", 1), ("shown", step + 1000)],
    }
}

/// The directory of the run.
fn changed_run(folder: &Path) -> PathBuf {
    let file = folder.join("cluster.toml");
    fs::write(&file, FILE).expect("written");
    fs::write(folder.join("one.st"), BEFORE).expect("written");
    let clusters = [BEFORE, AFTER].map(|program| -> Cluster {
        let read = understudy_cluster::read("cluster.toml", FILE, &mut |_| Ok(program.to_owned()));
        read.cluster.expect("a cluster")
    });
    let run = folder.join("runs/changed");
    fs::create_dir_all(&run).expect("a folder");
    keep_cluster(&run, &file, &clusters[0]).expect("kept");
    let mut journal = Journal::create(&run.join("journal.jsonl"), 1_000_000).expect("created");
    let members = Members::of(&clusters[0]);
    let moment = |cycle| Moment { epoch: Epoch(1), cycle: Cycle(cycle) };
    let texts = ChangeTexts::between(&clusters[0], &clusters[1]).expect("an online change");
    journal.write(&Record::of_run(0, RunEvent::ChangeLoaded { texts: Box::new(texts) }));
    for cycle in 0..END {
        let version = usize::from(cycle >= SWITCH);
        let controller = &clusters[version].controllers()[0];
        let at_ns = cycle * 10_000_000;
        let mut note = |event| {
            let member = Member::RemoteIo(ProgramId(0));
            journal.write(&Record::of_member(at_ns, member, &members, Happening::RemoteIo(event)));
        };
        if cycle == SWITCH {
            let [from, to] = [0, 1].map(|side: usize| clusters[side].controllers()[0].hash);
            note(Event::PointsChanged { moment: moment(cycle), from, to });
        }
        let image = |points: &Points| {
            let mut image = Image::zero(points.width());
            for (name, value) in values(cycle) {
                points.find(name).into_iter().for_each(|it| it.set(image.words_mut(), value));
            }
            image
        };
        note(Event::Applied {
            moment: moment(cycle),
            sampled: Some(image(&controller.interface.inputs)),
            outputs: image(&controller.interface.outputs),
            driven: None,
            source: Source::Direct,
            word_of: None,
            missing: None,
            points: Some(controller.hash),
            heard: StationSet::EMPTY,
        });
        if cycle == 0 {
            journal.write(&Record::of_run(0, RunEvent::Origin { moment: moment(0), cycle: 0 }));
        }
    }
    journal.write(&Record::of_run(END * 10_000_000, RunEvent::Finished));
    assert_eq!(journal.finish().lost, 0);
    run
}

/// A value as the page has it.
fn shown(name: &str, value: u64) -> Value {
    match name {
        "go" | "done" | "alarm" => json!(value == 1),
        _ => json!(value),
    }
}

#[test]
fn each_cycle_has_the_points_that_counted_in_it() {
    let run = changed_run(&empty_folder("points"));
    let page = Page::of_run(&run);
    for cycle in [10, SWITCH - 1, SWITCH, END - 1] {
        let state = page.get(&format!("/api/state?cycle={cycle}")).json();
        let program = &state["programs"][0];
        let facts = page.get(&format!("/api/points/0?cycle={cycle}")).json();
        assert_eq!(program["points"], facts["points"], "{cycle}");
        let mut found = Vec::new();
        for (side, values) in [("inputs", "input_values"), ("outputs", "output_values")] {
            let names = facts[side].as_array().expect("signals").iter();
            let values = program[values].as_array().expect("values").iter();
            assert_eq!(names.len(), values.len(), "{cycle}");
            found.extend(
                names.zip(values).map(|(signal, value)| (signal["name"].clone(), value.clone())),
            );
        }
        found.retain(|(name, _)| !name.as_str().is_some_and(|name| name.starts_with("program.")));
        let expected =
            values(cycle).into_iter().map(|(name, value)| (json!(name), shown(name, value)));
        assert_eq!(found, expected.collect::<Vec<_>>(), "{cycle}");
        // The watch table by name.
        let asked = "/api/values?signals=0.output.shown,0.input.step";
        let answer = page.get(&format!("{asked}&cycle={cycle}")).json();
        let value = |wanted: &str| {
            let values = values(cycle);
            values.into_iter().find(|(name, _)| *name == wanted).map(|(_, value)| value)
        };
        assert_eq!(answer["values"], json!([value("shown"), value("step")]), "{cycle}");
    }
    // The facts of the run are those of its newest cycle.
    let facts = page.get("/api/run").json();
    assert_eq!(facts["programs"][0]["inputs"][0]["name"], "more");
    // A point that stays has one trend; one that is new begins with the change.
    let trends =
        page.get("/api/trends?signals=0.output.shown,0.output.alarm&from=90&to=110").json();
    let runs = |place: usize| trends["signals"][place]["runs"].as_array().expect("runs").clone();
    assert_eq!(runs(0)[0], json!([90, 40]));
    assert_eq!(runs(0)[10], json!([100, 1000]));
    assert_eq!(runs(1), [json!([90, null]), json!([100, 1])]);
    assert_eq!(page.get("/api/points/7?cycle=10").status, 404);
}

#[test]
fn a_browser_replays_a_change_of_points() {
    let Some(browser) = browser() else {
        return;
    };
    let _turn = one_at_a_time();
    let folder = empty_folder("points-browser");
    let page = Page::of_run(&changed_run(&folder));
    drive_page(&browser, &page, &folder, "points.mjs", Vec::new());
}
