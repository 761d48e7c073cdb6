//! `understudy node`, `remote-io` and `plant`: one member as one process.

use std::io;
use std::net::SocketAddr;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use clap::Args;
use serde::Serialize;
use serde_json::json;
use understudy_bus::{
    Admitted, ChannelSettings, Commands, Endpoints, FieldDriver, Guard, LinkKind, MemberSettings,
    NewLife, NoField, NoObserver, Peer, SimulatedField, ZENOH_RUNTIME, hold_back_signals,
    run_member,
};
use understudy_cluster::{Cluster, Security, why_unreachable};
use understudy_cycle::Machine;
use understudy_journal::Segments;
use understudy_keys::{Date, MemberKeys, RevocationWatch};
use understudy_node::Station;
use understudy_plant::PlantMachine;
use understudy_remote_io::RemoteIo;
use understudy_wire::{Epoch, Image, Member, ProgramId, Time};

use crate::answer::{Answer, Status};
use crate::field::Equipment;
use crate::files;
use crate::overrides::{OverrideArguments, link_kind, parse_size};

/// Run one station, a controller or an understudy, as this process
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy node cluster.toml --name robot

Reports are JSON lines on standard output (docs/reference/run-directory.md). Every member needs an address in the cluster file, or in
the file of --endpoints. SIGINT and SIGTERM end it in order; the lines `stop` and `release` on standard input are commands.")]
pub(crate) struct Arguments {
    /// The cluster file
    #[arg(value_name = "CLUSTER.toml")]
    cluster: PathBuf,
    /// Which member of the cluster, by its name
    #[arg(long, value_name = "NAME")]
    name: String,
    /// A JSON list of members, names and addresses, in place of the addresses of the cluster file
    #[arg(long, value_name = "FILE")]
    endpoints: Option<PathBuf>,
    /// The folder of this member's keys; needed unless the cluster file says `security = "off"`
    #[arg(long, value_name = "DIR")]
    keys: Option<PathBuf>,
    /// End with standard input and with the process that started this one
    #[arg(long)]
    in_laboratory: bool,
    /// Do not ask for real-time rights
    #[arg(long)]
    no_real_time: bool,
    /// Write the reports to this file in place of standard output; older ones to segments beside it
    #[arg(long, value_name = "FILE")]
    journal: Option<PathBuf>,
    /// What that file and its segments may take of the disk, such as 200MB; the oldest reports go when they are full
    #[arg(long, value_name = "SIZE", default_value = "1GB", value_parser = parse_size)]
    journal_limit: u64,
    #[command(flatten)]
    overrides: OverrideArguments,
}

/// Run one remote I/O as this process
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy remote-io cluster.toml --name robot-io")]
pub(crate) struct RemoteIoArguments {
    #[command(flatten)]
    pub(crate) common: Arguments,
}

/// Run one simulated plant as this process
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy plant cluster.toml --name arm")]
pub(crate) struct PlantArguments {
    #[command(flatten)]
    pub(crate) common: Arguments,
}

pub(crate) fn run_station(arguments: &Arguments) -> Answer {
    with_cluster(arguments, |cluster, member| {
        let Member::Station(station) = member else {
            return Err(wrong_kind(arguments, "station", "understudy node"));
        };
        let settings = cluster.station_settings(station, epoch_of_the_clock());
        let settings =
            settings.ok_or_else(|| wrong_kind(arguments, "station", "understudy node"))?;
        play(
            arguments,
            cluster,
            member,
            Station::new(Time::default(), settings),
            Box::new(NoField),
        )
    })
}

pub(crate) fn run_remote_io(arguments: &Arguments) -> Answer {
    with_cluster(arguments, |cluster, member| {
        let wrong = || wrong_kind(arguments, "remote I/O", "understudy remote-io");
        let Member::RemoteIo(program) = member else {
            return Err(wrong());
        };
        let settings = cluster.remote_io_settings(program).ok_or_else(wrong)?;
        let field = field_of(arguments, cluster, program, settings.fail_safe.clone())?;
        play(
            arguments,
            cluster,
            member,
            RemoteIo::new(Time::default(), settings),
            field,
        )
    })
}

/// Its device where it has one, and its simulated plant otherwise.
fn field_of(
    arguments: &Arguments,
    cluster: &Cluster,
    program: ProgramId,
    fail_safe: Image,
) -> Result<Box<dyn FieldDriver>, Answer> {
    let agreement = cluster.agreement();
    let remote_io = cluster.remote_ios().get(program.index());
    let Some(device) = remote_io.and_then(|remote_io| remote_io.field.clone()) else {
        return Ok(Box::new(SimulatedField::new(program, agreement.clone())));
    };
    let period = agreement.schedule.period();
    let equipment = Equipment::start(device, fail_safe, period, !arguments.no_real_time);
    match equipment {
        Ok(equipment) => Ok(Box::new(equipment)),
        Err(error) => {
            let message = format!("a thread for the device: {error}");
            Err(Answer::failed(Status::Failed, "U0506", message))
        }
    }
}

pub(crate) fn run_plant(arguments: &Arguments) -> Answer {
    with_cluster(arguments, |cluster, member| {
        let wrong = || wrong_kind(arguments, "plant", "understudy plant");
        let Member::Plant(program) = member else {
            return Err(wrong());
        };
        let settings = cluster.plant_settings(program).ok_or_else(wrong)?;
        play(
            arguments,
            cluster,
            member,
            PlantMachine::new(settings, Time::default()),
            Box::new(NoField),
        )
    })
}

fn with_cluster(
    arguments: &Arguments,
    run: impl FnOnce(&Cluster, Member) -> Result<Answer, Answer>,
) -> Answer {
    let (cluster, _) = match files::cluster(&arguments.cluster, arguments.overrides.overrides()) {
        Ok(read) => read,
        Err(answer) => return answer,
    };
    // Before anything else is started, which would be lost.
    start_again_for_zenoh(link_kind(&cluster));
    let answer = find(&cluster, &arguments.name).and_then(|member| run(&cluster, member));
    answer.unwrap_or_else(|answer| answer)
}

/// The member of a name.
pub(crate) fn find(cluster: &Cluster, name: &str) -> Result<Member, Answer> {
    cluster.member(name).ok_or_else(|| {
        let names: Vec<&str> = cluster
            .members()
            .filter_map(|member| cluster.member_name(member))
            .collect();
        let message = format!("the cluster has no `{name}`; it has {}", names.join(", "));
        Answer::failed(Status::BadInput, "U0605", message)
    })
}

fn wrong_kind(arguments: &Arguments, wanted: &str, command: &str) -> Answer {
    let message = format!(
        "`{}` is no {wanted}, which `{command}` runs",
        arguments.name
    );
    Answer::failed(Status::BadInput, "U0606", message)
}

/// Runs the machine until it is told to end.
fn play<M>(
    arguments: &Arguments,
    cluster: &Cluster,
    member: Member,
    machine: M,
    field: Box<dyn FieldDriver>,
) -> Result<Answer, Answer>
where
    M: Machine + Send,
    M::Event: Serialize + Send + 'static,
{
    let link = link_kind(cluster);
    let members = peers(cluster, arguments.endpoints.as_deref())?;
    let neighbours = cluster.neighbours();
    let endpoints = Endpoints::new(cluster.agreement().cluster, member, members, neighbours);
    let endpoints = endpoints
        .map_err(|error| Answer::failed(Status::BadInput, error.code(), error.to_string()))?;
    let keys = read_keys(arguments, cluster, member)?;
    let settings = MemberSettings {
        endpoints,
        link,
        guard: keys.guard,
        channel: keys.channel,
        field,
        observer: Box::new(NoObserver),
        commands: if arguments.in_laboratory {
            Commands::ReadAndEndWithInput
        } else {
            Commands::Read
        },
        ends_with_parent: arguments.in_laboratory,
        real_time: !arguments.no_real_time,
    };
    let output: Box<dyn io::Write + Send> = match &arguments.journal {
        None => Box::new(io::stdout()),
        Some(path) => Box::new(Segments::create(path, arguments.journal_limit).map_err(
            |error| {
                let message = format!("{} cannot be written: {error}", path.display());
                Answer::failed(Status::Failed, "U0602", message)
            },
        )?),
    };
    match run_member(machine, settings, output) {
        // Its last record has said it already.
        Ok(_) => Ok(Answer::done("", json!(null))),
        Err(error) => Err(Answer::failed(
            Status::Failed,
            error.code(),
            error.to_string(),
        )),
    }
}

/// What a member seals and opens with, and what follows its list of revoked keys.
struct Held {
    guard: Guard,
    channel: Option<ChannelSettings>,
    _watch: Option<RevocationWatch>,
}

fn read_keys(arguments: &Arguments, cluster: &Cluster, member: Member) -> Result<Held, Answer> {
    let folder = match (&arguments.keys, cluster.security()) {
        (_, Security::Off) => {
            return Ok(Held {
                guard: Guard::Off,
                channel: None,
                _watch: None,
            });
        }
        (None, Security::Keys) => {
            let message = "the cluster wants keys: name this member's folder with --keys (`understudy keys init` makes them), or write `security = \"off\"` in the cluster file";
            return Err(Answer::failed(Status::BadInput, "U0620", message));
        }
        (Some(folder), Security::Keys) => folder,
    };
    let now = Date::of(SystemTime::now());
    // Whoever follows the list of revoked keys is a thread.
    hold_back_signals()
        .map_err(|error| Answer::failed(Status::Failed, error.code(), error.to_string()))?;
    let keys = MemberKeys::load(folder, cluster, member, now);
    let keys = keys.map_err(|errors| crate::deployment::keys::failed(&errors))?;
    let keys = Arc::new(keys);
    let seal = keys.begin_life(now);
    let watch = keys.watch();
    match (seal, watch) {
        (Ok(seal), Ok(watch)) => Ok(Held {
            guard: Guard::with_keys(seal, keys.opener()).with_lives(new_life(&keys)),
            // In a laboratory standard input is the operator.
            channel: (!arguments.in_laboratory).then(|| channel(keys, cluster)),
            _watch: Some(watch),
        }),
        (Err(error), _) | (_, Err(error)) => Err(crate::deployment::keys::failed(&[error])),
    }
}

/// A life of now, noted where the lives before it are.
fn new_life(keys: &Arc<MemberKeys>) -> NewLife {
    let keys = Arc::clone(keys);
    Arc::new(move || {
        let life = keys.begin_life(Date::of(SystemTime::now()));
        life.map_err(|error| error.to_string())
    })
}

fn channel(keys: Arc<MemberKeys>, cluster: &Cluster) -> ChannelSettings {
    let tls = keys.tls().clone();
    ChannelSettings {
        keys: crate::deployment::operate::tls_keys(&tls),
        admitted: Box::new(move || {
            let (operators, members) = keys.admitted();
            Admitted { operators, members }
        }),
        configuration: cluster.canonical_text().to_owned(),
    }
}

/// All members and where they listen, from a list or from the cluster file.
pub(crate) fn peers(cluster: &Cluster, list: Option<&Path>) -> Result<Vec<Peer>, Answer> {
    match list {
        Some(path) => listed(path),
        None => addressed(cluster),
    }
}

fn listed(path: &Path) -> Result<Vec<Peer>, Answer> {
    let refused = |error: String| {
        let message = format!("{} is no list of endpoints: {error}", path.display());
        Answer::failed(Status::BadInput, "U0607", message)
    };
    let peers: Vec<Peer> =
        serde_json::from_str(&files::text(path)?).map_err(|error| refused(error.to_string()))?;
    for Peer { name, address, .. } in &peers {
        if let Some(why) = why_unreachable(*address) {
            return Err(refused(format!("{name} has the address {address}: {why}")));
        }
    }
    Ok(peers)
}

fn addressed(cluster: &Cluster) -> Result<Vec<Peer>, Answer> {
    let name = |member| cluster.member_name(member).unwrap_or_default().to_owned();
    let known: Vec<(Member, Option<SocketAddr>)> = cluster
        .members()
        .map(|member| (member, cluster.address(member)))
        .collect();
    let lacking = known.iter().filter(|(_, address)| address.is_none());
    let lacking: Vec<String> = lacking.map(|(member, _)| name(*member)).collect();
    if !lacking.is_empty() {
        let message = format!(
            "no address for {}; give each an `address = \"HOST:PORT\"` in the cluster file",
            lacking.join(", ")
        );
        return Err(Answer::failed(Status::BadInput, "U0608", message));
    }
    let peers = known.into_iter().filter_map(|(member, address)| {
        Some(Peer {
            member,
            name: name(member),
            address: address?,
        })
    });
    Ok(peers.collect())
}

/// Zenoh takes the number of its threads from the environment only, and only when a process starts.
fn start_again_for_zenoh(link: LinkKind) {
    let (variable, value) = ZENOH_RUNTIME;
    if link == LinkKind::Udp || std::env::var_os(variable).is_some() {
        return;
    }
    if let Ok(program) = std::env::current_exe() {
        // It only comes back where it fails; then Zenoh has more threads than it needs, and works.
        let _ = Command::new(program)
            .args(std::env::args_os().skip(1))
            .env(variable, value)
            .exec();
    }
}

/// Later than any epoch that the cluster has had.
fn epoch_of_the_clock() -> Epoch {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    Epoch(since.map_or(1, |since| {
        u64::try_from(since.as_micros()).unwrap_or(u64::MAX)
    }))
}
