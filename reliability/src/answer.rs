//! The answer of `understudy reliability`: mean times and reliabilities of the cluster and of what it is compared with.

use std::fmt::Write;

use serde::Serialize;

use crate::cell::{
    CellRow, SinglePoint, cells_text, compare_cells, left_out, single_points, single_points_text,
};
use crate::chain::Chain;
use crate::error::ReliabilityError;
use crate::options::Options;
use crate::quantity::{grouped, probability, stated};
use crate::system::System;
use crate::transient::AfterFailure;

/// Result of `reliability`, as in JSON. Times in hours; absent values were not requested.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Answer {
    /// The options of the calculation.
    pub options: Options,
    /// Stations of the cluster; and its remote I/Os, field devices and networks, as far as their times are given.
    pub boxes: u32,
    /// The paper's model with one spare, (20).
    pub mttf_paper_hours: f64,
    /// The cluster as it is built here.
    pub mttf_cluster_hours: f64,
    /// Full duplex of 2N controllers, (21).
    pub mttf_duplex_hours: f64,
    /// N controllers without redundancy.
    pub mttf_simplex_hours: f64,
    /// 3N controllers, two out of three.
    pub mttf_tmr_hours: f64,
    /// Standard deviation of the cluster's time to failure.
    pub deviation_cluster_hours: Option<f64>,
    /// Whole cells; empty where stations alone have times.
    pub cells: Vec<CellRow>,
    /// Parts of the model of which each one stops this cell.
    pub single_points: Vec<SinglePoint>,
    /// Parts that the model leaves out, redundant or not.
    pub left_out: Vec<&'static str>,
    /// Results at the end of the mission.
    #[serde(flatten)]
    pub mission: Option<Mission>,
}

/// Probabilities at the end of the mission. A probability below [`MINIMUM_PROBABILITY`](crate::MINIMUM_PROBABILITY) is nothing; each of the
/// others has twelve digits, 1 - R as well as R.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Mission {
    /// Mission time.
    pub mission_hours: f64,
    /// R of the paper's model, (18).
    pub reliability_paper: Option<f64>,
    /// R of the cluster as it is built.
    pub reliability_cluster: Option<f64>,
    /// R of the full duplex, (21).
    pub reliability_duplex: Option<f64>,
    /// R without a spare.
    pub reliability_simplex: Option<f64>,
    /// R of TMR.
    pub reliability_tmr: Option<f64>,
    /// 1 - R of the paper's model.
    pub unreliability_paper: Option<f64>,
    /// 1 - R of the cluster as it is built.
    pub unreliability_cluster: Option<f64>,
    /// 1 - R of the full duplex.
    pub unreliability_duplex: Option<f64>,
    /// 1 - R without a spare.
    pub unreliability_simplex: Option<f64>,
    /// 1 - R of TMR.
    pub unreliability_tmr: Option<f64>,
    /// Density of the first failure of the paper's model, `dP2/dt` of (17), per hour.
    pub density_paper_per_hour: Option<f64>,
    /// Density of the first failure of the cluster as it is built.
    pub density_cluster_per_hour: Option<f64>,
    /// Density of the first failure of the full duplex.
    pub density_duplex_per_hour: Option<f64>,
    /// Density of the first failure without a spare.
    pub density_simplex_per_hour: Option<f64>,
    /// Density of the first failure of TMR.
    pub density_tmr_per_hour: Option<f64>,
    /// Probability that all stations of the paper's model work, (15).
    pub p0: Option<f64>,
    /// Some box of it is down, (16).
    pub p1: Option<f64>,
    /// It has failed, (17).
    pub p2: Option<f64>,
}

/// Calculates the answer to the options.
///
/// # Errors
/// Everything that is wrong with the options, or the first result that cannot be had.
pub fn calculate(options: &Options) -> Result<Answer, Vec<ReliabilityError>> {
    let system = options.system()?;
    let duplex = system.copies_chain(2)?;
    let tmr = system.copies_chain(3)?;
    let paper = system.as_paper();
    let simplex = system.as_simplex();
    let one = |error| vec![error];
    let (cluster_chain, paper_chain) = (system.chain()?, paper.chain()?);
    let mean = |system: &System| system.chain()?.mttf().map_err(one);
    let mission = match options.mission {
        None => None,
        Some(hours) => {
            let hours = hours.get();
            let at = |chain: &Chain| chain.transient(hours, AfterFailure::Final).map_err(one);
            let simplex_chain = simplex.chain()?;
            let (cluster, simplex) = (at(&cluster_chain)?, at(&simplex_chain)?);
            let states = at(&paper_chain)?;
            // In its first state all stations work.
            let p0 = states.probabilities[0];
            let alive = (1..paper_chain.states()).filter(|state| !paper_chain.is_failure(*state));
            let p1: f64 = alive.map(|state| states.probabilities[state]).sum();
            let duplex = system.copies_survival(2, hours)?;
            let tmr = system.copies_survival(3, hours)?;
            Some(Mission {
                mission_hours: hours,
                reliability_paper: stated(states.working),
                reliability_cluster: stated(cluster.working),
                reliability_duplex: stated(duplex.working),
                reliability_simplex: stated(simplex.working),
                reliability_tmr: stated(tmr.working),
                unreliability_paper: stated(states.failed),
                unreliability_cluster: stated(cluster.failed),
                unreliability_duplex: stated(duplex.failed),
                unreliability_simplex: stated(simplex.failed),
                unreliability_tmr: stated(tmr.failed),
                density_paper_per_hour: stated(paper_chain.failure_density(&states)),
                density_cluster_per_hour: stated(cluster_chain.failure_density(&cluster)),
                density_duplex_per_hour: stated(duplex.density),
                density_simplex_per_hour: stated(simplex_chain.failure_density(&simplex)),
                density_tmr_per_hour: stated(tmr.density),
                p0: stated(p0),
                p1: stated(p1),
                p2: stated(states.failed),
            })
        }
    };
    let moments = cluster_chain.time_to_failure().ok();
    Ok(Answer {
        options: options.clone(),
        boxes: system.boxes().saturating_add(options.other_boxes()),
        mttf_paper_hours: paper_chain.mttf().map_err(one)?,
        mttf_cluster_hours: cluster_chain.mttf().map_err(one)?,
        mttf_duplex_hours: duplex.mttf().map_err(one)?,
        mttf_simplex_hours: mean(&simplex)?,
        mttf_tmr_hours: tmr.mttf().map_err(one)?,
        deviation_cluster_hours: moments.map(|moments| moments.variance_hours_squared.sqrt()),
        cells: compare_cells(options)?,
        single_points: single_points(options),
        left_out: left_out(options),
        mission,
    })
}

impl Answer {
    /// JSON with all digits.
    ///
    /// # Errors
    /// A number that JSON cannot hold.
    pub fn to_json(&self) -> Result<String, ReliabilityError> {
        serde_json::to_string_pretty(self)
            .map_err(|error| ReliabilityError::Report { why: error.to_string() })
    }

    /// The answer for people.
    pub fn to_text(&self) -> String {
        let (n, other) = (self.options.controllers, self.options.other_boxes());
        let mission = self.mission.as_ref();
        let rows = [
            (
                "no spare",
                n + other,
                self.mttf_simplex_hours,
                mission.map(|at| {
                    (at.reliability_simplex, at.unreliability_simplex, at.density_simplex_per_hour)
                }),
            ),
            (
                "paper's model",
                n + 1 + other,
                self.mttf_paper_hours,
                mission.map(|at| {
                    (at.reliability_paper, at.unreliability_paper, at.density_paper_per_hour)
                }),
            ),
            (
                "this cluster",
                self.boxes,
                self.mttf_cluster_hours,
                mission.map(|at| {
                    (at.reliability_cluster, at.unreliability_cluster, at.density_cluster_per_hour)
                }),
            ),
            (
                "full duplex",
                2 * n + other,
                self.mttf_duplex_hours,
                mission.map(|at| {
                    (at.reliability_duplex, at.unreliability_duplex, at.density_duplex_per_hour)
                }),
            ),
            (
                "TMR",
                3 * n + other,
                self.mttf_tmr_hours,
                mission
                    .map(|at| (at.reliability_tmr, at.unreliability_tmr, at.density_tmr_per_hour)),
            ),
        ];
        let mut text = format!("{:<14} {:>6} {:>14}", "", "boxes", "MTTF in h");
        let works = mission.map(|at| format!("R({} h)", grouped(at.mission_hours)));
        let width = works.as_ref().map_or(0, String::len).max(12);
        if let Some(works) = works {
            let _ = write!(text, "  {works:<width$}  {:<12} density per h", "1 - R");
        }
        text.push('\n');
        for (name, boxes, mean, at_end) in rows {
            let _ = write!(text, "{name:<14} {boxes:>6} {:>14}", grouped(mean));
            if let Some((works, failed, density)) = at_end {
                let (works, failed) = (probability(works, 9), probability(failed, 9));
                let density = match density {
                    Some(density) => format!("{density:.6e}"),
                    None => probability(None, 9),
                };
                let _ = write!(text, "  {works:<width$}  {failed:<12} {density}");
            }
            text.push('\n');
        }
        if let Some(at) = mission {
            let _ = writeln!(
                text,
                "The paper's states at {} h: p0 {}, p1 {}, p2 {}",
                grouped(at.mission_hours),
                probability(at.p0, 9),
                probability(at.p1, 9),
                probability(at.p2, 9)
            );
        }
        if !self.cells.is_empty() {
            let single = single_points_text(&self.single_points, &self.left_out);
            let _ = write!(text, "\n{}{single}", cells_text(&self.cells));
        }
        text
    }
}
