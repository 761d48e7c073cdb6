//! The command line as a person sees it: help, answers, errors, exit statuses.

mod alert_rules;
mod allocate;
mod animate;
mod book;
mod bounded;
mod campaign;
mod change;
mod check;
mod convert;
mod des;
mod drafts;
mod durations;
mod examples;
mod explain;
mod gateway;
mod help;
mod init;
mod log;
mod model_check;
mod named_files;
mod next;
mod others;
mod outcomes;
mod papers;
mod pasted;
mod petri;
mod points;
mod program_faults;
mod projects;
mod reconfigure;
mod rehearsal;
mod reliability;
mod requirements;
mod scan;
mod searches;
#[allow(
    dead_code,
    clippy::disallowed_methods,
    reason = "each test uses its part, by the real clock"
)]
#[path = "../shared/mod.rs"]
mod shared;
mod terminal;
mod twincat;
mod twins;
mod verdicts;
mod verify;
mod view;
mod warnings;
mod whole_numbers;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// What a command printed, and how it ended.
struct Answer {
    status: i32,
    output: String,
    errors: String,
}

impl Answer {
    /// All of it, for a snapshot.
    fn shown(&self) -> String {
        format!(
            "exit status {}\n--- standard output\n{}--- standard error\n{}",
            self.status, self.output, self.errors
        )
    }

    fn json(&self) -> serde_json::Value {
        serde_json::from_str(&self.output).expect("one JSON document on standard output")
    }
}

/// Runs the built binary in the project's folder.
fn understudy(arguments: &[&str]) -> Answer {
    understudy_in(Path::new(env!("CARGO_MANIFEST_DIR")), arguments)
}

fn understudy_in(folder: &Path, arguments: &[&str]) -> Answer {
    let Output { status, stdout, stderr } = Command::new(env!("CARGO_BIN_EXE_understudy"))
        .args(arguments)
        .current_dir(folder)
        // Help is as wide as the terminal; here there is none.
        .env_remove("COLUMNS")
        .output()
        .expect("the binary is built");
    Answer {
        status: status.code().expect("an exit status"),
        output: String::from_utf8(stdout).expect("text"),
        errors: String::from_utf8(stderr).expect("text"),
    }
}

/// An empty folder of this test's own.
fn empty_folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("commands").join(name);
    if folder.exists() {
        std::fs::remove_dir_all(&folder).expect("an old run's folder goes");
    }
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}
