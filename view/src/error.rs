//! What cannot be answered, and why.

use std::path::PathBuf;

use understudy_scenarios::KeptError;

/// A question that has no answer.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// There is no run in this place.
    #[error("no run in {}{hint}", path.display())]
    NoRun {
        /// The place.
        path: PathBuf,
        /// What is there instead.
        hint: String,
    },
    /// The run does not say which programs it ran.
    #[error(transparent)]
    Kept(#[from] KeptError),
    /// The journal cannot be read.
    #[error("{} cannot be read: {reason}", path.display())]
    Journal {
        /// Which file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// No program has an output of this name.
    #[error("no program has an output `{name}`; {hint}")]
    NoOutput {
        /// As it was asked for.
        name: String,
        /// The nearest name, or all.
        hint: String,
    },
    /// Several programs have an output of this name.
    #[error("{} have an output `{name}`; say which, as in `{}.{name}`", programs.join(" and "), programs.first().map_or("robot", String::as_str))]
    SeveralOutputs {
        /// As it was asked for.
        name: String,
        /// Who has one.
        programs: Vec<String>,
    },
    /// The cycle is not in what is left of the journal.
    #[error("cycle {cycle} is not in the journal of {program}, which has {known}")]
    NoCycle {
        /// As it was asked for.
        cycle: i64,
        /// Whose program.
        program: String,
        /// The cycles that it has, in words.
        known: String,
    },
    /// The state of the program is not known in this cycle.
    #[error("the state of {program} is not known in cycle {cycle}: {reason}")]
    NoState {
        /// As it was asked for.
        cycle: i64,
        /// Whose program.
        program: String,
        /// Why.
        reason: String,
    },
    /// No party or program has this name.
    #[error("no {kind} is called `{name}`; {hint}")]
    NoName {
        /// What was looked for.
        kind: &'static str,
        /// As it was asked for.
        name: String,
        /// The nearest name, or all.
        hint: String,
    },
}

impl ViewError {
    /// Stable code.
    pub fn code(&self) -> &'static str {
        match self {
            Self::NoRun { .. } => "U0570",
            Self::Kept(KeptError::NotKept { .. }) => "U0571",
            Self::Kept(_) | Self::Journal { .. } => "U0572",
            Self::NoOutput { .. } => "U0573",
            Self::SeveralOutputs { .. } => "U0574",
            Self::NoCycle { .. } => "U0575",
            Self::NoState { .. } => "U0576",
            Self::NoName { .. } => "U0577",
        }
    }
}
