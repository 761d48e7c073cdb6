//! `understudy measure`: MTTF measured with the real protocol, compared with the model.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::{Duration, SystemTime};

use clap::Args;
use understudy_campaigns::{
    Measured, Planned, Question, QuestionError, RealCampaign, SpareTimes, Speed,
    hold_against_model, measure_shared, plan_campaign, run_campaign, run_real_campaign,
};
use understudy_cluster::Cluster;
use understudy_cycle::Mode;
use understudy_processes::{LaboratoryError, Progress};
use understudy_reliability::{Hours, Options};

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::files;
use crate::overrides::OverrideArguments;
use crate::reliability::prediction::{MeanTimes, Times, refused, write_report};
use crate::run::lab::{NetworkArguments, laboratory_settings};
use crate::run::simulate::seed_of_the_clock;

/// Maximum time limit of a campaign on processes.
const LONGEST_LIMIT: Duration = Duration::from_secs(365 * 24 * 3600);

/// Measure the MTTF by random failures and compare it with the model
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy measure examples/press-cell/cluster.toml --mtbf 25h --mttr 30min --failures 200 --seed 1
  understudy measure examples/press-cell/cluster.toml --real --mtbf 3s --mttr 200ms --failures 5
  understudy measure examples/twin-remote-io/cluster.toml --mtbf 30s --mttr 3s --remote-io 30s,3s --network 60s,3s --failures 60
  understudy measure examples/shared-spare/line-1/cluster.toml --groups 2 --mtbf 10000s --mttr 1000s --cycles-per-mttr 2000 --failures 20

Stations fail and are repaired at random until the system fails. The protocol itself is not accelerated: its time to detect a failure and to
transfer states is measured and added to the repair time of the model, and the resulting bias is printed. The system fails when a remote
I/O becomes fail-safe because no station holds the state of its program; in paper mode, at the second failure. Equal arguments and seeds
give equal simulated campaigns.

With --remote-io and --network, remote I/Os with their twins and networks fail too: the system has failed as well when a program has no remote I/O
that drives, and when no network is left.

With --groups N, copies of the cluster share as many spares as it has slots (`spare = true`), which wake by their rule
(docs/how-to/spares.md).

Exit status: 1 if the model is outside of the 95 % confidence interval, as happens to a correct model in one of twenty campaigns.")]
pub(crate) struct Arguments {
    /// Cluster file
    #[arg(value_name = "CLUSTER.toml")]
    cluster: PathBuf,
    /// MTBF of a station
    #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
    mtbf: String,
    /// MTTR of a station, from the detection of the failure
    #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
    mttr: String,
    /// MTBF and MTTR of a remote I/O, which fails and is repaired too; without them remote I/Os do not fail
    #[arg(long, value_name = "MTBF,MTTR", allow_hyphen_values = true, conflicts_with_all = ["real", "groups", "crews"])]
    remote_io: Option<String>,
    /// MTBF and MTTR of a network, which fails and is repaired too; without them networks do not fail
    #[arg(long, value_name = "MTBF,MTTR", allow_hyphen_values = true, conflicts_with_all = ["real", "groups", "crews"])]
    network: Option<String>,
    /// Number of repair crews; default: one per station
    #[arg(long, value_name = "R")]
    crews: Option<u32>,
    /// Number of system failures to measure
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u64).range(2..=1_000_000))]
    failures: u64,
    /// Seed of all random numbers; the default is taken from the clock and printed
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Acceleration of failures and repairs; default: a mean repair takes 50 cycles, maximum 10,000
    #[arg(
        long,
        value_name = "FACTOR",
        conflicts_with = "cycles_per_mttr",
        allow_hyphen_values = true
    )]
    acceleration: Option<f64>,
    /// Acceleration, as the number of cycles of a mean repair
    #[arg(long, value_name = "CYCLES", allow_hyphen_values = true)]
    cycles_per_mttr: Option<f64>,
    /// Number of groups, each a copy of the cluster, that share the spares of its slots
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100), conflicts_with_all = ["real", "crews", "report"])]
    groups: Option<u32>,
    /// Cycles for which a station must be flagged before a spare wakes
    #[arg(long, value_name = "N", default_value_t = 50, value_parser = clap::value_parser!(u32).range(1..=100_000), requires = "groups")]
    spare_after: u32,
    /// Kill (kill -9) and restart processes of this machine instead of simulated stations; Ctrl-C ends the measurement with partial results
    #[arg(long)]
    real: bool,
    /// Maximum run time
    #[arg(
        long,
        value_name = "TIME",
        default_value = "10min",
        requires = "real",
        allow_hyphen_values = true
    )]
    limit: String,
    /// Directory for the journals of the processes
    #[arg(long, value_name = "DIR", default_value = "runs", requires = "real")]
    out: PathBuf,
    /// Allow an acceleration of more than 10,000 and run times of hours
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    overrides: OverrideArguments,
    /// Output folder for reliability.html, .json and .csv
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Result<Answer, Answer> {
    let mut times = Times::default();
    let mtbf = times.required("mtbf", Some(&arguments.mtbf));
    let mttr = times.required("mttr", Some(&arguments.mttr));
    let limit = times.required("limit", Some(&arguments.limit));
    let mut part = |name, text: &Option<String>| {
        let read = times.parsed::<MeanTimes>(name, text.as_slice()).pop();
        read.map(|MeanTimes { mtbf, mttr }| (mtbf, mttr))
    };
    let remote_io = part("remote-io", &arguments.remote_io);
    let network = part("network", &arguments.network);
    let (cluster, reports) = files::cluster(&arguments.cluster, arguments.overrides.overrides())?;
    // Invalid crews and invalid times are reported together.
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
        remote_io,
        network,
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
    if let Some(groups) = arguments.groups {
        return with_spares(arguments, &cluster, &planned, groups, console);
    }
    let (measured, run) = if arguments.real {
        on_processes(arguments, &cluster, &planned, limit, console)?
    } else {
        (in_the_simulator(&cluster, &planned, console)?, None)
    };
    let found =
        hold_against_model(&cluster, &planned, measured).map_err(|errors| refused(&errors))?;
    let status = if found.is_met() { Status::Done } else { Status::Failed };
    let mut answer =
        Answer::done(found.to_text(), &found).with_used(reports).with_status(status).and_next(&[
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
            answer = answer.and_failure(Status::Failed, failure.code(), &failure);
        }
    }
    if let Some(folder) = &arguments.report {
        let written =
            write_report(folder, &planned.options, Some(&cluster), Some(found.assessment));
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

/// Cycles for which a group must be complete before its spare retires: the model has it free at once.
const RETIRE_AFTER: u32 = 10;

/// Groups that share spares.
fn with_spares(
    arguments: &Arguments,
    cluster: &Cluster,
    planned: &Planned,
    groups: u32,
    console: &mut Console,
) -> Result<Answer, Answer> {
    if cluster.agreement().schedule.spare_slots().is_empty() || cluster.lasting_understudies() != 1
    {
        let message = "--groups is for a cluster with one understudy and a slot (`spare = true`)";
        return Err(Answer::failed(Status::BadInput, "U0600", message));
    }
    if cluster.agreement().mode == Mode::Paper {
        let message = "--groups is for mode `full`: in mode `paper` a spare masks nothing";
        return Err(Answer::failed(Status::BadInput, "U0600", message));
    }
    planned.check_length().map_err(|error| not_begun(&[error]))?;
    let times = SpareTimes { spare_after: arguments.spare_after, retire_after: RETIRE_AFTER };
    let of = planned.plan.failures;
    let found = measure_shared(cluster, planned, groups, times, &mut |done| {
        console.show(&Progress::Failure { done, of });
    });
    console.show(&Progress::Ending);
    let found = found.map_err(|error| Answer::failed(Status::Failed, "U0530", error))?;
    let found = found.map_err(|errors| refused(&errors))?;
    let status = if found.is_met() { Status::Done } else { Status::Failed };
    Ok(Answer::done(found.to_text(), &found).with_status(status))
}

fn in_the_simulator(
    cluster: &Cluster,
    planned: &Planned,
    console: &mut Console,
) -> Result<Measured, Answer> {
    planned.check_length().map_err(|error| not_begun(&[error]))?;
    let of = planned.plan.failures;
    let measured = run_campaign(cluster, &planned.plan, &mut |done| {
        console.show(&Progress::Failure { done, of });
    });
    console.show(&Progress::Ending);
    measured.map_err(|error| Answer::failed(Status::Failed, "U0530", error))
}

/// Directory of the journals of a campaign on processes, and the reason of an early end.
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
        .map_err(files::unwritable_run)?;
    match (run.measured, run.failure) {
        (Some(measured), failure) => Ok((measured, Some((run.directory, failure)))),
        (None, Some(failure)) => Err(failed(failure.code(), failure.to_string())),
        (None, None) => Err(failed(
            "U0531",
            "ended before all members were synchronised: nothing was measured".to_owned(),
        )),
    }
}

fn not_begun(errors: &[QuestionError]) -> Answer {
    errors.iter().fold(Answer::done("", ()).with_status(Status::BadInput), |answer, error| {
        answer.and_failure(Status::BadInput, error.code(), error)
    })
}
