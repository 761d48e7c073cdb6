//! Expressions of BOOLs as networks of contacts.

use understudy_ladder::{
    CoilKind, Comparison, Element, MAXIMUM_NESTING, MAXIMUM_PRESET_VALUE, Name, Relation, Series,
};
use understudy_structured_text::syntax::{
    Expression, ExpressionKind, Literal, Operator, Path, Step,
};
use understudy_typed::Comparison as Compared;

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
            _ => refused("it computes more than BOOLs", &expression.span),
        }
    }

    fn read(&mut self, path: &Path, negated: bool) -> Found<Power> {
        let operand = match (self.known(path)?, path.steps.as_slice()) {
            (Known::Bit { name, .. }, []) => name,
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
                let mut left = self.power(first, negated, depth + 1)?;
                for (operator, right) in rest {
                    if *operator != Operator::Xor {
                        return refused("it computes more than BOOLs", &right.span);
                    }
                    left = self.different(left, right, depth + 1)?;
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

    /// Exclusive or.
    fn different(&mut self, left: Power, right: &Expression, depth: usize) -> Found<Power> {
        let left = match left {
            Power::Off => return self.power(right, false, depth),
            Power::On => return self.power(right, true, depth),
            left => self.held(left),
        };
        let right = match self.power(right, false, depth)? {
            Power::Off => return Ok(Power::Through(vec![contact(&left, false)])),
            Power::On => return Ok(Power::Through(vec![contact(&left, true)])),
            right => self.held(right),
        };
        let branches = [false, true].map(|one| vec![contact(&left, one), contact(&right, !one)]);
        Ok(Power::Through(vec![Element::Branches(branches.to_vec())]))
    }

    /// A bit that has the power: that of its one contact, or a memory bit in a rung before.
    fn held(&mut self, power: Power) -> String {
        if let Power::Through(series) = &power
            && let [Element::Contact(only)] = series.as_slice()
            && only.kind == understudy_ladder::ContactKind::NormallyOpen
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
                let relation = match relation {
                    Compared::Equal => Relation::Equal,
                    Compared::NotEqual => Relation::NotEqual,
                    Compared::Less => Relation::Less,
                    Compared::LessOrEqual => Relation::LessOrEqual,
                    Compared::Greater => Relation::Greater,
                    Compared::GreaterOrEqual => Relation::GreaterOrEqual,
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
        let left = self.power(first, is_equal, depth + 1)?;
        self.different(left, second, depth + 1)
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
