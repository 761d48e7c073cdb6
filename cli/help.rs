//! Help as wide as the terminal: what follows the options is written in lines of the source, and flows as paragraphs.

use clap::Command;

/// The command, and all below it, with paragraphs in place of lines.
pub(crate) fn flowing(command: Command) -> Command {
    let command = match command.get_after_help() {
        Some(text) => {
            let text = paragraphs(&text.to_string());
            command.after_help(text)
        }
        None => command,
    };
    command.mut_subcommands(flowing)
}

/// Joins each line to the one before, but for those that are indented, as examples are, and those around them.
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
    use super::paragraphs;

    #[test]
    fn prose_flows_and_examples_stand() {
        let text =
            "Example:\n  understudy demo\n  understudy init cell\n\nAll is\nwell.\n\nThe end.";
        let expected =
            "Example:\n  understudy demo\n  understudy init cell\n\nAll is well.\n\nThe end.";
        assert_eq!(paragraphs(text), expected);
    }
}
