//! Standard blocks: in the wire where they stood in it alone, else in a rung of their own.

use std::ops::Range;
use std::time::Duration;

use understudy_ladder::{
    Block, BlockKind, Contact, ContactKind, Element, Feed, MAXIMUM_PRESET_TIME,
    MAXIMUM_PRESET_VALUE, Name, Series,
};

use super::Drawing;
use super::scope::Binding;
use crate::plcopen::document::Ignored;
use crate::plcopen::literal::{integer, time};
use crate::plcopen::plan::{Action, Call, Input};
use crate::plcopen::power::Power;
use crate::plcopen::standard::StandardBlock;
use crate::plcopen::units::undeclared;

/// A block that waits for the wire behind it.
pub(super) struct Pending {
    instance: String,
    pin: &'static str,
    /// What feeds it, and the block.
    series: Series,
}

impl Drawing<'_> {
    /// Draws the blocks that the next step does not take into its wires.
    pub(super) fn flush_before(&mut self, action: &Action) {
        let mut uses = 0;
        for power in action.powers() {
            count(power, false, &mut |instance| {
                uses += usize::from(
                    self.pending
                        .iter()
                        .any(|pending| pending.instance.eq_ignore_ascii_case(instance)),
                );
            });
        }
        let by_name = self
            .pending
            .iter()
            .any(|pending| action.powers().iter().any(|power| names(power, &pending.instance)));
        // One step after the other: what one does not take at once gets a rung of its own.
        if uses != self.pending.len() || self.pending.len() > 1 || by_name {
            self.flush();
        }
    }

    pub(super) fn flush(&mut self) {
        for pending in std::mem::take(&mut self.pending) {
            self.rung(pending.series, Vec::new());
        }
    }

    /// The waiting block, where it is this one.
    pub(super) fn take_pending(
        &mut self,
        instance: &Name,
        pin: &Name,
        negated: bool,
    ) -> Option<Series> {
        let place = self.pending.iter().position(|pending| {
            !negated
                && pending.instance.eq_ignore_ascii_case(instance)
                && pending.pin == pin.as_str()
        })?;
        Some(self.pending.remove(place).series)
    }

    pub(super) fn call(&mut self, call: &Call, span: &Range<usize>) {
        let Some(standard) = StandardBlock::of(&call.type_name) else {
            self.general(format!("the block {}", call.type_name), call.type_name.span());
            return;
        };
        if call.enable.is_some() {
            self.general("a block with EN", span.clone());
        }
        match self.scope.find(&call.instance) {
            Some(Binding::Instance(_)) => {}
            None if call.is_named => {
                let found = undeclared(self.project, &call.instance, standard.word);
                self.diagnostics.push(found);
            }
            // The file gives no name.
            None => {}
            Some(_) => {
                let message = format!("`{}` is not declared as a {}", call.instance, standard.word);
                self.error("U1012", message, call.instance.span());
                return;
            }
        }
        let name = self.scope.declare_instance(&call.instance);
        if !self.drawn.insert(name.clone()) {
            self.general(format!("`{}` is called twice", call.instance), call.instance.span());
            return;
        }
        let mut wire = Vec::new();
        let mut pins = Vec::new();
        let mut preset = None;
        let mut wired = false;
        for input in &call.inputs {
            let Some(pin) = standard.input(&input.pin) else {
                let message = format!("{} has no input `{}`", standard.word, input.pin);
                self.error("U1008", message, input.pin.span());
                continue;
            };
            if matches!(pin, "PT" | "PV") {
                preset = Some(input);
                continue;
            }
            let network = self.input(input, span);
            if pin == standard.wire_input() {
                wire = network;
                wired = true;
            } else {
                let pin = Name::at(pin, input.pin.span());
                pins.push(Feed { pin, network });
            }
        }
        if !wired {
            wire = vec![self.constant_contact(false)];
        }
        let Some(kind) = self.kind(standard, preset, span) else {
            return;
        };
        self.feed_all(kind, &mut pins);
        wire.push(Element::Block(Block {
            name: Name::at(name.as_str(), call.instance.span()),
            kind,
            pins,
        }));
        if call.in_wire {
            self.flush();
            self.pending.push(Pending {
                instance: call.instance.to_string(),
                pin: standard.wire_output(),
                series: wire,
            });
        } else {
            self.rung(wire, Vec::new());
        }
    }

    /// What must be fed and is not gets a bit that is always 0; what is always on, one that is always 1.
    fn feed_all(&mut self, kind: BlockKind, pins: &mut Vec<Feed>) {
        for (pin, needed) in kind.side_inputs() {
            if *needed && !pins.iter().any(|feed| feed.pin.as_str() == *pin) {
                let network = vec![self.constant_contact(false)];
                pins.push(Feed { pin: (*pin).into(), network });
            }
        }
        for feed in pins.iter_mut().filter(|feed| feed.network.is_empty()) {
            feed.network = vec![self.constant_contact(true)];
        }
        let order = |feed: &Feed| {
            let mut names = kind.side_inputs().iter();
            names.position(|(pin, _)| *pin == feed.pin.as_str())
        };
        pins.sort_by_key(order);
    }

    /// The network of an input, with what its pin makes of it.
    fn input(&mut self, input: &Input, span: &Range<usize>) -> Series {
        let power =
            if input.modifier.negated { input.power.clone().not() } else { input.power.clone() };
        let Some(edge) = input.modifier.edge else {
            return self.series(&power);
        };
        let operand = self.kept_edge(&power, Some(edge), &format!("{}_edge", input.pin), span);
        vec![Element::Contact(Contact { kind: ContactKind::NormallyOpen, operand })]
    }

    fn kind(
        &mut self,
        standard: StandardBlock,
        preset: Option<&Input>,
        span: &Range<usize>,
    ) -> Option<BlockKind> {
        let kind = BlockKind::of_word(standard.word)?;
        Some(match (kind.preset_time(), kind.preset_value()) {
            (Some(_), _) => kind.with_time(self.time(preset, span)?),
            (_, Some(_)) => kind.with_value(self.count(preset, span)?),
            (None, None) => kind,
        })
    }

    /// A preset that is not connected is nought.
    fn time(&mut self, preset: Option<&Input>, span: &Range<usize>) -> Option<Duration> {
        let Some(preset) = preset else {
            return Some(Duration::ZERO);
        };
        let Power::Read(read) = &preset.power else {
            self.general("a preset that is calculated", span.clone());
            return None;
        };
        if let Some(time) = time(&read.text) {
            return Some(time);
        }
        let number = match (integer(&read.text), self.scope.find(&read.text)) {
            (Some(number), _) => Some(number),
            (None, Some(Binding::Number(number))) if !self.writes(&read.text) => Some(number),
            _ => None,
        };
        if let Some(scans) = number.and_then(|number| u32::try_from(number).ok()) {
            // Not of the standard: one tool counts scans.
            let what = format!(
                "the type of the preset `{}`, which counts scans of {:?},",
                read.text, self.period
            );
            let span = read.text.span();
            self.ignored.push(Ignored { what, span });
            return Some(self.period.saturating_mul(scans).min(MAXIMUM_PRESET_TIME));
        }
        match self.scope.find(&read.text) {
            Some(Binding::Time(time)) if !self.writes(&read.text) => Some(time),
            Some(_) => {
                self.general(
                    format!("the preset `{}` is not a constant duration", read.text),
                    read.text.span(),
                );
                None
            }
            None => {
                let message = format!("`{}` is not a duration", read.text);
                self.error("U1011", message, read.text.span());
                None
            }
        }
    }

    fn count(&mut self, preset: Option<&Input>, span: &Range<usize>) -> Option<u16> {
        let Some(preset) = preset else {
            return Some(0);
        };
        let Power::Read(read) = &preset.power else {
            self.general("a preset that is calculated", span.clone());
            return None;
        };
        let value = match (integer(&read.text), self.scope.find(&read.text)) {
            (Some(value), _) => value,
            (None, Some(Binding::Number(value))) if !self.writes(&read.text) => value,
            (None, Some(_)) => {
                self.general(
                    format!("the preset `{}` is not a constant number", read.text),
                    read.text.span(),
                );
                return None;
            }
            (None, None) => {
                self.error("U1011", format!("`{}` is not a number", read.text), read.text.span());
                return None;
            }
        };
        let preset = u16::try_from(value).ok().filter(|value| *value <= MAXIMUM_PRESET_VALUE);
        if preset.is_none() {
            let message = format!("the preset {value} is not between 0 and {MAXIMUM_PRESET_VALUE}");
            self.error("U1011", message, read.text.span());
        }
        preset
    }

    /// Whether any step writes the variable.
    pub(super) fn writes(&self, variable: &Name) -> bool {
        self.plan.steps.iter().any(|step| match &step.action {
            Action::Write { targets, .. } => {
                targets.iter().any(|(target, _)| target.eq_ignore_ascii_case(variable))
            }
            _ => false,
        })
    }
}

/// Calls `see` with the instance of each output in a wire, not behind a negation or in a function.
fn count(power: &Power, hidden: bool, see: &mut impl FnMut(&str)) {
    match power {
        Power::Output(instance, _) if !hidden => see(instance),
        Power::All(parts) | Power::Any(parts) => {
            parts.iter().for_each(|part| count(part, hidden, see))
        }
        Power::Not(inner) => count(inner, true, see),
        Power::Function(_, inputs) => inputs.iter().for_each(|(_, input)| count(input, true, see)),
        _ => {}
    }
}

/// Whether a variable of the instance is read by its name.
fn names(power: &Power, instance: &str) -> bool {
    let mut found = false;
    power.visit(&mut |part| {
        if let Power::Read(read) = part {
            found |= read
                .text
                .split_once('.')
                .is_some_and(|(name, _)| name.eq_ignore_ascii_case(instance));
        }
    });
    found
}
