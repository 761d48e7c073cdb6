//! The events of the run, chosen by severity, kind and member.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use axum::Json;
use axum::extract::rejection::QueryRejection;
use axum::extract::{Query, State};
use serde::{Deserialize, Serialize};
use understudy_journal::TimeOfDay;
use understudy_view::{EventFilter, EventRow, Level};

use super::Answered;
use super::facts::known;
use crate::app::App;
use crate::error::Problem;

/// Rows in one answer, at most.
const MAXIMUM_ROWS: usize = 1000;

const LEVELS: [Level; 4] = [Level::Info, Level::Notice, Level::Warning, Level::Alarm];

/// Lists have commas between.
#[derive(Debug, Deserialize)]
pub(super) struct Wanted {
    limit: Option<usize>,
    #[serde(default)]
    find: String,
    until: Option<i64>,
    #[serde(default)]
    levels: String,
    #[serde(default)]
    kinds: String,
    #[serde(default)]
    members: String,
    /// Whether events of the host are shown.
    #[serde(default)]
    host: bool,
    /// Whether a repeated event has one row; by default it has.
    fold: Option<bool>,
}

#[derive(Debug, Serialize)]
pub(super) struct Events {
    /// The newest first.
    events: Vec<ShownEvent>,
    /// Rows that there are.
    rows: usize,
    hidden_of_host: usize,
    /// Events by severity, kind and member, whatever the filter says.
    levels: BTreeMap<&'static str, usize>,
    kinds: BTreeMap<&'static str, usize>,
    members: BTreeMap<String, usize>,
}

#[derive(Debug, Serialize)]
struct ShownEvent {
    /// Number of the oldest event of the row.
    id: u64,
    /// Of the newest event of the row.
    cycle: i64,
    at: Option<TimeOfDay>,
    /// Of the oldest one.
    first_cycle: i64,
    count: usize,
    who: String,
    kind: &'static str,
    level: &'static str,
    what: String,
    cause: Option<String>,
}

fn list(text: &str) -> BTreeSet<String> {
    let names = text.split(',').filter(|name| !name.is_empty());
    names.map(str::to_owned).collect()
}

impl Wanted {
    fn filter(self) -> Answered<EventFilter> {
        let level = |word: String| {
            let found = LEVELS.into_iter().find(|level| level.word() == word);
            let expected = LEVELS.map(Level::word).join(", ");
            found.ok_or_else(|| Problem::bad(format!("level {word:.30}: expected {expected}")))
        };
        Ok(EventFilter {
            find: self.find,
            until: self.until,
            levels: list(&self.levels).into_iter().map(level).collect::<Answered<_>>()?,
            kinds: list(&self.kinds),
            members: list(&self.members),
            of_host: self.host,
            folds: self.fold.unwrap_or(true),
        })
    }
}

pub(super) async fn events(
    State(app): State<Arc<App>>,
    wanted: Result<Query<Wanted>, QueryRejection>,
) -> Answered<Json<Events>> {
    let Query(wanted) = wanted?;
    let limit = wanted.limit.unwrap_or(200).min(MAXIMUM_ROWS);
    let filter = wanted.filter()?;
    let model = app.model();
    let list = known(&model)?.run.event_list(&filter);
    let levels = list.levels.iter();
    let members = list.members.iter();
    Ok(Json(Events {
        rows: list.rows.len(),
        hidden_of_host: list.hidden_of_host,
        levels: levels.map(|(level, &count)| (level.word(), count)).collect(),
        members: members.map(|(&name, &count)| (name.to_owned(), count)).collect(),
        events: list.rows.iter().take(limit).map(shown).collect(),
        kinds: list.kinds,
    }))
}

fn shown(row: &EventRow<'_>) -> ShownEvent {
    let EventRow { event, first, count } = *row;
    ShownEvent {
        id: first.number,
        cycle: event.cycle,
        at: event.at,
        first_cycle: first.cycle,
        count,
        who: event.name.clone(),
        kind: event.event,
        level: event.level.word(),
        what: event.text.clone(),
        cause: event.cause.clone(),
    }
}
