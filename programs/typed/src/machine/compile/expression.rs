//! Expressions: operands and instructions.

use super::Compiler;
use super::place::{Location, calls};
use crate::form::{Expression, ExpressionKind};
use crate::machine::instruction::{Application, Code, TextSource};
use crate::machine::working::is_saturated;
use crate::operation::{Comparison, Operation};
use crate::types::Elementary;

/// The instruction for a comparison, and whether its operands are exchanged.
pub(super) struct Compared {
    pub(super) code: Code,
    pub(super) is_exchanged: bool,
}

impl Compiler<'_> {
    /// The operand of an elementary value: a variable, a constant or a temporary slot.
    pub(super) fn operand(&mut self, expression: &Expression) -> u32 {
        match &expression.kind {
            ExpressionKind::Constant(value) => return self.constant(*value),
            ExpressionKind::Load(place) => {
                if let Some(of) = place.of.elementary()
                    && place.indices.is_empty()
                    && !place.is_by_reference()
                    && let Location::Slot(slot) = self.location(place, of)
                {
                    return slot;
                }
            }
            ExpressionKind::Apply(Operation::Elapsed, _) => return self.elapsed(),
            ExpressionKind::Apply(operation, operands) if keeps_bits(*operation) => {
                return self.operand(&operands[0]);
            }
            _ => {}
        }
        let target = self.temporary();
        self.scope(|compiler| compiler.into(expression, target));
        target
    }

    /// The same for one of several operands: it keeps its value while those behind it are evaluated.
    pub(super) fn operand_before<'e>(
        &mut self,
        expression: &Expression,
        later: impl IntoIterator<Item = &'e Expression>,
    ) -> u32 {
        let operand = self.operand(expression);
        if later.into_iter().any(calls) { self.kept(operand) } else { operand }
    }

    /// Several operands, each of which keeps its value.
    pub(super) fn operands(&mut self, operands: &[&Expression]) -> Vec<u32> {
        let indices = 0..operands.len();
        indices
            .map(|index| {
                let later = operands[index + 1..].iter().copied();
                self.operand_before(operands[index], later)
            })
            .collect()
    }

    /// `to` := an elementary value. It is written last, so the expression may read it.
    pub(super) fn into(&mut self, expression: &Expression, to: u32) {
        match &expression.kind {
            ExpressionKind::Constant(_) | ExpressionKind::Apply(Operation::Elapsed, _) => {
                let value = self.operand(expression);
                self.emit(Code::Move, to, value, 0);
            }
            ExpressionKind::Load(place) => {
                let of = place.of.elementary().expect("an elementary type");
                let from = self.location(place, of);
                self.load(from, of, to);
            }
            ExpressionKind::Apply(Operation::Text(operation), operands) => {
                self.apply_to_texts(*operation, operands, TextSource::Number(to));
            }
            ExpressionKind::Apply(operation, operands) if keeps_bits(*operation) => {
                self.into(&operands[0], to);
            }
            ExpressionKind::Apply(operation, operands) => {
                if self.apply_two(*operation, operands, to).is_some() {
                    return;
                }
                let operands: Vec<&Expression> = operands.iter().collect();
                let operands = self.operands(&operands);
                self.apply(*operation, &operands, to);
            }
            ExpressionKind::Choose(parts) => {
                let [condition, first, second] = &**parts;
                let (otherwise, end) = (self.label(), self.label());
                self.scope(|compiler| compiler.condition(condition, otherwise, false));
                self.scope(|compiler| compiler.into(first, to));
                self.jump(Code::Jump, 0, 0, end);
                self.place_label(otherwise);
                self.scope(|compiler| compiler.into(second, to));
                self.place_label(end);
            }
            ExpressionKind::Call(call) => {
                let own = self.call(call);
                if let Some(place) = &call.result {
                    let of = place.of.elementary().expect("an elementary type");
                    self.in_routine(own, |compiler| {
                        let from = compiler.location(place, of);
                        compiler.load(from, of, to);
                    });
                }
            }
            ExpressionKind::Text(_) => panic!("a text is no number"),
        }
    }

    /// A slot with the address of an array or a structure.
    pub(super) fn aggregate(&mut self, expression: &Expression) -> u32 {
        match &expression.kind {
            ExpressionKind::Load(place) => self.address(place),
            ExpressionKind::Call(call) => {
                let own = self.call(call);
                let place = call.result.as_ref().expect("a result");
                self.in_routine(own, |compiler| compiler.address(place))
            }
            ExpressionKind::Choose(parts) => {
                let [condition, first, second] = &**parts;
                let (otherwise, end) = (self.label(), self.label());
                let to = self.temporary();
                self.scope(|compiler| compiler.condition(condition, otherwise, false));
                self.scope(|compiler| compiler.aggregate_into(first, to));
                self.jump(Code::Jump, 0, 0, end);
                self.place_label(otherwise);
                self.scope(|compiler| compiler.aggregate_into(second, to));
                self.place_label(end);
                to
            }
            other => panic!("{other:?} is no array and no structure"),
        }
    }

    fn aggregate_into(&mut self, expression: &Expression, to: u32) {
        let address = self.aggregate(expression);
        self.emit(Code::Move, to, address, 0);
    }

    /// Adds to an integer in a slot.
    pub(super) fn add(&mut self, of: Elementary, slot: u32, added: u32) {
        self.apply(Operation::Add(of), &[slot, added], slot);
    }

    fn apply(&mut self, operation: Operation, operands: &[u32], to: u32) {
        if self.apply_fast(operation, operands, to).is_some() {
            return;
        }
        self.tables.applications.push(Application { operation, operands: operands.into() });
        let table = self.tables.applications.len() as u32 - 1;
        self.emit(Code::Apply, to, table, 0);
    }

    /// An operation that has an instruction of its own.
    fn apply_fast(&mut self, operation: Operation, operands: &[u32], to: u32) -> Option<()> {
        use Operation as O;
        match (operation, operands) {
            (_, [value]) if keeps_bits(operation) => self.emit(Code::Move, to, *value, 0),
            (O::Minimum(of) | O::Maximum(of), [first, between @ .., last]) => {
                let code = extreme(of, matches!(operation, O::Minimum(_)));
                let unused = if of.is_signed() { 64 - of.bits() } else { 0 };
                let mut best = *first;
                for next in between {
                    let better = self.temporary();
                    self.emit_with(code, unused as u8, better, best, *next);
                    best = better;
                }
                self.emit_with(code, unused as u8, to, best, *last);
            }
            (O::Compare(comparison, of), [left, right]) => {
                let Compared { code, is_exchanged } = comparing(comparison, of);
                let (left, right) = match is_exchanged {
                    true => (right, left),
                    false => (left, right),
                };
                self.emit(code, to, *left, *right);
            }
            (O::Select(_), [condition, first, second]) if to != *condition && to != *second => {
                self.emit(Code::Move, to, *first, 0);
                self.emit(Code::MoveIf, to, *second, *condition);
            }
            (O::ShiftLeft(of), [value, by]) => {
                self.emit_with(Code::ShiftLeft, of.bits() as u8, to, *value, *by);
            }
            (O::ShiftRight(of), [value, by]) => {
                self.emit_with(Code::ShiftRight, of.bits() as u8, to, *value, *by);
            }
            (O::Not(of), [value]) => {
                let mask = self.constant(of.mask());
                self.emit(Code::Xor, to, *value, mask);
            }
            (O::Extract { to: part, at, .. }, [value]) => {
                let mask = self.constant(part.mask());
                self.emit_with(Code::Extract, at, to, *value, mask);
            }
            (O::Negate(of), [value]) if !of.is_real() => {
                let zero = self.constant(0);
                let code = binary(O::Subtract(of))?;
                self.emit(code, to, zero, *value);
            }
            (O::Convert(from, target), [value]) => self.convert(from, target, *value, to)?,
            (O::Truncate(from, target), [value]) => {
                let codes = [Code::TruncateReal, Code::TruncateLreal];
                self.whole(codes, from, target, *value, to)?;
            }
            (O::Divide(of), [left, right]) => {
                let of_type = Elementary::ALL.iter().position(|each| *each == of)?;
                self.emit_with(binary(operation)?, of_type as u8, to, *left, *right);
            }
            (_, [left, right]) => self.emit(binary(operation)?, to, *left, *right),
            (_, [value]) => {
                let code = match operation {
                    O::Negate(Elementary::Real) => Code::NegateReal,
                    O::Negate(Elementary::Lreal) => Code::NegateLreal,
                    O::Absolute(Elementary::Real) => Code::AbsoluteReal,
                    O::Absolute(Elementary::Lreal) => Code::AbsoluteLreal,
                    _ => return None,
                };
                self.emit(code, to, *value, 0);
            }
            _ => return None,
        }
        Some(())
    }

    /// A real to an integer, by the code for REAL or the one for LREAL.
    fn whole(
        &mut self,
        [real, lreal]: [Code; 2],
        from: Elementary,
        target: Elementary,
        value: u32,
        to: u32,
    ) -> Option<()> {
        let of = Elementary::ALL.iter().position(|each| *each == target)?;
        let code = match from {
            Elementary::Real => real,
            _ => lreal,
        };
        is_saturated(target).then(|| self.emit_with(code, of as u8, to, value, 0))
    }

    fn convert(&mut self, from: Elementary, target: Elementary, value: u32, to: u32) -> Option<()> {
        let unused = if from.is_signed() { 64 - from.bits() } else { 0 };
        match (from, target) {
            (Elementary::Real, Elementary::Lreal) => self.emit(Code::RealToLreal, to, value, 0),
            (Elementary::Lreal, Elementary::Real) => self.emit(Code::LrealToReal, to, value, 0),
            _ if from.is_real() => {
                let codes = [Code::RoundReal, Code::RoundLreal];
                self.whole(codes, from, target, value, to)?;
            }
            // Of 64 bits without a sign: not all numbers are those of an i64.
            _ if target.is_real() && !from.is_signed() && from.bits() == 64 => return None,
            (_, Elementary::Real) => {
                self.emit_with(Code::ToReal, unused as u8, to, value, 0);
            }
            (_, Elementary::Lreal) => {
                self.emit_with(Code::ToLreal, unused as u8, to, value, 0);
            }
            (_, Elementary::Bool) => {
                let zero = self.constant(0);
                self.emit(Code::NotEqual, to, value, zero);
            }
            _ => {
                let mask = self.constant(target.mask());
                self.emit_with(Code::Extend, unused as u8, to, value, mask);
            }
        }
        Some(())
    }
}

/// The instruction for the lesser or the greater of two.
fn extreme(of: Elementary, is_least: bool) -> Code {
    match (of, is_least) {
        (Elementary::Real, true) => Code::MinimumReal,
        (Elementary::Real, false) => Code::MaximumReal,
        (Elementary::Lreal, true) => Code::MinimumLreal,
        (Elementary::Lreal, false) => Code::MaximumLreal,
        (_, true) if of.is_signed() => Code::MinimumS,
        (_, false) if of.is_signed() => Code::MaximumS,
        (_, true) => Code::MinimumU,
        (_, false) => Code::MaximumU,
    }
}

/// Whether the result has the bits of the operand.
fn keeps_bits(operation: Operation) -> bool {
    match operation {
        Operation::Reinterpret(..) => true,
        Operation::Convert(from, to) if from == to => !from.is_real(),
        Operation::Convert(from, to) => {
            let is_whole = !from.is_real() && !to.is_real();
            let is_widened = from.bits() < to.bits() && !from.is_signed();
            is_whole && to != Elementary::Bool && (is_widened || from.bits() == to.bits())
        }
        _ => false,
    }
}

/// The instruction of an operation on two operands.
fn binary(operation: Operation) -> Option<Code> {
    use Elementary::{Lreal, Real};
    use Operation as O;
    Some(match operation {
        O::Add(Real) => Code::AddReal,
        O::Add(Lreal) => Code::AddLreal,
        O::Subtract(Real) => Code::SubtractReal,
        O::Subtract(Lreal) => Code::SubtractLreal,
        O::Multiply(Real) => Code::MultiplyReal,
        O::Multiply(Lreal) => Code::MultiplyLreal,
        O::Divide(Real) => Code::DivideReal,
        O::Divide(Lreal) => Code::DivideLreal,
        O::Add(of) => width(of, [Code::Add8, Code::Add16, Code::Add32, Code::Add64])?,
        O::Subtract(of) => {
            width(of, [Code::Subtract8, Code::Subtract16, Code::Subtract32, Code::Subtract64])?
        }
        O::Multiply(of) => {
            width(of, [Code::Multiply8, Code::Multiply16, Code::Multiply32, Code::Multiply64])?
        }
        O::Divide(of) if !of.is_signed() => Code::DivideU,
        O::Modulo(of) if !of.is_signed() => Code::ModuloU,
        O::Divide(of) => match of.bits() {
            16 => Code::DivideS16,
            32 => Code::DivideS32,
            64 => Code::DivideS64,
            _ => return None,
        },
        O::Modulo(of) => match of.bits() {
            16 => Code::ModuloS16,
            32 => Code::ModuloS32,
            64 => Code::ModuloS64,
            _ => return None,
        },
        O::And(_) => Code::And,
        O::Or(_) => Code::Or,
        O::Xor(_) => Code::Xor,
        _ => return None,
    })
}

fn width(of: Elementary, codes: [Code; 4]) -> Option<Code> {
    let [of8, of16, of32, of64] = codes;
    match of.bits() {
        8 => Some(of8),
        16 => Some(of16),
        32 => Some(of32),
        64 => Some(of64),
        _ => None,
    }
}

/// Instructions for =, <>, < and <= of a type.
pub(super) fn comparing(comparison: Comparison, of: Elementary) -> Compared {
    let [equal, not_equal, less, less_or_equal] = match of {
        Elementary::Real => {
            [Code::EqualReal, Code::NotEqualReal, Code::LessReal, Code::LessOrEqualReal]
        }
        Elementary::Lreal => {
            [Code::EqualLreal, Code::NotEqualLreal, Code::LessLreal, Code::LessOrEqualLreal]
        }
        _ => {
            let [less, less_or_equal] = match (of.is_signed(), of.bits()) {
                (true, 8) => [Code::LessS8, Code::LessOrEqualS8],
                (true, 16) => [Code::LessS16, Code::LessOrEqualS16],
                (true, 32) => [Code::LessS32, Code::LessOrEqualS32],
                (true, _) => [Code::LessS64, Code::LessOrEqualS64],
                (false, _) => [Code::LessU, Code::LessOrEqualU],
            };
            [Code::Equal, Code::NotEqual, less, less_or_equal]
        }
    };
    let (code, is_exchanged) = match comparison {
        Comparison::Equal => (equal, false),
        Comparison::NotEqual => (not_equal, false),
        Comparison::Less => (less, false),
        Comparison::LessOrEqual => (less_or_equal, false),
        Comparison::Greater => (less, true),
        Comparison::GreaterOrEqual => (less_or_equal, true),
    };
    Compared { code, is_exchanged }
}
