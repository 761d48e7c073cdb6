//! Online changes of inputs and outputs on real processes, with a device whose registers tell what was driven, and while a station is killed.

use std::collections::BTreeMap;
use std::fs;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::process::Child;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use nix::sys::signal::Signal;
use serde_json::Value;
use understudy_cluster::{ChangeTexts, Cluster, read};
use understudy_journal::{Command, Commander, OperatorAction};
use understudy_wire::{
    ChangeRequest, Member, ProgramHash, ProgramId, SignalPlace, StationId, Unforce,
};

use super::deaths::{Records, is};
use super::shared::{DEADLINE, answer, empty_folder, modbus, some_at_a_time};
use super::{no_orphan, running_with, signal};

const CLUSTER: &str = r#"
[cluster]
name = "points"
period = "100ms"
security = "off"

[[controller]]
name = "drive"
ladder = "drive.st"

[[remote_io]]
controller = "drive"
hold_cycles = 3
"#;

/// Counts its scans, and shows two of its inputs.
const BEFORE: &str = "
PROGRAM drive
  VAR_INPUT speed : INT; old : INT; END_VAR
  VAR_OUTPUT shown : INT; gone : INT; echo : INT; END_VAR
  VAR count : INT; END_VAR
  count := count + 1;
  shown := count;
  gone := old;
  echo := speed;
END_PROGRAM";

/// `speed` and `echo` have other places, `shown` another type, `old` and `gone` go, and `more`, `level`, `extra` and `sum` are new.
const AFTER: &str = "
PROGRAM drive
  VAR_INPUT more : INT; level : REAL; speed : INT; END_VAR
  VAR_OUTPUT extra : INT; echo : INT; sum : INT; shown : DINT; END_VAR
  VAR count : INT; END_VAR
  count := count + 1;
  extra := count;
  shown := count;
  echo := speed;
  sum := more + REAL_TO_INT(level);
END_PROGRAM";

const FAIL_SAFE_BEFORE: &str = "fail_safe = { shown = 71, gone = 72, echo = 73 }";
const FAIL_SAFE_AFTER: &str = "fail_safe = { extra = 81, echo = 82, sum = 83, shown = 84 }";

const PLACES_BEFORE: &str = r#"
inputs = { speed = "input:0 int", old = "input:1 int" }
outputs = { shown = "holding:0 int", gone = "holding:1 int", echo = "holding:2 int" }
"#;
const PLACES_AFTER: &str = r#"
inputs = { more = "input:3 int", level = "input:4 real", speed = "input:6 int" }
outputs = { extra = "holding:10 int", echo = "holding:11 int", sum = "holding:12 int", shown = "holding:14 dint" }
"#;

/// Input registers of the device: `speed` and `old`, then `more`, `level` (2.0), and another sensor of `speed`.
const SENSORS: [u16; 7] = [11, 22, 0, 44, 0x4000, 0, 12];

const OLD_PLACES: RangeInclusive<u16> = 0..=2;
const NEW_PLACES: RangeInclusive<u16> = 10..=15;

const DRIVE_IO: Member = Member::RemoteIo(ProgramId(0));

/// What was written to the holding registers of the device: address and word, in their order.
type Written = Arc<Mutex<Vec<(u16, u16)>>>;

/// A device on a free port.
fn device() -> (u16, Written) {
    let written = Written::default();
    let log = Arc::clone(&written);
    let holding: Mutex<BTreeMap<u16, u16>> = Mutex::default();
    let port = modbus::serve(move |request| {
        let word = |at: usize| u16::from_be_bytes([request[at], request[at + 1]]);
        let mut holding = holding.lock().unwrap_or_else(PoisonError::into_inner);
        let mut write = |address: u16, word: u16| {
            holding.insert(address, word);
            log.lock().unwrap_or_else(PoisonError::into_inner).push((address, word));
        };
        let answer = |words: Vec<u16>| {
            let bytes = words.iter().flat_map(|word| word.to_be_bytes());
            [request[0], 2 * words.len() as u8].into_iter().chain(bytes).collect()
        };
        match request[0] {
            3 => {
                let read = |address| holding.get(&address).copied().unwrap_or(0);
                answer((word(1)..word(1) + word(3)).map(read).collect())
            }
            4 => {
                let read = |address: u16| SENSORS.get(usize::from(address)).copied().unwrap_or(0);
                answer((word(1)..word(1) + word(3)).map(read).collect())
            }
            6 => {
                write(word(1), word(3));
                request.to_vec()
            }
            16 => {
                for place in 0..word(3) {
                    write(word(1) + place, word(6 + 2 * usize::from(place)));
                }
                request[..5].to_vec()
            }
            function => vec![function | 0x80, 1],
        }
    });
    (port, written)
}

/// One of the two files of a change.
struct Side {
    file: PathBuf,
    cluster: Cluster,
}

impl Side {
    /// `renamed` are keys of the controller, and `settings` those of its remote I/O.
    fn write(folder: &Path, program: &str, (renamed, settings): (&str, &str)) -> Self {
        fs::create_dir_all(folder).expect("a folder");
        let cluster =
            CLUSTER.replace("\n\n[[remote_io]]", &format!("\n{renamed}\n\n[[remote_io]]"));
        let text = format!("{cluster}{settings}");
        fs::write(folder.join("drive.st"), program).expect("written");
        let file = folder.join("cluster.toml");
        fs::write(&file, &text).expect("written");
        let loaded = read("cluster.toml", &text, &mut |_| Ok(program.to_owned()));
        let cluster = loaded.cluster.unwrap_or_else(|| panic!("{:?}", loaded.reports));
        Self { file, cluster }
    }

    fn hash(&self) -> ProgramHash {
        self.cluster.controllers()[0].hash
    }

    /// Width of the outputs in bits.
    fn width(&self) -> usize {
        self.cluster.controllers()[0].interface.outputs.width()
    }

    /// The value of an output in the words of an image.
    fn output(&self, event: &Value, name: &str) -> u64 {
        let words = event["outputs"]["words"].as_array().expect("words");
        let words: Vec<u64> = words.iter().filter_map(Value::as_u64).collect();
        let outputs = &self.cluster.controllers()[0].interface.outputs;
        outputs.find(name).expect("an output").get(&words)
    }
}

/// A laboratory that runs the file before, and the change.
struct Cell {
    before: Side,
    after: Side,
    texts: ChangeTexts,
    laboratory: Child,
    runs: PathBuf,
    run: PathBuf,
    commander: Commander,
    records: Records,
}

impl Drop for Cell {
    /// Where an assertion fails, the laboratory ends as well.
    fn drop(&mut self) {
        if matches!(self.laboratory.try_wait(), Ok(None)) {
            signal(self.laboratory.id(), Signal::SIGINT);
            // There is nothing to be done about it.
            let _ = self.laboratory.wait();
        }
    }
}

impl Cell {
    fn start(name: &str, before: &str, after: &str) -> Self {
        Self::of(name, (BEFORE, ("", before)), (AFTER, ("", after)))
    }

    fn of(
        name: &str,
        (old, before): (&str, (&str, &str)),
        (new, after): (&str, (&str, &str)),
    ) -> Self {
        let out = empty_folder(name);
        let before = Side::write(&out.join("before"), old, before);
        let after = Side::write(&out.join("after"), new, after);
        let texts = ChangeTexts::between(&before.cluster, &after.cluster);
        let texts = texts.expect("an online change");
        let runs = out.join("runs");
        let more = ["--cycles", "100000", "--allow-commands"];
        let file = before.file.to_str().expect("text");
        let (laboratory, _errors) =
            running_with(&["lab", file, "--link", "udp", "--out"], &runs, &more, "synchronised: ");
        let run = fs::canonicalize(runs.join("latest")).expect("a run");
        let (commander, records) = (Commander::of_run(run.clone()), Records::of(&run));
        Self { before, after, texts, laboratory, runs, run, commander, records }
    }

    fn act(&self, member: Member, command: Command) -> Result<(), String> {
        let (owner, reason) = ("anna".to_owned(), "a test".to_owned());
        let action = OperatorAction::Command { member, command, owner, reason };
        self.commander.act_and_wait(&action).map(|_| ()).map_err(|why| why.to_string())
    }

    /// Gives a step to a member until it is taken: a frame that it waits for, or the end of a history, comes soon.
    fn step(&self, member: Member, request: &ChangeRequest) {
        let deadline = Instant::now() + DEADLINE;
        loop {
            let done = self.act(member, Command::Change { request: request.clone() });
            let Err(why) = done else {
                return;
            };
            let waits = ["U0634", "U0636", "U0557"].iter().any(|code| why.starts_with(code));
            assert!(waits && Instant::now() < deadline, "{request:?}: {why}");
            std::thread::yield_now();
        }
    }

    fn prepare(&self) {
        let file = self.run.join("texts.json");
        fs::write(&file, serde_json::to_vec(&self.texts).expect("JSON")).expect("written");
        let request = ChangeRequest::Prepare { file: file.to_str().expect("text").to_owned() };
        self.before.cluster.members().for_each(|member| self.step(member, &request));
    }

    /// The outputs of the cycle from which on the points of a side count, as the remote I/O applied them.
    fn switch(&mut self, to: ProgramHash) -> Value {
        self.step(DRIVE_IO, &ChangeRequest::Switch { change: self.texts.name(), to });
        let changed = |record: &Value| is(record, "drive-io", "points-changed");
        let changed = self.records.wait_for("the change of the points", changed);
        assert_eq!(changed["event"]["to"], to.0);
        let moment = changed["event"]["moment"].clone();
        let applied = |record: &Value| {
            is(record, "drive-io", "applied") && record["event"]["moment"] == moment
        };
        let applied = self.records.wait_for("the outputs of that cycle", applied);
        assert!(applied["event"]["missing"].is_null(), "{applied}");
        applied["event"].clone()
    }

    fn cancel(&mut self) -> Value {
        let applied = self.switch(self.before.hash());
        let (change, configuration) = (self.texts.name(), self.texts.before);
        let forget = ChangeRequest::Forget { change, configuration };
        self.before.cluster.members().for_each(|member| self.step(member, &forget));
        applied
    }

    /// Ends it; the cycles in which no output of the program was proved, but for those in which this machine stood still.
    fn end(mut self) -> Vec<Value> {
        signal(self.laboratory.id(), Signal::SIGINT);
        self.laboratory.wait().expect("it ends");
        no_orphan(&self.runs);
        let journal = fs::read_to_string(self.run.join("journal.jsonl")).expect("a journal");
        let records =
            journal.lines().map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
        let records: Vec<Value> = records.collect();
        if records.iter().any(|record| record["event"]["event"] == "stalled") {
            return Vec::new();
        }
        let of = |record: &&Value| is(record, "drive-io", "applied");
        let applied = records.into_iter().filter(|record| of(&record));
        // Before the first proved outputs the stations are not synchronised.
        let applied = applied.skip_while(|record| !record["event"]["missing"].is_null());
        applied.filter(|record| !record["event"]["missing"].is_null()).collect()
    }
}

/// What was written to one register from a place of the log on.
fn of_register(log: &[(u16, u16)], register: u16) -> Vec<u16> {
    log.iter().filter(|(address, _)| *address == register).map(|(_, word)| *word).collect()
}

/// Waits until a register has had a value.
fn written(log: &Written, from: usize, register: u16, wanted: u16) {
    let deadline = Instant::now() + DEADLINE;
    let has = || {
        let log = log.lock().unwrap_or_else(PoisonError::into_inner);
        log[from..].contains(&(register, wanted))
    };
    while !has() {
        assert!(Instant::now() < deadline, "{wanted} was not written to register {register}");
        std::thread::yield_now();
    }
}

fn length(log: &Written) -> usize {
    log.lock().unwrap_or_else(PoisonError::into_inner).len()
}

/// The registers of the device tell that outputs are driven at the places of the program that runs, from the cycle of the switch on, that those which are gone
/// got their fail-safe value once, and that no cycle was missed; so it is on the way back.
#[test]
fn a_device_is_driven_by_the_points_of_the_program_that_runs() {
    let _one = some_at_a_time();
    let (port, log) = device();
    let field = |fail_safe: &str, places: &str| {
        let timing = "timeout = \"500ms\"\nstale_after = \"2s\"";
        format!(
            "{fail_safe}\n\n[remote_io.field]\nmodbus = \"127.0.0.1:{port}\"\n{timing}\n{places}"
        )
    };
    let before = field(FAIL_SAFE_BEFORE, PLACES_BEFORE);
    let after = field(FAIL_SAFE_AFTER, PLACES_AFTER);
    let mut cell = Cell::start("points_device", &before, &after);
    written(&log, 0, 2, SENSORS[0]);
    written(&log, 0, 1, SENSORS[1]);
    cell.prepare();
    let begun = length(&log);
    let applied = cell.switch(cell.after.hash());
    let first = cell.after.output(&applied, "extra");
    // The new sensors are read, by their new places and types.
    written(&log, begun, 11, SENSORS[6]);
    written(&log, begun, 12, SENSORS[3] + 2);
    // Who knows the file before alone does not reach another signal.
    let outputs = &cell.before.cluster.controllers()[0].interface.outputs;
    let gone = outputs.find("gone").expect("an output");
    let signal = SignalPlace::Output(u16::try_from(gone.bit).expect("a place"));
    let points = cell.before.cluster.points_hash(ProgramId(0));
    let refused = cell.act(DRIVE_IO, Command::Unforce(Unforce { signal, points }));
    assert!(refused.as_ref().is_err_and(|why| why.starts_with("U0638")), "{refused:?}");
    let middle = length(&log);
    let applied = cell.cancel();
    let again = cell.before.output(&applied, "shown");
    written(&log, middle, 2, SENSORS[0]);
    written(&log, middle, 1, SENSORS[1]);
    let missed = cell.end();
    assert!(missed.is_empty(), "{missed:?}");
    let log = log.lock().unwrap_or_else(PoisonError::into_inner).clone();
    let place_of = |from: usize, places: RangeInclusive<u16>| {
        let found = log[from..].iter().position(|(address, _)| places.contains(address));
        from + found.expect("it was written")
    };
    // There: from the first write to a new place on.
    let (there, back) = (place_of(begun, NEW_PLACES), middle);
    let back = back
        + log[back..]
            .iter()
            .position(|write| *write == (0, again as u16))
            .expect("it is driven again");
    for (register, last) in [(0, 71), (1, 72), (2, 73)] {
        let gone = of_register(&log[there..back], register);
        let before = of_register(&log[begun..there], register);
        let left = before.iter().chain(&gone).filter(|word| **word == last).count();
        assert_eq!(left, 1, "register {register}: {before:?} {gone:?}");
        assert!(gone.iter().all(|word| *word == last), "register {register}: {gone:?}");
    }
    assert_eq!(of_register(&log[there..], 10)[0], first as u16, "from the cycle of the switch on");
    assert_eq!(of_register(&log[there..], 15)[0], first as u16);
    assert!(!log.iter().any(|(address, word)| (*address, *word) == (11, 99)));
    // Back: what only the new program has got its fail-safe value once, and nothing else.
    for (register, last) in [(10, 81), (11, 82), (12, 83), (14, 0), (15, 84)] {
        let gone = of_register(&log[back..], register);
        let near = of_register(&log[middle..], register);
        assert!(gone.iter().all(|word| *word == last), "register {register}: {gone:?}");
        let left = near.iter().filter(|word| **word == last).count();
        assert!(register == 14 || left == 1, "register {register}: {near:?}");
    }
    assert!(
        OLD_PLACES
            .chain(NEW_PLACES)
            .all(|place| log.iter().any(|(address, _)| *address == place) || place == 13)
    );
}

/// The controller is dead while the points change: the outputs of that very cycle are reconstructed, by the points of the new program; back in the cell, it
/// follows, and the way back goes the same way.
#[test]
fn points_change_while_a_station_is_dead() {
    let _one = some_at_a_time();
    let mut cell = Cell::start("points_killed", FAIL_SAFE_BEFORE, FAIL_SAFE_AFTER);
    let controller = Member::Station(StationId(0));
    cell.prepare();
    cell.act(controller, Command::Kill).expect("it is killed");
    cell.records.wait_for("its end", |record| is(record, "drive-io", "unprotected"));
    let applied = cell.switch(cell.after.hash());
    assert_eq!(applied["source"], "reconstructed", "{applied}");
    assert_eq!(
        cell.after.output(&applied, "extra"),
        cell.after.output(&applied, "shown"),
        "{applied}"
    );
    cell.act(controller, Command::Restart).expect("it starts again");
    cell.records.wait_for("its state", |record| is(record, "drive", "synchronised"));
    cell.records.wait_for("protection", |record| is(record, "drive-io", "protected"));
    let applied = cell.cancel();
    assert_eq!(applied["source"], "direct", "{applied}");
    let missed = cell.end();
    assert!(missed.is_empty(), "{missed:?}");
}

/// The steps of the tool, with what it refuses meanwhile: orders by the old file reach no signal after the switch, and the change is accepted.
#[test]
fn the_tool_changes_points() {
    let _one = some_at_a_time();
    let mut cell = Cell::start("points_tool", FAIL_SAFE_BEFORE, FAIL_SAFE_AFTER);
    let run = cell.run.to_str().expect("text").to_owned();
    let after = cell.after.file.to_str().expect("text").to_owned();
    let done = |step: &str| {
        let (exit, document, errors) = answer(&["change", &run, &after, step, "--drop"]);
        assert_eq!(exit, 0, "{step}: {document:#} {errors}");
    };
    let force = |signal: &str| {
        let (exit, document, _) = answer(&["operate", &run, "--name", "drive-io", "force", signal]);
        (exit, document["failures"][0]["code"].as_str().map(str::to_owned))
    };
    done("prepare");
    assert_eq!(force("gone=99"), (0, None));
    done("switch");
    let changed = |record: &Value| is(record, "drive-io", "points-changed");
    cell.records.wait_for("the change of the points", changed);
    let unknown = (2, Some("U0556".to_owned()));
    assert_eq!(force("gone=98"), unknown);
    done("cancel");
    cell.records.wait_for("the change back", changed);
    assert_eq!(force("gone=97"), (0, None));
    done("prepare");
    done("accept");
    cell.records.wait_for("the change again", changed);
    let shown = |record: &Value| {
        let event = &record["event"];
        is(record, "drive-io", "applied") && event["outputs"]["width"] == cell.after.width()
    };
    let applied = cell.records.wait_for("the outputs of the new program", shown);
    let event = &applied["event"];
    assert_eq!(cell.after.output(event, "extra"), cell.after.output(event, "shown"), "{applied}");
    assert_eq!(force("gone=96"), unknown);
    let missed = cell.end();
    assert!(missed.is_empty(), "{missed:?}");
}

/// An operator writes `wanted` and `hand`. The new program has `wanted` under another name, and `hand` from the device.
const BY_HAND: &str = "
PROGRAM drive
  VAR_INPUT wanted : INT; hand : INT; END_VAR
  VAR_OUTPUT shown : INT; seen : INT; END_VAR
  shown := wanted;
  seen := hand;
END_PROGRAM";

const BY_DEVICE: &str = "
PROGRAM drive
  VAR_INPUT more : INT; target : INT; hand : INT; END_VAR
  VAR_OUTPUT seen : INT; told : INT; END_VAR
  told := target;
  seen := hand;
END_PROGRAM";

/// What an operator has written goes on in an input with another name, and in one that comes from the device now until that is read for the first time: in no
/// cycle do the outputs see another value. The tool says so.
#[test]
fn written_values_go_on_under_other_names_and_from_other_sources() {
    let _one = some_at_a_time();
    let (port, log) = device();
    let setpoint = |name: &str| {
        format!("inputs.{name} = {{ operator = \"setpoint\", low = 0, high = 99, initial = 5 }}\n")
    };
    let field = |places: &str| format!("field = {{ modbus = \"127.0.0.1:{port}\", {places} }}\n");
    let outputs = |told: &str| {
        format!("outputs = {{ {told} = \"holding:0 int\", seen = \"holding:1 int\" }}")
    };
    let before = format!("{}{}{}", setpoint("wanted"), setpoint("hand"), field(&outputs("shown")));
    let places = format!("inputs = {{ hand = \"input:3 int\" }}, {}", outputs("told"));
    let after = format!("{}{}", setpoint("target"), field(&places));
    let renamed = "renamed = { wanted = \"target\", shown = \"told\" }";
    let mut cell =
        Cell::of("points_written", (BY_HAND, ("", &before)), (BY_DEVICE, (renamed, &after)));
    let run = cell.run.to_str().expect("text").to_owned();
    let file = cell.after.file.to_str().expect("text").to_owned();
    for (value, register) in [("wanted=7", 0), ("hand=30", 1)] {
        let (exit, document, errors) =
            answer(&["operate", &run, "--name", "drive-io", "write", value]);
        assert_eq!(exit, 0, "{document:#} {errors}");
        written(&log, 0, register, if register == 0 { 7 } else { 30 });
    }
    let begun = length(&log);
    for step in ["plan", "prepare", "switch"] {
        let (exit, document, errors) = answer(&["change", &run, &file, step]);
        assert_eq!(exit, 0, "{step}: {document:#} {errors}");
        let points = document["result"]["plan"][0]["points"].as_array().expect("points").clone();
        let fate = |name: &str| {
            let mut found = points.iter().filter(|point| point["point"] == name);
            found.next().map(|point| (point["fate"].clone(), point["before"].clone()))
        };
        assert_eq!(fate("target"), Some(("renamed".into(), "wanted".into())), "{document:#}");
        assert_eq!(fate("told"), Some(("renamed".into(), "shown".into())), "{document:#}");
    }
    let changed = |record: &Value| is(record, "drive-io", "points-changed");
    let changed = cell.records.wait_for("the change of the points", changed);
    let moment = changed["event"]["moment"].clone();
    let applied =
        |record: &Value| is(record, "drive-io", "applied") && record["event"]["moment"] == moment;
    let applied = cell.records.wait_for("the outputs of that cycle", applied);
    let value = |name: &str| cell.after.output(&applied["event"], name);
    assert_eq!((value("told"), value("seen")), (7, 30), "{applied}");
    written(&log, begun, 1, SENSORS[3]);
    let middle = length(&log);
    // Back: the operator's value again, and what the device showed last.
    let (exit, document, errors) = answer(&["change", &run, &file, "cancel", "--drop"]);
    assert_eq!(exit, 0, "{document:#} {errors}");
    cell.records.wait_for("the change back", |record| is(record, "drive-io", "points-changed"));
    written(&log, middle, 1, SENSORS[3]);
    let missed = cell.end();
    assert!(missed.is_empty(), "{missed:?}");
    let log = log.lock().unwrap_or_else(PoisonError::into_inner).clone();
    let of = |register| {
        let mut values = of_register(&log[begun..], register);
        values.dedup();
        values
    };
    // At the end of the laboratory the fail-safe values.
    assert!(matches!(of(0)[..], [7] | [7, 0]), "{:?}", of(0));
    assert!(matches!(of(1)[..], [30, 44] | [30, 44, 0]), "{:?}", of(1));
}
