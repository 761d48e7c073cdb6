//! Protection of a program as its remote I/O reports it, and what is left of a lost state.

use schemars::JsonSchema;
use serde::Serialize;
use understudy_remote_io::{AskReason, OldInputs};

/// Protection of a program.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Protection {
    /// Whether the failure of one station would be masked.
    pub protected: bool,
    /// The first cycle, from the origin.
    pub since: i64,
    /// The stations that cannot prove the outputs in this cycle; none where the program is protected.
    pub lacking: Vec<LackingStation>,
}

/// A station that cannot prove the outputs of a program.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct LackingStation {
    /// Its name.
    pub station: String,
    /// `not-received`, `joining`, `behind`, `excluded` or `failed`.
    pub reason: &'static str,
    /// The link that is broken, as `from → to`, where the cause is a link.
    pub link: Option<String>,
    /// The reason in words.
    pub text: String,
}

/// What is available of a program whose state is lost.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct LostState {
    /// The first cycle, from the origin.
    pub since: i64,
    /// The cycle of the newest available state, as the cluster counts: the operator's choice names it. Nothing where no station has one.
    pub newest: Option<u64>,
    /// The station that holds it, or has kept it over a power failure.
    pub holder: Option<String>,
    /// Its age in cycles, compared with the newest applied output, when the state was lost; nothing where that is not known. It is not known of a
    /// state that is as new as the newest output of which it is known that it was applied: it is lost because a newer one may have been.
    pub age_cycles: Option<u64>,
    /// Whether the operator is asked.
    pub asks: bool,
    /// Why the program does not start by itself from a state that is not lost: its values or names have changed, or the cluster file says so.
    pub reason: Option<&'static str>,
    /// What levels and setpoints with `retain` have after the start from the newest state, where that is not what they had in it.
    pub inputs: Option<String>,
}

/// What levels and setpoints with `retain` have after a start.
pub(crate) fn old_inputs_text(inputs: OldInputs) -> String {
    let kept = "levels and setpoints with `retain`";
    match inputs {
        OldInputs::Initial => {
            format!("{kept} have their INITIAL values: there is no note that has them")
        }
        OldInputs::Of(moment) => format!(
            "{kept} have OLDER values than the state: the newest note is of cycle {} of the cluster",
            moment.cycle.0
        ),
    }
}

/// Why a program does not start by itself from a state that is not lost.
pub(crate) fn asked_because(reason: AskReason) -> Option<&'static str> {
    match reason {
        AskReason::Doubt => None,
        AskReason::NotWhole => Some(
            "the newest state was kept by another program, or under other names or keys, and not all of it is taken over \
             (retained-dropped, retained-refused)",
        ),
        AskReason::Unreceived => Some(
            "a station that could compute it is not received, and may follow the other remote I/O, which is not received either",
        ),
        AskReason::Configured => Some("restart = \"operator\" asks after each power failure"),
    }
}

impl Protection {
    /// `protected`, or why not.
    pub fn text(&self) -> String {
        if self.protected {
            return "protected".to_owned();
        }
        let texts: Vec<&str> = self.lacking.iter().map(|one| one.text.as_str()).collect();
        let causes = if texts.is_empty() { "" } else { ": " };
        format!("NOT protected since cycle {}{causes}{}", self.since, texts.join(", "))
    }
}

impl LostState {
    /// What is available, and how old it is.
    pub fn text(&self) -> String {
        let age = self.age_cycles.map_or_else(String::new, |age| format!(", {age} cycles old"));
        let doubt = match (self.age_cycles, self.reason) {
            (None, None) => "; whether outputs of a newer one were applied is not known",
            _ => "",
        };
        let since = self.since;
        let lost = match self.reason {
            Some(reason) => format!("NOT STARTED since cycle {since}: {reason}"),
            None => format!("STATE LOST since cycle {since}"),
        };
        let inputs = self.inputs.as_ref();
        let inputs = inputs.map_or_else(String::new, |text| format!("; after accept-state {text}"));
        match (self.newest, &self.holder) {
            (Some(newest), Some(holder)) => format!(
                "{lost}: the newest available state is of cycle {newest} of the cluster{age}, in {holder}{doubt}{inputs}"
            ),
            _ => format!("{lost}: no station has a state of the program"),
        }
    }
}
