//! A program is changed while the power is off: every process is killed, and the next ones run another text.

use std::fs::{self, File};
use std::io::Write;
use std::path::PathBuf;
use std::process::Stdio;
use std::time::{Duration, Instant};

use serde_json::Value;
use understudy_bus::free_addresses;

use super::shared::deployed::{Running, text};
use super::shared::{DEADLINE, empty_folder, some_at_a_time, understudy};

const MEMBERS: [(&str, &str); 3] =
    [("counter", "node"), ("understudy", "node"), ("counter-io", "remote-io")];

/// A cluster of three processes whose program changes from life to life.
struct Plant {
    folder: PathBuf,
    file: &'static str,
    life: u32,
    members: Vec<Running>,
}

impl Plant {
    fn new(name: &str, file: &'static str, inputs: &str) -> Self {
        let folder = empty_folder(name);
        let addresses = free_addresses(3).expect("three free ports");
        let cluster = format!(
            "[cluster]\nname = \"change\"\nsecurity = \"off\"\nlink = \"udp\"\nperiod = \"50ms\"\nretain_every = \"20s\"\n\n\
             [[controller]]\nname = \"counter\"\nladder = \"{file}\"\naddress = \"{}\"\n\n\
             [[understudy]]\nname = \"understudy\"\naddress = \"{}\"\n\n\
             [[remote_io]]\ncontroller = \"counter\"\naddress = \"{}\"\n{inputs}",
            addresses[0], addresses[1], addresses[2]
        );
        fs::write(folder.join("cluster.toml"), cluster).expect("it is ours");
        Self { folder, file, life: 0, members: Vec::new() }
    }

    /// Starts all members with a program.
    fn start(&mut self, program: &str) {
        self.life += 1;
        fs::write(self.folder.join(self.file), program).expect("it is ours");
        let cluster = self.folder.join("cluster.toml");
        let kept = self.folder.join("kept");
        for (name, command) in MEMBERS {
            let member = [command, text(&cluster), "--name", name, "--no-real-time"];
            let child = understudy(&member)
                .args(["--retain", text(&kept), "--journal", text(&self.journal(name))])
                .stdin(Stdio::piped())
                .stdout(Stdio::null())
                .stderr(File::create(self.folder.join(format!("{name}.errors"))).expect("a file"))
                .spawn();
            self.members.push(Running(child.expect("the binary is built")));
        }
    }

    fn journal(&self, name: &str) -> PathBuf {
        self.folder.join(format!("{name}.{}.jsonl", self.life))
    }

    /// The events of a member in this life.
    fn events(&self, name: &str) -> Vec<Value> {
        let journal = fs::read_to_string(self.journal(name)).unwrap_or_default();
        // A line that is being written has no end yet.
        let whole = journal.rsplit_once('\n').map_or("", |(whole, _)| whole);
        let records = whole.lines().map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
        records.map(|record| record["event"].clone()).collect()
    }

    /// The first event of a kind.
    fn wait_for(&self, name: &str, wanted: impl Fn(&Value) -> bool) -> Value {
        let deadline = Instant::now() + DEADLINE;
        loop {
            if let Some(found) = self.events(name).into_iter().find(|event| wanted(event)) {
                return found;
            }
            let errors = self.folder.join(format!("{name}.errors"));
            let errors = fs::read_to_string(errors).unwrap_or_default();
            assert!(Instant::now() < deadline, "{name}: {errors}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// The first number of the outputs, in so many bits, in the first applied outputs that come from the program and that fit.
    fn applied(&self, bits: u32, fits: impl Fn(u64) -> bool) -> u64 {
        let number = |event: &Value| {
            let word = event["outputs"]["words"][0].as_u64().unwrap_or_default();
            word & (u64::MAX >> (64 - bits))
        };
        let found = self.wait_for("counter-io", |event| {
            let is_proved = event["source"] == "direct" || event["source"] == "reconstructed";
            event["event"] == "applied" && is_proved && fits(number(event))
        });
        number(&found)
    }

    /// The power fails.
    fn kill(&mut self) {
        self.members.clear();
    }

    /// A line on standard input of a member.
    fn order(&mut self, name: &str, line: &str) {
        let place = MEMBERS.iter().position(|(member, _)| *member == name).expect("a member");
        let input = self.members[place].0.stdin.as_mut().expect("it is piped");
        writeln!(input, "{line}").expect("it reads");
    }
}

fn is(kind: &'static str) -> impl Fn(&Value) -> bool {
    move |event| event["event"] == kind
}

fn counter(declarations: &str) -> String {
    format!("PROGRAM counter {declarations} total := total + 1; END_PROGRAM\n")
}

/// The file holds the whole state of 20 s before: the steps since are replayed with the old program, so the new one starts from the newest applied
/// output.
#[test]
fn a_counter_goes_on_when_the_program_has_changed() {
    let _one = some_at_a_time();
    let mut plant = Plant::new("change-typed", "counter.st", "");
    plant.start(&counter("VAR_OUTPUT RETAIN total : INT; END_VAR"));
    plant.applied(16, |total| total > 40);
    plant.kill();
    let last = plant.events("counter-io").iter().rev().find_map(|event| {
        let word = event["outputs"]["words"][0].as_u64()?;
        (event["event"] == "applied").then_some(word & 0xffff)
    });
    let last = last.expect("it ran");
    // Another comment, another place, a wider type.
    plant.start(&counter(
        "(* changed *)\n VAR_OUTPUT RETAIN fresh : DINT := 7; END_VAR VAR_OUTPUT RETAIN total : DINT; END_VAR",
    ));
    let first = plant
        .wait_for("counter-io", |event| event["event"] == "applied" && event["source"] == "direct");
    let word = first["outputs"]["words"][0].as_u64().expect("an image");
    assert_eq!(word & 0xffff_ffff, 7, "{first}");
    // The journal of a killed process may lack its last lines, and the note does not.
    assert!((last + 1..last + 100).contains(&(word >> 32)), "{last} {first}");
    let warm = plant.wait_for("counter-io", is("started-warm"));
    assert_eq!(warm["lost"], 0, "{warm}");
    for station in ["counter", "understudy"] {
        let carried = plant.wait_for(station, is("retained-carried"));
        let counts = ["kept", "converted", "new"].map(|fate| carried[fate].as_u64());
        assert_eq!(counts, [Some(0), Some(1), Some(1)], "{carried}");
    }
    // The text of the old program goes when no file needs it.
    plant.kill();
    let programs = fs::read_dir(plant.folder.join("kept")).expect("a folder").filter(|entry| {
        let path = entry.as_ref().expect("an entry").path();
        path.extension().is_some_and(|ending| ending == "program")
    });
    assert!((3..=6).contains(&programs.count()));
}

/// A value that the new program does not have is never lost without a question.
#[test]
fn a_renamed_variable_is_a_question() {
    let _one = some_at_a_time();
    let mut plant = Plant::new("change-renamed", "counter.st", "");
    plant.start(&counter(
        "VAR_OUTPUT RETAIN total : INT; END_VAR VAR RETAIN hours : INT := 3; END_VAR",
    ));
    plant.applied(16, |total| total > 20);
    plant.kill();
    plant.start(&counter(
        "VAR_OUTPUT RETAIN total : INT; END_VAR VAR RETAIN run_hours : INT; END_VAR",
    ));
    let asked = plant.wait_for("counter-io", is("state-lost"));
    assert_eq!(asked["asks"], true, "{asked}");
    for station in ["counter", "understudy"] {
        let dropped = plant.wait_for(station, is("retained-dropped"));
        assert_eq!(dropped["paths"], serde_json::json!(["hours"]), "{dropped}");
    }
    assert!(!plant.events("counter-io").iter().any(is("started-cold")));
    plant.order("counter-io", r#"choose {"newest":{"cycle":null}}"#);
    plant.wait_for("counter-io", is("started-warm"));
    assert!(plant.applied(16, |_| true) > 20);
}

/// The text of the old program is gone or damaged: nothing is taken over, and nothing starts cold without a question.
#[test]
fn a_program_whose_text_cannot_be_read_is_a_question() {
    let _one = some_at_a_time();
    let mut plant = Plant::new("change-unreadable", "counter.st", "");
    plant.start(&counter("VAR_OUTPUT RETAIN total : INT; END_VAR"));
    plant.applied(16, |total| total > 20);
    plant.kill();
    for entry in fs::read_dir(plant.folder.join("kept")).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.extension().is_some_and(|ending| ending == "program") {
            let mut bytes = fs::read(&path).expect("it is ours");
            let last = bytes.len() - 2;
            bytes[last] ^= 1;
            fs::write(&path, bytes).expect("it is ours");
        }
    }
    plant.start(&counter("VAR_OUTPUT RETAIN total : DINT; END_VAR"));
    let asked = plant.wait_for("counter-io", is("state-lost"));
    assert_eq!(asked["asks"], true, "{asked}");
    let refused = plant.wait_for("counter", is("retained-refused"));
    assert!(
        refused["reason"].as_str().is_some_and(|reason| reason.contains("damaged")),
        "{refused}"
    );
}

/// Rungs: a latch whose set rung is removed shows what it was.
#[test]
fn a_latch_goes_on_when_the_rungs_have_changed() {
    let _one = some_at_a_time();
    let inputs = "\n[remote_io.inputs]\ngo = { operator = \"level\", initial = true }\n";
    let mut plant = Plant::new("change-ladder", "counter.ladder", inputs);
    plant.start("program latch\ninput go\noutput lamp\nmemory seen\nretain seen\nrung go (S seen)\nrung seen (lamp)\n");
    plant.applied(1, |lamp| lamp == 1);
    plant.kill();
    plant.start("program latch\ninput go\noutput lamp\nmemory other\nmemory seen\nretain seen\nrung /go (other)\nrung other (R seen)\nrung seen (lamp)\n");
    let warm = plant.wait_for("counter-io", is("started-warm"));
    assert_eq!(warm["lost"], 0, "{warm}");
    assert_eq!(plant.applied(1, |_| true), 1);
    let carried = plant.wait_for("counter", is("retained-carried"));
    assert_eq!(carried["kept"], 1, "{carried}");
}
