//! The commands, in groups. The parser, the help, the manual and the completions are made from this table, and it runs the command.

use std::str::FromStr;

use clap::builder::Styles;
use clap::{Arg, ArgAction, ArgMatches, Args, Command};
use understudy_bus::{LogFilter, LogFormat, LogSettings};

use crate::answer::Answer;
use crate::console::Console;
use crate::{deployment, inspect, programs, reliability, run, supervisors, tools};

/// A command line without errors, ready to run.
pub(crate) struct Call {
    pub(crate) json: bool,
    /// Log on standard error.
    pub(crate) log: LogSettings,
    /// Name of the command.
    pub(crate) name: &'static str,
    run: Box<dyn FnOnce(&mut Console) -> Answer>,
}

impl Call {
    pub(crate) fn run(self, console: &mut Console) -> Answer {
        (self.run)(console)
    }
}

/// Commands for one purpose.
pub(crate) struct Group {
    /// One word, such as `inspect`.
    pub(crate) name: &'static str,
    /// Heading in the help and the manual.
    pub(crate) title: &'static str,
    pub(crate) entries: Vec<Entry>,
}

/// One command: its arguments and the function that runs it.
pub(crate) struct Entry {
    pub(crate) name: &'static str,
    parser: Command,
    bind: Bind,
}

/// Reads the arguments of a command.
type Bind = Box<dyn Fn(&ArgMatches) -> Result<Bound, clap::Error>>;

/// A command with its arguments.
type Bound = Box<dyn FnOnce(&mut Console) -> Answer>;

impl Group {
    /// Parsers of the commands of this group.
    pub(crate) fn parsers(&self) -> impl Iterator<Item = Command> {
        self.entries.iter().map(|entry| entry.parser.clone())
    }
}

/// A command with arguments of type `A`, which carry its description and examples. `run` returns an [`Answer`], or a result of two.
pub(crate) fn command<A: Args + 'static, R: Into<Answer>>(
    name: &'static str,
    run: impl Fn(A, &mut Console) -> R + Copy + 'static,
) -> Entry {
    Entry {
        name,
        parser: A::augment_args(Command::new(name)),
        bind: Box::new(move |matches| {
            let arguments = A::from_arg_matches(matches)?;
            Ok(Box::new(move |console| run(arguments, console).into()))
        }),
    }
}

/// Every command, in the order of the help.
pub(crate) fn groups() -> [Group; 7] {
    [
        run::group(),
        inspect::group(),
        programs::group(),
        supervisors::group(),
        reliability::group(),
        deployment::group(),
        tools::group(),
    ]
}

/// Parses the command line of this process, of a program with these commands.
///
/// # Errors
/// Where the arguments are wrong, and where help or the version was asked for.
pub(crate) fn parse(parser: Command, groups: &[Group]) -> Result<Call, clap::Error> {
    let matches = whole_examples(parser).try_get_matches()?;
    let json = matches.get_flag("json");
    let log = LogSettings {
        filter: matches.get_one("log").cloned(),
        format: matches.get_one("log-format").copied(),
    };
    let called = matches.subcommand();
    let found = called.and_then(|(name, matches)| {
        let mut entries = groups.iter().flat_map(|group| &group.entries);
        Some((entries.find(|entry| entry.name == name)?, matches))
    });
    // The parser requires one of the commands.
    let (entry, matches) =
        found.ok_or_else(|| clap::Error::new(clap::error::ErrorKind::MissingSubcommand))?;
    Ok(Call { json, log, name: entry.name, run: (entry.bind)(matches)? })
}

/// The exit statuses of all commands.
pub(crate) const EXIT_STATUS: &str = "  0  success
  1  a run or a check failed
  2  invalid input, nothing was started
  3  inconclusive: the host was too slow
  4  a campaign found runs that fail
";

/// The command line of `understudy`.
pub(crate) fn parser(groups: &[Group]) -> Command {
    let examples = "\
Example:
  understudy demo          run the press cell of the paper on processes of this machine
  understudy init cell     write a small cluster as a starting point

`understudy COMMAND --help` describes a command, `understudy explain CODE` an error.";
    let about = "A redundant array of independent controllers: RAID for PLCs";
    with_commands("understudy", about, examples, groups)
}

/// The command line of `understudy-runtime`.
pub(crate) fn runtime_parser(groups: &[Group]) -> Command {
    let examples = "\
Example:
  understudy-runtime node cluster.toml --name robot --keys keys/robot
  understudy-runtime doctor cluster.toml --name robot --keys keys/robot

`understudy-runtime COMMAND --help` describes a command. The commands are those of `understudy`, which has all others too.";
    let about = "The members of Understudy clusters, for machines that run nothing else";
    with_commands("understudy-runtime", about, examples, groups)
}

fn with_commands(
    name: &'static str,
    about: &'static str,
    examples: &str,
    groups: &[Group],
) -> Command {
    let json = Arg::new("json")
        .long("json")
        .global(true)
        .action(ArgAction::SetTrue)
        .help("Print one JSON document on standard output (docs/reference/json.md)");
    let log = Arg::new("log")
        .long("log")
        .global(true)
        .value_name("FILTER")
        .value_parser(LogFilter::from_str)
        .help("Log on standard error, such as debug or understudy=trace; default: RUST_LOG");
    let log_format = Arg::new("log-format")
        .long("log-format")
        .global(true)
        .value_name("FORMAT")
        .value_parser(LogFormat::from_str)
        .help("Format of the log: text or json");
    let parser = Command::new(name)
        .version(env!("CARGO_PKG_VERSION"))
        .about(about)
        .help_template(template(groups))
        .after_help(format!(
            "\
{examples}

Exit status:
{EXIT_STATUS}
Understudy is not a safety PLC."
        ))
        .subcommand_required(true)
        .arg_required_else_help(true)
        .args([json, log, log_format])
        .subcommands(groups.iter().flat_map(Group::parsers));
    flowing(parser)
}

/// The help of the whole command line, with the commands under the headings of their groups.
fn template(groups: &[Group]) -> String {
    let styles = Styles::styled();
    let (heading, literal) = (styles.get_header(), styles.get_literal());
    let mut template = "{about-with-newline}\n{usage-heading} {usage}\n\n".to_owned();
    for group in groups {
        template.push_str(&format!("{heading}{}:{heading:#}\n", group.title));
        for Entry { name, parser, .. } in &group.entries {
            let about = parser.get_about().map(ToString::to_string);
            let about = about.unwrap_or_default();
            template.push_str(&format!("  {literal}{name:<20}{literal:#}  {about}\n"));
        }
        template.push('\n');
    }
    template + &format!("{heading}Options:{heading:#}\n{{options}}{{after-help}}")
}

/// The command, and all below it, with the text after the options as paragraphs as wide as the terminal.
fn flowing(command: Command) -> Command {
    let command = match command.get_after_help() {
        Some(text) => {
            let text = paragraphs(&text.to_string());
            command.after_help(text)
        }
        None => command,
    };
    command.mut_subcommands(flowing)
}

/// The heading of the examples of a command, which its text after the options begins with.
const EXAMPLES: &str = "Example:\n";

/// The command, and all below it, with examples that keep their lines however narrow the terminal is, so that they can be pasted: text of a template
/// is not wrapped.
fn whole_examples(command: Command) -> Command {
    command.mut_subcommands(|command| {
        let text = command.get_after_help().map(ToString::to_string);
        let text = text.filter(|text| text.starts_with(EXAMPLES));
        let command = match text {
            Some(text) => {
                let (examples, prose) = text.split_once("\n\n").unwrap_or((&text, ""));
                let template = format!(
                    "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{{all-args}}\n\n{examples}{{after-help}}"
                );
                let command = command.help_template(template);
                if prose.is_empty() {
                    command.after_help(None::<&str>)
                } else {
                    command.after_help(prose.to_owned())
                }
            }
            None => command,
        };
        whole_examples(command)
    })
}

/// Joins each line to the one before, except indented lines, such as examples, and the lines next to them.
fn paragraphs(text: &str) -> String {
    let mut joined = String::new();
    let mut flows = false;
    for line in text.lines() {
        let is_prose = !line.is_empty() && !line.starts_with(' ');
        if !joined.is_empty() {
            joined.push(if flows && is_prose { ' ' } else { '\n' });
        }
        joined.push_str(line);
        flows = is_prose;
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prose_flows_and_examples_keep_their_lines() {
        let text =
            "Example:\n  understudy demo\n  understudy init cell\n\nAll is\nwell.\n\nThe end.";
        let expected =
            "Example:\n  understudy demo\n  understudy init cell\n\nAll is well.\n\nThe end.";
        assert_eq!(paragraphs(text), expected);
    }

    /// The words of a command line, as a shell reads them.
    fn words(line: &str) -> Vec<String> {
        let mut words = vec![String::new()];
        let mut is_quoted = false;
        for letter in line.chars() {
            match letter {
                '"' => is_quoted = !is_quoted,
                ' ' if !is_quoted => words.push(String::new()),
                _ => words.last_mut().expect("a word").push(letter),
            }
        }
        words.retain(|word| !word.is_empty());
        words
    }

    fn check_examples(command: &Command, name: &str) -> usize {
        let text = command.get_after_help().map(ToString::to_string).unwrap_or_default();
        let examples =
            text.strip_prefix(EXAMPLES).unwrap_or_else(|| panic!("{name} has no example"));
        let examples = examples.split("\n\n").next().unwrap_or_default();
        assert!(!examples.contains(['{', '\\']), "{name}: {examples}");
        let mut count = 0;
        for line in examples.lines() {
            let line = line.strip_prefix("  ").unwrap_or_else(|| panic!("{name}: {line}"));
            // An explanation follows several blanks; a pipe and a file follow the command.
            let line = line.split("   ").next().unwrap_or_default();
            let line =
                line.split(['|', '>']).next().filter(|_| !line.contains(">=")).unwrap_or(line);
            let line = line.strip_prefix("sudo ").unwrap_or(line);
            let parsed = parser(&groups()).try_get_matches_from(words(line));
            assert!(parsed.is_ok(), "{name}: {line}: {}", parsed.expect_err("wrong"));
            count += 1;
        }
        for below in command.get_subcommands().filter(|below| below.get_name() != "help") {
            count += check_examples(below, &format!("{name} {}", below.get_name()));
        }
        count
    }

    #[test]
    fn every_command_has_examples_that_it_understands() {
        let whole = parser(&groups());
        let mut count = 0;
        for command in whole.get_subcommands() {
            count += check_examples(command, command.get_name());
        }
        assert!(count > 120, "{count}");
    }

    #[test]
    fn examples_keep_their_lines_in_a_narrow_terminal() {
        for command in whole_examples(parser(&groups())).get_subcommands_mut() {
            let examples = |text: &str| -> Vec<String> {
                let lines = text.lines().filter(|line| line.starts_with("  understudy "));
                lines.map(str::to_owned).collect()
            };
            let wide = examples(&command.clone().term_width(400).render_long_help().to_string());
            let narrow = examples(&command.clone().term_width(40).render_long_help().to_string());
            assert!(!wide.is_empty(), "{}", command.get_name());
            assert_eq!(wide, narrow);
        }
    }

    #[test]
    fn the_table_is_a_valid_command_line() {
        parser(&groups()).debug_assert();
    }
    #[test]
    fn every_summary_fits_on_one_line() {
        for entry in groups().iter().flat_map(|group| &group.entries) {
            let about = entry.parser.get_about().map(ToString::to_string);
            let length = about.map_or(0, |about| about.chars().count());
            assert!((10..=70).contains(&length), "{}: {length} characters", entry.name);
        }
    }
}
