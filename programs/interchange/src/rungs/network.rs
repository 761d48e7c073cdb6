//! Expressions of BOOLs as networks of contacts.

use understudy_ladder::{
    CoilKind, Comparison, ContactKind, Element, MAXIMUM_NESTING, MAXIMUM_PRESET_VALUE, Name, Series,
};
use understudy_structured_text::syntax::{
    Argument, Expression, ExpressionKind, Literal, Operator, Path, Span, Step,
};
use understudy_typed::Comparison as Compared;

use super::drawn::is_made;
use super::signals::Known;
use super::{Found, Refused, Writer, coil, contact, refused};

/// Branches in each other, beyond which a memory bit holds the power.
const DEPTH: usize = MAXIMUM_NESTING / 2;

/// What a network passes.
pub(super) enum Power {
    /// TRUE
    On,
    /// FALSE
    Off,
    /// What its elements let through.
    Through(Series),
}

/// The value of an expression that is a literal BOOL.
pub(super) fn constant(expression: &Expression) -> Option<bool> {
    match &expression.kind {
        ExpressionKind::Literal(Literal::Boolean(value)) => Some(*value),
        ExpressionKind::Not(inner) => constant(inner).map(|value| !value),
        ExpressionKind::Chain(only, rest) if rest.is_empty() => constant(only),
        _ => None,
    }
}

impl Writer<'_> {
    /// The network that passes power where the expression is TRUE, or FALSE if negated.
    pub(super) fn power(
        &mut self,
        expression: &Expression,
        negated: bool,
        depth: usize,
    ) -> Found<Power> {
        if let Some(value) = constant(expression) {
            return Ok(if value == negated { Power::Off } else { Power::On });
        }
        match &expression.kind {
            ExpressionKind::Variable(path) => self.read(path, negated),
            ExpressionKind::Not(inner) => self.power(inner, !negated, depth),
            ExpressionKind::Chain(first, rest) => self.chain(first, rest, negated, depth),
            ExpressionKind::Call(name, arguments)
                if name.root.is("SEL")
                    && self.file.units.iter().all(|unit| !unit.name.is("SEL")) =>
            {
                self.selected(arguments, negated, depth, &expression.span)
            }
            _ => refused("it computes more than BOOLs", &expression.span),
        }
    }

    fn read(&mut self, path: &Path, negated: bool) -> Found<Power> {
        let operand = match (self.known(path)?, path.steps.as_slice()) {
            (Known::Bit { name, .. }, []) => name,
            // The output of a trigger that a reader made.
            (Known::Bit { name, .. }, [Step::Field(_)]) if is_made(&path.root) => name,
            (Known::Block { name, kind, .. }, [Step::Field(pin)]) => {
                let outputs = kind.outputs().iter();
                let mut outputs = outputs.filter(|output| pin.is(output));
                let Some(output) = outputs.next() else {
                    return refused(format!("it reads `{name}.{pin}`"), &path.span);
                };
                let operand = format!("{name}.{output}");
                self.read.push((name, path.span.clone()));
                operand
            }
            (Known::Edge { is_rising, power }, [Step::Field(_)]) => {
                return Ok(Power::Through(vec![self.edge(is_rising, power, negated)]));
            }
            _ => return refused("it reads a part of a variable", &path.span),
        };
        Ok(Power::Through(vec![contact(&operand, negated)]))
    }

    fn chain(
        &mut self,
        first: &Expression,
        rest: &[(Operator, Expression)],
        negated: bool,
        depth: usize,
    ) -> Found<Power> {
        match rest {
            [] => self.power(first, negated, depth),
            [(Operator::Compare(relation), second)] => {
                self.compared(first, *relation, second, negated, depth)
            }
            [(Operator::Xor, _), ..] => {
                let mut left = self.power(first, false, depth + 1)?;
                for (place, (operator, right)) in rest.iter().enumerate() {
                    if *operator != Operator::Xor {
                        return refused("it computes more than BOOLs", &right.span);
                    }
                    let is_last = place + 1 == rest.len();
                    left = self.different(left, right, negated && is_last, depth + 1)?;
                }
                Ok(left)
            }
            _ => {
                let is_and = |operator: Operator| match operator {
                    Operator::And | Operator::AndThen => Some(true),
                    Operator::Or | Operator::OrElse => Some(false),
                    _ => None,
                };
                let all = is_and(rest[0].0).map(|all| all != negated);
                let mut parts = Vec::new();
                for (place, operand) in
                    std::iter::once(first).chain(rest.iter().map(|(_, it)| it)).enumerate()
                {
                    let operator = rest[place.saturating_sub(1)].0;
                    if all.is_none() || is_and(operator).map(|all| all != negated) != all {
                        return refused("it computes more than BOOLs", &operand.span);
                    }
                    parts.push(self.power(operand, negated, depth + 1)?);
                }
                if all == Some(true) { Ok(series(parts)) } else { self.branches(parts, depth) }
            }
        }
    }

    fn branches(&mut self, parts: Vec<Power>, depth: usize) -> Found<Power> {
        let mut branches = Vec::new();
        for part in parts {
            match part {
                Power::On => return Ok(Power::On),
                Power::Off => {}
                Power::Through(series) => branches.push(series),
            }
        }
        let power = match branches.len() {
            0 => return Ok(Power::Off),
            1 => Power::Through(branches.remove(0)),
            _ => Power::Through(vec![Element::Branches(branches)]),
        };
        if depth > 0 && depth.is_multiple_of(DEPTH) {
            let held = self.held(power);
            return Ok(Power::Through(vec![contact(&held, false)]));
        }
        Ok(power)
    }

    /// Exclusive or; equal, where it is negated.
    fn different(
        &mut self,
        left: Power,
        right: &Expression,
        negated: bool,
        depth: usize,
    ) -> Found<Power> {
        let left = match left {
            Power::Off => return self.power(right, negated, depth),
            Power::On => return self.power(right, !negated, depth),
            left => self.held(left),
        };
        let right = match self.power(right, false, depth)? {
            Power::Off => return Ok(Power::Through(vec![contact(&left, negated)])),
            Power::On => return Ok(Power::Through(vec![contact(&left, !negated)])),
            right => self.held(right),
        };
        let pair = |one: bool| vec![contact(&left, one), contact(&right, one == negated)];
        let branches = [false, true].map(pair);
        Ok(Power::Through(vec![Element::Branches(branches.to_vec())]))
    }

    /// `SEL(G, IN0, IN1)` of BOOLs.
    fn selected(
        &mut self,
        arguments: &[Argument],
        negated: bool,
        depth: usize,
        span: &Span,
    ) -> Found<Power> {
        let value = |at: usize, pin: &str| {
            arguments.iter().enumerate().find_map(|(place, argument)| match argument {
                Argument::Placed(value) => (place == at).then_some(value),
                Argument::Given(given, value) => given.is(pin).then_some(value),
                Argument::Taken { .. } => None,
            })
        };
        let values = (value(0, "G"), value(1, "IN0"), value(2, "IN1"));
        let (Some(which), Some(first), Some(second)) = values else {
            return refused("it computes more than BOOLs", span);
        };
        let which = match self.power(which, false, depth + 1)? {
            Power::Off => return self.power(first, negated, depth),
            Power::On => return self.power(second, negated, depth),
            which => self.held(which),
        };
        let mut branches = Vec::new();
        for (value, is_closed) in [(first, true), (second, false)] {
            let power = self.power(value, negated, depth + 1)?;
            branches.push(series(vec![Power::Through(vec![contact(&which, is_closed)]), power]));
        }
        self.branches(branches, depth)
    }

    /// A bit that has the power: that of its one contact, or a memory bit in a rung before.
    fn held(&mut self, power: Power) -> String {
        if let Power::Through(series) = &power
            && let [Element::Contact(only)] = series.as_slice()
            && only.kind == ContactKind::NormallyOpen
        {
            return only.operand.to_string();
        }
        let bit = self.memory("held");
        let (network, kind) = match power {
            Power::On => (Vec::new(), CoilKind::Plain),
            Power::Off => (Vec::new(), CoilKind::Negated),
            Power::Through(series) => (series, CoilKind::Plain),
        };
        self.push(network, vec![coil(kind, &bit)]);
        bit
    }

    /// A counter compared with a constant, or two BOOLs.
    fn compared(
        &mut self,
        first: &Expression,
        relation: Compared,
        second: &Expression,
        negated: bool,
        depth: usize,
    ) -> Found<Power> {
        let relation = if negated { relation.opposite() } else { relation };
        let sides = [(first, relation, second), (second, relation.mirrored(), first)];
        for (counter, relation, number) in sides {
            let literal = match &number.kind {
                ExpressionKind::Literal(literal) => Some(literal),
                ExpressionKind::Variable(path) if path.steps.is_empty() => self.constant(path),
                _ => None,
            };
            if let Some(Literal::Integer { value, .. }) = literal
                && let Some(counter) = self.counter(counter)
            {
                let value = u16::try_from(*value).ok().filter(|it| *it <= MAXIMUM_PRESET_VALUE);
                let Some(value) = value else {
                    let what =
                        format!("a counter is compared with numbers to {MAXIMUM_PRESET_VALUE}");
                    return Err(Refused { what, span: number.span.clone() });
                };
                self.read.push((counter.clone(), first.span.clone()));
                let counter = Name::from(counter);
                let comparison = Element::Comparison(Comparison { counter, relation, value });
                return Ok(Power::Through(vec![comparison]));
            }
        }
        let is_equal = match relation {
            Compared::Equal => true,
            Compared::NotEqual => false,
            _ => return refused("it compares numbers", &first.span),
        };
        let left = self.power(first, false, depth + 1)?;
        self.different(left, second, is_equal, depth + 1)
    }

    /// The counter whose value an expression is.
    fn counter(&mut self, expression: &Expression) -> Option<String> {
        let ExpressionKind::Variable(path) = &expression.kind else {
            return None;
        };
        match (self.known(path).ok()?, path.steps.as_slice()) {
            (Known::Block { name, kind, .. }, [Step::Field(pin)])
                if pin.is("CV") && kind.preset_value().is_some() =>
            {
                Some(name)
            }
            _ => None,
        }
    }
}

/// Elements one behind the other.
fn series(parts: Vec<Power>) -> Power {
    let mut all = Vec::new();
    for part in parts {
        match part {
            Power::On => {}
            Power::Off => return Power::Off,
            Power::Through(series) => all.extend(series),
        }
    }
    if all.is_empty() { Power::On } else { Power::Through(all) }
}
