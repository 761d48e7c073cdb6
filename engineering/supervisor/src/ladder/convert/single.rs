//! One supervisor: a rung for each row of Ω, bearing its number.

use super::super::map::InputOutputMap;
use super::super::omega::{Row, Trigger};
use super::super::partition::Meaning;
use super::super::rung::{any, closed, open, reset, set};
use super::{Converter, Element, Label, Name, repeats};

impl Converter<'_> {
    pub(super) fn single(&mut self, rows: &[Row]) {
        let automaton = self.automata[0];
        let mut by_event = std::collections::BTreeMap::<Label, Vec<&Row>>::new();
        for row in rows {
            if let Trigger::Event(label) = row.trigger {
                by_event.entry(label).or_default().push(row);
            }
        }
        let groups = self.groups.clone();
        for group in &groups {
            let label = group.label;
            let stands_again = groups.iter().any(|other| other.label == label && other.again);
            let consumed = stands_again || repeats(automaton, label);
            if !self.is_queued(label) && !group.again && (consumed || !self.is_level(label)) {
                let bit = self.detect(label, consumed);
                self.bits.insert(label, bit);
            }
            if consumed {
                self.consumed.insert(label);
            }
        }
        if self.map.one_event.is_some() {
            // One event at most moves the automaton, so the rungs stand by state, as in figure 13 of Uzam and Gelen.
            for row in rows {
                self.event_row(row, false);
            }
            by_event.clear();
        }
        for group in &groups {
            for row in by_event.get(&group.label).into_iter().flatten() {
                self.event_row(row, group.again);
            }
        }
        for row in rows {
            if let Some(label) = row.command() {
                self.command_row(row, label);
            }
        }
    }

    fn title(&self, row: &Row, label: Label, again: bool) -> String {
        let automaton = self.automata[0];
        let source = row.source.map_or_else(String::new, |state| self.shown(0, state));
        let again = if again { ", after another event" } else { "" };
        format!(
            "{}: {source} -- {} --> {}{again}",
            row.number,
            automaton.alphabet().name(label),
            self.shown(0, row.target)
        )
    }

    fn moves(&self, row: &Row) -> (Option<Name>, Name) {
        let source = row.source.map(|state| self.states[0][state.index()].clone());
        (source, self.states[0][row.target.index()].clone())
    }

    fn event_row(&mut self, row: &Row, again: bool) {
        let Trigger::Event(label) = row.trigger else {
            return;
        };
        let (Some(source), target) = self.moves(row) else {
            return;
        };
        let mut network = vec![open(&source)];
        let mut coils = vec![reset(&source), set(&target)];
        match self.bits.get(&label).cloned() {
            Some(bit) => {
                network.push(open(&bit));
                if self.consumed.contains(&label) {
                    coils.push(reset(&bit));
                }
            }
            None => network.extend(self.occurrence(label)),
        }
        let title = self.title(row, label, again);
        self.push(&title, network, coils);
    }

    fn command_row(&mut self, row: &Row, label: Label) {
        let (Some(source), target) = self.moves(row) else {
            return;
        };
        let mut network = vec![open(&source)];
        if let Trigger::Request(_, wanted) = &row.trigger {
            let request = self.ask(label, wanted);
            network.push(open(&request));
        }
        network.extend(self.commanded.iter().chain(&self.queued).map(closed));
        let mut coils = Vec::new();
        if source == target {
            network.extend(changes(self.map, self.partition.meaning(label)));
        } else {
            coils.extend([reset(&source), set(&target)]);
        }
        coils.extend(row.unlatch.iter().map(reset));
        coils.extend(row.latch.iter().map(set));
        coils.extend(self.commanded.iter().map(set));
        let title = self.title(row, label, false);
        self.push(&title, network, coils);
    }
}

/// Passes power while a command to a switch would change its position; the others always do something.
pub(super) fn changes(map: &InputOutputMap, meaning: Option<Meaning>) -> Option<Element> {
    match meaning {
        Some(Meaning::Switch { switch, position }) => {
            let positions = &map.switches[switch].positions;
            if position == 0 {
                any(positions.iter().map(|position| &position.signal))
            } else {
                Some(closed(&positions[position - 1].signal))
            }
        }
        _ => None,
    }
}
