//! Members on real clocks, threads and networks.
//!
//! A member (a station, a remote I/O, a plant) is a pure [`understudy_cycle::Machine`]. This crate gives it a thread, a clock,
//! a link to its peers ([`LinkKind`]: Zenoh or plain UDP) and a journal, and runs it ([`Host`], or [`run_member`] for a process
//! of its own). Nothing here decides anything about the cycle.

mod anchor;
mod announcer;
mod changes;
mod channel;
mod clock;
mod connections;
mod control;
mod cores;
mod distribution;
pub mod doctor;
mod documents;
mod doorbell;
mod endpoints;
mod error;
mod field;
mod guard;
mod host;
mod host_event;
mod interruption;
mod journal;
mod linger;
mod link;
mod log;
mod member;
mod multicast;
mod network_reception;
mod operator;
mod orders;
mod paths;
mod ports;
mod refused_as;
mod refused_certificates;
mod refused_orders;
mod retained;
mod rights;
mod tally;
mod timing;
mod trouble;
mod udp;
mod unreceived;
mod wakefulness;
mod watchdog;
mod writes;
mod zenoh_link;

pub use announcer::{Announcer, Question};
pub use changes::{ChangeKeeper, Changes};
pub use channel::{
    Admitted, ChannelSettings, DONE, LinesInEffect, Reporter, SPARE_REPORTS_EVERY, SpareReport,
    TlsKeys, Validity,
};
pub use clock::Clock;
pub use connections::{
    Connection, Connections, Listener, RESERVED_DESCRIPTORS, RefusedConnections, RelayedCallers,
    Slot, inner_address, relay, relay_known,
};
pub use control::{Commands, Interruption, hold_back_signals};
pub use distribution::{Distribution, Quantiles};
pub use documents::Documents;
pub use endpoints::{Endpoints, Peer};
pub use error::BusError;
pub use field::{FieldDriver, Look, NoField, SimulatedField};
pub use guard::{Guard, Keys, NewLife};
pub use host::{Host, Summary};
pub use host_event::HostEvent;
pub use interruption::interruption;
pub use journal::{
    EventSink, JOURNAL_RECORDS, JOURNAL_VERSION, Journal, JournalSender, Noted, Record,
};
pub use link::{Link, LinkCounters, LinkKind, NoSuchLink, Reopening};
pub use log::{Line, Log, LogFilter, LogFormat, LogSettings, log_environment};
pub use member::{MemberSettings, end_with_parent, run_member};
pub use multicast::loopback_groups;
pub use network_reception::NetworkReception;
pub use operator::{Call, Request, Told};
pub use orders::{Control, Cuts, Order, Orders, orders};
pub use ports::free_addresses;
pub use refused_as::RefusedAs;
pub use refused_orders::{RefusedOrder, RefusedOrders};
pub use retained::{
    CarriedOver, FoundFile, FoundNotes, LoadedPrograms, Owner, RetainedFiles, Retention,
};
pub use rights::{Rights, keep_times};
pub use wakefulness::Wakefulness;
pub use watchdog::Watchdog;
pub use writes::{WRITES_PER_SECOND, WriteLimiter};
pub use zenoh_link::{zenoh_runtime, zenoh_runtime_of_follower};
