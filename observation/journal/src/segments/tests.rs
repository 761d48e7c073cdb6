//! Segments that are listed, packed and removed while they are read.

use std::io::Read as _;

use understudy_testing::Folder;

use super::*;

fn lines(path: &Path) -> Vec<u64> {
    let mut text = String::new();
    for opened in OpenSegments::of(path).expect("readable") {
        let (_, mut file) = opened.expect("readable");
        file.read_to_string(&mut text).expect("text");
    }
    assert!(text.is_empty() || text.ends_with('\n'));
    text.lines()
        .filter(|line| !line.starts_with('{'))
        .map(|line| line.trim_end_matches('x').parse().expect("a number"))
        .collect()
}

/// The oldest whole line that is there now.
fn oldest_line(path: &Path) -> Option<u64> {
    OpenSegments::of(path).expect("readable").find_map(|opened| {
        let (_, file) = opened.expect("readable");
        let lines = BufReader::new(file).lines().map(|line| line.expect("text"));
        let mut lines = lines.filter(|line| !line.starts_with('{'));
        lines.next()?.trim_end_matches('x').parse().ok()
    })
}

fn size(path: &Path) -> u64 {
    let files = segments_of(path).expect("readable");
    files.iter().map(|file| size_of(file)).sum()
}

#[test]
fn the_newest_lines_are_kept_whole_and_the_limit_holds() {
    let folder = Folder::new("segments");
    let path = folder.join("journal.jsonl");
    let mut segments = Segments::create(&path, LEAST_LIMIT).expect("created");
    let filler = "x".repeat(100);
    for number in 0..5000 {
        // In pieces, as a writer of JSON does.
        write!(segments, "{number}").expect("written");
        segments.write_all(filler.as_bytes()).expect("written");
        segments.write_all(b"\n").expect("written");
        if number % 512 == 0 {
            segments.flush().expect("written");
            assert!(size(&path) <= LEAST_LIMIT + 200, "{}", size(&path));
        }
    }
    segments.flush().expect("written");
    let kept = lines(&path);
    let first = 5000 - kept.len() as u64;
    assert_eq!(kept, (first..5000).collect::<Vec<_>>());
    assert!(kept.len() as u64 * 100 > LEAST_LIMIT / 2);
    drop(segments);
    // One that starts again goes on, and loses nothing that is within the limit.
    let mut segments = Segments::create(&path, LEAST_LIMIT * 2).expect("created");
    writeln!(segments, "5000").expect("written");
    segments.flush().expect("written");
    assert_eq!(lines(&path).last(), Some(&5000));
    assert!(lines(&path).len() > kept.len() / 2);
}

/// Between two steps of a reader a segment is closed, packed, or removed as the oldest.
#[test]
fn whatever_happens_between_listing_and_opening_each_line_is_read_once() {
    for taken in 0..6 {
        let folder = Folder::new("segments-between");
        let path = folder.join("journal.jsonl");
        let write = |number: u64, text: u64| {
            let closed = closed_path(&path, number);
            fs::write(&closed, format!("{text}\n")).expect("written");
            closed
        };
        let texts: Vec<PathBuf> = (1..5).map(|number| write(number, number)).collect();
        fs::write(&path, "5\n").expect("written");
        let mut segments = OpenSegments::of(&path).expect("readable");
        let mut read = String::new();
        let mut take = |(_, mut file): (bool, SegmentFile)| {
            file.read_to_string(&mut read).expect("text");
        };
        segments.by_ref().take(taken).for_each(|opened| take(opened.expect("readable")));
        // The first is removed, all others are packed, and the newest is closed and packed too.
        fs::remove_file(&texts[0]).expect("removed");
        texts[1..].iter().for_each(|text| pack(text));
        let closed = closed_path(&path, 5);
        fs::rename(&path, &closed).expect("closed");
        pack(&closed);
        fs::write(&path, "6\n").expect("written");
        segments.for_each(|opened| take(opened.expect("readable")));
        let read: Vec<u64> = read.lines().map(|line| line.parse().expect("a number")).collect();
        let first = if taken == 0 { 2 } else { 1 };
        let last = if taken >= 5 { 5 } else { 6 };
        assert_eq!(read, (first..=last).collect::<Vec<_>>(), "after {taken} segments");
    }
}

/// A journal that is written all the time.
#[test]
fn readers_of_a_journal_that_is_written_lose_no_line() {
    let folder = Folder::new("segments-live");
    let path = folder.join("journal.jsonl");
    let written = Segments::create(&path, 1 << 22).expect("created");
    std::thread::scope(|scope| {
        let writer = scope.spawn(move || {
            let mut segments = written;
            for number in 0..60_000 {
                writeln!(segments, "{number}{}", "x".repeat(90)).expect("written");
            }
            segments.flush().expect("written");
            segments
        });
        let mut reads = 0;
        while !writer.is_finished() || reads == 0 {
            let mut text = String::new();
            for opened in OpenSegments::of(&path).expect("readable") {
                let (_, mut file) = opened.expect("readable");
                file.read_to_string(&mut text).expect("text");
            }
            let whole = text.rfind('\n').map_or("", |end| &text[..=end]);
            let lines = whole.lines().filter(|line| !line.starts_with('{'));
            let numbers: Vec<u64> =
                lines.map(|line| line.trim_end_matches('x').parse().expect("whole")).collect();
            assert!(numbers.windows(2).all(|two| two[0] < two[1]), "in order, once");
            // Lines that are missing went as the oldest ones, while older ones were read.
            let gap = numbers.windows(2).rfind(|two| two[0] + 1 != two[1]);
            if let Some([_, after]) = gap {
                let oldest = oldest_line(&path);
                assert!(oldest.is_none_or(|oldest| oldest >= *after), "{gap:?}, {oldest:?}");
            }
            reads += 1;
        }
        drop(writer.join().expect("no panic"));
    });
}

#[test]
fn what_is_no_file_is_refused_and_does_not_block() {
    let folder = Folder::new("segments-devices");
    let path = folder.join("journal.jsonl");
    std::os::unix::fs::symlink("/dev/zero", &path).expect("a link");
    assert!(SegmentFile::open(&path).is_err());
    std::os::unix::fs::symlink("/dev/zero", closed_path(&path, 1)).expect("a link");
    let opened: Vec<bool> =
        OpenSegments::of(&path).expect("readable").take(3).map(|opened| opened.is_ok()).collect();
    assert_eq!(opened, [false, false]);
}

#[test]
fn a_segment_that_went_while_it_was_packed_does_not_come_back() {
    let folder = Folder::new("segments-went");
    let [text, packed] = ["a.000001.jsonl", "a.000001.packed"].map(|name| folder.join(name));
    fs::write(&text, "1\n").expect("written");
    pack_file(&text, &packed).expect("packed");
    fs::remove_file(&text).expect("removed");
    pack(&text);
    assert!(!packed.exists());
    // One whose writer was killed between both.
    fs::write(&text, "1\n").expect("written");
    pack_file(&text, &packed).expect("packed");
    assert_eq!(lines(&folder.join("a.jsonl")), [1]);
    pack(&text);
    assert!(packed.exists() && !text.exists());
    assert_eq!(lines(&folder.join("a.jsonl")), [1]);
}

#[test]
fn other_files_of_the_folder_are_left_alone() {
    let folder = Folder::new("segments-others");
    for name in ["journal.jsonl.bak", "journal.1.jsonl", "summary.000001.json"] {
        fs::write(folder.join(name), "kept").expect("written");
    }
    let path = folder.join("journal.jsonl");
    let mut segments = Segments::create(&path, 0).expect("created");
    for number in 0..10_000 {
        writeln!(segments, "{number}xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx").expect("written");
    }
    for name in ["journal.jsonl.bak", "journal.1.jsonl", "summary.000001.json"] {
        let text = fs::read_to_string(folder.join(name));
        assert_eq!(text.expect("it is there"), "kept");
    }
}
