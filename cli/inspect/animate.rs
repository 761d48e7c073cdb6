//! `understudy animate`: an animated picture of a part of a run.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;
use understudy_view::{Bounds, Run, Scene};

use crate::answer::Answer;
use crate::files;
use crate::inspect::view::{RUN, refused};

/// Draw part of a run as an animated SVG picture
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy animate
  understudy animate runs/latest --output kill.svg
  understudy animate runs/latest --program press --from 390 --to 560 --output press.svg

Without a range of cycles the picture shows the first kill of a controller, until its outputs are direct again. Browsers and GitHub play
the animation.")]
pub(crate) struct Arguments {
    /// Directory of a run
    #[arg(value_name = "RUN", default_value = RUN)]
    run: PathBuf,
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

pub(crate) fn run(arguments: &Arguments) -> Answer {
    let scene = Scene {
        program: arguments.program.as_deref(),
        from: arguments.from,
        to: arguments.to,
    };
    let film = Run::open(&arguments.run).and_then(|run| {
        let until = arguments.to.unwrap_or(i64::MAX);
        run.read_until(Bounds::default(), until)?.film(scene)
    });
    let film = match film {
        Ok(film) => film,
        Err(error) => return refused(&error),
    };
    if let Err(answer) = files::write(&arguments.output, &film.to_svg()) {
        return answer;
    }
    let file = arguments.output.display().to_string();
    let (from, to) = film.cycles();
    let program = film.program();
    Answer::done(
        format!("{file}: outputs of {program}, cycles {from} to {to}"),
        json!({ "file": file, "program": program, "from": from, "to": to }),
    )
}
