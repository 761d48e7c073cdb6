//! `understudy init`: a new cluster from a template or from existing programs.

pub(super) mod from;

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde_json::json;
use understudy_cluster::{TemplateFile, minimal, modbus_cell, template};

use crate::answer::Answer;
use crate::files;

/// Write a new cluster from a template or from existing programs
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy init cell
  understudy init level --template modbus
  understudy init line --from examples/plcopen/pump.xml examples/press-cell/press.ladder
  understudy init sites --from north=examples/plcopen/pump.xml south=examples/plcopen/pump.xml
  understudy init belt --from examples/other-tools/conveyor --output jams

--from takes every program that `understudy check` finds right: files, projects of TwinCAT (.plcproj) and folders. Files that use what another one
declares are one project. Each program gets a controller, a remote I/O and a placeholder for its plant; a file with several programs gives one
controller per program, unless they share variables. NAME= sets the name of the controller. --output makes a variable an output in the copy
of the program.")]
pub(crate) struct Arguments {
    /// Folder to create; existing files are not overwritten
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Template
    #[arg(long, value_enum, default_value_t)]
    template: Template,
    /// Existing programs, instead of a template
    #[arg(long, value_name = "[NAME=]FILE", num_args = 1.., conflicts_with = "template")]
    from: Vec<PathBuf>,
    /// Variables of the programs that are meant as outputs and declared as memory
    #[arg(long, value_name = "[PROGRAM.]NAME", num_args = 1.., requires = "from")]
    output: Vec<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
enum Template {
    /// One program and one understudy
    Minimal,
    /// A filling tank and a conveyor with simulated plants
    #[default]
    Cell,
    /// A tank with a Modbus TCP device and a script that simulates it, and a simulated press
    Modbus,
}

impl Template {
    fn files(self) -> &'static [TemplateFile] {
        match self {
            Self::Minimal => minimal(),
            Self::Cell => template(),
            Self::Modbus => modbus_cell(),
        }
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Answer> {
    let folder = &arguments.folder;
    if !arguments.from.is_empty() {
        return from::run(folder, &arguments.from, &arguments.output);
    }
    let paths = files::write_template(folder, arguments.template.files())?;
    let answer = written(folder, &paths, "");
    Ok(match arguments.template {
        Template::Modbus => with_device(answer, &folder.join("device.py")),
        Template::Minimal | Template::Cell => answer,
    })
}

/// Answer that lists the files and the next steps.
fn written(folder: &Path, paths: &[PathBuf], more: &str) -> Answer {
    let names = paths.iter().map(|path| path.display().to_string());
    let names: Vec<String> = names.collect();
    let text = format!("{}\n{more}", names.join("\n"));
    let (cluster, scenario) = (folder.join("cluster.toml"), folder.join("kill.toml"));
    Answer::done(text, json!({ "files": names }))
        .and_next(&[&"check", &cluster, &scenario])
        .and_next(&[&"lab", &cluster, &"--scenario", &scenario])
}

/// Adds the instructions to start the simulated device.
fn with_device(mut answer: Answer, device: &Path) -> Answer {
    answer.text.push_str(&format!(
        "\nStart the simulated device in a terminal of its own before the laboratory:\n  pip install pymodbus==3.16.1\n  python3 {}\n",
        device.display()
    ));
    answer
}
