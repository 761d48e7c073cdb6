//! The overview of a plant as text.

use std::fmt::Write as _;

use super::{PlantOverview, SpareState};

impl PlantOverview {
    /// Tables of the groups and the spares, and the alarms.
    pub fn text(&self) -> String {
        let mut text = String::new();
        let names = self.groups.iter().map(|group| &group.name);
        let names = names.chain(self.spares.iter().map(|spare| &spare.name));
        let width = names.map(|name| name.chars().count()).max().unwrap_or(0).max(5);
        let _ = writeln!(
            text,
            "{:width$}  {:12}  {:>8}  {:>10}  details",
            "group", "state", "survives", "cycle"
        );
        for group in &self.groups {
            let number = |number: Option<i64>| number.map_or("?".to_owned(), |it| it.to_string());
            let mut details = Vec::new();
            if !group.failed.is_empty() {
                details.push(format!("failed: {}", group.failed.join(", ")));
            }
            if !group.spares.is_empty() {
                details.push(format!("spare: {}", group.spares.join(", ")));
            }
            details.extend(group.reason.clone());
            let survives = number(group.survives.map(i64::from));
            let cycle = number(group.cycle);
            let line = format!(
                "{:width$}  {:12}  {survives:>8}  {cycle:>10}  {}",
                group.name,
                group.state.word(),
                details.join("; ")
            );
            let _ = writeln!(text, "{}", line.trim_end());
        }
        let _ = writeln!(text, "\n{:width$}  {:12}  group", "spare", "state");
        for spare in &self.spares {
            let group = spare.group.as_deref().unwrap_or(match spare.state {
                SpareState::NotReceived => "?",
                _ => "-",
            });
            let _ = writeln!(text, "{:width$}  {:12}  {group}", spare.name, spare.state.word());
        }
        text.push('\n');
        if self.alarms.is_empty() {
            text.push_str("no alarm\n");
        }
        for alarm in &self.alarms {
            let _ = writeln!(text, "ALARM  {}", alarm.text);
        }
        text
    }
}
