//! `[notify]`: the command that passes alarms on to other systems.

use std::time::Duration;

/// Command that is run when an alarm is raised, acknowledged or over. The members do not run it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Notify {
    /// The program.
    pub program: String,
    /// Its arguments.
    pub arguments: Vec<String>,
    /// Time after which it is killed.
    pub timeout: Duration,
}
