use std::io::Write;

use understudy_bus::Segments;
use understudy_scenarios::{Happening, RunEvent};

use super::*;

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("understudy-{name}-{}", std::process::id()));
    // It is there only where a run before was killed.
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder");
    folder
}

fn line(number: u64) -> Vec<u8> {
    let record = Record::of_run(number, RunEvent::Interrupted);
    let mut line = serde_json::to_vec(&record).expect("JSON");
    line.push(b'\n');
    line
}

/// Numbers of all records that are there now; `None` stands for a trouble.
fn taken(follower: &mut Follower) -> Vec<Option<u64>> {
    let mut all = Vec::new();
    while follower.poll(&mut |found| {
        all.push(found.ok().map(|record| {
            assert!(matches!(
                record.event,
                Happening::Run(RunEvent::Interrupted)
            ));
            record.at_ns
        }));
    }) > 0
    {}
    all
}

/// Whatever is written between two looks, and however often segments are closed meanwhile, each record comes once and in order.
#[test]
fn a_journal_is_followed_through_its_segments() {
    let folder = folder("follow");
    let path = folder.join("journal.jsonl");
    let mut follower = Follower::new(&path);
    assert_eq!(taken(&mut follower), []);
    let mut segments = Segments::create(&path, 0).expect("created");
    let mut next = 0;
    let mut seen = Vec::new();
    for round in 0..60_u64 {
        // From nothing to a few segments at once, cut within a line.
        let mut bytes = Vec::new();
        for _ in 0..round * 7 % 90 {
            bytes.extend(line(next));
            next += 1;
        }
        let cut = bytes.len() / 3;
        segments.write_all(&bytes[..cut]).expect("written");
        segments.flush().expect("written");
        seen.extend(taken(&mut follower));
        let mut rest = &bytes[cut..];
        while !rest.is_empty() {
            let written = segments.write(rest).expect("written");
            rest = &rest[written..];
        }
        segments.flush().expect("written");
        seen.extend(taken(&mut follower));
    }
    let expected: Vec<Option<u64>> = (0..next).map(Some).collect();
    assert_eq!(seen.len(), expected.len());
    assert_eq!(seen, expected);
    assert!(closed_segments(&path).expect("readable").len() > 3);
    fs::remove_dir_all(folder).expect("it goes");
}

/// Who comes too late is told that something is gone, once, and goes on with what is left.
#[test]
fn what_is_gone_is_said() {
    let folder = folder("follow-late");
    let path = folder.join("journal.jsonl");
    let mut segments = Segments::create(&path, 0).expect("created");
    let write = |segments: &mut Segments, numbers: std::ops::Range<u64>| {
        for number in numbers {
            let line = line(number);
            let mut rest = line.as_slice();
            while !rest.is_empty() {
                let written = segments.write(rest).expect("written");
                rest = &rest[written..];
            }
        }
        segments.flush().expect("written");
    };
    let mut early = Follower::new(&path);
    write(&mut segments, 0..50);
    assert_eq!(taken(&mut early).len(), 50);
    write(&mut segments, 50..5000);
    for mut follower in [early, Follower::new(&path)] {
        let seen = taken(&mut follower);
        assert_eq!(seen.iter().filter(|number| number.is_none()).count(), 1);
        let numbers: Vec<u64> = seen.into_iter().flatten().collect();
        let first = 5000 - numbers.len() as u64;
        // The one who was early has the rest of the file that he had open.
        let unbroken = numbers.iter().rev().zip((0..5000).rev());
        let unbroken = unbroken
            .take_while(|(seen, number)| **seen == *number)
            .count();
        assert!(unbroken > 200, "{unbroken} of {first}");
        assert!(numbers.is_sorted());
    }
    fs::remove_dir_all(folder).expect("it goes");
}

#[test]
fn what_is_no_record_is_left_out() {
    let folder = folder("follow-bad");
    let path = folder.join("journal.jsonl");
    let mut bytes = line(0);
    bytes.extend(b"{\"at_ns\":1}\n\n\xff\xfe\n");
    bytes.extend(vec![b'x'; 3 * LONGEST_LINE]);
    bytes.push(b'\n');
    bytes.extend(line(1));
    bytes.extend(b"{\"at_ns\"");
    fs::write(&path, bytes).expect("written");
    let mut follower = Follower::new(&path);
    assert_eq!(taken(&mut follower), [Some(0), None, None, None, Some(1)]);
    fs::remove_dir_all(folder).expect("it goes");
}
