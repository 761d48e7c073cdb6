//! What a run is, for other systems: the binary as a server, and what its answers mean.

#![allow(
    clippy::disallowed_methods,
    reason = "what is waited for has a deadline on the real clock"
)]

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;
use understudy_testing::skip;

use crate::{empty_folder, understudy, understudy_in};

/// A finished run of the small cluster, in virtual time: the station `tank` is silent for a hundred cycles.
pub(crate) fn finished_run(name: &str) -> PathBuf {
    let folder = empty_folder(name);
    let made = understudy_in(&folder, &["init", "."]);
    assert_eq!(made.status, 0, "{}", made.errors);
    let arguments =
        ["simulate", "cluster.toml", "--scenario", "kill.toml", "--seed", "1", "--out", "runs"];
    let run = understudy_in(&folder, &arguments);
    assert_eq!(run.status, 0, "{}", run.errors);
    folder
}

/// The value of a metric with all of `labels`.
fn metric(text: &str, name: &str, labels: &[&str]) -> Option<f64> {
    text.lines()
        .find(|line| {
            let rest = line.strip_prefix(name).unwrap_or("#");
            rest.starts_with('{') && labels.iter().all(|label| rest.contains(label))
        })
        .and_then(|line| line.rsplit(' ').next()?.parse().ok())
}

#[test]
fn metrics_count_what_the_journal_has() {
    let folder = finished_run("gateway_metrics");
    let answer = understudy_in(&folder, &["gateway", "metrics", "runs/latest", "--once"]);
    assert_eq!(answer.status, 0, "{}", answer.errors);
    let text = &answer.output;
    assert!(text.ends_with("# EOF\n"));
    let summary = fs::read_to_string(folder.join("runs/latest/summary.json")).expect("a summary");
    let summary: Value = serde_json::from_str(&summary).expect("JSON");
    assert!(summary.is_object());
    let deadlines = |program: &str, source: &str| {
        let labels = [format!("program=\"{program}\""), format!("source=\"{source}\"")];
        let labels: Vec<&str> = labels.iter().map(String::as_str).collect();
        metric(text, "understudy_deadlines_total", &labels).unwrap_or_default()
    };
    for program in ["tank", "conveyor"] {
        assert!(deadlines(program, "reconstructed") >= 90.0, "{text}");
        assert!(deadlines(program, "direct") > deadlines(program, "reconstructed"), "{text}");
    }
    let silent = metric(
        text,
        "understudy_silent_turns_total",
        &["station=\"tank\"", "remote_io=\"tank-io\""],
    );
    assert!(silent.is_some_and(|turns| turns >= 90.0), "{silent:?}");
    let margins = metric(text, "understudy_cycle_margin_seconds_count", &[]);
    assert!(margins.is_some_and(|count| count > 100.0), "{margins:?}");
    // The deadline of a period of 10 ms is a bound.
    for name in ["understudy_token_seconds", "understudy_cycle_margin_seconds"] {
        let bucket = format!("{name}_bucket");
        assert!(metric(text, &bucket, &["le=\"0.0065\""]).is_some(), "{text}");
    }
    let version = format!("version=\"{}\"", env!("CARGO_PKG_VERSION"));
    assert_eq!(metric(text, "understudy_build_info", &[&version]), Some(1.0));
    let journal = fs::metadata(folder.join("runs/latest/journal.jsonl"));
    let written = journal.and_then(|journal| journal.modified()).expect("a journal");
    let written = written.duration_since(std::time::UNIX_EPOCH).expect("later");
    for name in ["last_record", "newest_cycle"] {
        let at = metric(text, &format!("understudy_{name}_timestamp_seconds"), &[]);
        let at = at.expect("a time");
        assert!((at - written.as_secs_f64()).abs() < 1.0, "{name}: {at}");
    }
    let state =
        |state: &str| metric(text, "understudy_run_state", &[&format!("state=\"{state}\"")]);
    assert_eq!((state("finished"), state("running")), (Some(1.0), Some(0.0)));
    assert_eq!(metric(text, "understudy_records_received", &["member=\"tank-io\""]), Some(1.0));
    assert_eq!(
        metric(text, "understudy_station_state", &["station=\"tank\"", "state=\"publishing\""]),
        Some(1.0)
    );
}

#[test]
fn the_register_map_has_every_signal_once() {
    let folder = finished_run("gateway_registers");
    let document = understudy_in(&folder, &["gateway", "registers", "runs/latest", "--json"]);
    assert_eq!(document.status, 0, "{}", document.output);
    let document = document.json();
    let places = document["result"]["registers"].as_array().expect("a list");
    let mut taken = std::collections::BTreeSet::new();
    for place in places {
        let address = place["address"].as_u64().expect("an address");
        for register in 0..place["width"].as_u64().expect("a width") {
            let key = (place["area"].to_string(), address + register);
            assert!(taken.insert(key), "{place} stands on another");
        }
    }
    let named = |name: &str| places.iter().find(|place| place["name"] == name);
    let coil = named("conveyor.motor").expect("an output");
    assert_eq!(coil["area"], "coil");
    assert_eq!(named("tank.source").expect("a register")["address"], Value::from(96));
}

/// A gateway that serves; it is ended with the test.
pub(crate) struct Gateway {
    child: Child,
    address: SocketAddr,
}

impl Gateway {
    pub(crate) fn start(folder: &Path, what: &str) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_understudy"))
            .args(["gateway", what, "runs/latest", "--listen", "127.0.0.1:0"])
            .current_dir(folder)
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the binary is built");
        let errors = child.stderr.take().expect("piped");
        let mut line = String::new();
        BufReader::new(errors).read_line(&mut line).expect("it says where it listens");
        let address = line.trim().rsplit(' ').next().expect("an address");
        let address = address.parse().unwrap_or_else(|error| panic!("{line}: {error}"));
        Self { child, address }
    }

    pub(crate) fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(self.address).expect("it listens");
        stream.set_read_timeout(Some(Duration::from_secs(60))).expect("a deadline");
        stream
    }

    /// It ends in order when it is asked to.
    pub(crate) fn stop(mut self) {
        let process = Pid::from_raw(self.child.id() as i32);
        kill(process, Signal::SIGTERM).expect("it runs");
        let status = self.child.wait().expect("it ends");
        assert_eq!(status.code(), Some(0));
    }
}

impl Drop for Gateway {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn metrics_are_served_over_http_and_nothing_else_is() {
    let folder = finished_run("gateway_http");
    let gateway = Gateway::start(&folder, "metrics");
    let ask = |request: &str| {
        let mut stream = gateway.connect();
        stream.write_all(request.as_bytes()).expect("it takes it");
        let mut answer = String::new();
        stream.read_to_string(&mut answer).expect("it answers");
        answer
    };
    let get =
        |path: &str| ask(&format!("GET {path} HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n"));
    // The journal is read beside the server: until its end there is nothing to tell of the present.
    let deadline = std::time::Instant::now() + Duration::from_secs(60);
    let answer = loop {
        let answer = get("/metrics");
        if answer.starts_with("HTTP/1.1 200 OK\r\n") {
            break answer;
        }
        let is_reading = answer.starts_with("HTTP/1.1 503 ") && answer.contains("U0688");
        assert!(is_reading, "{answer}");
        assert!(std::time::Instant::now() < deadline, "{answer}");
        std::thread::sleep(Duration::from_millis(20));
    };
    assert!(answer.contains("application/openmetrics-text; version=1.0.0"));
    assert!(answer.contains("understudy_deadlines"), "{answer}");
    assert!(get("/").starts_with("HTTP/1.1 404 "));
    let posted =
        ask("POST /metrics HTTP/1.1\r\nHost: a\r\nContent-Length: 0\r\nConnection: close\r\n\r\n");
    assert!(posted.starts_with("HTTP/1.1 405 "), "{posted}");
    assert!(ask("nonsense\r\n\r\n").starts_with("HTTP/1.1 400 "));
    assert!(get("/metrics").starts_with("HTTP/1.1 200 OK\r\n"));
    gateway.stop();
}

/// Each sends a byte of a header that never ends.
#[test]
fn slow_connections_are_closed_and_others_are_answered() {
    let folder = finished_run("gateway_slow");
    let gateway = Gateway::start(&folder, "metrics");
    let mut slow: Vec<TcpStream> = (0..300).map(|_| gateway.connect()).collect();
    for stream in &mut slow {
        let pause = Some(Duration::from_millis(1));
        stream.set_read_timeout(pause).expect("not zero");
    }
    let deadline = std::time::Instant::now() + Duration::from_secs(60);
    while !slow.is_empty() {
        assert!(std::time::Instant::now() < deadline, "{} connections are open", slow.len());
        slow.retain_mut(|stream| {
            let is_taken = stream.write_all(b"x").is_ok();
            let silent = stream.read(&mut [0]).is_err_and(|error| {
                let waits = [std::io::ErrorKind::WouldBlock, std::io::ErrorKind::TimedOut];
                waits.contains(&error.kind())
            });
            is_taken && silent
        });
        std::thread::sleep(Duration::from_millis(100));
    }
    let mut stream = gateway.connect();
    stream
        .write_all(b"GET /metrics HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n")
        .expect("it takes it");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("it answers");
    assert!(answer.starts_with("HTTP/1.1 200 OK\r\n"), "{answer}");
    gateway.stop();
}

/// One request of Modbus TCP; the answer from its function code on.
pub(crate) fn modbus(stream: &mut TcpStream, request: &[u8]) -> Vec<u8> {
    let mut frame = vec![0, 7, 0, 0, 0, request.len() as u8 + 1, 1];
    frame.extend(request);
    stream.write_all(&frame).expect("it takes it");
    let mut header = [0; 7];
    stream.read_exact(&mut header).expect("it answers");
    assert_eq!(header[..2], [0, 7], "the same transaction");
    let length = usize::from(u16::from_be_bytes([header[4], header[5]])) - 1;
    let mut answer = vec![0; length];
    stream.read_exact(&mut answer).expect("the whole answer");
    answer
}

#[test]
fn the_process_image_is_read_by_modbus_and_not_written() {
    let folder = finished_run("gateway_modbus");
    let gateway = Gateway::start(&folder, "modbus");
    let mut stream = gateway.connect();
    // Until the journal was read, the server is busy; the first answer is of the last cycle.
    let deadline = std::time::Instant::now() + Duration::from_secs(60);
    let answer = loop {
        let answer = modbus(&mut stream, &[4, 0, 0, 0, 10]);
        if answer != [0x84, 6] {
            break answer;
        }
        assert!(std::time::Instant::now() < deadline, "busy for ever");
    };
    assert_eq!(answer[..4], [4, 20, 0, 1], "the version of the map");
    assert_eq!(answer[6..10], 699_u32.to_be_bytes(), "the last cycle");
    assert_eq!(answer[18..20], [0, 2], "two programs");
    assert_eq!(answer[20..22], [0, 3], "three stations");
    let source = modbus(&mut stream, &[3, 0, 96, 0, 1]);
    assert_eq!(source, [3, 2, 0, 1], "direct at the end");
    assert_eq!(modbus(&mut stream, &[1, 0, 0, 0, 2])[..2], [1, 1]);
    assert_eq!(modbus(&mut stream, &[2, 0, 0, 0, 2])[..2], [2, 1]);
    assert_eq!(modbus(&mut stream, &[5, 0, 0, 0xff, 0]), [0x85, 1]);
    assert_eq!(modbus(&mut stream, &[6, 0, 0, 0, 1]), [0x86, 1]);
    assert_eq!(modbus(&mut stream, &[4, 0xff, 0xff, 0, 1]), [0x84, 2]);
    assert_eq!(modbus(&mut stream, &[4, 0, 0, 0, 126]), [0x84, 3]);
    let mut other = gateway.connect();
    other.write_all(b"this is no Modbus at all").expect("it takes it");
    assert_eq!(modbus(&mut stream, &[3, 0, 0, 0, 1]), [3, 2, 0, 1]);
    gateway.stop();
}

#[test]
fn what_is_wrong_is_said() {
    let folder = empty_folder("gateway_wrong");
    for what in ["metrics", "modbus", "registers", "zenoh"] {
        let answer = understudy_in(&folder, &["gateway", what, "gone"]);
        assert_eq!(answer.status, 2, "{what}: {}", answer.errors);
        assert!(answer.errors.contains("U0570"), "{}", answer.errors);
    }
    assert_eq!(understudy(&["gateway", "zenoh", "--mirror", "1000/s"]).status, 2);
}

/// The metrics of a run whose last cycles are those before the operator's choice.
fn exposed_while_a_state_is_lost(folder: &Path) -> String {
    let scenario = include_str!("../../examples/press-cell/lost-state.toml");
    let (before, _) = scenario.split_once("[[step]]\nat = 400").expect("the operator's choice");
    let before = before.replace("cycles = 600", "cycles = 390");
    fs::write(folder.join("lost.toml"), before).expect("written");
    let cluster = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/press-cell/cluster.toml");
    let cluster = cluster.to_str().expect("text");
    let scenario = ["--scenario", "lost.toml", "--seed", "1", "--out", "lost"];
    let run = understudy_in(folder, &[&["simulate", cluster][..], &scenario].concat());
    assert!(folder.join("lost/latest").exists(), "{}", run.errors);
    let answer = understudy_in(folder, &["gateway", "metrics", "lost/latest", "--once"]);
    answer.output
}

/// Metrics of an example.
pub(crate) fn exposed_by(folder: &Path, example: &str, scenario: &str) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples").join(example);
    let path = |file: &str| root.join(file).display().to_string();
    let (cluster, scenario) = (path("cluster.toml"), path(scenario));
    let arguments =
        ["simulate", &cluster, "--scenario", &scenario, "--seed", "1", "--out", example];
    let run = understudy_in(folder, &arguments);
    assert_eq!(run.status, 0, "{}", run.errors);
    let latest = format!("{example}/latest");
    understudy_in(folder, &["gateway", "metrics", &latest, "--once"]).output
}

/// The names of metrics in a text.
pub(crate) fn metric_names(text: &str) -> std::collections::BTreeSet<String> {
    let belongs = |character: char| character.is_ascii_alphanumeric() || character == '_';
    text.split(|character: char| !belongs(character))
        .filter(|word| word.starts_with("understudy_") && *word != "understudy_client")
        .map(str::to_owned)
        .collect()
}

/// Metrics of a run of processes.
fn exposed_by_processes(folder: &Path) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let cluster = root.join("examples/press-cell/cluster.toml").display().to_string();
    let arguments =
        ["lab", &cluster, "--cycles", "20", "--link", "udp", "--period", "50ms", "--out", "lab"];
    understudy_in(folder, &arguments);
    understudy_in(folder, &["gateway", "metrics", "lab/latest", "--once"]).output
}

#[test]
fn the_dashboard_and_the_page_name_metrics_that_there_are() {
    let folder = finished_run("gateway_dashboard");
    let answer = understudy_in(&folder, &["gateway", "metrics", "runs/latest", "--once"]);
    let samples = answer.output.lines().filter(|line| !line.starts_with('#'));
    let exposed: std::collections::BTreeSet<&str> =
        samples.filter_map(|line| line.split(['{', ' ']).next()).collect();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    // Some have a sample only while something is wrong, where alarms are declared, with two networks, or in processes.
    let at_times = exposed_while_a_state_is_lost(&folder)
        + &exposed_by(&folder, "heated-tank", "kill-each.toml")
        + &exposed_by(&folder, "two-networks", "network-fails.toml")
        + &exposed_by_processes(&folder);
    let read = |path: &str| fs::read_to_string(root.join(path)).expect("a file");
    let dashboard = read("deployment/monitoring/dashboards/understudy.json");
    let document: Value = serde_json::from_str(&dashboard).expect("JSON");
    assert!(document["panels"].as_array().is_some_and(|panels| panels.len() > 5));
    for name in metric_names(&dashboard) {
        assert!(exposed.contains(name.as_str()), "{name} is not exposed");
    }
    // Those of a plant file need its groups: the gateway registers them.
    let of_plant = read("observation/gateway/src/plant.rs");
    for name in metric_names(&read("docs/how-to/monitoring.md")) {
        let registered =
            name.strip_prefix("understudy_plant_").map(|name| format!("register(\"{name}\""));
        if registered.is_some_and(|registered| of_plant.contains(&registered)) {
            continue;
        }
        let is_there = exposed.contains(name.as_str())
            || exposed.contains(format!("{name}_count").as_str())
            || at_times.contains(&format!("\n{name}{{"));
        assert!(is_there, "{name} is not exposed");
    }
}

#[test]
fn grafanas_own_model_reads_the_dashboard_whole() {
    let python = std::env::var("UNDERSTUDY_PYTHON").unwrap_or_else(|_| "python3".into());
    let read = Command::new(&python)
        .arg("tests/commands/dashboard.py")
        .arg("deployment/monitoring/dashboards/understudy.json")
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output();
    let missing = read.as_ref().map_or(true, |read| read.status.code() == Some(77));
    if missing {
        skip(format_args!(
            "{python} has no Grafana model: pip install grafana-foundation-sdk, and name it by UNDERSTUDY_PYTHON"
        ));
        return;
    }
    let read = read.expect("it ran");
    let errors = String::from_utf8_lossy(&read.stderr);
    assert!(read.status.success(), "{errors}");
}

/// A SCADA imports names, addresses, types and cards from one list; the cluster file is enough for it.
#[test]
fn the_tags_of_a_cluster_are_a_list_as_csv() {
    let cluster = "examples/heated-tank/cluster.toml";
    let answer = understudy(&["gateway", "registers", cluster, "--csv"]);
    assert_eq!(answer.status, 0, "{}", answer.errors);
    let mut lines = answer.output.split("\r\n");
    let heads =
        "name,table,address,registers,type,writable,unit,decimals,low,high,group,description";
    assert_eq!(lines.next(), Some(heads));
    let rows: Vec<&str> = lines.filter(|line| !line.trim().is_empty()).collect();
    let json = understudy(&["gateway", "registers", cluster, "--csv", "--json"]).json();
    let places = json["result"]["registers"].as_array().expect("places");
    assert_eq!(rows.len(), places.len());
    let named = |name: &str| rows.iter().find(|row| row.starts_with(name)).copied();
    let place = places.iter().find(|place| place["name"] == "temperature.temperature");
    let place = place.expect("a signal");
    let address = &place["address"];
    let expected = format!(
        "temperature.temperature,register,{address},2,REAL,false,°C,1,0,60,batch,Temperature of the batch"
    );
    assert_eq!(named("temperature.temperature,"), Some(expected.as_str()));
    assert_eq!((&place["unit"], &place["high"]), (&"°C".into(), &60.0.into()));
    let drain =
        "level.drain,discrete input,0,1,BOOL,false,,,,,tank,\"Push button, or the end of a batch\"";
    assert_eq!(named("level.drain,"), Some(drain));
    assert!(named("run.cycle,register,2,2,UDINT,false,,,,,,").is_some(), "{rows:?}");
    let text = understudy(&["gateway", "registers", cluster]).output;
    assert!(
        text.contains("REAL in °C: input, as last sampled; Temperature of the batch"),
        "{text}"
    );
}
