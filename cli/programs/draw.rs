//! `understudy draw`: pictures of programs.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde_json::json;
use understudy_interchange::{Bodies, Source, Wanted, digraph, draw_typed, listing};
use understudy_ladder::{draw_svg, draw_text};
use understudy_text::Report;
use understudy_typed::Elementary;

use crate::answer::{Answer, Status};
use crate::files;

/// Draw a program as a ladder, as function blocks or as a chart
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy draw examples/press-cell/robot.ladder
  understudy draw examples/press-cell/robot.ladder --output robot.svg
  understudy draw examples/plcopen/pump.xml --output pump.svg
  understudy draw examples/heated-tank/level.st --as fbd --output level.svg

A program with numbers is drawn in its own language: a ladder with its boxes, function blocks as networks, a sequence as a chart. Structured Text and instruction lists are listed; `--as fbd` draws statements as function blocks. As text, a program with numbers is Structured Text.")]
pub(crate) struct Arguments {
    /// Program
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Output format; default: svg where the output file ends in .svg, else text
    #[arg(long = "as", value_enum)]
    form: Option<Form>,
    /// Program to draw, if the file contains several
    #[arg(long, value_name = "NAME")]
    program: Option<String>,
    /// Output file; default: standard output
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Form {
    /// Box-drawing characters; Structured Text for a program with numbers
    Text,
    /// SVG picture
    Svg,
    /// SVG picture with statements as function blocks
    Fbd,
    /// SVG picture of the digraphs: elements are edges, connections are vertices
    Digraph,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Answer> {
    let path = arguments.file.as_path();
    let wanted = Wanted { program: arguments.program.as_deref(), period: None };
    let (source, mut file, _) = files::program(path, wanted)?;
    let ladder = file.rungs.take().map(|rungs| rungs.ladder);
    let is_picture = arguments.output.as_ref().and_then(|path| path.extension());
    let is_picture = is_picture.is_some_and(|ending| ending.eq_ignore_ascii_case("svg"));
    let form = arguments.form.unwrap_or(if is_picture { Form::Svg } else { Form::Text });
    let (text, is_ladder) = match (ladder, form) {
        (Some(program), Form::Text) => (draw_text(&program), true),
        (Some(program), Form::Svg) => (draw_svg(&program), true),
        (Some(program), Form::Digraph) => (digraph::draw_svg(&program), true),
        (None, Form::Digraph) => {
            of_bools(&source)?;
            (digraph::draw_svg(&files::ladder(path)?.0), false)
        }
        (_, form) => match typed(path, &mut file.report, wanted, form) {
            Ok(text) => (text, false),
            Err(answer) => return Err(answer.with_reports(file.reports())),
        },
    };
    let output = arguments.output.as_deref();
    let answer = files::deliver(output, &text, json!({ "text": text }))?;
    let answer = match output {
        Some(_) if is_ladder => answer.and_next(&[&"verify", &path]),
        _ => answer,
    };
    Ok(answer.with_reports(file.reports()))
}

/// A digraph has contacts and coils, so numbers would be as many signals as they have bits.
fn of_bools(source: &Source) -> Result<(), Answer> {
    let Source::Program(program) = source else {
        return Ok(());
    };
    let mut points = program.inputs.iter().chain(&program.outputs);
    let number = points.find(|point| point.slot != 0 && point.of != Elementary::Bool);
    number.map_or(Ok(()), |number| {
        let (name, of, program) = (&number.name, number.declared(), &program.name);
        let message =
            format!("`draw --as digraph` works on rungs, and `{name}` of `{program}` is {of}: use --as fbd or svg");
        Err(Answer::failed(Status::BadInput, "U0438", message))
    })
}

/// A program with numbers, or one that is drawn in another language than that of ladders.
fn typed(
    path: &Path,
    report: &mut Report,
    wanted: Wanted<'_>,
    form: Form,
) -> Result<String, Answer> {
    let name = &report.name;
    let bodies = match form {
        Form::Fbd => Bodies::Blocks,
        _ => Bodies::AsRead,
    };
    let (text, found) = match form {
        Form::Text => listing(name, &report.text, wanted),
        Form::Svg | Form::Fbd | Form::Digraph => draw_typed(name, &report.text, wanted, bodies),
    };
    let Some(text) = text else {
        let message = format!(
            "{} has no statements to be drawn as function blocks: use --as svg",
            path.display()
        );
        return Err(Answer::failed(Status::BadInput, "U0438", message));
    };
    report.diagnostics = found;
    Ok(text)
}
