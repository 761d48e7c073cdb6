//! `understudy draw`: diagrams of ladder programs.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde_json::json;
use understudy_interchange::digraph;
use understudy_ladder::{draw_svg, draw_text};

use crate::answer::Answer;
use crate::files;

/// Draw a ladder diagram as text or SVG
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy draw examples/press-cell/robot.ladder
  understudy draw robot.ladder --as svg --output robot.svg
  understudy draw robot.ladder --as digraph --output robot.svg")]
pub(crate) struct Arguments {
    /// Ladder program
    #[arg(value_name = "FILE.ladder")]
    ladder: PathBuf,
    /// Output format
    #[arg(long = "as", value_enum, default_value = "text")]
    form: Form,
    /// Output file; default: standard output
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Form {
    /// Box-drawing characters
    Text,
    /// SVG picture
    Svg,
    /// SVG picture of the digraphs: elements are edges, connections are vertices
    Digraph,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Answer> {
    let (program, report) = files::ladder(&arguments.ladder)?;
    let text = match arguments.form {
        Form::Text => draw_text(&program),
        Form::Svg => draw_svg(&program),
        Form::Digraph => digraph::draw_svg(&program),
    };
    let output = arguments.output.as_deref();
    let answer = files::deliver(output, &text, json!({ "text": text }))?;
    let answer = match output {
        Some(_) => answer.and_next(&[&"verify", &arguments.ladder]),
        None => answer,
    };
    Ok(answer.with_reports(vec![report]))
}
