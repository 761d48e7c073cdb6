//! Transfer of a state between stations, as a snapshot and a log.
//!
//! ```text
//! giver   its state after the sample of cycle t ──► a snapshot, kept while it is asked for
//!                     │ segments, two in a cycle
//! joiner  logs all samples from t on ──► all segments ──► replays the log, some samples in a cycle ──► shadow mode
//! ```
//!
//! A state of one segment is sent as it is, without a snapshot. The joiner asks for the segments that it lacks in each cycle, so lost ones
//! come again. Where none comes for [`PATIENCE_CYCLES`], it takes the snapshot of any station: that of a giver that is gone has no
//! other copy. Segments are put together by the digest of the whole, which is checked before the state is used; where the log does
//! not reach back to the snapshot, another one is asked for.

use std::collections::VecDeque;

use understudy_cycle::Versions;
use understudy_executable::Scratch;
use understudy_wire::{
    Digest, Image, Lineage, Partial, Segment, SegmentMask, StationId, Step, Transfer,
};

use super::log::Log;
use super::{Held, Remembered, Replica, Standing, State};

/// Segments of wide states that a station sends in a cycle, all states together: 16 KiB.
pub(crate) const SEGMENTS_A_CYCLE: usize = 2;

/// Cycles without a segment after which a joiner takes another snapshot.
const PATIENCE_CYCLES: u32 = 3;

/// Cycles without a question after which a giver drops a snapshot.
const KEPT_CYCLES: u32 = 16;

/// Samples that are replayed onto a wide state in one cycle, so that the other programs of the station are in time.
const REPLAYED_A_CYCLE: usize = 4;

/// A state of which some segments have come.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct Arriving {
    whole: Digest,
    missing: SegmentMask,
    held: Held,
    /// Cycles since the last segment.
    idle: u32,
}

/// What a replica without a state gathers.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub(super) struct Joining {
    pub(super) log: Option<Log>,
    arriving: Option<Arriving>,
    /// The whole state, from which the log is still to be replayed.
    behind: Option<Behind>,
}

/// A state that is not current yet.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct Behind {
    from: StationId,
    held: Held,
    past: VecDeque<State>,
}

/// A snapshot for a station that lacks the state.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct Snapshot {
    to: StationId,
    whole: Digest,
    held: Held,
    /// Cycles since it was asked for.
    idle: u32,
}

impl Replica {
    /// The state, or the next segments of it, for a station that lacks it and can prove outputs with it from then on; nothing
    /// unless this replica is synchronised. `partial` is what that station has; `budget` counts the segments of wide states that may
    /// still be sent in this cycle.
    pub(crate) fn transfer(
        &mut self,
        to: StationId,
        partial: Option<&Partial>,
        budget: &mut usize,
    ) -> Vec<Transfer> {
        let Some(held) = self.held.as_ref().filter(|_| self.standing == Standing::Proven) else {
            return Vec::new();
        };
        if let Remembered::Relayed(recalled) | Remembered::Received(recalled) = &mut self.remembered
            && recalled.accounted_for.contains(to)
        {
            recalled.accounted_for.remove(to);
            self.given.insert(to);
        }
        let width = held.state.bits.width();
        let segment_of = |held: &Held, whole, place| {
            let state = Segment::of(&held.state.bits, whole, place)?;
            Some(Transfer {
                to,
                program: self.id,
                hash: held.state.program,
                born: held.born,
                lineage: held.state.lineage,
                stepped: held.state.stepped,
                digest: held.state.digest,
                state,
            })
        };
        if Segment::count(width) == 1 {
            let whole = Digest::of(&held.state.bits);
            return segment_of(held, whole, 0).into_iter().collect();
        }
        if *budget == 0 {
            return Vec::new();
        }
        let mut snapshots = self.snapshots.iter();
        let place = snapshots.position(|it| {
            it.to == to && partial.is_some_and(|partial| partial.lineage == it.held.state.lineage)
        });
        let (place, missing) = match (place, partial) {
            (Some(place), Some(partial)) => (place, partial.missing),
            (None, Some(partial)) if !partial.waits => return Vec::new(),
            _ => {
                self.snapshots.retain(|it| it.to != to);
                self.snapshots.push(Snapshot {
                    to,
                    whole: Digest::of(&held.state.bits),
                    held: held.clone(),
                    idle: 0,
                });
                (self.snapshots.len() - 1, Segment::all(width))
            }
        };
        let snapshot = &mut self.snapshots[place];
        snapshot.idle = 0;
        let snapshot = &self.snapshots[place];
        let sent: Vec<Transfer> = (0..Segment::count(width))
            .filter(|&segment| missing >> segment & 1 == 1)
            .take(*budget)
            .filter_map(|segment| segment_of(&snapshot.held, snapshot.whole, segment))
            .collect();
        *budget -= sent.len();
        sent
    }

    /// Takes a state, or a segment of one, from the station `from`. True where the state is whole, leads to the last sample received, and is
    /// that of this replica from now on.
    pub(crate) fn adopt(
        &mut self,
        versions: Versions<'_>,
        scratch: &mut Scratch,
        (from, transfer): (StationId, &Transfer),
        shadow_cycles: u32,
    ) -> bool {
        let segment = &transfer.state;
        let Some(program) = versions.of(transfer.hash) else {
            return false;
        };
        let width = program.executable.state_count();
        if self.standing != Standing::Lost
            || self.joining.behind.is_some()
            || segment.width as usize != width
        {
            return false;
        }
        let is_other = |arriving: &Arriving| {
            arriving.whole != segment.whole || arriving.held.state.lineage != transfer.lineage
        };
        match &self.joining.arriving {
            Some(arriving) if is_other(arriving) && arriving.idle < PATIENCE_CYCLES => {
                return false;
            }
            Some(arriving) if !is_other(arriving) => {}
            _ => {
                self.joining.arriving = Some(Arriving {
                    whole: segment.whole,
                    missing: Segment::all(width),
                    held: Held {
                        born: transfer.born,
                        state: State {
                            bits: Image::zero(width),
                            program: transfer.hash,
                            lineage: transfer.lineage,
                            stepped: transfer.stepped,
                            digest: transfer.digest,
                        },
                    },
                    idle: 0,
                });
            }
        }
        let Some(arriving) = &mut self.joining.arriving else {
            return false;
        };
        arriving.idle = 0;
        arriving.missing &= !(1 << segment.place);
        segment.put(&mut arriving.held.state.bits);
        if arriving.missing != 0 {
            return false;
        }
        let Some(arrived) = self.joining.arriving.take() else {
            return false;
        };
        Digest::of(&arrived.held.state.bits) == arrived.whole
            && self.arrived(versions, scratch, (from, arrived.held), shadow_cycles)
    }

    /// Takes a whole state, if it leads to the last sample.
    fn arrived(
        &mut self,
        versions: Versions<'_>,
        scratch: &mut Scratch,
        (from, held): (StationId, Held),
        shadow_cycles: u32,
    ) -> bool {
        let Some(log) = &mut self.joining.log else {
            // No sample was received: the remote I/O is down, and the state is kept until it comes back.
            let keeps = self.held.is_none();
            if keeps {
                self.past.clear();
                self.held = Some(held);
                self.standing = Standing::Shadow(shadow_cycles);
            }
            return keeps;
        };
        if !log.starts_at(held.state.lineage) {
            return false;
        }
        self.joining.behind = Some(Behind { from, held, past: VecDeque::new() });
        self.catch_up(versions, scratch, shadow_cycles).is_some()
    }

    /// Replays some samples of the log onto a state that was transferred. Once none is left, the replica has that state: the station
    /// that it is from.
    pub(super) fn catch_up(
        &mut self,
        versions: Versions<'_>,
        scratch: &mut Scratch,
        shadow_cycles: u32,
    ) -> Option<StationId> {
        let Behind { from, held, past } = self.joining.behind.take()?;
        let log = self.joining.log.as_mut()?;
        if log.begins() != held.state.lineage {
            // Samples became void: the state is of another history.
            return None;
        }
        let is_wide = Segment::count(held.state.bits.width()) > 1;
        let most = if is_wide { REPLAYED_A_CYCLE } else { usize::MAX };
        let samples: Vec<Step> = std::iter::from_fn(|| log.take()).take(most).collect();
        let (moment, is_over) = (log.moment, log.is_empty());
        let before = (self.held.replace(held), std::mem::replace(&mut self.past, past));
        let replayed =
            samples.iter().try_for_each(|step| self.step(versions, scratch, step, moment));
        if replayed.is_err() {
            // The log changes to a program that is not loaded here.
            (self.held, self.past) = before;
            self.step.after = None;
            return None;
        }
        if is_over {
            if let Some(held) = &mut self.held {
                held.state.stepped = moment;
            }
            self.standing = Standing::Shadow(shadow_cycles);
            self.joining = Joining::default();
            return Some(from);
        }
        // Until it is current, it is not the state of this replica.
        let (held, past) = before;
        let past = std::mem::replace(&mut self.past, past);
        let held = std::mem::replace(&mut self.held, held)?;
        self.joining.behind = Some(Behind { from, held, past });
        self.step.after = None;
        None
    }

    /// Whether a station takes over a state from this one: what it proves then is not known here.
    pub(super) fn gives_to(&self, station: StationId) -> bool {
        self.snapshots.iter().any(|snapshot| snapshot.to == station)
    }

    /// A station reports to hold the state of `lineage`: a snapshot of it for that station has arrived.
    pub(super) fn is_taken_over(&mut self, station: StationId, lineage: Lineage) {
        self.snapshots.retain(|it| it.to != station || it.held.state.lineage != lineage);
    }

    /// Whether it asks other stations for a state: it has none, and replays none.
    pub(crate) fn wants_state(&self) -> bool {
        self.standing == Standing::Lost && self.joining.behind.is_none()
    }

    /// What has come of a state.
    pub(crate) fn partial(&self) -> Option<Partial> {
        self.joining.arriving.as_ref().map(|arriving| Partial {
            program: self.id,
            lineage: arriving.held.state.lineage,
            missing: arriving.missing,
            waits: arriving.idle >= PATIENCE_CYCLES,
        })
    }

    /// Ends a cycle of transfers.
    pub(super) fn close_transfers(&mut self) {
        if let Some(arriving) = &mut self.joining.arriving {
            arriving.idle = arriving.idle.saturating_add(1);
        }
        self.snapshots.retain_mut(|snapshot| {
            snapshot.idle += 1;
            snapshot.idle <= KEPT_CYCLES
        });
    }
}
