//! The power in a rung as an expression of Structured Text.

/// The power at a place of a rung, as an expression.
#[derive(Clone)]
pub(super) enum Power {
    /// The power of the left rail.
    On,
    /// One word: a variable, an output of a block, FALSE.
    Word(String),
    Not(String),
    /// A comparison of a counter.
    Compared(String),
    All(Vec<Power>),
    Any(Vec<Power>),
}

impl Power {
    pub(super) fn and(self, other: Self) -> Self {
        match (self, other) {
            (Self::On, other) => other,
            (power, Self::On) => power,
            (Self::All(mut parts), Self::All(others)) => {
                parts.extend(others);
                Self::All(parts)
            }
            (Self::All(mut parts), other) => {
                parts.push(other);
                Self::All(parts)
            }
            (power, other) => Self::All(vec![power, other]),
        }
    }

    pub(super) fn is_word(&self) -> bool {
        matches!(self, Self::On | Self::Word(_))
    }

    /// How tightly it binds; NOT and single words need no brackets.
    fn binding(&self) -> u8 {
        match self {
            Self::Any(_) => 0,
            Self::All(_) => 1,
            Self::Compared(_) => 2,
            Self::Not(_) | Self::On | Self::Word(_) => 3,
        }
    }

    /// Appends its words where only `least` or a tighter binding needs no brackets.
    pub(super) fn words(&self, least: u8, words: &mut Vec<String>) {
        if self.binding() < least {
            words.push("(".into());
            self.words(0, words);
            words.push(")".into());
            return;
        }
        let mut joined = |parts: &[Self], word: &str, least| {
            for (place, part) in parts.iter().enumerate() {
                if place > 0 {
                    words.push(word.into());
                }
                part.words(least, words);
            }
        };
        match self {
            Self::On => words.push("TRUE".into()),
            Self::Word(word) | Self::Compared(word) => words.push(word.clone()),
            Self::Not(word) => words.push(format!("NOT {word}")),
            Self::All(parts) => joined(parts, "AND", 3),
            Self::Any(parts) => joined(parts, "OR", 1),
        }
    }
}
