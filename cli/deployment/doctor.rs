//! `understudy doctor`: readiness of a machine for a member.

mod fix;

use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::{Duration, SystemTime};

use clap::Args;
use serde::Serialize;
use understudy_bus::doctor::{
    Finding, Health, examine_machine, examine_networks, examine_peers, examine_ports,
};
use understudy_bus::{BusError, Endpoints, Guard};
use understudy_cluster::{Cluster, Security};
use understudy_keys::{Date, KeysError, MemberKeys};
use understudy_member::link_kind;
use understudy_wire::Member;

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::files;
use crate::overrides::OverrideArguments;
use fix::Fixed;

/// Check whether this machine is ready for a cluster or a member
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy doctor
  understudy doctor cell/cluster.toml
  understudy doctor cell/cluster.toml --name robot --keys /etc/understudy/keys/robot
  sudo understudy doctor cell/cluster.toml --fix

Without a cluster file the machine is checked for cycles of --period, or of 10 ms. Without --name only the machine is checked; with --name also ports, keys and the connections to other members. --fix shows the commands that
repair the machine, asks for confirmation on a terminal, runs them as root and checks again.

Exit status: 1 if a finding prevents the member from working. Possible improvements are warnings.")]
pub(crate) struct Arguments {
    /// Cluster file
    #[arg(value_name = "CLUSTER.toml")]
    cluster: Option<PathBuf>,
    /// Member to run on this machine
    #[arg(long, value_name = "NAME", requires = "cluster")]
    name: Option<String>,
    /// Folder of this member's keys
    #[arg(long, value_name = "DIR", requires = "name")]
    keys: Option<PathBuf>,
    /// JSON list of member names and addresses, overrides the addresses of the cluster file
    #[arg(long, value_name = "FILE", requires = "name")]
    endpoints: Option<PathBuf>,
    /// Number of cycles to listen for the other members
    #[arg(long, value_name = "CYCLES", default_value_t = 100)]
    listen: u32,
    /// Repair the machine: show, confirm and run each command as root, then check again
    #[arg(long)]
    fix: bool,
    /// Run the commands of --fix without confirmation
    #[arg(long, requires = "fix")]
    yes: bool,
    #[command(flatten)]
    overrides: OverrideArguments,
}

/// Certificates with fewer days left cause a warning.
const SOON_DAYS: i64 = 30;

/// Period that a machine is checked for without a cluster file.
const PERIOD: Duration = Duration::from_millis(10);

/// Minimum time to establish sessions.
const LEAST_PATIENCE: Duration = Duration::from_secs(2);

#[derive(Serialize)]
struct Examined<'a> {
    /// With a cluster file.
    #[serde(skip_serializing_if = "Option::is_none")]
    configuration: Option<String>,
    findings: &'a [Finding],
    /// Repairs, with --fix.
    #[serde(skip_serializing_if = "Option::is_none")]
    fixed: Option<&'a Fixed>,
}

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Result<Answer, Answer> {
    let overrides = arguments.overrides.overrides();
    let wanted = overrides.period.unwrap_or(PERIOD);
    let path = arguments.cluster.as_ref();
    let cluster = path.map(|path| files::cluster(path, overrides)).transpose()?;
    let cluster = cluster.map(|(cluster, _)| cluster);
    let agreement = cluster.as_ref().map(Cluster::agreement);
    let period = agreement.map_or(wanted, |agreement| agreement.schedule.period());
    let spins = cluster.as_ref().is_some_and(Cluster::spins);
    let mut findings = examine_machine(period, spins);
    let hash = agreement.map(|agreement| agreement.configuration.to_string());
    if let Some(hash) = &hash {
        let found = format!("{hash}; must be equal on all machines");
        findings.push(Finding::good("configuration", found));
    }
    if let (Some(name), Some(cluster)) = (&arguments.name, &cluster) {
        let member = crate::member::find(cluster, name)?;
        findings.extend(of_member(arguments, cluster, member)?);
    }
    let look_again = || examine_machine(period, spins);
    let fixed = arguments.fix.then(|| fix::fix(&findings, &look_again, arguments.yes, console));
    let (found, findings) = match &fixed {
        Some(fixed) => (findings.clone(), fixed.applied_to(findings)),
        None => (Vec::new(), findings),
    };
    let worst = findings.iter().map(|finding| finding.health).max();
    let status = if worst == Some(Health::Bad) { Status::Failed } else { Status::Done };
    let result = Examined { configuration: hash, findings: &findings, fixed: fixed.as_ref() };
    let mut words = text(&findings);
    if let Some(fixed) = &fixed {
        words += &fixed.text(&found);
    }
    let answer = Answer::done(words, result).with_status(status);
    let (Some(path), Some(cluster)) = (path, &cluster) else {
        return Ok(answer.and_next(&[&"demo"]));
    };
    Ok(match (&arguments.name, &arguments.keys) {
        (Some(name), Some(keys)) => {
            let command = command_of(cluster, name)?;
            answer.and_next(&[&command, path, &"--name", name, &"--keys", keys])
        }
        (Some(_), None) => answer,
        (None, _) => answer.and_next(&[&"lab", path]),
    })
}

/// Command that runs a member.
fn command_of(cluster: &Cluster, name: &str) -> Result<&'static str, Answer> {
    Ok(match crate::member::find(cluster, name)? {
        Member::Station(_) => "node",
        Member::RemoteIo(_) | Member::Twin(_) => "remote-io",
        Member::Plant(_) => "plant",
    })
}

fn of_member(
    arguments: &Arguments,
    cluster: &Cluster,
    member: Member,
) -> Result<Vec<Finding>, Answer> {
    let members = crate::member::peers(cluster, arguments.endpoints.as_deref())?;
    let agreement = cluster.agreement();
    let endpoints = Endpoints::new(agreement.cluster, member, members, cluster.roster());
    let endpoints = endpoints.map(|endpoints| endpoints.with_multicast(cluster.multicast()));
    let endpoints =
        endpoints.map_err(|error| Answer::failed(Status::BadInput, error.code(), error))?;
    let mut findings = examine_ports(&endpoints, link_kind(cluster));
    findings.extend(examine_networks(&endpoints));
    let (mut guard, of_keys) = keys(arguments, cluster, member);
    findings.extend(of_keys);
    let Some(guard) = &mut guard else {
        return Ok(findings);
    };
    let patience = (agreement.schedule.period() * arguments.listen).max(LEAST_PATIENCE);
    let heard =
        examine_peers(&endpoints, link_kind(cluster), guard, agreement.configuration, patience);
    match heard {
        Ok(heard) => findings.extend(heard),
        Err(BusError::PortInUse { .. }) => findings.push(Finding::good(
            "peer",
            "not checked: the member is already running; see its journal for the members it receives",
        )),
        // Errors of the address are reported with the ports.
        Err(BusError::Listen { .. }) => {}
        Err(error) => findings.push(Finding::trouble(
            "peer",
            Health::Bad,
            error.to_string(),
            "try again with `--link udp`, which requires only the address",
        )),
    }
    Ok(findings)
}

/// Findings about the keys, with the guard if the keys are valid.
fn keys(arguments: &Arguments, cluster: &Cluster, member: Member) -> (Option<Guard>, Vec<Finding>) {
    let folder = match (cluster.security(), &arguments.keys) {
        (Security::Off, _) => {
            let finding = Finding::trouble(
                "keys",
                Health::Warning,
                "the cluster file says `security = \"off\"`: any device on the network can control the plant",
                "remove `security` and run `understudy keys init`",
            );
            return (Some(Guard::Off), vec![finding]);
        }
        (Security::Keys, None) => {
            let finding = Finding::trouble(
                "keys",
                Health::Bad,
                "no keys given; the member does not start without keys",
                "give `--keys DIR`; `understudy keys init` creates them",
            );
            return (None, vec![finding]);
        }
        (Security::Keys, Some(folder)) => folder,
    };
    let now = Date::of(SystemTime::now());
    let bad = |error: &KeysError| {
        let text = error.to_string();
        let (found, remedy) = text.split_once("; ").unwrap_or((
            &text,
            "copy the folder of this member again from the machine that issues keys",
        ));
        Finding::trouble("keys", Health::Bad, found, remedy)
    };
    let keys = match MemberKeys::load(folder, cluster, member, now) {
        Ok(keys) => keys,
        Err(errors) => return (None, errors.iter().map(bad).collect()),
    };
    let days = now.days_until(keys.expires());
    let found = format!("valid until {}, {days} days", keys.expires());
    let finding = if days < SOON_DAYS {
        let remedy = "run `understudy keys issue`, then copy the changed folders";
        Finding::trouble("keys", Health::Warning, found, remedy)
    } else {
        Finding::good("keys", found)
    };
    match keys.begin_life(now) {
        Ok(seal) => (Some(Guard::with_keys(seal, keys.opener())), vec![finding]),
        Err(error) => (None, vec![finding, bad(&error)]),
    }
}

fn text(findings: &[Finding]) -> String {
    let mut text = String::new();
    for finding in findings {
        let word = match finding.health {
            Health::Good => "good",
            Health::Warning => "warning",
            Health::Bad => "BAD",
        };
        let _ = writeln!(text, "{word:8} {:14} {}", finding.check, finding.found);
        if let Some(remedy) = &finding.remedy {
            let _ = writeln!(text, "{:24}remedy: {remedy}", "");
        }
        if let Some(repair) = &finding.repair {
            let command = fix::shown(repair);
            let _ = writeln!(text, "{:24}command: {command}", "");
        }
    }
    let count = |health| findings.iter().filter(|finding| finding.health == health).count();
    let (bad, warnings) = (count(Health::Bad), count(Health::Warning));
    let verdict = if bad == 0 { "ready" } else { "NOT READY" };
    let _ = writeln!(text, "{verdict}: {bad} bad, {warnings} warnings");
    text
}
