//! `understudy init`: a small cluster that runs.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;
use understudy_cluster::template;

use crate::answer::Answer;
use crate::files;

/// Write a small cluster that runs, to begin with
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy init cell
  understudy lab cell/cluster.toml --scenario cell/kill.toml")]
pub(crate) struct Arguments {
    /// A folder; files that exist are not overwritten
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

pub(crate) fn run(arguments: &Arguments) -> Answer {
    match files::write_template(&arguments.folder, template()) {
        Err(answer) => answer,
        Ok(paths) => {
            let names: Vec<String> = paths
                .iter()
                .map(|path| path.display().to_string())
                .collect();
            let folder = arguments.folder.display();
            let text = format!(
                "{}\n\nnext:\n  understudy check {folder}/cluster.toml {folder}/kill.toml\n  \
                 understudy lab {folder}/cluster.toml --scenario {folder}/kill.toml\n  \
                 understudy watch {folder}/cluster.toml --allow-commands\n",
                names.join("\n")
            );
            Answer::done(text, json!({ "files": names }))
        }
    }
}
