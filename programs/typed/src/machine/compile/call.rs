//! Calls of functions and methods, and blocks that run on an instance.

use super::place::{Location, calls, place_calls};
use super::text::capacity;
use super::{Compiler, Context, Own};
use crate::form::{Argument, Call, Place, Root, RoutineId};
use crate::machine::instruction::Code;
use crate::types::{Elementary, Type};

/// An evaluated argument.
#[derive(Debug, Clone, Copy)]
enum Given {
    /// The operand of an elementary value, or of an address.
    Number(u32),
    Text(u32),
    /// The address of an array or a structure.
    Slots(u32),
}

impl Compiler<'_> {
    /// Runs a block on an instance.
    pub(super) fn invoke(&mut self, routine: RoutineId, place: &Place) {
        let own = self.instance(place);
        self.clear(routine);
        self.enter(routine, Some(own));
    }

    /// Where the variables of an instance are.
    fn instance(&mut self, place: &Place) -> Own {
        let is_known = place.indices.is_empty();
        match (place.root, self.context.own) {
            (Root::Global(slot), _) if is_known => Own::At(slot + place.offset),
            (Root::Frame(slot), _) if is_known => Own::At(self.program.state + slot + place.offset),
            (Root::Own(slot), Own::At(own)) if is_known => Own::At(own + slot + place.offset),
            _ => Own::Address(self.address(place)),
        }
    }

    /// Goes to the code of a routine.
    fn enter(&mut self, routine: RoutineId, own: Option<Own>) {
        let known = match own {
            Some(Own::At(slot)) if self.is_special(routine, slot) => Some(slot),
            _ => None,
        };
        if known.is_some() || own.is_none() {
            if self.is_inlined(routine, known) {
                self.inline(routine, known);
                return;
            }
            let unit = self.unit(routine, known);
            self.jump(Code::Call, 0, 0, unit);
            return;
        }
        let unit = self.unit(routine, None);
        match own {
            None | Some(Own::Relative) => panic!("an instance has a slot or an address"),
            Some(Own::Address(address)) => self.jump(Code::CallOn, address, 0, unit),
            Some(Own::At(slot)) => {
                let address = self.constant(64 * u64::from(slot));
                self.jump(Code::CallOn, address, 0, unit);
            }
        }
    }

    /// The code of a routine in place of a call.
    fn inline(&mut self, routine: RoutineId, own: Option<u32>) {
        let end = self.label();
        let inner = Context {
            routine,
            line: 0,
            own: own.map_or(Own::Relative, Own::At),
            level: self.levels[routine.0 as usize],
            temporaries: 0,
            texts: 0,
            end: Some(end),
        };
        let outer = std::mem::replace(&mut self.context, inner);
        let loops = std::mem::take(&mut self.loops);
        let program = self.program;
        self.statements(&program.routine(routine).body);
        self.loops = loops;
        self.context = outer;
        self.place_label(end);
    }

    /// Does something with the variables of a called routine.
    pub(super) fn in_routine<T>(
        &mut self,
        own: Option<Own>,
        inner: impl FnOnce(&mut Self) -> T,
    ) -> T {
        let outer = self.context.own;
        self.context.own = own.unwrap_or(outer);
        let result = inner(self);
        self.context.own = outer;
        result
    }

    /// A call without its result; answers with the instance.
    pub(super) fn call(&mut self, call: &Call) -> Option<Own> {
        let own = call.own.as_ref().map(|place| self.instance(place));
        let given = self.arguments(call);
        let mut taken = Vec::with_capacity(call.outputs.len());
        for (_, to) in &call.outputs {
            taken.push(match to.of.elementary() {
                Some(of) if to.indices.is_empty() && !to.is_by_reference() => self.location(to, of),
                _ => Location::Address(self.address(to)),
            });
        }
        self.clear(call.routine);
        for (argument, given) in call.arguments.iter().zip(given) {
            self.scope(|compiler| {
                compiler.in_routine(own, |compiler| compiler.give(argument, given));
            });
        }
        self.enter(call.routine, own);
        for ((from, to), location) in call.outputs.iter().zip(taken) {
            self.scope(|compiler| compiler.take(own, from, to, location));
        }
        own
    }

    fn arguments(&mut self, call: &Call) -> Vec<Given> {
        let mut given = Vec::with_capacity(call.arguments.len());
        for (index, argument) in call.arguments.iter().enumerate() {
            let later = &call.arguments[index + 1..];
            // What is evaluated later may change a variable that is read now.
            let more = later.iter().any(|argument| match argument {
                Argument::Value(_, value) => calls(value),
                Argument::Reference(_, place) => place_calls(place),
            }) || call.outputs.iter().any(|(_, to)| place_calls(to));
            given.push(match argument {
                Argument::Reference(_, place) => Given::Number(self.address(place)),
                Argument::Value(_, value) => match &value.of {
                    Type::Elementary(_) | Type::Enumeration(..) => {
                        let operand = self.operand(value);
                        Given::Number(if more { self.kept(operand) } else { operand })
                    }
                    Type::Text(_) => Given::Text(self.text(value)),
                    of => {
                        let slots = of.slots() as u32;
                        let copy = self.temporaries_of(slots);
                        let to = self.constant(64 * u64::from(copy));
                        let from = self.scope(|compiler| compiler.aggregate(value));
                        self.emit(Code::Copy, to, from, slots);
                        Given::Slots(to)
                    }
                },
            });
        }
        given
    }

    /// Stores an argument into a variable of the routine.
    fn give(&mut self, argument: &Argument, given: Given) {
        let (Argument::Value(place, _) | Argument::Reference(place, _)) = argument;
        match given {
            Given::Number(value) if matches!(argument, Argument::Reference(..)) => {
                let holder = self.location(&place.holder(), Elementary::Lword);
                self.store(holder, Elementary::Lword, value);
            }
            Given::Number(value) => {
                let of = place.of.elementary().unwrap_or(Elementary::Lword);
                let location = self.location(place, of);
                self.store(location, of, value);
            }
            Given::Text(text) => {
                let address = self.address(place);
                self.emit(Code::TextStore, text, address, capacity(place));
            }
            Given::Slots(from) => {
                let address = self.address(place);
                self.emit(Code::Copy, address, from, place.of.slots() as u32);
            }
        }
    }

    /// Copies a variable of the routine to a place of the caller.
    fn take(&mut self, own: Option<Own>, from: &Place, to: &Place, location: Location) {
        if let (Some(of), Some(target)) = (from.of.elementary(), to.of.elementary()) {
            let source = self.in_routine(own, |compiler| compiler.location(from, of));
            let value = match source {
                Location::Slot(slot) => slot,
                _ => {
                    let value = self.temporary();
                    self.load(source, of, value);
                    value
                }
            };
            self.store(location, target, value);
            return;
        }
        let Location::Address(address) = location else {
            return;
        };
        let source = self.in_routine(own, |compiler| compiler.address(from));
        match (&from.of, &to.of) {
            (Type::Text(_), Type::Text(_)) => {
                let text = self.new_text();
                self.emit(Code::TextLoad, text, source, capacity(from));
                self.emit(Code::TextStore, text, address, capacity(to));
            }
            (of, _) => self.emit(Code::Copy, address, source, of.slots() as u32),
        }
    }
}
