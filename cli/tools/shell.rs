//! `understudy completions` and `understudy man`.

use std::io;

use clap::{Args, Command};
use clap_complete::Shell;
use clap_mangen::Man;
use serde_json::json;
use understudy_text::spelling;

use crate::answer::{Answer, Status};
use crate::commands::{EXIT_STATUS, Group, groups, parser};

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

/// Print the manual page of the program or of a command
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy man | man -l -
  understudy man verify | man -l -")]
pub(crate) struct ManArguments {
    /// Command; without it the page lists all commands
    #[arg(value_name = "COMMAND")]
    command: Option<String>,
}

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

pub(crate) fn man(arguments: &ManArguments) -> Answer {
    let groups = groups();
    let page = match &arguments.command {
        None => page(&groups),
        Some(name) => {
            let entries = groups.iter().flat_map(|group| &group.entries);
            let names: Vec<&str> = entries.map(|entry| entry.name).collect();
            if !names.contains(&name.as_str()) {
                let message = match spelling::nearest(name, names) {
                    Some(near) => format!("there is no command `{name}`: did you mean `{near}`?"),
                    None => format!("there is no command `{name}`: `understudy --help` lists them"),
                };
                return Answer::failed(Status::BadInput, "U0600", message);
            }
            page_of(name, parser(&groups))
        }
    };
    match page {
        Ok(page) => answer(page),
        Err(error) => Answer::failed(Status::Failed, "U0602", error),
    }
}

/// The manual page of one command, which exists.
fn page_of(name: &str, mut whole: Command) -> io::Result<Vec<u8>> {
    whole.build();
    let mut page = Vec::new();
    if let Some(command) = whole.find_subcommand(name) {
        let titled = Man::new(command.clone()).title(format!("understudy-{name}"));
        titled.render(&mut page)?;
    }
    page.extend_from_slice(b".SH \"EXIT STATUS\"\n");
    for line in EXIT_STATUS.lines() {
        page.extend_from_slice(format!("{}\n.br\n", line.trim()).as_bytes());
    }
    Ok(page)
}

/// The manual page of the program, with a section for each group of commands.
fn page(groups: &[Group]) -> io::Result<Vec<u8>> {
    let mut page = Vec::new();
    let whole = Man::new(parser(groups));
    whole.render_title(&mut page)?;
    whole.render_name_section(&mut page)?;
    whole.render_synopsis_section(&mut page)?;
    whole.render_description_section(&mut page)?;
    whole.render_options_section(&mut page)?;
    for group in groups {
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
