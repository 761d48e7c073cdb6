//! The plant's side: samples, selects or reconstructs, holds, and falls safe.
//!
//! [`RemoteIo`] is the only source of u(i) and the only place where y(i) is applied, and so the arbiter of program i:
//! no agreement among the others is needed to mask a failure, and no two masters can drive one actuator.

mod channel;
mod diagnosis;
mod event;
mod foresight;
mod history;
mod holders;
mod paired_inputs;
mod remote_io;
mod selection;
mod settings;
mod sharing;
mod source;
mod trust;
mod votes;

pub use channel::Channel;
pub use diagnosis::Diagnosis;
pub use event::{AskReason, Event, Lacking, LackingReason, Missing, OldInputs};
pub use foresight::Foreseen;
pub use paired_inputs::PairedInput;
pub use remote_io::RemoteIo;
pub use settings::{PairSettings, SWITCHOVER, Settings, StopPoints, Wiring};
pub use source::{OperatorInput, OperatorInputKind, SignalInput, SignalSource, ValueMismatch};
pub use understudy_cycle::{
    Fallback, PointPlace, Ramp, Release, Restart, SharedOutputs, StaleState, ValueFault, in_order,
};
