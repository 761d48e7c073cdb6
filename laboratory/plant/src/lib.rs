//! Small models of plants for the laboratory, and a plant as a member of its own.
//!
//! A [`Plant`] is stepped once a cycle with y(i) and shows u(i): it closes the loop of (1)-(2) through the outside. Invariant:
//! a model sees and moves signals only by name, through the [`Signals`] that bind its terminals to the inputs and outputs of
//! its controller, so that the same model serves any program that uses those names. The model is deterministic: equal
//! outputs, equal arrivals and equal neighbours in equal order show equal sensors.
//!
//! Plants that stand side by side act on each other in two ways: one hands parts over to another, and a terminal can follow
//! what another plant shows ([`Followed`]), such as the pilot flame that the main burner stands in.
//!
//! Counts ([`understudy_wire::Field`]) are all that a verdict needs: a plant is functional while `finished` grows, and nothing
//! may ever be counted in `plant_faults`.

mod binding;
mod event;
mod feeder;
mod followed;
mod machine;
mod model;
mod press;
mod program_model;
mod robot;

pub use binding::{BindingProblem, Signals};
pub use event::{Event, Pace};
pub use followed::Followed;
pub use machine::{PlantMachine, Settings, WATCHDOG_CYCLES};
pub use model::{Direction, ModelKind, Plant, PlantProgram, Terminal, Terminals};
pub use press::PressParameters;
pub use robot::RobotParameters;
