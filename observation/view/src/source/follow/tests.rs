use std::io::Write;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use understudy_journal::{Happening, RunEvent, Segments, WrongVersion, journal_header};
use understudy_testing::Folder;

use super::*;

fn line(number: u64) -> Vec<u8> {
    // What cannot be packed, so that the limit is reached.
    let verdict = format!("{:x}", number.wrapping_mul(0x9e37_79b9_7f4a_7c15)).repeat(2);
    let record = Record::of_run(number, RunEvent::ScenarioOver { verdict });
    let mut line = serde_json::to_vec(&record).expect("JSON");
    line.push(b'\n');
    line
}

/// Numbers of all records that are there now; `None` stands for a trouble.
fn taken(follower: &mut Follower) -> Vec<Option<u64>> {
    let mut all = Vec::new();
    while follower.poll(&mut |found| {
        all.push(found.ok().map(|record| {
            assert!(matches!(record.event, Happening::Run(RunEvent::ScenarioOver { .. })));
            record.at_ns
        }));
    }) > 0
    {}
    all
}

/// Whatever is written between two looks, and however often segments are closed meanwhile, each record comes once and in order.
#[test]
fn a_journal_is_followed_through_its_segments() {
    let folder = Folder::new("follow");
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
}

/// Who comes too late is told that something is gone, once, and goes on with what is left.
#[test]
fn what_is_gone_is_said() {
    let folder = Folder::new("follow-late");
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
        let unbroken = unbroken.take_while(|(seen, number)| **seen == *number).count();
        assert!(unbroken > 200, "{unbroken} of {first}");
        assert!(numbers.is_sorted());
    }
}

#[test]
fn what_is_no_record_is_left_out() {
    let folder = Folder::new("follow-bad");
    let path = folder.join("journal.jsonl");
    let mut bytes = [journal_header(1), line(0)].concat();
    bytes.extend(b"{\"at_ns\":1}\n\n\xff\xfe\n");
    bytes.extend(vec![b'x'; 3 * LONGEST_LINE]);
    bytes.push(b'\n');
    bytes.extend(line(1));
    bytes.extend(b"{\"at_ns\"");
    fs::write(&path, bytes).expect("written");
    let mut follower = Follower::new(&path);
    assert_eq!(taken(&mut follower), [Some(0), None, None, None, Some(1)]);
}

#[test]
fn a_journal_of_another_version_is_refused_once() {
    let folder = Folder::new("follow-version");
    let path = folder.join("journal.jsonl");
    fs::write(&path, [line(0), line(1), line(2)].concat()).expect("written");
    let mut found = Vec::new();
    Follower::new(&path).poll(&mut |record| found.push(record));
    let wrong = WrongVersion { found: 1 };
    assert_eq!(found, [Err(Trouble::Version(wrong))]);
}

/// However a journal is cut and however often it is read, who is at the end has every record that was written before the poll, and who
/// reads on until nothing is left is at the end.
#[test]
fn only_the_end_is_taken_for_the_end() {
    for seed in 0..40 {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let folder = Folder::new(&format!("follow-end-{seed}"));
        let path = folder.join("journal.jsonl");
        let mut follower = Follower::new(&path);
        follower.piece = vec![0; random.random_range(1..2000)];
        let mut segments = Segments::create(&path, 0).expect("created");
        let (mut written, mut seen) = (0, 0);
        for _ in 0..60 {
            let lines = random.random_range(0..200_u64);
            let bytes: Vec<u8> = (written..written + lines).flat_map(line).collect();
            written += lines;
            let cut = random.random_range(0..=bytes.len());
            segments.write_all(&bytes[..cut]).expect("written");
            let flushed = random.random::<bool>();
            if flushed {
                segments.flush().expect("written");
            }
            let complete = bytes[..cut].iter().filter(|byte| **byte == b'\n').count() as u64;
            let complete = written - lines + complete;
            for _ in 0..random.random_range(0..4) {
                follower.poll(&mut |found| seen += u64::from(found.is_ok()));
                let is_at_end = follower.progress().is_at_end();
                assert!(!(flushed && is_at_end) || seen == complete, "seed {seed}: {seen}");
            }
            let mut rest = &bytes[cut..];
            while !rest.is_empty() {
                let now = segments.write(rest).expect("written");
                rest = &rest[now..];
            }
            // Nothing is to be rotated out before it is read.
            segments.flush().expect("written");
            seen += taken(&mut follower).iter().flatten().count() as u64;
            assert!(follower.progress().is_at_end(), "seed {seed}");
            assert_eq!(seen, written, "seed {seed}");
        }
    }
}

/// A folder of thousands of segments is listed a few times, and not once for each of them: that would take hours.
#[test]
#[allow(clippy::disallowed_methods, reason = "the duration is counted on the real clock")]
fn thousands_of_segments_are_read_in_seconds() {
    const SEGMENTS: u64 = 20_000;
    let folder = Folder::new("follow-thousands");
    let path = folder.join("journal.jsonl");
    for number in 1..=SEGMENTS {
        let closed = folder.join(format!("journal.{number:06}.jsonl"));
        fs::write(closed, [journal_header(number), line(number)].concat()).expect("written");
    }
    let text = [journal_header(SEGMENTS + 1), line(SEGMENTS + 1)].concat();
    fs::write(&path, text).expect("written");
    let begun = Instant::now();
    let mut follower = Follower::new(&path);
    let seen = taken(&mut follower);
    assert_eq!(seen, (1..=SEGMENTS + 1).map(Some).collect::<Vec<_>>());
    assert!(begun.elapsed() < Duration::from_secs(60), "{:?}", begun.elapsed());
    assert_eq!(follower.ahead().expect("readable"), 0);
}
