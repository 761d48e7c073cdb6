//! Equipment behind a remote I/O: how it is reached, and which signal is at which of its addresses.

use std::fmt;
use std::net::SocketAddr;
use std::time::Duration;

use understudy_typed::Declared;
use understudy_wire::Image;

use crate::place::Place;

/// Device with Modbus TCP or Modbus RTU.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldDevice {
    /// How it is reached.
    pub connection: Connection,
    /// Unit behind that address, or device on the serial line.
    pub unit: u8,
    /// Maximum duration of one exchange.
    pub timeout: Duration,
    /// Age at which its last answer is too old.
    pub stale_after: Duration,
    /// Inputs of the program with a place; all others keep their initial values.
    pub inputs: Side,
    /// Outputs of the program with a place; all others reach no actuator.
    pub outputs: Side,
}

/// How a device is reached.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Connection {
    /// Modbus TCP.
    Tcp(SocketAddr),
    /// Modbus RTU.
    Rtu(SerialLine),
}

/// Serial line of Modbus RTU, with 8 data bits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SerialLine {
    /// The terminal device, such as `/dev/ttyUSB0`.
    pub path: String,
    /// Bits per second, one of [`BAUD_RATES`].
    pub baud: u32,
    /// Parity bit.
    pub parity: Parity,
    /// 1 or 2.
    pub stop_bits: u8,
}

/// Rates of a serial line.
pub const BAUD_RATES: [u32; 11] =
    [1200, 2400, 4800, 9600, 19_200, 38_400, 57_600, 115_200, 230_400, 460_800, 921_600];

/// Parity bit of a serial line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parity {
    /// Even number of ones.
    Even,
    /// Odd number of ones.
    Odd,
    /// No parity bit.
    None,
}

impl fmt::Display for Connection {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tcp(address) => address.fmt(formatter),
            Self::Rtu(line) => line.path.fmt(formatter),
        }
    }
}

/// The inputs or the outputs of a program, as far as they have a place in the device.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Side {
    /// The process image with the initial values of all signals without a place.
    pub rest: Image,
    /// In order of declaration.
    pub bindings: Vec<Binding>,
}

/// A signal of the program and its place in the device.
#[derive(Debug, Clone, PartialEq)]
pub struct Binding {
    /// Name of the signal.
    pub name: String,
    /// Type and range of the signal.
    pub declared: Declared,
    /// First bit of the signal in the process image.
    pub bit: usize,
    /// Its place.
    pub place: Place,
}
