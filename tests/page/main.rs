//! The page of a run from outside: every path by HTTP, commands against a real laboratory, and a browser where there is one.

#![allow(
    clippy::print_stderr,
    reason = "a test that cannot be done here says why"
)]
#![allow(
    clippy::disallowed_methods,
    reason = "what is waited for has a deadline on the real clock"
)]

mod browser;
mod commands;
mod paths;

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, MutexGuard};
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;

/// Whatever is waited for comes within this time, on a busy machine too.
const DEADLINE: Duration = Duration::from_secs(60);

/// Two clusters at once on two processors would measure each other.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

fn one_at_a_time() -> MutexGuard<'static, ()> {
    ONE_AT_A_TIME
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner())
}

fn empty_folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("page")
        .join(name);
    if folder.exists() {
        fs::remove_dir_all(&folder).expect("an old run's folder goes");
    }
    fs::create_dir_all(&folder).expect("a folder");
    folder
}

fn understudy(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_understudy"));
    command
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"));
    command
}

/// A simulated run in which the robot's station is killed in cycle 50 and started again in cycle 150: its directory.
fn simulated_run(folder: &Path) -> PathBuf {
    let scenario = folder.join("kill.toml");
    let text = "title = \"kill and restart\"\ncycles = 300\n\n[[step]]\nat = 50\naction = \"crash\"\nstation = \"robot\"\n\n[[step]]\nat = 150\naction = \"restart\"\nstation = \"robot\"\n";
    fs::write(&scenario, text).expect("written");
    let runs = folder.join("runs");
    let output = understudy(&["simulate", "examples/press-cell/cluster.toml"])
        .args(["--seed", "7"])
        .arg("--scenario")
        .arg(&scenario)
        .arg("--out")
        .arg(&runs)
        .output()
        .expect("the binary is built");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(runs.join("latest").exists(), "{said}");
    fs::canonicalize(runs.join("latest")).expect("a run")
}

/// A process that serves a page, ended when this is dropped.
struct Page {
    process: Child,
    address: String,
}

/// What was answered.
struct Answer {
    status: u16,
    head: String,
    body: String,
}

impl Answer {
    fn json(&self) -> Value {
        serde_json::from_str(&self.body).unwrap_or_else(|error| {
            let body: String = self.body.chars().take(300).collect();
            panic!("{error}: {} {body}", self.status)
        })
    }

    /// Of a problem.
    fn code(&self) -> String {
        self.json()["error"]["code"]
            .as_str()
            .unwrap_or_default()
            .to_owned()
    }
}

impl Page {
    /// Starts a command that serves a page, and waits until it says where.
    fn start(mut command: Command) -> Self {
        let mut process = command
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the binary is built");
        let errors = process.stderr.take().expect("it is piped");
        let mut errors = BufReader::new(errors);
        let mut said = String::new();
        let address = loop {
            let mut line = String::new();
            let length = errors.read_line(&mut line).expect("text");
            assert!(length > 0, "it ended: {said}");
            if let Some((_, url)) = line.split_once("http://") {
                break url.trim().trim_end_matches('/').to_owned();
            }
            said += &line;
        };
        // It says more, and must not wait for a reader.
        std::thread::spawn(move || std::io::copy(&mut errors, &mut std::io::sink()));
        Self { process, address }
    }

    fn of_run(run: &Path) -> Self {
        let mut command = understudy(&["watch", "--address", "127.0.0.1:0"]);
        command.arg(run);
        let page = Self::start(command);
        page.wait_for("the whole run", |state| state["finished"] == true);
        page
    }

    /// One request as it stands.
    fn request(&self, text: &str) -> Answer {
        let mut stream = TcpStream::connect(&self.address).expect("it listens");
        stream.set_read_timeout(Some(DEADLINE)).expect("a timeout");
        stream.write_all(text.as_bytes()).expect("sent");
        let mut bytes = Vec::new();
        stream.read_to_end(&mut bytes).expect("an answer");
        let text = String::from_utf8(bytes).expect("text");
        let (head, body) = text.split_once("\r\n\r\n").expect("a head");
        let status = head.split(' ').nth(1).expect("a status");
        Answer {
            status: status.parse().expect("a number"),
            head: head.to_lowercase(),
            body: body.to_owned(),
        }
    }

    fn get(&self, path: &str) -> Answer {
        let host = &self.address;
        self.request(&format!(
            "GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n"
        ))
    }

    fn post(&self, path: &str, body: &str) -> Answer {
        let origin = format!("Origin: http://{}\r\n", self.address);
        self.post_with(path, &origin, body)
    }

    fn post_with(&self, path: &str, lines: &str, body: &str) -> Answer {
        let (host, length) = (&self.address, body.len());
        self.request(&format!(
            "POST {path} HTTP/1.1\r\nHost: {host}\r\n{lines}Content-Type: application/json\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n{body}"
        ))
    }

    /// Asks for the state until it is as it is wanted.
    fn wait_for(&self, what: &str, wanted: impl Fn(&Value) -> bool) -> Value {
        let started = Instant::now();
        loop {
            let answer = self.get("/api/state");
            if answer.status == 200 {
                let state = answer.json();
                if wanted(&state) {
                    return state;
                }
            }
            assert!(
                started.elapsed() < DEADLINE,
                "{what} did not come: {}",
                answer.body.chars().take(2000).collect::<String>()
            );
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    fn ask_to_end(&self) {
        let id = i32::try_from(self.process.id()).expect("a process id");
        kill(Pid::from_raw(id), Signal::SIGINT).expect("it runs");
    }

    /// Asks it to end, and waits until it has.
    fn end(mut self) -> i32 {
        self.ask_to_end();
        let status = self.process.wait().expect("it ends");
        status.code().expect("a status")
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        // One that has ended already needs nothing.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn party<'a>(state: &'a Value, name: &str) -> &'a Value {
    let parties = state["parties"].as_array().expect("parties");
    parties
        .iter()
        .find(|party| party["name"] == name)
        .unwrap_or_else(|| panic!("no {name}"))
}
