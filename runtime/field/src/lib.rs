//! Real sensors and actuators behind a remote I/O: a device with Modbus TCP or Modbus RTU. The only crate that names tokio-modbus.
//!
//! The cycle never waits for the device: a thread of its own exchanges with it, takes the newest outputs, and leaves the newest
//! answer, which the cycle looks at ([`Device::look`]). Invariant: an answer that is looked at as good is whole, no older than
//! configured, and nothing has gone wrong with the device since.

#![allow(clippy::disallowed_methods, reason = "the age of an answer is counted on the real clock")]

mod contest;
mod device;
mod exchange;
mod number;
mod plan;
mod serial;
mod stream;

pub use device::{Device, Look};
