//! Whether the others receive this member, by what they send themselves.
//!
//! A member whose frames are refused everywhere, because another process with its keys began a later life, learns it here and nowhere else.
//!
//! | member | evidence |
//! |---|---|
//! | station | a remote I/O sends in each sample that the station is gone |
//! | remote I/O | a station recalls the remote I/O's sample in each frame, because it has received none in the cycle |
//!
//! A broken link gives the same evidence. So what follows from it must be harmless there: the member begins a new life, and does so less
//! and less often.

use std::collections::BTreeMap;
use std::time::Duration;

use understudy_wire::{Body, Frame, Member, Time};

/// The evidence has to last so long for the first new life, and twice as long for each further one.
const FIRST_PATIENCE: Duration = Duration::from_secs(3);

/// And no longer than this.
const LONGEST_PATIENCE: Duration = Duration::from_secs(300);

/// What one member gathers.
#[derive(Debug)]
pub(crate) struct Unreceived {
    own: Member,
    patience: Duration,
    /// Since when each other member says in every frame that it does not receive this one.
    since: BTreeMap<Member, Time>,
}

impl Unreceived {
    pub(crate) fn new(own: Member) -> Self {
        Self { own, patience: FIRST_PATIENCE, since: BTreeMap::new() }
    }

    /// Takes a frame of another member; true where it is time for a new life.
    pub(crate) fn shown_by(&mut self, now: Time, frame: &Frame) -> bool {
        let sender = frame.header.sender;
        let unreceived = match (self.own, &frame.body) {
            // The other one of two remote I/Os may be received in its place.
            (Member::Twin(own), Body::Turn(turn)) => {
                turn.recalled.iter().any(|recalled| recalled.program == own)
            }
            (Member::Twin(own), Body::Join(join)) => {
                join.recalled.iter().any(|recalled| recalled.program == own)
            }
            (Member::Station(own), Body::Sample(sample)) => sample.gone.contains(own),
            (Member::RemoteIo(own), Body::Turn(turn)) => {
                turn.recalled.iter().any(|recalled| recalled.program == own)
            }
            (Member::RemoteIo(own), Body::Join(join)) => {
                join.recalled.iter().any(|recalled| recalled.program == own)
            }
            _ => return false,
        };
        if !unreceived {
            self.since.remove(&sender);
            return false;
        }
        let since = *self.since.entry(sender).or_insert(now);
        if now.since(since) < self.patience {
            return false;
        }
        self.since.clear();
        self.patience = (2 * self.patience).min(LONGEST_PATIENCE);
        true
    }
}

#[cfg(test)]
mod tests {
    use smallvec::smallvec;
    use understudy_wire::{
        ClusterHash, ConfigurationHash, Header, Image, Lineage, Moment, ProgramId, Sample,
        StationId, StationSet, Step,
    };

    use super::*;

    fn sample(of: u8, gone: StationSet) -> Frame {
        let lineage = Lineage::default();
        Frame {
            header: Header {
                cluster: ClusterHash::of(b"cell"),
                configuration: ConfigurationHash(1),
                prepared: None,
                moment: Moment::default(),
                sender: Member::RemoteIo(ProgramId(of)),
                alone: false,
            },
            body: Body::Sample(Sample {
                born: Moment::default(),
                base: lineage,
                before: lineage,
                after: lineage,
                history: smallvec![Step::of(Image::zero(1))],
                applied: None,
                excluded: StationSet::EMPTY,
                gone,
                drives: true,
                writes: smallvec![],
                pulses: smallvec![],
                unforced: None,
                version: None,
            }),
        }
    }

    /// The seconds in which a new life began, where station 2 gets `gone(second)` from two remote I/Os.
    fn check(seconds: u64, gone: impl Fn(u64, u8) -> bool, expected: &[u64]) {
        let own = StationId(2);
        let mut unreceived = Unreceived::new(Member::Station(own));
        let mut began = Vec::new();
        for second in 0..seconds {
            for of in [0, 1] {
                let set =
                    if gone(second, of) { [own].into_iter().collect() } else { StationSet::EMPTY };
                let now = Time(0) + Duration::from_secs(second);
                if unreceived.shown_by(now, &sample(of, set)) {
                    began.push(second);
                }
            }
        }
        assert_eq!(began, expected);
    }

    #[test]
    fn a_member_that_is_not_received_begins_a_new_life_less_and_less_often() {
        check(20, |_, _| false, &[]);
        check(30, |_, _| true, &[3, 9, 22]);
        check(30, |_, of| of == 0, &[3, 10, 23]);
        // Received again every other second.
        check(60, |second, _| second % 2 == 0, &[]);
    }
}
