//! Function blocks as registers. Each is the block of `interpreter/blocks.rs` with times as counts of scans; the tests prove it.

use understudy_logic::Expression;

use super::number::{Number, width};
use super::{Lowering, preset_scans};
use crate::program::{Block, BlockKind};

impl<'a> Lowering<'a> {
    /// Makes the bits of a block: its number, its clocks, its outputs.
    pub(super) fn declare(&mut self, block: &'a Block) {
        let name = block.name.as_str();
        let (maximum, initial, word) = match block.kind {
            BlockKind::Ton(preset) | BlockKind::Tp(preset) => {
                (preset_scans(preset, self.period), 0, "scans")
            }
            BlockKind::Tof(preset) => {
                let scans = preset_scans(preset, self.period);
                (scans, scans, "scans")
            }
            BlockKind::Ctu(value) | BlockKind::Ctd(value) | BlockKind::Ctud(value) => {
                (u64::from(value), 0, "CV")
            }
            BlockKind::Sr | BlockKind::Rs | BlockKind::RTrig | BlockKind::FTrig => (0, 0, ""),
        };
        let first = self.slots.len();
        for place in 0..width(maximum) {
            self.slot(format!("{name}.{word}.{place}"), initial >> place & 1 == 1);
        }
        self.numbers.insert(name, (first, width(maximum)));
        let clocks: &[&'static str] = match block.kind {
            BlockKind::Ctu(_) => &["CU"],
            BlockKind::Ctd(_) => &["CD"],
            BlockKind::Ctud(_) => &["CU", "CD"],
            BlockKind::RTrig | BlockKind::FTrig => &["CLK"],
            _ => &[],
        };
        for &pin in clocks {
            let place = self.slot(format!("{name}.{pin}"), false);
            self.clocks.insert((name, pin), place);
        }
        for pin in block.kind.outputs() {
            let pin = format!("{name}.{pin}");
            let place = self.slot(pin.clone(), false);
            self.places.insert(pin, place);
        }
    }

    /// The block's first output.
    pub(super) fn block(&mut self, block: &'a Block, wire: Expression) -> Expression {
        let mut fed = Vec::new();
        for feed in &block.pins {
            let rail = self.graph.constant(true);
            fed.push((feed.pin.as_str(), self.series(&feed.network, rail)));
        }
        let off = self.graph.constant(false);
        let input = |pin: &str| {
            let found = fed.iter().find(|(name, _)| *name == pin);
            found.map_or(off, |(_, value)| *value)
        };
        let name = block.name.as_str();
        let outputs = match block.kind {
            BlockKind::Ton(_) => vec![self.on_delay(block, wire)],
            BlockKind::Tof(_) => vec![self.off_delay(block, wire)],
            BlockKind::Tp(_) => vec![self.pulse(block, wire)],
            BlockKind::Ctu(preset) => {
                let up = self.clock(name, "CU", wire);
                let number = self.count(block, up, off);
                let keep = self.graph.not(input("R"));
                let number = number.masked(&mut self.graph, keep);
                self.store(name, &number);
                vec![number.equals(&mut self.graph, u64::from(preset))]
            }
            BlockKind::Ctd(preset) => {
                let down = self.clock(name, "CD", wire);
                let number = self.count(block, off, down);
                let number = number.loaded(&mut self.graph, input("LD"), u64::from(preset));
                self.store(name, &number);
                vec![number.equals(&mut self.graph, 0)]
            }
            BlockKind::Ctud(preset) => {
                let preset = u64::from(preset);
                let up = self.clock(name, "CU", wire);
                let down = self.clock(name, "CD", input("CD"));
                let number = self.count(block, up, down);
                let number = number.loaded(&mut self.graph, input("LD"), preset);
                let keep = self.graph.not(input("R"));
                let number = number.masked(&mut self.graph, keep);
                self.store(name, &number);
                let full = number.equals(&mut self.graph, preset);
                vec![full, number.equals(&mut self.graph, 0)]
            }
            BlockKind::Sr => {
                let latched = self.signal(&format!("{name}.Q1"));
                let keep = self.graph.not(input("R"));
                let kept = self.graph.and(keep, latched);
                vec![self.graph.or(wire, kept)]
            }
            BlockKind::Rs => {
                let latched = self.signal(&format!("{name}.Q1"));
                let keep = self.graph.not(input("R1"));
                let set = self.graph.or(wire, latched);
                vec![self.graph.and(keep, set)]
            }
            BlockKind::RTrig => vec![self.clock(name, "CLK", wire)],
            BlockKind::FTrig => {
                let low = self.graph.not(wire);
                vec![self.clock(name, "CLK", low)]
            }
        };
        for (pin, &value) in block.kind.outputs().iter().zip(&outputs) {
            let place = self.places[&format!("{name}.{pin}")];
            self.write(place, value);
        }
        outputs[0]
    }

    fn clock(&mut self, block: &'a str, pin: &'static str, value: Expression) -> Expression {
        self.rising(self.clocks[&(block, pin)], value)
    }

    fn store(&mut self, block: &str, number: &Number) {
        let (first, _) = self.numbers[block];
        for (place, &bit) in number.0.iter().enumerate() {
            self.write(first + place, bit);
        }
    }

    fn is_full(&mut self, block: &Block, scans: &Number) -> Expression {
        let preset = block.kind.preset_time().unwrap_or_default();
        scans.equals(&mut self.graph, preset_scans(preset, self.period))
    }

    /// Counts the scans with power, up to the preset; on while power is there and they were full before.
    fn on_delay(&mut self, block: &Block, wire: Expression) -> Expression {
        let scans = self.number(&block.name);
        let full = self.is_full(block, &scans);
        let counting = self.graph.not(full);
        let next = scans.increment(&mut self.graph, counting);
        let next = next.masked(&mut self.graph, wire);
        self.store(&block.name, &next);
        self.graph.and(wire, full)
    }

    /// Counts the scans without power, up to the preset, where it begins; off when they were full before.
    fn off_delay(&mut self, block: &Block, wire: Expression) -> Expression {
        let scans = self.number(&block.name);
        let full = self.is_full(block, &scans);
        let counting = self.graph.not(full);
        let next = scans.increment(&mut self.graph, counting);
        let idle = self.graph.not(wire);
        let next = next.masked(&mut self.graph, idle);
        self.store(&block.name, &next);
        self.graph.or(wire, counting)
    }

    /// Counts the scans of the pulse; when it is full the pulse is over, and it begins again only after a scan without power.
    fn pulse(&mut self, block: &Block, wire: Expression) -> Expression {
        let scans = self.number(&block.name);
        let full = self.is_full(block, &scans);
        let idle = scans.equals(&mut self.graph, 0);
        let running = self.graph.not(idle);
        let begun = self.graph.or(running, wire);
        let unfinished = self.graph.not(full);
        let output = self.graph.and(unfinished, begun);
        let next = scans.increment(&mut self.graph, output);
        let waiting = self.graph.and(full, wire);
        let keep = self.graph.or(waiting, output);
        let next = next.masked(&mut self.graph, keep);
        self.store(&block.name, &next);
        output
    }

    /// The counter after its clocks, bounded by 0 and the preset; both at once do nothing.
    fn count(&mut self, block: &Block, up: Expression, down: Expression) -> Number {
        let old = self.number(&block.name);
        let preset = u64::from(block.kind.preset_value().unwrap_or_default());
        let full = old.equals(&mut self.graph, preset);
        let empty = old.equals(&mut self.graph, 0);
        let [not_up, not_down, not_full, not_empty] =
            [up, down, full, empty].map(|value| self.graph.not(value));
        let more = self.graph.all([up, not_down, not_full]);
        let less = self.graph.all([down, not_up, not_empty]);
        old.increment(&mut self.graph, more).decrement(&mut self.graph, less)
    }
}
