//! A gateway that attaches to a long run tells the present first, and in the end what one tells that has read everything.

use std::collections::BTreeSet;
use std::fs;
use std::time::{Duration, Instant};

use understudy_cluster::press_cell;
use understudy_cycle::Mode;
use understudy_gateway::{Followed, exposition_of};
use understudy_journal::{Journal, Members, keep_cluster};
use understudy_scenarios::{read, simulate};
use understudy_testing::Folder;
use understudy_view::{Bounds, Run};

const SCENARIO: &str = "title = \"long\"\ncycles = 3000\n\
    [[step]]\nat = 100\naction = \"crash\"\nstation = \"press\"\n\
    [[step]]\nat = 140\naction = \"restart\"\nstation = \"press\"\n\
    [[step]]\nat = 2500\naction = \"crash\"\nstation = \"robot\"\n";

#[test]
#[allow(clippy::disallowed_methods, reason = "a bound of the test")]
fn what_is_told_in_the_end_is_that_of_the_whole_journal() {
    let cell = understudy_testing::press_cell(Mode::Full);
    let folder = Folder::new("gateway-past");
    let source = folder.join("source");
    fs::create_dir_all(&source).expect("a folder");
    for file in press_cell() {
        fs::write(source.join(file.name), file.text).expect("written");
    }
    let path = folder.join("run");
    fs::create_dir_all(&path).expect("a folder");
    keep_cluster(&path, &source.join("cluster.toml"), &cell).expect("kept");
    let mut journal = Journal::create(&path.join("journal.jsonl"), 8 << 20).expect("created");
    let scenario = read("scenario.toml", SCENARIO, Some(&Members::of(&cell)));
    let scenario = scenario.scenario.expect("a scenario");
    simulate(&cell, &scenario, 1, &mut |record| journal.write(record)).expect("in step");
    assert_eq!(journal.finish().lost, 0);
    fs::write(path.join("summary.json"), "{}").expect("written");

    let run = Run::open(&path).expect("a run");
    assert!(run.follow_newest().is_some(), "it is long");
    let followed = Followed::new(&run).expect("a thread");
    let exposition = followed.exposition();
    let began = Instant::now();
    let told = loop {
        // Until its past is read it has no metrics, and the values of the present.
        if let Ok(told) = exposition() {
            break told;
        }
        if let Ok(present) = followed.observation() {
            assert_eq!(present.snapshot.programs[0].reconstructed, 500);
        }
        assert!(began.elapsed() < Duration::from_secs(60), "it is not read");
    };
    let counted = |text: &str| {
        let lines = text.lines().filter(|line| !line.contains("timestamp"));
        // Whether it has ended is known a moment later.
        let lines =
            lines.filter(|line| !line.contains("journal_age") && !line.contains("run_state"));
        // A family has its metrics in any order.
        lines.map(str::to_owned).collect::<BTreeSet<_>>()
    };
    let (told, whole) = (counted(&told), counted(&exposition_of(&run).expect("readable")));
    let differing: Vec<_> = told.symmetric_difference(&whole).collect();
    assert!(differing.is_empty(), "{differing:#?}");
    let read = run.read(Bounds::default()).expect("readable");
    let present = followed.observation().expect("current");
    assert_eq!(present.past_percent, None);
    assert_eq!(present.snapshot.alarms, read.snapshot().alarms);
    assert_eq!(followed.take_events(), []);
}
