//! Random operations with a result of a type.

use understudy_typed::{
    Comparison, Elementary, Operand, Operation, RealFunction, Signature, TextOperation,
};

use super::Random;

pub(crate) const COMPARISONS: [Comparison; 6] = [
    Comparison::Equal,
    Comparison::NotEqual,
    Comparison::Less,
    Comparison::LessOrEqual,
    Comparison::Greater,
    Comparison::GreaterOrEqual,
];

pub(crate) const FUNCTIONS: [RealFunction; 13] = [
    RealFunction::SquareRoot,
    RealFunction::Sine,
    RealFunction::Cosine,
    RealFunction::Tangent,
    RealFunction::ArcSine,
    RealFunction::ArcCosine,
    RealFunction::ArcTangent,
    RealFunction::Exponential,
    RealFunction::NaturalLogarithm,
    RealFunction::Logarithm,
    RealFunction::Floor,
    RealFunction::Ceiling,
    RealFunction::Round,
];

/// An operation and its signature.
pub(crate) fn with_result(random: &mut Random, of: Elementary) -> (Operation, Signature) {
    loop {
        let other = random.elementary();
        let at = random.below(64) as u8;
        let operation = match random.below(34) {
            0..=3 => Operation::Add(of),
            4..=6 => Operation::Subtract(of),
            7..=8 => Operation::Multiply(of),
            9 => Operation::Divide(of),
            10 => Operation::Modulo(of),
            11 => Operation::Negate(of),
            12 => Operation::Absolute(of),
            13 => Operation::Minimum(of),
            14 => Operation::Maximum(of),
            15 => Operation::Power(of),
            16 => Operation::Real(*random.pick(&FUNCTIONS), of),
            17 => Operation::Not(of),
            18 => Operation::And(of),
            19 => Operation::Or(of),
            20 => Operation::Xor(of),
            21 => Operation::ShiftLeft(of),
            22 => Operation::ShiftRight(of),
            23 => Operation::RotateLeft(of),
            24 => Operation::RotateRight(of),
            25 => Operation::Compare(*random.pick(&COMPARISONS), other),
            26 => Operation::Select(of),
            27 => Operation::Multiplex(of),
            28 => Operation::Truncate(other, of),
            29 => Operation::Reinterpret(other, of),
            30 => Operation::Extract { from: other, to: of, at },
            31 => Operation::Insert { of, part: other, at },
            32 => match random.below(5) {
                0 => Operation::FromBcd(other, of),
                1 => Operation::ToBcd(other, of),
                2 => Operation::Elapsed,
                3 => Operation::Text(TextOperation::To(of)),
                _ => Operation::Text(*random.pick(&[
                    TextOperation::Length,
                    TextOperation::Find,
                    TextOperation::Byte,
                    TextOperation::Compare(Comparison::Less),
                ])),
            },
            _ => Operation::Convert(other, of),
        };
        let wanted = Operand::Number(of);
        for count in [2, 1, 3, 0] {
            if let Some(signature) = operation.signature(count)
                && signature.result == wanted
            {
                return (operation, signature);
            }
        }
    }
}

/// An operation that gives a text.
pub(crate) fn with_text(random: &mut Random) -> (Operation, Signature) {
    let operation = *random.pick(&[
        TextOperation::Left,
        TextOperation::Right,
        TextOperation::Middle,
        TextOperation::Concatenate,
        TextOperation::Insert,
        TextOperation::Delete,
        TextOperation::Replace,
        TextOperation::Select,
        TextOperation::From(Elementary::Dint),
        TextOperation::From(Elementary::Lreal),
        TextOperation::From(Elementary::Time),
        TextOperation::UpperCase,
        TextOperation::LowerCase,
    ]);
    let operation = Operation::Text(operation);
    let signature = (1..=4).find_map(|count| operation.signature(count));
    (operation, signature.expect("a number of operands"))
}
