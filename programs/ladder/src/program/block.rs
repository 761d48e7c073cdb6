//! The standard function blocks and what their inputs and outputs are called.

use std::time::Duration;

use super::{Name, Series};

/// A function block: the wire enters at its first input and leaves at its first output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Block {
    /// Unique among the signals and blocks of a program.
    pub name: Name,
    /// Which block, and its preset.
    pub kind: BlockKind,
    /// What feeds its other inputs; an input that is not fed is 0.
    pub pins: Vec<Feed>,
}

/// What feeds one input of a block, from the left rail.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Feed {
    /// One of [`BlockKind::side_inputs`].
    pub pin: Name,
    /// Its network.
    pub network: Series,
}

/// The standard function blocks of IEC 61131-3.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum BlockKind {
    /// On-delay timer with its preset.
    Ton(Duration),
    /// Off-delay timer with its preset.
    Tof(Duration),
    /// Pulse timer with its preset.
    Tp(Duration),
    /// Up counter with its preset.
    Ctu(u16),
    /// Down counter with its preset.
    Ctd(u16),
    /// Up and down counter with its preset.
    Ctud(u16),
    /// Latch; set wins.
    Sr,
    /// Latch; reset wins.
    Rs,
    /// Rising edge.
    RTrig,
    /// Falling edge.
    FTrig,
}

impl BlockKind {
    /// All of them, with presets of 0.
    pub const ALL: [Self; 10] = [
        Self::Ton(Duration::ZERO),
        Self::Tof(Duration::ZERO),
        Self::Tp(Duration::ZERO),
        Self::Ctu(0),
        Self::Ctd(0),
        Self::Ctud(0),
        Self::Sr,
        Self::Rs,
        Self::RTrig,
        Self::FTrig,
    ];

    /// The block of a name in the standard, whatever its case, with a preset of 0.
    pub fn of_word(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.word().eq_ignore_ascii_case(word))
    }

    /// The same timer with another preset; another block stays what it is.
    pub fn with_time(self, time: Duration) -> Self {
        match self {
            Self::Ton(_) => Self::Ton(time),
            Self::Tof(_) => Self::Tof(time),
            Self::Tp(_) => Self::Tp(time),
            other => other,
        }
    }

    /// The same counter with another preset; another block stays what it is.
    pub fn with_value(self, value: u16) -> Self {
        match self {
            Self::Ctu(_) => Self::Ctu(value),
            Self::Ctd(_) => Self::Ctd(value),
            Self::Ctud(_) => Self::Ctud(value),
            other => other,
        }
    }

    /// Its name in the standard.
    pub fn word(self) -> &'static str {
        match self {
            Self::Ton(_) => "TON",
            Self::Tof(_) => "TOF",
            Self::Tp(_) => "TP",
            Self::Ctu(_) => "CTU",
            Self::Ctd(_) => "CTD",
            Self::Ctud(_) => "CTUD",
            Self::Sr => "SR",
            Self::Rs => "RS",
            Self::RTrig => "R_TRIG",
            Self::FTrig => "F_TRIG",
        }
    }

    /// The input that the wire enters.
    pub fn wire_input(self) -> &'static str {
        match self {
            Self::Ton(_) | Self::Tof(_) | Self::Tp(_) => "IN",
            Self::Ctu(_) | Self::Ctud(_) => "CU",
            Self::Ctd(_) => "CD",
            Self::Sr => "S1",
            Self::Rs => "S",
            Self::RTrig | Self::FTrig => "CLK",
        }
    }

    /// The other inputs, each with whether it must be fed.
    pub fn side_inputs(self) -> &'static [(&'static str, bool)] {
        match self {
            Self::Ctu(_) => &[("R", false)],
            Self::Ctd(_) => &[("LD", true)],
            Self::Ctud(_) => &[("CD", true), ("R", false), ("LD", false)],
            Self::Sr => &[("R", true)],
            Self::Rs => &[("R1", true)],
            _ => &[],
        }
    }

    /// The outputs that a contact can read; the wire leaves at the first.
    pub fn outputs(self) -> &'static [&'static str] {
        match self {
            Self::Ctud(_) => &["QU", "QD"],
            Self::Sr | Self::Rs => &["Q1"],
            _ => &["Q"],
        }
    }

    /// All inputs in the order of the standard, the one that the wire enters first.
    pub fn inputs(self) -> impl Iterator<Item = &'static str> {
        let preset = match (self.preset_time(), self.preset_value()) {
            (Some(_), _) => Some("PT"),
            (_, Some(_)) => Some("PV"),
            (None, None) => None,
        };
        let side = self.side_inputs().iter().map(|(pin, _)| *pin);
        [self.wire_input()].into_iter().chain(side).chain(preset)
    }

    /// The output that shows a time or a count.
    pub fn value_output(self) -> Option<&'static str> {
        match (self.preset_time(), self.preset_value()) {
            (Some(_), _) => Some("ET"),
            (_, Some(_)) => Some("CV"),
            (None, None) => None,
        }
    }

    /// The preset time of a timer.
    pub fn preset_time(self) -> Option<Duration> {
        match self {
            Self::Ton(time) | Self::Tof(time) | Self::Tp(time) => Some(time),
            _ => None,
        }
    }

    /// The preset value of a counter.
    pub fn preset_value(self) -> Option<u16> {
        match self {
            Self::Ctu(value) | Self::Ctd(value) | Self::Ctud(value) => Some(value),
            _ => None,
        }
    }
}
