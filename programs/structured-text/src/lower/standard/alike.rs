//! Operands of functions that take any type: the type that all of them fit.

use understudy_typed::{Elementary, Expression, Type};

use crate::lower::Lowering;
use crate::lower::convert::{common, is_number, is_whole, limits};
use crate::lower::fold::convert;
use crate::lower::numbers::{Number, Operand};
use crate::syntax;

impl Lowering<'_> {
    /// Operands in the type that all of them fit.
    pub(super) fn alike(
        &mut self,
        values: &[&syntax::Expression],
        hint: Option<&Type>,
    ) -> Option<(Vec<Expression>, Type)> {
        let mut hint = hint.cloned();
        let mut operands = Vec::with_capacity(values.len());
        let mut of: Option<Type> = None;
        let mut is_whole_call = true;
        for value in values {
            let operand = self.stored(value, hint.as_ref());
            match &operand {
                Operand::Faulty => is_whole_call = false,
                Operand::Typed(found) => {
                    let joined = match &of {
                        None => Some(found.of.clone()),
                        Some(of) => self.joined(of, &found.of),
                    };
                    if joined.is_none() {
                        let wanted = of.clone()?;
                        let found = self.describe(&found.of);
                        return self.mismatch(&found, &wanted, &value.span);
                    }
                    of = joined;
                    if matches!(found.of, Type::Enumeration(..)) {
                        hint = of.clone();
                    }
                }
                Operand::Number(_) | Operand::Wide(..) => {}
            }
            operands.push(operand);
        }
        if !is_whole_call {
            return None;
        }
        let of = self.with_literals(of, &operands, hint.as_ref());
        let mut lowered = Vec::with_capacity(values.len());
        for (operand, value) in operands.into_iter().zip(values) {
            lowered.push(match operand {
                Operand::Typed(found) if found.of == of => found,
                Operand::Typed(found) => match (of.elementary(), &of) {
                    (Some(to), Type::Elementary(_)) => {
                        self.changed(&found, to, &value.span);
                        convert(found, to)
                    }
                    _ => found,
                },
                other => self.coerce(other, &of, &value.span)?,
            });
        }
        Some((lowered, of))
    }

    fn joined(&self, left: &Type, right: &Type) -> Option<Type> {
        match (left, right) {
            _ if left == right => Some(left.clone()),
            (Type::Text(left), Type::Text(right)) => Some(Type::Text(*left.max(right))),
            (Type::Enumeration(..), Type::Enumeration(..)) => None,
            _ => {
                let (left, right) = (left.elementary()?, right.elementary()?);
                common(left, right).map(Type::Elementary)
            }
        }
    }

    /// The type of operands among which there are literals.
    fn with_literals(&self, of: Option<Type>, operands: &[Operand], hint: Option<&Type>) -> Type {
        let hinted = hint.and_then(Type::elementary).filter(|of| is_number(*of));
        let mut of = of.map(|of| match of.elementary() {
            Some(found) if is_number(found) && matches!(of, Type::Elementary(_)) => Ok(found),
            _ => Err(of),
        });
        for operand in operands {
            let Operand::Number(value) = operand else {
                continue;
            };
            let settled = match (value, hinted) {
                (Number::Real(..), Some(hinted)) if hinted.is_real() => hinted,
                (Number::Integer(value), Some(hinted)) if of.is_none() => {
                    let fits = hinted.is_real() || {
                        let (least, most) = limits(hinted);
                        least <= *value && *value <= most
                    };
                    if fits { hinted } else { Number::Integer(*value).default_type() }
                }
                _ => value.default_type(),
            };
            of = match (of, value) {
                (None, _) => Some(Ok(settled)),
                (Some(Ok(found)), _) if found.is_real() => Some(Ok(found)),
                (Some(Ok(found)), Number::Integer(value)) => {
                    let (least, most) = limits(found);
                    if least <= *value && *value <= most {
                        Some(Ok(found))
                    } else {
                        Some(Ok(common(found, settled).unwrap_or(found)))
                    }
                }
                (Some(Ok(found)), Number::Real(..)) => Some(Ok(match hinted {
                    Some(hinted) if hinted.is_real() => hinted,
                    _ if found.bits() == 64 => Elementary::Lreal,
                    _ if is_whole(found) => Elementary::Real,
                    _ => found,
                })),
                (other, _) => other,
            };
        }
        match of {
            Some(Ok(of)) => Type::Elementary(of),
            Some(Err(of)) => of,
            None => Type::Elementary(Elementary::Int),
        }
    }
}
