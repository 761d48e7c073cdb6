//! The hours to come, by the journal of a cluster that runs or has run.

use std::fmt::Write as _;

use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use serde::Serialize;
use understudy_cycle::Mode;
use understudy_reliability::{
    Hours, Interval, Observed, Options, Outlook, ReliabilityError, Rule, grouped, outlook,
};

use crate::observed::JournalView;

/// Of all intervals.
const CONFIDENCE: f64 = 0.95;

/// Draws from what is known of the rates.
const DRAWS: usize = 2_000;

/// The draws are the same for the same journal.
const SEED: u64 = 1;

/// An outlook with what it rests on.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JournalOutlook {
    /// Programs, N.
    pub controllers: u32,
    /// Understudies, S.
    pub understudies: u32,
    /// How many failures the cluster masks: `full` or `paper`.
    pub mode: &'static str,
    /// What the journal shows.
    pub observed: Observed,
    /// What follows from it.
    pub outlook: Outlook,
    /// Deadlines at the fail-safe.
    pub fail_safe: u64,
    /// What else a reader has to know, in sentences.
    pub remarks: Vec<String>,
}

/// Looks `ahead` from what a journal shows of a cluster in `mode`. `mttr` stands in where no repair was seen, as half a repair.
///
/// # Errors
/// No repair and no `mttr`; otherwise as [`outlook`].
pub fn look_ahead(
    view: JournalView,
    mode: Mode,
    ahead: Hours,
    mttr: Option<Hours>,
) -> Result<JournalOutlook, Vec<ReliabilityError>> {
    let mut observed = view.observed;
    let mut remarks = Vec::new();
    if observed.repairs == 0 {
        let Some(mttr) = mttr else {
            return Err(vec![ReliabilityError::Measurement {
                why: "the journal shows no repair that came to its end: give the time that one takes (--mttr), or let a station be killed and restarted in the run, with a scenario, `operate` or the page"
                    .into(),
            }]);
        };
        observed.repairing_hours += mttr.get() / 2.0;
        remarks.push(format!(
            "No repair was seen: the mean time to repair is taken as {mttr}, with the weight of half a repair."
        ));
    }
    if view.stalls > 0 {
        remarks.push(format!(
            "{} silences of stations lie beside a stall of the host and are not counted.",
            view.stalls
        ));
    }
    if view.cut {
        remarks.push("The last line of the journal is cut, as while it is written.".to_owned());
    }
    let any = ahead;
    let mut options = Options::new(view.controllers, any, any);
    options.spares = view.understudies;
    options.rule = match mode {
        Mode::Full => Rule::AsBuilt,
        Mode::Paper => Rule::Paper,
    };
    let mut random = Pcg64::seed_from_u64(SEED);
    let found = outlook(&observed, &options.system()?, ahead, CONFIDENCE, DRAWS, &mut random)?;
    if observed.failures_at.len() < 5 {
        remarks.push(format!(
            "{} failures are too few to test whether they come at a constant rate and independently; that is assumed.",
            observed.failures_at.len()
        ));
    }
    Ok(JournalOutlook {
        controllers: view.controllers,
        understudies: view.understudies,
        mode: match mode {
            Mode::Full => "full",
            Mode::Paper => "paper",
        },
        observed,
        outlook: found,
        fail_safe: view.fail_safe,
        remarks,
    })
}

impl JournalOutlook {
    /// The same for people.
    pub fn to_text(&self) -> String {
        let observed = &self.observed;
        let outlook = &self.outlook;
        let mut text = format!(
            "N = {}, S = {}, mode {}; observed for {} h: {} failures of stations, {} repairs, {} deadlines at the fail-safe\n\n",
            self.controllers,
            self.understudies,
            self.mode,
            grouped(observed.hours),
            observed.failures_at.len(),
            observed.repairs,
            self.fail_safe,
        );
        let mut line = |name: &str, value: String| {
            let _ = writeln!(text, "{name:<30} {value}");
        };
        line("", "estimate (95 % credible interval)".to_owned());
        line("MTBF of a station", time_of(&outlook.failure_rate));
        line("MTTR of a station", time_of(&outlook.repair_rate));
        line(
            "failures masked",
            format!(
                "{} of {}: coverage {}",
                observed.masked,
                observed.asked,
                said(&outlook.coverage)
            ),
        );
        if let Some(detection) = &outlook.detection_rate {
            line("detected after", time_of(detection));
        }
        line(
            &format!("R over the next {} h", grouped(outlook.ahead_hours)),
            said(&outlook.reliability),
        );
        line("  averaged over what is unknown", grouped(outlook.predicted));
        for remark in &self.remarks {
            let _ = writeln!(text, "{remark}");
        }
        for doubt in &outlook.doubts {
            let _ = writeln!(text, "DOUBT: {doubt}");
        }
        text
    }
}

/// The mean time that belongs to a rate: its ends change places.
fn time_of(rate: &Interval) -> String {
    let inverse = |rate: Option<f64>| rate.map_or("unknown".to_owned(), |rate| grouped(1.0 / rate));
    format!(
        "{} h ({} to {})",
        inverse(rate.estimate),
        inverse(rate.upper),
        inverse(Some(rate.lower))
    )
}

fn said(interval: &Interval) -> String {
    let number = |value: Option<f64>| value.map_or("unknown".to_owned(), grouped);
    format!(
        "{} ({} to {})",
        number(interval.estimate),
        grouped(interval.lower),
        number(interval.upper)
    )
}
