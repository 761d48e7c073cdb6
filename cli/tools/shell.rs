//! `understudy completions` and `understudy man`.

use std::io;

use clap::{Args, Command};
use clap_complete::Shell;
use clap_mangen::Man;
use serde_json::json;

use crate::answer::{Answer, Status};
use crate::commands::{Group, groups, parser};

/// Print the completion script for a shell
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy completions bash > ~/.local/share/bash-completion/completions/understudy")]
pub(crate) struct CompletionsArguments {
    /// Shell to complete commands in
    #[arg(value_enum)]
    shell: Shell,
}

/// Print the manual page
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy man | man -l -")]
pub(crate) struct ManArguments {}

/// Shells list the commands with their groups.
pub(crate) fn completions(arguments: &CompletionsArguments) -> Answer {
    let groups = groups();
    let mut parser = parser(&groups);
    for group in &groups {
        for command in group.parsers() {
            parser = parser.mut_subcommand(command.get_name(), |command| {
                let about = command.get_about().map(ToString::to_string);
                let about = about.unwrap_or_default();
                command.about(format!("{}: {about}", group.name))
            });
        }
    }
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut parser, "understudy", &mut script);
    answer(script)
}

pub(crate) fn man(_: &ManArguments) -> Answer {
    match page() {
        Ok(page) => answer(page),
        Err(error) => Answer::failed(Status::Failed, "U0602", error),
    }
}

/// The manual page, with a section for each group of commands.
fn page() -> io::Result<Vec<u8>> {
    let groups = groups();
    let mut page = Vec::new();
    let whole = Man::new(parser(&groups));
    whole.render_title(&mut page)?;
    whole.render_name_section(&mut page)?;
    whole.render_synopsis_section(&mut page)?;
    whole.render_description_section(&mut page)?;
    whole.render_options_section(&mut page)?;
    for group in &groups {
        of_group(group).render_subcommands_section(&mut page)?;
    }
    whole.render_extra_section(&mut page)?;
    whole.render_version_section(&mut page)?;
    Ok(page)
}

fn of_group(group: &Group) -> Man {
    let parser = Command::new("understudy")
        .subcommand_help_heading(group.title)
        .disable_help_subcommand(true)
        .subcommands(group.parsers());
    Man::new(parser)
}

fn answer(bytes: Vec<u8>) -> Answer {
    let text = String::from_utf8_lossy(&bytes).into_owned();
    let result = json!({ "text": text });
    Answer::done(text, result)
}
