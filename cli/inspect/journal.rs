//! `understudy journal`: the events of a run as text.

use std::io::Write as _;
use std::time::Duration;

use clap::Args;
use serde_json::json;
use understudy_text::{MAXIMUM_SHOWN, visible, visible_json};
use understudy_view::{Filter, JournalLine, JournalText, Listing, Run, Source, Trouble};

use crate::answer::{Answer, Status};
use crate::inspect::view::{RunArgument, ZoneArgument, several};

/// Print or follow the journal of a run
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy journal
  understudy journal runs/latest --member robot --member robot-io --from 195 --to 230
  understudy journal --follow --event flagged --event source --event value-fault

Without filters all records are shown except the periodic ones of every cycle. Cycles are counted from the origin of the run, as in its
report. With --follow and --json each line is a JSON object.")]
pub(crate) struct Arguments {
    #[command(flatten)]
    run: RunArgument,
    /// Print new records until the run ends
    #[arg(long)]
    follow: bool,
    /// Show only records of this member; repeatable
    #[arg(long, value_name = "NAME")]
    member: Vec<String>,
    /// Show only this kind of record, such as flagged; repeatable
    #[arg(long, value_name = "EVENT")]
    event: Vec<String>,
    /// Show only this controller, its remote I/O and its plant; repeatable
    #[arg(long, value_name = "CONTROLLER")]
    program: Vec<String>,
    /// First cycle
    #[arg(long, value_name = "CYCLE", allow_hyphen_values = true)]
    from: Option<i64>,
    /// Last cycle
    #[arg(long, value_name = "CYCLE", allow_hyphen_values = true)]
    to: Option<i64>,
    /// Include the periodic records of every cycle
    #[arg(long)]
    all: bool,
    #[command(flatten)]
    zone: ZoneArgument,
}

/// Polling interval of a growing journal.
const LOOK: Duration = Duration::from_millis(100);

pub(crate) fn run(arguments: &Arguments, json: bool) -> Result<Answer, Answer> {
    if let (Some(from), Some(to)) = (arguments.from, arguments.to)
        && from > to
    {
        let message = format!("--from {from} is after --to {to}: no cycle is between them");
        return Err(Answer::failed(Status::BadInput, "U0600", message));
    }
    let run = arguments.run.open()?;
    let filter = Filter {
        members: arguments.member.clone(),
        events: arguments.event.clone(),
        programs: arguments.program.clone(),
        from: arguments.from,
        to: arguments.to,
        ordinary: arguments.all,
    };
    let (listing, source) = run.listing(filter).map_err(|errors| several(&errors))?;
    if arguments.follow {
        let shown = JournalText::new(arguments.zone.zone());
        return Ok(followed(&run, listing, source, shown, json));
    }
    let mut lines = Vec::new();
    let (mut troubles, mut more) = (Vec::new(), 0_usize);
    for trouble in read(listing, source, &mut |line| lines.push(line)) {
        if troubles.len() < MAXIMUM_SHOWN {
            troubles.push(trouble.to_string());
        } else {
            more += 1;
        }
    }
    if more > 0 {
        troubles.push(format!("{more} more unreadable lines of the journal"));
    }
    let mut shown = JournalText::new(arguments.zone.zone());
    let mut text: String = lines.iter().map(|line| shown.text(line) + "\n").collect();
    if lines.is_empty() {
        text += match arguments.all {
            true => "No records.\n",
            false => {
                "No records but those of every cycle, if there are any; show them with --all.\n"
            }
        };
    }
    for trouble in &troubles {
        text += &format!("       -  {trouble}\n");
    }
    Ok(Answer::done(text, json!({ "lines": lines, "troubles": troubles })))
}

/// The present records, and the errors between them.
fn read(
    mut listing: Listing,
    mut source: Source,
    take: &mut dyn FnMut(JournalLine),
) -> Vec<Trouble> {
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

/// Prints each new line until the run ends or the reader closes the pipe.
fn followed(
    run: &Run,
    mut listing: Listing,
    mut source: Source,
    mut shown: JournalText,
    json: bool,
) -> Answer {
    let mut output = std::io::stdout();
    let mut reader_is_there = true;
    loop {
        let over = run.is_finished();
        let taken = source.poll(&mut |found| {
            let mut text = |line: &JournalLine| {
                if json {
                    serde_json::to_string(line).unwrap_or_default()
                } else {
                    shown.text(line)
                }
            };
            let lines = match found {
                Ok(record) => listing.take(&record).iter().map(&mut text).collect(),
                Err(trouble) if json => vec![json!({ "trouble": trouble.to_string() }).to_string()],
                Err(trouble) => vec![format!("       -  {trouble}")],
            };
            for line in lines {
                let line = if json { visible_json(&line) } else { visible(&line) };
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
