//! Samples that do not count: those that become void, and those of a program that a fault has stopped.

use understudy_cycle::{OperatorInput, OperatorInputKind};
use understudy_wire::{Moment, WriteId, WriteRefusal};

use super::sessions::Progress;
use super::{WithoutEffect, Writing};

impl Writing {
    /// The samples of `lost` writes are no longer part of the history: values that hold are sampled again. Answers with the writes that have no
    /// effect.
    pub(in crate::remote_io) fn lose(
        &mut self,
        inputs: &[OperatorInput],
        moment: Moment,
        lost: impl Fn(WriteId) -> bool,
    ) -> WithoutEffect {
        let mut void = WithoutEffect::new();
        for session in self.sessions.iter_mut() {
            if !matches!(session.progress, Progress::Sampled { .. }) || !lost(session.id) {
                continue;
            }
            session.progress = Progress::Taken;
            let Some(at) = session.input else {
                if session.is_orphaned {
                    void.push((session.id, WriteRefusal::Void));
                }
                continue;
            };
            let written = &mut self.values[at];
            if written.by == session.id && !written.is_over(&inputs[at]) {
                written.is_sampled = false;
            } else {
                void.push((session.id, WriteRefusal::Void));
            }
        }
        self.sessions.drop_void(&void, moment);
        void
    }

    /// A fault has stopped the program in the scan of the sample of `moment`, or before: no output will be computed with the values of this scan. A value that
    /// holds is one of the next sample first. A pulse that waits does not begin: the FALSE before it may be of this scan. Answers with the writes that
    /// have no effect.
    pub(in crate::remote_io) fn not_executed(
        &mut self,
        inputs: &[OperatorInput],
        moment: Moment,
    ) -> WithoutEffect {
        let mut void = WithoutEffect::new();
        for session in self.sessions.iter_mut() {
            let Some(at) = session.input else {
                continue;
            };
            let written = &mut self.values[at];
            let is_void = match session.progress {
                Progress::Sampled { first, .. } if first == moment => {
                    session.progress = Progress::Taken;
                    written.by != session.id || written.is_over(&inputs[at])
                }
                Progress::Taken if matches!(inputs[at].kind, OperatorInputKind::Pulse(_)) => {
                    (written.stored, written.left, written.is_sampled) = (0, 0, true);
                    true
                }
                _ => false,
            };
            if is_void {
                void.push((session.id, WriteRefusal::Void));
            }
        }
        self.sessions.drop_void(&void, moment);
        void
    }
}
