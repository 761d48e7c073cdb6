//! A cell on processes of this machine, and the tool that changes its program.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde::Serialize;
use serde_json::Value;
use understudy::{Answer, Status};
use understudy_journal::{Command, Commander, OperatorAction};
use understudy_wire::Member;

use crate::children::understudy_command;
use crate::spares::failed;

/// Cycles of a run for each change, at most: it ends by itself where this program was killed.
const CYCLES: u64 = 1500;

/// Cycles until the cell is there, and until it has ended.
const MORE_CYCLES: u64 = 3000;

/// Time after which what is waited for will not come.
const PATIENCE: Duration = Duration::from_secs(60);

const LOOK: Duration = Duration::from_millis(100);

/// The names of the variable that counts and its steps, before and after.
const VARIANTS: [(&str, u32); 2] = [("count", 1), ("total", 10)];

const CLUSTER: &str = "[cluster]\nname = \"changes\"\nperiod = \"20ms\"\nsecurity = \"off\"\n\n\
     [[controller]]\nname = \"counter\"\nladder = \"counter.st\"\nRENAMED\n\n\
     [[controller]]\nname = \"lamp\"\nladder = \"lamp.st\"\n\n\
     [[remote_io]]\ncontroller = \"counter\"\ntrial_cycles = 10\n\n[[remote_io]]\ncontroller = \"lamp\"\n";

const LAMP: &str = "PROGRAM lamp\n  VAR_INPUT go : BOOL; END_VAR\n  VAR_OUTPUT on : BOOL; END_VAR\n  on := NOT on;\nEND_PROGRAM\n";

/// What the run came to.
#[derive(Debug, Default, Serialize)]
pub(super) struct Totals {
    /// Wrong outputs, and what else must not happen.
    pub(super) wrong: u64,
    /// Deadlines with the last true output.
    pub(super) held: u64,
    /// Deadlines with the fail-safe output.
    pub(super) fail_safe: u64,
    /// Deadlines at which the remote I/O was down.
    pub(super) missed: u64,
    /// Held and fail-safe deadlines during host stalls, which are none of the others.
    pub(super) by_stall: u64,
}

pub(super) struct Plant {
    folder: PathBuf,
    run: PathBuf,
    laboratory: Child,
    commander: Commander,
    /// Which of the variants the members run.
    current: usize,
    last_words: String,
}

/// A run of the changing tool.
pub(super) struct Tool(Child);

impl Tool {
    pub(super) fn kill(mut self) {
        // It may have ended.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn program(variant: usize) -> String {
    let (name, step) = VARIANTS[variant];
    format!(
        "PROGRAM counter\n  VAR_INPUT go : BOOL; END_VAR\n  VAR_OUTPUT shown : DINT; END_VAR\n  VAR {name} : DINT; END_VAR\n  \
         {name} := {name} + {step};\n  shown := {name};\nEND_PROGRAM\n"
    )
}

impl Plant {
    pub(super) fn start(folder: &Path, changes: u32, loses: bool) -> Result<Self, Answer> {
        for variant in 0..VARIANTS.len() {
            let folder = folder.join(variant.to_string());
            let [old, new] = [1 - variant, variant].map(|variant| VARIANTS[variant].0);
            let cluster = CLUSTER.replace("RENAMED", &format!("renamed = {{ {old} = \"{new}\" }}"));
            let counter = program(variant);
            let written = fs::create_dir_all(&folder)
                .and_then(|()| fs::write(folder.join("cluster.toml"), cluster))
                .and_then(|()| fs::write(folder.join("counter.st"), counter))
                .and_then(|()| fs::write(folder.join("lamp.st"), LAMP));
            written.map_err(|error| failed("the files of the cell", &error))?;
        }
        let folder =
            fs::canonicalize(folder).map_err(|error| failed("the folder of the cell", &error))?;
        let runs = folder.join("runs");
        let mut command = understudy_command()?;
        command.arg("lab").arg(folder.join("0/cluster.toml")).arg("--out").arg(&runs);
        let cycles = (CYCLES * u64::from(changes) + MORE_CYCLES).to_string();
        command.args(["--cycles", &cycles, "--allow-commands"]);
        if loses {
            command.args(["--loss", "10%"]);
        }
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut laboratory = command.spawn().map_err(|error| failed("the laboratory", &error))?;
        let errors = laboratory.stderr.take();
        let errors = errors.ok_or_else(|| failed("the laboratory", &"no standard error"))?;
        let mut lines = BufReader::new(errors);
        let mut said = String::new();
        while !said.contains("synchronised: ") {
            match lines.read_line(&mut said) {
                Ok(length) if length > 0 => {}
                _ => {
                    let _ = laboratory.wait();
                    let message = format!("the laboratory has ended: {said}");
                    return Err(Answer::failed(Status::Failed, "U0530", message));
                }
            }
        }
        // What it says later is read, so that it never waits.
        std::thread::spawn(move || std::io::copy(&mut lines, &mut std::io::sink()));
        let run = fs::canonicalize(runs.join("latest"));
        let run = run.map_err(|error| failed("the run", &error))?;
        let commander = Commander::of_run(run.clone());
        Ok(Self { folder, run, laboratory, commander, current: 0, last_words: String::new() })
    }

    pub(super) fn directory(&self) -> String {
        self.run.display().to_string()
    }

    /// What the tool said when it was not done last.
    pub(super) fn last_words(&self) -> &str {
        &self.last_words
    }

    /// Begins a step of the change to the other variant.
    pub(super) fn change(&self, step: &str) -> Result<Tool, Answer> {
        let file = |variant: usize| self.folder.join(format!("{variant}/cluster.toml"));
        let mut command = understudy_command()?;
        command.arg("change").arg(file(self.current)).arg(file(1 - self.current));
        command.arg(step).arg("--out").arg(self.folder.join("runs"));
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        let child = command.spawn().map_err(|error| failed("understudy change", &error))?;
        Ok(Tool(child))
    }

    /// Waits for the end of a step; whether it is done.
    pub(super) fn is_done(&mut self, tool: Tool) -> Result<bool, Answer> {
        let output = tool.0.wait_with_output();
        let output = output.map_err(|error| failed("understudy change", &error))?;
        self.last_words = String::from_utf8_lossy(&output.stderr).trim().to_owned();
        Ok(output.status.success())
    }

    /// Members run the other variant from now on.
    pub(super) fn accepted(&mut self) {
        self.current = 1 - self.current;
    }

    pub(super) fn kill(&self, member: Member) -> Result<(), Answer> {
        self.act(member, Command::Kill)
    }

    pub(super) fn restart(&self, member: Member) -> Result<(), Answer> {
        self.act(member, Command::Restart)
    }

    fn act(&self, member: Member, command: Command) -> Result<(), Answer> {
        let action = OperatorAction::Command {
            member,
            command: command.clone(),
            owner: "bench".to_owned(),
            reason: "a failure of the benchmark".to_owned(),
        };
        let begun = Instant::now();
        loop {
            match self.commander.act_and_wait(&action) {
                Ok(_) => return Ok(()),
                Err(refusal) if begun.elapsed() > PATIENCE => {
                    let message = format!("{command:?} of {member:?}: {refusal}");
                    return Err(Answer::failed(Status::Failed, "U0530", message));
                }
                Err(_) => std::thread::sleep(LOOK),
            }
        }
    }

    /// Until the failure of any one station would be masked, so that no two failures meet.
    pub(super) fn wait_until_protected(&self) -> Result<(), Answer> {
        let begun = Instant::now();
        loop {
            let mut command = understudy_command()?;
            command.arg("top").arg(&self.run).args(["--json", "--once"]).stdin(Stdio::null());
            let output = command.output().map_err(|error| failed("understudy top", &error))?;
            let document: Value = serde_json::from_slice(&output.stdout).unwrap_or_default();
            let margin = &document["result"]["margin"];
            if margin["survives"].as_u64().is_some_and(|survives| survives > 0) {
                return Ok(());
            }
            if begun.elapsed() > PATIENCE {
                let message = format!("the cell is not protected again: {margin}");
                return Err(Answer::failed(Status::Failed, "U0530", message));
            }
            std::thread::sleep(LOOK);
        }
    }

    /// Ends the run.
    pub(super) fn end(mut self) -> Result<Totals, Answer> {
        self.interrupt();
        self.laboratory.wait().map_err(|error| failed("the laboratory", &error))?;
        let text = fs::read_to_string(self.run.join("summary.json"));
        let text = text.map_err(|error| failed("summary.json", &error))?;
        let summary: Value = serde_json::from_str(&text).unwrap_or_default();
        Ok(totals(&summary))
    }

    fn interrupt(&self) {
        if let Ok(id) = i32::try_from(self.laboratory.id()) {
            // It may have ended.
            let _ = kill(Pid::from_raw(id), Signal::SIGINT);
        }
    }
}

fn totals(summary: &Value) -> Totals {
    let of = |count: &str| -> u64 {
        let remote_ios = summary["remote_ios"].as_array().into_iter().flatten();
        remote_ios.filter_map(|remote_io| remote_io["counts"][count].as_u64()).sum()
    };
    Totals {
        wrong: summary["violation_count"].as_u64().unwrap_or(u64::MAX),
        held: of("held"),
        fail_safe: of("fail_safe"),
        missed: of("missed"),
        by_stall: of("held_by_stall") + of("fail_safe_by_stall"),
    }
}

impl Drop for Plant {
    fn drop(&mut self) {
        if matches!(self.laboratory.try_wait(), Ok(None)) {
            self.interrupt();
            let _ = self.laboratory.wait();
        }
    }
}
