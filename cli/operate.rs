//! `understudy operate`: what an operator asks of a member: of one in a laboratory by the socket of its run, of one elsewhere by mutual TLS.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use clap::{Args, ValueEnum};
use serde_json::json;
use understudy_bus::{Call, Request};
use understudy_cluster::Overrides;
use understudy_journal::{Command, OperatorAction, Refusal};
use understudy_keys::{Date, OperatorKeys};
use understudy_member::tls_keys;
use understudy_view::{Run, find_running_of};
use understudy_wire::{Cycle, StateChoice};

use crate::answer::{Answer, Status};
use crate::files;

/// Command a member of a laboratory, or ask something of a member on another machine
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy operate runs/latest --name robot kill
  understudy operate runs/latest --name robot restart
  understudy operate cell/cluster.toml --keys keys/members/operator --name robot-io status
  understudy operate cell/cluster.toml --keys keys/members/operator --name robot-io release
  understudy operate cell/cluster.toml --keys keys/members/operator --name robot-io accept-state --cycle 4711
  understudy operate cell/cluster.toml --keys keys/members/operator --name robot journal --lines 100

Without --keys the member is one of a laboratory that runs on this machine: in the directory of a run, or of the cluster below --out.")]
pub(crate) struct Arguments {
    /// The cluster file, or the directory of a run that is being written
    #[arg(value_name = "CLUSTER.toml|RUN")]
    target: PathBuf,
    /// The folder of the operator's keys, for a member on another machine
    #[arg(long, value_name = "DIR")]
    keys: Option<PathBuf>,
    /// Which member of the cluster, by its name
    #[arg(long, value_name = "NAME")]
    name: String,
    /// What is asked of it
    #[arg(value_enum)]
    what: What,
    /// For accept-state: the cycle of the state, as the event `state-lost` names it; another newest state is refused
    #[arg(long, value_name = "CYCLE", required_if_eq("what", "accept-state"))]
    cycle: Option<u64>,
    /// Lines of the journal, then it ends
    #[arg(long, value_name = "N", default_value_t = u64::MAX, hide_default_value = true)]
    lines: u64,
    /// Why, for the journal of the laboratory
    #[arg(long, value_name = "TEXT", default_value = "from the command line")]
    reason: String,
    /// Where laboratories keep their runs
    #[arg(long, value_name = "DIR", default_value = "runs")]
    out: PathBuf,
}

impl Arguments {
    /// Of `cold-start` or `accept-state`.
    fn choice(&self) -> StateChoice {
        match self.what {
            What::AcceptState => StateChoice::Newest {
                cycle: self.cycle.map(Cycle),
            },
            _ => StateChoice::Cold,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum What {
    /// What it said when it was ready
    Status,
    /// The canonical text of its configuration
    Configuration,
    /// Release the outputs of a program that was started cold
    Release,
    /// Start a program whose state is lost from its initial state
    ColdStart,
    /// Continue a program whose state is lost from the newest available state, which is from the cycle --cycle
    AcceptState,
    /// End
    Stop,
    /// Each line of its journal from now on
    Journal,
    /// End its process as `kill -9` does; in a laboratory
    Kill,
    /// Start its process again; in a laboratory
    Restart,
}

/// A member says something in every cycle.
const SILENCE: Duration = Duration::from_secs(60);

pub(crate) fn run(arguments: &Arguments) -> Answer {
    let answer = match &arguments.keys {
        Some(keys) => elsewhere(arguments, keys),
        None => in_laboratory(arguments),
    };
    match answer {
        Ok(answer) | Err(answer) => answer,
    }
}

/// The laboratory that writes a run is told.
fn in_laboratory(arguments: &Arguments) -> Result<Answer, Answer> {
    let word = arguments.what.to_possible_value();
    let word = word.as_ref().map_or("", |value| value.get_name());
    let command = match arguments.what {
        What::Kill => Command::Kill,
        What::Restart => Command::Restart,
        What::Release => Command::Release,
        What::ColdStart | What::AcceptState => Command::Choose {
            choice: arguments.choice(),
        },
        What::Status | What::Configuration | What::Stop | What::Journal => {
            let message = format!(
                "`{word}` is for a member on another machine: name the folder of the operator's keys with --keys; a laboratory takes kill, restart, release, cold-start and accept-state"
            );
            return Err(Answer::failed(Status::BadInput, "U0621", message));
        }
    };
    let run = written(arguments)?;
    let action = OperatorAction::Command {
        member: crate::member::find(run.cluster(), &arguments.name)?,
        command,
        owner: crate::top::owner(),
        reason: arguments.reason.clone(),
    };
    let done = run.commander().act_and_wait(&action);
    done.map_err(|refusal| refused(&refusal))?;
    let text = format!("{word} {}: done", arguments.name);
    let result = json!({ "run": run.path(), "name": arguments.name, "done": word });
    Ok(Answer::done(text, result).and_next(&[&"top", &run.path()]))
}

/// The run that is meant: a directory of it, or the newest of a cluster that is being written.
fn written(arguments: &Arguments) -> Result<Run, Answer> {
    let target = &arguments.target;
    if target.is_dir() {
        return Run::open(target)
            .map_err(|error| Answer::failed(Status::BadInput, error.code(), error.to_string()));
    }
    let (cluster, _) = files::cluster(target, Overrides::default())?;
    find_running_of(&arguments.out, &cluster).ok_or_else(|| {
        let message = format!(
            "no laboratory of `{}` runs below {}; members on other machines are called with the keys of an operator (--keys DIR)",
            cluster.name(),
            arguments.out.display()
        );
        Answer::failed(Status::BadInput, "U0614", message)
    })
}

fn refused(refusal: &Refusal) -> Answer {
    let message = refusal.to_string();
    // Its words begin with their code, also those that another process said.
    let code = message.split(':').next().unwrap_or_default().to_owned();
    Answer::failed(Status::Failed, &code, message)
}

/// A member on another machine is called.
fn elsewhere(arguments: &Arguments, keys: &Path) -> Result<Answer, Answer> {
    let (cluster, _) = files::cluster(&arguments.target, Overrides::default())?;
    let keys = OperatorKeys::load(keys, &cluster, Date::of(SystemTime::now()));
    let keys = keys.map_err(|errors| crate::keys::failed(&errors))?;
    let member = crate::member::find(&cluster, &arguments.name)?;
    let request = match arguments.what {
        What::Status => Some(Request::Status),
        What::Configuration => Some(Request::Configuration),
        What::Release => Some(Request::Release),
        What::ColdStart | What::AcceptState => Some(Request::Choose(arguments.choice())),
        What::Stop => Some(Request::Stop),
        What::Journal => None,
        What::Kill | What::Restart => {
            return Err(refused(&Refusal::Elsewhere {
                name: arguments.name.clone(),
                reason: "its process runs on another machine: end it or start it there".to_owned(),
            }));
        }
    };
    let address = cluster.address(member).ok_or_else(|| {
        let message = format!("no address for {}", arguments.name);
        Answer::failed(Status::BadInput, "U0608", message)
    })?;
    let failed = |error: understudy_bus::BusError| {
        Answer::failed(Status::Failed, error.code(), error.to_string())
    };
    let hash = cluster.agreement().cluster;
    let call = Call::to(address, hash, &arguments.name, &tls_keys(&keys.tls)).map_err(failed)?;
    let Some(request) = request else {
        let mut left = arguments.lines;
        let take = |line: &str| {
            left = left.saturating_sub(1);
            // A reader that is gone wants no more.
            writeln!(std::io::stdout(), "{line}").is_ok() && left > 0
        };
        call.follow(SILENCE, take).map_err(failed)?;
        return Ok(Answer::done("", json!(null)));
    };
    let text = call.ask(&request).map_err(failed)?;
    let result = serde_json::from_str(&text).unwrap_or_else(|_| json!({ "text": text }));
    Ok(Answer::done(text, result))
}
