//! `understudy keys`: keys and certificates of a cluster.

use std::fmt::Write as _;
use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use clap::{Args, Subcommand};
use serde::Serialize;
use understudy_cluster::{Cluster, Overrides};
use understudy_keys::{Authority, DEFAULT_PERSON, Date, Holder, Issued, KeysError, People, Role};
use understudy_wire::Role as Rights;

use crate::answer::{Answer, Status};
use crate::files;

/// Create, issue, revoke and list the keys of a cluster
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy keys init cell/cluster.toml --folder cell/keys
  understudy keys list --folder cell/keys
  understudy keys revoke tank --folder cell/keys
  understudy keys issue cell/cluster.toml tank --folder cell/keys

`init` issues keys to all members and to one engineer. Copy the folder members/NAME only to the machine of NAME (docs/how-to/deployment.md). Keep
the folder authority where keys are issued.")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Create the authority, and keys for all members and one engineer
    #[command(after_help = "Example:\n  understudy keys init cell/cluster.toml --folder cell/keys")]
    Init {
        /// Cluster file
        #[arg(value_name = "CLUSTER.toml")]
        cluster: PathBuf,
        #[command(flatten)]
        folder: FolderArgument,
        #[command(flatten)]
        days: DaysArgument,
    },
    /// Issue keys to new members, or instead of expired or revoked ones
    #[command(
        after_help = "Example:\n  understudy keys issue cell/cluster.toml tank --folder cell/keys\n  understudy keys issue cell/cluster.toml --operator anna --folder cell/keys"
    )]
    Issue {
        /// Cluster file
        #[arg(value_name = "CLUSTER.toml")]
        cluster: PathBuf,
        /// Members
        #[arg(value_name = "NAME")]
        names: Vec<String>,
        #[command(flatten)]
        people: PeopleArguments,
        #[command(flatten)]
        folder: FolderArgument,
        #[command(flatten)]
        days: DaysArgument,
    },
    /// List issued keys, their expiry and revoked keys
    #[command(after_help = "Example:\n  understudy keys list --folder cell/keys")]
    List {
        #[command(flatten)]
        folder: FolderArgument,
    },
    /// Revoke keys; running members apply it when their revoked.toml is replaced
    #[command(after_help = "Example:\n  understudy keys revoke tank --folder cell/keys")]
    Revoke {
        /// Members or persons
        #[arg(value_name = "NAME", required = true)]
        names: Vec<String>,
        #[command(flatten)]
        folder: FolderArgument,
    },
}

#[derive(Debug, Args)]
struct PeopleArguments {
    /// Person or program that may read what the members report; repeatable
    #[arg(long, value_name = "NAME")]
    viewer: Vec<String>,
    /// Person or program that may also write operator inputs; repeatable
    #[arg(long, value_name = "NAME")]
    operator: Vec<String>,
    /// Person or program that may also force, release and stop; repeatable
    #[arg(long, value_name = "NAME")]
    engineer: Vec<String>,
    /// Address at which members reach them, such as the router of a site
    #[arg(long, value_name = "IP")]
    address: Option<IpAddr>,
}

impl PeopleArguments {
    fn holders(&self) -> Vec<(String, Rights)> {
        let roles = [
            (&self.viewer, Rights::Viewer),
            (&self.operator, Rights::Operator),
            (&self.engineer, Rights::Engineer),
        ];
        let holders = roles.into_iter().flat_map(|(names, role)| {
            let names = names.iter().cloned();
            names.map(move |name| (name, role))
        });
        holders.collect()
    }
}

#[derive(Debug, Args)]
struct FolderArgument {
    /// Folder of the keys
    #[arg(long, value_name = "DIR", default_value = "keys")]
    folder: PathBuf,
}

#[derive(Debug, Args)]
struct DaysArgument {
    /// Validity of the certificates in days
    #[arg(long, value_name = "N", default_value_t = 730, value_parser = clap::value_parser!(u32).range(1..=7300))]
    days: u32,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Answer> {
    let now = Date::of(SystemTime::now());
    let (issued, without_address) = match &arguments.what {
        What::Init { cluster, folder, days } => {
            let cluster = read(cluster)?;
            let members = cluster.members();
            let names = members.filter_map(|member| cluster.member_name(member));
            let names: Vec<String> = names.map(str::to_owned).collect();
            let mut authority =
                Authority::init(&folder.folder, &cluster, now).map_err(|error| failed(&[error]))?;
            let people = [(DEFAULT_PERSON.to_owned(), Rights::Engineer)];
            let issued = authority.issue(&cluster, &names, people[..].into(), days.days, now);
            let issued = issued.map_err(|errors| failed(&errors))?;
            (issued, without_address(&cluster, &names))
        }
        What::Issue { cluster, names, people, folder, days } => {
            let cluster = read(cluster)?;
            let mut authority = open(folder)?;
            let holders = people.holders();
            let people = People { holders: &holders, address: people.address };
            let issued = authority.issue(&cluster, names, people, days.days, now);
            let issued = issued.map_err(|errors| failed(&errors))?;
            (issued, without_address(&cluster, names))
        }
        What::List { folder } => {
            return Ok(listed(&open(folder)?.register().holders, now));
        }
        What::Revoke { names, folder } => {
            let revoked = open(folder)?.revoke(names, now);
            (revoked.map_err(|errors| failed(&errors))?, Vec::new())
        }
    };
    let has_addresses = without_address.is_empty();
    let answer = changed(&issued, without_address, now);
    Ok(match &arguments.what {
        What::Init { cluster, folder, .. } if has_addresses => {
            with_doctor(answer, cluster, &folder.folder, &issued)
        }
        What::Init { cluster, .. } => answer.and_next(&[&"lab", cluster]),
        _ => answer,
    })
}

/// Command for the machine of the first member.
fn with_doctor(answer: Answer, cluster: &Path, folder: &Path, issued: &Issued) -> Answer {
    let Some(member) = issued.holders.iter().find(|it| it.role == Role::Member) else {
        return answer;
    };
    let keys = folder.join("members").join(&member.name);
    answer.and_next(&[&"doctor", &cluster, &"--name", &member.name, &"--keys", &keys])
}

fn read(path: &Path) -> Result<Cluster, Answer> {
    files::cluster(path, Overrides::default()).map(|(cluster, _)| cluster)
}

fn open(folder: &FolderArgument) -> Result<Authority, Answer> {
    Authority::open(&folder.folder).map_err(|errors| failed(&errors))
}

/// Answer with all errors: a failed run if writing failed, otherwise invalid input.
pub(crate) fn failed(errors: &[KeysError]) -> Answer {
    let writing = |error: &KeysError| {
        matches!(error, KeysError::Write { .. } | KeysError::Certificate { .. })
    };
    let status = if errors.iter().any(writing) { Status::Failed } else { Status::BadInput };
    let answer = Answer::done("", serde_json::Value::Null).with_status(status);
    errors.iter().fold(answer, |answer, error| answer.and_failure(status, error.code(), error))
}

#[derive(Serialize)]
struct Shown<'a> {
    name: &'a str,
    role: Role,
    generation: u32,
    serial: &'a str,
    issued: Date,
    expires: Date,
    days_left: i64,
    state: &'static str,
    revoked: Option<Date>,
}

#[derive(Serialize)]
struct List<'a> {
    holders: Vec<Shown<'a>>,
    /// Changed holders.
    folders: Vec<String>,
    /// Members with certificates for 127.0.0.1.
    without_address: Vec<String>,
}

fn shown(holder: &Holder, now: Date) -> Shown<'_> {
    let state = match holder.revoked {
        Some(_) => "revoked",
        None if now >= holder.expires => "expired",
        None => "valid",
    };
    Shown {
        name: &holder.name,
        role: holder.role,
        generation: holder.generation,
        serial: &holder.serial,
        issued: holder.issued,
        expires: holder.expires,
        days_left: now.days_until(holder.expires),
        state,
        revoked: holder.revoked,
    }
}

fn table(holders: &[Holder], now: Date) -> String {
    let width = holders.iter().map(|holder| holder.name.len()).max();
    let width = width.unwrap_or(0).max(4);
    let mut text =
        format!("{:width$}  role      generation  expires               state\n", "name");
    for holder in holders {
        let shown = shown(holder, now);
        let role = shown.role.word();
        let state = match shown.revoked {
            Some(since) => format!("revoked {since}"),
            None if shown.state == "valid" => format!("valid, {} days left", shown.days_left),
            None => shown.state.to_owned(),
        };
        let _ = writeln!(
            text,
            "{:width$}  {role:8}  {:10}  {}  {state}",
            shown.name, shown.generation, shown.expires
        );
    }
    text
}

fn listed(holders: &[Holder], now: Date) -> Answer {
    let list = List {
        holders: holders.iter().map(|holder| shown(holder, now)).collect(),
        folders: Vec::new(),
        without_address: Vec::new(),
    };
    Answer::done(table(holders, now), list)
}

/// Members without an address in the cluster file; their certificates are for 127.0.0.1.
fn without_address(cluster: &Cluster, names: &[String]) -> Vec<String> {
    let lacks = |name: &&String| {
        let member = cluster.member(name);
        member.is_some_and(|member| cluster.address(member).is_none())
    };
    names.iter().filter(lacks).cloned().collect()
}

fn changed(issued: &Issued, without_address: Vec<String>, now: Date) -> Answer {
    let folders = issued.folders.iter();
    let folders: Vec<String> = folders.map(|folder| folder.display().to_string()).collect();
    let mut text = String::new();
    if !without_address.is_empty() {
        let _ = writeln!(
            text,
            "warning[U0915]: no address in the cluster file for {}; their certificates are for 127.0.0.1 and are refused on other machines: give each an `address`, then `understudy keys issue`",
            without_address.join(", ")
        );
    }
    text.push_str(&table(&issued.holders, now));
    text.push_str("\nchanged folders; copy each only to the machine of its member:\n");
    for folder in &folders {
        let _ = writeln!(text, "  {folder}");
    }
    let list = List {
        holders: issued.holders.iter().map(|holder| shown(holder, now)).collect(),
        folders,
        without_address,
    };
    Answer::done(text, list)
}
