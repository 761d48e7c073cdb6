//! `understudy keys`: the keys and certificates of a cluster.

use std::fmt::Write as _;
use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use clap::{Args, Subcommand};
use serde::Serialize;
use understudy_cluster::{Cluster, Overrides};
use understudy_keys::{
    Authority, DEFAULT_OPERATOR, Date, Holder, Issued, KeysError, Operators, Role,
};

use crate::answer::{Answer, Status};
use crate::files;

/// Make, issue, revoke and list the keys of a cluster
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy keys init cell/cluster.toml --folder cell/keys
  understudy keys list --folder cell/keys
  understudy keys revoke tank --folder cell/keys
  understudy keys issue cell/cluster.toml tank --folder cell/keys

`init` issues keys to every member and to one operator. The folder members/NAME goes to the machine of NAME, and to nobody else
(docs/how-to/deployment.md); the folder authority stays where keys are made.")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Make an authority, and keys for every member and for an operator
    Init {
        /// The cluster file
        #[arg(value_name = "CLUSTER.toml")]
        cluster: PathBuf,
        #[command(flatten)]
        folder: FolderArgument,
        #[command(flatten)]
        days: DaysArgument,
    },
    /// Make new keys in place of those that expire or were revoked, or for members that are new
    Issue {
        /// The cluster file
        #[arg(value_name = "CLUSTER.toml")]
        cluster: PathBuf,
        /// Members of the cluster
        #[arg(value_name = "NAME")]
        names: Vec<String>,
        /// An operator, who is no member and may command them; may be given more than once
        #[arg(long, value_name = "NAME")]
        operator: Vec<String>,
        /// Where these operators are called, such as the router of a site
        #[arg(long, value_name = "IP", requires = "operator")]
        address: Option<IpAddr>,
        #[command(flatten)]
        folder: FolderArgument,
        #[command(flatten)]
        days: DaysArgument,
    },
    /// What was issued to whom, until when it holds, and what was revoked
    List {
        #[command(flatten)]
        folder: FolderArgument,
    },
    /// Keys that no longer count; those who run obey as soon as their revoked.toml is replaced
    Revoke {
        /// Members or operators
        #[arg(value_name = "NAME", required = true)]
        names: Vec<String>,
        #[command(flatten)]
        folder: FolderArgument,
    },
}

#[derive(Debug, Args)]
struct FolderArgument {
    /// Where the keys are kept
    #[arg(long, value_name = "DIR", default_value = "keys")]
    folder: PathBuf,
}

#[derive(Debug, Args)]
struct DaysArgument {
    /// Days for which the certificates hold
    #[arg(long, value_name = "N", default_value_t = 730, value_parser = clap::value_parser!(u32).range(1..=7300))]
    days: u32,
}

pub(crate) fn run(arguments: &Arguments) -> Answer {
    let now = Date::of(SystemTime::now());
    let done = match &arguments.what {
        What::Init {
            cluster,
            folder,
            days,
        } => read(cluster).and_then(|cluster| {
            let members = cluster.members();
            let names = members.filter_map(|member| cluster.member_name(member));
            let names: Vec<String> = names.map(str::to_owned).collect();
            let mut authority =
                Authority::init(&folder.folder, &cluster, now).map_err(|error| failed(&[error]))?;
            let operators = [DEFAULT_OPERATOR.to_owned()];
            let issued = authority.issue(&cluster, &names, operators[..].into(), days.days, now);
            let issued = issued.map_err(|errors| failed(&errors))?;
            Ok((issued, without_address(&cluster, &names)))
        }),
        What::Issue {
            cluster,
            names,
            operator,
            address,
            folder,
            days,
        } => read(cluster).and_then(|cluster| {
            let mut authority = open(folder)?;
            let operators = Operators {
                names: operator,
                address: *address,
            };
            let issued = authority.issue(&cluster, names, operators, days.days, now);
            let issued = issued.map_err(|errors| failed(&errors))?;
            Ok((issued, without_address(&cluster, names)))
        }),
        What::List { folder } => {
            return match open(folder) {
                Ok(authority) => listed(&authority.register().holders, now),
                Err(answer) => answer,
            };
        }
        What::Revoke { names, folder } => open(folder).and_then(|mut authority| {
            let revoked = authority.revoke(names, now);
            let revoked = revoked.map_err(|errors| failed(&errors))?;
            Ok((revoked, Vec::new()))
        }),
    };
    match done {
        Ok((issued, without_address)) => {
            let has_addresses = without_address.is_empty();
            let answer = changed(&issued, without_address, now);
            match &arguments.what {
                What::Init {
                    cluster, folder, ..
                } if has_addresses => with_doctor(answer, cluster, &folder.folder, &issued),
                What::Init { cluster, .. } => answer.and_next(&[&"lab", cluster]),
                _ => answer,
            }
        }
        Err(answer) => answer,
    }
}

/// What is run on the machine of the first member.
fn with_doctor(answer: Answer, cluster: &Path, folder: &Path, issued: &Issued) -> Answer {
    let Some(member) = issued.holders.iter().find(|it| it.role == Role::Member) else {
        return answer;
    };
    let keys = folder.join("members").join(&member.name);
    answer.and_next(&[
        &"doctor",
        &cluster,
        &"--name",
        &member.name,
        &"--keys",
        &keys,
    ])
}

fn read(path: &Path) -> Result<Cluster, Answer> {
    files::cluster(path, Overrides::default()).map(|(cluster, _)| cluster)
}

fn open(folder: &FolderArgument) -> Result<Authority, Answer> {
    Authority::open(&folder.folder).map_err(|errors| failed(&errors))
}

/// All of them; where something could not be written a run has failed, and otherwise an input was wrong.
pub(crate) fn failed(errors: &[KeysError]) -> Answer {
    let writing = |error: &KeysError| {
        matches!(
            error,
            KeysError::Write { .. } | KeysError::Certificate { .. }
        )
    };
    let status = if errors.iter().any(writing) {
        Status::Failed
    } else {
        Status::BadInput
    };
    let answer = Answer::done("", serde_json::Value::Null).with_status(status);
    errors.iter().fold(answer, |answer, error| {
        answer.and_failure(status, error.code(), error.to_string())
    })
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
    /// Those that changed.
    folders: Vec<String>,
    /// Members whose certificates are for 127.0.0.1.
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
    let mut text = format!(
        "{:width$}  role      generation  expires               state\n",
        "name"
    );
    for holder in holders {
        let shown = shown(holder, now);
        let role = match shown.role {
            Role::Member => "member",
            Role::Operator => "operator",
        };
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

/// Members that the cluster file gives no address, and whose certificates are therefore for 127.0.0.1.
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
    text.push_str(
        "\nthese folders changed; copy each to the machine of its member, and to nobody else:\n",
    );
    for folder in &folders {
        let _ = writeln!(text, "  {folder}");
    }
    let list = List {
        holders: issued
            .holders
            .iter()
            .map(|holder| shown(holder, now))
            .collect(),
        folders,
        without_address,
    };
    Answer::done(text, list)
}
