//! The signals of a program: its inputs, its outputs, and the markers that its state is made of.

use opcua::types::Variant;
use understudy_cluster::Controller;

use super::{Kind, Tree};
use crate::trust;

/// Bits that a number of OPC UA holds.
const WORD_BITS: usize = 64;

impl Tree {
    pub(super) fn signals(&mut self, place: usize, controller: &Controller) {
        let circuit = &controller.circuit;
        self.enter(&["Programs", &controller.name, "Inputs"]);
        let inputs = circuit.inputs();
        for (bit, name) in inputs.iter().enumerate() {
            let channel = format!("{name}.failed");
            let status_bit = inputs.iter().position(|input| *input == channel);
            let own_name = name.clone();
            self.add(name, Kind::Boolean, "as last sampled", move |seen| {
                let program = seen.program(place);
                let image = program.and_then(|program| program.inputs.as_deref());
                let value = bit_of(image, bit);
                let has_failed = status_bit.and_then(|place| bit_of(image, place)) == Some(true);
                let own = program.map(|program| trust::input(program, &own_name, has_failed));
                seen.present(value.map(Variant::from), own.unwrap_or_default())
            });
        }
        self.enter(&["Programs", &controller.name, "Outputs"]);
        for (bit, output) in circuit.outputs().iter().enumerate() {
            let name = output.name.clone();
            self.add(&output.name, Kind::Boolean, "as driven", move |seen| {
                let program = seen.program(place);
                let image = program.and_then(|program| program.outputs.as_deref());
                let own = program.map(|program| trust::output(program, &name));
                let value = bit_of(image, bit).map(Variant::from);
                seen.present(value, own.unwrap_or_default())
            });
        }
        self.enter(&["Programs", &controller.name, "Markers"]);
        let names: Vec<&str> = circuit
            .registers()
            .iter()
            .map(|register| register.name.as_str())
            .collect();
        for word in words(&names) {
            let (kind, bits) = (word.kind, word.bits);
            self.add(
                &word.name,
                kind,
                "value in the state before the last sample",
                move |seen| {
                    let states = &seen.observation.states;
                    let state = states.get(place).and_then(Option::as_deref);
                    let value = state.and_then(|state| word_of(kind, &bits, state));
                    let own = seen.program(place).map(trust::state);
                    seen.present(value, own.unwrap_or_default())
                },
            );
        }
    }
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
        let numbered = name
            .rsplit_once('.')
            .and_then(|(word, bit)| Some((word, bit.parse::<usize>().ok()?)));
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
            (None, Some((word, 0))) if !names.contains(&word) => words.push(Word {
                name: word.to_owned(),
                kind: Kind::UInt64,
                bits: vec![place],
            }),
            _ => words.push(Word {
                name: (*name).to_owned(),
                kind: Kind::Boolean,
                bits: vec![place],
            }),
        }
    }
    words
}

fn word_of(kind: Kind, bits: &[usize], state: &[bool]) -> Option<Variant> {
    let bits: Option<Vec<bool>> = bits
        .iter()
        .map(|place| state.get(*place).copied())
        .collect();
    let bits = bits?;
    if kind == Kind::Boolean {
        return bits.first().copied().map(Variant::from);
    }
    let number = bits
        .iter()
        .rev()
        .fold(0, |number: u64, bit| number << 1 | u64::from(*bit));
    Some(number.into())
}

/// A bit of a text such as `0110`.
fn bit_of(image: Option<&str>, place: usize) -> Option<bool> {
    image?.as_bytes().get(place).map(|bit| *bit == b'1')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbered_bits_are_one_number() {
        let names = ["a", "t.et.0", "t.et.1", "t.et.2", "x.1", "b", "b.0"];
        let found: Vec<(String, Kind, Vec<usize>)> = words(&names)
            .into_iter()
            .map(|word| (word.name, word.kind, word.bits))
            .collect();
        let bit = |name: &str, place| (name.to_owned(), Kind::Boolean, vec![place]);
        let expected = [
            bit("a", 0),
            ("t.et".to_owned(), Kind::UInt64, vec![1, 2, 3]),
            bit("x.1", 4),
            bit("b", 5),
            bit("b.0", 6),
        ];
        assert_eq!(found, expected);
        let state = [false, true, false, true, false, false, false];
        let value = |kind, bits: &[usize]| word_of(kind, bits, &state);
        assert_eq!(value(Kind::UInt64, &[1, 2, 3]), Some(Variant::from(5_u64)));
        assert_eq!(value(Kind::Boolean, &[3]), Some(Variant::from(true)));
        assert_eq!(value(Kind::UInt64, &[6, 7]), None);
    }
}
