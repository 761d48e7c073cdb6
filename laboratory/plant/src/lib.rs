//! Small models of plants for the laboratory, and a plant as a member.
//!
//! A [`Plant`] is stepped once a cycle with y(i) and shows u(i): it closes the control loop of (1)-(2). Invariant:
//! a model uses signals only by name, through the [`Signals`] that bind its terminals to the inputs and outputs of
//! its controller, so that the same model serves any program that uses those names. The model is deterministic: equal
//! outputs, equal arrivals and equal neighbours in equal order give equal sensors.
//!
//! Plants act on each other in two ways: one hands parts over to another, and a terminal can follow
//! a sensor of another plant ([`Followed`]), such as the pilot flame in front of the main burner.
//!
//! A verdict needs only the counts ([`understudy_wire::Field`]): a plant is functional while `finished` grows, and
//! `plant_faults` must stay 0.

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
