//! `understudy journal`: what happened in a run, in words.

use std::io::Write as _;
use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use serde_json::json;
use understudy_diagnostic::MAXIMUM_SHOWN;
use understudy_view::{Filter, JournalLine, Listing, Run, Trouble};

use crate::answer::{Answer, Status};
use crate::inspect::view::{RUN, refused, several};

/// Show the journal of a run in words, or follow it
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy journal
  understudy journal runs/latest --member robot --member robot-io --from 195 --to 230
  understudy journal --follow --event flagged --event source --event value-fault

Without filters everything is shown but what every member says in every cycle. Cycles are counted from the origin of the run, as its
report counts them. With --follow and --json each line is a JSON object.")]
pub(crate) struct Arguments {
    /// The directory of a run
    #[arg(value_name = "RUN", default_value = RUN)]
    run: PathBuf,
    /// Go on with what is written, until the run is over
    #[arg(long)]
    follow: bool,
    /// Only what this member says; may be given again
    #[arg(long, value_name = "NAME")]
    member: Vec<String>,
    /// Only this kind of record, such as flagged; may be given again
    #[arg(long, value_name = "EVENT")]
    event: Vec<String>,
    /// Only the controller of this name, its remote I/O and its plant; may be given again
    #[arg(long, value_name = "CONTROLLER")]
    program: Vec<String>,
    /// The first cycle
    #[arg(long, value_name = "CYCLE", allow_hyphen_values = true)]
    from: Option<i64>,
    /// The last cycle
    #[arg(long, value_name = "CYCLE", allow_hyphen_values = true)]
    to: Option<i64>,
    /// Also what every member says in every cycle
    #[arg(long)]
    all: bool,
}

/// How often a journal that grows is looked at.
const LOOK: Duration = Duration::from_millis(100);

pub(crate) fn run(arguments: &Arguments, json: bool) -> Answer {
    answered(arguments, json).unwrap_or_else(|answer| answer)
}

fn answered(arguments: &Arguments, json: bool) -> Result<Answer, Answer> {
    let run = Run::open(&arguments.run).map_err(|error| refused(&error))?;
    let filter = Filter {
        members: arguments.member.clone(),
        events: arguments.event.clone(),
        programs: arguments.program.clone(),
        from: arguments.from,
        to: arguments.to,
        ordinary: arguments.all,
    };
    let listing = run.listing(filter).map_err(|errors| several(&errors))?;
    if arguments.follow {
        return Ok(followed(&run, listing, json));
    }
    let mut lines = Vec::new();
    let (mut troubles, mut more) = (Vec::new(), 0_usize);
    for trouble in read(&run, listing, &mut |line| lines.push(line)) {
        if troubles.len() < MAXIMUM_SHOWN {
            troubles.push(trouble.to_string());
        } else {
            more += 1;
        }
    }
    if more > 0 {
        troubles.push(format!("{more} more lines of the journal cannot be read"));
    }
    let mut text: String = lines.iter().map(|line| line.to_text() + "\n").collect();
    if lines.is_empty() {
        text += "Nothing else happened there than what every member says in every cycle, which --all shows.\n";
    }
    for trouble in &troubles {
        text += &format!("       -  {trouble}\n");
    }
    Ok(Answer::done(
        text,
        json!({ "lines": lines, "troubles": troubles }),
    ))
}

/// What there is; answers with what stood between.
fn read(run: &Run, mut listing: Listing, take: &mut dyn FnMut(JournalLine)) -> Vec<Trouble> {
    let mut source = run.follow();
    let mut troubles = Vec::new();
    loop {
        let taken = source.poll(&mut |found| match found {
            Ok(record) => listing.take(&record).into_iter().for_each(&mut *take),
            Err(trouble) => troubles.push(trouble),
        });
        if taken == 0 || listing.is_past() {
            troubles.extend(source.failure());
            return troubles;
        }
    }
}

/// Prints each line as it comes, until the run is over or nobody reads any more.
fn followed(run: &Run, mut listing: Listing, json: bool) -> Answer {
    let mut source = run.follow();
    let mut output = std::io::stdout();
    let mut reader_is_there = true;
    loop {
        let over = run.is_finished();
        let taken = source.poll(&mut |found| {
            let line = match found {
                Ok(record) => listing.take(&record).map(|line| {
                    if json {
                        serde_json::to_string(&line).unwrap_or_default()
                    } else {
                        line.to_text()
                    }
                }),
                Err(trouble) if json => Some(json!({ "trouble": trouble.to_string() }).to_string()),
                Err(trouble) => Some(format!("       -  {trouble}")),
            };
            if let Some(line) = line {
                reader_is_there &= writeln!(output, "{line}").is_ok();
            }
        });
        if !reader_is_there || listing.is_past() || (over && taken == 0) {
            return Answer::done("", json!(null)).with_status(Status::Done);
        }
        if taken == 0 {
            std::thread::sleep(LOOK);
        }
    }
}
