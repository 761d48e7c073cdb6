//! A supervisor as a ladder: the event partition, the function Ω, and rungs that cannot run away.
//!
//! After the thesis of Moniruzzaman, chapter 3 (its G_c = (X, Y, Ω, Z)), with the avalanche effect treated as by Uzam and
//! Gelen, section 2.4. An [`InputOutputMap`] says by which signals events are seen and made; [`omega`] lists the rows of Ω
//! as Tables 3.1 and 3.2 do; [`convert`] makes the program. Invariants of one scan of it:
//!
//! - every state has one bit, and of each automaton exactly one is on once it has started;
//! - an event that is seen moves an automaton once: its bit is reset by the rung that uses it (AEEM, step 2), and each
//!   automaton has a bit of its own where several share the event;
//! - events come before commands, and there is at most one command, so that the plant sees each and can answer it;
//! - of two events in one scan neither is lost where the model has an order for them: the groups of rungs stand in that
//!   order, and where no order serves all states, a group stands again below the one that it waits for. There are automata
//!   that no order of groups serves; for these a scan can have at most one event ([`OneEvent`]).
//!
//! Self-loops of events have no rung (assumption 3 of the thesis): they change neither the state nor what is enabled.

mod addresses;
mod avalanche;
mod convert;
mod map;
mod names;
mod omega;
mod order;
mod partition;
mod positions;
mod read;
pub(crate) mod rung;

pub use addresses::{Located, locate};
pub use avalanche::{Repetition, avalanche_events, repetitions};
pub use convert::{Conversion, Correspondence, convert};
pub use map::{
    Agent, EventName, InputEvent, InputOutputMap, Mode, OneEvent, Position, Pulse, Request, Switch,
    Timer, When,
};
pub use omega::{Row, Trigger, omega, table};
pub use partition::{Meaning, Modules, Partition};
pub use read::{ReadMap, read_map};

pub(crate) use addresses::{check_signals, read_addresses};
pub(crate) use names::{ILLEGAL_NAME, Names, is_legal};
pub(crate) use positions::Positions;
