//! The function Ω: (Q ∪ {∅}) × (Y ∪ {∅}) → Q × (X ∪ {∅}) × Pwr(X), thesis section 3.4.3, as the rows of its tables.

use std::fmt::Write;

use understudy_ladder::Name;

use super::map::{InputOutputMap, Mode};
use super::partition::{Meaning, Partition};
use super::positions::Positions;
use crate::{Automaton, Edge, Label, State};

/// y: what makes a row move.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Trigger {
    /// x^0, the operator's start.
    Start(Name),
    /// x_σ: an event of the operator or the plant.
    Event(Label),
    /// ∅: the PLC generates this command by itself.
    Command(Label),
    /// x^σ: the PLC generates this command when its request is 1.
    Request(Label, Name),
}

/// (q, y) ↦ (q', x, X'). Leaving q and entering q' are implied.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row {
    /// Its number in the table, from 1.
    pub number: usize,
    /// q; `None` is ∅, no state yet.
    pub source: Option<State>,
    /// y.
    pub trigger: Trigger,
    /// q'.
    pub target: State,
    /// x: the signal that is switched on.
    pub latch: Option<Name>,
    /// X': the signals that are switched off.
    pub unlatch: Vec<Name>,
}

impl Row {
    /// The command that the row generates.
    pub fn command(&self) -> Option<Label> {
        match self.trigger {
            Trigger::Command(label) | Trigger::Request(label, _) => Some(label),
            Trigger::Start(_) | Trigger::Event(_) => None,
        }
    }
}

/// All rows, by state, in each state the events before the commands, both by label. Events that change nothing have none.
///
/// A switch that moves from one position to another unlatches those in which it can be; one that is turned off, all.
pub fn omega(
    automaton: &Automaton,
    map: &InputOutputMap,
    partition: &Partition,
    mode: Mode,
) -> Vec<Row> {
    let positions = Positions::of(automaton, map, partition);
    let mut rows = Vec::new();
    if let (Some(start), Some(target)) = (&map.start, automaton.initial()) {
        rows.push(Row {
            number: 1,
            source: None,
            trigger: Trigger::Start(start.clone()),
            target,
            latch: None,
            unlatch: Vec::new(),
        });
    }
    for source in automaton.states() {
        let edges = automaton.edges(source);
        let (commands, events): (Vec<&Edge>, Vec<&Edge>) =
            edges.iter().partition(|edge| automaton.label(**edge).is_controllable());
        let has_choice = commands.len() > 1;
        for edge in events.into_iter().filter(|edge| edge.target != source) {
            rows.push(Row {
                number: rows.len() + 1,
                source: Some(source),
                trigger: Trigger::Event(automaton.label(*edge)),
                target: edge.target,
                latch: None,
                unlatch: Vec::new(),
            });
        }
        for edge in commands {
            let label = automaton.label(*edge);
            let (latch, unlatch) = action(map, partition, label, |switch, position| {
                positions.possible(source, switch, position)
            });
            rows.push(Row {
                number: rows.len() + 1,
                source: Some(source),
                trigger: if mode.asks(has_choice) {
                    Trigger::Request(label, request(automaton, partition, label))
                } else {
                    Trigger::Command(label)
                },
                target: edge.target,
                latch,
                unlatch,
            });
        }
    }
    rows
}

impl Mode {
    /// Whether a command waits for its request; `has_choice` where others are enabled with it.
    pub(crate) fn asks(self, has_choice: bool) -> bool {
        match self {
            Self::Automatic => false,
            Self::Manual => has_choice,
            Self::Requested => true,
        }
    }
}

/// x^σ: as the map has it, or `request_σ`.
pub(crate) fn request(automaton: &Automaton, partition: &Partition, label: Label) -> Name {
    partition.request(label).cloned().unwrap_or_else(|| {
        let name = automaton.alphabet().name(label);
        super::Names::default().fresh(&[&format!("request_{name}")])
    })
}

/// x and X' of a command; `can_be` says whether a switch can be in a position.
pub(crate) fn action(
    map: &InputOutputMap,
    partition: &Partition,
    label: Label,
    can_be: impl Fn(usize, usize) -> bool,
) -> (Option<Name>, Vec<Name>) {
    match partition.meaning(label) {
        Some(Meaning::Switch { switch, position }) => {
            let signals = map.switches[switch].positions.iter().enumerate();
            let others = signals
                .filter(|(place, _)| {
                    position == 0 || (place + 1 != position && can_be(switch, place + 1))
                })
                .map(|(_, other)| other.signal.clone())
                .collect();
            let latch =
                (position > 0).then(|| map.switches[switch].positions[position - 1].signal.clone());
            (latch, others)
        }
        Some(Meaning::Pulse(pulse)) => (Some(map.pulses[pulse].signal.clone()), Vec::new()),
        Some(Meaning::Input(_) | Meaning::Timer(_)) | None => (None, Vec::new()),
    }
}

/// The rows as the thesis prints them: number, current state, event, next state, latch, unlatch. A request bears the mark '.
pub fn table(automaton: &Automaton, rows: &[Row]) -> String {
    let mut cells = vec![
        ["Rung", "Current state", "Event", "Next state", "Latch", "Unlatch"]
            .map(str::to_owned)
            .to_vec(),
    ];
    for row in rows {
        let (mark, event) = match &row.trigger {
            Trigger::Start(signal) => ("", signal.to_string()),
            Trigger::Event(label) => ("", automaton.alphabet().name(*label)),
            Trigger::Command(_) => ("", "∅".to_owned()),
            Trigger::Request(_, signal) => ("'", signal.to_string()),
        };
        let unlatch: Vec<&str> = row.unlatch.iter().map(Name::as_str).collect();
        let empty = || "∅".to_owned();
        cells.push(vec![
            format!("{}{mark}", row.number),
            row.source.map_or_else(empty, |state| automaton.state_name(state).into_owned()),
            event,
            automaton.state_name(row.target).into_owned(),
            row.latch.as_ref().map_or_else(empty, Name::to_string),
            if unlatch.is_empty() { empty() } else { format!("{{{}}}", unlatch.join(", ")) },
        ]);
    }
    let width = |column: usize| {
        let widths = cells.iter().map(|row| row[column].chars().count());
        widths.max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..6).map(width).collect();
    let mut text = String::new();
    for row in &cells {
        let mut line = String::new();
        for (cell, width) in row.iter().zip(&widths) {
            let _ = write!(line, "{cell:<width$}  ");
        }
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}
