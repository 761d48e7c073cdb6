//! Stations with individual times on the command line: `NAME=MTBF,MTTR` or `NAME*COUNT=MTBF,MTTR`.

use std::str::FromStr;

use serde::Serialize;

use crate::error::ReliabilityError;
use crate::quantity::Hours;

/// The name that means the understudies, where there is no cluster file.
pub const UNDERSTUDIES: &str = "understudies";

/// Stations with times of their own.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UnequalBoxes {
    /// The name of a station of the cluster file; without one, any name, where [`UNDERSTUDIES`] means all understudies.
    pub name: String,
    /// Number of controllers; for understudies it stands for all.
    pub count: u32,
    /// Whether they are understudies.
    pub understudies: bool,
    /// Mean time between failures of each.
    pub mtbf: Hours,
    /// Mean time to repair each, from the detection of its failure.
    pub mttr: Hours,
}

impl FromStr for UnequalBoxes {
    type Err = ReliabilityError;

    fn from_str(text: &str) -> Result<Self, ReliabilityError> {
        let wrong =
            |why: &str| ReliabilityError::BoxText { text: text.to_owned(), why: why.to_owned() };
        let (which, times) = text.split_once('=').ok_or_else(|| wrong("missing ="))?;
        let (mtbf, mttr) = times
            .split_once(',')
            .ok_or_else(|| wrong("after = stand an MTBF and an MTTR with a comma between them"))?;
        let (name, count) = match which.split_once('*') {
            None => (which, 1),
            Some((name, count)) => {
                let count = count.trim().parse().ok().filter(|count| *count > 0);
                (name, count.ok_or_else(|| wrong("after * stands how many there are"))?)
            }
        };
        let name = name.trim();
        if name.is_empty() {
            return Err(wrong("it has no name"));
        }
        Ok(Self {
            name: name.to_owned(),
            count,
            understudies: name == UNDERSTUDIES,
            mtbf: mtbf.trim().parse()?,
            mttr: mttr.trim().parse()?,
        })
    }
}

/// A shared part on the command line: `NAME=MTBF`.
impl FromStr for crate::parts::SharedPart {
    type Err = ReliabilityError;

    fn from_str(text: &str) -> Result<Self, ReliabilityError> {
        let parts = text.split_once('=').map(|(name, time)| (name.trim(), time.trim()));
        match parts {
            Some((name, mtbf)) if !name.is_empty() => Ok(Self::single(name, mtbf.parse()?)),
            _ => Err(ReliabilityError::BoxText {
                text: text.to_owned(),
                why: "expected NAME=MTBF".to_owned(),
            }),
        }
    }
}
