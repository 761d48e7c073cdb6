//! What a scenario expects, beside what was found.

use understudy_journal::source_word;
use understudy_wire::{Member, Source};

use super::{ExpectationSummary, Summary};
use crate::account::{Account, RangeFinding};
use crate::scenario::{During, Scenario};

pub(super) fn expectations(
    summary: &Summary,
    account: &Account,
    scenario: &Scenario,
) -> Vec<ExpectationSummary> {
    let expect = &scenario.expect;
    let total = summary.total();
    let plant_faults = summary.plants.iter().map(|plant| plant.plant_faults).sum();
    let wrong = at_most("wrong outputs", expect.wrong, summary.violation_count, 0);
    let mut list = vec![ExpectationSummary { needs_time: false, ..wrong }];
    for (member, records) in &account.unwritten {
        if member.sampled_program().is_some() {
            list.push(ExpectationSummary {
                expected: format!("all that {} drove is judged", account.terms.members.name(*member)),
                found: format!(
                    "its journal lost {records} records on a host that was too slow to write them; what came after was not judged"
                ),
                met: false,
                needs_time: false,
            });
        }
    }
    for (program, gaps) in account.gaps() {
        let name = account.terms.members.name(Member::RemoteIo(program));
        list.push(ExpectationSummary {
            expected: format!("all that {name} drove is judged"),
            found: format!(
                "{gaps} times it was killed before its journal had its last samples; what came after was not judged until a station reported its state"
            ),
            met: false,
            needs_time: false,
        });
    }
    if summary.death_count > 0 && !scenario.asks_for_nothing() {
        let each: Vec<String> = summary.deaths.iter().map(ToString::to_string).collect();
        list.push(ExpectationSummary {
            expected: "no member ends but by a step of the scenario".to_owned(),
            found: format!("ended unexpectedly: {}", each.join(", ")),
            met: false,
            needs_time: false,
        });
    }
    if let Some(held) = expect.held {
        list.push(at_most("cycles held", held, total.held, total.held_by_stall));
    }
    if let Some(fail_safe) = expect.fail_safe {
        let by_stall = total.fail_safe_by_stall;
        list.push(at_most("cycles fail-safe", fail_safe, total.fail_safe, by_stall));
    }
    if let Some(missed) = expect.missed {
        list.push(at_most("cycles missed", missed, total.missed, 0));
    }
    if let Some(allowed) = expect.plant_faults {
        list.push(at_most("plant_faults", allowed, plant_faults, 0));
    }
    if expect.protected {
        let found = account.protected;
        list.push(ExpectationSummary {
            expected: "everybody synchronised at the end".to_owned(),
            found: if found { "synchronised" } else { "not synchronised" }.to_owned(),
            met: found,
            needs_time: true,
        });
    }
    if scenario.asks_for_nothing() {
        list.extend(undisturbed(summary));
    }
    let plant_name = |program| account.terms.members.name(Member::Plant(program));
    let plant = |program| {
        let name = plant_name(program);
        summary.plants.iter().find(|plant| plant.name == name)
    };
    for &program in &expect.functional {
        let met = plant(program).is_some_and(|plant| plant.functional);
        list.push(ExpectationSummary {
            expected: format!("{} functional", plant_name(program)),
            found: if met { "functional" } else { "not functional" }.to_owned(),
            met,
            needs_time: true,
        });
    }
    for (&program, &least) in &expect.finished {
        let finished = plant(program).map_or(0, |plant| plant.finished);
        list.push(ExpectationSummary {
            expected: format!("{} finishes at least {least} parts", plant_name(program)),
            found: finished.to_string(),
            met: finished >= least,
            needs_time: true,
        });
    }
    let ranges = account.during.iter();
    list.extend(ranges.map(|(during, finding)| {
        let remote_io = account.terms.members.name(Member::RemoteIo(during.remote_io));
        range(remote_io, during, *finding)
    }));
    list
}

/// What a cluster that merely runs must do: every plant stays functional, and so does equipment behind a remote I/O. Cycles that a stall of the
/// host explains do not count.
fn undisturbed(summary: &Summary) -> impl Iterator<Item = ExpectationSummary> {
    summary.remote_ios.iter().map(|remote_io| {
        let plant = summary.plants.iter().find(|plant| plant.remote_io == remote_io.name);
        let lacking = [
            (remote_io.counts.wrong, "wrong"),
            (remote_io.counts.fail_safe, "fail-safe"),
            (remote_io.counts.missed, "missed"),
            (plant.map_or(0, |plant| plant.plant_faults), "plant faults"),
        ];
        let lacking = lacking.into_iter().filter(|(number, _)| *number > 0);
        let lacking: Vec<String> =
            lacking.map(|(number, what)| format!("{number} {what}")).collect();
        ExpectationSummary {
            expected: match plant {
                Some(plant) => format!("{} functional", plant.name),
                None => format!("{} applies proven or held outputs", remote_io.name),
            },
            found: if lacking.is_empty() { "as expected".to_owned() } else { lacking.join(", ") },
            met: lacking.is_empty(),
            needs_time: true,
        }
    })
}

fn at_most(what: &str, allowed: u64, found: u64, by_stall: u64) -> ExpectationSummary {
    let expected = match allowed {
        0 => format!("no {what}"),
        _ => format!("at most {allowed} {what}"),
    };
    ExpectationSummary {
        expected,
        found: format!("{found}{}", apart(by_stall)),
        met: found <= allowed,
        needs_time: true,
    }
}

/// Cycles that do not count, because the host stood still.
fn apart(by_stall: u64) -> String {
    match by_stall {
        0 => String::new(),
        _ => format!(" (and {by_stall} while the host stood still)"),
    }
}

fn range(remote_io: &str, during: &During, finding: RangeFinding) -> ExpectationSummary {
    let words: Vec<&str> = during.sources.iter().copied().map(source_word).collect();
    let word = |source: Option<Source>| source.map_or("nothing", source_word);
    ExpectationSummary {
        expected: format!(
            "{remote_io} {} in cycles {}-{}",
            words.join(" or "),
            during.from,
            during.to - 1
        ),
        found: match finding.first {
            None if finding.missed_by_stall == 0 => "as expected".to_owned(),
            None => format!(
                "as expected, but for {} while the host stood still",
                finding.missed_by_stall
            ),
            Some((cycle, source)) => format!(
                "not in {} cycles{}, first in cycle {cycle}: {}",
                finding.missed,
                apart(finding.missed_by_stall),
                word(source)
            ),
        },
        met: finding.missed == 0,
        needs_time: true,
    }
}
