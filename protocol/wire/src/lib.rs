//! Data that the members of a cluster exchange: identifiers, images, lineages and frames.
//!
//! All definitions that two members must share are in this crate only: members ([`Member`]), equality of states
//! ([`Lineage`]), and the bytes of a [`Frame`] ([`encode`], [`decode`]).

mod audience;
mod change;
mod codec;
mod force;
mod frame;
mod identifier;
mod image;
mod lineage;
mod retained;
mod segment;
mod set;
mod state_choice;
mod time;
mod via;
mod write;

pub use audience::{Audience, Roster, Topic, ZENOH_PORT_OFFSET};
pub use change::{ChangeName, ChangeRequest};
pub use codec::{FrameError, MAXIMUM_FRAME_BYTES, decode, encode};
pub use force::{
    Force, ForceError, MAXIMUM_FORCE_SECONDS, MAXIMUM_OWNER_LENGTH, MAXIMUM_REASON_LENGTH,
    OrderRefusal, PointValue, SignalPlace, Unforce, check_owner_and_reason,
};
pub use frame::{
    Actuation, Body, Configurations, Field, Frame, Header, Holding, Join, Kept,
    MAXIMUM_CHANGE_MARKS, MAXIMUM_HISTORY, Modules, Pair, Part, Partial, Recalled, Relayed, Sample,
    SamplesReceived, Share, Source, Step, Transfer, Turn, Word,
};
pub use identifier::{
    AuthorityHash, ClusterHash, ConfigurationHash, Cycle, Epoch, MAXIMUM_PROGRAMS,
    MAXIMUM_STATIONS, Member, Moment, PointsHash, ProgramHash, ProgramId, StationId,
};
pub use image::{Image, ImageError, MAXIMUM_IMAGE_BITS, MAXIMUM_STATE_BITS};
pub use lineage::{Digest, Lineage};
pub use retained::{
    Carried, MAXIMUM_KEPT_TEXT_BYTES, Note, Retained, RetainedError, RetainedProgram, RetainedRun,
    RetainedState, RetainedStep,
};
pub use segment::{MAXIMUM_SEGMENTS, Segment, SegmentMask};
pub use set::{Element, ProgramSet, Set, StationSet};
pub use state_choice::StateChoice;
pub use time::Time;
pub use via::{NoSuchNetwork, Via};
pub use write::{
    MAXIMUM_PULSES, MAXIMUM_SESSIONS, Pulse, Role, Write, WriteAnswer, WriteId, WriteOutcome,
    WriteRefusal,
};
