//! Table II: the states of the stations and of the plants over the cycles, with the cells of equal state joined.

use std::fmt;

use serde::Serialize;

use crate::account::{Interval, Presence, Service};
use crate::summary::Summary;

/// Columns that are still readable.
const MAXIMUM_COLUMNS: usize = 40;

/// Characters of a line of text where the formatter names no width; a table that is wider goes on below.
const LINE_LENGTH: usize = 118;

/// The table.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Table {
    /// Cycles of each column, as `200–326`.
    pub columns: Vec<String>,
    /// Stations, then plants.
    pub rows: Vec<Row>,
    /// Columns that were left out at the end.
    pub left_out: usize,
}

/// One station or plant.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Row {
    /// Its name.
    pub name: String,
    /// From the first column to the last.
    pub cells: Vec<Cell>,
}

/// Columns of equal state.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Cell {
    /// How many columns.
    pub span: usize,
    /// The state in a word.
    pub text: &'static str,
}

impl Table {
    /// Of a run.
    pub fn new(summary: &Summary) -> Self {
        let mut starts: Vec<u64> = vec![0];
        starts.extend(summary.stations.iter().flat_map(|row| froms(&row.intervals)));
        starts.extend(summary.plants.iter().flat_map(|row| froms(&row.intervals)));
        starts.retain(|&start| start < summary.cycles_run);
        starts.sort_unstable();
        starts.dedup();
        let left_out = starts.len().saturating_sub(MAXIMUM_COLUMNS);
        let end = starts.get(MAXIMUM_COLUMNS).copied().unwrap_or(summary.cycles_run);
        starts.truncate(MAXIMUM_COLUMNS);
        let ends = starts.iter().skip(1).copied().chain([end]);
        let columns = starts.iter().zip(ends).map(|(from, to)| match to - from {
            1 => from.to_string(),
            _ => format!("{from}–{}", to - 1),
        });
        let stations = summary.stations.iter().map(|station| Row {
            name: station.name.clone(),
            cells: cells(&starts, &station.intervals, presence_word),
        });
        let plants = summary.plants.iter().map(|plant| Row {
            name: plant.name.clone(),
            cells: cells(&starts, &plant.intervals, service_word),
        });
        Self { columns: columns.collect(), rows: stations.chain(plants).collect(), left_out }
    }
}

fn froms<T>(intervals: &[Interval<T>]) -> impl Iterator<Item = u64> {
    intervals.iter().map(|interval| interval.from)
}

fn cells<T: Copy>(
    starts: &[u64],
    intervals: &[Interval<T>],
    word: fn(T) -> &'static str,
) -> Vec<Cell> {
    let mut cells: Vec<Cell> = Vec::new();
    for &start in starts {
        let interval =
            intervals.iter().find(|interval| (interval.from..interval.to).contains(&start));
        let text = interval.map_or("", |interval| word(interval.state));
        match cells.last_mut() {
            Some(last) if last.text == text => last.span += 1,
            _ => cells.push(Cell { span: 1, text }),
        }
    }
    cells
}

fn presence_word(presence: Presence) -> &'static str {
    match presence {
        Presence::On => "on",
        Presence::Off => "OFF",
        Presence::Joining => "joining",
    }
}

fn service_word(service: Service) -> &'static str {
    match service {
        Service::Functional => "functional",
        Service::Held => "held",
        Service::FailSafe => "FAIL-SAFE",
        Service::Wrong => "WRONG",
        Service::Missed => "MISSED",
    }
}

impl Table {
    /// Columns `from` up to, not including, `to`.
    fn slice(&self, from: usize, to: usize) -> Self {
        let rows = self.rows.iter().map(|row| {
            let mut column = 0;
            let cells = row.cells.iter().filter_map(|cell| {
                let (start, end) = (column, column + cell.span);
                column = end;
                let span = end.min(to).checked_sub(start.max(from))?;
                (span > 0).then_some(Cell { span, text: cell.text })
            });
            Row { name: row.name.clone(), cells: cells.collect() }
        });
        Self { columns: self.columns[from..to].to_vec(), rows: rows.collect(), left_out: 0 }
    }

    /// The width of each column with its gap: of its cycles, and of states that are not joined with their neighbours.
    fn widths(&self) -> Vec<usize> {
        let length = |text: &str| text.chars().count();
        let mut widths: Vec<usize> = self.columns.iter().map(|column| length(column) + 2).collect();
        for row in &self.rows {
            let mut column = 0;
            for cell in &row.cells {
                let columns = &mut widths[column..column + cell.span];
                let room = columns.iter().sum::<usize>();
                if let Some(last) = columns.last_mut() {
                    *last += (length(cell.text) + 2).saturating_sub(room);
                }
                column += cell.span;
            }
        }
        widths
    }

    fn write_block(&self, formatter: &mut fmt::Formatter<'_>, name_width: usize) -> fmt::Result {
        let widths = self.widths();
        let mut line = format!("{:name_width$}", "cycle");
        for (column, width) in self.columns.iter().zip(&widths) {
            line += &format!("{column:width$}");
        }
        writeln!(formatter, "{}", line.trim_end())?;
        for row in &self.rows {
            let mut line = format!("{:name_width$}", row.name);
            let mut column = 0;
            for cell in &row.cells {
                let width = widths[column..column + cell.span].iter().sum::<usize>();
                line += &format!("{:width$}", cell.text);
                column += cell.span;
            }
            writeln!(formatter, "{}", line.trim_end())?;
        }
        Ok(())
    }
}

/// As text; the width of the formatter is the longest line, as in `{table:60}`.
impl fmt::Display for Table {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = self.rows.iter().map(|row| row.name.chars().count());
        let name_width = names.max().unwrap_or(0).max("cycle".len()) + 2;
        let length = formatter.width().unwrap_or(LINE_LENGTH);
        let mut from = 0;
        while from < self.columns.len() {
            let fits = |to: &usize| {
                let widths = self.slice(from, *to).widths();
                name_width + widths.iter().sum::<usize>() <= length
            };
            let to = (from + 1..=self.columns.len()).take_while(fits).last();
            let to = to.unwrap_or(from + 1);
            if from > 0 {
                writeln!(formatter)?;
            }
            self.slice(from, to).write_block(formatter, name_width)?;
            from = to;
        }
        if self.left_out > 0 {
            writeln!(formatter, "({} more columns are in summary.json)", self.left_out)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wide_table_goes_on_below() {
        let table = Table {
            columns: (0..30).map(|column| format!("{column}0–{column}9")).collect(),
            rows: vec![
                Row {
                    name: "robot".into(),
                    cells: vec![
                        Cell { span: 14, text: "on" },
                        Cell { span: 2, text: "OFF" },
                        Cell { span: 14, text: "on" },
                    ],
                },
                Row { name: "arm".into(), cells: vec![Cell { span: 30, text: "functional" }] },
            ],
            left_out: 3,
        };
        insta::assert_snapshot!(table);
        let narrow = format!("{table:60}");
        assert!(narrow.lines().all(|line| line.chars().count() <= 60));
    }
}
