//! Records passed on within one process. The sender never waits.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::Instant;

use understudy_journal::Record;

use super::Trouble;
use super::progress::Progress;

/// Records taken in one go, at most.
const AT_ONCE: usize = 4096;

/// The end that is given records.
#[derive(Debug, Clone)]
pub struct Feed {
    sender: SyncSender<Record>,
    lost: Arc<AtomicU64>,
}

impl Feed {
    /// Passes a record on; one that does not fit is lost, and the loss is reported. False after the end of the reader.
    pub fn give(&self, record: Record) -> bool {
        match self.sender.try_send(record) {
            Ok(()) => true,
            Err(std::sync::mpsc::TrySendError::Full(_)) => {
                self.lost.fetch_add(1, Ordering::Relaxed);
                true
            }
            Err(std::sync::mpsc::TrySendError::Disconnected(_)) => false,
        }
    }
}

#[derive(Debug)]
pub(super) struct Channel {
    receiver: Receiver<Record>,
    lost: Arc<AtomicU64>,
    read: u64,
    progress: Progress,
}

pub(super) fn bounded(most: usize) -> (Feed, Channel) {
    let (sender, receiver) = sync_channel(most.max(1));
    let lost = Arc::new(AtomicU64::new(0));
    let feed = Feed { sender, lost: Arc::clone(&lost) };
    let channel = Channel { receiver, lost, read: 0, progress: Progress::default() };
    (feed, channel)
}

impl Channel {
    pub(super) fn progress(&self) -> Progress {
        self.progress
    }

    #[allow(
        clippy::disallowed_methods,
        reason = "whether the channel was emptied lately is a matter of the clock"
    )]
    pub(super) fn poll(&mut self, take: &mut dyn FnMut(Result<Record, Trouble>)) -> usize {
        let began = Instant::now();
        let (mut taken, mut reports) = (0, false);
        for record in self.receiver.try_iter().take(AT_ONCE) {
            reports |= record.member.is_some();
            take(Ok(record));
            taken += 1;
        }
        self.read += taken as u64;
        // How many wait is not known.
        self.progress.polled(began, self.read, u64::from(taken == AT_ONCE));
        if reports {
            self.progress.reported = Some(began);
        }
        match self.lost.swap(0, Ordering::Relaxed) {
            0 => taken,
            lost => {
                take(Err(Trouble::Gone { count: Some(lost) }));
                taken + 1
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use understudy_journal::RunEvent;

    use super::*;

    #[test]
    fn what_does_not_fit_is_counted() {
        let (feed, mut channel) = bounded(3);
        for at_ns in 0..5 {
            assert!(feed.give(Record::of_run(at_ns, RunEvent::Finished)));
        }
        let mut found = Vec::new();
        assert_eq!(channel.poll(&mut |record| found.push(record)), 4);
        assert_eq!(found[3], Err(Trouble::Gone { count: Some(2) }));
        assert_eq!(channel.poll(&mut |_| ()), 0);
        drop(channel);
        assert!(!feed.give(Record::of_run(5, RunEvent::Finished)));
    }
}
