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

/// What a block takes of a controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cost {
    /// Timers.
    pub timers: u64,
    /// Counters.
    pub counters: u64,
    /// Bits that remember.
    pub bits: u64,
}

/// A row of the table of standard blocks: what is the same for each preset. What a block does is in the library of Structured Text.
#[derive(Debug, Clone, Copy)]
struct Standard {
    word: &'static str,
    wire: &'static str,
    side: &'static [(&'static str, bool)],
    outputs: &'static [&'static str],
    /// The input of the preset, and the output that runs up to it.
    preset: Option<(&'static str, &'static str)>,
    /// The power at the wire with which a timer runs; none where an edge starts it.
    runs_while: Option<bool>,
    needs_power: bool,
    cost: Cost,
}

impl Standard {
    /// A block with one bit and the usual output.
    const fn of(wire: &'static str) -> Self {
        Self {
            word: "",
            wire,
            side: &[],
            outputs: &["Q"],
            preset: None,
            runs_while: None,
            needs_power: false,
            cost: Cost { timers: 0, counters: 0, bits: 1 },
        }
    }
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

    /// Its row in the table of standard blocks.
    const fn standard(self) -> Standard {
        let timer = Standard {
            preset: Some(("PT", "ET")),
            cost: Cost { timers: 1, counters: 0, bits: 0 },
            ..Standard::of("IN")
        };
        let counter = Standard {
            preset: Some(("PV", "CV")),
            cost: Cost { timers: 0, counters: 1, bits: 0 },
            ..Standard::of("CU")
        };
        let latch = Standard { outputs: &["Q1"], ..Standard::of("S1") };
        let edge = Standard::of("CLK");
        match self {
            Self::Ton(_) => {
                Standard { word: "TON", runs_while: Some(true), needs_power: true, ..timer }
            }
            Self::Tof(_) => Standard { word: "TOF", runs_while: Some(false), ..timer },
            Self::Tp(_) => Standard { word: "TP", ..timer },
            Self::Ctu(_) => Standard { word: "CTU", side: &[("R", false)], ..counter },
            Self::Ctd(_) => Standard { word: "CTD", wire: "CD", side: &[("LD", true)], ..counter },
            Self::Ctud(_) => Standard {
                word: "CTUD",
                side: &[("CD", true), ("R", false), ("LD", false)],
                outputs: &["QU", "QD"],
                ..counter
            },
            Self::Sr => Standard { word: "SR", side: &[("R", true)], ..latch },
            Self::Rs => Standard { word: "RS", wire: "S", side: &[("R1", true)], ..latch },
            Self::RTrig => Standard { word: "R_TRIG", needs_power: true, ..edge },
            Self::FTrig => Standard { word: "F_TRIG", ..edge },
        }
    }

    /// Its name in the standard.
    pub fn word(self) -> &'static str {
        self.standard().word
    }

    /// The input that the wire enters.
    pub fn wire_input(self) -> &'static str {
        self.standard().wire
    }

    /// The other inputs, each with whether it must be fed.
    pub fn side_inputs(self) -> &'static [(&'static str, bool)] {
        self.standard().side
    }

    /// The outputs that a contact can read; the wire leaves at the first.
    pub fn outputs(self) -> &'static [&'static str] {
        self.standard().outputs
    }

    /// All inputs in the order of the standard, the one that the wire enters first.
    pub fn inputs(self) -> impl Iterator<Item = &'static str> {
        let Standard { wire, side, preset, .. } = self.standard();
        let side = side.iter().map(|(pin, _)| *pin);
        [wire].into_iter().chain(side).chain(preset.map(|(pin, _)| pin))
    }

    /// The output that shows a time or a count.
    pub fn value_output(self) -> Option<&'static str> {
        self.standard().preset.map(|(_, shown)| shown)
    }

    /// Whether its output is on only while there is power at its wire.
    pub fn needs_power(self) -> bool {
        self.standard().needs_power
    }

    /// What it takes of a controller.
    pub fn cost(self) -> Cost {
        self.standard().cost
    }

    /// The power at its wire with which a timer runs; none of a pulse timer, which an edge starts, and of all other blocks.
    pub fn runs_while(self) -> Option<bool> {
        self.standard().runs_while
    }

    /// ET of a timer with this output in a scan of its circuit, which does not tell an off-delay that is over from one that has not run.
    pub(crate) fn shown_time(self, elapsed: Duration, output: bool) -> Duration {
        let is_over = self.runs_while() == Some(false) && !output;
        if is_over { self.preset_time().unwrap_or(elapsed) } else { elapsed }
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
