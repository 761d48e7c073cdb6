//! Faults of networks and links.

use std::fmt;

use schemars::JsonSchema;
use serde::Serialize;
use understudy_journal::Members;

use crate::account::{NetworkFault, NetworkSubject};

/// A network that was not in order, or a link that a member could not open.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct NetworkFaultSummary {
    /// Name of the network, or of the member whose link it was.
    pub name: String,
    /// What was wrong.
    pub text: String,
    /// The first cycle with it; nothing before the cluster was synchronised.
    pub from: Option<u64>,
    /// The first cycle without it; nothing where it lasted until the end.
    pub to: Option<u64>,
}

impl NetworkFaultSummary {
    pub(super) fn new(fault: &NetworkFault, members: &Members) -> Self {
        let (name, text) = match fault.subject {
            NetworkSubject::Network(via) => {
                let what =
                    if fault.is_lost { "no frames arrived" } else { "frames were lost or late" };
                let names: Vec<&str> = fault.members.iter().map(|one| members.name(*one)).collect();
                let whom = match names.len() == members.iter().len() {
                    true => "any members".to_owned(),
                    false => names.join(", "),
                };
                (via.name().to_owned(), format!("{what} between {whom}"))
            }
            NetworkSubject::Link(member, via) => {
                let over = via.map_or_else(String::new, |via| format!(" over {via}"));
                let text = format!("could not open its link{over}: {}", fault.reason);
                (members.name(member).to_owned(), text)
            }
        };
        Self { name, text, from: fault.from, to: fault.to }
    }
}

impl fmt::Display for NetworkFaultSummary {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}: {}", self.name, self.text)?;
        match self.from {
            Some(cycle) => write!(formatter, ", from cycle {cycle}")?,
            None => formatter.write_str(", from before cycle 0")?,
        }
        match self.to {
            Some(cycle) => write!(formatter, " to cycle {cycle}"),
            None => formatter.write_str(" until the end"),
        }
    }
}
