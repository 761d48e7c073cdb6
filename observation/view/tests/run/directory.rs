//! A run in its directory, while it is written and afterwards.

use std::fs;

use understudy_cluster::press_cell;
use understudy_journal::{Journal, keep_cluster, place_before};
use understudy_testing::Folder;
use understudy_view::{Bounds, Filter, Run, find_run_of};

use crate::support::{KILL_EACH, cell, model, records, scenario};

/// Who follows a journal of a few segments knows at the end what one knows who reads it then, or who was handed its records.
#[test]
fn a_run_is_followed_while_it_is_written() {
    let cell = cell();
    let folder = Folder::new("view-run");
    let source = folder.join("source");
    fs::create_dir_all(&source).expect("a folder");
    for file in press_cell() {
        fs::write(source.join(file.name), file.text).expect("written");
    }
    let path = folder.join("runs/2026-01-01T00-00-00Z");
    fs::create_dir_all(&path).expect("a folder");
    assert_eq!(Run::open(&path).expect_err("no run").code(), "U0570");
    keep_cluster(&path, &source.join("cluster.toml"), &cell).expect("kept");

    let run = Run::open(&path).expect("a run that begins");
    let mut follower = run.follow();
    let mut followed = run.model(Bounds::default());
    let scenario = scenario(&cell, KILL_EACH);
    let mut journal = Journal::create(&path.join("journal.jsonl"), 1_500_000).expect("created");
    for (number, record) in records(&cell, &scenario, 1).iter().enumerate() {
        journal.write(record);
        if number % 700 == 0 {
            journal.flush();
            follower.poll(&mut |record| followed.note(&record.expect("a record")));
        }
    }
    assert_eq!(journal.finish().lost, 0);
    while follower.poll(&mut |record| followed.note(&record.expect("a record"))) > 0 {}
    let segments = fs::read_dir(&path).expect("readable").count();
    assert!(segments > 3, "{segments}");

    let read = run.read(Bounds::default()).expect("readable");
    let handed = model(&cell, &scenario, 1);
    assert_eq!(followed.snapshot(), read.snapshot());
    assert_eq!(handed.snapshot(), read.snapshot());
    let events = |model: &understudy_view::Model| model.events().cloned().collect::<Vec<_>>();
    assert_eq!(events(&followed), events(&read));
    assert_eq!(events(&handed), events(&read));

    // What is asked of one cycle needs no more than the cycles before it.
    let few = Bounds { cycles: 200, ..Bounds::default() };
    let part = run.read_until(few, 140).expect("readable");
    let why = part.why("press.move_down", Some(140)).expect("known");
    assert_eq!(why, read.why("press.move_down", Some(140)).expect("known"));
    let late = run.read(few).expect("readable");
    assert_eq!(late.why("press.move_down", Some(20)).expect_err("forgotten").code(), "U0575");

    // A list counts cycles from the origin also before it was told.
    let first = run
        .listing(Filter::default())
        .map(|(mut listing, mut source)| {
            let mut first = None;
            source.poll(&mut |record| {
                let lines = listing.take(&record.expect("a record"));
                first = first.take().or(lines.into_iter().next());
            });
            first
        })
        .expect("no filter");
    assert!(first.and_then(|line| line.cycle).is_some_and(|cycle| cycle < 0));
    let found = find_run_of(&folder.join("runs"), &cell).expect("the newest");
    assert_eq!(found.path(), path);
}

/// A question about one cycle of a long run is answered from a checkpoint as from the first record, wherever it lies: in a packed segment, in
/// one that is still text, or in the file that is written.
#[test]
fn a_cycle_is_found_without_reading_what_is_before() {
    let folder = Folder::new("run-places");
    let cell = cell();
    let source = folder.join("source");
    fs::create_dir_all(&source).expect("a folder");
    for file in press_cell() {
        fs::write(source.join(file.name), file.text).expect("written");
    }
    let path = folder.join("run");
    fs::create_dir_all(&path).expect("a folder");
    keep_cluster(&path, &source.join("cluster.toml"), &cell).expect("kept");
    let journal = path.join("journal.jsonl");
    let mut writer = Journal::create(&journal, 8 << 20).expect("created");
    let plain = scenario(&cell, "title = \"long\"\ncycles = 4000\n");
    for record in records(&cell, &plain, 1) {
        writer.write(&record);
    }
    assert_eq!(writer.finish().lost, 0);
    let run = Run::open(&path).expect("a run");
    let whole = run.read(Bounds::default()).expect("readable");
    for cycle in [0, 700, 1500, 2500, 3300, 3999] {
        let place = place_before(&journal, cycle).expect("readable");
        if cycle >= 700 {
            let found = place.expect("a checkpoint").cycle;
            assert!((cycle - 400..=cycle).contains(&found), "{found} for {cycle}");
        }
        for signal in ["press.move_down", "robot.grip"] {
            let (near, far) = (run.why(signal, Some(cycle)), whole.why(signal, Some(cycle)));
            assert_eq!(near.expect("known"), far.expect("known"), "{signal} in {cycle}");
        }
    }
    // A list of some cycles begins there, and is the same as the part of a list of all.
    let lines = |from, to| {
        let filter = Filter { from, to, ordinary: true, ..Filter::default() };
        let (mut listing, mut source) = run.listing(filter).expect("no names");
        let (mut lines, mut records) = (Vec::new(), 0);
        let mut taken = 1;
        while taken > 0 && !listing.is_past() {
            taken = source.poll(&mut |record| {
                lines.extend(listing.take(&record.expect("a record")));
            });
            records += taken;
        }
        (lines, records)
    };
    let (all, whole_journal) = lines(Some(0), None);
    for from in [0, 900, 2500, 3990] {
        let (some, read) = lines(Some(from), Some(from + 5));
        let part = all.iter().filter(|line| {
            let cycle = line.cycle.expect("counted");
            (from..=from + 5).contains(&cycle)
        });
        assert_eq!(some, part.cloned().collect::<Vec<_>>(), "from {from}");
        assert!(from < 3000 || read < whole_journal / 3, "{read} of {whole_journal}");
    }
    let newest = run.why("robot.grip", None).expect("known");
    assert_eq!(newest, whole.why("robot.grip", None).expect("known"));
}
