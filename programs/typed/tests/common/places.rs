//! Random places: parts of variables, with constant and computed indices.

use understudy_typed::{Elementary, Expression, ExpressionKind, Index, Operation, Place, Type};

use super::Known;
use super::code::{Writer, constant};

impl Writer<'_> {
    /// A variable of a type, or a part of one.
    pub(super) fn place(&mut self, of: &Type, is_written: bool) -> Option<Place> {
        for _ in 0..12 {
            let known = self.to.random.pick(&self.scope).clone();
            if is_written && known.is_constant {
                continue;
            }
            let place = Place::new(known.root, known.of);
            if let Some(place) = self.part(place, of) {
                return Some(place);
            }
        }
        let all: Vec<Known> =
            self.scope.iter().filter(|known| known.of.is_stored_like(of)).cloned().collect();
        match all.is_empty() {
            true => None,
            false => {
                let known = self.to.random.pick(&all).clone();
                Some(Place::new(known.root, known.of))
            }
        }
    }

    /// A part of a type, found by descending at random.
    fn part(&mut self, mut place: Place, of: &Type) -> Option<Place> {
        loop {
            if place.of.is_stored_like(of) {
                return Some(place);
            }
            match place.of.clone() {
                Type::Structure(id, _) => {
                    let fields = &self.to.program.structures[id.0 as usize].fields;
                    let field = self.to.random.pick(fields);
                    if field.is_reference {
                        return None;
                    }
                    place.offset += field.slot;
                    place.of = field.of.clone();
                }
                Type::Array(array) => self.element(&mut place, &array),
                _ => return None,
            }
        }
    }

    fn element(&mut self, place: &mut Place, array: &understudy_typed::Array) {
        let mut stride = array.stride();
        let mut bit = u64::from(place.bit);
        for &(low, high) in array.ranges.iter().rev() {
            if self.percent(50) {
                bit += stride * self.below((high - low + 1) as usize) as u64;
            } else {
                self.within += 1;
                let value = self.index(low, high);
                self.within -= 1;
                place.indices.insert(0, Index { value, low, high, stride });
            }
            stride *= high.abs_diff(low) + 1;
        }
        place.offset += (bit / 64) as u32;
        place.bit = (bit % 64) as u32;
        place.is_packed = array.element.elementary().is_some();
        place.of = array.element.clone();
    }

    /// An index, mostly within the bounds.
    fn index(&mut self, low: i64, high: i64) -> Expression {
        let lint = Elementary::Lint;
        let length = (high - low + 1) as u64;
        let choice = if self.within > 2 { 99 } else { self.below(100) };
        match choice {
            0..=1 => self.number(lint, 1),
            2..=15 => {
                let of =
                    *self.to.random.pick(&[Elementary::Int, Elementary::Usint, Elementary::Dint]);
                let rest = Expression {
                    of: Type::Elementary(of),
                    kind: ExpressionKind::Apply(
                        Operation::Modulo(of),
                        vec![self.number(of, 1), constant(of, length)],
                    ),
                };
                // Negative where the dividend is, which the bounds may not have.
                Expression {
                    of: Type::Elementary(lint),
                    kind: ExpressionKind::Apply(Operation::Convert(of, lint), vec![rest]),
                }
            }
            16..=50 => {
                let value = self.number(Elementary::Usint, 2);
                let wide = |kind| Expression { of: Type::Elementary(lint), kind };
                let convert = Operation::Convert(Elementary::Usint, lint);
                let value = wide(ExpressionKind::Apply(convert, vec![value]));
                let length = constant(lint, length);
                let rest =
                    wide(ExpressionKind::Apply(Operation::Modulo(lint), vec![value, length]));
                let low = constant(lint, low as u64);
                wide(ExpressionKind::Apply(Operation::Add(lint), vec![rest, low]))
            }
            _ => {
                let at = low + self.below(length as usize) as i64;
                constant(lint, at as u64)
            }
        }
    }
}
