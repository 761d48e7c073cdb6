//! The answer about a chain of any shape.

use std::fmt::Write;

use serde::{Serialize, Serializer};

use crate::chain::Chain;
use crate::error::ReliabilityError;
use crate::quantity::{Hours, grouped, probability, stated};
use crate::transient::AfterFailure;

/// States that are listed in text, at most.
const MAXIMUM_LISTED: usize = 30;

/// What a chain says. What is nothing does not exist for this chain, or was not asked for, as `remarks` say, or is a probability below
/// [`MINIMUM_PROBABILITY`](crate::MINIMUM_PROBABILITY).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChainAnswer<'a> {
    /// States, failures too.
    pub states: usize,
    /// Mean time to the first failure.
    pub mttf_hours: Option<f64>,
    /// Standard deviation of the time to the first failure.
    pub deviation_hours: Option<f64>,
    /// Probability of a failure state in the long run.
    pub unavailability: Option<f64>,
    /// Results at the end of the mission.
    #[serde(flatten)]
    pub mission: Option<ChainMission>,
    /// States with their probabilities.
    pub by_state: ByState<'a>,
    /// Why something is missing.
    pub remarks: Vec<String>,
}

/// Results at the end of a mission.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ChainMission {
    /// Mission time.
    pub mission_hours: f64,
    /// Probability that there was no failure.
    pub reliability: Option<f64>,
    /// Probability that there was one.
    pub unreliability: Option<f64>,
    /// Probability of a failure state, where failures are repaired as the chain says.
    pub point_unavailability: Option<f64>,
}

/// The states of a chain, of which there may be millions: what is said of each is made when it is asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct ByState<'a> {
    chain: &'a Chain,
    steady: Option<Vec<f64>>,
    at_mission: Option<Vec<f64>>,
}

impl ByState<'_> {
    /// The states in the order of the chain.
    pub fn iter(&self) -> impl Iterator<Item = StateAnswer> + '_ {
        let of = |all: &Option<Vec<f64>>, state: usize| stated(all.as_ref()?[state]);
        (0..self.chain.states()).map(move |state| StateAnswer {
            name: self.chain.name(state),
            failure: self.chain.is_failure(state),
            steady: of(&self.steady, state),
            at_mission: of(&self.at_mission, state),
        })
    }
}

impl Serialize for ByState<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.iter())
    }
}

/// One state.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StateAnswer {
    /// Name of the state.
    pub name: String,
    /// Whether it is a failure.
    pub failure: bool,
    /// Probability in the long run.
    pub steady: Option<f64>,
    /// Probability at the end of the mission, where failures are repaired as the chain says.
    pub at_mission: Option<f64>,
}

/// Answers what can be answered about `chain`.
///
/// # Errors
/// A mission that takes too many steps.
pub fn answer_chain(
    chain: &Chain,
    mission: Option<Hours>,
) -> Result<ChainAnswer<'_>, ReliabilityError> {
    let mut remarks = Vec::new();
    let mut kept = |found: Result<f64, ReliabilityError>| match found {
        Ok(value) => Some(value),
        Err(error) => {
            remarks.push(error.to_string());
            None
        }
    };
    let mttf_hours = kept(chain.mttf());
    let deviation_hours = match mttf_hours {
        Some(_) => {
            kept(chain.time_to_failure().map(|moments| moments.variance_hours_squared.sqrt()))
        }
        None => None,
    };
    let steady = match chain.steady_state() {
        Ok(steady) => Some(steady),
        Err(error) => {
            remarks.push(error.to_string());
            None
        }
    };
    let failures = || (0..chain.states()).filter(|state| chain.is_failure(*state));
    let mut at_mission = None;
    let mission = match mission {
        Some(hours) => {
            let first = chain.transient(hours.get(), AfterFailure::Final)?;
            let later = chain.transient(hours.get(), AfterFailure::Repaired)?;
            // Without a failure state there is no failure, and this is not a number that is too small.
            let failed = |probability| match failures().next() {
                None => Some(0.0),
                Some(_) => stated(probability),
            };
            let answer = ChainMission {
                mission_hours: hours.get(),
                reliability: stated(first.working),
                unreliability: failed(first.failed),
                point_unavailability: failed(later.failed),
            };
            at_mission = Some(later.probabilities);
            Some(answer)
        }
        None => None,
    };
    Ok(ChainAnswer {
        states: chain.states(),
        mttf_hours,
        deviation_hours,
        unavailability: steady.as_ref().and_then(|steady| match failures().next() {
            None => Some(0.0),
            Some(_) => stated(failures().map(|state| steady[state]).sum()),
        }),
        by_state: ByState { chain, steady, at_mission },
        mission,
        remarks,
    })
}

impl ChainAnswer<'_> {
    /// The answer for people.
    pub fn to_text(&self) -> String {
        let mut text = format!("{} states\n", self.states);
        let mut line = |name: &str, value: Option<String>| {
            if let Some(value) = value {
                let _ = writeln!(text, "{name:<24} {value}");
            }
        };
        line("MTTF", self.mttf_hours.map(|hours| format!("{} h", grouped(hours))));
        line(
            "standard deviation",
            self.deviation_hours.map(|hours| format!("{} h", grouped(hours))),
        );
        let tiny = || probability(None, 6);
        if let Some(share) = self.unavailability {
            line("unavailability", Some(format!("{share:.6e}")));
        }
        if let Some(at) = &self.mission {
            let hours = grouped(at.mission_hours);
            line(&format!("R({hours} h)"), Some(probability(at.reliability, 12)));
            line(
                &format!("1 - R({hours} h)"),
                Some(at.unreliability.map_or_else(tiny, |share| format!("{share:.6e}"))),
            );
        }
        for state in self.by_state.iter().take(MAXIMUM_LISTED) {
            let steady = state.steady.map(|share| format!("{share:.6e} in the long run"));
            let later = self.mission.as_ref().map(|_| {
                let share = state.at_mission.map_or_else(tiny, |share| format!("{share:.6e}"));
                format!("{share} at the end of the mission")
            });
            let said: Vec<String> = [steady, later].into_iter().flatten().collect();
            line(&state.name, (!said.is_empty()).then(|| said.join(", ")));
        }
        for remark in &self.remarks {
            let _ = writeln!(text, "{remark}");
        }
        text
    }
}
