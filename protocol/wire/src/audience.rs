//! Who is to hear whom.
//!
//! Invariant: a member hears another one on one topic at most, so that one subscription and one key for each are enough.
//!
//! | topic | said by | heard by |
//! |---|---|---|
//! | cycle | stations | all other stations and all remote I/Os; a Transfer only by the station that asked, where the link can choose |
//! | cycle | remote I/Os | all stations |
//! | field | plant i | remote I/O i, and the plants that it feeds or that follow it |
//! | actuation | remote I/O i | plant i |

use crate::frame::Body;
use crate::identifier::{Member, ProgramId};

/// What a frame is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Topic {
    /// The cycle of the cluster.
    Cycle,
    /// What a plant's sensors see.
    Field,
    /// What a remote I/O drives.
    Actuation,
}

impl Topic {
    /// Each of them; its place is `topic as usize`.
    pub const ALL: [Self; 3] = [Self::Cycle, Self::Field, Self::Actuation];

    /// What a kind of frame is about.
    pub fn of(body: &Body) -> Self {
        match body {
            Body::Sync | Body::Sample(_) | Body::Turn(_) | Body::Join(_) | Body::Transfer(_) => {
                Self::Cycle
            }
            Body::Field(_) => Self::Field,
            Body::Actuation(_) => Self::Actuation,
        }
    }

    /// On which topic `listener` hears `speaker`, if at all; a pair (i, j) in `neighbours` says that plant j
    /// hears plant i.
    pub fn between(
        speaker: Member,
        listener: Member,
        neighbours: &[(ProgramId, ProgramId)],
    ) -> Option<Self> {
        if speaker == listener {
            return None;
        }
        match (speaker, listener) {
            // What a remote I/O samples concerns no other one.
            (Member::RemoteIo(_), Member::RemoteIo(_)) => None,
            (
                Member::Station(_) | Member::RemoteIo(_),
                Member::Station(_) | Member::RemoteIo(_),
            ) => Some(Self::Cycle),
            (Member::RemoteIo(program), Member::Plant(plant)) => {
                (program == plant).then_some(Self::Actuation)
            }
            (Member::Plant(plant), Member::RemoteIo(program)) => {
                (program == plant).then_some(Self::Field)
            }
            (Member::Plant(speaker), Member::Plant(listener)) => neighbours
                .contains(&(speaker, listener))
                .then_some(Self::Field),
            (Member::Station(_), Member::Plant(_)) | (Member::Plant(_), Member::Station(_)) => None,
        }
    }
}
