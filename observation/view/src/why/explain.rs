//! Follows a signal back: through the rungs above, through blocks, and through the cycles before.
//!
//! Bounded by [`DEEPEST`] and [`MOST`]; the last reason states it.

mod blocks;

use std::collections::{HashMap, HashSet};
use std::rc::Rc;

use understudy_ladder::{CoilKind, ContactKind, Element, Evaluation, Program, Reading};
use understudy_typed::Part;

use super::power::{Node, behind, nodes};
use super::{Reason, end_of_history};
use crate::error::ViewError;
use crate::history::History;
use crate::model::Model;
use crate::value::shown;

/// Reasons within reasons.
const DEEPEST: usize = 24;

/// Reasons in all.
const MOST: usize = 300;

/// Cycles that are gone back through to find what started a timer: each of them is scanned.
const FARTHEST: usize = 4096;

pub(super) struct Explainer<'m> {
    model: &'m Model,
    history: &'m History,
    program: &'m Program,
    evaluations: HashMap<usize, Option<Rc<Evaluation>>>,
    told: HashSet<(String, usize, usize)>,
    count: usize,
}

/// A coil that decided a signal in a scan.
struct Decision {
    rung: usize,
    kind: CoilKind,
}

impl<'m> Explainer<'m> {
    pub(super) fn new(model: &'m Model, history: &'m History, program: &'m Program) -> Self {
        Self {
            model,
            history,
            program,
            evaluations: HashMap::new(),
            told: HashSet::new(),
            count: 0,
        }
    }

    /// A variable, or a part of one, as it was after the scan of the step at `place`.
    pub(super) fn root(&mut self, part: &Part, place: usize) -> Result<Reason, ViewError> {
        let evaluation = self.model.evaluation_at(self.history, place)?;
        let name = part.name.as_str();
        let of = |signals: &[understudy_ladder::Signal], values: &[bool]| {
            let found = signals.iter().position(|signal| signal.name.as_str() == name);
            found.and_then(|found| values.get(found).copied())
        };
        let value = of(&self.program.outputs, &evaluation.outputs)
            .or_else(|| of(&self.program.memory, &evaluation.memory))
            .or_else(|| of(&self.program.inputs, &evaluation.inputs));
        self.evaluations.insert(place, Some(Rc::new(evaluation)));
        if let Some(value) = value {
            return Ok(self.signal(name, value, place, self.program.rungs.len(), 0));
        }
        // A pin or the value of a block, or what sees an edge.
        let state = self.model.state_after(self.history, place)?;
        let because = name.rsplit_once('.').and_then(|(block, pin)| {
            let rung = self.rung_of(block)?;
            let fed = self.fed(block, pin, rung, place);
            fed.or_else(|| Some(vec![self.block_at(block, rung, place, 1)?]))
        });
        let text = if because.is_some() { "after the scan" } else { "no signal of a rung" };
        let declared = part.declared();
        let stored = part.stored(&state).zip(declared.as_ref());
        let value = stored.map(|((_, stored), declared)| shown(declared, stored));
        Ok(Reason {
            value: value.unwrap_or_default(),
            of: declared,
            because: because.unwrap_or_default(),
            ..self.leaf(name, false, place, text)
        })
    }

    fn evaluation(&mut self, place: usize) -> Option<Rc<Evaluation>> {
        let found = self.evaluations.get(&place).cloned();
        found.unwrap_or_else(|| {
            let evaluation = self.model.evaluation_at(self.history, place).ok();
            let evaluation = evaluation.map(Rc::new);
            self.evaluations.insert(place, evaluation.clone());
            evaluation
        })
    }

    fn cycle(&self, place: usize) -> i64 {
        self.history.steps()[place].cycle
    }

    fn leaf(&self, signal: &str, value: bool, place: usize, text: impl Into<String>) -> Reason {
        Reason {
            at: None,
            signal: signal.to_owned(),
            value: value.into(),
            of: None,
            unit: None,
            cycle: self.cycle(place),
            rung: None,
            title: None,
            line: None,
            statement: None,
            text: text.into(),
            because: Vec::new(),
        }
    }

    /// A signal as a contact in the rung `below` reads it: as the rungs above have left it.
    fn signal(
        &mut self,
        name: &str,
        value: bool,
        place: usize,
        below: usize,
        depth: usize,
    ) -> Reason {
        if self.program.inputs.iter().any(|input| input.name.as_str() == name) {
            return self.input(name, value, place);
        }
        self.count += 1;
        if depth > DEEPEST || self.count > MOST {
            return self.leaf(name, value, place, "further causes omitted");
        }
        if !self.told.insert((name.to_owned(), place, below)) {
            return self.leaf(name, value, place, "explained above");
        }
        let Some(evaluation) = self.evaluation(place) else {
            return self.leaf(name, value, place, "the earlier state is not known");
        };
        if let Some(decision) = self.decision(name, &evaluation, below) {
            return self.decided(name, value, [place, place], &decision, &evaluation, depth);
        }
        if !value {
            // For a latch that is off, the missing set condition explains more than the last reset.
            let because = self.not_set(name, &evaluation, below, place, depth);
            if !because.is_empty() {
                let reason = self.leaf(name, value, place, "no rung writes it");
                return Reason { because, ..reason };
            }
        }
        let at = match self.changed(name, value, place) {
            Ok(at) => at,
            Err(end) => return self.leaf(name, value, place, self.end_of_history(end)),
        };
        let Some(evaluation) = self.evaluation(at) else {
            return self.leaf(name, value, place, "the earlier state is not known");
        };
        match self.decision(name, &evaluation, self.program.rungs.len()) {
            Some(decision) => self.decided(name, value, [place, at], &decision, &evaluation, depth),
            None => self.leaf(name, value, place, self.end_of_history(at)),
        }
    }

    /// The last step before the one at `place` whose scan changed a signal to `value`; the first step that is known where none did.
    fn changed(&self, name: &str, value: bool, place: usize) -> Result<usize, usize> {
        let version = self.model.version_at(self.history, place).map_err(|_| place)?;
        let bit = version.controller().code.bit_of(name);
        let mut at = place;
        loop {
            let before = self.history.scan_before(at).ok_or(at)?;
            let state = self.history.steps()[before].sampled.as_ref();
            let was = bit.and_then(|bit| Some(state?.state.get(bit)));
            if was != Some(value) {
                return Ok(before);
            }
            at = before;
        }
    }

    /// Why there is nothing before the step at `place`.
    fn end_of_history(&self, place: usize) -> String {
        end_of_history(self.history, place)
    }

    fn input(&self, name: &str, value: bool, place: usize) -> Reason {
        let version = self.model.version_at(self.history, place).ok();
        let point = version.and_then(|it| it.controller().interface.inputs.find(name));
        let at = |place| self.model.input_at(self.history, place, point?);
        let mut since = place;
        while let Some(before) = self.history.before(since) {
            if at(before) != Some(u64::from(value)) {
                break;
            }
            since = before;
        }
        let known = self.history.before(since).is_some() || self.history.begins_at(since);
        let text = match (since == place, known) {
            (true, true) => "input, new in this cycle".to_owned(),
            (false, true) => format!("input, since cycle {}", self.cycle(since)),
            (_, false) => format!("input, since cycle {} or longer", self.cycle(since)),
        };
        self.leaf(name, value, place, text)
    }

    /// The last coil above the rung `below` that decided a signal in a scan.
    fn decision(&self, name: &str, evaluation: &Evaluation, below: usize) -> Option<Decision> {
        let rungs = self.program.rungs[..below].iter().enumerate().rev();
        for (rung, written) in rungs {
            for coil in written.coils.iter().rev() {
                let decides = !coil.kind.is_latch() || evaluation.rungs[rung].power;
                if coil.target.as_str() == name && decides {
                    let kind = coil.kind;
                    return Some(Decision { rung, kind });
                }
            }
        }
        None
    }

    fn decided(
        &mut self,
        name: &str,
        value: bool,
        [place, at]: [usize; 2],
        decision: &Decision,
        evaluation: &Rc<Evaluation>,
        depth: usize,
    ) -> Reason {
        let power = evaluation.rungs[decision.rung].power;
        let how = match (decision.kind, power) {
            (CoilKind::Set, _) => "is set",
            (CoilKind::Reset, _) => "is reset",
            (CoilKind::Plain, true) => "has power",
            (CoilKind::Plain, false) => "has no power",
            (CoilKind::Negated, true) => "has power, and the coil is negated",
            (CoilKind::Negated, false) => "has no power, and the coil is negated",
            (CoilKind::Rising, _) if value => "its rung has just got power",
            (CoilKind::Rising, true) => "its rung had power already",
            (CoilKind::Rising, false) => "its rung has no power",
            (CoilKind::Falling, _) if value => "its rung has just lost power",
            (CoilKind::Falling, true) => "its rung has power",
            (CoilKind::Falling, false) => "its rung had no power before",
        };
        let when = if at == place {
            String::new()
        } else {
            format!(" in cycle {}, and unchanged since", self.cycle(at))
        };
        let rung = &self.program.rungs[decision.rung];
        Reason {
            at: None,
            signal: name.to_owned(),
            value: value.into(),
            of: None,
            unit: None,
            cycle: self.cycle(place),
            rung: Some(decision.rung + 1),
            title: rung.title.clone().filter(|title| !title.is_empty()),
            line: None,
            statement: None,
            text: format!("{how}{when}"),
            because: self.power_of(decision.rung, evaluation, at, depth + 1),
        }
    }

    /// Why the set coils of a signal have no power.
    fn not_set(
        &mut self,
        name: &str,
        evaluation: &Rc<Evaluation>,
        below: usize,
        place: usize,
        depth: usize,
    ) -> Vec<Reason> {
        let sets = self.program.rungs[..below].iter().enumerate();
        let sets: Vec<usize> = sets
            .filter(|(_, rung)| {
                let mut coils = rung.coils.iter();
                coils.any(|coil| coil.kind == CoilKind::Set && coil.target.as_str() == name)
            })
            .map(|(rung, _)| rung)
            .collect();
        let mut reasons = Vec::new();
        for rung in sets {
            reasons.extend(self.power_of(rung, evaluation, place, depth + 1));
        }
        reasons
    }

    /// Why a rung has power, or why not.
    fn power_of(
        &mut self,
        rung: usize,
        evaluation: &Rc<Evaluation>,
        place: usize,
        depth: usize,
    ) -> Vec<Reason> {
        let flow = &evaluation.rungs[rung];
        let network = nodes(&self.program.rungs[rung].network, &mut flow.elements.iter());
        let elements = behind(&network, flow.power);
        self.elements(&elements, rung, place, depth)
    }

    fn elements(
        &mut self,
        elements: &[&Node<'_>],
        rung: usize,
        place: usize,
        depth: usize,
    ) -> Vec<Reason> {
        elements.iter().map(|node| self.element(node, rung, place, depth)).collect()
    }

    fn element(&mut self, node: &Node<'_>, rung: usize, place: usize, depth: usize) -> Reason {
        match node.element {
            Element::Contact(contact) => {
                let value = node.flow.reading == Reading::Bit(true);
                let read = (contact.operand.as_str(), value);
                let mut reason = self.operand(read, (rung, node.element), place, depth);
                let edge = match (contact.kind, node.flow.passes) {
                    (ContactKind::Rising, true) => "has a rising edge; ",
                    (ContactKind::Rising, false) => "has no rising edge; ",
                    (ContactKind::Falling, true) => "has a falling edge; ",
                    (ContactKind::Falling, false) => "has no falling edge; ",
                    _ => "",
                };
                reason.text.insert_str(0, edge);
                reason
            }
            Element::Comparison(comparison) => {
                let number = match node.flow.reading {
                    Reading::Number(number) => number,
                    _ => 0,
                };
                let relation = comparison.relation.sign();
                let signal = format!("{}.CV {relation} {}", comparison.counter, comparison.value);
                let mut reason =
                    self.leaf(&signal, node.flow.passes, place, format!("CV is {number}"));
                let counter = comparison.counter.as_str();
                let found = self.block(counter, (rung, node.element), place, depth + 1);
                reason.because = found.into_iter().collect();
                reason
            }
            Element::Block(block) => {
                let found = self.block_at(&block.name, rung, place, depth);
                found.unwrap_or_else(|| self.leaf(&block.name, node.flow.leaves, place, ""))
            }
            Element::Branches(_) => self.leaf("branches", node.flow.leaves, place, ""),
        }
    }

    fn operand(
        &mut self,
        (operand, value): (&str, bool),
        (rung, element): (usize, &Element),
        place: usize,
        depth: usize,
    ) -> Reason {
        let block = operand.rsplit_once('.').map(|(block, _)| block);
        let at = (rung, element);
        let explained = block.and_then(|block| self.block(block, at, place, depth));
        match explained {
            Some(reason) => Reason { signal: operand.to_owned(), value: value.into(), ..reason },
            None => self.signal(operand, value, place, rung, depth + 1),
        }
    }
}
