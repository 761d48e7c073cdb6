//! `understudy draw`: diagrams of ladder programs.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde_json::json;
use understudy_interchange::{digraph, parse_program};
use understudy_ladder::{draw_svg, draw_text};
use understudy_text::Report;

use crate::answer::Answer;
use crate::files;
use crate::kind::Kind;

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

pub(crate) fn run(arguments: &Arguments) -> Answer {
    let source = match files::text_of(Kind::Ladder, &arguments.ladder) {
        Ok(source) => source,
        Err(answer) => return answer,
    };
    let parsed = parse_program(&arguments.ladder.display().to_string(), &source);
    let report = Report {
        name: arguments.ladder.display().to_string(),
        text: source,
        diagnostics: parsed.diagnostics,
    };
    if report.has_errors() {
        return Answer::bad_files(vec![report]);
    }
    let text = match arguments.form {
        Form::Text => draw_text(&parsed.program),
        Form::Svg => draw_svg(&parsed.program),
        Form::Digraph => digraph::draw_svg(&parsed.program),
    };
    let answer = match &arguments.output {
        None => {
            let result = json!({ "text": text });
            Answer::done(text, result)
        }
        Some(path) => match files::write(path, &text) {
            Ok(()) => {
                let name = path.display().to_string();
                Answer::done(format!("written to {name}"), json!({ "file": name }))
                    .and_next(&[&"verify", &arguments.ladder])
            }
            Err(answer) => answer,
        },
    };
    answer.with_reports(vec![report])
}
