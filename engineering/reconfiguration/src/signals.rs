//! Inputs, outputs and events of a ladder, and vectors of bits over them.

use std::fmt;

/// Values of signals, in the order of their declaration.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Bits(pub Vec<bool>);

impl fmt::Display for Bits {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let digits = self.0.iter().map(|&bit| if bit { '1' } else { '0' });
        formatter.write_str(&digits.collect::<String>())
    }
}

impl Bits {
    /// The vector that `text` spells in 0 and 1.
    pub fn parse(text: &str) -> Option<Self> {
        let bit = |character| match character {
            '0' => Some(false),
            '1' => Some(true),
            _ => None,
        };
        text.chars().map(bit).collect::<Option<Vec<bool>>>().map(Self)
    }
}

/// The names of I and O.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Signals {
    /// I, in the order of their declaration.
    pub inputs: Vec<String>,
    /// O, in the order of their declaration.
    pub outputs: Vec<String>,
}

/// A change of an input, or the virtual event ω: what the ladder does by itself, while no input changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Event {
    /// i⁺, from 0 to 1; the place of the input.
    Rises(usize),
    /// i⁻, from 1 to 0; the place of the input.
    Falls(usize),
    /// ω.
    Omega,
}

impl Event {
    /// The input that changes: the channel that reports it.
    pub fn channel(self) -> Option<usize> {
        match self {
            Self::Rises(input) | Self::Falls(input) => Some(input),
            Self::Omega => None,
        }
    }

    /// The change of `input` to `value`.
    pub fn change(input: usize, value: bool) -> Self {
        if value { Self::Rises(input) } else { Self::Falls(input) }
    }
}

impl Signals {
    /// `ps1+`, `ps1-`, `omega`.
    pub fn event_name(&self, event: Event) -> String {
        match event {
            Event::Rises(input) => format!("{}+", self.inputs[input]),
            Event::Falls(input) => format!("{}-", self.inputs[input]),
            Event::Omega => "omega".into(),
        }
    }

    /// Names with commas between.
    pub fn event_names(&self, events: &[Event]) -> String {
        let names: Vec<String> = events.iter().map(|&event| self.event_name(event)).collect();
        names.join(", ")
    }

    /// The event that is called `name`.
    pub fn event(&self, name: &str) -> Option<Event> {
        let (input, value) = match name.strip_suffix('+') {
            Some(input) => (input, true),
            None => (name.strip_suffix('-')?, false),
        };
        let input = self.inputs.iter().position(|known| known == input)?;
        Some(Event::change(input, value))
    }

    /// Σ without ω: every change of every input, in the order of the tables of the paper.
    pub fn events(&self) -> impl Iterator<Item = Event> + use<> {
        (0..self.inputs.len()).flat_map(|input| [Event::Rises(input), Event::Falls(input)])
    }

    /// The changes from one vector of inputs to another; none is ω.
    pub fn changes(before: &Bits, after: &Bits) -> Vec<Event> {
        let pairs = before.0.iter().zip(&after.0).enumerate();
        pairs
            .filter(|(_, (old, new))| old != new)
            .map(|(input, (_, &new))| Event::change(input, new))
            .collect()
    }
}
