//! The list at the bottom: events, alarms, or further failures.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Text};

use understudy_cluster::Priority;
use understudy_journal::TimeOfDay;

use super::Bottom;
use crate::alarm::{Alarm, AlarmState};
use crate::event::{Event, Level};
use crate::model::Model;
use crate::process_alarm::ProcessAlarm;
use crate::snapshot::Snapshot;
use crate::zone::Zone;

/// Which list, with times of day in a zone.
pub(super) struct List {
    pub(super) bottom: Bottom,
    pub(super) zone: Zone,
}

impl List {
    pub(super) fn draw(
        &self,
        frame: &mut Frame<'_>,
        area: Rect,
        model: &Model,
        snapshot: &Snapshot,
        back: &mut usize,
    ) {
        let [head, list] =
            Layout::vertical([Constraint::Length(1), Constraint::Min(1)]).areas(area);
        let open = snapshot.alarms.len();
        let asking = snapshot.alarms.iter().filter(|alarm| alarm.acknowledged_by.is_none()).count();
        let asking =
            if asking == 0 { String::new() } else { format!(" ({asking} to acknowledge)") };
        let tabs = [
            (Bottom::Events, format!("events {}", snapshot.events)),
            (Bottom::Alarms, format!("alarms {open}{asking}")),
            (Bottom::Failures, "further failures".to_owned()),
        ];
        let spans = tabs.into_iter().flat_map(|(tab, text)| {
            let style = if tab == self.bottom {
                Style::new().add_modifier(Modifier::BOLD | Modifier::UNDERLINED)
            } else {
                Style::new()
            };
            [" ".into(), ratatui::text::Span::styled(text, style), "  ".into()]
        });
        frame.render_widget(Line::from(spans.collect::<Vec<_>>()), head);
        let lines: Vec<Line<'static>> = match self.bottom {
            Bottom::Events => model.events().map(|event| self.event(event)).collect(),
            Bottom::Alarms => {
                let unseen = snapshot.process_alarms.iter().filter_map(|alarm| self.unseen(alarm));
                let alarms = model.alarms_at(i64::MAX).filter(|alarm| alarm.repeated_in.is_none());
                alarms.map(|alarm| self.alarm(&alarm)).chain(unseen).collect()
            }
            Bottom::Failures => failures(snapshot),
        };
        // The newest at the bottom, and never past the oldest.
        let height = usize::from(list.height);
        *back = (*back).min(lines.len().saturating_sub(height));
        let end = lines.len() - *back;
        let start = end.saturating_sub(height);
        frame.render_widget(Text::from(lines[start..end].to_vec()), list);
    }

    /// A column with the time of day, where it is known.
    fn clock(&self, at: Option<TimeOfDay>) -> String {
        at.map_or_else(String::new, |at| format!(" {}", self.zone.seconds(at)))
    }

    fn event(&self, event: &Event) -> Line<'static> {
        let cause = event.cause.as_ref().map_or(String::new(), |cause| format!(" <- {cause}"));
        let at = self.clock(event.at);
        let text = format!("{at}{:>7} {:12} {}{cause}", event.cycle, event.name, event.text);
        Line::styled(text, colour(event.level))
    }

    fn alarm(&self, alarm: &Alarm) -> Line<'static> {
        let state = match (&alarm.over, &alarm.acknowledged_by) {
            (None, None) => "lasts, not acknowledged".to_owned(),
            (None, Some(by)) => format!("lasts, acknowledged by {by}"),
            (Some(over), None) => format!("over in {over}, not acknowledged"),
            (Some(over), Some(by)) => format!("over in {over}, acknowledged by {by}"),
        };
        let at = self.clock(alarm.raised_at);
        let kind = alarm.priority.map_or(alarm.alarm, Priority::word);
        let before = if alarm.since_before { ", perhaps since an earlier cycle" } else { "" };
        let action = alarm.action.as_ref();
        let action = action.map_or(String::new(), |action| format!(" -> {action}"));
        let text = format!(
            "{at}{:>7} {:12} {kind:12} {} ({state}{before}){action}",
            alarm.cycle, alarm.name, alarm.text
        );
        let style = match alarm.state() {
            AlarmState::Unacknowledged => colour(Level::Alarm),
            AlarmState::Returned => colour(Level::Warning),
            _ => Style::new(),
        };
        Line::styled(text, style)
    }

    /// An alarm on a signal that is shelved or unknown.
    fn unseen(&self, alarm: &ProcessAlarm) -> Option<Line<'static>> {
        let why = match (&alarm.shelved, alarm.active) {
            (Some(shelved), _) => format!(
                "shelved until{} cycle {} by {}: {}",
                self.clock(shelved.until_at),
                shelved.until,
                shelved.owner,
                shelved.reason
            ),
            (None, None) => format!("unknown: the value of {}", alarm.signal),
            (None, Some(_)) => return None,
        };
        let (name, priority) = (&alarm.name, alarm.priority.word());
        let text = format!("{:>7} {name:12} {priority:12} {why}", "");
        Some(Line::styled(text, colour(Level::Warning)))
    }
}

fn colour(level: Level) -> Style {
    match level {
        Level::Info | Level::Notice => Style::new(),
        Level::Warning => Style::new().fg(Color::Yellow),
        Level::Alarm => Style::new().fg(Color::Red).add_modifier(Modifier::BOLD),
    }
}

fn failures(snapshot: &Snapshot) -> Vec<Line<'static>> {
    let margin = &snapshot.margin;
    let outcomes = margin.singles.iter().chain(&margin.pairs);
    let lines = outcomes.map(|outcome| {
        let failed = outcome.failed.join(" + ");
        if outcome.masked {
            Line::from(format!(" {failed:28} masked"))
        } else {
            let text = format!(" {failed:28} not masked: {}", outcome.lost.join(", "));
            Line::styled(text, colour(Level::Warning))
        }
    });
    lines.collect()
}
