//! What a member reports, one JSON object a line.
//!
//! The cycle never waits for the journal: records go through a bounded queue to a thread of their own; what does not fit is
//! dropped, counted, and said in the journal as soon as it takes something again. When writing fails (a full disk, a reader that is gone)
//! the thread goes on taking records, and counts them as lost.

use std::borrow::Cow;
use std::io::{self, BufWriter, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

use serde::{Deserialize, Serialize};
use understudy_wire::{Member, Time};

use crate::anchor::Anchors;
use crate::clock::{Clock, wall_clock};
use crate::error::BusError;
use crate::host_event::HostEvent;
use crate::tally::Tally;

/// Version of the journal: what its records are called and hold. Journals of version 1 do not say theirs; version 3 packs closed segments and records the wall
/// clock; in version 4 the bits of the state of a ladder stand in another order.
pub const JOURNAL_VERSION: u32 = 4;

/// Records that wait to be written, at most: some seconds of a member at 10 ms.
pub const JOURNAL_RECORDS: usize = 4096;

/// Stack of the thread that writes. All of it is locked into memory.
const STACK_BYTES: usize = 256 * 1024;

/// One line of the journal.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Record<'name, E> {
    /// Nanoseconds of the host's CLOCK_MONOTONIC; comparable among the processes of one host.
    pub at_ns: u64,
    /// Who reports.
    pub member: Member,
    /// Its name in the cluster file.
    pub name: Cow<'name, str>,
    /// What happened.
    pub event: Noted<E>,
}

/// Something that a member reports, or the process that it runs in; told apart by the value of `event`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Noted<E> {
    /// By the process.
    Host(HostEvent),
    /// By the member.
    Member(E),
}

/// Takes what is reported; never blocks.
pub trait EventSink<E> {
    /// Takes one record.
    fn record(&mut self, now: Time, event: Noted<E>);
}

/// The cycle's end of the journal.
#[derive(Debug)]
pub struct JournalSender<E> {
    sender: SyncSender<(Time, Noted<E>)>,
    lost: Arc<AtomicU64>,
}

impl<E> Clone for JournalSender<E> {
    fn clone(&self) -> Self {
        Self { sender: self.sender.clone(), lost: Arc::clone(&self.lost) }
    }
}

impl<E> EventSink<E> for JournalSender<E> {
    fn record(&mut self, now: Time, event: Noted<E>) {
        // No record comes between a loss and the word about it: readers judge what is complete. Of two senders that find a loss at once
        // both report it.
        let lost = self.lost.load(Ordering::Relaxed);
        if lost > 0 {
            let note = Noted::Host(HostEvent::JournalLost { records: lost });
            if self.sender.try_send((now, note)).is_err() {
                self.lost.fetch_add(1, Ordering::Relaxed);
                return;
            }
            let less = |now: u64| Some(now.saturating_sub(lost));
            let _ = self.lost.fetch_update(Ordering::Relaxed, Ordering::Relaxed, less);
        }
        if self.sender.try_send((now, event)).is_err() {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// The thread that writes. It ends when all senders are gone.
#[derive(Debug)]
pub struct Journal {
    thread: JoinHandle<u64>,
}

impl Journal {
    /// Starts the thread; at most `bound` records wait.
    ///
    /// # Errors
    /// [`BusError::System`] where there is no thread to be had.
    pub fn start<E>(
        bound: usize,
        clock: Clock,
        member: Member,
        name: String,
        output: impl Write + Send + 'static,
    ) -> Result<(JournalSender<E>, Self), BusError>
    where
        E: Serialize + Send + 'static,
    {
        let (sender, receiver) = sync_channel(bound);
        let lost = Arc::new(AtomicU64::new(0));
        let left = Arc::clone(&lost);
        let thread = std::thread::Builder::new()
            .name("journal".into())
            .stack_size(STACK_BYTES)
            .spawn(move || {
                let mut output = BufWriter::new(output);
                let mut anchors = Anchors::default();
                let record = |at_ns, event| Record {
                    at_ns,
                    member,
                    name: Cow::Borrowed(name.as_str()),
                    event,
                };
                let anchor = || {
                    let (at_ns, unix_ns) = wall_clock()?;
                    let event = anchors.look(at_ns, unix_ns)?;
                    Some(record(at_ns, Noted::Host(event)))
                };
                let unwritten = write_all(
                    &receiver,
                    &mut output,
                    |(now, event)| record(clock.host_ns(now), event),
                    anchor,
                );
                unwritten + left.load(Ordering::Relaxed)
            })
            .map_err(|source| BusError::System { what: "a thread for the journal", source })?;
        Ok((JournalSender { sender, lost }, Self { thread }))
    }

    /// Waits until everything is written, and says how many records are lost without a word about it in the journal.
    pub fn finish(self) -> u64 {
        self.thread.join().unwrap_or(0)
    }
}

/// Writes until all senders are gone; the number of records that could not be written.
fn write_all<'name, E: Serialize + 'name>(
    receiver: &Receiver<(Time, Noted<E>)>,
    output: &mut impl Write,
    record: impl Fn((Time, Noted<E>)) -> Record<'name, E>,
    mut anchor: impl FnMut() -> Option<Record<'name, E>>,
) -> u64 {
    let mut tally = Tally::default();
    let mut is_first = true;
    while let Ok(first) = receiver.recv() {
        // Flushed when nothing waits: a reader sees each record at once, and a burst costs one write.
        let mut burst = std::iter::once(first).chain(receiver.try_iter()).map(&record);
        // The first record of a journal states its version; the wall clock comes before all others, so that they have a time of day.
        let version = if std::mem::take(&mut is_first) { burst.next() } else { None };
        for line in version.into_iter().chain(anchor()).chain(burst) {
            tally.count(write_line(output, &line));
        }
        tally.count(output.flush());
    }
    tally.unwritten
}

fn write_line<E: Serialize>(output: &mut impl Write, record: &Record<'_, E>) -> io::Result<()> {
    serde_json::to_writer(&mut *output, record)?;
    output.write_all(b"\n")
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;
    use std::sync::mpsc::channel;
    use std::time::Duration;

    use understudy_wire::{ProgramId, StationId};

    use super::*;
    use crate::host::Summary;
    use crate::link::LinkKind;
    use crate::rights::Rights;

    /// Writes only after it was let.
    struct Held {
        let_go: std::sync::mpsc::Receiver<()>,
        written: Arc<Mutex<Vec<u8>>>,
    }

    impl Write for Held {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let _ = self.let_go.recv();
            self.written.lock().expect("no panic").extend_from_slice(bytes);
            Ok(bytes.len())
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    /// What is written whole: a burst may fill the buffer in the middle of a line.
    fn events(written: &[u8]) -> Vec<Noted<u32>> {
        let whole = written.iter().rposition(|&byte| byte == b'\n');
        let whole = &written[..whole.map_or(0, |end| end + 1)];
        let lines = std::str::from_utf8(whole).expect("text").lines();
        lines
            .map(|line| serde_json::from_str::<Record<'_, u32>>(line).expect("a record").event)
            .collect()
    }

    #[test]
    fn a_journal_that_is_stuck_loses_records_and_says_how_many() {
        const RECORDS: u32 = 1000;
        let (let_go, held) = channel();
        let written = Arc::new(Mutex::new(Vec::new()));
        let output = Held { let_go: held, written: Arc::clone(&written) };
        let member = Member::Station(StationId(0));
        let (mut sender, journal) =
            Journal::start::<u32>(8, Clock::start(), member, "robot".into(), output)
                .expect("a thread");
        for number in 0..RECORDS {
            sender.record(Time(u64::from(number)), Noted::Member(number));
        }
        drop(let_go);
        // The thread takes records again from here on; whoever reports next says what was lost before.
        let mut number = RECORDS;
        let clock = Clock::start();
        while !events(&written.lock().expect("no panic"))
            .iter()
            .any(|event| matches!(event, Noted::Host(HostEvent::JournalLost { .. })))
        {
            assert!(clock.now() < Time(0) + Duration::from_secs(20), "nothing is said");
            sender.record(Time(0), Noted::Member(number));
            number += 1;
            std::thread::yield_now();
        }
        drop(sender);
        let unsaid = journal.finish();
        let events = events(&written.lock().expect("no panic"));
        let kept = events.iter().filter(|event| matches!(event, Noted::Member(_))).count() as u64;
        let lost: u64 = events
            .iter()
            .map(|event| match event {
                Noted::Host(HostEvent::JournalLost { records }) => *records,
                _ => 0,
            })
            .sum();
        // Wherever numbers are missing, the journal says so before it goes on.
        let (mut next, mut said) = (0, 0);
        for event in &events {
            match event {
                Noted::Member(number) => {
                    assert_eq!(u64::from(number - next), said, "before {number}");
                    (next, said) = (number + 1, 0);
                }
                Noted::Host(HostEvent::JournalLost { records }) => said += records,
                Noted::Host(_) => {}
            }
        }
        // A thread that began late may have said the first of them before it was held.
        let in_all = lost + unsaid;
        assert!(in_all >= u64::from(RECORDS) - 8 - 1 - BURST, "{in_all} of {number}");
        assert_eq!(kept + lost + unsaid, u64::from(number));
    }

    /// What the thread may have taken into its own buffer before the first write was held: 8 KiB of lines.
    const BURST: u64 = 8192 / 60;

    #[test]
    fn a_line_is_what_a_reader_of_journals_expects() {
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        #[serde(tag = "event", rename_all = "kebab-case")]
        enum Event {
            BecameCycleMaster { cycle: u64 },
        }
        let record = |event| Record {
            at_ns: 12,
            member: Member::RemoteIo(ProgramId(1)),
            name: "press-io".into(),
            event,
        };
        let records = [
            record(Noted::Host(HostEvent::Ready {
                version: JOURNAL_VERSION,
                process: 4711,
                address: ([127, 0, 0, 1], 7450).into(),
                link: LinkKind::Zenoh,
                rights: Rights {
                    real_time: true,
                    locked_memory: true,
                    core: None,
                    lacking: Vec::new(),
                },
            })),
            record(Noted::Member(Event::BecameCycleMaster { cycle: 3 })),
            record(Noted::Host(HostEvent::JournalLost { records: 5 })),
            record(Noted::Host(HostEvent::Stopped(Summary::default()))),
        ];
        let mut text = Vec::new();
        for record in &records {
            write_line(&mut text, record).expect("it is memory");
        }
        let text = String::from_utf8(text).expect("JSON is text");
        insta::assert_snapshot!(text);
        for (line, record) in text.lines().zip(&records) {
            let read: Record<'_, Event> = serde_json::from_str(line).expect("it was written");
            assert_eq!(read, *record);
        }
    }

    #[test]
    fn a_disk_that_is_full_stops_the_journal_and_not_its_senders() {
        struct Full;
        impl Write for Full {
            fn write(&mut self, _: &[u8]) -> io::Result<usize> {
                Err(io::ErrorKind::StorageFull.into())
            }
            fn flush(&mut self) -> io::Result<()> {
                Err(io::ErrorKind::StorageFull.into())
            }
        }
        let member = Member::Station(StationId(0));
        let (mut sender, journal) =
            Journal::start::<u32>(8, Clock::start(), member, "robot".into(), Full)
                .expect("a thread");
        for number in 0..1000 {
            sender.record(Time(0), Noted::Member(number));
        }
        drop(sender);
        assert!(journal.finish() > 0);
    }
}
