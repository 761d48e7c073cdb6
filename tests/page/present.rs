//! The past is never shown as the present: readers that catch up with a long journal, and readers that were suspended while it grew.

use std::fs::{self, OpenOptions};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use understudy_journal::{SegmentFile, segments_of};

use crate::shared::DEADLINE;
use crate::{Page, empty_folder, member, one_at_a_time, simulated_run_of, understudy};

/// Longer than a reader may be away without noticing.
const AWAY: Duration = Duration::from_millis(2_200);

/// Cycles by which the page may stay behind the newest deadline.
const LAG_CYCLES: i64 = 3;

/// The robot is killed in its first cycles, and two thirds of the journal come later.
const SCENARIO: &str = "title = \"a long past\"\ncycles = 2400\n\n[[step]]\nat = 40\naction = \"crash\"\nstation = \"robot\"\n";

/// One of the processes that show a run.
struct Reader {
    process: Child,
    address: String,
}

impl Reader {
    fn start(arguments: &[&str], run: &Path, listen: &str) -> Self {
        let mut process = understudy(arguments)
            .arg(run)
            .args([listen, "127.0.0.1:0"])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the binary is built");
        let errors = process.stderr.take().expect("it is piped");
        let mut line = String::new();
        BufReader::new(errors).read_line(&mut line).expect("text");
        let address = line.trim().trim_end_matches('/').rsplit([' ', '/']);
        let address = address.into_iter().next().expect("an address").to_owned();
        Self { process, address }
    }

    fn signal(&self, signal: Signal) {
        let id = i32::try_from(self.process.id()).expect("a process id");
        kill(Pid::from_raw(id), signal).expect("it runs");
    }

    fn get(&self, path: &str) -> (u16, String) {
        let mut stream = TcpStream::connect(&self.address).expect("it listens");
        stream.set_read_timeout(Some(DEADLINE)).expect("a timeout");
        let host = &self.address;
        let request = format!("GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n");
        stream.write_all(request.as_bytes()).expect("sent");
        let mut text = String::new();
        stream.read_to_string(&mut text).expect("an answer");
        let (head, body) = text.split_once("\r\n\r\n").expect("a head");
        let status = head.split(' ').nth(1).expect("a status");
        (status.parse().expect("a number"), body.to_owned())
    }

    /// Input registers from 0 on, by Modbus; the exception where it answers with one.
    fn registers(&self, count: u8) -> Result<Vec<u16>, u8> {
        let mut stream = TcpStream::connect(&self.address).expect("it listens");
        stream.set_read_timeout(Some(DEADLINE)).expect("a timeout");
        stream.write_all(&[0, 7, 0, 0, 0, 6, 1, 4, 0, 0, 0, count]).expect("sent");
        let mut head = [0; 9];
        stream.read_exact(&mut head).expect("an answer");
        if head[7] != 4 {
            return Err(head[8]);
        }
        let mut bytes = vec![0; 2 * usize::from(count)];
        stream.read_exact(&mut bytes).expect("all of it");
        let words = bytes.chunks_exact(2);
        Ok(words.map(|word| u16::from_be_bytes([word[0], word[1]])).collect())
    }
}

impl Drop for Reader {
    fn drop(&mut self) {
        // One that has ended already needs nothing.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Asks again and again from the start on; the first answer that is a state is to be the present one, in which the robot is dead.
fn first_answer(ask: impl Fn() -> Option<(i64, bool)>, present: i64) -> usize {
    let started = Instant::now();
    let mut refused = 0;
    loop {
        if let Some((cycle, robot_is_dead)) = ask() {
            assert!(robot_is_dead, "cycle {cycle}, after {refused} refusals");
            assert!(
                (present - LAG_CYCLES..=present).contains(&cycle),
                "cycle {cycle} of {present}, after {refused} refusals"
            );
            return refused;
        }
        refused += 1;
        assert!(started.elapsed() < DEADLINE, "{refused} refusals");
    }
}

/// As a run that is being written: there are no results, and nothing says that its writer has ended.
fn is_live(run: &Path) {
    for name in ["summary.json", "run.lock"] {
        fs::remove_file(run.join(name)).expect("it was there");
    }
}

fn present_cycle(run: &Path) -> i64 {
    let output = understudy(&["gateway", "metrics", "--once"])
        .arg(run)
        .output()
        .expect("the binary is built");
    let text = String::from_utf8(output.stdout).expect("text");
    metric(&text, "understudy_cycle{").expect("a cycle")
}

fn metric(text: &str, begins: &str) -> Option<i64> {
    let line = text.lines().find(|line| line.starts_with(begins))?;
    line.rsplit(' ').next()?.parse().ok()
}

/// The text of a journal, whose closed segments are removed.
fn of_one_segment(journal: &Path) -> String {
    let mut text = String::new();
    for segment in segments_of(journal).expect("readable") {
        let mut own = String::new();
        let mut file = SegmentFile::open(&segment).expect("it is there");
        file.read_to_string(&mut own).expect("text");
        fs::remove_file(segment).expect("it is ours");
        // One header is enough.
        let header = if text.is_empty() { 0 } else { own.find('\n').expect("lines") + 1 };
        text += &own[header..];
    }
    text
}

/// Registers of the run itself.
const OF_RUN: u8 = 16;

/// A reader starts with the first third of the journal, and is suspended while the rest is written.
fn check(name: &str, arguments: &[&str], listen: &str, ask: fn(&Reader) -> Option<(i64, bool)>) {
    let _turn = one_at_a_time();
    let run = simulated_run_of(&empty_folder(name), SCENARIO);
    is_live(&run);
    let journal = run.join("journal.jsonl");
    let text = of_one_segment(&journal);
    let third = text.len() / 3;
    let cut = third + text[third..].find('\n').expect("lines") + 1;
    fs::write(&journal, &text[..cut]).expect("written");

    let present = present_cycle(&run);
    let reader = Reader::start(arguments, &run, listen);
    let refused = first_answer(|| ask(&reader), present);
    assert!(refused > 0, "the journal is long enough to be seen read");

    reader.signal(Signal::SIGSTOP);
    std::thread::sleep(AWAY);
    let mut file = OpenOptions::new().append(true).open(&journal);
    let file = file.as_mut().expect("the journal");
    file.write_all(&text.as_bytes()[cut..]).expect("written");
    let later = present_cycle(&run);
    assert!(later > present + 1000, "{later}");
    reader.signal(Signal::SIGCONT);
    let refused = first_answer(|| ask(&reader), later);
    assert!(refused > 0, "it was behind");
}

#[test]
fn the_page_shows_no_past() {
    check("present-page", &["watch"], "--address", |reader| {
        let (status, body) = reader.get("/api/state");
        let answer: serde_json::Value = serde_json::from_str(&body).expect("JSON");
        if status == 503 {
            assert_eq!(answer["error"]["code"], "U0688");
            for path in ["/api/events", "/api/ladder/0", "/api/why/0/0", "/api/state?cycle=1"] {
                // It may have caught up between the two questions.
                assert!([503, 200].contains(&reader.get(path).0), "{path}");
            }
            return None;
        }
        // The directory is looked at before its run is known.
        if status == 404 {
            return None;
        }
        assert_eq!(status, 200, "{body}");
        let dead = member(&answer, "robot")["state"] == "killed";
        let cycle = answer["cycle"].as_i64().expect("a cycle");
        Some((cycle, dead && answer["redundancy"]["level"] != "all"))
    });
}

#[test]
fn metrics_tell_no_past() {
    check("present-metrics", &["gateway", "metrics"], "--listen", |reader| {
        let (status, body) = reader.get("/metrics");
        if status == 503 {
            assert!(body.starts_with("U0688: reading the journal: "), "{body}");
            return None;
        }
        assert_eq!(status, 200, "{body}");
        let killed = body.lines().find(|line| {
            let names = ["understudy_station_state{", "\"robot\"", "\"killed\""];
            names.iter().all(|name| line.contains(name))
        });
        let dead = killed.is_some_and(|line| line.ends_with(" 1"));
        Some((metric(&body, "understudy_cycle{").expect("a cycle"), dead))
    });
}

#[test]
fn modbus_tells_no_past() {
    check("present-modbus", &["gateway", "modbus"], "--listen", |reader| {
        match reader.registers(OF_RUN) {
            // Without the robot no further failure would be masked.
            Ok(words) => {
                let cycle = i64::from(words[2]) << 16 | i64::from(words[3]);
                Some((cycle, words[6] == 0))
            }
            Err(exception) => {
                assert_eq!(exception, 6, "server device busy");
                None
            }
        }
    });
}

/// A live run, some of whose records are there; the newest is an hour old.
fn old_run(name: &str) -> PathBuf {
    let run = simulated_run_of(&empty_folder(name), SCENARIO);
    is_live(&run);
    let journal = run.join("journal.jsonl");
    let text = of_one_segment(&journal);
    let cut = text.len() / 3;
    fs::write(&journal, &text[..cut]).expect("written");
    let journal = OpenOptions::new().append(true).open(journal);
    let long_ago = std::time::SystemTime::now() - Duration::from_secs(3600);
    journal.and_then(|journal| journal.set_modified(long_ago)).expect("it is ours");
    run
}

/// Its inputs and outputs are not the present ones any more, so a client gets none; it can still read that the run is not current.
#[test]
fn modbus_tells_no_values_of_a_run_that_is_not_current() {
    let _turn = one_at_a_time();
    let run = old_run("present-old");
    let reader = Reader::start(&["gateway", "modbus"], &run, "--listen");
    let started = Instant::now();
    let words = loop {
        match reader.registers(OF_RUN) {
            Ok(words) => break words,
            Err(exception) => assert_eq!(exception, 6),
        }
        assert!(started.elapsed() < DEADLINE);
    };
    assert_eq!(words[1], 4, "not current");
    assert_eq!(reader.registers(OF_RUN + 1), Err(6));
}

/// A viewer of a page whose run is suspended is told how old the newest record is; the page itself is not suspended.
#[test]
fn a_viewer_is_told_how_old_the_newest_record_is() {
    let _turn = one_at_a_time();
    let run = old_run("present-age");
    let mut command = understudy(&["watch", "--address", "127.0.0.1:0"]);
    command.arg(&run);
    let page = Page::start(command);
    let state = page.wait_for("a state", |state| state["cycle"].is_i64());
    assert!(state["age_ms"].as_u64() >= Some(3_600_000), "{}", state["age_ms"]);
}
