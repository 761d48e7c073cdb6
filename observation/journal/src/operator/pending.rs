//! Orders that were sent to a remote I/O over a way without an answer, until its journal has their outcome.

use understudy_remote_io::Event as RemoteIoEvent;
use understudy_wire::{Member, OrderRefusal, StateChoice, WriteAnswer, WriteOutcome, WriteRefusal};

use super::{Command, Commanded, Done, OperatorAction, Refusal};
use crate::record::{Happening, Record, RunEvent};

/// Orders that were sent to their remote I/Os, until their outcomes are in the journal.
#[derive(Debug, Default)]
pub struct PendingOrders(Vec<Commanded>);

impl PendingOrders {
    /// Waits for the outcome of an order.
    pub fn add(&mut self, commanded: Commanded) {
        // Callers that have given up do not come back.
        self.0.retain(|waiting| !waiting.answer.is_closed());
        self.0.push(commanded);
    }

    /// Answers the callers whose orders are decided by a record. Of equal orders the oldest is meant: a remote I/O takes them in their order.
    pub fn observe(&mut self, record: &Record) {
        if self.0.is_empty() {
            return;
        }
        let mut is_taken = false;
        for commanded in std::mem::take(&mut self.0) {
            let outcome = match &commanded.action {
                OperatorAction::Command { member, command, .. } => {
                    outcome(*member, command, record, is_taken)
                }
                _ => None,
            };
            match outcome {
                Some(done) => {
                    // Every attempt at a write is answered, and one of other orders.
                    is_taken = true;
                    commanded.answer(done);
                }
                None => self.0.push(commanded),
            }
        }
    }
}

/// What a record says of an order to a member; a record that was `taken` by another order says nothing of a further one, unless it is of a write.
fn outcome(
    member: Member,
    command: &Command,
    record: &Record,
    taken: bool,
) -> Option<Result<Done, Refusal>> {
    let event = match &record.event {
        Happening::Run(RunEvent::Ended { member: ended, .. }) if *ended == member => {
            return (!matches!(command, Command::Write(_)))
                .then(|| Err(Refusal::Down(record.name.clone())));
        }
        Happening::RemoteIo(event) => event,
        _ => return None,
    };
    if let Command::Write(write) = command {
        let answer = write_answer(record).filter(|answer| answer.id == write.id)?;
        return Some(Done::of_write(answer.outcome));
    }
    if record.member != Some(member) || taken {
        return None;
    }
    let refused = |refusal: OrderRefusal| Some(Err(Refusal::Order(refusal)));
    match (command, event) {
        (Command::Force(force), RemoteIoEvent::Forced { force: done, .. }) if force == done => {
            Some(Ok(Done::default()))
        }
        (Command::Force(force), RemoteIoEvent::ForceRefused { force: other, refusal, .. })
            if force == other =>
        {
            refused(*refusal)
        }
        (Command::Unforce { signal }, RemoteIoEvent::Unforced { signal: done, .. })
            if signal == done =>
        {
            Some(Ok(Done::default()))
        }
        (
            Command::Unforce { signal },
            RemoteIoEvent::UnforceRefused { signal: other, refusal, .. },
        ) if signal == other => refused(*refusal),
        (Command::Choose { choice: StateChoice::Cold }, RemoteIoEvent::StartedCold { .. })
        | (
            Command::Choose { choice: StateChoice::Newest { .. } },
            RemoteIoEvent::AdoptedLineage { .. },
        ) => Some(Ok(Done::default())),
        (Command::Choose { .. }, RemoteIoEvent::ChoiceRefused { newest, .. }) => {
            refused(OrderRefusal::of_choice(*newest))
        }
        _ => None,
    }
}

/// The outcome of a write that a record tells.
pub fn write_answer(record: &Record) -> Option<WriteAnswer> {
    let Happening::RemoteIo(event) = &record.event else {
        return None;
    };
    let refused = |refusal: WriteRefusal| WriteOutcome::Refused { refusal };
    let (id, outcome) = match event {
        RemoteIoEvent::WriteInEffect { id, since, .. } => {
            (*id, WriteOutcome::InEffect { since: *since })
        }
        RemoteIoEvent::WriteRefused { write, refusal, .. } => (write.id, refused(*refusal)),
        RemoteIoEvent::WriteVoid { id, refusal, .. } => (*id, refused(*refusal)),
        _ => return None,
    };
    Some(WriteAnswer { id, outcome })
}
