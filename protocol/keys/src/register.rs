//! What was issued to whom.

use serde::{Deserialize, Serialize};

use crate::date::Date;

/// The authority's book.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Register {
    /// The name of the cluster.
    pub cluster: String,
    /// In the order in which they were first issued something.
    #[serde(rename = "holder", default)]
    pub holders: Vec<Holder>,
}

/// One who holds keys.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Holder {
    /// A member's name in the cluster file, or an operator's.
    pub name: String,
    /// What it may do.
    pub role: Role,
    /// Which of its keys are the present ones, from 1; all earlier ones no longer count.
    pub generation: u32,
    /// Of the present certificate, hexadecimal.
    pub serial: String,
    /// When the present ones were made.
    pub issued: Date,
    /// Until when the present certificate holds.
    pub expires: Date,
    /// Since when the present ones no longer count.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub revoked: Option<Date>,
    /// The newest of its keys that ever were revoked: these and all before them stay so, whatever is issued after.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub revoked_through: Option<Revoked>,
}

/// Keys that no longer count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Revoked {
    /// This generation and all before it.
    pub generation: u32,
    /// Since when.
    pub since: Date,
}

/// Rights of a holder.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// Be a member of the cluster.
    Member,
    /// Read what the members report.
    Viewer,
    /// Also write operator inputs.
    Operator,
    /// Also force signals, release outputs, choose states and stop members.
    Engineer,
}

impl From<understudy_wire::Role> for Role {
    fn from(role: understudy_wire::Role) -> Self {
        match role {
            understudy_wire::Role::Viewer => Self::Viewer,
            understudy_wire::Role::Operator => Self::Operator,
            understudy_wire::Role::Engineer => Self::Engineer,
        }
    }
}

impl Role {
    /// Its name.
    pub fn word(self) -> &'static str {
        self.of_person().map_or("member", understudy_wire::Role::word)
    }

    /// The rights of a person; `None` for a member.
    pub fn of_person(self) -> Option<understudy_wire::Role> {
        match self {
            Self::Member => None,
            Self::Viewer => Some(understudy_wire::Role::Viewer),
            Self::Operator => Some(understudy_wire::Role::Operator),
            Self::Engineer => Some(understudy_wire::Role::Engineer),
        }
    }
}

impl Holder {
    /// The common name of its certificate.
    pub fn common_name(&self) -> String {
        common_name(&self.name, self.generation)
    }
}

/// Names have no dots, so that a name and a generation are told apart.
pub(crate) fn common_name(name: &str, generation: u32) -> String {
    format!("{name}.{generation}")
}

impl Register {
    pub(crate) fn find(&self, name: &str) -> Option<&Holder> {
        self.holders.iter().find(|holder| holder.name == name)
    }

    /// Who there is, in words.
    pub(crate) fn known(&self) -> String {
        let names: Vec<&str> = self.holders.iter().map(|holder| holder.name.as_str()).collect();
        match names.as_slice() {
            [] => "nothing was issued yet".to_owned(),
            names => format!("there are {}", names.join(", ")),
        }
    }
}
