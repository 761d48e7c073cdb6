//! `understudy node`, `remote-io` and `plant`: one member as one process.

use std::net::SocketAddrV4;
use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;
use understudy_bus::{LinkKind, Peer, zenoh_runtime};
use understudy_cluster::{Cluster, MULTICAST_GROUPS, is_multicast_range};
use understudy_member::{
    MemberError, MemberOptions, addressed_peers, find_member, link_kind, listed_peers,
    restart_for_zenoh,
};
use understudy_wire::Member;

use crate::answer::{Answer, Status};
use crate::files;
use crate::overrides::{OverrideArguments, parse_size};

/// Run one station, a controller or an understudy
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy node cluster.toml --name robot

The journal records are JSON lines on standard output (docs/reference/run-directory.md). All members must have an address, in the cluster
file or in the file of --endpoints. SIGINT and SIGTERM shut the member down; the lines `stop` and `release` on standard input are commands.")]
pub struct Arguments {
    /// Cluster file
    #[arg(value_name = "CLUSTER.toml")]
    cluster: PathBuf,
    /// Name of the member in the cluster file
    #[arg(long, value_name = "NAME")]
    name: String,
    /// JSON list of members with names and addresses, overrides the addresses of the cluster file
    #[arg(long, value_name = "FILE")]
    endpoints: Option<PathBuf>,
    /// First multicast group of the frames such as 239.192.0.0:7600, or `none`; overrides the cluster file
    #[arg(long, value_name = "ADDRESS", value_parser = parse_multicast)]
    multicast: Option<Multicast>,
    /// Folder of the keys of this member; required unless the cluster file has `security = "off"`
    #[arg(long, value_name = "DIR")]
    keys: Option<PathBuf>,
    /// Folder for what is needed after a power failure: retentive values, and the newest applied output of a remote I/O
    #[arg(long, value_name = "DIR")]
    retain: Option<PathBuf>,
    /// Exit when standard input is closed or the parent process ends
    #[arg(long)]
    in_laboratory: bool,
    /// As --in-laboratory, and operators reach the member at its address
    #[arg(long)]
    ends_with_parent: bool,
    /// Do not request real-time scheduling and locked memory
    #[arg(long)]
    no_real_time: bool,
    /// Journal file; older records are moved to segments next to it. Default: standard output
    #[arg(long, value_name = "FILE")]
    journal: Option<PathBuf>,
    /// Size limit of the journal, such as 200MB; the oldest records are removed first
    #[arg(long, value_name = "SIZE", default_value = "1GB", value_parser = parse_size)]
    journal_limit: u64,
    #[command(flatten)]
    overrides: OverrideArguments,
}

/// Run one remote I/O
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy remote-io cluster.toml --name robot-io")]
pub(crate) struct RemoteIoArguments {
    #[command(flatten)]
    pub(crate) common: Arguments,
}

/// Run one simulated plant
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy plant cluster.toml --name arm")]
pub(crate) struct PlantArguments {
    #[command(flatten)]
    pub(crate) common: Arguments,
}

/// Runs one station as this process.
pub fn run_station(arguments: &Arguments) -> Result<Answer, Answer> {
    let station = |member: Member| matches!(member, Member::Station(_));
    let wanted = (station as fn(Member) -> bool, "station", "understudy node");
    run(arguments, wanted, understudy_member::run_station)
}

/// Runs one remote I/O as this process.
pub fn run_remote_io(arguments: &Arguments) -> Result<Answer, Answer> {
    let remote_io = |member: Member| member.sampled_program().is_some();
    let wanted = (remote_io as fn(Member) -> bool, "remote I/O", "understudy remote-io");
    run(arguments, wanted, understudy_member::run_remote_io)
}

/// Runs one simulated plant as this process.
pub fn run_plant(arguments: &Arguments) -> Result<Answer, Answer> {
    let plant = |member: Member| matches!(member, Member::Plant(_));
    let wanted = (plant as fn(Member) -> bool, "plant", "understudy plant");
    run(arguments, wanted, understudy_member::run_plant)
}

/// A test of the member's kind, its word, and the command that runs it.
type Wanted = (fn(Member) -> bool, &'static str, &'static str);

fn run(
    arguments: &Arguments,
    (is_wanted, wanted, command): Wanted,
    member: fn(&Cluster, &MemberOptions) -> Result<(), MemberError>,
) -> Result<Answer, Answer> {
    let (cluster, _) = files::cluster(&arguments.cluster, arguments.overrides.overrides())?;
    let found = find(&cluster, &arguments.name)?;
    if link_kind(&cluster) == LinkKind::Zenoh {
        restart_for_zenoh(zenoh_runtime(cluster.paths(found).count()));
    }
    if !is_wanted(found) {
        return Err(failed(&MemberError::WrongKind {
            name: arguments.name.clone(),
            wanted,
            command,
        }));
    }
    let options = arguments.options(&cluster)?;
    member(&cluster, &options).map_err(|error| failed(&error))?;
    Ok(Answer::done("", json!(null)))
}

impl Arguments {
    fn options(&self, cluster: &Cluster) -> Result<MemberOptions, Answer> {
        Ok(MemberOptions {
            name: self.name.clone(),
            peers: peers(cluster, self.endpoints.as_deref())?,
            multicast: match self.multicast {
                None => cluster.multicast(),
                Some(Multicast(first)) => first,
            },
            keys: self.keys.clone(),
            in_laboratory: self.in_laboratory,
            ends_with_parent: self.in_laboratory || self.ends_with_parent,
            real_time: !self.no_real_time,
            retain: self.retain.clone(),
            journal: self.journal.clone(),
            journal_limit: self.journal_limit,
        })
    }
}

/// The first multicast group, or none.
#[derive(Debug, Clone, Copy)]
struct Multicast(Option<SocketAddrV4>);

fn parse_multicast(text: &str) -> Result<Multicast, String> {
    if text == "none" {
        return Ok(Multicast(None));
    }
    let first = text.parse().ok().filter(|first| is_multicast_range(*first));
    first.map(|first| Multicast(Some(first))).ok_or_else(|| {
        format!("{text:?} is not the first of {MULTICAST_GROUPS} multicast groups: an address such as 239.192.0.0:7600, or `none`")
    })
}

fn failed(error: &MemberError) -> Answer {
    if let MemberError::Keys(errors) = error {
        return crate::deployment::keys::failed(errors);
    }
    let status = if error.is_of_input() { Status::BadInput } else { Status::Failed };
    Answer::failed(status, error.code(), error)
}

/// The member of a name.
pub(crate) fn find(cluster: &Cluster, name: &str) -> Result<Member, Answer> {
    find_member(cluster, name).map_err(|error| failed(&error))
}

/// All members and their addresses, from a list or from the cluster file.
pub(crate) fn peers(cluster: &Cluster, list: Option<&Path>) -> Result<Vec<Peer>, Answer> {
    let peers = match list {
        Some(path) => listed_peers(path, &files::text(path)?),
        None => addressed_peers(cluster),
    };
    peers.map_err(|error| failed(&error))
}
