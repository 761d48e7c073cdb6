//! What a campaign found, held against the model: for machines, and in words.
//!
//! Two numbers of the model stand beside the measured one. The *closed form* knows failures and repairs alone. The model *of this
//! campaign* adds the time that the protocol needs to detect a failure and to take over states, as it was measured; that time is not
//! accelerated, so the faster the campaign is, the further both lie apart, and by how much is said.

use std::fmt::Write as _;

use serde::Serialize;
use understudy_cluster::Cluster;
use understudy_cycle::Mode;
use understudy_reliability::{
    AccelerationBias, Assessment, Hours, Interval, Probability, REMOTE_IO_PAIR, ReliabilityError,
    SharedPart, acceleration_bias, assess, grouped,
};

use super::question::Planned;
use super::{CampaignPlan, HOUR_NS, Measured, OwnTime, PartsFound};

/// Of all intervals.
const CONFIDENCE: f64 = 0.95;

/// A campaign beside the model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Found {
    /// The name of the cluster.
    pub cluster: String,
    /// How many failures it masks: `full` or `paper`.
    pub mode: &'static str,
    /// What was done.
    pub plan: CampaignPlan,
    /// Period of the cluster, in nanoseconds.
    pub period_ns: f64,
    /// Cycles that were run.
    pub cycles: u64,
    /// What the protocol needed.
    pub own: OwnTime,
    /// MTTF by the model without the protocol's own time, in hours.
    pub mttf_closed_form_hours: f64,
    /// Whether it lies in the measured interval too.
    pub closed_form_agrees: bool,
    /// MTTF by the model of this campaign over that of the closed form, minus one.
    pub own_time_bias: f64,
    /// What the protocol's own time does to the MTTF, in the plant and in the campaign.
    pub bias: AccelerationBias,
    /// Measured against calculated.
    pub assessment: Assessment,
    /// Failures that were masked, of those that should have been.
    pub masked: (u64, u64),
    /// Remote I/Os and networks; nothing where they do not fail.
    pub parts: Option<PartsFound>,
    /// What must never happen and did.
    pub violations: Vec<String>,
    /// What a reader has to know of the run besides.
    pub remarks: Vec<String>,
}

/// Holds what was measured against the model of `planned`.
///
/// # Errors
/// A model that cannot be had, or no time at all that was measured.
pub fn hold_against_model(
    cluster: &Cluster,
    planned: &Planned,
    measured: Measured,
) -> Result<Found, Vec<ReliabilityError>> {
    let one = |error| vec![error];
    let factor = planned.plan.acceleration;
    let cycles = measured.own.down_cycles.max(1e-3);
    let time = |cycles: f64| Hours::new("the time of the protocol", cycles * planned.period_hours);
    let own = time(cycles).map_err(one)?;
    let bias = acceleration_bias(&planned.system, own, factor, planned.forced)?;
    let mut campaigned = planned.system.clone();
    campaigned.detection = Some(time(cycles * factor).map_err(one)?);
    let parts = measured.parts;
    if parts.switchovers > 0 {
        let share = 1.0 - parts.unmasked as f64 / parts.switchovers as f64;
        let switchover = Probability::new("the coverage of the switchover", share).map_err(one)?;
        let has_twins = |part: &&mut SharedPart| part.name == REMOTE_IO_PAIR;
        let pairs = campaigned.shared.iter_mut().filter(has_twins).flat_map(|it| &mut it.pair);
        pairs.for_each(|pair| pair.switchover = switchover);
    }
    let assessment = assess(&measured.campaign, &campaigned, CONFIDENCE, planned.plan.seed)?;
    let closed = planned.closed_form_hours;
    Ok(Found {
        cluster: cluster.name().to_owned(),
        mode: match cluster.agreement().mode {
            Mode::Full => "full",
            Mode::Paper => "paper",
        },
        plan: planned.plan,
        period_ns: planned.period_hours * HOUR_NS,
        cycles: measured.cycles,
        own: measured.own,
        mttf_closed_form_hours: closed,
        closed_form_agrees: assessment.mttf_hours.covers(closed),
        own_time_bias: assessment.model_hours / closed - 1.0,
        bias,
        assessment,
        parts: (planned.plan.remote_io.is_some() || planned.plan.network.is_some())
            .then_some(parts),
        masked: (measured.campaign.masked, measured.campaign.box_failures),
        violations: measured.violations,
        remarks: measured.remarks,
    })
}

impl Found {
    /// Whether the model of the campaign lies in the measured interval, and nothing happened that must not.
    pub fn is_met(&self) -> bool {
        self.assessment.agrees && self.violations.is_empty()
    }

    /// The same for people.
    pub fn to_text(&self) -> String {
        let plan = &self.plan;
        let assessment = &self.assessment;
        let mut text = format!(
            "seed {}\n{} of {} failures of {} (mode {}) in {} cycles of {}, {}: \
             MTBF {} cycles, MTTR {} cycles{}\n\n",
            plan.seed,
            assessment.failures,
            plan.failures,
            self.cluster,
            self.mode,
            grouped(self.cycles as f64),
            match assessment.world.as_str() {
                "simulator" => "the simulator",
                _ => "real processes",
            },
            if (plan.acceleration - 1.0).abs() < 1e-9 {
                "as fast as the plant".to_owned()
            } else {
                format!("{} times faster than the plant", grouped(plan.acceleration))
            },
            grouped(plan.mtbf_cycles),
            grouped(plan.mttr_cycles),
            match plan.crews {
                None => String::new(),
                Some(1) => ", 1 crew".to_owned(),
                Some(crews) => format!(", {crews} crews"),
            },
        );
        for (name, value) in self.lines() {
            let _ = writeln!(text, "{name:<34} {value}");
        }
        if !assessment.causes.is_empty() {
            text.push_str("\ncauses\n");
        }
        for (cause, count) in &assessment.causes {
            let _ = writeln!(text, "  {cause:<32} {count}");
        }
        for remark in &self.remarks {
            let _ = writeln!(text, "{remark}");
        }
        for doubt in &assessment.doubts {
            let _ = writeln!(text, "DOUBT: {doubt}");
        }
        for violation in self.violations.iter().take(5) {
            let _ = writeln!(text, "VIOLATION: {violation}");
        }
        text
    }

    fn lines(&self) -> Vec<(&'static str, String)> {
        let assessment = &self.assessment;
        let verdict = |inside| if inside { "inside" } else { "OUTSIDE" };
        let mut lines = vec![
            ("MTTF measured, 95 % interval", said(&assessment.mttf_hours, " h")),
            (
                "  calculated for this campaign",
                format!(
                    "{} h, {}: a station is down for the repair and {:.2} cycles of the protocol",
                    grouped(assessment.model_hours),
                    verdict(assessment.agrees),
                    self.own.down_cycles
                ),
            ),
            (
                "  closed form, repair alone",
                format!(
                    "{} h, {}: those cycles{} take {:.2} % from it",
                    grouped(self.mttf_closed_form_hours),
                    verdict(self.closed_form_agrees).to_lowercase(),
                    match &self.parts {
                        Some(parts) if parts.unmasked > 0 => " and failed switchovers",
                        _ => "",
                    },
                    -100.0 * self.own_time_bias
                ),
            ),
            (
                "  in the plant, not accelerated",
                format!(
                    "{} h; the acceleration biases the campaign by {:.2} %",
                    grouped(self.bias.true_hours),
                    100.0 * self.bias.relative
                ),
            ),
        ];
        if let Some(coverage) = &assessment.coverage {
            let (masked, asked) = self.masked;
            let coverage = said(coverage, "");
            lines.push(("failures masked", format!("{masked} of {asked}, coverage {coverage}")));
        }
        let cycles = |cycles: Option<f64>| {
            cycles.map_or("none".to_owned(), |cycles| format!("{cycles:.2} cycles"))
        };
        if let Some(parts) = &self.parts {
            let PartsFound { remote_ios, networks, switchovers, unmasked, .. } = parts;
            let longest = parts.longest_ns as f64 / self.period_ns;
            lines.push(("failures of remote I/Os, networks", format!("{remote_ios}, {networks}")));
            lines.push((
                "switchovers to a twin",
                format!("{switchovers}, of which {unmasked} failed; the longest took {longest:.2} cycles"),
            ));
        }
        lines.push(("detected after", cycles(self.own.detection_cycles)));
        lines.push(("states taken over after a restart", cycles(self.own.taking_over_cycles)));
        lines.push(("and proved in shadow after", cycles(self.own.shadow_cycles)));
        if let Some(repair) = &assessment.repair_hours {
            lines.push(("repaired after", said(repair, " h")));
        }
        if let Some(fit) = &assessment.fit {
            let p = fit.anderson_darling_p;
            lines.push(("fit to the law of the model", format!("p = {p:.3} (Anderson-Darling)")));
        }
        if assessment.censored > 0 {
            lines.push((
                "ended before a failure",
                format!("{} replicas, counted as censored", assessment.censored),
            ));
        }
        lines
    }
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
