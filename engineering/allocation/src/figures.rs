//! What is known about a controller: numbers and texts, each with the source that says so.
//!
//! An unknown figure is absent, never 0. A 0 in the catalogue states that the controller has none.

use std::fmt;

use serde::Serialize;

/// A number about one model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Digital inputs on board.
    DigitalInputs,
    /// Digital outputs on board.
    DigitalOutputs,
    /// Analog inputs on board.
    AnalogIn,
    /// Analog outputs on board.
    AnalogOut,
    /// For programs.
    ProgramMemoryBytes,
    /// For data.
    DataMemoryBytes,
    /// Timers that a program may have.
    Timers,
    /// Counters that a program may have.
    Counters,
    /// Time of one instruction on bits.
    BoolInstructionNs,
    /// In hundredths of its currency.
    Price,
}

impl Quantity {
    /// All, in the order of the columns of a catalogue file.
    pub const ALL: [Self; 10] = [
        Self::DigitalInputs,
        Self::DigitalOutputs,
        Self::AnalogIn,
        Self::AnalogOut,
        Self::ProgramMemoryBytes,
        Self::DataMemoryBytes,
        Self::Timers,
        Self::Counters,
        Self::BoolInstructionNs,
        Self::Price,
    ];

    /// Its name in files and in the database.
    pub fn name(self) -> &'static str {
        match self {
            Self::DigitalInputs => "digital_inputs",
            Self::DigitalOutputs => "digital_outputs",
            Self::AnalogIn => "analog_in",
            Self::AnalogOut => "analog_out",
            Self::ProgramMemoryBytes => "program_memory_bytes",
            Self::DataMemoryBytes => "data_memory_bytes",
            Self::Timers => "timers",
            Self::Counters => "counters",
            Self::BoolInstructionNs => "bool_instruction_ns",
            Self::Price => "price",
        }
    }

    /// The largest number that is believed.
    pub fn most(self) -> u64 {
        match self {
            Self::DigitalInputs | Self::DigitalOutputs | Self::AnalogIn | Self::AnalogOut => {
                100_000
            }
            Self::ProgramMemoryBytes | Self::DataMemoryBytes => 1 << 40,
            Self::Timers | Self::Counters => 1_000_000,
            Self::BoolInstructionNs => 1_000_000_000,
            Self::Price => 10_000_000_000,
        }
    }

    /// A number as it is written in a file: whole, or for prices with up to two digits behind a dot.
    pub fn parse(self, text: &str) -> Option<u64> {
        let (whole, hundredths) = match (self, text.split_once('.')) {
            (Self::Price, Some((whole, digits))) if digits.len() == 1 => {
                (whole, 10 * digits_of(digits)?)
            }
            (Self::Price, Some((whole, digits))) if digits.len() == 2 => {
                (whole, digits_of(digits)?)
            }
            (_, Some(_)) => return None,
            (_, None) => (text, 0),
        };
        let scale = if self == Self::Price { 100 } else { 1 };
        let value = digits_of(whole)?
            .checked_mul(scale)?
            .checked_add(hundredths)?;
        (value <= self.most()).then_some(value)
    }

    /// As [`Quantity::parse`] reads it.
    pub fn text(self, value: u64) -> String {
        match self {
            Self::Price => format!("{}.{:02}", value / 100, value % 100),
            _ => value.to_string(),
        }
    }
}

fn digits_of(text: &str) -> Option<u64> {
    let digits = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    digits.then(|| text.parse().ok()).flatten()
}

impl fmt::Display for Quantity {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

/// A text about one model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Statement {
    /// Its ports.
    CommPorts,
    /// What it can be expanded by.
    MaxExpansionIo,
    /// In which it is programmed.
    Languages,
    /// Of the price.
    Currency,
}

impl Statement {
    /// All, in the order of the columns of a catalogue file.
    pub const ALL: [Self; 4] = [
        Self::CommPorts,
        Self::MaxExpansionIo,
        Self::Languages,
        Self::Currency,
    ];

    /// Its name in files and in the database.
    pub fn name(self) -> &'static str {
        match self {
            Self::CommPorts => "comm_ports",
            Self::MaxExpansionIo => "max_expansion_io",
            Self::Languages => "languages",
            Self::Currency => "currency",
        }
    }
}

impl fmt::Display for Statement {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

/// How a family stores a program: what is needed to say how much memory a program takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FamilyQuantity {
    /// Program bytes of one instruction, at most.
    ProgramBytesPerInstruction,
    /// Further program bytes of one timer.
    ProgramBytesPerTimer,
    /// Further program bytes of one counter.
    ProgramBytesPerCounter,
    /// Data bytes of one bit that remembers.
    DataBytesPerBit,
    /// Data bytes of one timer.
    DataBytesPerTimer,
    /// Data bytes of one counter.
    DataBytesPerCounter,
    /// Of a rule for program and data together: bytes before the first point.
    MemoryBytesBase,
    /// Of a rule for program and data together: bytes for each input and each output.
    MemoryBytesPerPoint,
    /// 1 where a program may have as many timers and counters as its memory holds.
    TimersByMemory,
    /// Time of one instruction on bits, for models that do not say theirs.
    BoolInstructionNs,
}

impl FamilyQuantity {
    /// All.
    pub const ALL: [Self; 10] = [
        Self::ProgramBytesPerInstruction,
        Self::ProgramBytesPerTimer,
        Self::ProgramBytesPerCounter,
        Self::DataBytesPerBit,
        Self::DataBytesPerTimer,
        Self::DataBytesPerCounter,
        Self::MemoryBytesBase,
        Self::MemoryBytesPerPoint,
        Self::TimersByMemory,
        Self::BoolInstructionNs,
    ];

    /// The largest number that is believed.
    pub const MOST: u64 = 1 << 30;

    /// Its name in files and in the database.
    pub fn name(self) -> &'static str {
        match self {
            Self::ProgramBytesPerInstruction => "program_bytes_per_instruction",
            Self::ProgramBytesPerTimer => "program_bytes_per_timer",
            Self::ProgramBytesPerCounter => "program_bytes_per_counter",
            Self::DataBytesPerBit => "data_bytes_per_bit",
            Self::DataBytesPerTimer => "data_bytes_per_timer",
            Self::DataBytesPerCounter => "data_bytes_per_counter",
            Self::MemoryBytesBase => "memory_bytes_base",
            Self::MemoryBytesPerPoint => "memory_bytes_per_point",
            Self::TimersByMemory => "timers_by_memory",
            Self::BoolInstructionNs => "bool_instruction_ns",
        }
    }

    /// A whole number within its bound.
    pub fn parse(text: &str) -> Option<u64> {
        digits_of(text).filter(|value| *value <= Self::MOST)
    }
}

impl fmt::Display for FamilyQuantity {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

/// A value with the source that says so.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Figure<T> {
    /// What is said.
    pub value: T,
    /// Who says it: an address, a document, a quotation. Never empty.
    pub source: String,
}
