//! Executes the instructions of a compiled program.

use crate::fault::Cause;
use crate::form::Program;
use crate::machine::Tables;
use crate::machine::instruction::{Code, Instruction, RELATIVE};
use crate::machine::working::{
    apply, apply_to_texts, extend, has_passed, insert, load_text, mask, next, offset, rounded,
    saturated, store_text,
};
use crate::operation::real::Float;
use crate::row::Row;
use crate::types::Elementary;

/// A scan that runs.
pub(super) struct Run<'a, O, R: ?Sized> {
    pub(super) code: &'a [Instruction<O>],
    pub(super) tables: &'a Tables,
    pub(super) row: &'a mut R,
    pub(super) texts: &'a mut Vec<Vec<u8>>,
    pub(super) returns: &'a mut Vec<u32>,
    pub(super) budget: u64,
}

/// An instruction that has no result, and why.
pub(super) struct Stop {
    pub(super) at: usize,
    pub(super) cause: Cause,
}

impl<O: Copy + Into<u32>, R: Row + ?Sized> Run<'_, O, R> {
    /// Executes from an instruction to the return that ends it. Without `OWN` no operand is relative.
    pub(super) fn run<const OWN: bool>(&mut self, start: u32, own: u32) -> Result<(), Stop> {
        let tables = self.tables;
        let code = self.code;
        let row: &mut R = self.row;
        let floor = self.returns.len();
        let mut at = start as usize;
        macro_rules! slot {
            ($operand:expr) => {{
                let operand = $operand;
                if OWN && operand & RELATIVE != 0 {
                    (operand & !RELATIVE).wrapping_add(own)
                } else {
                    operand
                }
            }};
        }
        macro_rules! get {
            ($operand:expr) => {
                row.get(slot!($operand))
            };
        }
        macro_rules! set {
            ($operand:expr, $value:expr) => {{
                let value: u64 = $value;
                *row.slot(slot!($operand)) = value;
            }};
        }
        macro_rules! stop {
            ($cause:expr) => {
                return Err(Stop { at: at - 1, cause: $cause })
            };
        }
        loop {
            let instruction = code[at];
            let extra = instruction.extra;
            let operands = [instruction.a, instruction.b, instruction.c];
            let [a, b, c]: [u32; 3] = operands.map(Into::into);
            at += 1;
            macro_rules! integer {
                ($type:ty, $function:ident) => {
                    set!(a, (get!(b) as $type).$function(get!(c) as $type) as u64)
                };
            }
            macro_rules! divide {
                ($signed:ty, $unsigned:ty, $function:ident) => {{
                    let divisor = get!(c) as $signed;
                    if divisor == 0 {
                        stop!(Cause::DivisionByZero {
                            dividend: get!(b),
                            of: Elementary::ALL[usize::from(extra)],
                        });
                    }
                    set!(a, (get!(b) as $signed).$function(divisor) as $unsigned as u64)
                }};
            }
            // The remainder by 0 is 0.
            macro_rules! remainder {
                ($signed:ty, $unsigned:ty) => {{
                    let remainder = match get!(c) as $signed {
                        0 => 0,
                        divisor => (get!(b) as $signed).wrapping_rem(divisor),
                    };
                    set!(a, remainder as $unsigned as u64)
                }};
            }
            macro_rules! real {
                ($type:ty, $function:ident) => {
                    set!(a, <$type>::unpack(get!(b)).$function(<$type>::unpack(get!(c))).pack())
                };
            }
            macro_rules! fourth {
                () => {{
                    let operand: u32 = code[at].a.into();
                    at += 1;
                    operand
                }};
            }
            macro_rules! add_product {
                ($type:ty) => {{
                    let product = (get!(b) as $type).wrapping_mul(get!(c) as $type);
                    set!(a, (get!(fourth!()) as $type).wrapping_add(product) as u64)
                }};
            }
            macro_rules! with_product {
                ($type:ty, $function:ident) => {{
                    let product = <$type>::unpack(get!(b)).multiply(<$type>::unpack(get!(c)));
                    set!(a, <$type>::unpack(get!(fourth!())).$function(product).pack())
                }};
            }
            macro_rules! one_real {
                ($type:ty, $function:ident) => {
                    set!(a, <$type>::unpack(get!(b)).$function().pack())
                };
            }
            macro_rules! best {
                ($type:ty, $operator:tt) => {{
                    let (first, next) = (<$type>::unpack(get!(b)), <$type>::unpack(get!(c)));
                    let best = if next $operator first { next } else { first };
                    set!(a, best.pack())
                }};
            }
            macro_rules! best_signed {
                ($operator:tt) => {{
                    let (first, next) = (get!(b), get!(c));
                    let unused = u32::from(extra);
                    let is_better = extend(next, unused) $operator extend(first, unused);
                    set!(a, if is_better { next } else { first })
                }};
            }
            macro_rules! is {
                ($type:ty, $operator:tt) => {
                    set!(a, u64::from((get!(b) as $type) $operator (get!(c) as $type)))
                };
            }
            macro_rules! is_real {
                ($type:ty, $operator:tt) => {
                    set!(a, u64::from(<$type>::unpack(get!(b)) $operator <$type>::unpack(get!(c))))
                };
            }
            macro_rules! jump {
                ($condition:expr) => {
                    if $condition {
                        at = c as usize;
                    }
                };
            }
            macro_rules! jump_is {
                ($type:ty, $operator:tt) => {
                    jump!((get!(a) as $type) $operator (get!(b) as $type))
                };
            }
            macro_rules! jump_real {
                ($type:ty, $operator:tt, $wanted:literal) => {
                    jump!((<$type>::unpack(get!(a)) $operator <$type>::unpack(get!(b))) == $wanted)
                };
            }
            macro_rules! charge {
                ($turn:expr) => {
                    match self.budget.checked_sub($turn) {
                        Some(rest) => self.budget = rest,
                        None => stop!(Cause::BudgetExceeded { budget: tables.budget }),
                    }
                };
            }
            macro_rules! next_turn {
                ($type:ty, $unsigned:ty) => {{
                    let turn = fourth!();
                    let counter = get!(a) as $type;
                    if counter < get!(b) as $type {
                        set!(a, (counter + 1) as $unsigned as u64);
                        charge!(get!(turn));
                        at = c as usize;
                    } else if let Some(next) = counter.checked_add(1) {
                        set!(a, next as $unsigned as u64);
                    }
                }};
            }
            macro_rules! referred {
                ($address:expr) => {{
                    let address = $address;
                    let end = address.saturating_add(get!(c));
                    if address < 64 * u64::from(Program::HEADER) || end > tables.memory {
                        stop!(Cause::UnboundReference { address });
                    }
                    address
                }};
            }
            macro_rules! element {
                ($element:expr) => {
                    match offset($element, get!(b)) {
                        Ok(offset) => offset,
                        Err(cause) => stop!(cause),
                    }
                };
            }
            match instruction.code {
                Code::Move => set!(a, get!(b)),
                Code::MoveIf => {
                    // Bit by bit, without a jump.
                    let (before, chosen) = (get!(a), u64::from(get!(c) != 0).wrapping_neg());
                    set!(a, before ^ ((before ^ get!(b)) & chosen));
                }
                Code::Add8 => integer!(u8, wrapping_add),
                Code::Add16 => integer!(u16, wrapping_add),
                Code::Add32 => integer!(u32, wrapping_add),
                Code::Add64 => integer!(u64, wrapping_add),
                Code::Subtract8 => integer!(u8, wrapping_sub),
                Code::Subtract16 => integer!(u16, wrapping_sub),
                Code::Subtract32 => integer!(u32, wrapping_sub),
                Code::Subtract64 => integer!(u64, wrapping_sub),
                Code::Multiply8 => integer!(u8, wrapping_mul),
                Code::Multiply16 => integer!(u16, wrapping_mul),
                Code::Multiply32 => integer!(u32, wrapping_mul),
                Code::Multiply64 => integer!(u64, wrapping_mul),
                Code::DivideS16 => divide!(i16, u16, wrapping_div),
                Code::DivideS32 => divide!(i32, u32, wrapping_div),
                Code::DivideS64 => divide!(i64, u64, wrapping_div),
                Code::DivideU => divide!(u64, u64, wrapping_div),
                Code::ModuloS16 => remainder!(i16, u16),
                Code::ModuloS32 => remainder!(i32, u32),
                Code::ModuloS64 => remainder!(i64, u64),
                Code::ModuloU => remainder!(u64, u64),
                Code::And => set!(a, get!(b) & get!(c)),
                Code::Or => set!(a, get!(b) | get!(c)),
                Code::Xor => set!(a, get!(b) ^ get!(c)),
                Code::AndNot => set!(a, get!(b) & !get!(c)),
                Code::MultiplyAdd16 => add_product!(u16),
                Code::MultiplyAdd32 => add_product!(u32),
                Code::MultiplyAdd64 => add_product!(u64),
                Code::MultiplyAddReal => with_product!(f32, add),
                Code::MultiplyAddLreal => with_product!(f64, add),
                Code::MultiplySubtractReal => with_product!(f32, subtract),
                Code::MultiplySubtractLreal => with_product!(f64, subtract),
                Code::Data => {}
                Code::ShiftLeft => {
                    let by = get!(c);
                    let shifted = get!(b) << (by & 63) & mask(extra);
                    set!(a, if by < u64::from(extra) { shifted } else { 0 });
                }
                Code::ShiftRight => {
                    let by = get!(c);
                    let shifted = get!(b) >> (by & 63);
                    set!(a, if by < u64::from(extra) { shifted } else { 0 });
                }
                Code::Extract => set!(a, get!(b) >> (extra & 63) & get!(c)),
                Code::Extend => set!(a, extend(get!(b), u32::from(extra)) as u64 & get!(c)),
                Code::MinimumS => best_signed!(<),
                Code::MaximumS => best_signed!(>),
                Code::MinimumU => set!(a, get!(b).min(get!(c))),
                Code::MaximumU => set!(a, get!(b).max(get!(c))),
                Code::AddReal => real!(f32, add),
                Code::SubtractReal => real!(f32, subtract),
                Code::MultiplyReal => real!(f32, multiply),
                Code::DivideReal => real!(f32, divide),
                Code::NegateReal => one_real!(f32, negate),
                Code::AbsoluteReal => one_real!(f32, absolute),
                Code::DistanceReal => {
                    let difference = <f32>::unpack(get!(b)).subtract(<f32>::unpack(get!(c)));
                    set!(a, difference.absolute().pack());
                }
                Code::MinimumReal => best!(f32, <),
                Code::MaximumReal => best!(f32, >),
                Code::AddLreal => real!(f64, add),
                Code::SubtractLreal => real!(f64, subtract),
                Code::MultiplyLreal => real!(f64, multiply),
                Code::DivideLreal => real!(f64, divide),
                Code::NegateLreal => one_real!(f64, negate),
                Code::AbsoluteLreal => one_real!(f64, absolute),
                Code::DistanceLreal => {
                    let difference = <f64>::unpack(get!(b)).subtract(<f64>::unpack(get!(c)));
                    set!(a, difference.absolute().pack());
                }
                Code::MinimumLreal => best!(f64, <),
                Code::MaximumLreal => best!(f64, >),
                Code::ToReal => set!(a, (extend(get!(b), u32::from(extra)) as f32).pack()),
                Code::ToLreal => set!(a, (extend(get!(b), u32::from(extra)) as f64).pack()),
                Code::RoundReal => set!(a, rounded(f32::unpack(get!(b)).into(), extra)),
                Code::RoundLreal => set!(a, rounded(f64::unpack(get!(b)), extra)),
                Code::TruncateReal => set!(a, saturated(f32::unpack(get!(b)).into(), extra)),
                Code::TruncateLreal => set!(a, saturated(f64::unpack(get!(b)), extra)),
                Code::RealToLreal => set!(a, f64::from(f32::unpack(get!(b))).pack()),
                Code::LrealToReal => set!(a, (f64::unpack(get!(b)) as f32).pack()),
                Code::Equal => is!(u64, ==),
                Code::NotEqual => is!(u64, !=),
                Code::LessU => is!(u64, <),
                Code::LessOrEqualU => is!(u64, <=),
                Code::LessS8 => is!(i8, <),
                Code::LessOrEqualS8 => is!(i8, <=),
                Code::LessS16 => is!(i16, <),
                Code::LessOrEqualS16 => is!(i16, <=),
                Code::LessS32 => is!(i32, <),
                Code::LessOrEqualS32 => is!(i32, <=),
                Code::LessS64 => is!(i64, <),
                Code::LessOrEqualS64 => is!(i64, <=),
                Code::EqualReal => is_real!(f32, ==),
                Code::NotEqualReal => is_real!(f32, !=),
                Code::LessReal => is_real!(f32, <),
                Code::LessOrEqualReal => is_real!(f32, <=),
                Code::EqualLreal => is_real!(f64, ==),
                Code::NotEqualLreal => is_real!(f64, !=),
                Code::LessLreal => is_real!(f64, <),
                Code::LessOrEqualLreal => is_real!(f64, <=),
                Code::Jump => at = c as usize,
                Code::JumpIf => jump!(get!(a) != 0),
                Code::JumpUnless => jump!(get!(a) == 0),
                Code::JumpEqual => jump_is!(u64, ==),
                Code::JumpNotEqual => jump_is!(u64, !=),
                Code::JumpLessU => jump_is!(u64, <),
                Code::JumpLessOrEqualU => jump_is!(u64, <=),
                Code::JumpLessS8 => jump_is!(i8, <),
                Code::JumpLessOrEqualS8 => jump_is!(i8, <=),
                Code::JumpLessS16 => jump_is!(i16, <),
                Code::JumpLessOrEqualS16 => jump_is!(i16, <=),
                Code::JumpLessS32 => jump_is!(i32, <),
                Code::JumpLessOrEqualS32 => jump_is!(i32, <=),
                Code::JumpLessS64 => jump_is!(i64, <),
                Code::JumpLessOrEqualS64 => jump_is!(i64, <=),
                Code::JumpEqualReal => jump_real!(f32, ==, true),
                Code::JumpNotEqualReal => jump_real!(f32, !=, true),
                Code::JumpLessReal => jump_real!(f32, <, true),
                Code::JumpNotLessReal => jump_real!(f32, <, false),
                Code::JumpLessOrEqualReal => jump_real!(f32, <=, true),
                Code::JumpNotLessOrEqualReal => jump_real!(f32, <=, false),
                Code::JumpEqualLreal => jump_real!(f64, ==, true),
                Code::JumpNotEqualLreal => jump_real!(f64, !=, true),
                Code::JumpLessLreal => jump_real!(f64, <, true),
                Code::JumpNotLessLreal => jump_real!(f64, <, false),
                Code::JumpLessOrEqualLreal => jump_real!(f64, <=, true),
                Code::JumpNotLessOrEqualLreal => jump_real!(f64, <=, false),
                Code::JumpInRange => {
                    let range = &tables.ranges[b as usize];
                    let value = range.of.signed(get!(a));
                    jump!(i128::from(range.low) <= value && value <= i128::from(range.high));
                }
                Code::Charge => charge!(get!(a)),
                Code::Next16 => next_turn!(i16, u16),
                Code::Next32 => next_turn!(i32, u32),
                Code::Next64 => next_turn!(i64, u64),
                Code::Step => {
                    let each = tables.loops[a as usize];
                    let (counter, by) = (slot!(each.counter), get!(each.by));
                    if let Some(next) = next(&each, *row.slot(counter), by) {
                        *row.slot(counter) = next;
                        if !has_passed(&each, next, get!(each.limit), by) {
                            charge!(each.turn);
                            at = c as usize;
                        }
                    }
                }
                Code::Passed => {
                    let each = tables.loops[a as usize];
                    let (limit, by) = (get!(each.limit), get!(each.by));
                    jump!(has_passed(&each, get!(each.counter), limit, by));
                }
                Code::StoreBits => {
                    let (value, mask) = (get!(b), get!(c));
                    insert(row.slot(slot!(a)), u64::from(extra), mask, value);
                }
                Code::LoadWord => {
                    let element = &tables.elements[c as usize];
                    let offset = element!(element);
                    let from = slot!(element.base) as usize + (offset / 64) as usize;
                    set!(a, row.all()[from]);
                }
                Code::StoreWord => {
                    let element = &tables.elements[c as usize];
                    let offset = element!(element);
                    let to = slot!(element.base) as usize + (offset / 64) as usize;
                    row.all()[to] = get!(a);
                }
                Code::LoadPacked => {
                    let element = &tables.elements[c as usize];
                    let offset = element!(element) + u64::from(element.bit);
                    let from = slot!(element.base) as usize + (offset / 64) as usize;
                    set!(a, row.all()[from] >> (offset % 64) & element.mask);
                }
                Code::StorePacked => {
                    let element = &tables.elements[c as usize];
                    let offset = element!(element) + u64::from(element.bit);
                    let to = slot!(element.base) as usize + (offset / 64) as usize;
                    let value = get!(a);
                    insert(&mut row.all()[to], offset, element.mask, value);
                }
                Code::LoadAt => {
                    let address = get!(b);
                    let word = row.all()[(address / 64) as usize];
                    set!(a, word >> (address % 64) & mask(extra));
                }
                Code::StoreAt => {
                    let (address, value) = (get!(b), get!(a));
                    let word = &mut row.all()[(address / 64) as usize];
                    insert(word, address, mask(extra), value);
                }
                Code::LoadThrough => {
                    let address = referred!(get!(b));
                    let word = row.all()[(address / 64) as usize];
                    set!(a, word >> (address % 64) & mask(extra));
                }
                Code::StoreThrough => {
                    let address = referred!(get!(b));
                    let value = get!(a);
                    let word = &mut row.all()[(address / 64) as usize];
                    insert(word, address, mask(extra), value);
                }
                Code::Copy => {
                    let (to, from) = ((get!(a) / 64) as usize, (get!(b) / 64) as usize);
                    row.all().copy_within(from..from + c as usize, to);
                }
                Code::OwnAddress => set!(a, 64 * (u64::from(own) + u64::from(b))),
                Code::Reference => set!(a, referred!(get!(b))),
                Code::Index => {
                    let offset = element!(&tables.elements[c as usize]);
                    set!(a, get!(a).wrapping_add(offset));
                }
                Code::Clear => {
                    let first = slot!(a) as usize;
                    row.all()[first..first + b as usize].fill(0);
                }
                Code::Apply => {
                    let application = &tables.applications[b as usize];
                    match apply(application, |operand| get!(operand)) {
                        Ok(result) => set!(a, result),
                        Err(cause) => stop!(cause),
                    }
                }
                Code::TextConstant => {
                    let text = &mut self.texts[a as usize];
                    text.clear();
                    text.extend_from_slice(&tables.texts[b as usize]);
                }
                Code::TextLoad => {
                    let first = (get!(b) / 64) as usize;
                    load_text(&row.all()[first..], c as usize, &mut self.texts[a as usize]);
                }
                Code::TextStore => {
                    let first = (get!(b) / 64) as usize;
                    let text = &self.texts[a as usize];
                    if text.len() > c as usize {
                        stop!(Cause::TextTooLong {
                            length: text.len() as u64,
                            capacity: u64::from(c),
                        });
                    }
                    store_text(&mut row.all()[first..], c as usize, text);
                }
                Code::TextApply => {
                    let application = &tables.text_applications[a as usize];
                    apply_to_texts(application, self.texts, &mut |operand, value| {
                        if let Some(value) = value {
                            set!(operand, value);
                        }
                        get!(operand)
                    });
                }
                Code::Call => {
                    self.returns.push(at as u32);
                    at = c as usize;
                }
                Code::CallOn => {
                    let own = (get!(a) / 64) as u32;
                    let mut inner = Run {
                        code,
                        row: &mut *row,
                        tables,
                        texts: &mut *self.texts,
                        returns: &mut *self.returns,
                        budget: self.budget,
                    };
                    inner.run::<true>(c, own)?;
                    self.budget = inner.budget;
                }
                Code::Return => {
                    if self.returns.len() == floor {
                        return Ok(());
                    }
                    at = self.returns.pop().unwrap_or(0) as usize;
                }
            }
        }
    }
}
