//! The signals of a program: its inputs, its outputs, and the markers that its state is made of.

use opcua::types::Variant;
use understudy_cluster::{Card, Controller, InputSource};
use understudy_remote_io::OperatorInputKind;
use understudy_typed::{Elementary, Point};
use understudy_view::{ImageSide, state_signals_of};
use understudy_wire::{Image, Member, ProgramId};

use super::{Kind, Tree, WritableInput};
use crate::trust;

/// Numbers from 0 whose names a client is given.
const MOST_NAMES: usize = 256;

/// Bits that a number of OPC UA holds.
const WORD_BITS: usize = 64;

impl Tree {
    pub(super) fn signals(
        &mut self,
        place: usize,
        controller: &Controller,
        sources: &[InputSource],
        card: impl Fn(&str) -> Card,
    ) {
        self.enter(&["Programs", &controller.name, "Inputs"]);
        let inputs = &controller.interface.inputs;
        for point in inputs {
            let status = inputs.find(&format!("{}.failed", point.name)).cloned();
            let (name, own) = (point.name.clone(), point.clone());
            let source = sources.iter().find(|source| source.name == point.name);
            let writable = source.and_then(|source| written(place, point, source));
            let meaning = writable.as_ref().map_or_else(|| sampled(point), |(meaning, _)| *meaning);
            self.add(&name, kind_of(point.of), meaning, move |seen| {
                let program = seen.program(place);
                let failed = status
                    .as_ref()
                    .and_then(|status| seen.stored(place, ImageSide::Inputs, status));
                let trust = program.map(|it| trust::input(it, &own.name, failed == Some(1)));
                let value = seen.stored(place, ImageSide::Inputs, &own);
                let value = value.map(|stored| variant_of_stored(own.of, stored));
                seen.present(value, trust.unwrap_or_default())
            });
            self.show(point, card(&point.name));
            if let Some(added) = self.variables.last_mut() {
                added.writable = writable.map(|(_, writable)| writable);
            }
        }
        self.enter(&["Programs", &controller.name, "Outputs"]);
        for point in &controller.interface.outputs {
            let (name, own) = (point.name.clone(), point.clone());
            let meaning = match point.of.is_time() {
                true => "as driven, in nanoseconds",
                false => "as driven",
            };
            self.add(&name, kind_of(point.of), meaning, move |seen| {
                let program = seen.program(place);
                let trust = program.map(|program| trust::output(program, &own.name));
                let value = seen.stored(place, ImageSide::Outputs, &own);
                let value = value.map(|stored| variant_of_stored(own.of, stored));
                seen.present(value, trust.unwrap_or_default())
            });
            self.show(point, card(&point.name));
        }
        self.enter(&["Programs", &controller.name, "Markers"]);
        let registers = controller.code.registers();
        let names: Vec<&str> = registers.iter().map(|register| register.name.as_str()).collect();
        for word in words(&names) {
            let (kind, bits) = (word.kind, word.bits);
            self.add(&word.name, kind, "value in the state before the last sample", move |seen| {
                seen.in_state(place, |state| word_of(kind, &bits, state))
            });
        }
        if controller.circuit().is_none() {
            self.variables_of(place, controller);
        }
    }

    /// The variables of a program that is no ladder. Its state is that of its text.
    fn variables_of(&mut self, place: usize, controller: &Controller) {
        for signal in state_signals_of(controller) {
            let Some(of) = signal.elementary() else {
                continue;
            };
            let meaning = match of.is_time() {
                true => "value in the state before the last sample, in nanoseconds",
                false => "value in the state before the last sample",
            };
            let own = signal.clone();
            self.add(&signal.name, kind_of(of), meaning, move |seen| {
                seen.in_state(place, |state| {
                    let stored = own.stored(state.words());
                    stored.map(|stored| variant_of_stored(of, stored))
                })
            });
        }
    }
}

impl Tree {
    /// Gives the variable of a point, which was added last, its card: the description comes before what its value is.
    fn show(&mut self, point: &Point, card: Card) {
        let Some(added) = self.variables.last_mut() else {
            return;
        };
        added.names = value_names(point);
        added.card = card.facts(point.of);
        if let Some(description) = &added.card.description {
            added.meaning = format!("{description}; {}", added.meaning).into();
        }
    }
}

/// The names of the values of an enumeration, by number from 0; none where a value is below 0 or far above.
fn value_names(point: &Point) -> Vec<String> {
    let known = point.values.iter().flat_map(|known| &known.values);
    let mut names = Vec::new();
    for (name, value) in known {
        let Some(place) = usize::try_from(*value).ok().filter(|place| *place < MOST_NAMES) else {
            return Vec::new();
        };
        names.resize(names.len().max(place + 1), String::new());
        if names[place].is_empty() {
            names[place].clone_from(name);
        }
    }
    names
}

/// Meaning of the variable of an input.
fn sampled(point: &Point) -> &'static str {
    match point.of.is_time() {
        true => "as last sampled, in nanoseconds",
        false => "as last sampled",
    }
}

/// An operator input, with the meaning of its variable.
fn written(
    place: usize,
    point: &Point,
    source: &InputSource,
) -> Option<(&'static str, WritableInput)> {
    let declaration = source.operator()?;
    let meaning = match declaration.input.kind {
        OperatorInputKind::Level => "level that operators write, as last sampled",
        OperatorInputKind::Pulse(_) => "pulse: writing TRUE presses it",
        OperatorInputKind::Group { .. } => "signal of another group, as last sampled",
        OperatorInputKind::Setpoint { .. } => match point.of.is_time() {
            true => "setpoint that operators write, as last sampled, in nanoseconds",
            false => "setpoint that operators write, as last sampled",
        },
    };
    let writable = WritableInput {
        member: Member::RemoteIo(ProgramId(u8::try_from(place).ok()?)),
        point: point.clone(),
    };
    Some((meaning, writable))
}

/// A marker: one bit of the state, or the number that several are.
#[derive(Debug, PartialEq, Eq)]
struct Word {
    name: String,
    kind: Kind,
    /// Their places in the state, the lowest bit first.
    bits: Vec<usize>,
}

/// Bits that are called `NAME.0`, `NAME.1` and so on are one number.
fn words(names: &[&str]) -> Vec<Word> {
    let mut words: Vec<Word> = Vec::new();
    for (place, name) in names.iter().enumerate() {
        let numbered =
            name.rsplit_once('.').and_then(|(word, bit)| Some((word, bit.parse::<usize>().ok()?)));
        let continued = numbered.and_then(|(word, bit)| {
            words.iter_mut().find(|known| {
                known.kind == Kind::UInt64
                    && known.name == word
                    && known.bits.len() == bit
                    && bit < WORD_BITS
            })
        });
        match (continued, numbered) {
            (Some(known), _) => known.bits.push(place),
            (None, Some((word, 0))) if !names.contains(&word) => {
                words.push(Word { name: word.to_owned(), kind: Kind::UInt64, bits: vec![place] })
            }
            _ => words.push(Word {
                name: (*name).to_owned(),
                kind: Kind::Boolean,
                bits: vec![place],
            }),
        }
    }
    words
}

fn word_of(kind: Kind, bits: &[usize], state: &Image) -> Option<Variant> {
    let bit = |place: &usize| (*place < state.width()).then(|| state.get(*place));
    let bits: Option<Vec<bool>> = bits.iter().map(bit).collect();
    let bits = bits?;
    if kind == Kind::Boolean {
        return bits.first().copied().map(Variant::from);
    }
    let number = bits.iter().rev().fold(0, |number: u64, bit| number << 1 | u64::from(*bit));
    Some(number.into())
}

/// The type of a point's variable: times are nanoseconds.
fn kind_of(of: Elementary) -> Kind {
    match of {
        Elementary::Bool => Kind::Boolean,
        of if of.is_real() => Kind::Double,
        of if of.is_signed() => Kind::Int64,
        _ => Kind::UInt64,
    }
}

fn variant_of_stored(of: Elementary, value: u64) -> Variant {
    match (of, kind_of(of)) {
        (_, Kind::Boolean) => Variant::from(value != 0),
        (Elementary::Real, _) => f64::from(f32::from_bits(value as u32)).into(),
        (_, Kind::Double) => f64::from_bits(value).into(),
        (of, Kind::Int64) => (of.signed(value) as i64).into(),
        _ => value.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbered_bits_are_one_number() {
        let names = ["a", "t.et.0", "t.et.1", "t.et.2", "x.1", "b", "b.0"];
        let found: Vec<(String, Kind, Vec<usize>)> =
            words(&names).into_iter().map(|word| (word.name, word.kind, word.bits)).collect();
        let bit = |name: &str, place| (name.to_owned(), Kind::Boolean, vec![place]);
        let expected = [
            bit("a", 0),
            ("t.et".to_owned(), Kind::UInt64, vec![1, 2, 3]),
            bit("x.1", 4),
            bit("b", 5),
            bit("b.0", 6),
        ];
        assert_eq!(found, expected);
        let state = Image::from_words(7, &[0b1010]).expect("in bounds");
        let value = |kind, bits: &[usize]| word_of(kind, bits, &state);
        assert_eq!(value(Kind::UInt64, &[1, 2, 3]), Some(Variant::from(5_u64)));
        assert_eq!(value(Kind::Boolean, &[3]), Some(Variant::from(true)));
        assert_eq!(value(Kind::UInt64, &[6, 7]), None);
    }
}
