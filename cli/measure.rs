//! `understudy measure`: how long it works until a program is lost, measured on the real protocol, beside what is calculated.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use serde::Serialize;
use understudy_cluster::Cluster;
use understudy_reliability::{
    AccelerationBias, Assessment, Hours, Interval, MAXIMUM_ACCELERATION, Options, System,
    acceleration_bias, assess, grouped,
};
use understudy_scenarios::{CampaignPlan, Measured, run_campaign};
use understudy_wire::Mode;

use crate::answer::{Answer, Status};
use crate::files;
use crate::overrides::OverrideArguments;
use crate::reliability::{Times, boxes, refused, write_report};
use crate::simulate::seed_of_the_clock;

/// Of all intervals.
const CONFIDENCE: f64 = 0.95;

/// Cycles of a mean repair, where the command line does not say.
const CYCLES_OF_A_REPAIR: f64 = 50.0;

/// Cycles of a campaign, at most: above, more than an hour.
const MAXIMUM_CAMPAIGN_CYCLES: f64 = 1e9;

/// A replica that takes so many times its expectation is given up.
const PATIENCE: f64 = 1000.0;

/// Let stations fail and be repaired by chance, in the simulator, until the system fails, and hold the MTTF against the model
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy measure examples/press-cell/cluster.toml --mtbf 25h --mttr 30min --failures 200 --seed 1 --force

The protocol is the real one and its detection is not accelerated: the bias of that is calculated and printed. The system
fails where a remote I/O comes to its fail-safe because nobody holds its program's state; in the paper's mode, at the second
failure. Equal arguments and seeds give equal campaigns. Exit status 1 when the model lies outside of the 95 % interval, which
one campaign in twenty does by chance.")]
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
    /// Accelerate more than 10,000 times, and run for hours
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    overrides: OverrideArguments,
    /// A folder for reliability.html, .json and .csv
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
}

#[derive(Debug, Serialize)]
struct Found<'a> {
    /// The campaign.
    plan: CampaignPlan,
    /// Cycles that were run.
    cycles: u64,
    detection_cycles: Option<f64>,
    reentry_cycles: Option<f64>,
    /// MTTF by the model without detection and re-entry, in hours.
    mttf_closed_form_hours: f64,
    /// What the protocol's own time does to the MTTF, in the plant and in the campaign.
    bias: AccelerationBias,
    assessment: &'a Assessment,
    violations: &'a [String],
}

pub(crate) fn run(arguments: &Arguments) -> Answer {
    measured(arguments).unwrap_or_else(|answer| answer)
}

fn measured(arguments: &Arguments) -> Result<Answer, Answer> {
    let mut times = Times::default();
    let mtbf = times.required("mtbf", Some(&arguments.mtbf));
    let mttr = times.required("mttr", Some(&arguments.mttr));
    let (cluster, reports) = files::cluster(&arguments.cluster, arguments.overrides.overrides())?;
    times.finish(Vec::new())?;
    let (Some(mtbf), Some(mttr)) = (mtbf, mttr) else {
        return Err(refused(&[]));
    };
    let mut options = Options::new(0, mtbf, mttr);
    (options.controllers, options.spares) = boxes(&cluster);
    let system = options.system().map_err(|errors| refused(&errors))?;
    let system = match cluster.agreement().mode {
        Mode::Full => system,
        Mode::Paper => system.as_paper(),
    };
    let mttf = system
        .chain()
        .and_then(|chain| chain.mttf().map_err(|error| vec![error]))
        .map_err(|errors| refused(&errors))?;
    let period_hours = cluster.agreement().schedule.period().as_secs_f64() / 3600.0;
    let factor = factor(arguments, mttr, period_hours);
    let cycles = |hours: f64| hours / factor / period_hours;
    let period = Hours::new("the period", period_hours).map_err(|error| refused(&[error]))?;
    acceleration_bias(&system, period, factor, arguments.force)
        .map_err(|errors| refused(&errors))?;
    let expected = cycles(mttf) * arguments.failures as f64;
    if expected > MAXIMUM_CAMPAIGN_CYCLES && !arguments.force {
        let message = format!(
            "this campaign needs about {} cycles, and more than {} take hours; ask for fewer failures, \
             accelerate more, or take an MTBF nearer to the MTTR (force it if that is wanted)",
            grouped(expected),
            grouped(MAXIMUM_CAMPAIGN_CYCLES)
        );
        return Err(Answer::failed(Status::BadInput, "U0609", message));
    }
    let plan = CampaignPlan {
        mtbf_cycles: cycles(mtbf.get()),
        mttr_cycles: cycles(mttr.get()),
        acceleration: factor,
        failures: arguments.failures,
        seed: arguments.seed.unwrap_or_else(seed_of_the_clock),
        maximum_cycles: (PATIENCE * cycles(mttf)).max(PATIENCE) as u64,
        threads: std::thread::available_parallelism().map_or(1, usize::from),
    };
    let measured = run_campaign(&cluster, &plan)
        .map_err(|error| Answer::failed(Status::Failed, "U0530", error.to_string()))?;
    // Nobody can be relied on before its failure is seen, nor before it is in step again: both are the protocol's own time.
    let own_cycles =
        measured.detection_cycles.unwrap_or(0.0) + measured.reentry_cycles.unwrap_or(0.0);
    let own = Hours::new(
        "the time of the protocol",
        own_cycles.max(1e-3) * period_hours,
    )
    .map_err(|error| refused(&[error]))?;
    let bias = acceleration_bias(&system, own, factor, arguments.force)
        .map_err(|errors| refused(&errors))?;
    let mut campaigned = system.clone();
    campaigned.detection = Hours::new("the time of the protocol", own.get() * factor)
        .map(Some)
        .map_err(|error| refused(&[error]))?;
    let assessment = assess(&measured.campaign, &campaigned, CONFIDENCE, plan.seed)
        .map_err(|errors| refused(&errors))?;
    let found = Found {
        plan,
        cycles: measured.cycles,
        detection_cycles: measured.detection_cycles,
        reentry_cycles: measured.reentry_cycles,
        mttf_closed_form_hours: mttf,
        bias,
        assessment: &assessment,
        violations: &measured.violations,
    };
    let mut text = text(&cluster, &found, &measured, &system);
    let met = assessment.agrees && measured.violations.is_empty();
    let status = if met { Status::Done } else { Status::Failed };
    let answer = Answer::done("", &found)
        .with_reports(reports)
        .with_status(status);
    if let Some(folder) = &arguments.report {
        options.detection = campaigned.detection;
        match write_report(folder, &options, Some(&cluster), Some(assessment)) {
            Ok(said) => text.push_str(&said),
            Err(failed) => {
                let failures = failed.failures.iter();
                return Ok(failures.fold(Answer { text, ..answer }, |answer, failure| {
                    answer.and_failure(Status::Failed, &failure.code, &failure.message)
                }));
            }
        }
    }
    Ok(Answer { text, ..answer })
}

/// How many times faster than the plant.
fn factor(arguments: &Arguments, mttr: Hours, period_hours: f64) -> f64 {
    let by_cycles = |cycles: f64| mttr.get() / (cycles * period_hours);
    match (arguments.acceleration, arguments.cycles_per_mttr) {
        (Some(factor), _) => factor,
        (None, Some(cycles)) => by_cycles(cycles),
        (None, None) => by_cycles(CYCLES_OF_A_REPAIR).clamp(1.0, MAXIMUM_ACCELERATION),
    }
}

fn text(cluster: &Cluster, found: &Found<'_>, measured: &Measured, system: &System) -> String {
    let assessment = found.assessment;
    let mode = match cluster.agreement().mode {
        Mode::Full => "full",
        Mode::Paper => "paper",
    };
    let mut text = format!(
        "seed {}\n{} failures of {} (mode {mode}) in {} simulated cycles, {} times faster than the plant: \
         MTBF {} cycles, MTTR {} cycles\n\n",
        found.plan.seed,
        assessment.failures,
        cluster.name(),
        found.cycles,
        grouped(found.plan.acceleration),
        grouped(found.plan.mtbf_cycles),
        grouped(found.plan.mttr_cycles),
    );
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<34} {value}");
    };
    line(
        "MTTF measured, 95 % interval",
        said(&assessment.mttf_hours, " h"),
    );
    let verdict = if assessment.agrees {
        "inside"
    } else {
        "OUTSIDE"
    };
    line(
        "  calculated for this campaign",
        format!("{} h, {verdict}", grouped(assessment.model_hours)),
    );
    line(
        "  without the protocol's own time",
        format!("{} h", grouped(found.mttf_closed_form_hours)),
    );
    line(
        "  in the plant, not accelerated",
        format!(
            "{} h; acceleration biases by {:.2} %",
            grouped(found.bias.true_hours),
            100.0 * found.bias.relative
        ),
    );
    if let Some(coverage) = &assessment.coverage {
        line(
            "failures masked",
            format!(
                "{} of {}, coverage {}",
                measured.campaign.masked,
                measured.campaign.box_failures,
                said(coverage, "")
            ),
        );
    }
    let cycles = |cycles: Option<f64>| {
        cycles.map_or("none".to_owned(), |cycles| format!("{cycles:.3} cycles"))
    };
    line("detected after", cycles(found.detection_cycles));
    line(
        "in step again after the restart",
        cycles(found.reentry_cycles),
    );
    if let Some(repair) = &assessment.repair_hours {
        let given = grouped(system.understudies.mttr.get());
        line(
            "repaired after",
            format!("{}, drawn from {given} h", said(repair, " h")),
        );
    }
    if let Some(fit) = &assessment.fit {
        line(
            "fit to the law of the model",
            format!("p = {:.3} (Anderson-Darling)", fit.anderson_darling_p),
        );
    }
    if assessment.censored > 0 {
        line("given up", format!("{} replicas", assessment.censored));
    }
    text.push_str("\ncauses\n");
    for (cause, count) in &assessment.causes {
        let _ = writeln!(text, "  {cause:<32} {count}");
    }
    for doubt in &assessment.doubts {
        let _ = writeln!(text, "DOUBT: {doubt}");
    }
    for violation in measured.violations.iter().take(5) {
        let _ = writeln!(text, "VIOLATION: {violation}");
    }
    text
}

fn said(interval: &Interval, unit: &str) -> String {
    let number = |value: Option<f64>| value.map_or("unknown".to_owned(), grouped);
    format!(
        "{}{unit} ({} to {})",
        number(interval.estimate),
        grouped(interval.lower),
        number(interval.upper)
    )
}
