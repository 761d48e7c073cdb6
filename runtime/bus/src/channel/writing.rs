//! Writes of operators.

use understudy_wire::{Role, Write, WriteAnswer, WriteOutcome, WriteRefusal};
use zenoh::Wait;
use zenoh::query::{Query, Queryable};

use super::{Channel, of_configuration, with_value};
use crate::orders::Order;
use crate::writes;

impl<E> Channel<E> {
    /// Takes writes under the key of a role; the answer follows when the member knows the outcome.
    pub(super) fn answer_writes(
        &self,
        session: &zenoh::Session,
        role: Role,
        key: &str,
    ) -> zenoh::Result<Queryable<()>> {
        let key = format!("{}/{key}", self.prefix);
        let (control, callers, clock) = (self.control.clone(), self.callers.clone(), self.clock);
        let changes = self.settings.changes.clone();
        let declared = key.clone();
        session
            .declare_queryable(declared)
            .callback(move |query: Query| {
                let order =
                    of_configuration(&query, &changes).and_then(|()| with_value("write", &query));
                let refused = match order {
                    Ok(Order::Write(write)) => {
                        let write = Write { role, ..write };
                        let id = write.id;
                        if callers.wait(&write, &query, &key, clock.now()) {
                            if control.give(Order::Write(write)) {
                                return;
                            }
                            callers.forget(id);
                        }
                        let refusal = WriteRefusal::Busy;
                        let outcome = WriteOutcome::Refused { refusal };
                        writes::text(&WriteAnswer { id, outcome })
                    }
                    Ok(_) => return,
                    Err(reason) => reason,
                };
                if let Err(error) = query.reply(key.clone(), refused).wait() {
                    tracing::debug!(%error, "an answer was not sent");
                }
            })
            .wait()
    }
}
