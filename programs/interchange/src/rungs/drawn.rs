//! What a drawing has and its statements say in more words: edges of contacts and coils, several coils of one power, blocks in a wire.
//!
//! ```text
//! edge.0(CLK := a); y := edge.0.Q AND b;               +a b ( y )
//! power.1 := a AND b; y := power.1; z := NOT power.1;   a b ( y ) (/z )
//! pause(IN := a, PT := T#3s); y := pause.Q;            a {TON pause 3s} ( y )
//! ```

use std::collections::{HashMap, HashSet};

use understudy_ladder::{
    Block, BlockKind, Coil, CoilKind, Contact, ContactKind, Element, Name as Written, Rung, Series,
    visit,
};
use understudy_structured_text::syntax::{
    Argument, Body, Expression, ExpressionKind, Name, Path, Span, Statement, StatementKind, Unit,
};

use super::network::Power;
use super::signals::Known;
use super::{Found, Writer, coil, contact};

/// Whether a reader has declared it, and not a person: with a dot it is no name that one can write.
pub(super) fn is_made(name: &Name) -> bool {
    name.as_str().contains('.')
}

/// How the statements of a unit use its variables, by their names in capitals. What no rung holds is left out.
#[derive(Debug, Default)]
pub(super) struct Uses {
    /// How often each is read.
    reads: HashMap<String, usize>,
    /// Which are written.
    written: HashSet<String>,
}

impl Uses {
    pub(super) fn of(unit: &Unit) -> Self {
        let mut uses = Self::default();
        if let Body::Statements(statements) = &unit.body {
            uses.statements(statements);
        }
        uses
    }

    pub(super) fn reads(&self, key: &str) -> bool {
        self.reads.contains_key(key)
    }

    pub(super) fn writes(&self, key: &str) -> bool {
        self.written.contains(key)
    }

    fn statements(&mut self, statements: &[Statement]) {
        for statement in statements {
            match &statement.kind {
                StatementKind::Assign(target, value) => {
                    self.written.insert(target.root.key());
                    self.expression(value);
                }
                StatementKind::Call(_, arguments) => self.arguments(arguments),
                StatementKind::If(branches, otherwise) => {
                    for (condition, body) in branches {
                        self.expression(condition);
                        self.statements(body);
                    }
                    self.statements(otherwise);
                }
                _ => {}
            }
        }
    }

    fn arguments(&mut self, arguments: &[Argument]) {
        for argument in arguments {
            match argument {
                Argument::Given(_, value) | Argument::Placed(value) => self.expression(value),
                Argument::Taken { to, .. } => {
                    self.written.insert(to.root.key());
                }
            }
        }
    }

    fn expression(&mut self, value: &Expression) {
        match &value.kind {
            ExpressionKind::Variable(path) => {
                *self.reads.entry(path.root.key()).or_default() += 1;
            }
            ExpressionKind::Not(inner) => self.expression(inner),
            ExpressionKind::Call(_, arguments) => self.arguments(arguments),
            ExpressionKind::Chain(first, rest) => {
                self.expression(first);
                rest.iter().for_each(|(_, value)| self.expression(value));
            }
            _ => {}
        }
    }
}

impl<'f> Writer<'f> {
    /// Takes the call of a trigger that a reader made for an edge. Whoever reads it has the edge itself where that is asked for once, or is of an input,
    /// which is the same in the whole scan; else a bit has it.
    pub(super) fn edge_called(&mut self, path: &Path, arguments: &'f [Argument]) -> Found<bool> {
        let key = path.root.key();
        let (true, [Argument::Given(_, value)]) = (is_made(&path.root), arguments) else {
            return Ok(false);
        };
        let is_rising = match self.known.get(&key) {
            Some(Known::Block { kind: BlockKind::RTrig, .. }) => true,
            Some(Known::Block { kind: BlockKind::FTrig, .. }) => false,
            _ => return Ok(false),
        };
        let power = match self.power(value, false, 0)? {
            Power::Through(power) => power,
            Power::On => Vec::new(),
            Power::Off => return Ok(false),
        };
        let is_input =
            matches!(power.as_slice(), [Element::Contact(only)] if self.is_input(&only.operand));
        if !is_input && self.uses.reads.get(&key) != Some(&1) {
            let bit = self.memory("edge");
            let edge = self.edge(is_rising, power, false);
            self.push(vec![edge], vec![coil(CoilKind::Plain, &bit)]);
            self.known.insert(key, Known::Bit { name: bit, is_input: true });
            return Ok(true);
        }
        self.known.insert(key, Known::Edge { is_rising, power });
        Ok(true)
    }

    /// The edge that a value is as a whole, where no contact has it: a coil does.
    pub(super) fn taken_edge(&self, value: &Expression) -> Option<(bool, Series)> {
        let ExpressionKind::Variable(path) = &value.kind else {
            return None;
        };
        match self.known.get(&path.root.key()) {
            Some(Known::Edge { is_rising, power }) if !self.is_of_a_contact(power) => {
                Some((*is_rising, power.clone()))
            }
            _ => None,
        }
    }

    fn is_input(&self, name: &str) -> bool {
        self.ladder.inputs.iter().any(|input| input.name.as_str() == name)
    }

    /// Whether a power is that of one variable, of which a contact has the edge.
    fn is_of_a_contact(&self, power: &[Element]) -> bool {
        matches!(power, [Element::Contact(only)]
            if only.kind == ContactKind::NormallyOpen && !self.shared.contains(only.operand.as_str()))
    }

    /// A contact of an edge: of its operand, or of a bit whose coil has it.
    pub(super) fn edge(&mut self, is_rising: bool, power: Series, negated: bool) -> Element {
        if let ([Element::Contact(only)], false) = (power.as_slice(), negated)
            && only.kind == ContactKind::NormallyOpen
        {
            let kind = if is_rising { ContactKind::Rising } else { ContactKind::Falling };
            return Element::Contact(Contact { kind, operand: only.operand.clone() });
        }
        let bit = self.memory("edge");
        let kind = if is_rising { CoilKind::Rising } else { CoilKind::Falling };
        self.push(power, vec![coil(kind, &bit)]);
        contact(&bit, negated)
    }

    /// Adds a rung, or completes the one before: with what a block in its wire lets through, or with a further coil of its power.
    pub(super) fn push(&mut self, mut network: Series, mut coils: Vec<Coil>) {
        for coil in &mut coils {
            stands_at(&mut coil.target, &self.place);
        }
        place_all(&mut network, &self.place);
        let comments = std::mem::take(&mut self.comments);
        if comments.is_empty()
            && let Some(last) = self.ladder.rungs.last_mut()
        {
            if let Some(Element::Block(block)) = last.network.last()
                && last.coils.is_empty()
                && network.first() == Some(&output(block))
            {
                network.remove(0);
                last.network.append(&mut network);
                last.coils = coils;
                return;
            }
            let is_driven_here = |coil: &Coil| last.coils.iter().any(|it| it.target == coil.target);
            if is_again(last, &network) && !coils.iter().any(is_driven_here) {
                last.coils.append(&mut coils);
                return;
            }
            if let Some(power) = last.coils.first()
                && power.kind == CoilKind::Plain
                && self.shared.contains(power.target.as_str())
                && let ([Element::Contact(only)], [taken]) =
                    (network.as_slice(), coils.as_mut_slice())
                && only.operand == power.target
                && let Some(kind) = taken_by(only.kind, taken.kind)
            {
                taken.kind = kind;
                last.coils.append(&mut coils);
                return;
            }
        }
        self.ladder.rungs.push(Rung { network, coils, comments, ..Rung::default() });
    }

    /// Removes the bits of shared powers that no contact reads any more.
    pub(super) fn drop_shared_powers(&mut self) {
        let mut read: HashSet<String> = HashSet::new();
        for rung in &self.ladder.rungs {
            visit(&rung.network, &mut |element| {
                if let Element::Contact(contact) = element {
                    read.insert(contact.operand.to_string());
                }
            });
        }
        let is_unread = |name: &str| self.shared.contains(name) && !read.contains(name);
        let mut dropped: HashSet<String> = HashSet::new();
        // A rung keeps a coil.
        for rung in self.ladder.rungs.iter_mut().filter(|rung| rung.coils.len() > 1) {
            let unread = rung.coils.extract_if(.., |coil| is_unread(&coil.target));
            dropped.extend(unread.map(|coil| coil.target.to_string()));
        }
        self.ladder.memory.retain(|signal| !dropped.contains(signal.name.as_str()));
    }
}

/// Gives what a network reads the place of its statement.
fn place_all(network: &mut Series, place: &Span) {
    for element in network {
        match element {
            Element::Contact(contact) => stands_at(&mut contact.operand, place),
            Element::Comparison(comparison) => stands_at(&mut comparison.counter, place),
            Element::Branches(branches) => {
                branches.iter_mut().for_each(|branch| place_all(branch, place));
            }
            Element::Block(block) => {
                stands_at(&mut block.name, place);
                block.pins.iter_mut().for_each(|feed| place_all(&mut feed.network, place));
            }
        }
    }
}

fn stands_at(name: &mut Written, place: &Span) {
    if name.span().is_empty() {
        *name = Written::at(name.as_str(), place.clone());
    }
}

/// Whether a network lets through what the rung before has let through: its coils write nothing of it, and nothing in it keeps anything.
fn is_again(last: &Rung, network: &Series) -> bool {
    let is_same = match last.network.last() {
        Some(Element::Block(block)) => *network == [output(block)],
        _ => last.network == *network,
    };
    let mut is_changed = last.coils.is_empty();
    visit(network, &mut |element| {
        is_changed |= match element {
            Element::Contact(Contact { kind, operand }) => {
                matches!(kind, ContactKind::Rising | ContactKind::Falling)
                    || last.coils.iter().any(|coil| coil.target == *operand)
            }
            Element::Block(_) => true,
            _ => false,
        };
    });
    is_same && !is_changed
}

/// The coil that does with a power what one behind a contact of its bit does.
fn taken_by(contact: ContactKind, coil: CoilKind) -> Option<CoilKind> {
    match (contact, coil) {
        (ContactKind::NormallyOpen, kind) => Some(kind),
        (ContactKind::NormallyClosed, CoilKind::Plain) => Some(CoilKind::Negated),
        (ContactKind::NormallyClosed, CoilKind::Negated) => Some(CoilKind::Plain),
        _ => None,
    }
}

/// A contact of the output that a block has in its wire.
fn output(block: &Block) -> Element {
    contact(&format!("{}.{}", block.name, block.kind.outputs()[0]), false)
}
