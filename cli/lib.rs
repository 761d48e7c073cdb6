//! The command line: parses, calls one function per command, prints. [`main`] is the `understudy` command; the other items are what the
//! benchmarks run clusters with.

#![allow(clippy::disallowed_methods, reason = "the command line names runs by the time")]

mod answer;
mod commands;
mod console;
mod deployment;
mod excerpt;
mod files;
mod inspect;
mod kind;
mod member;
mod overrides;
mod patience;
mod plants;
mod programs;
mod reliability;
mod run;
mod supervisors;
mod tools;

use std::process::ExitCode;

use clap::error::ErrorKind;
use commands::Call;

pub use answer::{Answer, Failure, Status};
pub use console::Console;
pub use files::{ladder, write as write_file};
pub use member::{Arguments as MemberArguments, run_plant, run_remote_io, run_station};
pub use overrides::OverrideArguments;
pub use run::cluster_run::ClusterRun;
pub use run::lab::{Judged, NetworkArguments, RunArguments};
pub use tools::proxy::{Arguments as ProxyArguments, run as run_proxy};

/// Runs the command of this process's arguments.
pub fn main() -> ExitCode {
    let groups = commands::groups();
    called(commands::parse(commands::parser(&groups), &groups))
}

/// The same for `understudy-runtime`, which has the commands of a machine that runs members. What they do not need is not linked.
pub fn runtime() -> ExitCode {
    let groups = [deployment::members()];
    called(commands::parse(commands::runtime_parser(&groups), &groups))
}

fn called(call: Result<Call, clap::Error>) -> ExitCode {
    let call = match call {
        Ok(call) => call,
        Err(error) => return misused(&error),
    };
    let mut console = Console::new(call.json);
    let name = call.name;
    let log = call.log.clone().start();
    let command = tracing::error_span!("command", command = name).entered();
    tracing::debug!("begins");
    let answer = call.run(&mut console);
    let status = answer.status.code();
    let exit = console.finish(name, answer);
    tracing::debug!(status, "ends");
    drop(command);
    if let Some(log) = log {
        log.finish();
    }
    exit
}

/// The answer to invalid arguments: a code like that of any other failure, and a document under `--json`. Help and the version are no
/// failures.
pub fn misused(error: &clap::Error) -> ExitCode {
    let json = std::env::args_os().any(|argument| argument == "--json");
    let is_help = error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand;
    if !error.use_stderr() || (is_help && !json) {
        error.exit();
    }
    let text = error.render().to_string();
    let message = text.strip_prefix("error: ").unwrap_or(&text).trim_end();
    let command = std::env::args().nth(1).unwrap_or_default();
    let answer = Answer::failed(Status::BadInput, "U0600", message);
    Console::new(json).finish(&command, answer)
}
