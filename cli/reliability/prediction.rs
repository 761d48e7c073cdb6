//! `understudy reliability`: MTTF, reliability and availability from Markov models.

mod cell;
mod shared;

use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use clap::{Args, ValueEnum};
use serde_json::{Map, Value, json};
use understudy_campaigns::{options_of, set_unequal};
use understudy_cluster::{Cluster, Overrides};
use understudy_journal::time_name;
use understudy_reliability::{
    Answer as Calculated, Assessment, Chain, CommonCauseConvention, ExportForm, Hours, Options,
    Provenance, ReliabilityError, SharedPart, UnequalBoxes, answer_chain, calculate, export_chain,
    export_properties, read_chain, report, report_data,
};
use understudy_text::Report;

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::files;
use crate::run::outcome::command_line;
use cell::CellArguments;
pub(crate) use cell::MeanTimes;

/// Calculate the MTTF of a cluster and compare other redundancy
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy reliability --controllers 20 --mtbf 10000h --mttr 24h --mission 1000h
  understudy reliability examples/press-cell/cluster.toml --mtbf 10000h --mttr 24h --report reliability
  understudy reliability --controllers 20 --mtbf 10000h --mttr 24h --box old*3=4000h,48h --shared power=200000h
  understudy reliability --controllers 4 --mtbf 10000h --mttr 24h --remote-io 20000h,24h --network 100000h,8h --twins 4 --networks 2
  understudy reliability --chain plant.chain --mission 1y
  understudy reliability --controllers 20 --mtbf 10000h --mttr 24h --mission 1000h --export cluster.prism

Units of time: us, ms, s, min, h, d, y. Models and assumptions: docs/reference/reliability.md.")]
pub(crate) struct Arguments {
    /// Cluster file; supplies the numbers of controllers and understudies
    #[arg(value_name = "CLUSTER.toml", conflicts_with_all = ["controllers", "spares", "chain"])]
    cluster: Option<PathBuf>,
    /// Number of controllers, N
    #[arg(long, value_name = "N", required_unless_present_any = ["cluster", "chain"])]
    controllers: Option<u32>,
    /// Number of understudies per group
    #[arg(long, value_name = "S", default_value_t = 1)]
    spares: u32,
    /// MTBF of a controller or understudy
    #[arg(
        long,
        value_name = "TIME",
        required_unless_present = "chain",
        allow_hyphen_values = true
    )]
    mtbf: Option<String>,
    /// MTTR of a controller or understudy
    #[arg(
        long,
        value_name = "TIME",
        required_unless_present = "chain",
        allow_hyphen_values = true
    )]
    mttr: Option<String>,
    /// Individual times: NAME=MTBF,MTTR for a station of the cluster file; without a file NAME*COUNT=... and understudies=...
    #[arg(long = "box", value_name = "BOX")]
    boxes: Vec<String>,
    /// Shared part whose failure fails the system, such as power=200000h
    #[arg(long, value_name = "NAME=MTBF")]
    shared: Vec<String>,
    #[command(flatten)]
    cell: CellArguments,
    /// Number of repair crews; default: one per station
    #[arg(long, value_name = "R")]
    crews: Option<u32>,
    /// Coverage c: probability that a failure is masked
    #[arg(long, value_name = "C", default_value_t = 1.0, allow_hyphen_values = true)]
    coverage: f64,
    /// Number of equal groups without a shared understudy
    #[arg(long, value_name = "G", default_value_t = 1)]
    groups: u32,
    /// Compare 0 to P spares that the groups share with hot-standby pairs
    #[arg(long, value_name = "P", conflicts_with_all = UNSHARED)]
    shared_spares: Option<u32>,
    /// Mean time from a failure to the first turn of the spare that wakes
    #[arg(
        long,
        value_name = "TIME",
        default_value = "1s",
        allow_hyphen_values = true,
        requires = "shared_spares"
    )]
    wake: String,
    /// Probability that a spare wakes
    #[arg(
        long,
        value_name = "C",
        default_value_t = 1.0,
        allow_hyphen_values = true,
        requires = "shared_spares"
    )]
    wake_coverage: f64,
    /// Number of the groups that are too large for the capacity of the spares
    #[arg(long, value_name = "G", default_value_t = 0, requires = "shared_spares")]
    too_large: u32,
    /// Mean time to detect a failure, before the repair starts
    #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
    detection: Option<String>,
    /// Common-cause factor beta: share of failures that affect all stations
    #[arg(long, value_name = "BETA", default_value_t = 0.0, allow_hyphen_values = true)]
    beta: f64,
    /// Convention for beta
    #[arg(long, value_enum, default_value = "additive")]
    convention: ConventionWord,
    /// Mission time
    #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
    mission: Option<String>,
    /// Analyse the Markov chain in this file instead of a cluster
    #[arg(long, value_name = "FILE", conflicts_with_all = ["controllers", "mtbf", "mttr", "report"])]
    chain: Option<PathBuf>,
    /// Output file for the Markov chain: .prism for PRISM and Storm, .drn for Storm; its questions go to a .props file of the same name
    #[arg(long, value_name = "FILE")]
    export: Option<PathBuf>,
    /// Output folder for reliability.html, .json and .csv
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
}

/// Options that the model of shared spares does not have.
const UNSHARED: [&str; 11] = [
    "spares",
    "boxes",
    "shared",
    "crews",
    "coverage",
    "detection",
    "beta",
    "mission",
    "chain",
    "export",
    "report",
];

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ConventionWord {
    /// Common-cause failures add to the failures of each station
    Additive,
    /// Common-cause failures are a share of the failures of each station
    Split,
}

pub(crate) fn run(arguments: &Arguments, console: &Console) -> Result<Answer, Answer> {
    match &arguments.chain {
        Some(path) => of_chain(path, arguments, console),
        None => of_cluster(arguments),
    }
}

fn of_chain(path: &Path, arguments: &Arguments, console: &Console) -> Result<Answer, Answer> {
    let mut times = Times::default();
    let mission = times.optional("mission", arguments.mission.as_deref());
    times.finish(Vec::new())?;
    let read = read_chain(&path.display().to_string(), files::text(path)?);
    let Some(chain) = read.chain else {
        return Err(Answer::bad_files(vec![read.report]));
    };
    let found = answer_chain(&chain, mission).map_err(|error| refused(&[error]))?;
    // A document of all states takes a hundred times the memory of the chain, and a text does not show it.
    let answer = if console.is_json() {
        Answer::done("", &found)
    } else {
        Answer::done(found.to_text(), json!(null))
    };
    exported(arguments, &chain, mission, answer.with_reports(vec![read.report]))
}

/// Writes the chain and its properties for a model checker, where that is asked for.
fn exported(
    arguments: &Arguments,
    chain: &Chain,
    mission: Option<Hours>,
    answer: Answer,
) -> Result<Answer, Answer> {
    let Some(path) = &arguments.export else {
        return Ok(answer);
    };
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let Some(form) = ExportForm::of(&ending) else {
        let message = format!("{}: chains are exported as .prism or .drn", path.display());
        return Err(Answer::failed(Status::BadInput, "U0653", message));
    };
    let properties = path.with_extension("props");
    files::write_output(path, &export_chain(chain, form))?;
    files::write_output(&properties, &export_properties(mission))?;
    Ok(answer.and_written(&properties).and_written(path))
}

fn of_cluster(arguments: &Arguments) -> Result<Answer, Answer> {
    let mut times = Times::default();
    let mtbf = times.required("mtbf", arguments.mtbf.as_deref());
    let mttr = times.required("mttr", arguments.mttr.as_deref());
    let detection = times.optional("detection", arguments.detection.as_deref());
    let mission = times.optional("mission", arguments.mission.as_deref());
    let boxes: Vec<UnequalBoxes> = times.parsed("box", &arguments.boxes);
    let shared: Vec<SharedPart> = times.parsed("shared", &arguments.shared);
    let cluster = match &arguments.cluster {
        Some(path) => Some(files::cluster(path, Overrides::default())?),
        None => None,
    };
    let parts = arguments.cell.read(&mut times);
    let options = |mtbf, mttr| {
        let mut options = match &cluster {
            Some((cluster, _)) => options_of(cluster, mtbf, mttr),
            None => {
                let mut options =
                    Options::new(arguments.controllers.unwrap_or_default(), mtbf, mttr);
                options.spares = arguments.spares;
                options
            }
        };
        options.groups = arguments.groups;
        options.crews = arguments.crews;
        options.coverage = arguments.coverage;
        options.detection = detection;
        options.beta = arguments.beta;
        options.convention = match arguments.convention {
            ConventionWord::Additive => CommonCauseConvention::Additive,
            ConventionWord::Split => CommonCauseConvention::Split,
        };
        options.mission = mission;
        options.shared.clone_from(&shared);
        options
    };
    // Other invalid options and invalid times are reported together.
    let any = Hours::new("any", 1.0).map_err(|error| refused(&[error]))?;
    let mut options = options(mtbf.unwrap_or(any), mttr.unwrap_or(any));
    parts.set(&arguments.cell, &mut options, cluster.as_ref().map(|read| &read.0));
    let mut wrong = set_unequal(&mut options, cluster.as_ref().map(|read| &read.0), boxes);
    wrong.extend(options.system().err().unwrap_or_default());
    times.finish(wrong)?;
    if let Some(most) = arguments.shared_spares {
        return shared::compared(arguments, &options, most);
    }
    let found = calculate(&options).map_err(|errors| refused(&errors))?;
    let (cluster, reports) =
        cluster.map_or((None, Vec::new()), |(cluster, reports)| (Some(cluster), reports));
    let mut text = found.to_text();
    if let Some(folder) = &arguments.report {
        text.push_str(&write_report(folder, &options, cluster.as_ref(), None)?);
    }
    let answer = calculated(text, &found, reports);
    let chain = || options.system().and_then(|system| system.chain());
    let answer = match arguments.export {
        Some(_) => {
            let chain = chain().map_err(|errors| refused(&errors))?;
            exported(arguments, &chain, options.mission, answer)?
        }
        None => answer,
    };
    Ok(match &arguments.cluster {
        Some(cluster) => answer.and_next(&[&"allocate", cluster]),
        None => answer,
    })
}

/// Answer whose numbers are also top-level keys of the document.
fn calculated(text: String, found: &Calculated, reports: Vec<Report>) -> Answer {
    let answer = Answer::done(text, found).with_reports(reports);
    let numbers: Map<String, Value> = answer
        .result
        .as_object()
        .into_iter()
        .flatten()
        .filter(|(_, value)| value.is_number())
        .map(|(name, value)| (name.clone(), value.clone()))
        .collect();
    answer.with_numbers(numbers)
}

/// Answer with all errors of a question.
pub(crate) fn refused(errors: &[ReliabilityError]) -> Answer {
    errors
        .iter()
        .fold(Answer::done("", json!(null)).with_status(Status::BadInput), |answer, error| {
            answer.and_failure(Status::BadInput, error.code(), error)
        })
}

/// Collects the errors of several times.
#[derive(Debug, Default)]
pub(crate) struct Times {
    wrong: Vec<(&'static str, String)>,
}

impl Times {
    pub(crate) fn required(&mut self, name: &str, text: Option<&str>) -> Option<Hours> {
        self.optional(name, Some(text.unwrap_or_default()))
    }

    pub(crate) fn optional(&mut self, name: &str, text: Option<&str>) -> Option<Hours> {
        match text?.parse::<Hours>() {
            Ok(hours) => Some(hours),
            Err(error) => {
                self.note(name, &error);
                None
            }
        }
    }

    /// Parses a repeatable option.
    pub(crate) fn parsed<T>(&mut self, name: &str, texts: &[String]) -> Vec<T>
    where
        T: std::str::FromStr<Err = ReliabilityError>,
    {
        let mut found = Vec::new();
        for text in texts {
            match text.parse() {
                Ok(value) => found.push(value),
                Err(error) => self.note(name, &error),
            }
        }
        found
    }

    fn note(&mut self, name: &str, error: &ReliabilityError) {
        let (code, message) = (error.code(), error.to_string());
        let message = message.strip_prefix(code).unwrap_or(&message);
        self.wrong.push((code, format!("--{name}{message}")));
    }

    /// # Errors
    /// If a time is invalid or `others` is not empty.
    pub(crate) fn finish(self, others: Vec<ReliabilityError>) -> Result<(), Answer> {
        if self.wrong.is_empty() && others.is_empty() {
            return Ok(());
        }
        let answer = Answer::done("", json!(null)).with_status(Status::BadInput);
        let answer = self.wrong.into_iter().fold(answer, |answer, (code, message)| {
            answer.and_failure(Status::BadInput, code, message)
        });
        Err(others.iter().fold(answer, |answer, error| {
            answer.and_failure(Status::BadInput, error.code(), error)
        }))
    }
}

/// Writes all files of the report to `folder`, or none; returns a line with its location.
pub(crate) fn write_report(
    folder: &Path,
    options: &Options,
    cluster: Option<&Cluster>,
    measured: Option<Assessment>,
) -> Result<String, Answer> {
    if folder.extension().is_some_and(|it| ["html", "json", "csv"].iter().any(|of| it == *of)) {
        let message = format!(
            "{} is to be a folder, into which reliability.html, .json and .csv are written: give a name without an ending, such as `{}`",
            folder.display(),
            folder.with_extension("").display()
        );
        return Err(Answer::failed(Status::BadInput, "U0602", message));
    }
    let title = cluster.map_or_else(
        || format!("{} controllers", options.controllers),
        |cluster| cluster.name().to_owned(),
    );
    let provenance = Provenance {
        title,
        configuration: cluster.map(|cluster| cluster.agreement().configuration.to_string()),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        date: time_name(SystemTime::now()),
        repeat: command_line(),
    };
    let data = report_data(options, provenance, measured).map_err(|errors| refused(&errors))?;
    let made = report(&data).map_err(|error| refused(&[error]))?;
    let failed = |path: &Path, error: std::io::Error| {
        let message = format!("{} cannot be written: {error}", path.display());
        Answer::failed(Status::Failed, "U0602", message)
    };
    fs::create_dir_all(folder).map_err(|error| failed(folder, error))?;
    let texts = [
        ("reliability.html", &made.html),
        ("reliability.json", &made.json),
        ("reliability.csv", &made.csv),
    ];
    // Temporary files first: a full disk leaves neither a partial nor a mixed report.
    let staged = |name: &str| folder.join(format!(".{name}.new"));
    let written = texts.iter().try_for_each(|(name, text)| {
        let path = staged(name);
        fs::write(&path, text).map_err(|error| failed(&path, error))
    });
    let moved = written.and_then(|()| {
        texts.iter().try_for_each(|(name, _)| {
            let path = folder.join(name);
            fs::rename(staged(name), &path).map_err(|error| failed(&path, error))
        })
    });
    if let Err(answer) = moved {
        for (name, _) in texts {
            let _ = fs::remove_file(staged(name));
        }
        return Err(answer);
    }
    let page = folder.join("reliability.html");
    Ok(format!("report: {}\n", page.display()))
}
