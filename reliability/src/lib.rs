//! How long it works: Markov models of redundant controllers, estimates from what was measured, and their report.
//!
//! Calculated: a [`System`] describes the stations of a plant and gives a [`Chain`]; with [`Rule::Paper`] it is the paper's model,
//! (14) to (20). A chain gives mean times by elimination and transients by uniformisation. Invariant: probabilities and times are
//! sums of terms that are not negative, so no result loses its digits, whatever the rates are.
//!
//! What everything depends on is in series with the stations: remote I/Os with or without twins, field devices, networks, power (`parts.rs`). [`compare_cells`]
//! compares whole cells.
//!
//! Measured: estimates with exact intervals, a test of fit against the law that the model implies, and simulation of what is too rare to
//! wait for. Randomness is an argument.
//!
//! One function answers each question of the command line: [`calculate`], [`answer_chain`], [`assess`], [`outlook`], [`report_data`] with [`report`].

mod answer;
mod boxes;
mod campaign;
mod cell;
mod chain;
mod chain_answer;
mod copies;
mod dense;
mod drawing;
mod elimination;
mod error;
mod export;
mod extended;
mod figures;
mod format;
mod graph;
mod measured;
mod options;
mod parts;
mod poisson_weights;
mod positions;
mod quantity;
mod report;
mod sensitivity;
mod shared_spares;
mod system;
mod transient;

pub use answer::{Answer, Mission, calculate};
pub use boxes::{UNDERSTUDIES, UnequalBoxes};
pub use campaign::{Assessment, Campaign, SystemFailure, assess};
pub use cell::{CellRow, SinglePoint, cells_text, compare_cells, left_out, single_points};
pub use chain::{Chain, ChainBuilder, MAXIMUM_STATES};
pub use chain_answer::{ByState, ChainAnswer, ChainMission, StateAnswer, answer_chain};
pub use copies::Survival;
pub use elimination::TimeToFailure;
pub use error::ReliabilityError;
pub use export::{ExportForm, export_chain, export_properties};
pub use figures::{FigurePoint, PerUnit, figures_5_and_6};
pub use format::{MAXIMUM_TEXT_BYTES, ReadChain, read_chain};
pub use measured::{
    AccelerationBias, Fit, Interval, Law, MAXIMUM_ACCELERATION, Null, Observed, Outlook, RareEvent,
    Stopped, acceleration_bias, fit, mean_time, outlook, proportion, rare_event, times_to_failure,
};
pub use options::Options;
pub use parts::{
    FieldDevices, InCharge, LaneModules, Networks, Pair, REMOTE_IO_PAIR, RemoteIos, SharedPart,
};
pub use quantity::{
    Hours, MAXIMUM_HOURS, MINIMUM_HOURS, MINIMUM_PROBABILITY, Probability, grouped,
};
pub use report::{OverTime, Provenance, Report, ReportData, report, report_data};
pub use sensitivity::{
    ByUnderstudies, Sensitivity, WhatIf, by_understudies, sensitivities, what_if,
};
pub use shared_spares::{MAXIMUM_SHARED_GROUPS, MAXIMUM_SHARED_SPARES, SharedSpares};
pub use system::{
    BoxKind, CommonCause, CommonCauseConvention, MAXIMUM_BOXES, MAXIMUM_MODEL_STATES, Rule, System,
};
pub use transient::{AfterFailure, Transient};

/// The examples of the codes of this crate are run with its own.
#[cfg(doctest)]
#[doc = include_str!("../../docs/errors/U07.md")]
pub struct ErrorPages;
