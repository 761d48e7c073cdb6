//! Writes of other systems: clients of several kinds write at once while members are killed and frames are lost. Each value has one
//! effect, or an answer that it had none. `UNDERSTUDY_PYTHON` names a Python with pymodbus, asyncua and eclipse-zenoh;
//! `UNDERSTUDY_GATE_WRITES` is the number of writes of each client.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, Permissions};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Instant;

use nix::sys::signal::Signal;
use serde_json::{Value, json};
use understudy_bus::free_addresses;
use understudy_journal::{Command as Order, Commander, OperatorAction, records_of};
use understudy_testing::skip;
use understudy_wire::{Member, ProgramId, StationId};

use super::deaths::{Records, is};
use super::shared::page::Page;
use super::shared::{DEADLINE, answer, empty_folder, one_at_a_time, some_at_a_time, understudy};
use super::{PERIOD, TOLERATED_CYCLES, no_orphan, running_with, signal};

const CLUSTER: &str = "examples/two-shuttles/cluster.toml";

const MEMBERS: [(Member, &str); 5] = [
    (Member::Station(StationId(0)), "left"),
    (Member::RemoteIo(ProgramId(0)), "left-io"),
    (Member::Station(StationId(1)), "right"),
    (Member::RemoteIo(ProgramId(1)), "right-io"),
    (Member::Station(StationId(2)), "understudy"),
];

/// Values of the clients begin so far apart.
const APART: f64 = 50.0;

/// As in `gate_writer.py`.
const STEP: f64 = 0.001;

/// A laboratory, ended with the test.
pub(super) struct Laboratory(pub(super) Child);

impl Laboratory {
    /// Ends it in order.
    pub(super) fn end(mut self, runs: &Path) {
        signal(self.0.id(), Signal::SIGINT);
        self.0.wait().expect("it ends");
        no_orphan(runs);
    }
}

impl Drop for Laboratory {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn laboratory(out: &Path, more: &[&str]) -> (Laboratory, PathBuf) {
    let arguments =
        ["lab", CLUSTER, "--link", "udp", "--period", PERIOD, "--cycles", "1000000", "--out"];
    let more = [&["--allow-commands"], more].concat();
    let (child, errors) = running_with(&arguments, out, &more, "synchronised: ");
    // It says more, and must not wait for a reader.
    std::thread::spawn(move || std::io::copy(&mut { errors }, &mut std::io::sink()));
    let run = fs::canonicalize(out.join("latest")).expect("a run");
    (Laboratory(child), run)
}

/// A gateway that serves; it is ended with the test.
pub(super) struct Gateway {
    child: Child,
    pub(super) address: String,
}

impl Gateway {
    fn start(mut command: Command) -> Self {
        let mut child = command
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the binary is built");
        let mut errors = BufReader::new(child.stderr.take().expect("piped"));
        let mut line = String::new();
        errors.read_line(&mut line).expect("text");
        let address = line.trim().rsplit_once(' ').expect("an address").1;
        let address = address.to_owned();
        // Refused writes are logged, and whatever goes wrong.
        let name = address.replace([':', '/'], "-");
        let log = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("gateway-{name}.log"));
        let mut log = fs::File::create(log).expect("a file");
        std::thread::spawn(move || std::io::copy(&mut errors, &mut log));
        Self { child, address }
    }

    pub(super) fn of(what: &str, run: &Path) -> Self {
        // Zenoh does not say which port it has found.
        let address = free_addresses(1).expect("a free port")[0].to_string();
        let mut command = understudy(&["gateway", what, "--allow-writes", "--listen", &address]);
        command.arg(run);
        Self::start(command)
    }

    /// The OPC UA gateway is a binary of another package, beside this one.
    fn opcua(run: &Path, folder: &Path) -> Option<Self> {
        let binary = Path::new(env!("CARGO_BIN_EXE_understudy")).with_file_name("understudy-opcua");
        if !binary.exists() {
            skip(format_args!("no understudy-opcua: cargo build -p understudy-opcua-gateway"));
            return None;
        }
        let logins = folder.join("logins");
        let lines = "operator anna writes-something\nviewer vera sees-everything\n";
        fs::write(&logins, lines).expect("written");
        fs::set_permissions(&logins, Permissions::from_mode(0o600)).expect("changed");
        let mut command = Command::new(binary);
        command.args(["serve", "--listen", "127.0.0.1:0", "--logins"]);
        command.arg(logins).arg("--certificates");
        command.arg(folder.join("opcua")).arg(run);
        Some(Self::start(command))
    }
}

impl Drop for Gateway {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A Python with a module; says so where there is none.
pub(super) fn python(module: &str) -> Option<String> {
    let python = std::env::var("UNDERSTUDY_PYTHON").unwrap_or_else(|_| "python3".into());
    let found = Command::new(&python)
        .args(["-c", &format!("import {module}")])
        .stderr(Stdio::null())
        .status();
    if found.is_ok_and(|status| status.success()) {
        return Some(python);
    }
    skip(format_args!("{python} has no module {module}"));
    None
}

/// A client that writes; ended with the test.
struct Writer(Child);

impl Writer {
    fn start(kind: &str, module: &str, address: &str, first: f64, more: &[&str]) -> Option<Self> {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/laboratory/gate_writer.py");
        let child = Command::new(python(module)?)
            .arg(script)
            .args([kind, address, &first.to_string(), &writes().to_string()])
            .args(more)
            .stdout(Stdio::piped())
            .spawn()
            .expect("it ran a moment ago");
        Some(Self(child))
    }

    /// The outcome of each value, once all were written.
    fn outcomes(mut self) -> Vec<(u64, String)> {
        let lines = BufReader::new(self.0.stdout.take().expect("piped")).lines();
        let outcomes = lines.map(|line| {
            let line: Value = serde_json::from_str(&line.expect("text")).expect("JSON");
            let outcome = line["outcome"].as_str().expect("text").to_owned();
            (line["stored"].as_u64().expect("bits"), outcome)
        });
        let outcomes: Vec<_> = outcomes.collect();
        assert!(self.0.wait().expect("it ends").success());
        outcomes
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Number of writes of each client.
fn writes() -> u32 {
    let asked = std::env::var("UNDERSTUDY_GATE_WRITES").ok();
    asked.map_or(40, |text| text.parse().expect("a number"))
}

/// Writes by the page, as `gate_writer.py` does.
fn write_by_page(page: &Page, first: f64) -> Vec<(u64, String)> {
    let one = |number: u32| {
        let value = first + f64::from(number) * STEP;
        let member = ["left-io", "right-io"][number as usize % 2];
        let command = json!({ "command": "write", "input": "speed", "value": value.to_string() });
        let body =
            json!({ "member": member, "command": command, "owner": "page", "reason": "a test" });
        let deadline = Instant::now() + DEADLINE;
        let outcome = loop {
            let answer = page.post("/api/command", &body.to_string());
            if answer.status == 200 {
                assert!(answer.json()["cycle"].is_u64(), "{}", answer.body);
                break "in-effect";
            }
            if answer.code() == "U0648" {
                break "undecided";
            }
            assert_eq!(answer.status, 409, "{}", answer.body);
            assert!(Instant::now() < deadline, "{value}: {}", answer.body);
            std::thread::yield_now();
        };
        (u64::from((value as f32).to_bits()), outcome.to_owned())
    };
    (0..writes()).map(one).collect()
}

/// Kills and restarts each member, and again until `over`.
fn kill_each(run: &Path, over: &AtomicBool) {
    let commander = Commander::of_run(run.to_path_buf());
    let act = |member, command| {
        let done = commander.act_and_wait(&OperatorAction::Command {
            member,
            command,
            owner: "anna".to_owned(),
            reason: "a test".to_owned(),
        });
        done.expect("it is done");
    };
    let mut records = Records::of(run);
    let mut is_first = true;
    while is_first || !over.load(Ordering::SeqCst) {
        is_first = false;
        for (member, name) in MEMBERS {
            act(member, Order::Kill);
            act(member, Order::Restart);
            records.wait_for("its end", |record| {
                is(record, "laboratory", "fault") && record["event"]["action"] == "crash"
            });
            records.wait_for("its start", |record| is(record, name, "ready"));
            for _ in 0..2 {
                records.wait_for("its return", |record| match member {
                    Member::RemoteIo(_) => {
                        is(record, name, "applied") && record["event"]["source"] == "direct"
                    }
                    _ => is(record, name, "published") && record["event"]["words"] != json!([]),
                });
            }
        }
    }
}

/// Ends the killing, also when the test fails.
struct Over<'a>(&'a AtomicBool);

impl Drop for Over<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::SeqCst);
    }
}

/// Effects of each written value: the writes with it that are in effect.
fn effects(run: &Path) -> BTreeMap<u64, BTreeSet<String>> {
    let mut values = BTreeMap::new();
    let mut effects: BTreeMap<u64, BTreeSet<String>> = BTreeMap::new();
    let records = records_of(&run.join("journal.jsonl")).expect("a journal");
    for record in records.flatten() {
        let record = serde_json::to_value(record).expect("JSON");
        let event = &record["event"];
        match event["event"].as_str() {
            // A remote I/O that is killed loses the records of its last moment, and not the write.
            Some("commanded") if event["command"]["command"] == "write" => {
                let write = &event["command"];
                let stored = write["value"]["stored"].as_u64();
                values.insert(write["id"].to_string(), stored);
            }
            Some("write-in-effect") => {
                let id = event["id"].to_string();
                // A number whose write had no effect is used again.
                if let Some(Some(stored)) = values.get(&id) {
                    effects.entry(*stored).or_default().insert(id);
                }
            }
            _ => {}
        }
    }
    effects
}

fn register_of(registers: &Value, name: &str) -> String {
    let places = registers["result"]["registers"].as_array().expect("a list");
    let place = places.iter().find(|place| place["name"] == name && place["area"] == "register");
    let place = place.expect("a setpoint");
    assert_eq!((&place["writable"], &place["width"]), (&json!(true), &json!(2)));
    place["address"].to_string()
}

#[test]
fn clients_of_four_kinds_write_while_members_are_killed_and_frames_are_lost() {
    let _one = some_at_a_time();
    let out = empty_folder("gates");
    let runs = out.join("runs");
    let (laboratory, run) = laboratory(&runs, &["--loss", "10%"]);
    let text = run.to_str().expect("text");
    let (_, registers, _) = answer(&["gateway", "registers", text]);
    let left = register_of(&registers, "left.speed");
    let right = register_of(&registers, "right.speed");
    let modbus = Gateway::of("modbus", &run);
    let zenoh = Gateway::of("zenoh", &run);
    let opcua = Gateway::opcua(&run, &out);
    let certificates = out.join("opcua");
    let certificates = certificates.to_str().expect("text");
    let mut command = understudy(&["watch", "--address", "127.0.0.1:0", "--allow-commands"]);
    command.arg(&run);
    let page = Page::start(command);
    page.wait_for("a state", |state| state["cycle"].is_i64());
    let over = AtomicBool::new(false);
    let outcomes: Vec<(u64, String)> = std::thread::scope(|scope| {
        let killed = Over(&over);
        let killing = scope.spawn(|| kill_each(&run, &over));
        let by_page = scope.spawn(|| write_by_page(&page, 0.0));
        let registers = [left.as_str(), right.as_str()];
        let clients = [
            Writer::start("modbus", "pymodbus", &modbus.address, APART, &registers),
            Writer::start("zenoh", "zenoh", &zenoh.address, 2.0 * APART, &[]),
            opcua.as_ref().and_then(|opcua| {
                let (address, first) = (&opcua.address, 3.0 * APART);
                Writer::start("opcua", "asyncua", address, first, &[certificates])
            }),
        ];
        // Each is read as it writes: one whose output nobody reads waits for its reader.
        let written = clients.into_iter().flatten();
        let written: Vec<_> = written.map(|client| scope.spawn(|| client.outcomes())).collect();
        let mut all = Vec::new();
        for outcomes in written {
            let outcomes = outcomes.join().expect("no panic");
            assert_eq!(outcomes.len(), writes() as usize);
            all.extend(outcomes);
        }
        all.extend(by_page.join().expect("no panic"));
        drop(killed);
        killing.join().expect("no panic");
        all
    });
    laboratory.end(&runs);
    let effects = effects(&run);
    let mut undecided = 0;
    for (stored, outcome) in &outcomes {
        let count = effects.get(stored).map_or(0, BTreeSet::len);
        let value = f32::from_bits(*stored as u32);
        match outcome.as_str() {
            "in-effect" => assert_eq!(count, 1, "{value}"),
            _ => {
                assert!(count <= 1, "{value}: {count}");
                undecided += 1;
            }
        }
    }
    eprintln!("{} writes, {undecided} undecided", outcomes.len());
    assert!(undecided * 10 <= outcomes.len(), "{undecided} undecided");
    let summary = fs::read_to_string(run.join("summary.json")).expect("a summary");
    let summary: Value = serde_json::from_str(&summary).expect("JSON");
    assert_eq!(summary["violation_count"], 0, "{summary:#}");
}

/// Requests of the flood. One address has 16 connections at most, and another client takes the last.
const REQUESTS: usize = 4000;
const CONNECTIONS: usize = 15;

/// One request to press the button at a coil: the exception code, 0 where the press is in effect.
fn press(stream: &mut TcpStream, coil: u16) -> u8 {
    let [high, low] = coil.to_be_bytes();
    let request = [0, 7, 0, 0, 0, 6, 1, 5, high, low, 0xff, 0];
    stream.write_all(&request).expect("it takes it");
    let mut head = [0; 8];
    stream.read_exact(&mut head).expect("it answers");
    let is_refused = head[7] & 0x80 != 0;
    let mut rest = vec![0; if is_refused { 1 } else { 4 }];
    stream.read_exact(&mut rest).expect("the whole answer");
    if is_refused { rest[0] } else { 0 }
}

#[test]
fn a_flood_of_writes_is_bounded_and_disturbs_no_cycle() {
    let _one = one_at_a_time();
    let runs = empty_folder("gates_flood");
    let (laboratory, run) = laboratory(&runs, &[]);
    let text = run.to_str().expect("text");
    let (_, registers, _) = answer(&["gateway", "registers", text]);
    let places = registers["result"]["registers"].as_array().expect("a list");
    let coil = places.iter().find(|place| place["name"] == "left.start" && place["area"] == "coil");
    let coil = coil.expect("a pulse")["address"].as_u64();
    let coil = u16::try_from(coil.expect("an address")).expect("an address");
    let gateway = Gateway::of("modbus", &run);
    let (left, in_effect, busy) =
        (AtomicUsize::new(REQUESTS), AtomicUsize::new(0), AtomicUsize::new(0));
    let begun = Instant::now();
    std::thread::scope(|scope| {
        for _ in 0..CONNECTIONS {
            scope.spawn(|| {
                let mut stream = TcpStream::connect(&gateway.address).expect("it listens");
                stream.set_read_timeout(Some(DEADLINE)).expect("a timeout");
                let next = |left: usize| left.checked_sub(1);
                let is_next = || {
                    let taken = left.fetch_update(Ordering::SeqCst, Ordering::SeqCst, next);
                    taken.is_ok()
                };
                // A gateway that has not read the present yet refuses every write.
                while is_next() || in_effect.load(Ordering::SeqCst) == 0 {
                    assert!(begun.elapsed() < DEADLINE, "no write is in effect");
                    let count = match press(&mut stream, coil) {
                        0 => &in_effect,
                        6 => &busy,
                        code => panic!("exception {code}"),
                    };
                    count.fetch_add(1, Ordering::SeqCst);
                }
            });
        }
        // A client that is gone before its answer leaves nothing behind.
        let mut gone = TcpStream::connect(&gateway.address).expect("it listens");
        let [high, low] = coil.to_be_bytes();
        let request = [0, 7, 0, 0, 0, 6, 1, 5, high, low, 0xff, 0];
        gone.write_all(&request).expect("it takes it");
    });
    let seconds = begun.elapsed().as_secs() as usize;
    let (in_effect, busy) = (in_effect.into_inner(), busy.into_inner());
    eprintln!("{in_effect} in effect, {busy} refused in {seconds} s");
    assert!(in_effect > 0);
    laboratory.end(&runs);
    let mut commands = 0;
    let mut not_true = 0;
    let records = records_of(&run.join("journal.jsonl")).expect("a journal");
    let mut has_origin = false;
    for record in records.flatten() {
        let record = serde_json::to_value(record).expect("JSON");
        let event = &record["event"];
        has_origin |= event["event"] == "origin";
        if event["event"] == "commanded" {
            commands += 1;
            let write = &event["command"];
            assert_eq!(
                (&write["role"], &event["owner"]),
                (&json!("operator"), &json!("modbus 127.0.0.1"))
            );
        }
        let source = event["source"].as_str().unwrap_or_default();
        if has_origin && event["event"] == "applied" && ["held", "fail-safe"].contains(&source) {
            not_true += 1;
        }
    }
    // As many as a laboratory takes, for each second that was begun.
    assert!(commands <= 25 * (seconds + 2), "{commands} in {seconds} s");
    assert!(not_true <= TOLERATED_CYCLES, "{not_true} deadlines");
}
