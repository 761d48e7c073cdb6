//! A run on a terminal, as a table that is updated. It is drawn into any buffer of characters.
//!
//! ```text
//!   press-cell  full  10ms                         running  cycle 1234
//!   station      state      publishes for          last action
//!   program      outputs from   since  direct  reconstr.  held  safe  last cycles
//!   redundancy   any one station; not robot+understudy
//!   margin       ▅▅▆▅▅▅▄▅▅▅                        3.6 ms before the deadline
//!   events       cycle, member, event, cause
//! ```
//!
//! No state is shown by colour alone.

mod lists;
mod tables;

use std::time::{Duration, Instant};

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Paragraph, Sparkline};

use crate::alarm::Alarm;
use crate::model::Model;
use crate::snapshot::Snapshot;
use crate::source::{BEHIND, Progress};
use crate::zone::Zone;

/// A key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Key {
    /// Up in the list at the bottom.
    Up,
    /// Down.
    Down,
    /// A screen up.
    PageUp,
    /// A screen down.
    PageDown,
    /// The tables of stations and programs up.
    Left,
    /// The tables down.
    Right,
    /// The next list: events, alarms, failures.
    Next,
    /// Acknowledge all alarms.
    Acknowledge,
    /// Pause or resume.
    Pause,
    /// Show the keys.
    Help,
}

/// The list at the bottom.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Bottom {
    #[default]
    Events,
    Alarms,
    Failures,
}

/// The screen of `top`.
#[derive(Debug, Clone, Default)]
pub struct Screen {
    bottom: Bottom,
    /// Lines from the newest.
    back: usize,
    /// Rows of the tables that are above them.
    above: usize,
    paused: bool,
    help: bool,
    /// Age of the newest record, where a live run has not written one lately.
    age: Option<Duration>,
    /// How much of the journal is read while its past is not, in percent.
    past: Option<u8>,
    /// The zone of the times of day.
    zone: Zone,
}

const PAGE: usize = 10;

impl Screen {
    /// A screen with times of day in this zone.
    pub fn in_zone(zone: Zone) -> Self {
        Self { zone, ..Self::default() }
    }

    /// Whether it is paused: then no record is to be noted.
    pub fn is_paused(&self) -> bool {
        self.paused
    }

    /// Handles a key; returns the alarms that it acknowledges.
    pub fn press(&mut self, key: Key, model: &Model) -> Vec<Alarm> {
        match key {
            Key::Up => self.back += 1,
            Key::Down => self.back = self.back.saturating_sub(1),
            Key::PageUp => self.back += PAGE,
            Key::PageDown => self.back = self.back.saturating_sub(PAGE),
            Key::Left => self.above = self.above.saturating_sub(1),
            Key::Right => self.above += 1,
            Key::Next => {
                self.back = 0;
                self.bottom = match self.bottom {
                    Bottom::Events => Bottom::Alarms,
                    Bottom::Alarms => Bottom::Failures,
                    Bottom::Failures => Bottom::Events,
                };
            }
            Key::Acknowledge => {
                let unseen = model
                    .alarms()
                    .filter(|alarm| alarm.acknowledged_by.is_none() && alarm.repeated_in.is_none());
                return unseen.cloned().collect();
            }
            Key::Pause => self.paused = !self.paused,
            Key::Help => self.help = !self.help,
        }
        Vec::new()
    }

    /// Draws the present; while the journal is being read, only its progress. `past` says how much of the journal is read while its past is not. A
    /// paused screen does not change.
    pub fn draw_live(
        &mut self,
        frame: &mut Frame<'_>,
        model: &Model,
        progress: Progress,
        past: Option<u8>,
        now: Instant,
    ) {
        if !self.paused
            && let Err(reading) = progress.current(now)
        {
            let text = format!(" {}  {reading}", model.cluster().name());
            frame.render_widget(Line::raw(text), frame.area());
            return;
        }
        let age = progress.age(now).filter(|age| *age > BEHIND);
        self.age = age.filter(|_| !model.is_finished());
        self.past = past;
        self.draw(frame, model);
    }

    /// Draws it all.
    pub fn draw(&mut self, frame: &mut Frame<'_>, model: &Model) {
        let snapshot = model.snapshot();
        let area = frame.area();
        let stations = rows(snapshot.stations.len(), area.height);
        let programs = rows(snapshot.programs.len(), area.height);
        let protected = tables::protection(&snapshot);
        let lines = u16::try_from(protected.len()).unwrap_or(u16::MAX);
        let [head, station_area, program_area, protection, survives, timing, bottom] =
            Layout::vertical([
                Constraint::Length(1),
                Constraint::Length(stations),
                Constraint::Length(programs),
                Constraint::Length(lines.min((area.height / 6).max(1))),
                Constraint::Length(2),
                Constraint::Length(2),
                Constraint::Min(3),
            ])
            .areas(area);
        frame.render_widget(self.head(&snapshot, head.width), head);
        frame.render_widget(tables::stations(&snapshot, self.above), station_area);
        frame.render_widget(tables::programs(&snapshot, model, self.above), program_area);
        frame.render_widget(Paragraph::new(protected), protection);
        frame.render_widget(tables::survives(&snapshot), survives);
        draw_timing(frame, timing, model, &snapshot);
        if self.help {
            frame.render_widget(help(), bottom);
        } else {
            let list = lists::List { bottom: self.bottom, zone: self.zone };
            list.draw(frame, bottom, model, &snapshot, &mut self.back);
        }
    }

    fn head(&self, snapshot: &Snapshot, width: u16) -> Line<'static> {
        let run = if self.paused { "paused" } else { snapshot.run.word() };
        let period = std::time::Duration::from_micros(snapshot.period_us);
        let left = format!(" {}  {}  {period:?}", snapshot.cluster, snapshot.mode);
        let cycle = snapshot.cycle.map_or("-".to_owned(), |cycle| cycle.to_string());
        let left_out = match snapshot.left_out {
            0 => String::new(),
            left_out => format!("  {left_out} records left out"),
        };
        let age =
            self.age.map_or(String::new(), |age| format!("  NO RECORD FOR {} s", age.as_secs()));
        let past =
            self.past.map_or(String::new(), |percent| format!("  reading the past: {percent} %"));
        let at = snapshot.at.map_or_else(String::new, |at| {
            format!("  {} {}", self.zone.seconds(at), self.zone.name(at))
        });
        let apart = snapshot.clocks_apart.as_ref();
        let apart =
            apart.map_or_else(String::new, |apart| format!("  CLOCKS DIFFER: {}", apart.text()));
        let right =
            format!("{run}{at}  cycle {cycle}{past}{age}{apart}{left_out}  h help  q quit ");
        let gap = usize::from(width).saturating_sub(left.chars().count() + right.chars().count());
        let text = format!("{left}{}{right}", " ".repeat(gap.max(1)));
        Line::styled(text, Style::new().add_modifier(Modifier::REVERSED))
    }
}

/// Height of a table with its head; limited for a large cluster.
fn rows(count: usize, height: u16) -> u16 {
    let most = (height / 4).max(3);
    u16::try_from(count + 1).unwrap_or(most).min(most)
}

/// The label of a line.
pub(crate) fn label(text: &str) -> Span<'static> {
    Span::styled(format!(" {text:10} "), Style::new().add_modifier(Modifier::BOLD))
}

fn draw_timing(frame: &mut Frame<'_>, area: Rect, model: &Model, snapshot: &Snapshot) {
    let [left, middle, right] =
        Layout::horizontal([Constraint::Length(12), Constraint::Min(10), Constraint::Length(34)])
            .areas(area);
    frame.render_widget(Line::from(label("margin")), left);
    let width = usize::from(middle.width);
    let mut margins: Vec<u64> = model
        .timings()
        .rev()
        .take(width)
        .map(|timing| u64::try_from(timing.margin_ns).unwrap_or(0))
        .collect();
    margins.reverse();
    let period_ns = snapshot.period_us.saturating_mul(1000);
    frame.render_widget(Sparkline::default().data(margins).max(period_ns * 65 / 100), middle);
    let text = snapshot.timing.map_or_else(
        || " no times yet".to_owned(),
        |timing| {
            let cycle = timing
                .cycle_us
                .map_or(String::new(), |cycle| format!(", cycle {}", milliseconds(cycle)));
            format!(
                " {} before the deadline\n token {}{cycle}",
                milliseconds(timing.margin_us),
                milliseconds(timing.token_us)
            )
        },
    );
    frame.render_widget(Paragraph::new(text), right);
}

fn milliseconds(us: f64) -> String {
    format!("{:.2} ms", us / 1000.0)
}

fn help() -> Paragraph<'static> {
    Paragraph::new(
        " q quit            space  pause, resume\n tab  events, alarms, further failures\n a    acknowledge all alarms\n \
         up, down, page up, page down   scroll the list\n left, right                    scroll the tables\n h    back",
    )
}
