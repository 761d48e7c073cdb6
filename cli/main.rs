//! The `understudy` command: parses, calls one function a command, prints, exits.

#![allow(
    clippy::disallowed_methods,
    reason = "the command line names runs by the time, and measures speed"
)]

mod allocate;
mod animate;
mod answer;
mod attach;
mod automata;
mod bench;
mod campaign;
mod catalogue;
mod check;
mod console;
mod convert;
mod demo;
mod des;
mod diff;
mod doctor;
mod draw;
mod endurance;
mod excerpt;
mod explain;
mod failover;
mod files;
mod gateway;
mod help;
mod init;
mod journal;
mod keys;
mod kind;
mod lab;
mod measure;
mod member;
mod memory;
mod model_check;
mod operate;
mod outlook;
mod overrides;
mod parity;
mod petri;
mod proxy;
mod reconfigure;
mod reduction;
mod reliability;
mod resources;
mod run;
mod scan;
mod schema;
mod shell;
mod simulate;
mod supervisor_to_ladder;
mod synth;
mod top;
mod verify;
mod view;
mod wakefulness;
mod watch;
mod why;

use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

use answer::{Answer, Status};
use console::Console;

/// A redundant array of independent controllers: RAID for PLCs.
#[derive(Debug, Parser)]
#[command(
    name = "understudy",
    version,
    after_help = "\
Example:
  understudy demo                    the robot and the press of the paper, on real processes
  understudy init cell               a small cluster of your own, to begin with

Exit status: 0 when all is well, 1 when a run or a check of it failed, 2 when an input is wrong and nothing was started.
Understudy is not a safety PLC."
)]
struct Arguments {
    /// Answer with one JSON document on standard output (docs/json.md)
    #[arg(long, global = true)]
    json: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Demo(Box<demo::Arguments>),
    Lab(Box<lab::Arguments>),
    Watch(Box<watch::Arguments>),
    Simulate(simulate::Arguments),
    Check(check::Arguments),
    Explain(explain::Arguments),
    Parity(parity::Arguments),
    Verify(verify::Arguments),
    Draw(draw::Arguments),
    Convert(convert::Arguments),
    Des(des::Arguments),
    Synth(synth::Arguments),
    SupervisorToLadder(supervisor_to_ladder::Arguments),
    Petri(petri::Arguments),
    Reconfigure(reconfigure::Arguments),
    Reliability(reliability::Arguments),
    Resources(resources::Arguments),
    Allocate(Box<allocate::Arguments>),
    Catalogue(catalogue::Arguments),
    Measure(measure::Arguments),
    Outlook(outlook::Arguments),
    Campaign(campaign::Arguments),
    Top(top::Arguments),
    Why(why::Arguments),
    Journal(journal::Arguments),
    Diff(diff::Arguments),
    Animate(animate::Arguments),
    ModelCheck(model_check::Arguments),
    Init(init::Arguments),
    Keys(keys::Arguments),
    Operate(operate::Arguments),
    Doctor(doctor::Arguments),
    Gateway(gateway::Arguments),
    Node(member::Arguments),
    RemoteIo(member::RemoteIoArguments),
    Plant(member::PlantArguments),
    Proxy(proxy::Arguments),
    Bench(bench::Arguments),
    Schema(schema::Arguments),
    Completions(shell::CompletionsArguments),
    Man(shell::ManArguments),
}

impl Command {
    fn name(&self) -> &'static str {
        match self {
            Self::Demo(_) => "demo",
            Self::Lab(_) => "lab",
            Self::Watch(_) => "watch",
            Self::Simulate(_) => "simulate",
            Self::Check(_) => "check",
            Self::Explain(_) => "explain",
            Self::Parity(_) => "parity",
            Self::Verify(_) => "verify",
            Self::Draw(_) => "draw",
            Self::Convert(_) => "convert",
            Self::Des(_) => "des",
            Self::Synth(_) => "synth",
            Self::SupervisorToLadder(_) => "supervisor-to-ladder",
            Self::Petri(_) => "petri",
            Self::Reconfigure(_) => "reconfigure",
            Self::Reliability(_) => "reliability",
            Self::Resources(_) => "resources",
            Self::Allocate(_) => "allocate",
            Self::Catalogue(_) => "catalogue",
            Self::Measure(_) => "measure",
            Self::Outlook(_) => "outlook",
            Self::Campaign(_) => "campaign",
            Self::Top(_) => "top",
            Self::Why(_) => "why",
            Self::Journal(_) => "journal",
            Self::Diff(_) => "diff",
            Self::Animate(_) => "animate",
            Self::ModelCheck(_) => "model-check",
            Self::Init(_) => "init",
            Self::Keys(_) => "keys",
            Self::Operate(_) => "operate",
            Self::Doctor(_) => "doctor",
            Self::Gateway(_) => "gateway",
            Self::Node(_) => "node",
            Self::RemoteIo(_) => "remote-io",
            Self::Plant(_) => "plant",
            Self::Proxy(_) => "proxy",
            Self::Bench(_) => "bench",
            Self::Schema(_) => "schema",
            Self::Completions(_) => "completions",
            Self::Man(_) => "man",
        }
    }

    fn run(self, console: &mut Console) -> Answer {
        match self {
            Self::Demo(arguments) => demo::run(&arguments, console),
            Self::Lab(arguments) => lab::run(&arguments, console),
            Self::Watch(arguments) => watch::run(&arguments, console),
            Self::Simulate(arguments) => simulate::run(&arguments),
            Self::Check(arguments) => check::run(&arguments),
            Self::Explain(arguments) => explain::run(&arguments),
            Self::Parity(arguments) => parity::run(&arguments),
            Self::Verify(arguments) => verify::run(&arguments, console),
            Self::Draw(arguments) => draw::run(&arguments),
            Self::Convert(arguments) => convert::run(&arguments),
            Self::Des(arguments) => des::run(&arguments, console),
            Self::Synth(arguments) => synth::run(&arguments, console),
            Self::SupervisorToLadder(arguments) => supervisor_to_ladder::run(&arguments),
            Self::Petri(arguments) => petri::run(&arguments),
            Self::Reconfigure(arguments) => reconfigure::run(&arguments),
            Self::Reliability(arguments) => reliability::run(&arguments),
            Self::Resources(arguments) => resources::run(&arguments),
            Self::Allocate(arguments) => allocate::run(&arguments, console),
            Self::Catalogue(arguments) => catalogue::run(&arguments),
            Self::Measure(arguments) => measure::run(&arguments, console),
            Self::Outlook(arguments) => outlook::run(&arguments),
            Self::ModelCheck(arguments) => model_check::run(&arguments),
            Self::Campaign(arguments) => campaign::run(&arguments, console),
            Self::Top(arguments) => top::run(&arguments, console),
            Self::Why(arguments) => why::run(&arguments),
            Self::Journal(arguments) => journal::run(&arguments, console.is_json()),
            Self::Diff(arguments) => diff::run(&arguments),
            Self::Animate(arguments) => animate::run(&arguments),
            Self::Init(arguments) => init::run(&arguments),
            Self::Keys(arguments) => keys::run(&arguments),
            Self::Operate(arguments) => operate::run(&arguments),
            Self::Doctor(arguments) => doctor::run(&arguments, console),
            Self::Gateway(arguments) => gateway::run(&arguments, console),
            Self::Node(arguments) => member::run_station(&arguments),
            Self::RemoteIo(arguments) => member::run_remote_io(&arguments.common),
            Self::Plant(arguments) => member::run_plant(&arguments.common),
            Self::Proxy(arguments) => proxy::run(&arguments, console),
            Self::Bench(arguments) => bench::run(arguments, console),
            Self::Schema(arguments) => schema::run(&arguments),
            Self::Completions(arguments) => shell::completions(&arguments),
            Self::Man(arguments) => shell::man(&arguments),
        }
    }
}

fn main() -> ExitCode {
    let matches = help::flowing(Arguments::command()).try_get_matches();
    let parsed = matches.and_then(|matches| Arguments::from_arg_matches(&matches));
    let Arguments { json, command } = match parsed {
        Ok(arguments) => arguments,
        Err(error) => return misused(&error),
    };
    let mut console = Console::new(json);
    let name = command.name();
    let answer = command.run(&mut console);
    console.finish(name, answer)
}

/// The answer to wrong arguments: a code like that of any other failure, and a document where one was asked for. Help and the
/// version are no failures.
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
