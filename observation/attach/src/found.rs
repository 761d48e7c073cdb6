//! Who of a cluster takes a call, and why the others do not.

use std::sync::Arc;
use std::time::Duration;

use understudy_bus::{BusError, Call, Peer, Reporter, Request, TlsKeys};
use understudy_cluster::{AlarmDeclaration, Cluster, Security};
use understudy_journal::check_version;
use understudy_wire::{ClusterHash, ConfigurationHash};

use crate::error::{AttachError, Unheard};

/// Members that are called at once, at most.
const AT_ONCE: usize = 16;

/// A cluster elsewhere of which at least one member takes calls.
pub struct Found {
    pub(crate) line: Line,
    pub(crate) members: Vec<(Peer, Result<Call, String>)>,
    /// Alarms on signals.
    pub(crate) alarms: Arc<[AlarmDeclaration]>,
}

/// What every call needs.
#[derive(Clone)]
pub(crate) struct Line {
    pub(crate) cluster: ClusterHash,
    pub(crate) configuration: ConfigurationHash,
    pub(crate) keys: TlsKeys,
    /// Time limit for the first line of a member.
    pub(crate) patience: Duration,
}

/// Why a call was in vain.
pub(crate) enum Vain {
    /// No process listens there.
    Nobody(String),
    /// One side does not believe the other.
    NotAdmitted(String),
    /// It runs something else.
    Other(String),
    /// Its records have another version.
    Version(u32),
    /// Its understudy is older and does not tell its configuration with its records.
    Older,
}

impl Vain {
    pub(crate) fn words(self) -> String {
        match self {
            Self::Nobody(reason) | Self::NotAdmitted(reason) => reason,
            Self::Other(theirs) => format!("it runs configuration {theirs}"),
            Self::Version(found) => format!("it reports version {found} of the journal"),
            Self::Older => {
                "it does not report its configuration: run this understudy there".to_owned()
            }
        }
    }
}

/// Calls all members of a cluster at their addresses.
///
/// # Errors
/// Where none of them can be followed: [`AttachError`].
pub fn find(cluster: &Cluster, keys: TlsKeys, peers: Vec<Peer>) -> Result<Found, AttachError> {
    if cluster.security() == Security::Off {
        return Err(AttachError::NoKeys);
    }
    let agreement = cluster.agreement();
    let line = Line {
        cluster: agreement.cluster,
        configuration: agreement.configuration,
        keys,
        patience: (agreement.schedule.period() * 10).max(Duration::from_secs(5)),
    };
    let mut called = Vec::new();
    for some in peers.chunks(AT_ONCE) {
        std::thread::scope(|scope| {
            let calls = some.iter().map(|peer| scope.spawn(|| line.call(peer)));
            let calls: Vec<_> = calls.collect();
            for (peer, call) in some.iter().zip(calls) {
                let lost = || Vain::Nobody("the call was lost".to_owned());
                called.push((peer.clone(), call.join().unwrap_or_else(|_| Err(lost()))));
            }
        });
    }
    if called.iter().all(|(_, call)| call.is_err()) {
        return Err(why_nobody(called, line.configuration));
    }
    let members = called.into_iter();
    Ok(Found {
        line,
        alarms: Arc::clone(cluster.alarms()),
        members: members.map(|(peer, call)| (peer, call.map_err(Vain::words))).collect(),
    })
}

fn why_nobody(called: Vec<(Peer, Result<Call, Vain>)>, ours: ConfigurationHash) -> AttachError {
    let (mut silent, mut strange) = (Vec::new(), Vec::new());
    for (Peer { name, address, .. }, call) in called {
        let unheard = |reason| Unheard { name: name.clone(), address, reason };
        match call {
            Err(Vain::Other(theirs)) => {
                return AttachError::OtherConfiguration { name, address, theirs, ours };
            }
            Err(Vain::Version(found)) => {
                return AttachError::OtherVersion { name, address, found };
            }
            Err(Vain::Nobody(reason)) => silent.push(unheard(reason)),
            Err(Vain::NotAdmitted(reason)) => strange.push(unheard(reason)),
            // Only what it tells later shows this.
            Err(Vain::Older) | Ok(_) => {}
        }
    }
    if strange.is_empty() {
        AttachError::Nobody { tried: silent }
    } else {
        AttachError::NotAdmitted { tried: strange }
    }
}

impl Line {
    /// Calls one member, and hears whether it runs the same.
    pub(crate) fn call(&self, peer: &Peer) -> Result<Call, Vain> {
        // Asked of the system first: Zenoh says the same of a machine that is not there and of a key that is not believed.
        let address = peer.reachable().map_err(|error| Vain::Nobody(words_of(&error)))?;
        let not_admitted = |error: BusError| {
            Vain::NotAdmitted(match error {
                BusError::Uncalled { reason, .. } => reason,
                error => error.to_string(),
            })
        };
        let call = Call::to(address, self.cluster, &peer.name, &self.keys);
        let call = call.map_err(not_admitted)?;
        let theirs = call.ask(&Request::Cluster).map_err(|_| {
            let reason = "it believes the certificate, and does not answer its holder";
            Vain::NotAdmitted(reason.to_owned())
        })?;
        let status = call.ask(&Request::Status).unwrap_or_default();
        let mut hashes = theirs.split_whitespace().map(str::to_owned);
        let configuration = hashes.next().unwrap_or_default();
        let version = version_of(&status);
        self.check(&Reporter { configuration, prepared: hashes.next(), version })?;
        Ok(call.with_configuration(self.configuration))
    }

    /// Whether records have the configuration of the cluster file, and a version that is read here.
    pub(crate) fn check(&self, reporter: &Reporter) -> Result<(), Vain> {
        if !reporter.is_of(self.configuration) {
            return Err(Vain::Other(reporter.configuration.clone()));
        }
        check_version(reporter.version).map_err(|wrong| Vain::Version(wrong.found))
    }
}

/// Version of the records of a member, from what it said when it was ready.
fn version_of(status: &str) -> u32 {
    let ready: Option<serde_json::Value> = serde_json::from_str(status).ok();
    let version = ready.and_then(|ready| ready["version"].as_u64());
    version.map_or(1, |version| u32::try_from(version).unwrap_or(u32::MAX))
}

fn words_of(error: &std::io::Error) -> String {
    match error.kind() {
        std::io::ErrorKind::ConnectionRefused => "nothing listens there".to_owned(),
        std::io::ErrorKind::TimedOut | std::io::ErrorKind::WouldBlock => {
            "no answer from that address".to_owned()
        }
        _ => error.to_string(),
    }
}
