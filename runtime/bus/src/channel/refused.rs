//! What a channel refuses, or is told that it was refused, on its way to the journal.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};

use understudy_wire::{ChangeRequest, Time};
use zenoh::query::Queryable;

use super::{Channel, DONE, REFUSED_KEY, answer};
use crate::host_event::HostEvent;
use crate::journal::{EventSink, Noted};
use crate::refused_certificates::{self, RefusedCertificates};
use crate::refused_orders::{RefusedOrder, RefusedOrders};

/// Bytes of a refused order; one of bounded texts has less.
const REFUSED_ORDER_BYTES: usize = 4096;

/// Refused orders that wait to be recorded: more than come in a second.
const WAITING_REFUSALS: usize = 16;

/// Refused orders on their way to the journal.
pub(super) struct RefusedReports {
    bound: Arc<RefusedOrders>,
    sender: SyncSender<RefusedOrder>,
    receiver: Receiver<RefusedOrder>,
}

impl Default for RefusedReports {
    fn default() -> Self {
        let (sender, receiver) = sync_channel(WAITING_REFUSALS);
        Self { bound: Arc::default(), sender, receiver }
    }
}

impl<E: Send + 'static> Channel<E> {
    /// Records orders and certificates that were refused, and the moment from which its own does not count by the clock of this machine.
    pub(super) fn note_refused(&mut self, now: Time, is_valid: &mut bool) {
        while let Ok(order) = self.refused.receiver.try_recv() {
            self.sink.record(now, Noted::Host(HostEvent::OrderRefused(order)));
        }
        if let Some(RefusedCertificates { connections, reason }) = refused_certificates::take() {
            let event = HostEvent::RefusedCertificates { connections, reason };
            self.sink.record(now, Noted::Host(event));
        }
        let invalid = self.settings.keys.validity.reason();
        let was_valid = std::mem::replace(is_valid, invalid.is_none());
        if let Some(reason) = invalid.filter(|_| was_valid) {
            self.sink.record(now, Noted::Host(HostEvent::ChannelFailed { reason }));
        }
    }

    /// Takes the texts of an online change, or a step of it; which, `what` says. Each is recorded with its answer.
    pub(super) fn answer_changes(
        &self,
        session: &zenoh::Session,
        what: &'static str,
    ) -> zenoh::Result<Queryable<()>> {
        let (control, changes) = (self.control.clone(), self.settings.changes.clone());
        let (mut sink, clock) = (self.sink.clone(), self.clock);
        let sink = std::sync::Mutex::new(move |event| sink.record(clock.now(), Noted::Host(event)));
        let key = format!("{}/command/{what}", self.prefix);
        answer(session, key, move |query| {
            let bytes = query.payload().map(|payload| payload.to_bytes()).unwrap_or_default();
            let text = String::from_utf8_lossy(&bytes);
            let (step, said) = match what {
                "prepare" => {
                    ("to load an online change".to_owned(), changes.prepare(&control, &text))
                }
                _ => match serde_json::from_str::<ChangeRequest>(&text) {
                    // The files of this machine are no affair of a caller.
                    Err(_) | Ok(ChangeRequest::Prepare { .. }) => return "invalid step".to_owned(),
                    Ok(request) => (request.words(), changes.take(&control, &request)),
                },
            };
            if let Ok(mut record) = sink.lock() {
                let refused = (said != DONE).then(|| said.clone());
                record(HostEvent::ChangeOrdered { step, refused });
            }
            said
        })
    }

    /// Records orders that were refused before they were sent.
    pub(super) fn answer_refused(&self, session: &zenoh::Session) -> zenoh::Result<Queryable<()>> {
        let (bound, sender) = (Arc::clone(&self.refused.bound), self.refused.sender.clone());
        answer(session, format!("{}/{REFUSED_KEY}", self.prefix), move |query| {
            let bytes = query.payload().map(|payload| payload.to_bytes()).unwrap_or_default();
            let order = match bytes.len() {
                ..=REFUSED_ORDER_BYTES => serde_json::from_slice(&bytes).ok(),
                _ => None,
            };
            let Some(order) = order else {
                return "invalid refused order".to_owned();
            };
            if let Some(order) = bound.admit(order)
                && let Err(TrySendError::Full(order)) = sender.try_send(order)
            {
                bound.count(order);
            }
            DONE.to_owned()
        })
    }
}
