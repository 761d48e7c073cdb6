//! Members whose keys were revoked.

use std::sync::atomic::{AtomicU64, Ordering};

use understudy_wire::Member;

/// A set of members that another thread may change while frames are opened.
#[derive(Debug, Default)]
pub struct Revocations {
    words: [AtomicU64; WORDS],
}

/// Two words of stations, of which there are more than 64, and one of each other kind.
const WORDS: usize = 5;

impl Revocations {
    /// From now on exactly these members are revoked.
    pub fn set(&self, revoked: impl IntoIterator<Item = Member>) {
        let mut masks = [0_u64; WORDS];
        for member in revoked {
            let (word, bit) = place(member);
            masks[word] |= bit;
        }
        for (word, mask) in self.words.iter().zip(masks) {
            word.store(mask, Ordering::Relaxed);
        }
    }

    /// Whether the keys of a member were revoked.
    pub fn holds(&self, member: Member) -> bool {
        let (word, bit) = place(member);
        self.words[word].load(Ordering::Relaxed) & bit != 0
    }
}

/// The word of a member and its bit; no bit where its index is past every bound.
fn place(member: Member) -> (usize, u64) {
    let (word, index) = match member {
        Member::Station(station) => (usize::from(station.0 / 64).min(1), station.0),
        Member::RemoteIo(program) => (2, program.0),
        Member::Plant(program) => (3, program.0),
        Member::Twin(program) => (4, program.0),
    };
    let bit = if word == 1 { index - 64 } else { index };
    (word, 1_u64.checked_shl(u32::from(bit)).unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use understudy_wire::{MAXIMUM_PROGRAMS, MAXIMUM_STATIONS, ProgramId, StationId};

    use super::*;

    /// Each member of the largest cluster can be revoked, and no other one is revoked with it.
    #[test]
    fn each_member_is_revoked_alone() {
        let stations = (0..MAXIMUM_STATIONS as u8).map(|rank| Member::Station(StationId(rank)));
        let programs = (0..MAXIMUM_PROGRAMS as u8).map(ProgramId);
        let kinds = [Member::RemoteIo, Member::Plant, Member::Twin];
        let others = programs.flat_map(|program| kinds.map(|kind| kind(program)));
        let members: Vec<Member> = stations.chain(others).collect();
        let revocations = Revocations::default();
        for &revoked in &members {
            revocations.set([revoked]);
            let held = members.iter().copied().filter(|member| revocations.holds(*member));
            assert_eq!(held.collect::<Vec<_>>(), [revoked]);
        }
    }
}
