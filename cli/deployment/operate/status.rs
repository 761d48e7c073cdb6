//! The state of a remote member: what it said when it was ready, the records that are in effect, and its newest turn or deadline.

use std::time::{Duration, Instant};

use serde_json::{Value, json};
use understudy_bus::{BusError, Call, Reporter, Request, Told};
use understudy_cluster::Cluster;
use understudy_journal::{Record, records_not_over, repeated};
use understudy_view::{Filter, Listing};

use crate::answer::Answer;

/// A member repeats what is in effect every second.
const PATIENCE: Duration = Duration::from_secs(4);

/// The records of a member that say its state.
#[derive(Debug, Default)]
struct Present {
    in_effect: Vec<Record>,
    is_complete: bool,
    newest: Option<Record>,
}

impl Present {
    /// Takes a line of its journal; whether more are needed.
    fn take(&mut self, line: &str) -> bool {
        match repeated(line) {
            Ok(Some(_)) if self.is_complete => {}
            Ok(Some(record)) => self.in_effect.push(record),
            Ok(None) => self.is_complete = true,
            Err(_) => {
                if is_of_every_cycle(line)
                    && let Ok(record) = serde_json::from_str(line)
                {
                    self.newest = Some(record);
                }
            }
        }
        !self.is_complete || self.newest.is_none()
    }
}

/// The deadline, the turn or the step that a remote I/O, a station or a plant reports in each cycle.
const OF_EVERY_CYCLE: [&str; 3] = ["applied", "published", "stepped"];

/// Whether a line is a record of that kind.
fn is_of_every_cycle(line: &str) -> bool {
    let line: Value = serde_json::from_str(line).unwrap_or_default();
    let event = line["event"]["event"].as_str();
    event.is_some_and(|event| OF_EVERY_CYCLE.contains(&event))
}

/// Asks a member for its state.
pub(super) fn ask(call: &Call, cluster: &Cluster, name: &str) -> Result<Answer, BusError> {
    let ready = call.ask(&Request::Status)?;
    let ours = Reporter::with(cluster.agreement().configuration);
    let (mut present, mut other) = (Present::default(), None);
    let started = Instant::now();
    let followed = call.follow(PATIENCE, |told| {
        let wants_more = match told {
            Told::Line(line) => present.take(line),
            Told::By(reporter) => {
                let own = cluster.agreement().configuration;
                other = reporter.filter(|theirs| !theirs.is_of(own)).cloned();
                true
            }
            Told::Lost(_) | Told::Silent => true,
        };
        wants_more && started.elapsed() < PATIENCE
    });
    let all = std::mem::take(&mut present.in_effect);
    let slots = cluster.agreement().schedule.spare_slots();
    present.in_effect = records_not_over(all);
    // The slot of a spare that sleeps is empty, as it should be.
    present.in_effect.retain(|record| record.flagged().is_none_or(|of| !slots.contains(of)));
    let mut result: Value =
        serde_json::from_str(&ready).unwrap_or_else(|_| json!({ "text": ready }));
    let mut lines = Vec::new();
    if let Some(other) = &other {
        lines.push(format!(
            "U0563: {name} runs configuration {}, and the cluster file is configuration {}: its signals are not those of the file",
            other.configuration, ours.configuration
        ));
    } else if let Ok(mut listing) =
        Listing::new(cluster, Filter { ordinary: true, ..Filter::default() })
    {
        for record in present.in_effect.iter().chain(&present.newest) {
            lines.extend(
                listing.take(record).iter().map(|line| format!("{}: {}", line.event, line.text)),
            );
        }
    }
    if present.newest.is_none() {
        let why = match followed {
            Err(_) => "its journal cannot be followed with these keys",
            Ok(()) => "it takes no turn and applies no outputs now",
        };
        lines.push(format!("{name}: {why}"));
    }
    result["in_effect"] = json!(present.in_effect);
    result["newest"] = json!(present.newest);
    Ok(Answer::done(lines.join("\n"), result))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_state_is_one_repetition_and_the_newest_turn() {
        let record = |event: &str| {
            format!(r#"{{"at_ns":1,"name":"robot","member":{{"station":0}},"event":{event}}}"#)
        };
        let moment = r#"{"epoch":1,"cycle":2}"#;
        let turn = record(&format!(r#"{{"event":"published","moment":{moment},"words":[]}}"#));
        let joins = record(&format!(r#"{{"event":"became-cycle-master","moment":{moment}}}"#));
        let ended = r#"{"in_effect":null}"#;
        let mut present = Present::default();
        for (line, wants_more) in
            [(joins, true), (ended.to_owned(), true), (turn.clone(), false), (turn, false)]
        {
            assert_eq!(present.take(&line), wants_more, "{line}: {present:?}");
        }
        assert!(present.newest.is_some());
    }
}
