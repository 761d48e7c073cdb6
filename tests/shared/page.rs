//! A process that serves a page, and what is asked of it.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Instant;

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;

use super::{DEADLINE, understudy};

/// A process that serves a page, ended when this is dropped.
pub(crate) struct Page {
    process: Child,
    pub(crate) address: String,
    /// What it said before it said where.
    pub(crate) said: String,
}

/// What was answered.
pub(crate) struct Answer {
    pub(crate) status: u16,
    pub(crate) head: String,
    pub(crate) body: String,
}

impl Answer {
    pub(crate) fn json(&self) -> Value {
        serde_json::from_str(&self.body).unwrap_or_else(|error| {
            let body: String = self.body.chars().take(300).collect();
            panic!("{error}: {} {body}", self.status)
        })
    }

    /// Of a problem.
    pub(crate) fn code(&self) -> String {
        self.json()["error"]["code"].as_str().unwrap_or_default().to_owned()
    }
}

impl Page {
    /// Starts a command that serves a page, and waits until it says where.
    pub(crate) fn start(mut command: Command) -> Self {
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
        Self { process, address, said }
    }

    pub(crate) fn of_run(run: &Path) -> Self {
        let mut command = understudy(&["watch", "--address", "127.0.0.1:0"]);
        command.arg(run);
        let page = Self::start(command);
        page.wait_for("the whole run", |state| state["finished"] == true);
        page
    }

    /// One request as it stands.
    pub(crate) fn request(&self, text: &str) -> Answer {
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

    pub(crate) fn get(&self, path: &str) -> Answer {
        let host = &self.address;
        self.request(&format!("GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n"))
    }

    pub(crate) fn post(&self, path: &str, body: &str) -> Answer {
        let origin = format!("Origin: http://{}\r\n", self.address);
        self.post_with(path, &origin, body)
    }

    pub(crate) fn post_with(&self, path: &str, lines: &str, body: &str) -> Answer {
        let (host, length) = (&self.address, body.len());
        self.request(&format!(
            "POST {path} HTTP/1.1\r\nHost: {host}\r\n{lines}Content-Type: application/json\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n{body}"
        ))
    }

    /// Is told of each new state until it is as it is wanted.
    pub(crate) fn wait_for(&self, what: &str, wanted: impl Fn(&Value) -> bool) -> Value {
        let started = Instant::now();
        let mut stream = TcpStream::connect(&self.address).expect("it listens");
        stream.set_read_timeout(Some(DEADLINE)).expect("a timeout");
        let host = &self.address;
        // In this version of HTTP a stream has no pieces of its own.
        let asked = format!("GET /api/live HTTP/1.0\r\nHost: {host}\r\n\r\n");
        stream.write_all(asked.as_bytes()).expect("sent");
        let (mut last, mut is_state) = (Value::Null, false);
        for line in BufReader::new(stream).lines() {
            let line = line.expect("it tells of states, or that there is nothing new");
            if let Some(name) = line.strip_prefix("event: ") {
                is_state = name == "state";
            } else if let Some(state) = line.strip_prefix("data: ").filter(|_| is_state) {
                last = serde_json::from_str(state).expect("JSON");
                if !last.is_null() && wanted(&last) {
                    return last;
                }
            }
            let last = last.to_string();
            assert!(started.elapsed() < DEADLINE, "{what} did not come: {last:.2000}");
        }
        panic!("the page ended before {what} came");
    }

    pub(crate) fn ask_to_end(&self) {
        self.signal(Signal::SIGINT);
    }

    pub(crate) fn id(&self) -> u32 {
        self.process.id()
    }

    pub(crate) fn signal(&self, signal: Signal) {
        let id = i32::try_from(self.process.id()).expect("a process id");
        kill(Pid::from_raw(id), signal).expect("it runs");
    }

    /// Asks it to end, and waits until it has.
    pub(crate) fn end(mut self) -> i32 {
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

pub(crate) fn member<'a>(state: &'a Value, name: &str) -> &'a Value {
    let members = state["members"].as_array().expect("members");
    members.iter().find(|member| member["name"] == name).unwrap_or_else(|| panic!("no {name}"))
}
