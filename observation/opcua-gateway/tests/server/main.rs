//! The binary from outside: by hand on its socket, and by another project's client where this machine has it:
//! `UNDERSTUDY_PYTHON` names a Python with asyncua.

#![allow(
    clippy::disallowed_methods,
    reason = "what is waited for has a deadline on the real clock"
)]

mod cards;
mod level;

use std::fs::{self, Permissions};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;
use understudy_cluster::{Cluster, press_cell};
use understudy_cycle::Mode;
use understudy_journal::{Journal, Members, keep_cluster};
use understudy_scenarios::{read as read_scenario, simulate};
use understudy_testing::skip;
use understudy_view::{Bounds, Run};

/// What the reader is written for.
const ASYNCUA: &str = "2.1.0";

/// Longer than anything that is waited for takes on a busy machine.
const DEADLINE: Duration = Duration::from_secs(60);

const BINARY: &str = env!("CARGO_BIN_EXE_understudy-opcua");

fn empty_folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("opcua").join(name);
    if folder.exists() {
        fs::remove_dir_all(&folder).expect("an old folder goes");
    }
    fs::create_dir_all(&folder).expect("a folder");
    folder
}

fn cell() -> Cluster {
    understudy_testing::press_cell(Mode::Full)
}

/// A folder with `run`, a finished one of the press cell in virtual time: the robot's station crashes in cycle 20.
fn finished_run(name: &str) -> PathBuf {
    finished_run_of(name, 60)
}

fn finished_run_of(name: &str, cycles: u64) -> PathBuf {
    finished_run_with(name, cycles, "")
}

/// The same with more steps.
fn finished_run_with(name: &str, cycles: u64, steps: &str) -> PathBuf {
    let folder = empty_folder(name);
    for file in press_cell() {
        fs::write(folder.join(file.name), file.text).expect("written");
    }
    let run = folder.join("run");
    fs::create_dir_all(&run).expect("a folder");
    let cluster = cell();
    keep_cluster(&run, &folder.join("cluster.toml"), &cluster).expect("kept");
    let text = format!(
        "title = \"A crash\"\ncycles = {cycles}\n[[step]]\nat = 20\naction = \"crash\"\nstation = \"robot\"\n{steps}"
    );
    let scenario = read_scenario("crash.toml", &text, Some(&Members::of(&cluster)));
    let scenario = scenario.scenario.expect("it is right");
    let mut journal = Journal::create(&run.join("journal.jsonl"), 1_000_000_000).expect("created");
    simulate(&cluster, &scenario, 1, &mut |record| journal.write(record))
        .expect("the cluster comes into step");
    assert_eq!(journal.finish().lost, 0);
    // The results of a run are written when its journal is.
    fs::write(run.join("summary.json"), "{}").expect("written");
    folder
}

fn answer(folder: &Path, arguments: &[&str]) -> (i32, String, String) {
    let Output { status, stdout, stderr } = Command::new(BINARY)
        .args(arguments)
        .current_dir(folder)
        .env_remove("COLUMNS")
        .output()
        .expect("the binary is built");
    (
        status.code().expect("an exit status"),
        String::from_utf8(stdout).expect("text"),
        String::from_utf8(stderr).expect("text"),
    )
}

/// A server; it is ended with the test.
struct Server {
    child: Child,
    address: SocketAddr,
}

impl Server {
    fn start(folder: &Path, arguments: &[&str]) -> Self {
        Self::start_at("127.0.0.1:0", folder, arguments)
    }

    fn start_at(address: &str, folder: &Path, arguments: &[&str]) -> Self {
        let mut child = Command::new(BINARY)
            .args(["serve", "run", "--listen", address])
            .args(arguments)
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

    /// It ends in order when it is asked to.
    fn stop(mut self) {
        let process = Pid::from_raw(self.child.id() as i32);
        kill(process, Signal::SIGTERM).expect("it runs");
        let status = self.child.wait().expect("it ends");
        assert_eq!(status.code(), Some(0));
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The message of OPC UA TCP that answers `sent`.
fn exchange(address: SocketAddr, sent: &[u8]) -> Vec<u8> {
    let mut stream = TcpStream::connect(address).expect("it listens");
    stream.set_read_timeout(Some(DEADLINE)).expect("a deadline");
    stream.write_all(sent).expect("it takes it");
    let mut answer = Vec::new();
    let mut header = [0; 8];
    if stream.read_exact(&mut header).is_ok() {
        let length = u32::from_le_bytes([header[4], header[5], header[6], header[7]]);
        answer.extend(header);
        answer.resize(length as usize, 0);
        stream.read_exact(&mut answer[8..]).expect("all of it");
    }
    answer
}

/// `HEL` with usual sizes.
fn hello(address: SocketAddr) -> Vec<u8> {
    let url = format!("opc.tcp://{address}/");
    let mut body = Vec::new();
    for number in [0, 65_536, 65_536, 0, 0, url.len() as u32] {
        body.extend(number.to_le_bytes());
    }
    body.extend(url.as_bytes());
    let mut message = b"HELF".to_vec();
    message.extend((body.len() as u32 + 8).to_le_bytes());
    message.extend(body);
    message
}

#[test]
fn it_shakes_hands_survives_nonsense_and_ends_in_order() {
    let folder = finished_run("hello");
    let server = Server::start(&folder, &[]);
    let good = hello(server.address);
    assert_eq!(exchange(server.address, &good)[..4], *b"ACKF");
    for nonsense in [
        &b"GET / HTTP/1.1\r\nHost: a\r\n\r\n"[..],
        b"HELF\xff\xff\xff\xff\0\0\0\0",
        b"OPNF\x10\0\0\0\0\0\0\0\0\0\0\0",
    ] {
        let answer = exchange(server.address, nonsense);
        assert!(answer.is_empty() || answer.starts_with(b"ERRF"));
    }
    assert_eq!(exchange(server.address, &good)[..4], *b"ACKF");
    server.stop();
    let entries = fs::read_dir(&folder).expect("a folder").count();
    assert_eq!(entries, press_cell().len() + 1, "it writes nothing");
}

#[test]
fn the_nodes_are_listed_for_people_and_for_machines() {
    let folder = finished_run("nodes");
    let (status, table, errors) = answer(&folder, &["nodes", "run"]);
    assert_eq!((status, errors.as_str()), (0, ""));
    let (status, document, _) = answer(&folder, &["nodes", "run", "--json"]);
    assert_eq!(status, 0);
    let document: Value = serde_json::from_str(&document).expect("JSON");
    let variables = document["variables"].as_array().expect("a list");
    assert_eq!(table.lines().count(), variables.len());
    for variable in variables {
        let identifier = variable["identifier"].as_str().expect("a text");
        assert!(table.contains(identifier), "{identifier}");
    }
    let namespace = document["namespace"].as_str().expect("a text");
    assert!(namespace.starts_with("urn:understudy:"), "{namespace}");
}

#[test]
fn what_is_wrong_is_said_and_nothing_is_started() {
    let folder = finished_run("wrong");
    let check = |arguments: &[&str], code: &str| {
        let (status, _, errors) = answer(&folder, arguments);
        assert_eq!(status, 2, "{arguments:?}: {errors}");
        assert!(errors.contains(code), "{arguments:?}: {errors}");
    };
    check(&["nodes", "gone"], "U0570");
    check(&["serve", "gone"], "U0570");
    check(&["serve", "run", "--listen", "0.0.0.0:0"], "U0594");
    check(&["serve", "run", "--user", "a"], "--password-file");
    let login = |file: &str| {
        let arguments = ["serve", "run", "--certificates", "c", "--user", "reader"];
        check(&[&arguments[..], &["--password-file", file]].concat(), "U0595");
    };
    login("gone");
    let write = |name: &str, text: &str, mode: u32| {
        fs::write(folder.join(name), text).expect("written");
        fs::set_permissions(folder.join(name), Permissions::from_mode(mode)).expect("changed");
    };
    write("open", "secret\n", 0o644);
    login("open");
    write("empty", "\n", 0o600);
    login("empty");
    let logins = |text: &str| {
        write("logins", text, 0o600);
        let arguments = ["serve", "run", "--certificates", "c", "--logins", "logins"];
        check(&arguments, "U0595");
    };
    logins("");
    logins("owner anna secret\n");
    logins("operator anna\n");
    logins("operator anna secret\nviewer anna secret\n");
    write("logins", "operator anna secret\n", 0o644);
    check(&["serve", "run", "--certificates", "c", "--logins", "logins"], "U0595");
    check(&["serve", "run", "--logins", "logins"], "--certificates");
    assert!(!folder.join("c").exists(), "nothing is half made");

    let certificates = |folder: &str| check(&["serve", "run", "--certificates", folder], "U0596");
    certificates("open");
    fs::create_dir_all(folder.join("half/own")).expect("a folder");
    write("half/own/cert.der", "none", 0o644);
    certificates("half");
    fs::create_dir_all(folder.join("half/private")).expect("a folder");
    write("half/private/private.pem", "none", 0o600);
    certificates("half");
    write("half/private/private.pem", "none", 0o644);
    certificates("half");
}

#[test]
fn its_help_its_manual_and_its_completions_are_there() {
    let folder = empty_folder("help");
    for arguments in [&["--help"][..], &["man"], &["completions", "bash"]] {
        let (status, output, errors) = answer(&folder, arguments);
        assert_eq!((status, errors.as_str()), (0, ""), "{arguments:?}");
        assert!(output.contains("understudy-opcua"), "{arguments:?}");
    }
}

/// A Python with asyncua; says so where there is none.
fn python() -> Option<String> {
    let python = std::env::var("UNDERSTUDY_PYTHON").unwrap_or_else(|_| "python3".into());
    let script = "import importlib.metadata as m; print(m.version('asyncua'))";
    let output = Command::new(&python).args(["-c", script]).output();
    let version = output.map_or_else(
        |error| error.to_string(),
        |output| String::from_utf8_lossy(&output.stdout).trim().to_owned(),
    );
    if version == ASYNCUA {
        return Some(python);
    }
    skip(format_args!(
        "{python} has asyncua {version:?} and not {ASYNCUA}: pip install asyncua=={ASYNCUA}"
    ));
    None
}

/// The reader beside this test, which checks what it reads.
fn reader(python: &str, arguments: &[&str]) {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reader.py");
    let output = Command::new("timeout")
        .arg("300")
        .arg(python)
        .arg(script)
        .args(arguments)
        .output()
        .expect("a Python");
    assert!(
        output.status.success(),
        "{arguments:?}\n{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
}

#[test]
fn another_projects_client_reads_subscribes_and_may_not_write() {
    let Some(python) = python() else { return };
    let folder = finished_run("asyncua");
    let server = Server::start(&folder, &[]);
    reader(&python, &["clear", &format!("opc.tcp://{}/", server.address)]);
    server.stop();
}

#[test]
fn another_projects_client_follows_a_run_that_is_written() {
    let Some(python) = python() else { return };
    let folder = finished_run("asyncua-live");
    let journal = folder.join("run/journal.jsonl");
    let records = fs::read_to_string(&journal).expect("a journal");
    let results = folder.join("run/summary.json");
    fs::remove_file(&results).expect("it was there");
    let lines: Vec<&str> = records.lines().collect();
    fs::write(&journal, "").expect("written");
    let server = Server::start(&folder, &[]);
    let url = format!("opc.tcp://{}/", server.address);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reader.py");
    let mut child = Command::new("timeout")
        .arg("300")
        .arg(&python)
        .arg(script)
        .args(["follow", &url])
        .stdout(Stdio::piped())
        .spawn()
        .expect("a Python");
    let mut said = BufReader::new(child.stdout.take().expect("piped")).lines();
    let mut next = || said.next().and_then(Result::ok).unwrap_or_default();
    // It subscribes while nothing is known, and is then shown one half of the run after the other.
    assert_eq!(next(), "subscribed");
    let mut file = fs::OpenOptions::new().append(true).open(&journal).expect("the journal");
    let halves: Vec<&[&str]> = lines.chunks(lines.len().div_ceil(2)).collect();
    for (number, half) in halves.iter().enumerate() {
        file.write_all((half.join("\n") + "\n").as_bytes()).expect("written");
        if number == 1 {
            fs::write(&results, "{}").expect("written");
        }
        assert_eq!(next(), "seen");
    }
    assert!(child.wait().expect("it ends").success());
    server.stop();
}

/// A client that is there from the start on is told nothing until the journal is read, and then the present: the robot is dead.
#[test]
fn another_projects_client_is_told_no_past() {
    let Some(python) = python() else { return };
    let folder = finished_run_of("asyncua-present", 3000);
    fs::remove_file(folder.join("run/summary.json")).expect("it was there");
    let run = Run::open(&folder.join("run")).expect("a run");
    let model = run.read(Bounds::default()).expect("readable");
    let cycle = model.cycle().expect("a cycle").to_string();
    let free = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = free.local_addr().expect("its address").to_string();
    drop(free);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reader.py");
    let mut child = Command::new("timeout")
        .args(["300", &python])
        .arg(script)
        .args(["present", &format!("opc.tcp://{address}/"), &cycle])
        .stdout(Stdio::piped())
        .spawn()
        .expect("a Python");
    let mut said = BufReader::new(child.stdout.take().expect("piped")).lines();
    assert_eq!(said.next().and_then(Result::ok).as_deref(), Some("ready"));
    let server = Server::start_at(&address, &folder, &[]);
    assert!(child.wait().expect("it ends").success());
    server.stop();
}

#[test]
fn with_certificates_only_who_is_trusted_and_has_a_login_reads() {
    let Some(python) = python() else { return };
    let folder = finished_run("asyncua-secure");
    fs::write(folder.join("password"), "not a good one\n").expect("written");
    fs::set_permissions(folder.join("password"), Permissions::from_mode(0o600)).expect("changed");
    let server = Server::start(
        &folder,
        &["--certificates", "certificates", "--user", "reader", "--password-file", "password"],
    );
    let mode = |path: &str| {
        let metadata = fs::metadata(folder.join(path)).expect("it was made");
        metadata.permissions().mode() & 0o777
    };
    assert_eq!(mode("certificates/private"), 0o700);
    assert_eq!(mode("certificates/private/private.pem"), 0o600);
    let url = format!("opc.tcp://{}/", server.address);
    let certificates = folder.join("certificates");
    reader(
        &python,
        &["secure", &url, certificates.to_str().expect("text"), "reader", "not a good one"],
    );
    server.stop();
    // The same certificate serves again.
    let before = fs::read(folder.join("certificates/own/cert.der")).expect("a certificate");
    Server::start(&folder, &["--certificates", "certificates"]).stop();
    let after = fs::read(folder.join("certificates/own/cert.der")).expect("a certificate");
    assert_eq!(before, after);
    let (status, _, errors) =
        answer(&folder, &["serve", "run", "--certificates", "certificates", "--host", "elsewhere"]);
    assert_eq!(status, 2, "{errors}");
    assert!(errors.contains("U0596"), "{errors}");
}
