//! Events that wait for their turn: one of them is processed in a scan.
//!
//! Of the events that wait, the first one in the order of the queue that the automata can do now is next. Where they can do none
//! of them, all are ignored, so that none waits for a state that comes later by other events. No command is generated while an
//! event waits, because it might be forbidden after it.

use understudy_ladder::{Comparison, Name, Relation, Signal};

use super::super::rung::{any, closed, open, reset, set, write};
use super::{Block, BlockKind, Coil, Converter, Element, Label};

/// The preset of the counters: as far as they count.
const MOST: u16 = 32_767;

impl Converter<'_> {
    pub(super) fn queue(&mut self) {
        let order = self.partition.queue();
        if order.is_empty() {
            return;
        }
        let mut occurring = Vec::new();
        for &label in order {
            let occurs = self.detect(label, false);
            let event = self.event_name(label);
            let description = format!("{event} waits for its turn");
            let waiting = self.memory(&[&event, "waiting"], &description);
            self.waiting.insert(label, waiting.clone());
            let turn = self.memory(&[&event, "turn"], "");
            self.bits.insert(label, turn.clone());
            occurring.push((label, event, occurs, waiting, turn));
        }
        let twice =
            occurring.iter().map(|(_, _, occurs, waiting, _)| vec![open(occurs), open(waiting)]);
        let twice: Vec<Vec<Element>> = twice.collect();
        self.lost(twice);
        let taken = self.memory(&["taken"], "an event is processed in this scan");
        let turns = occurring.iter().map(|(_, _, _, _, turn)| reset(turn));
        let coils = [reset(&taken)].into_iter().chain(turns).collect();
        self.push("no event processed yet", Vec::new(), coils);
        for (_, event, occurs, waiting, _) in &occurring {
            let network = [open(occurs)].into_iter().chain(self.started.iter().map(open)).collect();
            self.push(&format!("{event} waits"), network, vec![set(waiting)]);
        }
        for (label, event, _, waiting, turn) in &occurring {
            let mut network = vec![open(waiting), closed(&taken)];
            for index in self.modules.witnesses(*label) {
                network.extend(self.allows(index, *label));
            }
            let coils = vec![set(turn), reset(waiting), set(&taken)];
            self.push(&format!("turn of {event}"), network, coils);
        }
        let waiting: Vec<Name> =
            occurring.into_iter().map(|(_, _, _, waiting, _)| waiting).collect();
        self.ignored(&waiting, &taken);
        if !self.modules.alphabet().labels().any(Label::is_controllable) {
            return;
        }
        let queued = self.memory(&["queued"], "an event waits for its turn");
        self.push("an event waits", any(&waiting).into_iter().collect(), vec![write(&queued)]);
        self.queued = Some(queued);
    }

    /// Counts events that come while the same one waits, and tells of them by an output.
    fn lost(&mut self, mut twice: Vec<Vec<Element>>) {
        let name = self.names.fresh(&["lost"]);
        let mut network = match twice.len() {
            1 => twice.remove(0),
            _ => vec![Element::Branches(twice)],
        };
        network.push(counter(&name));
        self.push("count events that come again while they wait", network, Vec::new());
        let output = self.names.fresh(&["event_lost"]);
        self.program.outputs.push(Signal {
            description: Some(
                "an event has been lost, because it came again while it waited".into(),
            ),
            ..Signal::new(output.clone())
        });
        let any_lost = Comparison { counter: name, relation: Relation::GreaterOrEqual, value: 1 };
        let network = vec![Element::Comparison(any_lost)];
        self.push("an event has been lost", network, vec![write(&output)]);
    }

    /// Counts and removes events that cannot occur in any order.
    fn ignored(&mut self, waiting: &[Name], taken: &Name) {
        let name = self.names.fresh(&["ignored"]);
        let mut network = vec![closed(taken)];
        network.extend(any(waiting));
        network.push(counter(&name));
        self.push("count scans that ignore events", network, Vec::new());
        let coils: Vec<Coil> = waiting.iter().map(reset).collect();
        self.push("ignore events that are not possible", vec![closed(taken)], coils);
    }

    /// Whether `label` waits for its turn, so that its bit is on for one scan and needs no reset at the end.
    pub(super) fn is_queued(&self, label: Label) -> bool {
        self.waiting.contains_key(&label)
    }
}

fn counter(name: &Name) -> Element {
    Element::Block(Block { name: name.clone(), kind: BlockKind::Ctu(MOST), pins: Vec::new() })
}
