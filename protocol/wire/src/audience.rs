//! Receivers of each kind of frame.
//!
//! Invariant: a member receives from another one on one topic at most, so that one subscription and one key for each
//! are enough.
//!
//! | topic | sent by | received by |
//! |---|---|---|
//! | cycle | stations | all other stations and all remote I/Os; a Transfer only by the station that asked, where the
//! link can choose |
//! | cycle | remote I/Os | all stations, and the remote I/Os of programs that read a signal of theirs |
//! | field | plant i | remote I/O i, and the plants that it feeds or that follow it |
//! | actuation | remote I/O i | plant i |

use crate::frame::Body;
use crate::identifier::Member;

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

    /// Topic on which `receiver` receives from `sender`, if any; a pair (i, j) in `neighbours` means that plant or
    /// remote I/O j also receives from plant or remote I/O i.
    pub fn between(
        sender: Member,
        receiver: Member,
        neighbours: &[(Member, Member)],
    ) -> Option<Self> {
        if sender == receiver {
            return None;
        }
        let is_neighbour = || neighbours.contains(&(sender, receiver));
        match (sender, receiver) {
            // Its sample names the lineage that proves the signals of its program.
            (Member::RemoteIo(_), Member::RemoteIo(_)) => is_neighbour().then_some(Self::Cycle),
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
            (Member::Plant(_), Member::Plant(_)) => is_neighbour().then_some(Self::Field),
            (Member::Station(_), Member::Plant(_)) | (Member::Plant(_), Member::Station(_)) => None,
        }
    }
}
