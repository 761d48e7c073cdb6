//! `understudy operate`: what an operator asks of a party that runs, by mutual TLS.

use std::io::Write as _;
use std::path::PathBuf;
use std::time::{Duration, SystemTime};

use clap::{Args, ValueEnum};
use serde_json::json;
use understudy_bus::{Call, Request, TlsKeys};
use understudy_cluster::Overrides;
use understudy_keys::{Date, OperatorKeys, TlsFiles};
use understudy_wire::{Cycle, StateChoice};

use crate::answer::{Answer, Status};
use crate::files;

/// Ask something of a party that runs on another machine, or command it
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy operate cell/cluster.toml --keys keys/parties/operator --name robot-io status
  understudy operate cell/cluster.toml --keys keys/parties/operator --name robot-io release
  understudy operate cell/cluster.toml --keys keys/parties/operator --name robot-io accept-state --cycle 4711
  understudy operate cell/cluster.toml --keys keys/parties/operator --name robot journal --lines 100")]
pub(crate) struct Arguments {
    /// The cluster file
    #[arg(value_name = "CLUSTER.toml")]
    cluster: PathBuf,
    /// The folder of the operator's keys
    #[arg(long, value_name = "DIR")]
    keys: PathBuf,
    /// Which party of the cluster, by its name
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
}

/// A party says something in every cycle.
const SILENCE: Duration = Duration::from_secs(60);

pub(crate) fn run(arguments: &Arguments) -> Answer {
    match asked(arguments) {
        Ok(answer) | Err(answer) => answer,
    }
}

fn asked(arguments: &Arguments) -> Result<Answer, Answer> {
    let (cluster, _) = files::cluster(&arguments.cluster, Overrides::default())?;
    let keys = OperatorKeys::load(&arguments.keys, &cluster, Date::of(SystemTime::now()));
    let keys = keys.map_err(|errors| crate::keys::failed(&errors))?;
    let party = crate::party::find(&cluster, &arguments.name)?;
    let address = cluster.address(party).ok_or_else(|| {
        let message = format!("no address for {}", arguments.name);
        Answer::failed(Status::BadInput, "U0608", message)
    })?;
    let failed = |error: understudy_bus::BusError| {
        Answer::failed(Status::Failed, error.code(), error.to_string())
    };
    let hash = cluster.agreement().cluster;
    let call = Call::to(address, hash, &arguments.name, &tls_keys(&keys.tls)).map_err(failed)?;
    let request = match arguments.what {
        What::Status => Request::Status,
        What::Configuration => Request::Configuration,
        What::Release => Request::Release,
        What::ColdStart => Request::Choose(StateChoice::Cold),
        What::AcceptState => Request::Choose(StateChoice::Newest {
            cycle: arguments.cycle.map(Cycle),
        }),
        What::Stop => Request::Stop,
        What::Journal => {
            let mut left = arguments.lines;
            let take = |line: &str| {
                left = left.saturating_sub(1);
                // A reader that is gone wants no more.
                writeln!(std::io::stdout(), "{line}").is_ok() && left > 0
            };
            call.follow(SILENCE, take).map_err(failed)?;
            return Ok(Answer::done("", json!(null)));
        }
    };
    let text = call.ask(&request).map_err(failed)?;
    let result = serde_json::from_str(&text).unwrap_or_else(|_| json!({ "text": text }));
    Ok(Answer::done(text, result))
}

/// Where the files lie, for the link.
pub(crate) fn tls_keys(tls: &TlsFiles) -> TlsKeys {
    TlsKeys {
        authority: tls.authority.clone(),
        certificate: tls.certificate.clone(),
        private_key: tls.private_key.clone(),
    }
}
