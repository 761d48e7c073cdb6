//! What a shell and a reader of manuals want to know of the command line.

use clap::{Args, CommandFactory};
use clap_complete::Shell;
use serde_json::json;

use crate::answer::{Answer, Status};

/// Print a script that completes commands in a shell
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy completions bash > ~/.local/share/bash-completion/completions/understudy")]
pub(crate) struct CompletionsArguments {
    /// For which shell
    #[arg(value_enum)]
    shell: Shell,
}

/// Print the manual page
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy man | man -l -")]
pub(crate) struct ManArguments {}

pub(crate) fn completions(arguments: &CompletionsArguments) -> Answer {
    let mut script = Vec::new();
    let mut command = crate::Arguments::command();
    clap_complete::generate(arguments.shell, &mut command, "understudy", &mut script);
    answer(script)
}

pub(crate) fn man(_: &ManArguments) -> Answer {
    let mut page = Vec::new();
    match clap_mangen::Man::new(crate::Arguments::command()).render(&mut page) {
        Ok(()) => answer(page),
        Err(error) => Answer::failed(Status::Failed, "U0602", error.to_string()),
    }
}

fn answer(bytes: Vec<u8>) -> Answer {
    let text = String::from_utf8_lossy(&bytes).into_owned();
    let result = json!({ "text": text });
    Answer::done(text, result)
}
