//! Members whose keys were revoked.

use std::sync::atomic::{AtomicU64, Ordering};

use understudy_wire::Member;

/// A set of members that another thread may change while frames are opened.
#[derive(Debug, Default)]
pub struct Revocations {
    stations: AtomicU64,
    remote_ios: AtomicU64,
    plants: AtomicU64,
}

impl Revocations {
    /// From now on exactly these members are revoked.
    pub fn set(&self, revoked: impl IntoIterator<Item = Member>) {
        let mut masks = [0_u64; 3];
        for member in revoked {
            let (kind, bit) = place(member);
            masks[kind] |= bit;
        }
        for (word, mask) in self.words().into_iter().zip(masks) {
            word.store(mask, Ordering::Relaxed);
        }
    }

    /// Whether the keys of a member were revoked.
    pub fn holds(&self, member: Member) -> bool {
        let (kind, bit) = place(member);
        self.words()[kind].load(Ordering::Relaxed) & bit != 0
    }

    fn words(&self) -> [&AtomicU64; 3] {
        [&self.stations, &self.remote_ios, &self.plants]
    }
}

/// The kind of a member and its bit; no bit where its index is past every bound.
fn place(member: Member) -> (usize, u64) {
    let (kind, index) = match member {
        Member::Station(station) => (0, station.0),
        Member::RemoteIo(program) => (1, program.0),
        Member::Plant(program) => (2, program.0),
    };
    (kind, 1_u64.checked_shl(u32::from(index)).unwrap_or(0))
}
