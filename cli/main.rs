//! The `understudy` command: parses, calls one function per command, prints, exits.

#![allow(
    clippy::disallowed_methods,
    reason = "the command line names runs by the time, and measures speed"
)]

mod answer;
mod bench;
mod commands;
mod console;
mod deployment;
mod endurance;
mod excerpt;
mod failover;
mod files;
mod inspect;
mod kind;
mod member;
mod memory;
mod overrides;
mod programs;
mod reliability;
mod run;
mod scan;
mod supervisors;
mod tools;

use std::process::ExitCode;

use clap::error::ErrorKind;

use answer::{Answer, Status};
use console::Console;

fn main() -> ExitCode {
    let call = match commands::parse() {
        Ok(call) => call,
        Err(error) => return misused(&error),
    };
    let mut console = Console::new(call.json);
    let name = call.name;
    let answer = call.run(&mut console);
    console.finish(name, answer)
}

/// The answer to invalid arguments: a code like that of any other failure, and a document under `--json`. Help and the version are no
/// failures.
fn misused(error: &clap::Error) -> ExitCode {
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
