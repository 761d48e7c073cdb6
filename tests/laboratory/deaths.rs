//! `kill -9` of members from outside: a fault like any other, which is recorded, masked and repaired while the run goes on.

use std::fs::{self, File, Metadata};
use std::io::{BufRead, BufReader, Read};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::Instant;

use nix::sys::signal::Signal;
use serde_json::{Value, json};

use super::shared::{DEADLINE, answer, empty_folder, some_at_a_time};
use super::{PRESS_CELL, no_orphan, running, running_with, signal};

/// The journal of a run that is being written.
pub(super) struct Records {
    path: PathBuf,
    journal: BufReader<File>,
    line: String,
}

impl Records {
    pub(super) fn of(run: &Path) -> Self {
        let path = run.join("journal.jsonl");
        let journal = File::open(&path).expect("a journal");
        Self { path, journal: BufReader::new(journal), line: String::new() }
    }

    /// The next record that is wanted, of those that have not been read.
    pub(super) fn wait_for(&mut self, what: &str, wanted: impl Fn(&Value) -> bool) -> Value {
        let deadline = Instant::now() + DEADLINE;
        loop {
            assert!(Instant::now() < deadline, "{what} did not come");
            // A closed segment has all that it will ever have.
            let is_closed = self.is_closed();
            let length = self.journal.read_line(&mut self.line).expect("text");
            if !self.line.ends_with('\n') {
                if length == 0 && is_closed {
                    self.journal = BufReader::new(File::open(&self.path).expect("a journal"));
                }
                // The rest is written soon.
                assert!(length > 0 || self.line.len() < 1 << 20);
                std::thread::yield_now();
                continue;
            }
            let record: Value = serde_json::from_str(&self.line).expect("a record");
            self.line.clear();
            if wanted(&record) {
                return record;
            }
        }
    }

    /// Whether the journal goes on in another file.
    fn is_closed(&self) -> bool {
        let number = |found: std::io::Result<Metadata>| found.ok().map(|found| found.ino());
        let (read, written) = (self.journal.get_ref().metadata(), fs::metadata(&self.path));
        let written = number(written);
        written.is_some() && number(read) != written
    }

    /// The process of a member, as its newest `ready` record says it.
    pub(super) fn ready(&mut self, name: &str) -> u32 {
        let what = format!("{name} is ready");
        let record = self.wait_for(&what, |record| is(record, name, "ready"));
        let process = record["event"]["process"].as_u64().expect("a number");
        u32::try_from(process).expect("a process id")
    }
}

pub(super) fn is(record: &Value, name: &str, event: &str) -> bool {
    record["name"] == name && record["event"]["event"] == event
}

/// An outcome of a remote I/O with this source.
fn applied(record: &Value, name: &str, source: &str) -> bool {
    is(record, name, "applied") && record["event"]["source"] == source
}

pub(super) fn operate(run: &Path, name: &str, command: &str) -> (i32, Value) {
    let run = run.to_str().expect("text");
    let (status, document, _) = answer(&["operate", run, "--name", name, command]);
    (status, document)
}

fn code(document: &Value) -> &str {
    document["failures"][0]["code"].as_str().unwrap_or_default()
}

#[test]
fn every_kind_of_member_is_killed_from_outside_and_started_again_by_an_operator() {
    let _one = some_at_a_time();
    let out = empty_folder("members");
    let (mut child, mut errors) = running(&out, &[]);
    let run = fs::canonicalize(out.join("latest")).expect("a run");
    let members = [
        ("press", json!({"station": 1})),
        ("understudy", json!({"station": 2})),
        ("press-io", json!({"remote-io": 1})),
        ("ram", json!({"plant": 1})),
    ];
    for (name, member) in members {
        let process = Records::of(&run).ready(name);
        let mut records = Records::of(&run);
        signal(process, Signal::SIGKILL);
        let ended = records.wait_for("its end", |record| {
            is(record, "laboratory", "ended") && record["event"]["member"] == member
        });
        assert_eq!(ended["event"]["how"], "signal: 9 (SIGKILL)", "{ended}");
        if name == "press" {
            let restored = |record: &Value| applied(record, "press-io", "reconstructed");
            records.wait_for("a reconstructed output", restored);
            let (status, document) = operate(&run, name, "kill");
            assert_eq!((status, code(&document)), (1, "U0551"), "{document:#}");
        }
        let (status, document) = operate(&run, name, "restart");
        assert_eq!(status, 0, "{document:#}");
        let (status, document) = operate(&run, name, "restart");
        assert_eq!((status, code(&document)), (1, "U0552"), "{document:#}");
        assert_ne!(records.ready(name), process);
        let back = |record: &Value| match name {
            "press-io" => applied(record, name, "direct"),
            "ram" => is(record, name, "stepped"),
            _ => is(record, name, "published"),
        };
        // Twice: a station that has received one sample only cannot vouch for a remote I/O that restarts right then.
        for _ in 0..2 {
            records.wait_for("its return", back);
        }
        if name == "press" {
            let direct = |record: &Value| applied(record, "press-io", "direct");
            records.wait_for("a direct output", direct);
        }
    }
    let (status, document) = operate(&run, "robot", "status");
    assert_eq!((status, code(&document)), (2, "U0621"), "{document:#}");
    let (status, document) = operate(&run, "nonsense", "status");
    assert_eq!((status, code(&document)), (2, "U0605"), "the name is the fault: {document:#}");
    signal(child.id(), Signal::SIGINT);
    let mut said = String::new();
    errors.read_to_string(&mut said).expect("text");
    assert_eq!(child.wait().expect("it ends").code(), Some(1), "{said}");
    no_orphan(&out);
    let restart = format!("understudy operate {} --name press restart", run.display());
    let told = run.file_name().and_then(|name| name.to_str()).expect("text");
    assert!(
        said.contains("press ended unexpectedly (signal: 9 (SIGKILL))")
            && said.contains(&format!("{told} --name press restart")),
        "{restart}: {said}"
    );
    let summary = fs::read_to_string(run.join("summary.json")).expect("a summary");
    let summary: Value = serde_json::from_str(&summary).expect("JSON");
    let deaths = summary["deaths"].as_array().expect("a list");
    let names: Vec<&str> = deaths.iter().filter_map(|death| death["name"].as_str()).collect();
    assert_eq!(names, ["press", "understudy", "press-io", "ram"]);
    assert_eq!(summary["violation_count"], 0);
    let (status, document) = operate(&run, "press", "restart");
    assert_eq!((status, code(&document)), (1, "U0557"), "{document:#}");
}

/// Kills the press's controller in a laboratory of 200 cycles; answers with the exit status, the text, and whether it ran again.
fn killed(name: &str, more: &[&str]) -> (Option<i32>, String, bool) {
    let out = empty_folder(name);
    let arguments = ["lab", PRESS_CELL, "--link", "udp", "--period", "50ms", "--out"];
    let (mut child, _errors) = running_with(&arguments, &out, more, "synchronised: ");
    let run = fs::canonicalize(out.join("latest")).expect("a run");
    let mut records = Records::of(&run);
    signal(records.ready("press"), Signal::SIGKILL);
    let mut text = String::new();
    let mut output = child.stdout.take().expect("piped");
    output.read_to_string(&mut text).expect("text");
    let status = child.wait().expect("it ends").code();
    no_orphan(&out);
    let journal = fs::read_to_string(run.join("journal.jsonl")).expect("a journal");
    let started = journal
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).expect("a record"))
        .filter(|record| is(record, "press", "ready"));
    (status, text, started.count() == 2)
}

#[test]
fn only_the_verdict_of_a_scenario_that_did_not_ask_for_the_death_differs() {
    let _one = some_at_a_time();
    let (status, text, again) = killed("undisturbed", &["--cycles", "200"]);
    assert_eq!(status, Some(0), "{text}");
    assert!(!again, "nothing starts it unasked");
    let told = "ENDED UNEXPECTEDLY: press in cycle ";
    let how = "(signal: 9 (SIGKILL))";
    assert!(text.contains(told) && text.contains(how), "{text}");

    let folder = empty_folder("quiet");
    let quiet = folder.join("quiet.toml");
    let expects =
        "title = \"Nothing happens\"\ncycles = 200\n\n[expect]\nwrong = 0\nprotected = true\n";
    fs::write(&quiet, expects).expect("written");
    let quiet = quiet.to_str().expect("text");
    let (status, text, again) = killed("restarted", &["--scenario", quiet, "--restart"]);
    assert_eq!(status, Some(1), "{text}");
    assert!(again, "{text}");
    let told = "NOT MET: no member ends but by a step of the scenario; found ended unexpectedly: press in cycle ";
    assert!(text.contains(told) && text.contains(how), "{text}");
    let unmet = text.lines().filter(|line| line.starts_with("NOT MET"));
    assert_eq!(unmet.count(), 1, "it is protected again: {text}");
}
