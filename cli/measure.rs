//! `understudy measure`: how long it works until a program is lost, measured on the real protocol, beside what is calculated.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::{Duration, SystemTime};

use clap::Args;
use understudy_campaigns::{
    Measured, Planned, Question, QuestionError, RealCampaign, Speed, hold_against_model,
    plan_campaign, run_campaign, run_real_campaign,
};
use understudy_cluster::Cluster;
use understudy_processes::{LaboratoryError, Progress};
use understudy_reliability::{Hours, Options};

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::files;
use crate::lab::{NetworkArguments, laboratory_settings};
use crate::overrides::OverrideArguments;
use crate::reliability::{Times, refused, write_report};
use crate::simulate::seed_of_the_clock;

/// Of a campaign on processes: no clock holds all of a time that can be written.
const LONGEST_LIMIT: Duration = Duration::from_secs(365 * 24 * 3600);

/// Let stations fail and be repaired by chance, in the simulator or on processes, until the system fails, and hold the MTTF against the model
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy measure examples/press-cell/cluster.toml --mtbf 25h --mttr 30min --failures 200 --seed 1
  understudy measure examples/press-cell/cluster.toml --real --mtbf 3s --mttr 200ms --failures 5

The protocol is the real one and its own time is not accelerated: what it needs to detect a failure and to take over states is
measured, added to the repair in the model, and the bias of it is printed. The system fails where a remote I/O comes to its
fail-safe because nobody holds its program's state; in the paper's mode, at the second failure. Equal arguments and seeds give
equal campaigns in the simulator. Exit status 1 when the model lies outside of the 95 % interval, which one campaign in twenty
does by chance.")]
pub(crate) struct Arguments {
    /// The cluster file
    #[arg(value_name = "CLUSTER.toml")]
    cluster: PathBuf,
    /// Mean time between failures of a station
    #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
    mtbf: String,
    /// Mean time to repair a station, from the detection on
    #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
    mttr: String,
    /// Stations that are repaired at the same time, at most; by default a crew for each
    #[arg(long, value_name = "R")]
    crews: Option<u32>,
    /// Failures of the system to wait for
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u64).range(2..=1_000_000))]
    failures: u64,
    /// What all chance comes from; by default taken from the clock, and printed
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// How many times faster than the plant; by default so that a mean repair takes 50 cycles, but 10,000 at most
    #[arg(
        long,
        value_name = "FACTOR",
        conflicts_with = "cycles_per_mttr",
        allow_hyphen_values = true
    )]
    acceleration: Option<f64>,
    /// The same, said by the cycles that a mean repair takes
    #[arg(long, value_name = "CYCLES", allow_hyphen_values = true)]
    cycles_per_mttr: Option<f64>,
    /// Kill and restart processes of this machine (kill -9) in place of the simulator's stations; Ctrl-C ends it with what there is
    #[arg(long)]
    real: bool,
    /// Until when the processes run at most
    #[arg(
        long,
        value_name = "TIME",
        default_value = "10min",
        requires = "real",
        allow_hyphen_values = true
    )]
    limit: String,
    /// Where the journals of the processes are kept
    #[arg(long, value_name = "DIR", default_value = "runs", requires = "real")]
    out: PathBuf,
    /// Accelerate more than 10,000 times, and run for hours
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    overrides: OverrideArguments,
    /// A folder for reliability.html, .json and .csv
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Answer {
    measured(arguments, console).unwrap_or_else(|answer| answer)
}

fn measured(arguments: &Arguments, console: &mut Console) -> Result<Answer, Answer> {
    let mut times = Times::default();
    let mtbf = times.required("mtbf", Some(&arguments.mtbf));
    let mttr = times.required("mttr", Some(&arguments.mttr));
    let limit = times.required("limit", Some(&arguments.limit));
    let (cluster, reports) = files::cluster(&arguments.cluster, arguments.overrides.overrides())?;
    // What is wrong with the crews is said in the same run as what is wrong with a time.
    let any = Hours::new("any", 1.0).map_err(|error| refused(&[error]))?;
    let mut crewed = Options::new(1, any, any);
    crewed.crews = arguments.crews;
    times.finish(crewed.system().err().unwrap_or_default())?;
    let (Some(mtbf), Some(mttr), Some(limit)) = (mtbf, mttr, limit) else {
        return Err(refused(&[]));
    };
    let question = Question {
        mtbf,
        mttr,
        crews: arguments.crews,
        failures: arguments.failures,
        seed: arguments.seed.unwrap_or_else(seed_of_the_clock),
        speed: match (arguments.acceleration, arguments.cycles_per_mttr) {
            (Some(factor), _) => Speed::Factor(factor),
            (None, Some(cycles)) => Speed::CyclesPerRepair(cycles),
            (None, None) => Speed::Usual,
        },
        forced: arguments.force,
    };
    let planned = plan_campaign(&cluster, &question).map_err(|errors| not_begun(&errors))?;
    let (measured, run) = if arguments.real {
        on_processes(arguments, &cluster, &planned, limit, console)?
    } else {
        (in_the_simulator(&cluster, &planned, console)?, None)
    };
    let found =
        hold_against_model(&cluster, &planned, measured).map_err(|errors| refused(&errors))?;
    let status = if found.is_met() {
        Status::Done
    } else {
        Status::Failed
    };
    let mut answer = Answer::done(found.to_text(), &found)
        .with_used(reports)
        .with_status(status)
        .and_next(&[
            &"reliability",
            &arguments.cluster,
            &"--mtbf",
            &arguments.mtbf,
            &"--mttr",
            &arguments.mttr,
        ]);
    if let Some((directory, failure)) = run {
        let _ = writeln!(answer.text, "journals: {}", directory.display());
        if let Some(failure) = failure {
            answer = answer.and_failure(Status::Failed, failure.code(), failure.to_string());
        }
    }
    if let Some(folder) = &arguments.report {
        let written = write_report(
            folder,
            &planned.options,
            Some(&cluster),
            Some(found.assessment),
        );
        match written {
            Ok(said) => answer.text.push_str(&said),
            Err(failed) => {
                return Ok(failed.failures.iter().fold(answer, |answer, failure| {
                    answer.and_failure(Status::Failed, &failure.code, &failure.message)
                }));
            }
        }
    }
    Ok(answer)
}

fn in_the_simulator(
    cluster: &Cluster,
    planned: &Planned,
    console: &mut Console,
) -> Result<Measured, Answer> {
    planned
        .check_length()
        .map_err(|error| not_begun(&[error]))?;
    let of = planned.plan.failures;
    let measured = run_campaign(cluster, &planned.plan, &mut |done| {
        console.show(&Progress::Failure { done, of });
    });
    console.show(&Progress::Ending);
    measured.map_err(|error| Answer::failed(Status::Failed, "U0530", error.to_string()))
}

/// Where the journals of a campaign on processes lie, and why it ended early.
type OnProcesses = (PathBuf, Option<LaboratoryError>);

fn on_processes(
    arguments: &Arguments,
    cluster: &Cluster,
    planned: &Planned,
    limit: Hours,
    console: &mut Console,
) -> Result<(Measured, Option<OnProcesses>), Answer> {
    let real = RealCampaign {
        laboratory: laboratory_settings(
            cluster,
            arguments.cluster.clone(),
            &arguments.overrides,
            NetworkArguments::default().settings(),
        )?,
        out: arguments.out.clone(),
        now: SystemTime::now(),
        limit: Duration::from_secs_f64((limit.get() * 3600.0).min(LONGEST_LIMIT.as_secs_f64())),
    };
    let failed = |code: &str, message: String| Answer::failed(Status::Failed, code, message);
    let mut watch = |progress| console.show(&progress);
    let run = run_real_campaign(cluster, &planned.plan, &real, &mut watch)
        .map_err(|error| failed("U0602", error.to_string()))?;
    match (run.measured, run.failure) {
        (Some(measured), failure) => Ok((measured, Some((run.directory, failure)))),
        (None, Some(failure)) => Err(failed(failure.code(), failure.to_string())),
        (None, None) => Err(failed(
            "U0531",
            "it ended before everybody was synchronised: nothing was measured".to_owned(),
        )),
    }
}

fn not_begun(errors: &[QuestionError]) -> Answer {
    errors.iter().fold(
        Answer::done("", ()).with_status(Status::BadInput),
        |answer, error| answer.and_failure(Status::BadInput, error.code(), error.to_string()),
    )
}
