//! What every member of a cluster shares, whether it is a station, a remote I/O or a plant.
//!
//! All members agree on the same configuration ([`Agreement`]) and compute the same [`Schedule`] from it. Each member admits frames
//! by [`Reception`], knows its cycle and epoch by [`CycleClock`], which stations were received by [`Attendance`], and repeats its
//! cyclic frames by [`Copies`]. A member is a [`Machine`].

mod agreement;
mod attendance;
mod clock;
mod copies;
mod machine;
mod reception;
mod schedule;
mod waking;

pub use agreement::{Agreement, Mode};
pub use attendance::{Attendance, Change};
pub use clock::{Arrival, CycleClock};
pub use copies::Copies;
pub use machine::{Input, Machine, Output};
pub use reception::{Admission, Reception};
pub use schedule::{Schedule, ScheduleError};
pub use waking::Waking;
