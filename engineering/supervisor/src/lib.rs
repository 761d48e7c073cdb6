//! Supervisors: from a plant and a specification to the automaton that keeps it, after Ramadge and Wonham, and to its ladder.
//!
//! An [`Automaton`] models what a plant can do or what it may do. [`read_ads`] and [`write_ads`] speak TCT's format, [`read_model`]
//! and [`write_model`] our own, [`foreign`] those of Supremica and libFAUDES. [`operations`] are TCT's. [`synthesise`] lists states, [`synthesise_symbolically`] holds sets of
//! them, [`synthesise_modularly`] makes a supervisor for each specification; all three are compared on every model that fits.
//! [`ladder`] turns a supervisor into a program, [`proof`] proves it, [`petri`] does the same for automation Petri nets.

pub mod ads;
mod alphabet;
mod automaton;
mod drawing;
mod events;
mod explicit;
mod findings;
pub mod foreign;
mod form;
mod format;
mod kind;
mod labels;
pub mod ladder;
pub mod model;
mod modular;
pub mod operations;
pub mod petri;
pub mod proof;
mod schema;
mod symbolic;
mod synthesis;

pub use ads::{AdsError, Read, read_ads, write_ads};
pub use alphabet::{Alphabet, Event, Label};
pub use automaton::{Automaton, AutomatonError, Edge, State, Transition};
pub use drawing::{TooLargeToDraw, draw_automaton_svg, draw_dot};
pub use explicit::{Bounds, TooLarge};
pub use findings::{
    Finding, empty_finding, model_findings, modular_findings, specification_findings,
    synthesis_findings,
};
pub use foreign::{ReadForeign, read_generator, read_module, write_generator, write_module};
pub use kind::FileKind;
pub use labels::{EventSource, EventsDisagree, agree_on_events};
pub use model::{Model, ReadModel, Signal, read_model, write_model};
pub use modular::{LocalSupervisor, ModularSupervisor, Together, synthesise_modularly};
pub use schema::{map_schema, model_schema, net_schema};
pub use symbolic::{
    SymbolicBounds, SymbolicSupervisor, TooComplex, Verdict, nonconflicting_symbolically,
    synthesise_symbolically,
};
pub use synthesis::{synthesise, unknown_events};

/// The examples of the codes of this crate are run with its own.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/errors/U08.md")]
pub struct ErrorPages;
