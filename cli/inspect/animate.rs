//! `understudy animate`: an animated picture of a part of a run.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;
use understudy_view::{Bounds, Scene};

use crate::answer::Answer;
use crate::files;
use crate::inspect::view::RunArgument;

/// Draw part of a run as an animated SVG picture
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy animate
  understudy animate runs/latest --output kill.svg
  understudy animate runs/latest --program press --from 120 --to 260 --output press.svg

Without a range of cycles the picture shows the first kill of a controller, until its outputs are direct again. Browsers and GitHub play
the animation.")]
pub(crate) struct Arguments {
    #[command(flatten)]
    run: RunArgument,
    /// Controller whose outputs are shown
    #[arg(long, value_name = "CONTROLLER")]
    program: Option<String>,
    /// First cycle
    #[arg(long, value_name = "CYCLE", allow_hyphen_values = true)]
    from: Option<i64>,
    /// Last cycle
    #[arg(long, value_name = "CYCLE", allow_hyphen_values = true)]
    to: Option<i64>,
    /// Output file
    #[arg(long, short, value_name = "FILE", default_value = "animation.svg")]
    output: PathBuf,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Answer> {
    let scene =
        Scene { program: arguments.program.as_deref(), from: arguments.from, to: arguments.to };
    let until = arguments.to.unwrap_or(i64::MAX);
    let run = arguments.run.open()?;
    let model = match arguments.from {
        Some(from) => run.read_between(Bounds::default(), from, until)?,
        None => run.read_until(Bounds::default(), until)?,
    };
    let film = model.film(scene)?;
    files::write(&arguments.output, &film.to_svg())?;
    let file = arguments.output.display().to_string();
    let (from, to) = film.cycles();
    let program = film.program();
    let text = format!("{file}: outputs of {program}, cycles {from} to {to}");
    let result = json!({ "file": file, "program": program, "from": from, "to": to });
    Ok(Answer::done(text, result))
}
