//! What is known about a controller: numbers and texts, each with the source that says so.
//!
//! An unknown figure is absent, never 0. A 0 in the catalogue states that the controller has none.

use serde::Serialize;
use understudy_text::words;

words! {
    /// A number about one model.
    pub enum Quantity by name {
        /// Digital inputs on board.
        DigitalInputs = "digital_inputs",
        /// Digital outputs on board.
        DigitalOutputs = "digital_outputs",
        /// Analog inputs on board.
        AnalogIn = "analog_in",
        /// Analog outputs on board.
        AnalogOut = "analog_out",
        /// Memory for programs in bytes.
        ProgramMemoryBytes = "program_memory_bytes",
        /// Memory for data in bytes.
        DataMemoryBytes = "data_memory_bytes",
        /// Timers that a program may have.
        Timers = "timers",
        /// Counters that a program may have.
        Counters = "counters",
        /// Time of one instruction on bits.
        BoolInstructionNs = "bool_instruction_ns",
        /// Price in hundredths of its currency.
        Price = "price",
        /// Clock of the processor.
        ClockKhz = "clock_khz",
        /// Width of the address bus.
        AddressBusBits = "address_bus_bits",
        /// Width of the data bus.
        DataBusBits = "data_bus_bits",
        /// Mean time between failures that the maker states.
        MtbfHours = "mtbf_hours",
        /// Expansion modules that it takes.
        ExpansionModules = "expansion_modules",
    }
}

impl Quantity {
    /// What an expansion module can add to.
    pub const EXTENDABLE: [Self; 6] = [
        Self::DigitalInputs,
        Self::DigitalOutputs,
        Self::AnalogIn,
        Self::AnalogOut,
        Self::ProgramMemoryBytes,
        Self::DataMemoryBytes,
    ];

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
            Self::ClockKhz => 100_000_000,
            Self::AddressBusBits | Self::DataBusBits => 1024,
            Self::MtbfHours => 1_000_000_000,
            Self::ExpansionModules => 256,
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
        let value = digits_of(whole)?.checked_mul(scale)?.checked_add(hundredths)?;
        (value <= self.most()).then_some(value)
    }

    /// The text of a number, as [`Quantity::parse`] reads it.
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

words! {
    /// A text about one model.
    pub enum Statement by name {
        /// Communication ports.
        CommPorts = "comm_ports",
        /// Possible expansion.
        MaxExpansionIo = "max_expansion_io",
        /// Programming languages.
        Languages = "languages",
        /// Currency of the price.
        Currency = "currency",
        /// How long the maker supplies and repairs it.
        Support = "support",
        /// Software that programs it.
        SupportSoftware = "support_software",
        /// Parts that a system of it needs.
        Accessories = "accessories",
    }
}

words! {
    /// How a family stores a program: what is needed to say how much memory a program takes.
    pub enum FamilyQuantity by name {
        /// Program bytes of one instruction, at most.
        ProgramBytesPerInstruction = "program_bytes_per_instruction",
        /// Further program bytes of one timer.
        ProgramBytesPerTimer = "program_bytes_per_timer",
        /// Further program bytes of one counter.
        ProgramBytesPerCounter = "program_bytes_per_counter",
        /// Data bytes of one bit that remembers.
        DataBytesPerBit = "data_bytes_per_bit",
        /// Data bytes of one timer.
        DataBytesPerTimer = "data_bytes_per_timer",
        /// Data bytes of one counter.
        DataBytesPerCounter = "data_bytes_per_counter",
        /// Common rule for program and data: bytes before the first point.
        MemoryBytesBase = "memory_bytes_base",
        /// Common rule for program and data: bytes for each input and each output.
        MemoryBytesPerPoint = "memory_bytes_per_point",
        /// 1 where a program may have as many timers and counters as its memory holds.
        TimersByMemory = "timers_by_memory",
        /// Time of one instruction on bits, for models that do not say theirs.
        BoolInstructionNs = "bool_instruction_ns",
    }
}

impl FamilyQuantity {
    /// The largest number that is believed.
    pub const MOST: u64 = 1 << 30;

    /// A whole number within its bound.
    pub fn parse(text: &str) -> Option<u64> {
        digits_of(text).filter(|value| *value <= Self::MOST)
    }
}

/// A value with the source that says so.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Figure<T> {
    /// The value.
    pub value: T,
    /// The source: an address, a document, a quotation. Never empty.
    pub source: String,
}
