//! Alarms that an operator takes off the list for a limited time, as the journal keeps it.

use serde::{Deserialize, Serialize};
use understudy_cluster::AlarmDeclaration;
use understudy_text::spelling::suggestion;
use understudy_wire::check_owner_and_reason;

/// The longest time for which an alarm is shelved at once, in seconds.
pub const MAXIMUM_SHELVING_SECONDS: u64 = 24 * 3600;

/// An alarm on a signal is shelved: it is not in the list of open alarms until its time is over.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shelving {
    /// Name of the alarm.
    pub name: String,
    /// For how long, in seconds of the cycles of the cluster.
    pub seconds: u64,
    /// Who shelves it.
    pub owner: String,
    /// Reason.
    pub reason: String,
    /// When, in seconds since 1970-01-01 UTC.
    pub at_unix_s: u64,
}

/// A shelved alarm is shelved no more.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Unshelving {
    /// Name of the alarm.
    pub name: String,
    /// Who takes it back.
    pub owner: String,
    /// Reason.
    pub reason: String,
    /// When, in seconds since 1970-01-01 UTC.
    pub at_unix_s: u64,
}

/// Why an alarm is not shelved or not acknowledged.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AlarmRefusal {
    /// The cluster has no alarm of that name.
    #[error("U0660: the cluster has no alarm `{name}` on a signal; {help}")]
    NoAlarm {
        /// Name in the request.
        name: String,
        /// The names that there are.
        help: String,
    },
    /// The time, the person or the reason is missing or too long.
    #[error("U0661: {0}")]
    Invalid(String),
    /// It was not raised, or is acknowledged.
    #[error("U0662: there is nothing to acknowledge of the alarm `{0}`")]
    NotOpen(String),
}

impl AlarmRefusal {
    /// Its code in the documentation of errors.
    pub fn code(&self) -> &'static str {
        match self {
            Self::NoAlarm { .. } => "U0660",
            Self::Invalid(_) => "U0661",
            Self::NotOpen(_) => "U0662",
        }
    }
}

/// The declared alarm of a name.
///
/// # Errors
/// [`AlarmRefusal::NoAlarm`].
pub fn find_alarm<'a>(
    alarms: &'a [AlarmDeclaration],
    name: &str,
) -> Result<&'a AlarmDeclaration, AlarmRefusal> {
    let found = alarms.iter().find(|alarm| alarm.name == name);
    found.ok_or_else(|| AlarmRefusal::NoAlarm {
        name: name.chars().take(60).collect(),
        help: suggestion(name, alarms.iter().map(|alarm| alarm.name.as_str())),
    })
}

impl Shelving {
    /// Checks the alarm, the time, the person and the reason.
    ///
    /// # Errors
    /// [`AlarmRefusal`].
    pub fn check(&self, alarms: &[AlarmDeclaration]) -> Result<(), AlarmRefusal> {
        find_alarm(alarms, &self.name)?;
        if !(1..=MAXIMUM_SHELVING_SECONDS).contains(&self.seconds) {
            return Err(AlarmRefusal::Invalid(format!(
                "an alarm is shelved for 1 to {MAXIMUM_SHELVING_SECONDS} seconds, not for {}",
                self.seconds
            )));
        }
        check_person(&self.owner, &self.reason)
    }
}

impl Unshelving {
    /// Checks the alarm, the person and the reason.
    ///
    /// # Errors
    /// [`AlarmRefusal`].
    pub fn check(&self, alarms: &[AlarmDeclaration]) -> Result<(), AlarmRefusal> {
        find_alarm(alarms, &self.name)?;
        check_person(&self.owner, &self.reason)
    }
}

fn check_person(owner: &str, reason: &str) -> Result<(), AlarmRefusal> {
    let checked = check_owner_and_reason(owner, reason);
    checked.map_err(|error| AlarmRefusal::Invalid(error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_alarm_an_endless_time_and_a_missing_reason_are_refused() {
        let program = "PROGRAM tank\nVAR_INPUT full : BOOL; END_VAR\nVAR_OUTPUT open : BOOL; END_VAR\nopen := full;\nEND_PROGRAM";
        let cluster = "[cluster]\nname = \"cell\"\n[[controller]]\nname = \"tank\"\nladder = \"tank.st\"\n\
            [[alarm]]\nsignal = \"tank.full\"\nwhen = true\ntext = \"full\"\n";
        let loaded =
            understudy_cluster::read("cluster.toml", cluster, &mut |_| Ok(program.to_owned()));
        let cluster = loaded.cluster.expect("it is right");
        let code = |name: &str, seconds, reason: &str| {
            let shelving = Shelving {
                name: name.to_owned(),
                seconds,
                owner: "anna".to_owned(),
                reason: reason.to_owned(),
                at_unix_s: 0,
            };
            let checked = shelving.check(cluster.alarms());
            checked.err().map(|refusal| refusal.to_string()[..5].to_owned())
        };
        let refused = |code: &str| Some(code.to_owned());
        assert_eq!(code("tank.full", 600, "repair"), None);
        assert_eq!(code("tank.full", MAXIMUM_SHELVING_SECONDS, "repair"), None);
        assert_eq!(code("tank.ful", 600, "repair"), refused("U0660"));
        for seconds in [0, MAXIMUM_SHELVING_SECONDS + 1, u64::MAX] {
            assert_eq!(code("tank.full", seconds, "repair"), refused("U0661"));
        }
        for reason in ["", " ", "a\nb", &"x".repeat(121)] {
            assert_eq!(code("tank.full", 600, reason), refused("U0661"), "{reason}");
        }
    }
}
