//! One count of cycles for a whole run, over all epochs.
//!
//! A cluster numbers the cycles of each epoch anew, and a remote I/O passes *idle* deadlines where nobody starts a cycle. Here
//! every deadline gets a number that only grows: an epoch goes on where the last one ended, and idle deadlines count where
//! every remote I/O passed them (one that is cut off alone does not move the others). The last epoch is not the greatest one: a
//! later founder whom nobody joins gives its epoch up for an earlier one.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use understudy_wire::{Epoch, Moment, ProgramId};

/// Gives numbers to moments.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(from = "Written", into = "Written")]
pub struct Numbering {
    /// For each epoch: what has to be added to its cycles.
    offsets: BTreeMap<Epoch, i128>,
    /// The newest cycle that was started.
    newest: Option<(Moment, i64)>,
    remote_ios: BTreeMap<ProgramId, Last>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
struct Last {
    moment: Moment,
    number: i64,
    /// Deadlines since, without a cycle.
    idle: i64,
}

/// The same as it is written: JSON has no numbers as keys.
#[derive(Serialize, Deserialize)]
struct Written {
    epochs: Vec<(Epoch, Offset)>,
    newest: Option<(Moment, i64)>,
    remote_ios: Vec<(ProgramId, Last)>,
}

impl From<Numbering> for Written {
    fn from(numbering: Numbering) -> Self {
        let offsets = numbering.offsets.into_iter();
        Self {
            epochs: offsets.map(|(epoch, offset)| (epoch, offset.into())).collect(),
            newest: numbering.newest,
            remote_ios: numbering.remote_ios.into_iter().collect(),
        }
    }
}

/// An offset as it is written: records of a journal hold no number with more than 64 bits.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Offset {
    Number(i64),
    Text(String),
}

impl From<i128> for Offset {
    fn from(offset: i128) -> Self {
        i64::try_from(offset).map_or_else(|_| Self::Text(offset.to_string()), Self::Number)
    }
}

impl Offset {
    fn value(&self) -> i128 {
        match self {
            Self::Number(offset) => i128::from(*offset),
            Self::Text(offset) => offset.parse().unwrap_or_default(),
        }
    }
}

impl From<Written> for Numbering {
    fn from(written: Written) -> Self {
        let epochs = written.epochs.into_iter();
        let remote_ios = written.remote_ios.into_iter().map(|(program, last)| {
            let last =
                Last { number: bounded(last.number), idle: bounded(last.idle).max(0), ..last };
            (program, last)
        });
        Self {
            offsets: epochs
                .map(|(epoch, offset)| (epoch, bounded_offset(offset.value())))
                .collect(),
            newest: written.newest.map(|(moment, number)| (moment, bounded(number))),
            remote_ios: remote_ios.collect(),
        }
    }
}

impl Numbering {
    /// One in which `moment` has the number `number`, and nothing is known of what was before.
    pub(crate) fn at(moment: Moment, number: i64) -> Self {
        let number = bounded(number);
        Self {
            offsets: BTreeMap::from([(moment.epoch, i128::from(number) - cycle(moment))]),
            newest: Some((moment, number)),
            remote_ios: BTreeMap::new(),
        }
    }

    /// The number of a deadline that a remote I/O reports. `idle` says that no cycle was started for it.
    pub fn deadline(&mut self, remote_io: ProgramId, moment: Moment, idle: bool) -> i64 {
        if idle
            && let Some(last) = self.remote_ios.get_mut(&remote_io)
            && last.moment == moment
        {
            last.idle += 1;
            return last.number.saturating_add(last.idle);
        }
        let number = self.start(remote_io, moment);
        let last = Last { moment, number, idle: 0 };
        self.remote_ios.insert(remote_io, last);
        number
    }

    /// The number of a moment that others speak of; none for an epoch that no remote I/O has seen.
    pub fn of(&self, moment: Moment) -> Option<i64> {
        let offset = self.offsets.get(&moment.epoch)?;
        Some(number(cycle(moment).saturating_add(*offset)))
    }

    /// The last number that was given.
    pub fn latest(&self) -> Option<i64> {
        let lasts = self.remote_ios.values();
        lasts
            .map(|last| last.number.saturating_add(last.idle))
            .max()
            .or_else(|| Some(self.newest?.1))
    }

    /// Whether every remote I/O that was ever there has told of a later deadline.
    pub fn all_are_past(&self, number: i64) -> bool {
        let mut lasts = self.remote_ios.values();
        lasts.all(|last| last.number.saturating_add(last.idle) > number)
    }

    fn start(&mut self, remote_io: ProgramId, moment: Moment) -> i64 {
        let Some((newest, newest_number)) = self.newest else {
            // A run begins with the numbers of the cluster, unless no viewer could count on from there.
            let first = if moment.cycle.0 <= LARGEST_FIRST { number(cycle(moment)) } else { 0 };
            self.offsets.insert(moment.epoch, i128::from(first) - cycle(moment));
            self.newest = Some((moment, first));
            return first;
        };
        if moment.epoch == newest.epoch {
            if moment > newest {
                let idle = i128::from(self.idle_of_all(newest_number));
                let skipped = cycle(moment) - cycle(newest) - 1;
                let offset = self.offsets.entry(moment.epoch).or_default();
                *offset = offset.saturating_add((idle - skipped).max(0));
            }
        } else {
            let next =
                newest_number.saturating_add(self.idle_of_all(newest_number)).saturating_add(1);
            let next = i128::from(next);
            let offset = self.offsets.entry(moment.epoch).or_insert(next - cycle(moment));
            // One that comes back to an epoch goes on counting from where it was.
            let own = self.remote_ios.get(&remote_io).map(|last| last.number);
            if own.is_some_and(|own| cycle(moment).saturating_add(*offset) <= i128::from(own)) {
                *offset = next - cycle(moment);
            }
        }
        let number = self.of(moment).unwrap_or(newest_number);
        if number > newest_number {
            self.newest = Some((moment, number));
        }
        number
    }

    /// Idle deadlines that every remote I/O has passed which was there in the newest cycle.
    fn idle_of_all(&self, newest_number: i64) -> i64 {
        self.remote_ios
            .values()
            .filter(|last| last.number >= newest_number)
            .map(|last| last.idle)
            .min()
            .unwrap_or(0)
    }
}

/// No cluster lives for so long; what says so is a journal that somebody has changed.
const MAXIMUM: i64 = i64::MAX / 4;

/// Largest number of a first cycle that a browser counts on from.
const LARGEST_FIRST: u64 = 1 << 52;

/// The same of a number that was read.
fn bounded(number: i64) -> i64 {
    number.clamp(-MAXIMUM, MAXIMUM)
}

fn cycle(moment: Moment) -> i128 {
    i128::from(moment.cycle.0)
}

/// As near as a number can be.
fn number(number: i128) -> i64 {
    let bounded = number.clamp((-MAXIMUM).into(), MAXIMUM.into());
    i64::try_from(bounded).unwrap_or(MAXIMUM)
}

/// An offset that was read: that of a number and a cycle.
fn bounded_offset(offset: i128) -> i128 {
    let largest = i128::from(MAXIMUM) + i128::from(u64::MAX);
    offset.clamp(-largest, largest)
}

#[cfg(test)]
mod tests {
    use understudy_wire::Cycle;

    use super::*;

    /// Rows of remote I/O, epoch, cycle, idle and the number that must come out.
    fn check(rows: &[(u8, u64, u64, bool, i64)]) {
        let mut numbering = Numbering::default();
        for &(remote_io, epoch, cycle, idle, expected) in rows {
            let moment = Moment { epoch: Epoch(epoch), cycle: Cycle(cycle) };
            let number = numbering.deadline(ProgramId(remote_io), moment, idle);
            assert_eq!(number, expected, "{remote_io} at {moment} in {rows:?}");
        }
    }

    /// A record holds it within an enum that serde tells apart by a tag.
    #[test]
    fn it_is_read_as_it_was_written() {
        #[derive(Serialize, Deserialize)]
        #[serde(tag = "event")]
        enum Tagged {
            Of { numbering: Numbering },
        }
        for cycle in [0, 5, 1 << 53, u64::MAX - 3] {
            let mut numbering = Numbering::default();
            numbering.deadline(
                ProgramId(0),
                Moment { epoch: Epoch(1), cycle: Cycle(cycle) },
                false,
            );
            numbering.deadline(ProgramId(1), Moment { epoch: Epoch(2), cycle: Cycle(0) }, false);
            let text = serde_json::to_string(&Tagged::Of { numbering: numbering.clone() });
            let read = serde_json::from_str(&text.expect("JSON"));
            let Tagged::Of { numbering: again } = read.expect("what was written");
            assert_eq!(again, numbering, "{cycle}");
        }
    }

    #[test]
    fn cycles_keep_their_numbers() {
        check(&[
            (0, 1, 5, false, 5),
            (1, 1, 5, false, 5),
            (0, 1, 6, false, 6),
            (1, 1, 7, false, 7),
        ]);
    }

    #[test]
    fn an_epoch_goes_on_where_the_last_one_ended() {
        check(&[
            (0, 1, 5, false, 5),
            (0, 2, 0, false, 6),
            (1, 2, 0, false, 6),
            (1, 2, 1, false, 7),
        ]);
    }

    #[test]
    fn the_last_epoch_is_not_the_greatest_one() {
        check(&[
            (0, 9, 0, false, 0),
            (1, 4, 3, false, 1),
            (0, 4, 4, false, 2),
            (1, 4, 4, false, 2),
            (0, 4, 5, false, 3),
        ]);
    }

    #[test]
    fn one_that_comes_back_to_an_epoch_goes_on_counting() {
        check(&[
            (0, 4, 0, false, 0),
            (0, 9, 0, false, 1),
            (0, 9, 1, false, 2),
            (0, 4, 1, false, 3),
            (0, 4, 2, false, 4),
        ]);
    }

    #[test]
    fn idle_deadlines_of_all_count() {
        check(&[
            (0, 1, 5, false, 5),
            (1, 1, 5, false, 5),
            (0, 1, 5, true, 6),
            (1, 1, 5, true, 6),
            (0, 1, 5, true, 7),
            (1, 1, 5, true, 7),
            (0, 1, 6, false, 8),
            (1, 1, 6, false, 8),
        ]);
    }

    #[test]
    fn idle_deadlines_of_one_do_not_move_the_others() {
        check(&[
            (0, 1, 5, false, 5),
            (1, 1, 5, false, 5),
            (0, 1, 5, true, 6),
            (1, 1, 6, false, 6),
            (0, 1, 5, true, 7),
            (1, 1, 7, false, 7),
            (0, 1, 8, false, 8),
        ]);
    }

    #[test]
    fn skipped_cycles_are_idle_deadlines_already() {
        check(&[(0, 1, 5, false, 5), (0, 1, 5, true, 6), (0, 1, 7, false, 7)]);
    }
}
