//! `understudy allocate`: selection of controllers for programs.

mod plant;
pub(crate) mod programs;
mod verified;

use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use understudy_allocation::{
    Allocation, FamilyQuantity, Item, MOST_RESERVE_PERCENT, Options, Preference, Provenance,
    Requirement, Stock, Terms, allocate, csv, html, text,
};
use understudy_journal::time_name;
use understudy_text::duration::parse_positive;

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::deployment::catalogue;
use crate::files;
use crate::inspect::plant::is_plant;
use crate::patience::Patience;
use crate::run::outcome::command_line;
use programs::Programs;

/// Select controllers for programs, understudies and remote I/Os
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy allocate examples/press-cell/cluster.toml
  understudy allocate examples/press-cell/cluster.toml --reserve 20% --prefer speed --report plan
  understudy allocate examples/press-cell/robot.ladder examples/press-cell/press.ladder --io local --stock \"CPU 1214C=2\"
  understudy allocate examples/boiler/complete.ladder --budget 20s
  understudy allocate examples/shared-spare/plant.toml
  understudy allocate examples/press-cell/press.ladder --require \"vendor=Siemens\" --require \"inputs>=12\"

A controller is suitable, unsuitable or unknown: an unknown figure never counts as sufficient. Programs are placed only after they have been
verified. Calculation of requirements and placement: docs/how-to/allocation.md. The stations, understudies and spares of a plant file are placed
on its machines, so that no machine, rack, feeder or switch takes two of one group.

Exit status: 0 if every program has a controller, 1 if one has none, 2 for invalid input.")]
pub(crate) struct Arguments {
    /// Ladder programs, cluster files, or one plant file
    #[arg(value_name = "PROGRAM", required = true)]
    programs: Vec<PathBuf>,
    /// Location of the I/O terminals; default: remote for a cluster or several programs, local for one program
    #[arg(long, value_enum)]
    io: Option<Io>,
    /// Number of understudies, without a cluster file
    #[arg(long, value_name = "NUMBER", default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=8))]
    understudies: u8,
    /// Scan period, without a cluster file. Default: that of the files, else 10ms
    #[arg(long, value_name = "TIME", value_parser = parse_positive)]
    period: Option<Duration>,
    /// Requirement, such as inputs>=24, languages~ladder, vendor=Siemens, remote-io:ethernet; repeatable
    #[arg(long, value_name = "WHAT")]
    require: Vec<String>,
    /// Selection criterion among suitable controllers
    #[arg(long, value_enum, default_value = "cost")]
    prefer: Prefer,
    /// Reserve of every capacity
    #[arg(long, value_name = "PERCENT", default_value = "0%", value_parser = reserve)]
    reserve: u8,
    /// Add expansion modules of the catalogue where on-board terminals or memory are insufficient
    #[arg(long)]
    expansion: bool,
    /// Assumed value of a figure unknown for a family, such as program_bytes_per_instruction=8; repeatable
    #[arg(long, value_name = "FIGURE=NUMBER", value_parser = assumption)]
    assume: Vec<(FamilyQuantity, u64)>,
    /// Allow programs of one group on one controller; its failure then affects several programs
    #[arg(long)]
    share_members: bool,
    /// Restrict the selection to this stock; repeatable
    #[arg(long, value_name = "MODEL=COUNT", value_parser = stock)]
    stock: Vec<Stock>,
    /// Properties to prove about a program before it is placed; repeatable
    #[arg(long, value_name = "PROGRAM=FILE", value_parser = properties)]
    properties: Vec<(String, PathBuf)>,
    /// Time limit for proofs; a program with undecided properties is not placed
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = parse_positive)]
    budget: Duration,
    /// Place programs without verification
    #[arg(long)]
    unverified: bool,
    /// Catalogue file; default: the built-in catalogue
    #[arg(long, value_name = "FILE")]
    catalogue: Option<PathBuf>,
    /// List every controller
    #[arg(long)]
    all: bool,
    /// Output folder for allocation.html and allocation.csv
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Io {
    /// At the controllers, without an understudy
    Local,
    /// At remote I/Os, which reconstruct lost outputs
    Remote,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Prefer {
    /// Lowest price; without known prices, the smallest sufficient controller
    Cost,
    /// Smallest sufficient program memory
    Memory,
    /// Shortest instruction time
    Speed,
    /// Largest minimum margin
    Reserve,
}

fn reserve(text: &str) -> Result<u8, String> {
    let number = text.strip_suffix('%').unwrap_or(text).trim();
    let percent = number.parse().ok();
    percent.filter(|percent| *percent <= MOST_RESERVE_PERCENT).ok_or_else(|| {
        format!("{text:?} is not a percentage: expected 0% to {MOST_RESERVE_PERCENT}%")
    })
}

fn assumption(text: &str) -> Result<(FamilyQuantity, u64), String> {
    let (name, value) = text.split_once('=').unwrap_or((text, ""));
    let known = FamilyQuantity::ALL.into_iter();
    let Some(quantity) =
        known.into_iter().find(|known| known.name() == name.trim().replace('-', "_"))
    else {
        let names = FamilyQuantity::ALL.map(FamilyQuantity::name).join(", ");
        return Err(format!("`{name}` is not a figure of a family; known figures: {names}"));
    };
    let value = FamilyQuantity::parse(value.trim());
    value.map(|value| (quantity, value)).ok_or_else(|| format!("expected {quantity}=NUMBER"))
}

fn stock(text: &str) -> Result<Stock, String> {
    let (name, count) = text.rsplit_once('=').ok_or("expected MODEL=COUNT")?;
    let count = count.trim().parse().ok().filter(|count| *count <= 1000);
    Ok(Stock {
        name: name.trim().to_owned(),
        count: count.ok_or("expected a number of controllers up to 1000 after the =")?,
    })
}

fn properties(text: &str) -> Result<(String, PathBuf), String> {
    let (name, file) = text.split_once('=').ok_or("expected PROGRAM=FILE")?;
    Ok((name.trim().to_owned(), PathBuf::from(file.trim())))
}

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Result<Answer, Answer> {
    if let Some(path) = arguments.programs.iter().find(|path| is_plant(path)) {
        return plant::place(arguments, path);
    }
    let mut options = options(arguments)?;
    let programs = Programs::read(&arguments.programs, arguments.period)?;
    options.networks = programs.networks();
    let (catalogue, about) = catalogue::read(arguments.catalogue.as_deref())?;
    let patience = Patience::new(Some(arguments.budget), console);
    let items = items(arguments, &programs, &patience)?;
    let found = allocate(&catalogue, &items, &options).map_err(|errors| {
        errors.iter().fold(Answer::done("", Value::Null), |answer, error| {
            answer.and_failure(Status::BadInput, error.code(), message(error))
        })
    })?;
    let mut answer_text = text(&found, arguments.all);
    if let Some(folder) = &arguments.report {
        let page = write_report(folder, &found, &options.terms, &programs.title(), about)?;
        answer_text.push_str(&format!("report: {page}\n"));
    }
    let status = if found.is_complete() { Status::Done } else { Status::Failed };
    let answer = Answer::done(answer_text, json!(found)).with_status(status);
    Ok(answer.with_used(programs.reports))
}

impl Arguments {
    /// Whether an option of the selection of controllers is given.
    fn selects_controllers(&self) -> bool {
        let lists = [
            self.require.is_empty(),
            self.assume.is_empty(),
            self.stock.is_empty(),
            self.properties.is_empty(),
        ];
        let flags = [self.expansion, self.share_members, self.unverified, self.all];
        lists.contains(&false)
            || flags.contains(&true)
            || self.reserve != 0
            || self.io.is_some()
            || self.period.is_some()
            || self.catalogue.is_some()
            || self.report.is_some()
    }
}

/// Text of an error without its code.
pub(crate) fn message(error: &impl std::fmt::Display) -> String {
    let text = error.to_string();
    let message = text.split_once(": ").map(|(_, message)| message.to_owned());
    message.unwrap_or(text)
}

fn options(arguments: &Arguments) -> Result<Options, Answer> {
    let mut wrong = Answer::done("", Value::Null);
    let mut requirements = Vec::new();
    for text in &arguments.require {
        match Requirement::parse(text) {
            Ok(requirement) => requirements.push(requirement),
            Err(error) => {
                wrong = wrong.and_failure(Status::BadInput, "U1130", message(&error));
            }
        }
    }
    if !wrong.failures.is_empty() {
        return Err(wrong);
    }
    Ok(Options {
        terms: Terms {
            reserve_percent: arguments.reserve,
            expansion: arguments.expansion,
            requirements,
            assumptions: arguments.assume.iter().copied().collect(),
        },
        preference: match arguments.prefer {
            Prefer::Cost => Preference::Cost,
            Prefer::Memory => Preference::Memory,
            Prefer::Speed => Preference::Speed,
            Prefer::Reserve => Preference::Reserve,
        },
        share_members: arguments.share_members,
        unverified: arguments.unverified,
        stock: arguments.stock.clone(),
        networks: 0,
    })
}

/// Controllers required by the programs, with the results of the proofs.
fn items(
    arguments: &Arguments,
    programs: &Programs,
    patience: &Patience<'_>,
) -> Result<Vec<Item>, Answer> {
    let alone = programs.groups.len() == 1
        && programs.groups[0].cluster.is_none()
        && programs.groups[0].members.len() == 1;
    let io = arguments.io.unwrap_or(if alone { Io::Local } else { Io::Remote });
    let asked = verified::asked(&arguments.properties, programs)?;
    let mut items = Vec::new();
    for (number, group) in programs.groups.iter().enumerate() {
        let members = verified::members(group, &asked, patience)?;
        if io == Io::Local {
            items.extend(members.iter().map(understudy_allocation::alone));
        } else {
            let group = verified::group(group, members, arguments.understudies, patience)?;
            items.extend(group.items(number));
        }
    }
    Ok(items)
}

/// Writes the page and the table; returns the name of the page.
fn write_report(
    folder: &Path,
    found: &Allocation,
    terms: &Terms,
    title: &str,
    catalogue: String,
) -> Result<String, Answer> {
    let about = Provenance {
        title: title.to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        date: time_name(SystemTime::now()),
        repeat: command_line(),
        catalogue,
    };
    let page = html(found, terms, &about);
    let page = page.map_err(|error| Answer::failed(Status::Failed, "U1141", message(&error)))?;
    files::make_folder(folder)?;
    let place = folder.join("allocation.html");
    files::write(&folder.join("allocation.csv"), &csv(found))?;
    files::write(&place, &page)?;
    Ok(place.display().to_string())
}
