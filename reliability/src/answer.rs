//! The answer of `understudy reliability`: mean times and reliabilities of the cluster and of what it is compared with.

use std::fmt::Write;

use serde::Serialize;

use crate::error::ReliabilityError;
use crate::options::Options;
use crate::quantity::grouped;
use crate::system::System;
use crate::three_state::ThreeState;
use crate::transient::AfterFailure;

/// The answer, as it stands in JSON. Times in hours. What is nothing was not asked for.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Answer {
    /// What was asked.
    pub options: Options,
    /// Boxes of the cluster.
    pub boxes: u32,
    /// The paper's model with one spare, (20).
    pub mttf_paper_hours: f64,
    /// The cluster as it is built here.
    pub mttf_cluster_hours: f64,
    /// A full duplex of 2N boxes, (21).
    pub mttf_duplex_hours: f64,
    /// N boxes and no spare.
    pub mttf_simplex_hours: f64,
    /// 3N boxes, two of three.
    pub mttf_tmr_hours: f64,
    /// Standard deviation of the cluster's time to failure.
    pub deviation_cluster_hours: Option<f64>,
    /// What holds at the end of the mission.
    #[serde(flatten)]
    pub mission: Option<Mission>,
}

/// What holds at the end of the mission.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Mission {
    /// Its length.
    pub mission_hours: f64,
    /// R of the paper's model, (18).
    pub reliability_paper: f64,
    /// R of the cluster as it is built.
    pub reliability_cluster: f64,
    /// R of the full duplex, (21).
    pub reliability_duplex: f64,
    /// R without a spare.
    pub reliability_simplex: f64,
    /// R of TMR.
    pub reliability_tmr: f64,
    /// 1 - R of the cluster with all its digits.
    pub unreliability_cluster: f64,
    /// All boxes of the paper's model work, (15).
    pub p0: f64,
    /// Some box of it is down, (16).
    pub p1: f64,
    /// It has failed, (17).
    pub p2: f64,
}

/// Calculates all that was asked.
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
    let cluster_chain = system.chain()?;
    let mean = |system: &System| system.chain()?.mttf().map_err(one);
    let closed = closed_form(options)?;
    let mission = match options.mission {
        None => None,
        Some(hours) => {
            let hours = hours.get();
            let reliability = |system: &System| system.chain()?.reliability(hours).map_err(one);
            let states = match &closed {
                Some(closed) => closed.probabilities(hours),
                None => {
                    let chain = paper.chain()?;
                    let found = chain.transient(hours, AfterFailure::Final).map_err(one)?;
                    let p0 = found.probabilities[0];
                    let alive = (1..chain.states()).filter(|state| !chain.is_failure(*state));
                    crate::StateProbabilities {
                        p0,
                        p1: alive.map(|state| found.probabilities[state]).sum(),
                        p2: found.failed,
                    }
                }
            };
            let failed = cluster_chain
                .transient(hours, AfterFailure::Final)
                .map_err(one)?
                .failed;
            let reliability_duplex = match equal_pairs(options)? {
                Some(pair) => (f64::from(options.controllers) * pair.log_reliability(hours)).exp(),
                None => duplex.reliability(hours).map_err(one)?,
            };
            Some(Mission {
                mission_hours: hours,
                reliability_paper: closed
                    .as_ref()
                    .map_or(states.p0 + states.p1, |closed| closed.reliability(hours)),
                reliability_cluster: cluster_chain.reliability(hours).map_err(one)?,
                reliability_duplex,
                reliability_simplex: reliability(&simplex)?,
                reliability_tmr: tmr.reliability(hours).map_err(one)?,
                unreliability_cluster: failed,
                p0: states.p0,
                p1: states.p1,
                p2: states.p2,
            })
        }
    };
    let moments = cluster_chain.time_to_failure().ok();
    Ok(Answer {
        options: options.clone(),
        boxes: system.boxes(),
        mttf_paper_hours: match &closed {
            Some(closed) => closed.mttf(),
            None => mean(&paper)?,
        },
        mttf_cluster_hours: cluster_chain.mttf().map_err(one)?,
        mttf_duplex_hours: duplex.mttf().map_err(one)?,
        mttf_simplex_hours: mean(&simplex)?,
        mttf_tmr_hours: tmr.mttf().map_err(one)?,
        deviation_cluster_hours: moments.map(|moments| moments.variance_hours_squared.sqrt()),
        mission,
    })
}

/// Whether the boxes fail by themselves and nothing else fails, so that the closed forms hold.
fn plain(options: &Options) -> bool {
    options.unequal.is_empty()
        && options.detection.is_none()
        && options.beta == 0.0
        && options.shared.is_empty()
}

/// (15) to (20), with coverage.
fn closed_form(options: &Options) -> Result<Option<ThreeState>, Vec<ReliabilityError>> {
    three_state(options, u64::from(options.controllers), plain(options))
}

/// One pair of the full duplex, (21) with theta at N = 1; independent where there is a crew for each.
fn equal_pairs(options: &Options) -> Result<Option<ThreeState>, Vec<ReliabilityError>> {
    let independent = options
        .crews
        .is_none_or(|crews| crews >= options.controllers);
    three_state(options, 1, plain(options) && independent)
}

fn three_state(
    options: &Options,
    controllers: u64,
    holds: bool,
) -> Result<Option<ThreeState>, Vec<ReliabilityError>> {
    if !holds {
        return Ok(None);
    }
    let coverage =
        crate::Probability::new("the coverage", options.coverage).map_err(|error| vec![error])?;
    ThreeState::with_coverage(
        controllers,
        options.mtbf.rate(),
        options.mttr.rate(),
        coverage,
    )
    .map(Some)
    .map_err(|error| vec![error])
}

impl Answer {
    /// JSON with all digits.
    ///
    /// # Errors
    /// A number that JSON cannot hold.
    pub fn to_json(&self) -> Result<String, ReliabilityError> {
        serde_json::to_string_pretty(self).map_err(|error| ReliabilityError::Report {
            why: error.to_string(),
        })
    }

    /// The answer for people.
    pub fn to_text(&self) -> String {
        let n = self.options.controllers;
        let mission = self.mission.as_ref();
        let rows = [
            (
                "no spare",
                n,
                self.mttf_simplex_hours,
                mission.map(|at| at.reliability_simplex),
            ),
            (
                "paper's model",
                n + 1,
                self.mttf_paper_hours,
                mission.map(|at| at.reliability_paper),
            ),
            (
                "this cluster",
                self.boxes,
                self.mttf_cluster_hours,
                mission.map(|at| at.reliability_cluster),
            ),
            (
                "full duplex",
                2 * n,
                self.mttf_duplex_hours,
                mission.map(|at| at.reliability_duplex),
            ),
            (
                "TMR",
                3 * n,
                self.mttf_tmr_hours,
                mission.map(|at| at.reliability_tmr),
            ),
        ];
        let mut text = format!("{:<14} {:>6} {:>14}", "", "boxes", "MTTF in h");
        if let Some(at) = mission {
            let _ = write!(text, "  R({} h)", grouped(at.mission_hours));
        }
        text.push('\n');
        for (name, boxes, mean, reliability) in rows {
            let _ = write!(text, "{name:<14} {boxes:>6} {:>14}", grouped(mean));
            if let Some(reliability) = reliability {
                let _ = write!(text, "  {reliability:.9}");
            }
            text.push('\n');
        }
        if let Some(at) = mission {
            let _ = writeln!(
                text,
                "The paper's states at {} h: p0 {:.9}, p1 {:.9}, p2 {:.3e}",
                grouped(at.mission_hours),
                at.p0,
                at.p1,
                at.p2
            );
        }
        text
    }
}
