//! Attaches to a running cluster: a laboratory of this machine, or remote members with an operator's keys.

use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use clap::Args;
use understudy_attach::{AttachError, Attached, Found, find};
use understudy_cluster::{Cluster, Security};
use understudy_journal::{RunDirectory, keep_cluster};
use understudy_keys::{Date, OperatorKeys};
use understudy_member::tls_keys;

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::files;
use crate::member::peers;

/// Access to a running cluster.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Remote cluster")]
pub(crate) struct AttachArguments {
    /// Folder of an operator's keys; connects to the members at their addresses and shows their journals
    #[arg(long, value_name = "DIR")]
    keys: Option<PathBuf>,
    /// JSON list of member names and addresses, overrides the addresses of the cluster file
    #[arg(long, value_name = "FILE", requires = "keys")]
    endpoints: Option<PathBuf>,
}

/// Connection timeout for a machine in the same network.
const REACH: Duration = Duration::from_millis(300);

/// Maximum number of members called before a laboratory starts.
const ASKED: usize = 8;

impl AttachArguments {
    pub(crate) fn is_wanted(&self) -> bool {
        self.keys.is_some()
    }

    /// Whether addresses are overridden.
    pub(crate) fn has_endpoints(&self) -> bool {
        self.endpoints.is_some()
    }

    /// The same for a group of a plant: the folder of the keys has a folder for each group.
    pub(crate) fn of_group(&self, group: &str) -> Self {
        Self { keys: self.keys.as_ref().map(|folder| folder.join(group)), endpoints: None }
    }

    /// Connects to the members and writes their journals to a run below `out`. Answers also with the person of the keys.
    pub(crate) fn attach(
        &self,
        cluster_file: &Path,
        cluster: &Cluster,
        out: &Path,
        journal_limit: u64,
        console: &mut Console,
    ) -> Result<(RunDirectory, Attached, String), Answer> {
        let (found, person) = self.find(cluster)?;
        let (heard, unheard) = found.names();
        console.note(&format!("attached to {}", heard.join(", ")));
        if !unheard.is_empty() {
            let unheard = unheard.join(", ");
            console.note(&format!("not received, retrying: {unheard}"));
        }
        let (directory, attached) = record(found, cluster_file, cluster, out, journal_limit)?;
        Ok((directory, attached, person))
    }

    /// Connects to the members. Answers also with the person of the keys.
    pub(crate) fn find(&self, cluster: &Cluster) -> Result<(Found, String), Answer> {
        if cluster.security() == Security::Off {
            let error = AttachError::NoKeys;
            return Err(Answer::failed(Status::BadInput, error.code(), error));
        }
        let folder = self.keys.as_deref().unwrap_or(Path::new(""));
        let keys = OperatorKeys::load(folder, cluster, Date::of(SystemTime::now()));
        let keys = keys.map_err(|errors| crate::deployment::keys::failed(&errors))?;
        let peers = peers(cluster, self.endpoints.as_deref())?;
        let found = find(cluster, tls_keys(&keys.tls), peers)
            .map_err(|error| Answer::failed(Status::Failed, error.code(), error))?;
        Ok((found, keys.name))
    }
}

/// Writes the journals of members to a new run below `out`.
pub(crate) fn record(
    found: Found,
    cluster_file: &Path,
    cluster: &Cluster,
    out: &Path,
    journal_limit: u64,
) -> Result<(RunDirectory, Attached), Answer> {
    let directory = files::run_directory(out)?;
    keep_cluster(directory.path(), cluster_file, cluster).map_err(files::unwritable_run)?;
    let attached = found
        .record(&directory, journal_limit)
        .map_err(|error| Answer::failed(Status::Failed, error.code(), error))?;
    Ok((directory, attached))
}

/// A member of the cluster file that accepts connections at its address: the cluster is running.
pub(crate) fn who_runs_already(cluster: &Cluster) -> Option<String> {
    cluster.members().take(ASKED).find_map(|member| {
        let address = cluster.address(member)?;
        TcpStream::connect_timeout(&address, REACH).ok()?;
        let name = cluster.member_name(member)?;
        Some(format!("{name} at {address}"))
    })
}
