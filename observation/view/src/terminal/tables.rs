//! The tables of stations and programs, and the remaining redundancy.

use ratatui::layout::Constraint;
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::Line;
use ratatui::widgets::{Cell, Paragraph, Row, Table, Wrap};
use understudy_wire::{ProgramId, Source};

use super::label;
use crate::model::Model;
use crate::snapshot::{MarginSnapshot, Snapshot};
use crate::station::StationState;

const GOOD: Color = Color::Green;
const MIDDLING: Color = Color::Yellow;
const BAD: Color = Color::Red;

/// Cycles that the row of a program shows.
const LAST: i64 = 20;

fn head(words: &[&'static str]) -> Row<'static> {
    let cells = words.iter().map(|word| Cell::from(*word));
    Row::new(cells.collect::<Vec<_>>()).style(Style::new().add_modifier(Modifier::BOLD))
}

pub(super) fn stations(snapshot: &Snapshot, above: usize) -> Table<'static> {
    let rows = snapshot.stations.iter().skip(clamped(above, snapshot.stations.len()));
    let rows = rows.map(|station| {
        let colour = match station.state {
            StationState::Publishing => GOOD,
            StationState::Joining
            | StationState::ShadowMode
            | StationState::NotStarted
            | StationState::Standby => MIDDLING,
            _ => BAD,
        };
        let mut state = station.state.text().to_owned();
        if station.flagged && station.state != StationState::Flagged {
            state += ", flagged";
        }
        if !station.excluded_from.is_empty() {
            state += ", excluded";
        }
        Row::new([
            Cell::from(format!(" {}", station.name)),
            Cell::from(state).style(Style::new().fg(colour)),
            Cell::from(station.publishes_for.join(" ")),
            Cell::from(station.done.clone().unwrap_or_default()),
        ])
    });
    let widths = [
        Constraint::Length(14),
        Constraint::Length(16),
        Constraint::Length(14),
        Constraint::Min(10),
    ];
    Table::new(rows.collect::<Vec<_>>(), widths).header(head(&[
        " station",
        "state",
        "publishes for",
        "last action",
    ]))
}

pub(super) fn programs(snapshot: &Snapshot, model: &Model, above: usize) -> Table<'static> {
    let programs = (0..).map(ProgramId).zip(&snapshot.programs);
    let rows = programs.skip(clamped(above, snapshot.programs.len()));
    let rows = rows.map(|(program, found)| {
        let colour = match found.source {
            Some("direct") => GOOD,
            Some("reconstructed") | None => MIDDLING,
            _ => BAD,
        };
        let source = found.source.unwrap_or("not known");
        Row::new([
            Cell::from(format!(" {}", found.program)),
            Cell::from(source).style(Style::new().fg(colour)),
            Cell::from(found.since.map_or("-".to_owned(), |since| since.to_string())),
            Cell::from(found.direct.to_string()),
            Cell::from(found.reconstructed.to_string()),
            Cell::from(found.held.to_string()),
            Cell::from(found.fail_safe.to_string()),
            Cell::from(last_sources(model, program, snapshot.cycle)),
        ])
    });
    let widths = [
        Constraint::Length(14),
        Constraint::Length(14),
        Constraint::Length(7),
        Constraint::Length(7),
        Constraint::Length(8),
        Constraint::Length(5),
        Constraint::Length(5),
        Constraint::Min(10),
    ];
    Table::new(rows.collect::<Vec<_>>(), widths).header(head(&[
        " program",
        "outputs",
        "since",
        "direct",
        "reconst.",
        "held",
        "safe",
        "last cycles",
    ]))
}

fn clamped(above: usize, count: usize) -> usize {
    above.min(count.saturating_sub(1))
}

/// A character for each of the last cycles: | direct, + reconstructed, _ held, ! fail-safe, a space for none.
fn last_sources(model: &Model, program: ProgramId, cycle: Option<i64>) -> String {
    let (Some(sources), Some(last)) = (model.series().sources(program), cycle) else {
        return String::new();
    };
    let letter = |cycle: i64| match sources.at(cycle) {
        Some(Source::Direct) => '|',
        Some(Source::Reconstructed) => '+',
        Some(Source::Held) => '_',
        Some(Source::FailSafe) => '!',
        None => ' ',
    };
    (last.saturating_sub(LAST - 1)..=last).map(letter).collect()
}

/// Programs whose state is lost or that are not protected, a line each; one line if there is no such program. And the online change in progress.
pub(super) fn protection(snapshot: &Snapshot) -> Vec<Line<'static>> {
    let alarm = Style::new().fg(BAD).add_modifier(Modifier::BOLD);
    let programs = snapshot.programs.iter();
    let texts = programs.filter_map(|program| {
        let is_protected = program.protection.as_ref().is_none_or(|of| of.protected);
        let text = match &program.lost {
            Some(lost) => lost.text(),
            None if is_protected && program.silent_cycles.is_none() => return None,
            None => snapshot.protection_text(program),
        };
        Some(format!("{}: {text}", program.program))
    });
    let mut lines: Vec<Line<'static>> =
        texts.map(|text| Line::from(vec![label("protected"), text.into()]).style(alarm)).collect();
    if lines.is_empty() {
        let mut programs = snapshot.programs.iter();
        let text = if programs.all(|program| program.protection.is_some()) {
            "all programs"
        } else {
            "not reported by all remote I/Os yet"
        };
        lines.push(Line::from(vec![label("protected"), text.into()]));
    }
    let change = snapshot.change.as_ref();
    lines.extend(change.map(|change| Line::from(vec![label("change"), change.text().into()])));
    lines
}

/// The remaining redundancy in a sentence.
pub(super) fn survives(snapshot: &Snapshot) -> Paragraph<'static> {
    let margin = &snapshot.margin;
    let programs = snapshot.programs.iter().map(|program| &program.program);
    let lost: Vec<&str> =
        programs.filter(|program| !margin.served.contains(program)).map(String::as_str).collect();
    let sentence = match (margin.served.is_empty(), lost.is_empty()) {
        (true, _) | (_, true) => sentence(margin),
        _ => format!(
            "{} has no provable outputs; of the others: {}",
            lost.join(" and "),
            sentence(margin)
        ),
    };
    let networks = snapshot.networks_text().map(|networks| format!("; {networks}"));
    let sentence = sentence + &networks.unwrap_or_default();
    let line = Line::from(vec![label("redundancy"), sentence.into()]);
    Paragraph::new(line).wrap(Wrap { trim: false })
}

fn sentence(margin: &MarginSnapshot) -> String {
    if margin.served.is_empty() {
        return "no program has provable outputs".to_owned();
    }
    let stations = |outcomes: &[crate::snapshot::OutcomeSnapshot], count: usize| -> Vec<String> {
        let fatal =
            outcomes.iter().filter(|outcome| !outcome.masked && outcome.failed.len() == count);
        fatal.map(|outcome| outcome.failed.join("+")).collect()
    };
    let most = |mut fatal: Vec<String>| {
        let more = fatal.len().saturating_sub(6);
        fatal.truncate(6);
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        format!("{}{more}", fatal.join(", "))
    };
    let singles = margin.singles.iter().filter(|single| {
        // A remote I/O is never redundant.
        !single.masked && !is_remote_io(single, margin)
    });
    let singles: Vec<String> = singles.map(|single| single.failed.join("+")).collect();
    let pairs = stations(&margin.pairs, 2);
    match (singles.is_empty(), pairs.is_empty()) {
        (false, _) => format!("NOT masked: {}", most(singles)),
        (true, false) => format!("any one station; not {}", most(pairs)),
        (true, true) => "any two stations".to_owned(),
    }
}

/// The remote I/Os of served programs come behind the stations.
fn is_remote_io(single: &crate::snapshot::OutcomeSnapshot, margin: &MarginSnapshot) -> bool {
    let stations = margin.singles.len() - margin.served.len();
    let place = margin.singles.iter().position(|other| other.failed == single.failed);
    place.is_some_and(|place| place >= stations)
}
