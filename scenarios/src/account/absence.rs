//! Remote I/Os that pass no deadlines, and why: cycles are counted by their deadlines, so a run ends where none of them passes any.

use std::collections::BTreeMap;

use understudy_journal::{Happening, Members, Process, Record, RunEvent};
use understudy_remote_io::Event as RemoteIoEvent;
use understudy_wire::Member;

/// Why each of them passes no deadlines.
#[derive(Debug, Clone, Default)]
pub(super) struct Absences(BTreeMap<Member, &'static str>);

impl Absences {
    /// Takes the next record.
    pub(super) fn note(&mut self, record: &Record) {
        let (member, reason) = match (&record.event, record.member) {
            (Happening::Run(RunEvent::Fault { action, member, .. }), _) => {
                let Some(process) = Process::after(*action) else { return };
                (*member, process.absence())
            }
            (Happening::Run(RunEvent::Ended { member, .. }), _) => {
                (*member, Process::Ended.absence())
            }
            (Happening::Run(RunEvent::Started { member }), _) => (*member, None),
            (Happening::RemoteIo(event), Some(member)) => match event {
                RemoteIoEvent::StateLost { asks: true, .. } => {
                    (member, Some("asks the operator which state its program continues from"))
                }
                RemoteIoEvent::Applied { .. } => (member, None),
                _ => return,
            },
            _ => return,
        };
        match reason.filter(|_| member.sampled_program().is_some()) {
            Some(reason) => self.0.insert(member, reason),
            None => self.0.remove(&member),
        };
    }

    /// In words; nothing where all of them pass deadlines, as far as is known.
    pub(super) fn text(&self, members: &Members) -> Option<String> {
        let each = self.0.iter().map(|(member, why)| format!("{} {why}", members.name(*member)));
        let each: Vec<String> = each.collect();
        (!each.is_empty()).then(|| each.join(", "))
    }
}
