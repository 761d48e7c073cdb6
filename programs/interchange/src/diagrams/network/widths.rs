//! Whether boxes have the bits of their operators.
//!
//! An operator on numbers of fewer than 32 bits computes in 32 bits, and a box in the type of its inputs. Both are the same where what
//! leaves the type is cut off again behind it: `n := a + b - c` of an INT is, `n := a * 100 / 4095` and `a + b > c` are not.

use understudy_structured_text::syntax::{
    Argument, Class, Expression, ExpressionKind, File, Operator, TypeKind, Unit, UnitKind,
};

use crate::plcopen::typed::values::{Values, unit};

/// The bits of types that operators widen.
const NARROW: [(&str, u32); 6] =
    [("SINT", 8), ("USINT", 8), ("BYTE", 8), ("INT", 16), ("UINT", 16), ("WORD", 16)];

/// What is done with a value.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Use {
    /// That number of its low bits is taken.
    Cut(u32),
    /// It is cut to its own type.
    Own,
    /// All of it counts.
    Whole,
}

impl Use {
    /// It is given to something of a type.
    fn given_to(of: Option<&TypeKind>) -> Self {
        of.and_then(bits).map_or(Self::Whole, Self::Cut)
    }
}

/// Whether a box would have fewer bits than its operator, in a value that is stored as a type or used at once.
pub(super) fn is_narrower(
    file: &File,
    unit: &Unit,
    value: &Expression,
    stored: Option<&TypeKind>,
) -> bool {
    let values = Values { file, declarations: &unit.declarations, made: &[] };
    Looking { file, values }.value(value, Use::given_to(stored))
}

struct Looking<'a> {
    file: &'a File,
    values: Values<'a>,
}

impl Looking<'_> {
    fn value(&self, value: &Expression, taken: Use) -> bool {
        match &value.kind {
            ExpressionKind::Not(inner) => self.value(inner, self.passed(value, taken)),
            ExpressionKind::Minus(inner) => {
                self.leaves(value, taken) || self.value(inner, self.passed(value, taken))
            }
            ExpressionKind::Chain(first, rest) => self.chain(value, first, rest, taken),
            ExpressionKind::Call(path, arguments) => {
                let own = unit(self.file, path.root.as_str());
                match own.filter(|own| own.kind == UnitKind::Function) {
                    Some(own) => self.arguments(own, arguments),
                    None => {
                        let given = of_function(&path.root.key());
                        arguments.iter().any(|argument| match argument {
                            Argument::Placed(value) | Argument::Given(_, value) => {
                                self.value(value, given)
                            }
                            Argument::Taken { .. } => false,
                        })
                    }
                }
            }
            _ => false,
        }
    }

    fn arguments(&self, called: &Unit, arguments: &[Argument]) -> bool {
        let inputs = called.declarations.iter();
        let inputs = inputs.filter(|it| matches!(it.class, Class::Input | Class::InOut));
        let mut by_place = inputs.clone();
        arguments.iter().any(|argument| {
            let (input, value) = match argument {
                Argument::Placed(value) => (by_place.next(), value),
                Argument::Given(name, value) => (inputs.clone().find(|it| it.name == *name), value),
                Argument::Taken { .. } => return false,
            };
            let of = input.map(|input| self.values.resolved(input.of.clone()).kind);
            self.value(value, Use::given_to(of.as_ref()))
        })
    }

    fn chain(
        &self,
        value: &Expression,
        first: &Expression,
        rest: &[(Operator, Expression)],
        taken: Use,
    ) -> bool {
        let Some(((operator, right), before)) = rest.split_last() else {
            return self.value(first, taken);
        };
        let left = match before {
            [] => first.clone(),
            before => Expression {
                kind: ExpressionKind::Chain(Box::new(first.clone()), before.to_vec()),
                span: value.span.clone(),
            },
        };
        let (leaves, passed) = match operator {
            Operator::Add | Operator::Subtract | Operator::Multiply => {
                (self.leaves(value, taken), self.passed(value, taken))
            }
            Operator::And | Operator::Or | Operator::Xor => (false, self.passed(value, taken)),
            // The least number by −1.
            Operator::Divide => (self.leaves(value, taken), Use::Whole),
            _ => (false, Use::Whole),
        };
        leaves || self.value(&left, passed) || self.value(right, passed)
    }

    /// What is taken of the operands of an operator whose low bits depend on theirs alone.
    fn passed(&self, value: &Expression, taken: Use) -> Use {
        match (taken, self.narrow(value)) {
            (Use::Own, Some(own)) => Use::Cut(own),
            (Use::Cut(bits), Some(own)) if bits <= own => taken,
            _ => Use::Whole,
        }
    }

    /// Whether bits of a result count that its type does not have.
    fn leaves(&self, value: &Expression, taken: Use) -> bool {
        let own = self.narrow(value);
        own.is_some_and(|own| match taken {
            Use::Cut(bits) => bits > own,
            Use::Own => false,
            Use::Whole => true,
        })
    }

    fn narrow(&self, value: &Expression) -> Option<u32> {
        let of = self.values.strong(value)?;
        bits(&self.values.resolved(of).kind)
    }
}

/// What a standard function does with its inputs: one whose name has a type converts them to it.
fn of_function(key: &str) -> Use {
    let from = key.split_once("_TO_").map(|(from, _)| from);
    match from.or_else(|| key.rsplit_once('_').map(|(_, of)| of)) {
        Some(of) => named(of).map_or(Use::Whole, Use::Cut),
        None => Use::Own,
    }
}

fn bits(of: &TypeKind) -> Option<u32> {
    match of {
        TypeKind::Named(name) | TypeKind::Subrange(name, ..) => named(&name.key()),
        _ => None,
    }
}

fn named(key: &str) -> Option<u32> {
    NARROW.iter().find(|(name, _)| *name == key).map(|(_, bits)| *bits)
}

#[cfg(test)]
mod tests {
    use understudy_structured_text::parse;
    use understudy_structured_text::syntax::{Body, StatementKind, TypeKind};

    use super::{Values, is_narrower};

    /// Whether it is found in the value of the assignment.
    fn found(statement: &str) -> bool {
        let text = format!(
            "TYPE Level : INT; END_TYPE FUNCTION Fun : INT VAR_INPUT i : INT; d : DINT; END_VAR END_FUNCTION
            PROGRAM main VAR n, m : INT; v : Level; s : SINT; d : DINT; r : REAL; q : BOOL; w : WORD; t : TIME; END_VAR {statement} END_PROGRAM"
        );
        let (file, errors) = parse(&text);
        assert!(errors.is_empty(), "{statement}: {errors:?}");
        let main = file.units.last().expect("a program");
        let Body::Statements(statements) = &main.body else { panic!("statements") };
        let StatementKind::Assign(to, value) = &statements[0].kind else { panic!("an assignment") };
        let values = Values { file: &file, declarations: &main.declarations, made: &[] };
        let of = values.strong(&crate::plcopen::typed::make::read(to.clone()));
        let of: Option<TypeKind> = of.map(|of| values.resolved(of).kind);
        is_narrower(&file, main, value, of.as_ref())
    }

    #[test]
    fn a_result_that_is_cut_off_again_may_be_a_box() {
        for statement in [
            "n := n + 1;",
            "n := n + m - 3 * n;",
            "v := v * 2;",
            "s := s - s;",
            "s := n * 3;",
            "d := d * 100 / 4095;",
            "r := r * 2.0;",
            "n := n / 3;",
            "n := n MOD 7;",
            "n := -n + m;",
            "q := n > 3;",
            "q := n MOD 2 = 0;",
            "w := NOT w AND w;",
            "d := d + n;",
            "n := MAX(n + 1, m);",
            // The input of a function is cut to its type.
            "d := MAX(d, n / m);",
            "n := Fun(n + 1, d + 1);",
            "t := t + t;",
            "r := INT_TO_REAL(n + 1);",
        ] {
            assert!(!found(statement), "{statement}");
        }
    }

    #[test]
    fn a_result_with_more_bits_than_its_box_is_none() {
        for statement in [
            "n := n * 100 / 4095;",
            "d := n * 100;",
            "r := n + 1;",
            "q := n + 1 > 5;",
            "v := v * 3 / 2;",
            "q := -n > 0;",
            "n := -n MOD 5;",
            "n := (n + m) MOD 3;",
            "n := Fun(n, n * 2);",
            "r := DINT_TO_REAL(n * 100);",
            "d := d + n * n;",
            "s := s * 2 / 3;",
            "q := NOT (w + 1) = 5;",
            "n := SEL(n + 1 > 3, n, m);",
        ] {
            assert!(found(statement), "{statement}");
        }
    }
}
