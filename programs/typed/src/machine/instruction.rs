//! Instructions of the register machine: an operation and three operands.
//!
//! An operand is the number of a slot in one row of memory:
//!
//! ```text
//! state | frames | time since the start | temporary values | constants
//! ```
//!
//! or, with [`RELATIVE`], of a slot counted from the instance on which a routine runs. Code for an instance that is known when a program is compiled has no such operands.

use crate::operation::{Operation, TextOperation};
use crate::types::Elementary;

/// Marks an operand as counted from the instance.
pub(super) const RELATIVE: u32 = 1 << 31;

/// An instruction. What the operands mean is said at the operation: mostly `a` is the target, `b` and `c` are read; a jump goes to `c`.
///
/// Operands of 16 bits are what nearly every program can have: then it takes 8 bytes, and so fewer steps of the processor.
#[derive(Debug, Clone, Copy)]
pub(super) struct Instruction<O = u32> {
    pub(super) code: Code,
    pub(super) extra: u8,
    pub(super) a: O,
    pub(super) b: O,
    pub(super) c: O,
}

impl Instruction {
    /// The same with operands of 16 bits, where they fit.
    pub(super) fn narrow(self) -> Option<Instruction<u16>> {
        Some(Instruction {
            code: self.code,
            extra: self.extra,
            a: self.a.try_into().ok()?,
            b: self.b.try_into().ok()?,
            c: self.c.try_into().ok()?,
        })
    }
}

/// What an instruction does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u8)]
pub(super) enum Code {
    /// a := b
    Move,
    /// a := b where c is TRUE
    MoveIf,

    Add8,
    Add16,
    Add32,
    Add64,
    Subtract8,
    Subtract16,
    Subtract32,
    Subtract64,
    Multiply8,
    Multiply16,
    Multiply32,
    Multiply64,
    DivideS16,
    DivideS32,
    DivideS64,
    DivideU,
    ModuloS16,
    ModuloS32,
    ModuloS64,
    ModuloU,
    And,
    Or,
    Xor,
    /// a := b AND NOT c
    AndNot,
    /// a := d + b · c, where d is operand a of the [`Code::Data`] that follows; each operation is rounded.
    MultiplyAdd16,
    MultiplyAdd32,
    MultiplyAdd64,
    MultiplyAddReal,
    MultiplyAddLreal,
    /// a := d − b · c
    MultiplySubtractReal,
    MultiplySubtractLreal,
    /// Belongs to the instruction before it.
    Data,
    /// `extra` is the width.
    ShiftLeft,
    ShiftRight,
    /// The bits from `extra` on, masked by c.
    Extract,
    /// Sign extension by `extra` bits, masked by c.
    Extend,

    /// The lesser of b and c, the first where they are equal; signed ones are sign-extended by `extra` bits.
    MinimumS,
    MaximumS,
    MinimumU,
    MaximumU,

    AddReal,
    SubtractReal,
    MultiplyReal,
    DivideReal,
    NegateReal,
    AbsoluteReal,
    /// |b − c|, each operation rounded.
    DistanceReal,
    MinimumReal,
    MaximumReal,
    AddLreal,
    SubtractLreal,
    MultiplyLreal,
    DivideLreal,
    NegateLreal,
    AbsoluteLreal,
    DistanceLreal,
    MinimumLreal,
    MaximumLreal,
    /// From an integer that is sign-extended by `extra` bits.
    ToReal,
    ToLreal,
    /// The nearest integer, or the one towards 0, of the type of number `extra`; saturating.
    RoundReal,
    RoundLreal,
    TruncateReal,
    TruncateLreal,
    RealToLreal,
    LrealToReal,

    Equal,
    NotEqual,
    LessU,
    LessOrEqualU,
    LessS8,
    LessOrEqualS8,
    LessS16,
    LessOrEqualS16,
    LessS32,
    LessOrEqualS32,
    LessS64,
    LessOrEqualS64,
    EqualReal,
    NotEqualReal,
    LessReal,
    LessOrEqualReal,
    EqualLreal,
    NotEqualLreal,
    LessLreal,
    LessOrEqualLreal,

    /// To c.
    Jump,
    /// To c where a is TRUE.
    JumpIf,
    /// To c where a is FALSE.
    JumpUnless,
    /// To c where a = b, and so on.
    JumpEqual,
    JumpNotEqual,
    JumpLessU,
    JumpLessOrEqualU,
    JumpLessS8,
    JumpLessOrEqualS8,
    JumpLessS16,
    JumpLessOrEqualS16,
    JumpLessS32,
    JumpLessOrEqualS32,
    JumpLessS64,
    JumpLessOrEqualS64,
    JumpEqualReal,
    JumpNotEqualReal,
    JumpLessReal,
    JumpNotLessReal,
    JumpLessOrEqualReal,
    JumpNotLessOrEqualReal,
    JumpEqualLreal,
    JumpNotEqualLreal,
    JumpLessLreal,
    JumpNotLessLreal,
    JumpLessOrEqualLreal,
    JumpNotLessOrEqualLreal,
    /// To c where a is in the range b.
    JumpInRange,

    /// Charges the constant a.
    Charge,
    /// The step by 1 behind a turn of a loop, with the signed counter a and the limit b, and the test; to c for the next turn, which operand a of the
    /// [`Code::Data`] that follows is charged for.
    Next16,
    Next32,
    Next64,
    /// The same of the loop a, whatever the type, the step and the direction.
    Step,
    /// To c where the counter of loop a has passed its end.
    Passed,

    /// Bits of slot a from `extra` on := b, as many as c has.
    StoreBits,
    /// a := the element of the array c with index b.
    LoadWord,
    /// The element of the array c with index b := a.
    StoreWord,
    /// a := the packed element of the array c with index b.
    LoadPacked,
    /// The packed element of the array c with index b := a.
    StorePacked,
    /// a := what lies at address b; `extra` bits.
    LoadAt,
    /// What lies at address b := a; `extra` bits.
    StoreAt,
    /// a := what lies at the address in slot b, c bits from which must lie in memory; `extra` bits.
    LoadThrough,
    /// What lies at the address in slot b := a, in the same way.
    StoreThrough,
    /// Copies c slots from address b to address a.
    Copy,
    /// a := the address of b slots from the instance.
    OwnAddress,
    /// a := the address in slot b; c bits from there must lie in memory.
    Reference,
    /// a := address `a` moved by index b of the array c.
    Index,
    /// Sets b slots from a to 0.
    Clear,

    /// a := the operation in the table at b.
    Apply,
    /// Text a := the constant b.
    TextConstant,
    /// Text a := what lies at address b, at most c bytes.
    TextLoad,
    /// What lies at address b := text a, at most c bytes.
    TextStore,
    /// The operation on texts in the table at a.
    TextApply,

    /// Goes on at c, until [`Code::Return`].
    Call,
    /// The same on the instance at address a.
    CallOn,
    Return,
}

impl Code {
    /// Whether c is an instruction that may be executed next.
    pub(super) fn has_target(self) -> bool {
        let jumps = Self::Jump as u8..=Self::JumpInRange as u8;
        let steps = Self::Next16 as u8..=Self::Passed as u8;
        let is_call = matches!(self, Self::Call | Self::CallOn);
        jumps.contains(&(self as u8)) || steps.contains(&(self as u8)) || is_call
    }
}

/// An array with one computed index.
#[derive(Debug, Clone, Copy)]
pub(super) struct Element {
    /// The slot of its first element, an operand, for [`Code::LoadWord`] and [`Code::LoadPacked`].
    pub(super) base: u32,
    /// The bit of its first element in that slot.
    pub(super) bit: u32,
    /// First index.
    pub(super) low: i64,
    /// From the first index to the last.
    pub(super) span: u64,
    /// Bits from one element to the next.
    pub(super) stride: u64,
    /// 1 for each bit of an element.
    pub(super) mask: u64,
    /// Bits by which the index is to be sign-extended.
    pub(super) extension: u32,
}

/// A counted loop.
#[derive(Debug, Clone, Copy)]
pub(super) struct Loop {
    pub(super) of: Elementary,
    /// Operands.
    pub(super) counter: u32,
    pub(super) limit: u32,
    pub(super) by: u32,
    /// What a turn is charged.
    pub(super) turn: u64,
}

/// A range of a CASE.
#[derive(Debug, Clone, Copy)]
pub(super) struct Range {
    pub(super) of: Elementary,
    pub(super) low: i64,
    pub(super) high: i64,
}

/// An operation that has no instruction of its own.
#[derive(Debug, Clone)]
pub(super) struct Application {
    pub(super) operation: Operation,
    pub(super) operands: Box<[u32]>,
}

/// An operand of an operation on texts.
#[derive(Debug, Clone, Copy)]
pub(super) enum TextSource {
    Number(u32),
    Text(u32),
}

/// An operation on texts.
#[derive(Debug, Clone)]
pub(super) struct TextApplication {
    pub(super) operation: TextOperation,
    pub(super) operands: Box<[TextSource]>,
    /// The slot or the text that takes the result.
    pub(super) target: TextSource,
}
