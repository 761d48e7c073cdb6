//! The plant's side: samples, selects or reconstructs, holds, and falls safe.
//!
//! [`RemoteIo`] is the only source of u(i) and the only place where y(i) is applied, and so the arbiter of program i:
//! no agreement among the others is needed to mask a failure, and no two masters can drive one actuator.

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
mod trust;
mod votes;

pub use diagnosis::Diagnosis;
pub use event::{
    AskReason, Event, ForceEnd, Lacking, LackingReason, Missing, OldInputs, PartnerLack,
};
pub use foresight::Foreseen;
pub use paired_inputs::PairedInput;
pub use remote_io::RemoteIo;
pub use settings::{PairSettings, SWITCHOVER, Settings, Wiring};
pub use understudy_cycle::{
    Channel, Fallback, Layout, OperatorInput, OperatorInputKind, PointPlace, Ramp, Release,
    Restart, SharedOutputs, SignalInput, SignalSource, StaleState, StopPoints, ValueFault,
    ValueMismatch, in_order,
};
