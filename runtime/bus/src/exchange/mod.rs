//! How long a cycle's frames take: from the first frame of a cycle to the last turn heard, at the cycle master.
//!
//! Three carriers are measured with one pattern of eight broadcasts among seven processes: plain sockets without anything of ours
//! ([`Carrier::Raw`], the yardstick), and the two links with a machine that does nothing but follow the pattern. A real station
//! is measured in the same way by [`run_exchange_machine`], or anywhere else by an [`ExchangeMeter`].
//!
//! ```text
//! station 1   Sync ───────────────── Turn ─┐                                       ┌─ heard: the exchange ends
//! remote I/Os      └ Sample Sample Sample ┘└ station 2: Turn └ station 3: Turn └ station 4: Turn
//! ```

mod benchmark;
mod meter;
mod pattern;
mod raw;

pub use benchmark::{
    Carrier, ExchangeMember, ExchangeSettings, measure, run_exchange_machine, run_exchange_member,
};
pub use meter::{Exchange, ExchangeMeter};
pub use pattern::{PROGRAMS, Pattern, STATIONS};
