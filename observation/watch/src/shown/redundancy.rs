//! The remaining redundancy, in a sentence and by failure.

use serde::Serialize;
use understudy_view::{MarginSnapshot, OutcomeSnapshot, Snapshot};

/// Failures that are listed, at most.
const LISTED_FAILURES: usize = 40;

/// Pairs of stations that the sentence about the remaining redundancy names, at most.
const NAMED_PAIRS: usize = 2;

/// The remaining redundancy.
#[derive(Debug, Serialize)]
pub(crate) struct Redundancy {
    level: &'static str,
    words: String,
    /// Further failures of stations that are masked whichever they are.
    survives: u8,
    failures: Vec<Failure>,
}

#[derive(Debug, Serialize)]
pub(crate) struct Failure {
    names: Vec<String>,
    masked: bool,
    why: String,
}

pub(super) fn redundancy(snapshot: &Snapshot) -> Redundancy {
    let margin = &snapshot.margin;
    let is_station = |name: &String| snapshot.stations.iter().any(|known| known.name == *name);
    let singles = margin.singles.iter();
    let singles: Vec<&OutcomeSnapshot> =
        singles.filter(|outcome| outcome.failed.iter().all(is_station)).collect();
    let (level, words) = in_words(margin, &singles);
    // A program that has no provable outputs is no good sign, whatever else would be masked.
    let programs = snapshot.programs.iter().map(|program| &program.program);
    let lost: Vec<&str> =
        programs.filter(|program| !margin.served.contains(program)).map(String::as_str).collect();
    let (level, words) = if lost.is_empty() || level == "none" {
        (level, words)
    } else {
        let lost = lost.join(" and ");
        let words = format!("{lost} has no provable outputs; of the others: {words}");
        ("some", words)
    };
    let (level, words) = match margin.unknown.as_slice() {
        [] => (level, words),
        unknown => {
            let unknown = unknown.join(" and ");
            ("some", format!("not known: nothing is received from {unknown} here"))
        }
    };
    let (level, words) = match snapshot.networks_text() {
        None => (level, words),
        Some(networks) => {
            let in_order = snapshot.networks.iter().all(|network| network.in_order);
            (
                if in_order || level == "none" { level } else { "some" },
                format!("{words}; {networks}"),
            )
        }
    };
    let unmasked_pairs = margin.pairs.iter().filter(|pair| !pair.masked);
    let failures = singles.into_iter().chain(unmasked_pairs);
    Redundancy {
        level,
        words,
        survives: margin.survives,
        failures: failures.take(LISTED_FAILURES).map(failure).collect(),
    }
}

fn in_words(margin: &MarginSnapshot, singles: &[&OutcomeSnapshot]) -> (&'static str, String) {
    let masked = singles.iter().filter(|outcome| outcome.masked).count();
    let of = singles.len();
    let unmasked: Vec<String> = margin
        .pairs
        .iter()
        .filter(|pair| !pair.masked)
        .map(|pair| pair.failed.join(" and "))
        .collect();
    let (level, words) = match (masked, unmasked.is_empty()) {
        _ if margin.served.is_empty() => ("none", "no program has provable outputs"),
        (0, _) => ("none", "no further failure of a station would be masked"),
        (_, _) if masked < of => {
            let words = format!("{masked} of {of} failures of a single station would be masked");
            return ("some", words);
        }
        (_, false) => {
            let more = unmasked.len().saturating_sub(NAMED_PAIRS);
            let named = unmasked[..unmasked.len() - more].join(", or ");
            let more =
                if more == 0 { String::new() } else { format!(", and {more} further pairs") };
            return (
                "all",
                format!("any one of {of} stations may fail; {named}{more} together not"),
            );
        }
        _ => ("all", "any two further failures of stations would be masked"),
    };
    (level, words.to_owned())
}

fn failure(outcome: &OutcomeSnapshot) -> Failure {
    Failure { names: outcome.failed.clone(), masked: outcome.masked, why: outcome.why.clone() }
}
