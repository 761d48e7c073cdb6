//! Whether modules drive what an author has driven lately: from the writes that the devices have recorded, and the outputs that authors have recorded.
//!
//! Both have times of the one monotonic clock of the host. An actuator gets the outputs of both modules through diodes, so where each write is proved,
//! what it gets is outputs of the program or 0.

use std::collections::VecDeque;

/// Outputs at a time, as coils.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Outputs {
    pub(super) at_ns: u64,
    pub(super) coils: u64,
}

/// A write that a device has received.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Write {
    pub(super) at_ns: u64,
    /// From when on it may have been received: before that time, where its connection ended unread.
    pub(super) since_ns: u64,
    /// Its coils after it.
    pub(super) coils: u64,
}

/// What may be driven, in ns.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rule {
    /// How old the outputs of an author may be, at most.
    pub(super) oldest: u64,
    /// How long a write may be unread, at most.
    pub(super) unread: u64,
    /// How much later than the write an author may record them.
    pub(super) recorded_after: u64,
    /// How long around the end of a process its last records may be missing.
    pub(super) unrecorded: u64,
}

/// Writes that no record explains.
#[derive(Debug, Default, Clone, PartialEq, Eq)]
pub(super) struct Found {
    /// When they were received.
    pub(super) unproved: Vec<u64>,
    /// Those after the end of a process that may have driven them and has not recorded it.
    pub(super) unrecorded: u64,
}

/// Checks the writes of one device. All rows are in the order of their times.
pub(super) fn judge(writes: &[Write], driven: &[Outputs], ends: &[u64], rule: Rule) -> Found {
    let mut found = Found::default();
    let mut next = driven.iter().peekable();
    let mut recent: VecDeque<&Outputs> = VecDeque::new();
    for write in writes {
        let newest = write.at_ns.saturating_add(rule.recorded_after);
        while let Some(it) = next.next_if(|it| it.at_ns <= newest) {
            recent.push_back(it);
        }
        let kept = rule.oldest + rule.unread;
        while recent.front().is_some_and(|it| it.at_ns.saturating_add(kept) < write.at_ns) {
            recent.pop_front();
        }
        let is_recent = |it: &&Outputs| it.at_ns.saturating_add(rule.oldest) >= write.since_ns;
        let mut lately = recent.iter().copied().filter(is_recent);
        if write.coils == 0 || lately.any(|it| it.coils == write.coils) {
            continue;
        }
        let may_be_lost = |end: &u64| {
            let lasts = rule.unrecorded + rule.oldest;
            write.at_ns.saturating_add(rule.unrecorded) >= *end
                && write.at_ns <= end.saturating_add(lasts)
        };
        if ends.iter().any(may_be_lost) {
            found.unrecorded += 1;
        } else {
            found.unproved.push(write.at_ns);
        }
    }
    found
}

/// Longest time without a write to any of these devices, in ns.
pub(super) fn longest_gap(devices: &[&[Write]]) -> u64 {
    let mut times: Vec<u64> =
        devices.iter().flat_map(|writes| writes.iter().map(|write| write.at_ns)).collect();
    times.sort_unstable();
    times.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const RULE: Rule = Rule { oldest: 60, unread: 100, recorded_after: 10, unrecorded: 30 };

    fn row(of: &[(u64, u64)]) -> Vec<Outputs> {
        of.iter().map(|&(at_ns, coils)| Outputs { at_ns, coils }).collect()
    }

    fn written(of: &[(u64, u64)]) -> Vec<Write> {
        of.iter().map(|&(at_ns, coils)| Write { at_ns, since_ns: at_ns, coils }).collect()
    }

    /// An author drives 1 and, from 100 on, 2.
    #[test]
    fn a_module_drives_what_an_author_has_driven_lately_or_nothing() {
        let driven: Vec<(u64, u64)> =
            (0..20).map(|cycle| (cycle * 10, if cycle < 10 { 1 } else { 2 })).collect();
        let driven = row(&driven);
        let check = |writes: &[(u64, u64)], ends: &[u64], unproved: &[u64], unrecorded: u64| {
            let found = judge(&written(writes), &driven, ends, RULE);
            let unproved = unproved.to_vec();
            assert_eq!(found, Found { unproved, unrecorded }, "{writes:?}");
        };
        check(&[(12, 1), (95, 2), (101, 2), (150, 1), (160, 0), (190, 2)], &[], &[], 0);
        // The last 1 was driven at 90; nothing has driven 3.
        check(&[(151, 1)], &[], &[151], 0);
        check(&[(80, 2)], &[], &[80], 0);
        check(&[(50, 3), (52, 0)], &[], &[50], 0);
        // One that was unread when its connection ended may be as old as that.
        for (since_ns, unproved) in [(150, vec![]), (151, vec![240])] {
            let found = judge(&[Write { at_ns: 240, since_ns, coils: 1 }], &driven, &[], RULE);
            assert_eq!(found.unproved, unproved);
        }
        // The author ends at 200, and what it has driven last may not be recorded.
        check(&[(195, 3), (230, 3), (291, 3)], &[200], &[291], 2);
    }

    #[test]
    fn one_module_alone_leaves_no_gap() {
        let first = written(&[(0, 1), (10, 1), (20, 1)]);
        let twin = written(&[(5, 1), (30, 1), (70, 1)]);
        assert_eq!(longest_gap(&[&first, &twin]), 40);
        assert_eq!(longest_gap(&[&first]), 10);
    }
}
