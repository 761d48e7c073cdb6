//! What every member of a cluster shares, whether it is a station, a remote I/O or a plant.
//!
//! All members agree on the same configuration ([`Agreement`]) and compute the same [`Schedule`] from it. A member is a
//! [`Machine`]. Each is built on an [`Endpoint`], which admits frames and sends frames; those that take part in the
//! cycle are built on a [`Participant`], which also knows its cycle and epoch ([`CycleClock`]) and the stations that it
//! receives ([`Attendance`]), and repeats its cyclic frames ([`Copies`]).

mod agreement;
mod attendance;
mod change;
mod channel;
mod clock;
mod copies;
mod fallback;
mod layout;
mod machine;
mod participant;
mod passage;
mod place;
mod ramp;
mod reception;
mod schedule;
mod shared;
mod source;
pub mod spare;
mod waking;

pub use agreement::{Agreement, Mode};
pub use attendance::{Attendance, Change};
pub use change::{
    ChangeOrder, Changing, Conversion, FallbackChange, OnlineChange, Program, ProgramChange,
    Versions,
};
pub use channel::Channel;
pub use clock::{Arrival, CycleClock};
pub use copies::Copies;
pub use fallback::{Fallback, Release, Restart, StaleState, ValueFault};
pub use layout::{Layout, StopPoints};
pub use machine::{Input, Machine, Output, Outvoted, RemoteIoInput};
pub use participant::{Endpoint, Notice, Participant, Refusal};
pub use passage::{Moved, Passage, PointsChange};
pub use place::{PointPlace, in_order};
pub use ramp::{Descent, Ramp};
pub use schedule::{Schedule, ScheduleError, Turns};
pub use shared::SharedOutputs;
pub use source::{OperatorInput, OperatorInputKind, SignalInput, SignalSource, ValueMismatch};
