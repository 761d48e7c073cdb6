//! Orders that were sent to a remote I/O over a way without an answer, until its journal has their outcome.

use understudy_bus::HostEvent;
use understudy_remote_io::Event as RemoteIoEvent;
use understudy_simulator::Action;
use understudy_wire::{
    ChangeRequest, Member, OrderRefusal, StateChoice, Unforce, WriteAnswer, WriteOutcome,
    WriteRefusal,
};

use super::{Command, Commanded, Done, OperatorAction, Refusal};
use crate::record::{Happening, Record, RunEvent};

/// Orders that were sent to their remote I/Os, until their outcomes are in the journal.
#[derive(Debug, Default)]
pub struct PendingOrders(Vec<Pending>);

#[derive(Debug)]
struct Pending {
    commanded: Commanded,
    /// Name of the remote I/O.
    name: String,
    /// Its deadlines since the order was sent.
    deadlines: u8,
}

/// A release that has nothing to release has no record: it was taken once this number of deadlines is over.
const RELEASED_AFTER: u8 = 5;

impl PendingOrders {
    /// Waits for the outcome of an order to the remote I/O `name`.
    pub fn add(&mut self, commanded: Commanded, name: String) {
        // Callers that have given up do not come back, and their writes are in the journal.
        self.0.retain(|Pending { commanded, .. }| {
            !commanded.answer.is_closed() || !commanded.is_write()
        });
        self.0.push(Pending { commanded, name, deadlines: 0 });
    }

    /// The orders that are decided by a record, with their outcomes. Of equal orders the oldest is meant: a remote I/O takes them in their order,
    /// and one that has ended decides none of those before, which are refused.
    pub fn observe(&mut self, record: &Record) -> Vec<DecidedOrder> {
        let mut decided = Vec::new();
        if self.0.is_empty() {
            return decided;
        }
        let mut is_taken = false;
        for mut pending in std::mem::take(&mut self.0) {
            let is_deadline = is_deadline(record, &pending.commanded.action);
            pending.deadlines = pending.deadlines.saturating_add(u8::from(is_deadline));
            let outcome = match &pending.commanded.action {
                OperatorAction::Command { member, command, .. } => {
                    if ends_life(record, *member) && !pending.commanded.is_write() {
                        Some(Err(Refusal::Down(pending.name.clone())))
                    } else {
                        let is_over = pending.deadlines >= RELEASED_AFTER;
                        let is_released = matches!(command, Command::Release) && is_over;
                        let outcome = outcome(*member, command, record, is_taken);
                        outcome.or(is_released.then(|| Ok(Done::default())))
                    }
                }
                _ => None,
            };
            match outcome {
                Some(done) => {
                    // Every attempt at a write is answered, and one of other orders.
                    is_taken = true;
                    decided.push(DecidedOrder { commanded: pending.commanded, done });
                }
                None => self.0.push(pending),
            }
        }
        decided
    }
}

/// The code of a step that was done and is not on the disk of the member.
const NOT_KEPT: &str = "U0633";

/// An order whose outcome is known.
#[derive(Debug)]
pub struct DecidedOrder {
    commanded: Commanded,
    done: Result<Done, Refusal>,
}

impl DecidedOrder {
    /// The step of an online change that it was, where that was done; also where the member does not keep it over its end (U0633).
    pub fn change(&self) -> Option<&ChangeRequest> {
        match &self.commanded.action {
            OperatorAction::Command { command: Command::Change { request }, .. } => {
                let is_done = |refusal: &Refusal| refusal.to_string().contains(NOT_KEPT);
                self.done.as_ref().err().is_none_or(is_done).then_some(request)
            }
            _ => None,
        }
    }

    /// Its record, which says why it was refused; nothing for a write, which is recorded when it is sent.
    pub fn record(&self) -> Option<RunEvent> {
        if self.commanded.is_write() {
            return None;
        }
        self.commanded.action.commanded(self.done.as_ref().err())
    }

    /// Answers its caller.
    pub fn answer(self) {
        self.commanded.answer(self.done);
    }
}

/// Whether a record is of a deadline of the remote I/O of an order.
fn is_deadline(record: &Record, order: &OperatorAction) -> bool {
    let is_applied = matches!(record.event, Happening::RemoteIo(RemoteIoEvent::Applied { .. }));
    let OperatorAction::Command { member, .. } = order else {
        return false;
    };
    is_applied && record.member == Some(*member)
}

/// Whether the process of a member has ended by a record: it was killed, or ended by itself, or another one has its place.
fn ends_life(record: &Record, of: Member) -> bool {
    match &record.event {
        Happening::Run(
            RunEvent::Ended { member, .. }
            | RunEvent::Started { member }
            | RunEvent::Fault { action: Action::Crash, member, .. },
        ) => *member == of,
        _ => false,
    }
}

/// What a record says of an order to a member; a record that was `taken` by another order says nothing of a further one, unless it is of a write.
fn outcome(
    member: Member,
    command: &Command,
    record: &Record,
    taken: bool,
) -> Option<Result<Done, Refusal>> {
    if let (
        Command::Change { request },
        Happening::Host(HostEvent::ChangeOrdered { step, refused }),
    ) = (command, &record.event)
    {
        let is_of_it = record.member == Some(member) && !taken && *step == request.words();
        return is_of_it.then(|| match refused {
            None => Ok(Done::default()),
            Some(why) => Err(Refusal::of_answer(why.clone())),
        });
    }
    let Happening::RemoteIo(event) = &record.event else {
        return None;
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
        (
            Command::Unforce(Unforce { signal, .. }),
            RemoteIoEvent::Unforced { signal: done, .. },
        ) if signal == done => Some(Ok(Done::default())),
        (
            Command::Unforce(Unforce { signal, .. }),
            RemoteIoEvent::UnforceRefused { signal: other, refusal, .. },
        ) if signal == other => refused(*refusal),
        (Command::Choose { choice: StateChoice::Cold }, RemoteIoEvent::StartedCold { .. })
        | (
            Command::Choose { choice: StateChoice::Newest { .. } },
            RemoteIoEvent::StartedWarm { .. } | RemoteIoEvent::AdoptedLineage { .. },
        ) => Some(Ok(Done::default())),
        (
            Command::Choose { .. } | Command::Release,
            RemoteIoEvent::ChoiceRefused { refusal, .. },
        ) => refused(*refusal),
        (Command::Release, RemoteIoEvent::Released { .. }) => Some(Ok(Done::default())),
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

#[cfg(test)]
mod tests {
    use understudy_remote_io::ForceEnd;
    use understudy_wire::{Force, Moment, ProgramId, SignalPlace};

    use super::*;

    const MEMBER: Member = Member::RemoteIo(ProgramId(0));
    const NAME: &str = "robot-io";

    /// What a caller waits for.
    type Answer = tokio::sync::oneshot::Receiver<Result<Done, Refusal>>;

    /// The order of a caller who still waits, or has gone.
    fn commanded(command: Command, is_gone: bool) -> (Commanded, Option<Answer>) {
        let (answer, waits) = tokio::sync::oneshot::channel();
        let (owner, reason) = ("anna".to_owned(), "a test".to_owned());
        let action = OperatorAction::Command { member: MEMBER, command, owner, reason };
        (Commanded { action, answer }, (!is_gone).then_some(waits))
    }

    fn record(event: RemoteIoEvent) -> Record {
        let name = NAME.to_owned();
        Record { at_ns: 1, name, member: Some(MEMBER), event: Happening::RemoteIo(event) }
    }

    /// Every order that a remote I/O decides is recorded once, with why it was refused, also where its caller has gone.
    #[test]
    fn the_record_of_an_order_has_its_outcome() {
        let moment = Moment::default();
        let signal = SignalPlace::Input(0);
        let (owner, reason) = ("anna".to_owned(), "a test".to_owned());
        let force = Force { signal, value: true.into(), seconds: 1, owner, reason, points: None };
        let choose = |choice| Command::Choose { choice };
        let refusal = OrderRefusal::NotForced;
        let orders = [
            (
                choose(StateChoice::Cold),
                RemoteIoEvent::StartedCold { born: moment, awaits_release: false, lost: None },
                RemoteIoEvent::ChoiceRefused { moment, refusal: OrderRefusal::NoChoice },
            ),
            (
                Command::Force(force.clone()),
                RemoteIoEvent::Forced { moment, force: force.clone() },
                RemoteIoEvent::ForceRefused { moment, force, refusal },
            ),
            (
                Command::Unforce(Unforce { signal, points: None }),
                RemoteIoEvent::Unforced { moment, signal, by: ForceEnd::Operator },
                RemoteIoEvent::UnforceRefused { moment, signal, refusal },
            ),
        ];
        for (command, done, refused) in orders {
            for (event, is_refused, is_gone) in [
                (done.clone(), false, false),
                (refused.clone(), true, false),
                (done, false, true),
                (refused, true, true),
            ] {
                let mut orders = PendingOrders::default();
                let (first, _waits) = commanded(command.clone(), is_gone);
                let (other, _other) = commanded(
                    Command::Unforce(Unforce { signal: SignalPlace::Output(9), points: None }),
                    false,
                );
                orders.add(first, NAME.to_owned());
                orders.add(other, NAME.to_owned());
                let decided = orders.observe(&record(event));
                let records: Vec<Option<RunEvent>> =
                    decided.iter().map(DecidedOrder::record).collect();
                let [Some(RunEvent::Commanded { command: of, refused, .. })] = &records[..] else {
                    panic!("{records:?}");
                };
                assert_eq!((of, refused.is_some()), (&command, is_refused));
            }
        }
    }

    /// The caller of an order that no process can decide any more is told so, and an equal order to the next process gets its own outcome.
    #[test]
    fn an_order_ends_with_the_process_that_it_was_sent_to() {
        let other = Member::RemoteIo(ProgramId(1));
        let ends = |member| {
            [
                RunEvent::Ended { member, how: "signal: 9 (SIGKILL)".to_owned(), said: Vec::new() },
                RunEvent::Fault { action: Action::Crash, member, asked: 7 },
                RunEvent::Started { member },
            ]
        };
        let signal = SignalPlace::Input(0);
        let unforce = || Command::Unforce(Unforce { signal, points: None });
        let moment = Moment::default();
        for end in ends(MEMBER) {
            let mut orders = PendingOrders::default();
            let send = |orders: &mut PendingOrders| {
                let (order, answer) = commanded(unforce(), false);
                orders.add(order, NAME.to_owned());
                answer.expect("its caller waits")
            };
            let observe = |orders: &mut PendingOrders, record: &Record| {
                let decided = orders.observe(record);
                let count = decided.len();
                decided.into_iter().for_each(DecidedOrder::answer);
                count
            };
            let mut before = send(&mut orders);
            for elsewhere in ends(other) {
                assert_eq!(observe(&mut orders, &Record::of_run(1, elsewhere)), 0);
            }
            assert_eq!(observe(&mut orders, &Record::of_run(1, end.clone())), 1, "{end:?}");
            assert_eq!(before.try_recv(), Ok(Err(Refusal::Down(NAME.to_owned()))), "{end:?}");
            let mut after = send(&mut orders);
            let unforced = RemoteIoEvent::Unforced { moment, signal, by: ForceEnd::Operator };
            assert_eq!(observe(&mut orders, &record(unforced)), 1);
            assert_eq!(after.try_recv(), Ok(Ok(Done::default())));
        }
    }

    /// What a member has loaded and cannot keep on its disk counts for all who judge what it drives.
    #[test]
    fn a_change_that_is_not_kept_is_loaded_all_the_same() {
        let request = ChangeRequest::Prepare { file: "change.json".to_owned() };
        let step = request.words();
        let not_kept = "U0633: it is done, and not kept on the disk";
        for (said, is_loaded) in
            [(None, true), (Some(not_kept), true), (Some("U0631: these are no texts"), false)]
        {
            let mut orders = PendingOrders::default();
            let command = Command::Change { request: request.clone() };
            let (order, _waits) = commanded(command, false);
            orders.add(order, NAME.to_owned());
            let refused = said.map(str::to_owned);
            let event = Happening::Host(HostEvent::ChangeOrdered { step: step.clone(), refused });
            let told = Record { at_ns: 1, name: NAME.to_owned(), member: Some(MEMBER), event };
            let decided = orders.observe(&told);
            let found = decided.first().and_then(DecidedOrder::change);
            assert_eq!(found.is_some(), is_loaded, "{said:?}");
        }
    }
}
