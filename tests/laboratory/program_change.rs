//! A program is changed while the power is off: every process is killed, and the next ones run another text.

use std::fs::{self, File};
use std::io::Write as _;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::Stdio;
use std::time::{Duration, Instant};

use serde_json::Value;
use understudy_bus::{RetainedFiles, free_addresses};
use understudy_wire::{
    AuthorityHash, Moment, Note, PointValue, Retained, RetainedRun, Role, Write, WriteId,
};

use super::shared::deployed::{Running, text};
use super::shared::{DEADLINE, answer, empty_folder, some_at_a_time, understudy};

/// The controller, an understudy and the remote I/O, as they are called until one is renamed.
const NAMES: [&str; 3] = ["counter", "understudy", "counter-io"];

/// A cluster of three processes whose program, or whose names, change from life to life.
struct Plant {
    folder: PathBuf,
    file: &'static str,
    name: &'static str,
    names: [&'static str; 3],
    /// Controllers before this one.
    before: String,
    inputs: String,
    addresses: Vec<SocketAddr>,
    life: u32,
    members: Vec<Running>,
}

impl Plant {
    fn new(name: &str, file: &'static str, inputs: &str) -> Self {
        Self {
            folder: empty_folder(name),
            file,
            name: "change",
            names: NAMES,
            before: String::new(),
            inputs: inputs.to_owned(),
            addresses: free_addresses(3).expect("three free ports"),
            life: 0,
            members: Vec::new(),
        }
    }

    fn cluster_text(&self) -> String {
        let Self { name, file, before, names: [controller, understudy, remote_io], inputs, .. } =
            self;
        let [first, second, third] = &self.addresses[..] else { unreachable!("three addresses") };
        format!(
            "[cluster]\nname = \"{name}\"\nsecurity = \"off\"\nlink = \"udp\"\nperiod = \"50ms\"\nretain_every = \"20s\"\n\n\
             {before}[[controller]]\nname = \"{controller}\"\nladder = \"{file}\"\naddress = \"{first}\"\n\n\
             [[understudy]]\nname = \"{understudy}\"\naddress = \"{second}\"\n\n\
             [[remote_io]]\nname = \"{remote_io}\"\ncontroller = \"{controller}\"\naddress = \"{third}\"\n{inputs}"
        )
    }

    /// Starts all members with a program.
    fn start(&mut self, program: &str) {
        self.life += 1;
        fs::write(self.folder.join(self.file), program).expect("it is ours");
        let cluster = self.folder.join("cluster.toml");
        fs::write(&cluster, self.cluster_text()).expect("it is ours");
        let kept = self.folder.join("kept");
        for (name, command) in self.names.into_iter().zip(["node", "node", "remote-io"]) {
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
        let found = self.wait_for(self.names[2], |event| {
            let is_proved = event["source"] == "direct" || event["source"] == "reconstructed";
            event["event"] == "applied" && is_proved && fits(number(event))
        });
        number(&found)
    }

    fn kept(&self, name: &str) -> RetainedFiles {
        RetainedFiles::new(&self.folder.join("kept"), format!("{}.{name}", self.name))
    }

    /// Until what is on the disk is as it should be.
    fn wait_for_disk(&self, is_there: impl Fn() -> bool) {
        let deadline = Instant::now() + DEADLINE;
        while !is_there() {
            let notes = self.kept(self.names[2]).notes(None);
            assert!(Instant::now() < deadline, "{notes:?}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Until the newest note of the remote I/O on the disk is of a program that keeps values, or of one that does not.
    fn noted(&self, keeps: bool) {
        self.wait_for_disk(|| self.kept(self.names[2]).notes(None).was_retentive == Some(keeps));
    }

    /// The power fails, once the disks have the newest applied output and the states that it came from. A disk that takes nothing for a while would make the
    /// next start a question.
    fn kill(&mut self) {
        let [controller, understudy, remote_io] = self.names;
        let applied = |event: &Value| {
            let is_proved = event["source"] == "direct" || event["source"] == "reconstructed";
            (event["event"] == "applied" && is_proved)
                .then(|| serde_json::from_value(event["moment"].clone()).expect("a moment"))
        };
        let applied: Option<Moment> = self.events(remote_io).iter().rev().find_map(applied);
        let notes = self.kept(remote_io);
        let note = || notes.notes(None).newest;
        if let Some(applied) = applied {
            let is_noted = |note: Note| note.applied().is_some_and(|noted| noted >= applied);
            self.wait_for_disk(|| note().is_some_and(is_noted));
        }
        // Without samples, the stations take no further step.
        self.members.pop();
        let note = note().filter(|note| applied.is_some() && note.is_retentive);
        if let Some(applied) = note.as_ref().and_then(Note::applied) {
            for station in [controller, understudy] {
                let files = self.kept(&format!("{station}.{controller}"));
                let newest = || files.runs(None).0.iter().map(RetainedRun::stepped).max();
                self.wait_for_disk(|| newest() >= Some(applied));
            }
        }
        self.members.clear();
    }

    /// A line on standard input of a member.
    fn order(&mut self, name: &str, line: &str) {
        let place = self.names.iter().position(|member| *member == name).expect("a member");
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
    assert_eq!(asked["reason"], "not-whole", "{asked}");
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

/// A member that was renamed has nothing under its own name. What is there under its old one is offered to the operator, and nothing starts without that.
#[test]
fn a_renamed_member_is_a_question() {
    let _one = some_at_a_time();
    let program = counter("VAR_OUTPUT RETAIN total : INT; END_VAR");
    let renamed = [
        ("controller", ["meter", "understudy", "meter-io"]),
        ("everything", ["meter", "deputy", "meter-io"]),
        ("remote-io", ["counter", "understudy", "terminal"]),
    ];
    for (what, names) in renamed {
        let mut plant = Plant::new(&format!("change-name-{what}"), "counter.st", "");
        plant.start(&program);
        plant.applied(16, |total| total > 20);
        plant.kill();
        plant.names = names;
        plant.start(&program);
        let [_, _, remote_io] = names;
        let asked = plant.wait_for(remote_io, is("state-lost"));
        assert!(asked["asks"] == true && asked["newest"] != Value::Null, "{what}: {asked}");
        let told = plant.wait_for(remote_io, is("retained-refused"));
        assert!(told["reason"].as_str().is_some_and(|it| it.contains("counter-io")), "{told}");
        assert!(!plant.events(remote_io).iter().any(is("started-cold")), "{what}");
        plant.order(remote_io, r#"choose {"newest":{"cycle":null}}"#);
        plant.wait_for(remote_io, is("started-warm"));
        assert!(plant.applied(16, |_| true) > 20, "{what}");
        // From now on it has files of its own.
        plant.kill();
        plant.start(&program);
        assert_eq!(plant.wait_for(remote_io, is("started-warm"))["lost"], 0, "{what}");
    }
}

/// The files are of a copy of the cluster with other keys, or one of the two files of notes is missing: nothing starts by itself, the operator may choose
/// the state, and the next life asks no more.
#[test]
fn files_of_other_keys_and_missing_notes_are_a_question() {
    let _one = some_at_a_time();
    let program = counter("VAR_OUTPUT RETAIN total : INT; END_VAR");
    for (what, reason) in [("keys", "keys of another authority"), ("notes", "it is missing")] {
        let mut plant = Plant::new(&format!("change-{what}"), "counter.st", "");
        plant.start(&program);
        plant.applied(16, |total| total > 20);
        plant.kill();
        for entry in fs::read_dir(plant.folder.join("kept")).expect("members have kept values") {
            let path = entry.expect("a file").path();
            let is_of = |ending: &str| path.to_str().is_some_and(|path| path.ends_with(ending));
            if what == "keys" && is_of(".retained") {
                let mut bytes = Vec::new();
                Retained::Authority(AuthorityHash(5)).write(&mut bytes);
                bytes.extend(fs::read(&path).expect("it is there"));
                fs::write(&path, bytes).expect("it is ours");
            } else if what == "notes" && is_of("change.counter-io.1.retained") {
                fs::remove_file(&path).expect("it is ours");
            }
        }
        plant.start(&program);
        let asked = plant.wait_for("counter-io", is("state-lost"));
        assert!(asked["asks"] == true && asked["newest"] != Value::Null, "{what}: {asked}");
        let told = plant.wait_for("counter-io", is("retained-refused"));
        assert!(told["reason"].as_str().is_some_and(|it| it.contains(reason)), "{told}");
        assert!(!plant.events("counter-io").iter().any(is("started-cold")), "{what}");
        plant.order("counter-io", r#"choose {"newest":{"cycle":null}}"#);
        plant.wait_for("counter-io", is("started-warm"));
        assert!(plant.applied(16, |_| true) > 20, "{what}");
        plant.kill();
        plant.start(&program);
        assert_eq!(plant.wait_for("counter-io", is("started-warm"))["lost"], 0, "{what}");
    }
}

/// The understudy alone has another name: the controller has kept the state.
#[test]
fn a_renamed_understudy_changes_nothing() {
    let _one = some_at_a_time();
    let program = counter("VAR_OUTPUT RETAIN total : INT; END_VAR");
    let mut plant = Plant::new("change-name-understudy", "counter.st", "");
    plant.start(&program);
    plant.applied(16, |total| total > 20);
    plant.kill();
    plant.names[1] = "deputy";
    plant.start(&program);
    assert_eq!(plant.wait_for("counter-io", is("started-warm"))["lost"], 0);
    assert!(plant.applied(16, |_| true) > 20);
}

/// A cluster with another name, or a program without retentive variables: what was kept is not given up without a question.
#[test]
fn what_the_plant_kept_is_not_given_up_without_a_question() {
    let _one = some_at_a_time();
    let retentive = counter("VAR_OUTPUT RETAIN total : INT; END_VAR");
    let plain = counter("VAR_OUTPUT total : INT; END_VAR");
    for (what, name, second, reason) in [
        ("cluster", "moved", &retentive, "of the cluster change"),
        ("plain", "change", &plain, "has no retentive variables"),
    ] {
        let mut plant = Plant::new(&format!("change-given-up-{what}"), "counter.st", "");
        plant.start(&retentive);
        plant.applied(16, |total| total > 20);
        plant.kill();
        plant.name = name;
        plant.start(second);
        let asked = plant.wait_for("counter-io", is("state-lost"));
        assert!(asked["asks"] == true && asked["newest"] == Value::Null, "{what}: {asked}");
        let told = plant.wait_for("counter-io", is("retained-refused"));
        assert!(told["reason"].as_str().is_some_and(|it| it.contains(reason)), "{told}");
        plant.order("counter-io", r#"choose "cold""#);
        plant.wait_for("counter-io", is("started-cold"));
        plant.applied(16, |total| total > 0);
        // The answer is given once.
        plant.noted(second == &retentive);
        plant.kill();
        plant.start(second);
        let wanted = if second == &plain { "started-cold" } else { "started-warm" };
        plant.wait_for("counter-io", is(wanted));
        assert!(!plant.events("counter-io").iter().any(is("state-lost")), "{what}");
    }
}

/// With a controller before it, a program has another number, and its files are its own as before.
#[test]
fn a_controller_with_another_number_has_its_files() {
    let _one = some_at_a_time();
    let program = counter("VAR_OUTPUT RETAIN total : INT; END_VAR");
    let mut plant = Plant::new("change-number", "counter.st", "");
    plant.start(&program);
    plant.applied(16, |total| total > 20);
    plant.kill();
    let addresses = free_addresses(2).expect("two free ports");
    plant.before = format!(
        "[[controller]]\nname = \"first\"\nladder = \"counter.st\"\naddress = \"{}\"\n\n\
         [[remote_io]]\ncontroller = \"first\"\naddress = \"{}\"\n\n",
        addresses[0], addresses[1]
    );
    plant.start(&program);
    assert_eq!(plant.wait_for("counter-io", is("started-warm"))["lost"], 0);
    assert!(plant.applied(16, |_| true) > 20);
}

/// A setpoint keeps its value where its input has another place in the changed program, and a new one has its initial value.
#[test]
fn a_setpoint_keeps_its_value_when_the_program_has_changed() {
    let _one = some_at_a_time();
    let setpoint = |name: &str, initial: u8| {
        format!(
            "{name} = {{ operator = \"setpoint\", low = 1, high = 100, initial = {initial}, retain = true }}\n"
        )
    };
    let inputs = |lines: &str| format!("\n[remote_io.inputs]\n{lines}");
    let program = |inputs: &str, shown: &str| {
        format!(
            "PROGRAM counter VAR_INPUT {inputs} : INT; END_VAR VAR_OUTPUT shown : INT; END_VAR\n\
             VAR_OUTPUT RETAIN total : INT; END_VAR shown := {shown}; total := total + 1; END_PROGRAM\n"
        )
    };
    let mut plant = Plant::new("change-setpoint", "counter.st", &inputs(&setpoint("limit", 5)));
    plant.start(&program("limit", "limit"));
    plant.applied(16, |shown| shown == 5);
    let write = Write {
        id: WriteId { session: 1, number: 1 },
        input: 0,
        value: PointValue::new(16, 42),
        role: Role::Operator,
        owner: "anna".to_owned(),
        reason: "a test".to_owned(),
        points: None,
    };
    plant.order("counter-io", &format!("write {}", serde_json::to_string(&write).expect("JSON")));
    plant.applied(16, |shown| shown == 42);
    plant.kill();
    plant.inputs = inputs(&(setpoint("offset", 3) + &setpoint("limit", 5)));
    plant.start(&program("offset, limit", "limit + 100 * offset"));
    plant.wait_for("counter-io", is("started-warm"));
    assert_eq!(plant.applied(16, |_| true), 342);
    // The value is outside the limits of the next one, whose name stays: it is said, and the initial value is sampled.
    plant.kill();
    plant.inputs = inputs(&(setpoint("offset", 3) + &setpoint("limit", 5).replace("100", "20")));
    plant.start(&program("offset, limit", "limit + 100 * offset"));
    let dropped = plant.wait_for("counter-io", is("retained-dropped"));
    assert_eq!(dropped["paths"], serde_json::json!(["limit"]), "{dropped}");
    assert_eq!(plant.applied(16, |_| true), 305);
}

/// What `check` says of the bytes that a station writes in a day is what it writes, at most.
#[test]
fn the_bytes_of_a_day_are_what_a_station_writes() {
    let _one = some_at_a_time();
    let mut plant = Plant::new("change-budget", "counter.st", "");
    plant.start(&counter("VAR_OUTPUT RETAIN total : INT; END_VAR"));
    plant.applied(16, |total| total > 60);
    plant.kill();
    let files = fs::read(plant.folder.join("kept/change.counter.counter.1.retained"));
    let files = files.expect("it has kept something");
    let (records, _) = Retained::read(&files);
    let mut first = Vec::new();
    records.first().expect("a state").write(&mut first);
    let steps = (records.len() - 1) as f64;
    let bytes_a_step = (files.len() - first.len()) as f64 / steps;
    assert!(steps > 20.0);
    let check = answer(&["check", text(&plant.folder.join("cluster.toml"))]).1;
    let all = check["result"]["files"].as_array().expect("files");
    let said = all.iter().find_map(|file| file["retained"]["bytes_a_day"].as_f64());
    let said = said.unwrap_or_else(|| panic!("{check}"));
    // At 50 ms, with a whole state in 400 steps.
    let limit = said / (86_400.0 / 0.05);
    let state = first.len() as f64 / 400.0;
    assert!(
        (limit / 4.0..=limit).contains(&(bytes_a_step + state)),
        "{bytes_a_step} and {state} of {limit}"
    );
}
