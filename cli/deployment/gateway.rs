//! `understudy gateway`: interfaces of a run for other systems.

use std::fmt::Write as _;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::SystemTime;

use clap::{Args, Subcommand};
use serde_json::json;
use understudy_bus::interruption;
use understudy_cluster::Overrides;
use understudy_gateway::{
    Followed, GatewayError, Notified, PlantMetrics, Rate, RegisterMap, Run, WriteGate,
    forward_signals, mirror, notify, serve_metrics, serve_modbus,
};
use understudy_keys::{Date, OperatorKeys};
use understudy_member::tls_keys;
use understudy_view::FollowedPlant;

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::files;
use crate::inspect::plant;
use crate::overrides::parse_address;
use crate::plants;

/// Publish a run by Prometheus, Modbus or Zenoh, and pass its alarms on
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy gateway metrics runs/latest --listen 127.0.0.1:9464
  understudy gateway metrics plant.toml
  understudy gateway modbus runs/latest --listen 127.0.0.1:1502
  understudy gateway modbus runs/latest --allow-writes
  understudy gateway registers runs/latest
  understudy gateway notify runs/latest
  understudy gateway zenoh runs/latest --listen 127.0.0.1:7447 --mirror 5/s
  understudy gateway signals runs/latest --from 192.168.20.1:7447

The gateway reads the journal of a run, live or finished, and ends with SIGINT or SIGTERM. Connections are neither encrypted nor
authenticated: bind the gateway to loopback or to a separate network (docs/how-to/monitoring.md). With --allow-writes every
client that reaches the gateway has the role of an operator (docs/how-to/operator-inputs.md).")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Prometheus metrics at http://ADDRESS/metrics
    #[command(
        after_help = "Example:\n  understudy gateway metrics runs/latest --once\n  understudy gateway metrics runs/latest --listen 127.0.0.1:9464\n  understudy gateway metrics plant.toml\n\nFor a plant file: the remaining redundancy of each group and where each spare is, from the runs that are recorded below --out."
    )]
    Metrics {
        /// Directory of a run, or plant file
        #[arg(value_name = "RUN|PLANT.toml", default_value = "runs/latest")]
        run: PathBuf,
        /// Directory of the runs of a plant's groups
        #[arg(long, value_name = "DIR", default_value = "runs")]
        out: PathBuf,
        /// Listening address; port 0 selects a free port
        #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:9464", value_parser = parse_address)]
        listen: SocketAddr,
        /// Print the current metrics and exit
        #[arg(long)]
        once: bool,
    },
    /// Process image as a Modbus TCP server
    #[command(
        after_help = "Example:\n  understudy gateway modbus runs/latest --listen 127.0.0.1:1502\n  understudy gateway modbus runs/latest --allow-writes"
    )]
    Modbus {
        #[command(flatten)]
        run: RunArgument,
        /// Listening address; port 0 selects a free port
        #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:1502", value_parser = parse_address)]
        listen: SocketAddr,
        /// Let clients write operator inputs, with the role of an operator
        #[arg(long)]
        allow_writes: bool,
    },
    /// Run the command of [notify] for each alarm
    #[command(after_help = "\
Example:
  understudy gateway notify runs/latest

Runs the command of the cluster file when an alarm is raised, acknowledged or over, until the run has ended. Start it only
for a cluster file that you trust: the command has the rights of this process (docs/how-to/alarms.md).")]
    Notify {
        #[command(flatten)]
        run: RunArgument,
    },
    /// Print the register map of the Modbus TCP server, or the list of tags
    #[command(
        after_help = "Example:\n  understudy gateway registers runs/latest\n  understudy gateway registers examples/heated-tank/cluster.toml --csv"
    )]
    Registers {
        /// Directory of a run, or cluster file
        #[arg(value_name = "RUN|CLUSTER.toml", default_value = "runs/latest")]
        run: PathBuf,
        /// Print a list of tags as CSV: name, address, type, unit, range and description
        #[arg(long)]
        csv: bool,
    },
    /// Write the signals of other groups to the inputs of a run
    #[command(
        after_help = "Example:\n  understudy gateway signals runs/latest --from 192.168.20.1:7447"
    )]
    Signals {
        #[command(flatten)]
        run: RunArgument,
        /// Address of the other group's `gateway zenoh`, or of a Zenoh router that it is connected to
        #[arg(long, value_name = "ADDRESS", value_parser = parse_address)]
        from: SocketAddr,
        /// Folder of an operator's keys, for a router with mutual TLS
        #[arg(long, value_name = "DIR")]
        keys: Option<PathBuf>,
    },
    /// States, values, remaining redundancy and events as JSON under Zenoh keys
    #[command(
        after_help = "Example:\n  understudy gateway zenoh runs/latest --listen 127.0.0.1:7447 --mirror 5/s"
    )]
    Zenoh {
        #[command(flatten)]
        run: RunArgument,
        /// Listening address (TCP)
        #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:7447", value_parser = parse_address)]
        listen: SocketAddr,
        /// Maximum rate of each changed document: 1/s to 50/s
        #[arg(long = "mirror", value_name = "RATE", default_value = "5/s")]
        rate: Rate,
        /// Let clients write operator inputs, with the role of an operator
        #[arg(long)]
        allow_writes: bool,
    },
}

#[derive(Debug, Args)]
struct RunArgument {
    /// Directory of a run
    #[arg(value_name = "RUN", default_value = "runs/latest")]
    run: PathBuf,
}

impl RunArgument {
    fn open(&self) -> Result<Run, Answer> {
        Ok(Run::open(&self.run)?)
    }
}

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Result<Answer, Answer> {
    let mut ready = |address| console.note(&format!("listening on {address}"));
    match &arguments.what {
        What::Metrics { run, out, listen, once } if plant::is_plant(run) => {
            let (plant, _) = plants::valid(run)?;
            let metrics = PlantMetrics::new(FollowedPlant::new(plant), out.clone());
            if *once {
                let metrics = metrics.exposition();
                return Ok(Answer::done(metrics.as_str(), json!({ "text": metrics })));
            }
            serve_metrics(move || Ok(metrics.exposition()), *listen, &mut ready).map_err(failed)?;
            Ok(ended())
        }
        What::Metrics { run, once, .. } if *once => {
            let metrics = understudy_gateway::exposition_of(&Run::open(run)?).map_err(failed)?;
            Ok(Answer::done(metrics.as_str(), json!({ "text": metrics })))
        }
        What::Metrics { run, listen, .. } => {
            let run = Followed::new(&Run::open(run)?).map_err(failed)?;
            serve_metrics(run.exposition(), *listen, &mut ready).map_err(failed)?;
            Ok(ended())
        }
        What::Modbus { run, listen, allow_writes } => {
            let run = run.open()?;
            let followed = Followed::new(&run).map_err(failed)?;
            let gate = allow_writes.then(|| WriteGate::new(&run, &followed));
            serve_modbus(followed, gate, *listen, &mut ready).map_err(failed)?;
            Ok(ended())
        }
        What::Signals { run, from, keys } => {
            let run = run.open()?;
            let followed = Followed::new(&run).map_err(failed)?;
            let gate = WriteGate::new(&run, &followed);
            let keys = match keys {
                Some(folder) => {
                    let date = Date::of(SystemTime::now());
                    let keys = OperatorKeys::load(folder, run.cluster(), date);
                    let keys = keys.map_err(|errors| crate::deployment::keys::failed(&errors))?;
                    Some(tls_keys(&keys.tls))
                }
                None => None,
            };
            let interrupted = interruption()?;
            let ends = || interrupted.load(Ordering::Relaxed) || run.is_finished();
            forward_signals(&gate, *from, keys.as_ref(), &ends, &mut |said| console.note(said))
                .map_err(failed)?;
            Ok(ended())
        }
        What::Notify { run } => {
            let run = Followed::new(&run.open()?).map_err(failed)?;
            if let Some(command) = run.cluster().notify() {
                console.note(&format!("alarms are passed on to `{}`", command.program));
            }
            let notified = notify(&run, &mut |error| console.note(&error.to_string()));
            let Notified { delivered, undelivered } = notified.map_err(failed)?;
            let text = format!("notifications: {delivered} delivered, {undelivered} not delivered");
            let counts = json!({ "delivered": delivered, "undelivered": undelivered });
            Ok(Answer::done(text.as_str(), counts))
        }
        What::Registers { run, csv } => {
            let (map, reports) = if run.is_file() {
                let (cluster, reports) = files::cluster(run, Overrides::default())?;
                (RegisterMap::new(&cluster), reports)
            } else {
                (RegisterMap::new(Run::open(run)?.cluster()), Vec::new())
            };
            let map = map.map_err(failed)?;
            let text = if *csv { map.tags() } else { table(&map) };
            Ok(Answer::done(text, json!({ "registers": map.places() })).with_used(reports))
        }
        What::Zenoh { run, listen, rate, allow_writes } => {
            let run = run.open()?;
            let followed = Followed::new(&run).map_err(failed)?;
            let gate = allow_writes.then(|| WriteGate::new(&run, &followed));
            mirror(&followed, gate, *listen, *rate, &mut ready).map_err(failed)?;
            Ok(ended())
        }
    }
}

fn failed(error: GatewayError) -> Answer {
    Answer::failed(Status::Failed, error.code(), error)
}

fn ended() -> Answer {
    Answer::done("", json!(null))
}

fn table(map: &RegisterMap) -> String {
    let mut text = String::new();
    let width = map.places().iter().map(|place| place.name.chars().count());
    let width = width.max().unwrap_or(0);
    for place in map.places() {
        let area = place.area.word();
        let last = place.address + (place.width - 1);
        let addresses = match place.width {
            1 => place.address.to_string(),
            _ => format!("{}-{last}", place.address),
        };
        let _ =
            writeln!(text, "{area:14}  {addresses:>9}  {:width$}  {}", place.name, place.meaning);
    }
    text
}
