//! What cannot be answered, and why.

use std::path::PathBuf;

use understudy_journal::{KeptError, WrongVersion};

/// A question that has no answer.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// There is no run in this place.
    #[error("U0570: no run in {}{hint}", path.display())]
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
    #[error("U0572: cannot read {}: {reason}", path.display())]
    Journal {
        /// Which file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// The journal is of another version.
    #[error("U0534: {}: {wrong}", path.display())]
    Version {
        /// Which file.
        path: PathBuf,
        /// The version that it has.
        wrong: WrongVersion,
    },
    /// No program has an output of this name.
    #[error("U0573: no program has an output or a variable `{name}`; {hint}")]
    NoOutput {
        /// As it was asked for.
        name: String,
        /// The nearest name, or all.
        hint: String,
    },
    /// The name is that of a block, a structure or an array.
    #[error("U0573: `{name}` has no value of its own; name a part of it, such as {}", parts.iter().map(|part| format!("`{part}`")).collect::<Vec<_>>().join(", "))]
    NoValue {
        /// As it was asked for.
        name: String,
        /// Parts that have one, the first few.
        parts: Vec<String>,
    },
    /// Several programs have an output of this name.
    #[error("U0574: {} have an output `{name}`; name the program too, for example `{}.{name}`", programs.join(" and "), programs.first().map_or("robot", String::as_str))]
    SeveralOutputs {
        /// As it was asked for.
        name: String,
        /// Who has one.
        programs: Vec<String>,
    },
    /// The cycle is not in what is left of the journal.
    #[error("U0575: cycle {cycle} is not in the journal of {program}, which has {}", cycles_text(*.cycle, *.known))]
    NoCycle {
        /// As it was asked for.
        cycle: i64,
        /// Whose program.
        program: String,
        /// The first and the last cycle that it has.
        known: Option<(i64, i64)>,
    },
    /// The state of the program is not known in this cycle.
    #[error("U0576: the state of {program} is not known in cycle {cycle}: {reason}")]
    NoState {
        /// As it was asked for.
        cycle: i64,
        /// Whose program.
        program: String,
        /// Why.
        reason: String,
    },
    /// No member or program has this name.
    #[error("U0577: unknown {kind} `{name}`; {hint}")]
    NoName {
        /// What was looked for.
        kind: &'static str,
        /// As it was asked for.
        name: String,
        /// The nearest name, or all.
        hint: String,
    },
    /// The part of the run to be shown is not given.
    #[error("U0579: no part of the run to show: {0}")]
    NoScene(String),
}

/// The cycles of a journal that has no record of `cycle`.
fn cycles_text(cycle: i64, known: Option<(i64, i64)>) -> String {
    match known {
        None => "none".to_owned(),
        Some((from, to)) if (from..=to).contains(&cycle) => {
            format!("{from} to {to} without it: its remote I/O reported nothing in it")
        }
        Some((from, to)) => format!("{from} to {to}"),
    }
}

impl ViewError {
    /// What is wrong, without the code.
    pub fn words(&self) -> String {
        let text = self.to_string();
        let words = text.strip_prefix(self.code());
        let words = words.and_then(|words| words.strip_prefix(": "));
        words.unwrap_or(&text).to_owned()
    }

    /// Stable code.
    pub fn code(&self) -> &'static str {
        match self {
            Self::NoRun { .. } => "U0570",
            Self::Kept(KeptError::NotKept { .. }) => "U0571",
            Self::Kept(_) | Self::Journal { .. } => "U0572",
            Self::Version { .. } => "U0534",
            Self::NoOutput { .. } | Self::NoValue { .. } => "U0573",
            Self::SeveralOutputs { .. } => "U0574",
            Self::NoCycle { .. } => "U0575",
            Self::NoState { .. } => "U0576",
            Self::NoName { .. } => "U0577",
            Self::NoScene(_) => "U0579",
        }
    }
}
