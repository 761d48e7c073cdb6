//! What was measured: estimates with their intervals, tests of fit, and simulation of what is too rare to wait for.

mod acceleration;
mod estimate;
mod fit;
mod law;
mod online;
mod rare;

pub use acceleration::{AccelerationBias, MAXIMUM_ACCELERATION, acceleration_bias};
pub use estimate::{Interval, Stopped, mean_time, proportion, times_to_failure};
pub use fit::{Fit, Null, fit};
pub use law::Law;
pub use online::{Observed, Outlook, outlook};
pub use rare::{RareEvent, rare_event};
