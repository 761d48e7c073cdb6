//! What was in effect when a member was attached: the journal of the run gets it once, after each time that the member was attached.

use std::collections::BTreeMap;

use understudy_journal::{Record, RecordsInEffect};
use understudy_wire::Member;

#[derive(Default)]
pub(crate) struct InEffect {
    /// What the journal of the run says.
    known: RecordsInEffect,
    /// Members of which no repetition was taken since they were attached, with the records of the one that is coming.
    awaited: BTreeMap<Member, Vec<Record>>,
}

impl InEffect {
    /// A record was written.
    pub(crate) fn note(&mut self, record: &Record) {
        self.known.note(record);
    }

    pub(crate) fn attached(&mut self, member: Member) {
        self.awaited.insert(member, Vec::new());
    }

    /// Takes a line of a repetition of a member: a record, or the end of the repetition. The answer is what the journal lacks at the end of the
    /// first whole repetition of a member: all of it, where the journal does not say the same. Its first record says that the process began, so
    /// what the journal said of the member before is void.
    ///
    /// Nothing is taken while `is_counted` is false: the cycles of the records are not known yet, and the repetition would be old when they are.
    pub(crate) fn repeated(
        &mut self,
        member: Member,
        record: Option<Record>,
        is_counted: bool,
    ) -> Vec<Record> {
        let Some(records) = self.awaited.get_mut(&member) else {
            return Vec::new();
        };
        match record {
            Some(record) if record.member == Some(member) => records.push(record),
            Some(_) => {}
            None if !is_counted || records.is_empty() => records.clear(),
            None => {
                let records = self.awaited.remove(&member).unwrap_or_default();
                let known = self.known.records().filter(|record| record.member == Some(member));
                if !known.eq(&records) {
                    return records;
                }
            }
        }
        Vec::new()
    }
}

#[cfg(test)]
mod tests {
    use understudy_bus::HostEvent;
    use understudy_journal::Happening;
    use understudy_remote_io::Event as RemoteIo;
    use understudy_wire::{Cycle, Epoch, Moment, ProgramId};

    use super::*;

    const MEMBER: Member = Member::RemoteIo(ProgramId(0));

    fn record(at_ns: u64, event: Happening) -> Record {
        Record { at_ns, name: "robot-io".to_owned(), member: Some(MEMBER), event }
    }

    fn protected(cycle: u64) -> Record {
        let moment = Moment { epoch: Epoch(1), cycle: Cycle(cycle) };
        record(cycle, Happening::RemoteIo(RemoteIo::Protected { moment }))
    }

    fn repeat(in_effect: &mut InEffect, records: &[Record], is_counted: bool) -> Vec<Record> {
        let lines = records.iter().cloned().map(Some).chain([None]);
        lines.flat_map(|line| in_effect.repeated(MEMBER, line, is_counted)).collect()
    }

    #[test]
    fn what_was_in_effect_is_written_once_for_each_attachment() {
        let lost = record(3, Happening::Host(HostEvent::FieldLost { reason: String::new() }));
        let all = [lost.clone(), protected(7)];
        let mut in_effect = InEffect::default();
        assert_eq!(repeat(&mut in_effect, &all, true), [], "it is not attached");
        in_effect.attached(MEMBER);
        assert_eq!(in_effect.repeated(MEMBER, None, true), [], "it has nothing");
        assert_eq!(repeat(&mut in_effect, &all, false), [], "no cycle is counted yet");
        // The cycles become known between its lines: all of them are taken.
        assert_eq!(in_effect.repeated(MEMBER, Some(lost), false), []);
        assert_eq!(in_effect.repeated(MEMBER, Some(protected(7)), true), []);
        let unknown = in_effect.repeated(MEMBER, None, true);
        assert_eq!(unknown, all);
        unknown.iter().for_each(|record| in_effect.note(record));
        assert_eq!(repeat(&mut in_effect, &all, true), [], "it was written");
        // Attached again: what is known is not written again, and what has changed meanwhile is.
        in_effect.attached(MEMBER);
        assert_eq!(repeat(&mut in_effect, &all, true), []);
        in_effect.attached(MEMBER);
        assert_eq!(repeat(&mut in_effect, &[protected(9)], true), [protected(9)]);
        assert_eq!(repeat(&mut in_effect, &[protected(10)], true), [], "once");
    }
}
