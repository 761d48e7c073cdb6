//! What an engineer asks of a member in an online change.

use serde::{Deserialize, Serialize};

use crate::identifier::{ConfigurationHash, ProgramHash};

/// An online change, by the configurations that it leads from and to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct ChangeName {
    /// The configuration before.
    pub before: ConfigurationHash,
    /// The configuration after.
    pub after: ConfigurationHash,
}

impl ChangeName {
    /// Whether a configuration is one of the two.
    pub fn has(self, configuration: ConfigurationHash) -> bool {
        configuration == self.before || configuration == self.after
    }
}

/// A step of an online change, at one member. Each names its change: a step of one that is over does nothing to the next one. The texts of the programs come before, on a way of their own.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ChangeRequest {
    /// Loads the change whose texts are in a file of the member's machine; only a laboratory asks so.
    Prepare {
        /// The file.
        file: String,
    },
    /// A remote I/O changes its program to the one with this hash.
    Switch {
        /// The change.
        change: ChangeName,
        /// Hash of the program.
        to: ProgramHash,
    },
    /// This configuration of the two is the member's own from now on.
    Run {
        /// The change.
        change: ChangeName,
        /// The configuration.
        configuration: ConfigurationHash,
    },
    /// The change is over: this configuration is the only one from now on.
    Forget {
        /// The change.
        change: ChangeName,
        /// The configuration, which the member runs.
        configuration: ConfigurationHash,
    },
}

impl ChangeRequest {
    /// What is asked, in words.
    pub fn words(&self) -> String {
        match self {
            Self::Prepare { .. } => "to load an online change".to_owned(),
            Self::Switch { to, .. } => format!("to change its program to {to}"),
            Self::Run { configuration, .. } => format!("to run configuration {configuration}"),
            Self::Forget { configuration, .. } => {
                format!("to end the change with configuration {configuration}")
            }
        }
    }
}
