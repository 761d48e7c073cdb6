//! Constants: `VAR CONSTANT`, and expressions whose value must be known when the program is read.

use understudy_typed::{ExpressionKind, Type};

use crate::syntax::{self, Declaration, Initializer};

use super::Lowering;
use super::names::{Constant, Owner, Symbol};
use super::numbers::{Number, Operand};

#[derive(Clone)]
pub(super) enum ConstantState {
    Busy,
    Done(Symbol),
}

impl Lowering<'_> {
    /// The value of a `VAR CONSTANT`; [`Symbol::Faulty`] where it has none that fits a slot.
    pub(super) fn constant_symbol(
        &mut self,
        owner: Option<Owner>,
        declaration: &Declaration,
    ) -> Symbol {
        let key = (owner, declaration.name.key());
        match self.constant_state(key.clone()) {
            Some(ConstantState::Done(symbol)) => {
                self.blamed += usize::from(matches!(symbol, Symbol::Faulty));
                return symbol;
            }
            Some(ConstantState::Busy) => {
                let message = format!("the constant `{}` is defined by itself", declaration.name);
                self.error("U1047", message, declaration.name.span());
                return Symbol::Faulty;
            }
            None => {}
        }
        self.constants.insert(key.clone(), ConstantState::Busy);
        let outside = self.leave_unit();
        self.scope.unit = owner.map(|owner| owner.unit);
        self.scope.method = owner.and_then(|owner| owner.method);
        let found = self.deeper(&declaration.name.span(), |own| own.constant_value(declaration));
        self.scope = outside;
        let symbol = found.map_or(Symbol::Faulty, Symbol::Constant);
        self.constants.insert(key, ConstantState::Done(symbol.clone()));
        symbol
    }

    /// `None` for an aggregate, which stands in memory, and for an error.
    fn constant_value(&mut self, declaration: &Declaration) -> Option<Constant> {
        let resolved = self.resolve(&declaration.of)?;
        match &resolved.of {
            Type::Elementary(_) | Type::Enumeration(..) => {
                let image = match &declaration.initial {
                    Some(initial) => self.initial_image(initial, &resolved)?,
                    None => resolved.image,
                };
                let value = image.first().map_or(0, |(_, value)| *value);
                Some(Constant::Number(resolved.of, value))
            }
            Type::Text(capacity) => match &declaration.initial {
                Some(Initializer::Value(value)) => {
                    let bytes = self.constant_text(value)?;
                    Some(Constant::Text(*capacity, bytes.into()))
                }
                _ => Some(Constant::Text(*capacity, Vec::new().into())),
            },
            Type::Array(_) | Type::Structure(..) => None,
        }
    }

    /// An expression of whole numbers that is known now.
    pub(super) fn constant_integer(&mut self, expression: &syntax::Expression) -> Option<i128> {
        match self.constant_operand(expression, None) {
            Operand::Faulty => None,
            Operand::Number(Number::Integer(value)) => Some(value),
            Operand::Typed(typed) | Operand::Wide(typed, _) => {
                let elementary = typed.of.elementary();
                match (elementary, &typed.kind) {
                    (Some(elementary), ExpressionKind::Constant(value))
                        if !elementary.is_real() =>
                    {
                        Some(elementary.signed(*value))
                    }
                    _ => self.not_constant(expression),
                }
            }
            Operand::Number(_) => {
                let message = "a whole number is expected here";
                self.error("U1043", message, expression.span.clone());
                None
            }
        }
    }

    fn constant_text(&mut self, expression: &syntax::Expression) -> Option<Vec<u8>> {
        match self.constant_operand(expression, None) {
            Operand::Faulty => None,
            Operand::Typed(typed) => match typed.kind {
                ExpressionKind::Text(bytes) => Some(bytes.to_vec()),
                _ => self.not_constant(expression),
            },
            Operand::Number(_) | Operand::Wide(..) => self.not_constant(expression),
        }
    }

    /// The value of a constant expression as one of this type, elementary or text.
    pub(super) fn constant_of(
        &mut self,
        expression: &syntax::Expression,
        of: &Type,
    ) -> Option<Constant> {
        let operand = self.constant_operand(expression, Some(of));
        let typed = self.coerce(operand, of, &expression.span)?;
        match typed.kind {
            ExpressionKind::Constant(value) => Some(Constant::Number(of.clone(), value)),
            ExpressionKind::Text(bytes) => match of {
                Type::Text(capacity) if bytes.len() <= usize::from(*capacity) => {
                    Some(Constant::Text(*capacity, bytes))
                }
                _ => {
                    let wanted = self.describe(of);
                    let message = format!(
                        "the text has {} characters, and {wanted} is too short",
                        bytes.len()
                    );
                    self.error("U1043", message, expression.span.clone());
                    None
                }
            },
            _ => self.not_constant(expression),
        }
    }

    /// Lowers an expression where no variables are known.
    fn constant_operand(
        &mut self,
        expression: &syntax::Expression,
        hint: Option<&Type>,
    ) -> Operand {
        let mut scope = self.scope.clone();
        scope.symbols = None;
        let outside = std::mem::replace(&mut self.scope, scope);
        let operand = match hint {
            Some(of) => self.operand_for(expression, of),
            None => self.operand(expression, None),
        };
        self.scope = outside;
        operand
    }

    fn not_constant<T>(&mut self, expression: &syntax::Expression) -> Option<T> {
        let message = "the value must be known when the program is read";
        let help = "use literals and VAR CONSTANT only";
        self.error_with("U1082", message, expression.span.clone(), help);
        None
    }
}
