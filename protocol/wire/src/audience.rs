//! Receivers of each kind of frame.
//!
//! Invariant: a member receives from another one on one topic at most, so that one subscription and one key for each
//! are enough.
//!
//! | topic | sent by | received by |
//! |---|---|---|
//! | cycle | stations | all other stations and all remote I/Os; a Transfer only by the station that asked, where the
//! link can choose |
//! | cycle | remote I/Os | all stations |
//! | field | plant i | remote I/O i, and the plants that it feeds or that follow it |
//! | actuation | remote I/O i | plant i |

use crate::frame::Body;
use crate::identifier::{Member, ProgramId};

/// Topic of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Topic {
    /// The cycle of the cluster.
    Cycle,
    /// Sensors of a plant.
    Field,
    /// Outputs that a remote I/O drives.
    Actuation,
}

impl Topic {
    /// All topics; the place of each is `topic as usize`.
    pub const ALL: [Self; 3] = [Self::Cycle, Self::Field, Self::Actuation];

    /// Topic of a kind of frame.
    pub fn of(body: &Body) -> Self {
        match body {
            Body::Sync | Body::Sample(_) | Body::Turn(_) | Body::Join(_) | Body::Transfer(_) => {
                Self::Cycle
            }
            Body::Field(_) => Self::Field,
            Body::Actuation(_) => Self::Actuation,
        }
    }

    /// Topic on which `receiver` receives from `sender`, if any; a pair (i, j) in `neighbours` means that plant j
    /// receives from plant i.
    pub fn between(
        sender: Member,
        receiver: Member,
        neighbours: &[(ProgramId, ProgramId)],
    ) -> Option<Self> {
        if sender == receiver {
            return None;
        }
        match (sender, receiver) {
            // A sample of a remote I/O concerns no other remote I/O.
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
            (Member::Plant(sender), Member::Plant(receiver)) => neighbours
                .contains(&(sender, receiver))
                .then_some(Self::Field),
            (Member::Station(_), Member::Plant(_)) | (Member::Plant(_), Member::Station(_)) => None,
        }
    }
}
