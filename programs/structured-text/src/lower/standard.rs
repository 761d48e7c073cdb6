//! The standard functions of IEC 61131-3, overloaded as they are there.

mod alike;
mod conversions;
mod inputs;
mod pointed;
mod reals;
mod selection;
mod texts;
mod times;
mod typed;

pub use inputs::input_names;

use understudy_typed::{Comparison, Elementary, Expression, Operation, RealFunction, Type};

use crate::syntax::{self, Argument, Operator, Span};

use super::Lowering;
use super::convert::{as_bits, is_whole};
use super::expand::{POINTED, STORED};
use super::fold::{apply, boolean, choose, convert, reinterpret};
use super::names::number;
use super::numbers::{Number, Operand};

/// The names that are known here, for suggestions; conversions come on top.
pub(super) const NAMES: [&str; 92] = [
    "ABS",
    "SQRT",
    "LN",
    "LOG",
    "EXP",
    "SIN",
    "COS",
    "TAN",
    "ASIN",
    "ACOS",
    "ATAN",
    "ATAN2",
    "ADD",
    "MUL",
    "SUB",
    "DIV",
    "MOD",
    "EXPT",
    "MOVE",
    "SHL",
    "SHR",
    "ROL",
    "ROR",
    "AND",
    "OR",
    "XOR",
    "NOT",
    "SEL",
    "MAX",
    "MIN",
    "LIMIT",
    "MUX",
    "GT",
    "GE",
    "EQ",
    "LE",
    "LT",
    "NE",
    "LEN",
    "LEFT",
    "RIGHT",
    "MID",
    "CONCAT",
    "INSERT",
    "DELETE",
    "REPLACE",
    "FIND",
    "UPPER_CASE",
    "LOWER_CASE",
    "TRUNC",
    "FLOOR",
    "CEIL",
    "ROUND",
    "ADD_TIME",
    "ADD_LTIME",
    "ADD_TOD_TIME",
    "ADD_LTOD_LTIME",
    "ADD_DT_TIME",
    "ADD_LDT_LTIME",
    "SUB_TIME",
    "SUB_LTIME",
    "SUB_DATE_DATE",
    "SUB_LDATE_LDATE",
    "SUB_TOD_TIME",
    "SUB_LTOD_LTIME",
    "SUB_TOD_TOD",
    "SUB_LTOD_LTOD",
    "SUB_DT_TIME",
    "SUB_LDT_LTIME",
    "SUB_DT_DT",
    "SUB_LDT_LDT",
    "MULTIME",
    "MUL_TIME",
    "MUL_LTIME",
    "DIVTIME",
    "DIV_TIME",
    "DIV_LTIME",
    "CONCAT_DATE_TOD",
    "CONCAT_DATE_LTOD",
    "TIME",
    "SIZEOF",
    "UPPER_BOUND",
    "LOWER_BOUND",
    "ADR",
    "REF",
    "FRAC",
    "BCD_TO_INT",
    "INT_TO_BCD",
    "TRUNC_INT",
    "TO_UPPER",
    "TO_LOWER",
    "LTIME",
];

/// Whether a name in capitals is that of a standard function.
pub(super) fn is_standard(key: &str) -> bool {
    NAMES.contains(&key)
        || typed::of(key).is_some()
        || typed::marked(key).is_some()
        || pointed_inputs(key).is_some()
        || conversions::Conversion::of(key).is_some()
}

/// The inputs of a function that stands for a pointer.
fn pointed_inputs(key: &str) -> Option<usize> {
    [(POINTED, 3), (STORED, 4)]
        .iter()
        .find(|(name, _)| key.eq_ignore_ascii_case(name))
        .map(|(_, inputs)| *inputs)
}

fn real_function(key: &str) -> Option<RealFunction> {
    Some(match key {
        "SQRT" => RealFunction::SquareRoot,
        "LN" => RealFunction::NaturalLogarithm,
        "LOG" => RealFunction::Logarithm,
        "EXP" => RealFunction::Exponential,
        "SIN" => RealFunction::Sine,
        "COS" => RealFunction::Cosine,
        "TAN" => RealFunction::Tangent,
        "ASIN" => RealFunction::ArcSine,
        "ACOS" => RealFunction::ArcCosine,
        "ATAN" => RealFunction::ArcTangent,
        _ => return None,
    })
}

/// The operator of a function in the place of one, and whether it takes more than two operands.
fn operator(key: &str) -> Option<(Operator, bool)> {
    Some(match key {
        "ADD" | "ADD_TIME" | "ADD_LTIME" | "ADD_TOD_TIME" | "ADD_LTOD_LTIME" | "ADD_DT_TIME"
        | "ADD_LDT_LTIME" => (Operator::Add, key == "ADD"),
        "MUL" | "MULTIME" | "MUL_TIME" | "MUL_LTIME" => (Operator::Multiply, key == "MUL"),
        "DIV" | "DIVTIME" | "DIV_TIME" | "DIV_LTIME" => (Operator::Divide, false),
        "MOD" => (Operator::Modulo, false),
        "EXPT" => (Operator::Power, false),
        "AND" => (Operator::And, true),
        "OR" => (Operator::Or, true),
        "XOR" => (Operator::Xor, true),
        _ if key == "SUB" || key.starts_with("SUB_") => (Operator::Subtract, false),
        _ => return None,
    })
}

impl Lowering<'_> {
    /// A call of a standard function.
    pub(super) fn standard(
        &mut self,
        key: &str,
        arguments: &[Argument],
        hint: Option<&Type>,
        span: &Span,
    ) -> Operand {
        let Some(values) = self.values(key, arguments, span) else {
            return Operand::Faulty;
        };
        let operand = match typed::of(key) {
            Some(typed) => self.typed_function(&typed, &values.of, span),
            None => self.standard_value(key, &values.of, hint, span),
        };
        if values.enable.is_none() {
            return operand;
        }
        match self.settle(operand, hint, span) {
            Some(value) => self.permitted(value, values.enable),
            None => Operand::Faulty,
        }
    }

    fn standard_value(
        &mut self,
        key: &str,
        values: &[&syntax::Expression],
        hint: Option<&Type>,
        span: &Span,
    ) -> Operand {
        if let Some(of) = typed::marked(key) {
            let value = self.expression(values[0], &Type::Elementary(of));
            return value.map_or(Operand::Faulty, Operand::Typed);
        }
        if let Some((operator, _)) = operator(key) {
            return self.operator_call(operator, values, hint);
        }
        let found = if let Some(comparison) = Comparison::of_word(key) {
            self.comparison_call(comparison, values)
        } else if let Some(function) = real_function(key) {
            self.real_call(function, values[0], hint)
        } else if let Some(conversion) = conversions::Conversion::of(key) {
            self.conversion(&conversion, values[0], hint)
        } else if let Some(conversion) = self.enumerated(&syntax::Name::new(key, span.clone())) {
            self.enumerated_value(conversion, values[0])
        } else {
            match key {
                "MOVE" => return self.stored(values[0], hint),
                "ABS" => self.absolute(values[0], hint),
                "NOT" => self.not_call(values[0], hint),
                "SHL" | "SHR" | "ROL" | "ROR" => self.shift(key, values, hint),
                "SEL" | "MAX" | "MIN" | "LIMIT" | "MUX" => self.selection(key, values, hint, span),
                "ATAN2" => self.arc_tangent_of_two(values, hint, span),
                "FLOOR" | "CEIL" | "ROUND" | "FRAC" => self.rounded(key, values[0], hint),
                "TIME" | "LTIME" => {
                    Some(apply(Operation::Elapsed, Vec::new(), Type::Elementary(Elementary::Time)))
                }
                "CONCAT_DATE_TOD" | "CONCAT_DATE_LTOD" => self.date_and_time(values),
                "SIZEOF" => return self.size_of(values[0]),
                "UPPER_BOUND" | "LOWER_BOUND" => return self.array_bound(key, values),
                "ADR" | "REF" => {
                    let help = "pass the variable as VAR_IN_OUT";
                    let message = "an address is supported only for a pointer that always points into one variable";
                    self.error_with("U1040", message, span.clone(), help);
                    None
                }
                _ if pointed_inputs(key) == Some(3) => self.pointed(values, span),
                _ if pointed_inputs(key) == Some(4) => self.pointed_stored(values, span),
                _ => self.text_call(key, values, hint),
            }
        };
        found.map_or(Operand::Faulty, Operand::Typed)
    }

    fn operator_call(
        &mut self,
        operator: Operator,
        values: &[&syntax::Expression],
        hint: Option<&Type>,
    ) -> Operand {
        let mut left = self.stored(values[0], hint);
        let mut whole = values[0].span.clone();
        for right in &values[1..] {
            let own = left.own_type().or_else(|| hint.cloned());
            let value = self.stored(right, own.as_ref());
            left = match self.binary(operator, (left, &whole), (value, &right.span), hint) {
                Operand::Wide(value, own) => {
                    let all = whole.start..right.span.end;
                    Operand::Typed(self.stored_as(value, own, own, &all))
                }
                found => found,
            };
            whole.end = right.span.end;
        }
        left
    }

    /// An input of a function, which has a type: what operators have computed as a DINT is cut to it.
    pub(super) fn stored(&mut self, value: &syntax::Expression, hint: Option<&Type>) -> Operand {
        match self.operand(value, hint) {
            Operand::Wide(found, own) => {
                Operand::Typed(self.stored_as(found, own, own, &value.span))
            }
            found => found,
        }
    }

    fn comparison_call(
        &mut self,
        comparison: Comparison,
        values: &[&syntax::Expression],
    ) -> Option<Expression> {
        let mut all: Option<Expression> = None;
        for pair in values.windows(2) {
            let left = self.stored(pair[0], None);
            let right = self.stored(pair[1], left.own_type().as_ref());
            let operator = Operator::Compare(comparison);
            let one = self.binary(operator, (left, &pair[0].span), (right, &pair[1].span), None);
            let one = self.settle(one, None, &pair[0].span)?;
            all = Some(match all {
                Some(before) => choose(before, one, boolean(false)),
                None => one,
            });
        }
        all
    }

    pub(super) fn not_a_number<T>(&mut self, found: &Expression, span: &Span) -> Option<T> {
        let found = self.describe(&found.of);
        let message = format!("expected a number, found {found}");
        self.error("U1043", message, span.clone());
        None
    }

    fn not_call(&mut self, value: &syntax::Expression, hint: Option<&Type>) -> Option<Expression> {
        let not = syntax::Expression {
            kind: syntax::ExpressionKind::Not(Box::new(value.clone())),
            span: value.span.clone(),
        };
        self.typed(&not, hint)
    }

    fn shift(
        &mut self,
        key: &str,
        values: &[&syntax::Expression],
        hint: Option<&Type>,
    ) -> Option<Expression> {
        let found = self.typed(values[0], hint);
        let by = self.long(values[1]);
        let (found, by) = (found?, by?);
        let Some(of) = found.of.elementary().filter(|of| is_whole(*of) || *of == Elementary::Bool)
        else {
            let shown = self.describe(&found.of);
            let message = format!("{key} needs a bit string, and this is {shown}");
            let help = "convert it first, such as with TO_DWORD(…)";
            self.error_with("U1043", message, values[0].span.clone(), help);
            return None;
        };
        let bits = as_bits(of);
        let operation = match key {
            "SHL" => Operation::ShiftLeft(bits),
            "SHR" => Operation::ShiftRight(bits),
            "ROL" => Operation::RotateLeft(bits),
            _ => Operation::RotateRight(bits),
        };
        let operands = vec![reinterpret(found, bits), by];
        Some(reinterpret(apply(operation, operands, Type::Elementary(bits)), of))
    }

    /// A whole number as a LINT.
    pub(super) fn long(&mut self, value: &syntax::Expression) -> Option<Expression> {
        let found = self.typed(value, None)?;
        match found.of.elementary() {
            Some(of) if is_whole(of) => Some(convert(found, Elementary::Lint)),
            _ => {
                let found = self.describe(&found.of);
                let message = format!("expected a whole number, found {found}");
                self.error("U1043", message, value.span.clone());
                None
            }
        }
    }

    fn size_of(&mut self, value: &syntax::Expression) -> Operand {
        let of = match &value.kind {
            syntax::ExpressionKind::Variable(path)
                if path.steps.is_empty() && self.lookup(&path.root).is_none() =>
            {
                let kind = syntax::TypeKind::Named(path.root.clone());
                let span = value.span.clone();
                self.resolve(&syntax::TypeName { kind, span }).map(|found| found.of)
            }
            _ => self.typed(value, None).map(|found| found.of),
        };
        match of {
            Some(of) => Operand::Number(Number::Integer(i128::from(self.bytes(&of)))),
            None => Operand::Faulty,
        }
    }

    /// Bytes of a type as other compilers count them, without gaps.
    pub(super) fn bytes(&self, of: &Type) -> u64 {
        match of {
            Type::Elementary(of) | Type::Enumeration(_, of) => u64::from(of.bits().div_ceil(8)),
            Type::Text(capacity) => u64::from(*capacity) + 1,
            Type::Array(array) => array.length().saturating_mul(self.bytes(&array.element)),
            Type::Structure(id, _) => {
                let fields = &self.program.structures[id.0 as usize].fields;
                fields.iter().map(|field| self.bytes(&field.of)).sum()
            }
        }
    }

    fn array_bound(&mut self, key: &str, values: &[&syntax::Expression]) -> Operand {
        let Some(found) = self.typed(values[0], None) else {
            return Operand::Faulty;
        };
        let Some(dimension) = self.constant_integer(values[1]) else {
            return Operand::Faulty;
        };
        let range = match &found.of {
            Type::Array(array) => {
                let at = usize::try_from(dimension - 1).ok();
                at.and_then(|at| array.ranges.get(at).copied())
            }
            _ => None,
        };
        let Some((low, high)) = range else {
            let found = self.describe(&found.of);
            let message = format!("{found} has no dimension {dimension}");
            self.error("U1043", message, values[1].span.clone());
            return Operand::Faulty;
        };
        let bound = if key == "LOWER_BOUND" { low } else { high };
        Operand::Number(Number::Integer(i128::from(bound)))
    }
}

/// A constant LINT.
fn lint(value: i64) -> Expression {
    number(Type::Elementary(Elementary::Lint), value as u64)
}
