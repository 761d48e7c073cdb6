//! Why a laboratory could not do its work.

use std::io;
use std::path::PathBuf;
use std::time::Duration;

use understudy_bus::BusError;
use understudy_journal::JOURNAL_VERSION;
use understudy_keys::KeysError;
use understudy_network::NetworkError;

/// Older than this, the newest record that was read says that the laboratory itself is late.
const LATE: Duration = Duration::from_secs(2);

fn behind_text(behind: Duration) -> String {
    match behind > LATE {
        true => format!(
            "; the laboratory reads records that are {} s old: this machine is too slow or too busy for the run",
            behind.as_secs()
        ),
        false => String::new(),
    }
}

/// Everything that was started is stopped when one of these comes out. The codes are stable.
#[derive(Debug, thiserror::Error)]
pub enum LaboratoryError {
    /// A process could not be started.
    #[error("U0521: {name} cannot be started ({}): {source}", program.display())]
    Start {
        /// Which member.
        name: String,
        /// The program that was to run.
        program: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A member ended before it was ready, or in a measurement that its end would falsify.
    #[error("U0522: {name} ended unexpectedly ({how}){}", said(.lines))]
    Ended {
        /// Which member.
        name: String,
        /// Exit status or signal.
        how: String,
        /// Its last words on standard error.
        lines: Vec<String>,
    },
    /// Not all processes came up.
    #[error("U0523: not ready after {seconds} s: {}", names.join(", "))]
    NotReady {
        /// How long it was waited for.
        seconds: u64,
        /// The members that were not.
        names: Vec<String>,
    },
    /// The cluster never came into step.
    #[error(
        "U0524: the cluster was not synchronised after {seconds} s; not yet synchronised: {}",
        names.join(", ")
    )]
    NotInStep {
        /// How long it was waited for.
        seconds: u64,
        /// The members that were not.
        names: Vec<String>,
    },
    /// The cycles of the cluster ceased.
    #[error("U0525: no cycle for {seconds} s, after cycle {cycle}{}", behind_text(*.behind))]
    NoCycles {
        /// How long it was waited for.
        seconds: u64,
        /// The last cycle that was decided.
        cycle: u64,
        /// How old the newest record is that the laboratory has read.
        behind: Duration,
    },
    /// A step of the scenario could not be done.
    #[error("U0526: {action} {name}: {source}")]
    Step {
        /// What.
        action: &'static str,
        /// To whom.
        name: String,
        /// What the system said.
        source: io::Error,
    },
    /// A process says something that is no record.
    #[error("U0527: {name} says what is no record: {line}")]
    Record {
        /// Which member.
        name: String,
        /// The line, cut.
        line: String,
    },
    /// A process is of another version of this program.
    #[error(
        "U0535: {name} reports version {found} of the journal, and this laboratory reads version {JOURNAL_VERSION}: start every member with the program of the laboratory"
    )]
    Version {
        /// Which member.
        name: String,
        /// Version of its records.
        found: u32,
    },
    /// The scenario needs what only the simulator has.
    #[error("U0528: only `understudy simulate` has these steps of the scenario: {}", words.join(", "))]
    OnlySimulated {
        /// Their actions.
        words: Vec<&'static str>,
    },
    /// One of two networks was to be impaired, and the cluster has one.
    #[error(
        "U0547: the cluster has one network: leave out --impaired-network, or add `networks = 2` to `[cluster]` in the cluster file"
    )]
    OneNetwork,
    /// The network that was asked for is not to be had.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// The addresses do not fit together.
    #[error(transparent)]
    Endpoints(BusError),
    /// There are no keys for the run.
    #[error("{}", errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Keys {
        /// All that is wrong.
        errors: Vec<KeysError>,
    },
    /// The system refused something that the laboratory needs.
    #[error("U0529: {what}: {source}")]
    System {
        /// What was asked of it.
        what: &'static str,
        /// What it said.
        source: io::Error,
    },
}

impl LaboratoryError {
    /// The stable code, such as `U0522`; a member's own code where it named one.
    pub fn code(&self) -> &str {
        match self {
            Self::Start { .. } => "U0521",
            Self::Ended { lines, .. } => {
                lines.iter().rev().find_map(|line| code_in(line)).unwrap_or("U0522")
            }
            Self::NotReady { .. } => "U0523",
            Self::NotInStep { .. } => "U0524",
            Self::NoCycles { .. } => "U0525",
            Self::Step { .. } => "U0526",
            Self::Record { .. } => "U0527",
            Self::Version { .. } => "U0535",
            Self::OnlySimulated { .. } => "U0528",
            Self::OneNetwork => "U0547",
            Self::Network(error) => error.code(),
            Self::Endpoints(error) => error.code(),
            Self::Keys { errors } => errors.first().map_or("U0902", KeysError::code),
            Self::System { .. } => "U0529",
        }
    }
}

/// A code such as `U0501` in a line.
fn code_in(line: &str) -> Option<&str> {
    line.match_indices('U')
        .filter_map(|(place, _)| line.get(place..place + 5))
        .find(|code| code[1..].bytes().all(|byte| byte.is_ascii_digit()))
}

fn said(lines: &[String]) -> String {
    if lines.is_empty() {
        return String::new();
    }
    format!(", saying:\n  {}", lines.join("\n  "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_code_of_a_member_that_named_one_is_passed_on() {
        let check = |line: &str, expected| assert_eq!(code_in(line), expected, "{line}");
        check("error[U0501]: port 7 is in use", Some("U0501"));
        check("U0501: port", Some("U0501"));
        check("UDP U05", None);
        check("Über U12é45", None);
    }
}
