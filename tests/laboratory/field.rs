//! Equipment that another project's Modbus server plays, where this machine has it: `UNDERSTUDY_PYTHON` names a Python with pymodbus.

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::Instant;

use serde_json::Value;
use understudy_testing::skip;

use super::{DEADLINE, answer, empty_folder, no_orphan, running_cluster, signal, some_at_a_time};

/// What the device is written for.
const PYMODBUS: &str = "3.16.1";

/// What pymodbus needs for serial lines.
const PYSERIAL: &str = "3.5";

/// A device on a port of its own. It ends with its standard input.
struct Device {
    child: Child,
    input: Option<ChildStdin>,
    output: BufReader<ChildStdout>,
    port: u16,
}

impl Drop for Device {
    fn drop(&mut self) {
        self.input = None;
        // One that does not end by itself is made to.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Device {
    /// That of `examples/modbus-cell`; nothing where this machine has no pymodbus, and it says so then.
    fn start(port: Option<u16>) -> Option<Self> {
        let port = port.unwrap_or_else(|| {
            let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
            listener.local_addr().expect("bound").port()
        });
        let mut device = Self::start_of("modbus-cell", &port.to_string(), "pymodbus", PYMODBUS)?;
        device.port = port;
        assert_eq!(device.line(), "ready");
        Some(device)
    }

    /// The device of an example, with its argument and the module that it needs.
    fn start_of(example: &str, argument: &str, module: &str, wanted: &str) -> Option<Self> {
        let python = std::env::var("UNDERSTUDY_PYTHON").unwrap_or_else(|_| "python3".into());
        let version = Command::new(&python)
            .args(["-c", &format!("import {module}; print({module}.__version__)")])
            .output();
        let version = version.map_or_else(
            |error| error.to_string(),
            |output| String::from_utf8_lossy(&output.stdout).trim().to_owned(),
        );
        if version != wanted {
            skip(format_args!(
                "{python} has {module} {version:?} and not {wanted}: pip install {module}=={wanted}"
            ));
            return None;
        }
        let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
        let mut child = Command::new(&python)
            .arg(examples.join(example).join("device.py"))
            .arg(argument)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("it ran a moment ago");
        Some(Self {
            input: child.stdin.take(),
            output: BufReader::new(child.stdout.take().expect("piped")),
            child,
            port: 0,
        })
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.output.read_line(&mut line).expect("text");
        line.trim_end().to_owned()
    }

    fn mood(&mut self, mood: &str) {
        let input = self.input.as_mut().expect("it runs");
        writeln!(input, "{mood}").expect("it listens");
    }
}

/// The example, with the device's own port.
fn cluster(out: &Path, port: u16) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let text = fs::read_to_string(root.join("modbus-cell/cluster.toml")).expect("text");
    assert!(text.contains("127.0.0.1:5020"));
    let text = text.replace("127.0.0.1:5020", &format!("127.0.0.1:{port}"));
    fs::write(out.join("cluster.toml"), text).expect("written");
    for file in ["tank.ladder", "press.ladder"] {
        fs::copy(root.join("modbus-cell").join(file), out.join(file)).expect("copied");
    }
    out.join("cluster.toml")
}

#[test]
fn a_device_of_another_project_is_driven_while_its_controller_is_dead() {
    let _one = some_at_a_time();
    let out = empty_folder("modbus");
    let Some(mut device) = Device::start(None) else {
        return;
    };
    let file = cluster(&out, device.port);
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/modbus-cell/kill.toml");
    let runs = out.join("runs");
    let (_, document, errors) = answer(&[
        "lab",
        file.to_str().expect("text"),
        "--scenario",
        scenario.to_str().expect("text"),
        "--link",
        "udp",
        "--out",
        runs.to_str().expect("text"),
    ]);
    no_orphan(&out);
    let summary = &document["result"]["summary"];
    assert_eq!(summary["violation_count"], 0, "{summary:#}\n{errors}");
    assert_eq!(summary["cycles_run"], summary["cycles_asked"], "{errors}");
    let counts = &summary["remote_ios"][0]["counts"];
    assert!(counts["reconstructed"].as_u64() > Some(0), "{counts:#}");
    // The device saw the valve move, between its marks.
    assert!(device.line().starts_with("level 0 valve 1"));
}

/// Waits for an event of the tank's remote I/O from record `from` on, and answers with the number of records until then.
fn wait_for(journal: &Path, from: usize, what: &str, test: impl Fn(&Value) -> bool) -> usize {
    wait_for_member(journal, from, "tank-io", what, test)
}

/// As [`wait_for`], for any member.
fn wait_for_member(
    journal: &Path,
    from: usize,
    member: &str,
    what: &str,
    test: impl Fn(&Value) -> bool,
) -> usize {
    let deadline = Instant::now() + DEADLINE;
    loop {
        let text = fs::read_to_string(journal).unwrap_or_default();
        let found = text.lines().enumerate().skip(from).find(|(_, line)| {
            serde_json::from_str::<Value>(line)
                .is_ok_and(|record| record["name"] == member && test(&record["event"]))
        });
        if let Some((place, _)) = found {
            return place;
        }
        assert!(Instant::now() < deadline, "waited for: {what}");
        std::thread::yield_now();
    }
}

#[test]
fn a_device_that_refuses_is_silent_or_gone_means_fail_safe_and_comes_back() {
    let _one = some_at_a_time();
    let out = empty_folder("modbus_troubles");
    let Some(mut device) = Device::start(None) else {
        return;
    };
    let port = device.port;
    let file = cluster(&out, port);
    let runs = out.join("runs");
    let (mut child, _errors) = running_cluster(&file, &runs, &[]);
    let journal = runs.join("latest/journal.jsonl");
    let lost = |reason: &'static str| {
        move |event: &Value| {
            let said = event["reason"].as_str().unwrap_or_default();
            event["event"] == "field-lost" && said.contains(reason)
        }
    };
    let source = |wanted: &'static str| {
        move |event: &Value| event["event"] == "applied" && event["source"] == wanted
    };
    let bad = |event: &Value| {
        event["event"] == "applied"
            && event["source"] == "fail-safe"
            && event["missing"] == "bad-quality"
    };
    let mut at = wait_for(&journal, 0, "driven", source("direct"));
    for (mood, reason) in [("refuse", "refuses"), ("silent", "does not answer")] {
        device.mood(mood);
        at = wait_for(&journal, at, reason, lost(reason));
        at = wait_for(&journal, at, "fail-safe by bad quality", bad);
        device.mood("well");
        at = wait_for(&journal, at, "driven again", source("direct"));
    }
    drop(device);
    at = wait_for(&journal, at, "fail-safe without a device", bad);
    let device = Device::start(Some(port)).expect("it was there before");
    wait_for(&journal, at, "driven by the new device", source("direct"));
    signal(child.id(), nix::sys::signal::Signal::SIGINT);
    child.wait().expect("it ends");
    drop(device);
    no_orphan(&out);
    let summary = fs::read_to_string(runs.join("latest/summary.json")).expect("written");
    let summary: Value = serde_json::from_str(&summary).expect("JSON");
    assert_eq!(summary["violation_count"], 0, "{summary:#}");
}

/// The example with numbers, with the device's own connection.
fn level_cluster(out: &Path, connection: &str) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/modbus-level");
    let text = fs::read_to_string(root.join("cluster.toml")).expect("text");
    assert!(text.contains("127.0.0.1:5021"));
    let mut text = text.replace("127.0.0.1:5021", connection);
    if connection.starts_with("rtu:") {
        // A pseudo terminal has no parity bit.
        text = text.replace("[remote_io.field]\n", "[remote_io.field]\nparity = \"none\"\n");
    }
    fs::write(out.join("cluster.toml"), text).expect("written");
    for file in ["level.st", "tank.st"] {
        fs::copy(root.join(file), out.join(file)).expect("copied");
    }
    out.join("cluster.toml")
}

/// The level controller is dead while the tank is filled; the register of the valve follows the reconstructed REAL, and nothing is held.
fn fill_without_a_controller(folder: &str, device: &mut Device, connection: &str) {
    let out = empty_folder(folder);
    let file = level_cluster(&out, connection);
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let scenario = examples.join("modbus-level/kill.toml");
    let runs = out.join("runs");
    let (_, document, errors) = answer(&[
        "lab",
        file.to_str().expect("text"),
        "--scenario",
        scenario.to_str().expect("text"),
        "--link",
        "udp",
        "--out",
        runs.to_str().expect("text"),
    ]);
    no_orphan(&out);
    let summary = &document["result"]["summary"];
    assert_eq!(summary["violation_count"], 0, "{summary:#}\n{errors}");
    assert_eq!(summary["cycles_run"], summary["cycles_asked"], "{errors}");
    let counts = &summary["remote_ios"][0]["counts"];
    assert!(counts["reconstructed"].as_u64() > Some(150), "{counts:#}");
    assert_eq!(device.line(), "filled");
    // The remote I/O ends with the fail-safe value, 12.5 % in hundredths.
    device.mood("show");
    let shown = device.line();
    assert!(shown.ends_with(" inflow 1250"), "{shown}");
}

#[test]
fn a_real_in_registers_is_driven_while_its_controller_is_dead() {
    let _one = some_at_a_time();
    let port = {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        listener.local_addr().expect("bound").port()
    };
    let started = Device::start_of("modbus-level", &port.to_string(), "pymodbus", PYMODBUS);
    let Some(mut device) = started else {
        return;
    };
    assert_eq!(device.line(), "ready");
    let connection = format!("127.0.0.1:{port}");
    fill_without_a_controller("modbus_level", &mut device, &connection);
    // A level that is not a number is bad quality, with its reason, and the next number is taken again.
    let out = empty_folder("modbus_level_nan");
    let file = level_cluster(&out, &connection);
    let runs = out.join("runs");
    let (mut child, _errors) = running_cluster(&file, &runs, &[]);
    let journal = runs.join("latest/journal.jsonl");
    let own = |event: &'static str, source: &'static str, missing: &'static str| {
        move |record: &Value| {
            record["event"] == event
                && (source.is_empty() || record["source"] == source)
                && (missing.is_empty() || record["missing"] == missing)
        }
    };
    let at = wait_for_member(&journal, 0, "left-io", "driven", own("applied", "direct", ""));
    device.mood("nan");
    let lost = |record: &Value| {
        let said = record["reason"].as_str().unwrap_or_default();
        record["event"] == "field-lost"
            && said.contains("`level` at input:0 real is infinite or not a number")
    };
    let at = wait_for_member(&journal, at, "left-io", "lost", lost);
    let bad = own("applied", "fail-safe", "bad-quality");
    let at = wait_for_member(&journal, at, "left-io", "fail-safe", bad);
    device.mood("well");
    wait_for_member(&journal, at, "left-io", "driven again", own("applied", "direct", ""));
    signal(child.id(), nix::sys::signal::Signal::SIGINT);
    child.wait().expect("it ends");
    no_orphan(&out);
}

#[test]
fn a_real_in_registers_of_a_serial_line_is_driven_while_its_controller_is_dead() {
    let _one = some_at_a_time();
    if Device::start_of("modbus-level", "rtu", "serial", PYSERIAL).is_none() {
        return;
    }
    let Some(mut device) = Device::start_of("modbus-level", "rtu", "pymodbus", PYMODBUS) else {
        return;
    };
    let line = device.line();
    let path = line.strip_prefix("line ").expect("its path");
    assert_eq!(device.line(), "ready");
    fill_without_a_controller("modbus_rtu", &mut device, &format!("rtu:{path}"));
}
