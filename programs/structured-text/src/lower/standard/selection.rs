//! SEL, MAX, MIN, LIMIT, MUX, and what calls a function of the library.

use understudy_typed::{
    Argument, Call, Comparison, Elementary, Expression, ExpressionKind, Operation, Root,
    TextOperation, Type,
};

use crate::syntax::{self, Span};

use super::{Lowering, lint};
use crate::lower::blocks::Key;
use crate::lower::convert::common;
use crate::lower::fold::{apply, choose, convert, text};
use crate::lower::names::Owner;
use crate::lower::places::place;

impl Lowering<'_> {
    pub(super) fn selection(
        &mut self,
        key: &str,
        values: &[&syntax::Expression],
        hint: Option<&Type>,
        span: &Span,
    ) -> Option<Expression> {
        match key {
            "SEL" => {
                let condition = self.condition(values[0]);
                let (mut values, of) = self.alike(&values[1..], hint)?;
                let (then, otherwise) = (values.pop()?, values.pop()?);
                let condition = condition?;
                let operands = vec![condition, otherwise, then];
                Some(match &of {
                    Type::Text(_) => text(TextOperation::Select, operands, of),
                    _ => match of.elementary() {
                        Some(elementary) => apply(Operation::Select(elementary), operands, of),
                        None => {
                            let [condition, otherwise, then] = <[_; 3]>::try_from(operands).ok()?;
                            choose(condition, then, otherwise)
                        }
                    },
                })
            }
            "MUX" => {
                let number = self.long(values[0]);
                let (values, of) = self.alike(&values[1..], hint)?;
                if let Type::Text(_) = of {
                    return self.text_of_number(number?, values, &of, span);
                }
                let elementary = self.plain(key, &of, span)?;
                let operands = std::iter::once(number?).chain(values).collect();
                Some(apply(Operation::Multiplex(elementary), operands, of))
            }
            "LIMIT" => {
                let (values, of) = self.alike(values, hint)?;
                if let Type::Text(_) = of {
                    let [least, value, most] = <[_; 3]>::try_from(values).ok()?;
                    let raised = self.extreme_text("MAX", vec![least, value], &of)?;
                    return self.extreme_text("MIN", vec![most, raised], &of);
                }
                let elementary = self.plain(key, &of, span)?;
                let [least, value, most] = <[_; 3]>::try_from(values).ok()?;
                let raised = apply(Operation::Maximum(elementary), vec![least, value], of.clone());
                Some(apply(Operation::Minimum(elementary), vec![most, raised], of))
            }
            _ => {
                let (values, of) = self.alike(values, hint)?;
                if let Type::Text(_) = of {
                    return self.extreme_text(key, values, &of);
                }
                let elementary = self.plain(key, &of, span)?;
                let operation = match key {
                    "MAX" => Operation::Maximum(elementary),
                    _ => Operation::Minimum(elementary),
                };
                let mut values = values;
                match values.len() {
                    1 => values.pop(),
                    _ => Some(apply(operation, values, of)),
                }
            }
        }
    }

    fn plain(&mut self, key: &str, of: &Type, span: &Span) -> Option<Elementary> {
        let elementary = of.elementary();
        if elementary.is_none() {
            let found = self.describe(of);
            let message = format!("{key} is for numbers, bits and times, and this is {found}");
            self.error_with("U1043", message, span.clone(), "use IF or CASE");
        }
        elementary
    }

    /// The text of a number; another number is a fault.
    fn text_of_number(
        &mut self,
        number: Expression,
        values: Vec<Expression>,
        of: &Type,
        span: &Span,
    ) -> Option<Expression> {
        // It is evaluated more than once.
        if matches!(number.kind, ExpressionKind::Call(_)) {
            let message = "MUX of texts by the result of a call is not supported";
            let help = "assign the result to a variable first";
            self.error_with("U1040", message, span.clone(), help);
            return None;
        }
        let long = Type::Elementary(Elementary::Lint);
        let numbers = (0..values.len() as i64).map(lint);
        let operands = std::iter::once(number).chain(numbers).collect();
        let number = apply(Operation::Multiplex(Elementary::Lint), operands, long);
        let bool = Type::Elementary(Elementary::Bool);
        let mut values = values.into_iter();
        let first = values.next()?;
        let chosen = values.zip(1..).fold(first, |chosen, (value, at)| {
            let equal = Operation::Compare(Comparison::Equal, Elementary::Lint);
            let is_it = apply(equal, vec![number.clone(), lint(at)], bool.clone());
            text(TextOperation::Select, vec![is_it, chosen, value], of.clone())
        });
        Some(chosen)
    }

    fn extreme_text(
        &mut self,
        key: &str,
        values: Vec<Expression>,
        of: &Type,
    ) -> Option<Expression> {
        let comparison = match key {
            "MAX" => Comparison::Greater,
            _ => Comparison::Less,
        };
        let bool = Type::Elementary(Elementary::Bool);
        values.into_iter().reduce(|best, next| {
            let operands = vec![next.clone(), best.clone()];
            let is_better = text(TextOperation::Compare(comparison), operands, bool.clone());
            text(TextOperation::Select, vec![is_better, best, next], of.clone())
        })
    }

    /// ATAN2 stands in the library, for LREAL.
    pub(super) fn arc_tangent_of_two(
        &mut self,
        values: &[&syntax::Expression],
        hint: Option<&Type>,
        span: &Span,
    ) -> Option<Expression> {
        let (y, of) = self.real_value(values[0], hint)?;
        let (x, other) = self.real_value(values[1], hint)?;
        let of = common(of, other)?;
        let unit = *self.unit_names.get("ARC_TANGENT_OF_TWO")?;
        let key = Key { owner: Owner { unit, method: None }, class: None, open: Vec::new() };
        let routine = self.routine(key, span)?;
        let double = Type::Elementary(Elementary::Lreal);
        let given = routine.parameters.iter().zip([y, x]).map(|(parameter, value)| {
            let to = place(Root::Frame(parameter.slot), double.clone());
            Argument::Value(to, convert(value, Elementary::Lreal))
        });
        let call = Call {
            routine: routine.id,
            own: None,
            arguments: given.collect(),
            outputs: Vec::new(),
            result: routine.result.clone(),
        };
        let value = Expression { of: double, kind: ExpressionKind::Call(Box::new(call)) };
        Some(convert(value, of))
    }
}
