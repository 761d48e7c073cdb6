//! How long a remote I/O takes from its samples to its outputs, and how late it is woken: the one is not read without the other.

use std::time::Duration;

use understudy_wire::Time;

use crate::distribution::Distribution;
use crate::host_event::HostEvent;

/// Time from one record to the next.
const REPORTED_EVERY: Duration = Duration::from_secs(10);

/// Since the start of the process, in memory that does not grow.
#[derive(Debug, Default)]
pub(crate) struct Timing {
    sample_to_output: Distribution,
    wakeups: Distribution,
    reported: Time,
    /// Outputs in the last record.
    reported_count: u64,
}

impl Timing {
    /// It was woken so long after the time that it had asked for.
    pub(crate) fn woken(&mut self, late: Duration) {
        self.wakeups.note(late);
    }

    /// By `now` the field has the outputs that are proved for the sample of `sampled`.
    pub(crate) fn driven(&mut self, sampled: Time, now: Time) {
        self.sample_to_output.note(now.since(sampled));
    }

    /// What is to be said at `now`, where that is new: every ten seconds, and the last time.
    pub(crate) fn record(&mut self, now: Time, is_last: bool) -> Option<HostEvent> {
        let is_due = is_last || now.since(self.reported) >= REPORTED_EVERY;
        let count = self.sample_to_output.count();
        if !is_due || count == self.reported_count {
            return None;
        }
        (self.reported, self.reported_count) = (now, count);
        Some(HostEvent::Timed {
            sample_to_output: self.sample_to_output.quantiles(),
            wakeups: self.wakeups.quantiles(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_comes_every_ten_seconds_and_at_the_end_where_outputs_were_driven() {
        let second = |number: u64| Time(number * 1_000_000_000);
        let mut timing = Timing::default();
        timing.woken(Duration::from_micros(50));
        assert_eq!(timing.record(second(11), true), None);
        for count in 1..=2 {
            timing.driven(Time(1_000), Time(4_000));
            let record = timing.record(second(count * 11), false);
            let Some(HostEvent::Timed { sample_to_output, wakeups }) = record else {
                panic!("no record");
            };
            assert_eq!((sample_to_output.count, sample_to_output.maximum_ns), (count, 3_000));
            assert_eq!((wakeups.count, wakeups.maximum_ns), (1, 50_000));
            assert_eq!(timing.record(second(count * 11 + 10), false), None);
        }
        timing.driven(Time(1_000), Time(4_000));
        assert_eq!(timing.record(second(31), false), None);
        assert!(timing.record(second(31), true).is_some());
        assert_eq!(timing.record(second(32), true), None);
    }
}
