//! One member of a cluster, put together from its file: machine, link, keys, field and journal.
//!
//! ```text
//!   cluster file ──► machine (station, remote I/O, plant) ─┐
//!   list of addresses ──► endpoints ───────────────────────┤
//!   folder of keys ──► guard, operators' channel ──────────┼─► understudy_bus::run_member ──► journal
//!   device ──► field driver ───────────────────────────────┘
//! ```

mod changes;
mod error;
mod field;
mod first_numbers;
mod former;
mod held;
mod peers;
mod retained;
mod run;

pub use error::MemberError;
pub use held::tls_keys;
pub use peers::{addressed_peers, find_member, listed_peers};
pub use retained::{last_state, station_files};
pub use run::{MemberOptions, link_kind, restart_for_zenoh, run_plant, run_remote_io, run_station};
