//! `understudy animate`: a part of a run as a moving picture.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;
use understudy_view::{Bounds, Run, Scene};

use crate::answer::Answer;
use crate::files;
use crate::inspect::view::{RUN, refused};

/// Draw a part of a run as a moving picture (SVG): outputs, their source and the stations
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy animate
  understudy animate runs/latest --output kill.svg
  understudy animate runs/latest --program press --from 390 --to 560 --output press.svg

Without cycles it shows the first kill of a controller, until its outputs are direct again. The picture is drawn from the journal of the
run; browsers and GitHub play it.")]
pub(crate) struct Arguments {
    /// The directory of a run
    #[arg(value_name = "RUN", default_value = RUN)]
    run: PathBuf,
    /// The controller whose outputs are shown
    #[arg(long, value_name = "CONTROLLER")]
    program: Option<String>,
    /// The first cycle
    #[arg(long, value_name = "CYCLE", allow_hyphen_values = true)]
    from: Option<i64>,
    /// The last cycle
    #[arg(long, value_name = "CYCLE", allow_hyphen_values = true)]
    to: Option<i64>,
    /// The file to write
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
