//! The report: everything as data, and one self-contained page of it that prints well.

use minijinja::value::Serde;
use minijinja::{Environment, Value, context};
use serde::Serialize;

use crate::answer::{Answer, calculate};
use crate::campaign::Assessment;
use crate::chain::Chain;
use crate::drawing::{Axis, Curve, Legend, Scale, curves, tornado};
use crate::error::ReliabilityError;
use crate::figures::{FigurePoint, figures_5_and_6};
use crate::graph::graph;
use crate::options::Options;
use crate::quantity::{grouped, probability};
use crate::sensitivity::{
    ByUnderstudies, Sensitivity, WhatIf, by_understudies, sensitivities, what_if,
};
use crate::system::System;
use crate::transient::AfterFailure;

const TEMPLATE: &str = include_str!("report.html");

/// Points of a curve over time.
const CURVE_POINTS: usize = 70;

/// N of figures 5 and 6.
const FIGURE_CONTROLLERS: std::ops::RangeInclusive<u32> = 1..=50;

/// Understudies in the table of what to buy, at most.
const MOST_UNDERSTUDIES: u32 = 3;

/// Data of a report that the caller provides.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Provenance {
    /// Title of the plant or the cluster.
    pub title: String,
    /// Hash of the cluster's configuration, where there is one.
    pub configuration: Option<String>,
    /// Version of the program.
    pub version: String,
    /// Date of the report, as the caller writes it.
    pub date: String,
    /// The command that makes it again.
    pub repeat: String,
}

/// Reliability and hazard over time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OverTime {
    /// Name of the configuration.
    pub name: String,
    /// Hours, R, and the hazard per hour.
    pub points: Vec<(f64, f64, f64)>,
}

/// Everything that the report says.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReportData {
    /// Version of this format: 1.
    pub format: u32,
    /// Origin of the report.
    pub provenance: Provenance,
    /// Mean times and reliabilities.
    pub answer: Answer,
    /// The model in full.
    pub system: System,
    /// States of its chain.
    pub states: usize,
    /// Assumptions of the model, as sentences.
    pub assumptions: Vec<String>,
    /// Sensitivities of the cluster, the widest bar first.
    pub sensitivities: Vec<Sensitivity>,
    /// Possible improvements.
    pub what_if: Vec<WhatIf>,
    /// MTTF by number of understudies.
    pub by_understudies: Vec<ByUnderstudies>,
    /// Figures 5 and 6.
    pub figures: Vec<FigurePoint>,
    /// Curves; one that would take too long is left out and named in `left_out`.
    pub over_time: Vec<OverTime>,
    /// Omitted parts with their reasons.
    pub left_out: Vec<String>,
    /// A campaign, where there was one.
    pub measured: Option<Assessment>,
}

/// The files of a report.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// `reliability.html`
    pub html: String,
    /// `reliability.json`
    pub json: String,
    /// `reliability.csv`: the figures and curves, one row for each point.
    pub csv: String,
}

/// Calculates the data of a report.
///
/// # Errors
/// Everything that is wrong with the options, or the first result that cannot be had.
pub fn report_data(
    options: &Options,
    provenance: Provenance,
    measured: Option<Assessment>,
) -> Result<ReportData, Vec<ReliabilityError>> {
    let answer = calculate(options)?;
    let system = options.system()?;
    let chain = system.chain()?;
    let longest =
        answer.mttf_cluster_hours.max(answer.mttf_duplex_hours).max(answer.mttf_paper_hours);
    let compared = [
        ("this cluster", system.chain()?),
        ("paper's model", system.as_paper().chain()?),
        ("full duplex", system.copies_chain(2)?),
        ("no spare", system.as_simplex().chain()?),
    ];
    let (mut over_time, mut left_out) = (Vec::new(), Vec::new());
    for (name, chain) in compared {
        match curve(&chain, answer.mttf_simplex_hours / 30.0, 3.0 * longest) {
            Ok(points) => over_time.push(OverTime { name: name.into(), points }),
            Err(error) => left_out.push(format!("The curve of {name} is left out: {error}.")),
        }
    }
    Ok(ReportData {
        format: 1,
        provenance,
        states: chain.states(),
        assumptions: assumptions(options),
        sensitivities: sensitivities(&system)?,
        what_if: what_if(&system, options.mission)?,
        by_understudies: by_understudies(&system, MOST_UNDERSTUDIES.max(options.spares + 1))?,
        figures: figures_5_and_6(options.mtbf, options.mttr, FIGURE_CONTROLLERS)?,
        over_time,
        left_out,
        measured,
        answer,
        system,
    })
}

/// R and hazard at times that grow by even factors.
fn curve(chain: &Chain, from: f64, to: f64) -> Result<Vec<(f64, f64, f64)>, ReliabilityError> {
    let factor = (to / from).powf(1.0 / (CURVE_POINTS - 1) as f64);
    let hours: Vec<f64> = (0..CURVE_POINTS).map(|point| from * factor.powi(point as i32)).collect();
    let found = chain.transients(&hours, AfterFailure::Final)?;
    let points = hours
        .iter()
        .zip(found)
        .map(|(hours, at)| (*hours, at.working, chain.failure_density(&at) / at.working));
    Ok(points.filter(|(_, alive, _)| *alive > 1e-9).collect())
}

fn assumptions(options: &Options) -> Vec<String> {
    let mut said = vec![
        "Stations fail independently at constant rates; repair times are exponential.".into(),
        "A repaired station receives its states in a time that is short compared with its repair."
            .into(),
        match options.crews {
            None => "Each station has its own repair crew.".to_owned(),
            Some(crews) => {
                format!("{crews} stations can be repaired at the same time, in random order.")
            }
        },
    ];
    said.push(if options.coverage < 1.0 {
        format!(
            "A failure is masked with probability {}; otherwise the system fails with it.",
            options.coverage
        )
    } else {
        "Every failure is masked as long as the remaining parity words allow it (coverage 1)."
            .into()
    });
    said.push(match options.detection {
        None => "Repair starts at the failure: detection takes no time.".into(),
        Some(latency) => {
            format!("Repair starts when the failure is detected, after {latency} on average; it is masked from the first cycle on.")
        }
    });
    for boxes in &options.unequal {
        said.push(format!(
            "{} fail after {} on average and are repaired in {}, unlike the others.",
            if boxes.understudies || boxes.count == 1 {
                format!("Boxes of {}", boxes.name)
            } else {
                format!("The {} boxes of {}", boxes.count, boxes.name)
            },
            boxes.mtbf,
            boxes.mttr
        ));
    }
    if options.beta > 0.0 {
        said.push(match options.convention {
            crate::CommonCauseConvention::Additive => format!(
                "Common causes affect all stations at β λ with β = {}, in addition to the failures of each station at λ (additive).",
                options.beta
            ),
            crate::CommonCauseConvention::Split => format!(
                "Of the failures of a station, the share β = {} affects all stations, and 1 - β only that station (split).",
                options.beta
            ),
        });
    } else {
        said.push("No common cause affects several stations.".into());
    }
    match options.remote_ios {
        None => said.push("Remote I/Os do not fail.".into()),
        Some(them) => said.push(format!(
            "{} of {} remote I/Os have a twin; a remote I/O fails after {} on average and is repaired in {}. A twin takes over with probability {}; \
             the share β = {} of its failures affects both, in addition.",
            them.twins, them.count, them.mtbf, them.mttr, them.switchover, them.beta
        )),
    }
    match options.field_devices {
        None => said.push("Field devices do not fail.".into()),
        Some(them) => said.push(format!(
            "Of {} of {} programs each remote I/O has a field device of its own; a field device fails after {} on average and is repaired in {}. \
             The first failure of a single one fails the system; that of one of two is masked with probability {}, and the share β = {} affects both, in \
             addition.",
            them.redundant, them.count, them.mtbf, them.mttr, them.coverage, them.beta
        )),
    }
    match options.networks {
        None => said.push("Networks do not fail.".into()),
        Some(them) if them.count > 1 => said.push(format!(
            "A network fails after {} on average and is repaired in {}; there are two, and the share β = {} of failures affects both, in addition.",
            them.mtbf, them.mttr, them.beta
        )),
        Some(them) => {
            said.push(format!("The first failure of the network fails the system; its MTBF is {}.", them.mtbf));
        }
    }
    if options.shared.is_empty() {
        said.push("No other part is shared.".into());
    }
    for part in &options.shared {
        said.push(format!(
            "The first failure of {} fails the system; its MTBF is {}.",
            part.name, part.mtbf
        ));
    }
    said
}

/// Makes the files of a report.
///
/// # Errors
/// [`ReliabilityError::Report`] where a library refuses.
pub fn report(data: &ReportData) -> Result<Report, ReliabilityError> {
    let refused = |error: minijinja::Error| ReliabilityError::Report { why: format!("{error:#}") };
    let mut environment = Environment::new();
    environment.add_filter("grouped", grouped);
    environment.add_filter("small", |value: f64| format!("{value:.4e}"));
    environment.add_filter("probability", probability);
    environment.add_filter("years", years);
    environment.add_filter("fixed", |value: f64, digits: usize| format!("{value:.digits$}"));
    environment.add_template("report.html", TEMPLATE).map_err(refused)?;
    let template = environment.get_template("report.html").map_err(refused)?;
    let pictures = pictures(data)?;
    let html = template
        .render(context! {
            data => Value::from(Serde(data)),
            pictures => pictures,
        })
        .map_err(refused)?;
    let json = serde_json::to_string_pretty(data)
        .map_err(|error| ReliabilityError::Report { why: error.to_string() })?;
    Ok(Report { html, json, csv: csv(data) })
}

/// A year of 365.25 days, in hours.
const YEAR: f64 = 8766.0;

/// A long time in years behind the hours; nothing below a year.
fn years(hours: f64) -> String {
    let years = hours / YEAR;
    match years {
        _ if !(1.0..).contains(&years) => String::new(),
        _ if years < 10.0 => format!(" ({years:.1} years)"),
        _ => format!(" ({} years)", grouped(years.round())),
    }
}

/// Drawings are this program's own and must not be escaped.
fn pictures(data: &ReportData) -> Result<Value, ReliabilityError> {
    let safe = Value::from_safe_string;
    let log = |name| Axis { name, scale: Scale::Logarithmic };
    let linear = |name| Axis { name, scale: Scale::Linear };
    let over = |name: &str, pick: &dyn Fn(&FigurePoint) -> f64| Curve {
        name: name.into(),
        points: data
            .figures
            .iter()
            .map(|point| (f64::from(point.controllers), pick(point)))
            .collect(),
    };
    let figure5 = [
        over("this cluster, N+1", &|point| point.cluster.mttf_hours),
        over("paper's model, N+1", &|point| point.paper.mttf_hours),
        over("full duplex, 2N", &|point| point.duplex.mttf_hours),
        over("no spare, N", &|point| point.simplex_hours),
    ];
    let per_added = [
        over("this cluster", &|point| point.cluster.per_added_hours),
        over("paper's model", &|point| point.paper.per_added_hours),
        over("full duplex", &|point| point.duplex.per_added_hours),
    ];
    let gained = [
        over("this cluster", &|point| point.cluster.gained_per_added_hours),
        over("paper's model", &|point| point.paper.gained_per_added_hours),
        over("full duplex", &|point| point.duplex.gained_per_added_hours),
    ];
    let in_time = |pick: &dyn Fn(&(f64, f64, f64)) -> f64| -> Vec<Curve> {
        let curve = |over: &OverTime| Curve {
            name: over.name.clone(),
            points: over.points.iter().map(|point| (point.0, pick(point))).collect(),
        };
        data.over_time.iter().map(curve).collect()
    };
    let controllers = || linear("non-redundant controllers, N");
    let bars: Vec<_> = data
        .sensitivities
        .iter()
        .map(|bar| {
            (format!("{}, {}", bar.parameter, bar.value), bar.halved_hours, bar.doubled_hours)
        })
        .collect();
    let none = Vec::new();
    let system = &data.system;
    let running = match &data.measured {
        Some(measured) if measured.running.len() > 1 => {
            let points = || measured.running.iter().map(|(count, at)| (*count as f64, at));
            let band = points()
                .map(|(count, at)| (count, at.lower, at.upper.unwrap_or(at.lower)))
                .collect();
            let estimate = Curve {
                name: "measured, with its interval".into(),
                points: points().filter_map(|(count, at)| Some((count, at.estimate?))).collect(),
            };
            let model = Curve {
                name: "calculated".into(),
                points: points().map(|(count, _)| (count, measured.model_hours)).collect(),
            };
            let drawn = curves(
                &linear("failures of the system"),
                &log("MTTF in h"),
                &[estimate, model],
                &band,
                Legend::TopRight,
            )?;
            Some(safe(drawn))
        }
        _ => None,
    };
    let chain = |system: &System| system.chain().map_err(|mut errors| errors.remove(0));
    Ok(context! {
        figure5 => safe(curves(&controllers(), &log("MTTF in h"), &figure5, &none, Legend::TopRight)?),
        per_added => safe(curves(&controllers(), &log("MTTF/added unit in h"), &per_added, &none, Legend::TopRight)?),
        gained => safe(curves(&controllers(), &log("MTTF gained/added unit in h"), &gained, &none, Legend::TopRight)?),
        reliability => safe(curves(&log("time in h"), &linear("R(t)"), &in_time(&|point| point.1), &none, Legend::BottomLeft)?),
        hazard => safe(curves(&log("time in h"), &log("hazard per h"), &in_time(&|point| point.2), &none, Legend::BottomRight)?),
        tornado => safe(tornado("MTTF in h", data.answer.mttf_cluster_hours, &bars)?),
        paper_graph => safe(graph(&chain(&system.as_paper())?)),
        cluster_graph => safe(graph(&chain(system)?)),
        running => running,
    })
}

/// One row for each point: what, abscissa, ordinate.
fn csv(data: &ReportData) -> String {
    let mut rows = String::from("series,x,y\n");
    let mut row = |series: &str, x: f64, y: f64| rows.push_str(&format!("{series},{x},{y}\n"));
    for point in &data.figures {
        let n = f64::from(point.controllers);
        row("mttf_simplex_hours", n, point.simplex_hours);
        for (name, per_unit) in
            [("paper", point.paper), ("cluster", point.cluster), ("duplex", point.duplex)]
        {
            row(&format!("mttf_{name}_hours"), n, per_unit.mttf_hours);
            row(&format!("mttf_per_added_{name}_hours"), n, per_unit.per_added_hours);
            row(&format!("mttf_gained_per_added_{name}_hours"), n, per_unit.gained_per_added_hours);
        }
    }
    for over in &data.over_time {
        let name = over.name.replace('\'', "").replace(' ', "_");
        for &(hours, reliability, hazard) in &over.points {
            row(&format!("reliability_{name}"), hours, reliability);
            row(&format!("hazard_per_hour_{name}"), hours, hazard);
        }
    }
    for bar in &data.sensitivities {
        let name = bar.parameter.replace([',', ' '], "_");
        row(&format!("halved_{name}_hours"), 0.5, bar.halved_hours);
        row(&format!("doubled_{name}_hours"), 2.0, bar.doubled_hours);
    }
    rows
}
