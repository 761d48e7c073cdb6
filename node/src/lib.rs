//! A station: the cycle, the token, and repair, as a pure state machine.
//!
//! [`Station`] is a controller or an understudy: they differ in the programs that they run and in the words that they
//! publish.

mod event;
mod generated;
mod replica;
mod settings;
mod station;
mod words;

pub use event::Event;
pub use generated::Generated;
pub use settings::Settings;
pub use station::{STATES_EVERY, Station};
pub use words::{of_controller as words_of_controller, of_understudy as words_of_understudy};
