//! Writes of one caller, such as a gateway or the page: a session for each remote I/O, so that a remote I/O remembers one write of the
//! caller and not all of them.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use tokio::time::Instant;
use understudy_wire::{Member, Write, WriteId, WriteRefusal};

use super::new_write::new_id;
use super::{Command, Commander, Done, Refusal};

/// Time within which a write is repeated under its identifier until its outcome is known. A remote I/O remembers a session for longer.
pub const DECIDED_WITHIN: Duration = Duration::from_secs(30);

/// Time limit of one attempt.
const ATTEMPT: Duration = Duration::from_secs(10);

/// Time between two attempts.
const PAUSE: Duration = Duration::from_millis(250);

/// Time after which a session is not used again, because the remote I/O may have forgotten it.
const UNUSED_FOR: Duration = Duration::from_secs(30);

/// Refusals of the write itself: it has no effect, however often it was sent. All others say that a remote I/O did not take it now.
const FINAL: [&str; 6] = ["U0556", "U0640", "U0641", "U0642", "U0643", "U0647"];

impl Refusal {
    /// Its code in the documentation of errors.
    pub fn code(&self) -> String {
        self.own_code().unwrap_or_else(|| "U0557".to_owned())
    }

    /// The code that its message begins with.
    pub(super) fn own_code(&self) -> Option<String> {
        let message = self.to_string();
        let code = message.split(':').next().unwrap_or_default();
        let is_code = code.len() == 5 && code.starts_with('U');
        is_code.then(|| code.to_owned())
    }

    /// Whether a write may be in effect although it was not confirmed.
    pub fn is_undecided(&self) -> bool {
        self.code() == Self::Undecided.code()
    }
}

impl Commander {
    /// Writes a value to an operator input and waits for the outcome. The write is repeated under its identifier while its outcome is
    /// not known, which has one effect at most.
    ///
    /// # Errors
    /// [`Refusal`]; only where it [is undecided](Refusal::is_undecided), the write may have an effect.
    pub async fn write(&self, member: Member, write: &Write) -> Result<Done, Refusal> {
        self.write_again(member, write, false).await
    }

    /// As [`Commander::write`], of a write that `is_sent` already under its identifier.
    ///
    /// # Errors
    /// [`Refusal`].
    pub async fn write_again(
        &self,
        member: Member,
        write: &Write,
        is_sent: bool,
    ) -> Result<Done, Refusal> {
        let attempt = || async {
            let command = Command::Write(write.clone());
            let attempt = self.give(member, command, write.owner.clone(), write.reason.clone());
            let done = tokio::time::timeout(ATTEMPT, attempt).await;
            done.unwrap_or(Err(Refusal::Undecided))
        };
        until_decided(is_sent, attempt).await
    }

    /// As [`Commander::write`], from a thread that has nothing else to do.
    ///
    /// # Errors
    /// [`Refusal`].
    pub fn write_and_wait(&self, member: Member, write: &Write) -> Result<Done, Refusal> {
        super::block_on(self.write(member, write))?
    }
}

/// Attempts to write under one identifier until the outcome is known, for [`DECIDED_WITHIN`]. A write that may have been
/// taken is never refused: its outcome is then not known.
struct Attempts {
    is_sent: bool,
    until: Instant,
}

impl Attempts {
    fn new(is_sent: bool) -> Self {
        Self { is_sent, until: Instant::now() + DECIDED_WITHIN }
    }

    /// The outcome of the write after one more attempt; nothing where it is to be attempted again.
    fn settle(&mut self, attempt: Result<Done, Refusal>) -> Option<Result<Done, Refusal>> {
        let refusal = match attempt {
            Ok(done) => return Some(Ok(done)),
            Err(refusal) => refusal,
        };
        // A remote I/O that refuses the second attempt for now may have taken the first.
        self.is_sent |= refusal.is_undecided();
        let code = refusal.code();
        if !self.is_sent || FINAL.contains(&code.as_str()) {
            return Some(Err(refusal));
        }
        // The remote I/O has forgotten the session, so the outcome will not be known.
        let is_forgotten = code == WriteRefusal::Order { expected: 1 }.code();
        let is_over = is_forgotten || Instant::now() >= self.until;
        is_over.then_some(Err(Refusal::Undecided))
    }
}

async fn until_decided<A: Future<Output = Result<Done, Refusal>>>(
    is_sent: bool,
    mut attempt: impl FnMut() -> A,
) -> Result<Done, Refusal> {
    let mut attempts = Attempts::new(is_sent);
    loop {
        if let Some(outcome) = attempts.settle(attempt().await) {
            return outcome;
        }
        tokio::time::sleep(PAUSE).await;
    }
}

/// Attempts a write under one identifier until its outcome is known, from a thread that has nothing else to do and is in no
/// runtime.
///
/// # Errors
/// [`Refusal`]; only where it [is undecided](Refusal::is_undecided), the write may have an effect.
pub fn attempt_until_decided(
    mut attempt: impl FnMut() -> Result<Done, Refusal>,
) -> Result<Done, Refusal> {
    let mut attempts = Attempts::new(false);
    loop {
        if let Some(outcome) = attempts.settle(attempt()) {
            return outcome;
        }
        super::block_on(async { tokio::time::sleep(PAUSE).await })?;
    }
}

/// Next identifier of a session, and the time of its last write.
type Next = Option<(WriteId, Instant)>;

/// Sessions of one caller, one for each remote I/O. Writes to a remote I/O are sent one after the other.
#[derive(Debug)]
pub struct WriteSessions {
    commander: Commander,
    sessions: Mutex<BTreeMap<Member, Arc<tokio::sync::Mutex<Next>>>>,
}

impl WriteSessions {
    /// Sessions that write by `commander`.
    pub fn new(commander: Commander) -> Self {
        Self { commander, sessions: Mutex::default() }
    }

    /// As [`Commander::write`], under the next identifier of the session.
    ///
    /// # Errors
    /// [`Refusal`].
    pub async fn write(&self, member: Member, mut write: Write) -> Result<Done, Refusal> {
        let session = {
            let mut sessions = self.sessions.lock().unwrap_or_else(PoisonError::into_inner);
            Arc::clone(sessions.entry(member).or_default())
        };
        let mut next = session.lock().await;
        // The session ends here for a caller that goes away, or whose write is undecided.
        let known = next.take();
        let known = known.filter(|(_, used)| used.elapsed() < UNUSED_FOR);
        write.id = known.map_or_else(new_id, |(id, _)| id);
        let mut done = self.commander.write(member, &write).await;
        let order = WriteRefusal::Order { expected: 1 }.code();
        if known.is_some() && matches!(&done, Err(refusal) if refusal.code() == order) {
            // The remote I/O has forgotten the session.
            write.id = new_id();
            done = self.commander.write(member, &write).await;
        }
        *next = match &done {
            Ok(_) => write.id.next().map(|id| (id, Instant::now())),
            Err(refusal) if refusal.is_undecided() => None,
            // A write without an effect leaves its number free.
            Err(_) => Some((write.id, Instant::now())),
        };
        done
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Commanded, OperatorAction, commands};
    use super::*;
    use understudy_wire::{ProgramId, Role};

    const MEMBER: Member = Member::RemoteIo(ProgramId(0));

    fn write() -> Write {
        Write {
            id: new_id(),
            input: 0,
            value: true.into(),
            role: Role::Operator,
            owner: "anna".to_owned(),
            reason: "a test".to_owned(),
            points: None,
        }
    }

    fn id_of(commanded: &Commanded) -> WriteId {
        match &commanded.action {
            OperatorAction::Command { command: Command::Write(write), .. } => write.id,
            other => panic!("{other:?}"),
        }
    }

    fn done(cycle: u64) -> Result<Done, Refusal> {
        Ok(Done { cycle: Some(cycle) })
    }

    fn refused(refusal: WriteRefusal) -> Result<Done, Refusal> {
        Err(Refusal::Write { refusal })
    }

    /// Writes once for each list of answers, each of which is the answer to one attempt. Answers with the outcomes and the
    /// identifiers of the attempts.
    fn run(answers: &[&[Result<Done, Refusal>]]) -> (Vec<Result<Done, Refusal>>, Vec<WriteId>) {
        let runtime =
            tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
        let (commander, mut commands) = commands();
        let sessions = WriteSessions::new(commander);
        runtime.block_on(async {
            let (mut outcomes, mut ids) = (Vec::new(), Vec::new());
            for answers in answers {
                let answering = async {
                    for answer in *answers {
                        let commanded = commands.next().await;
                        ids.push(id_of(&commanded));
                        commanded.answer(answer.clone());
                    }
                };
                let (outcome, ()) = tokio::join!(sessions.write(MEMBER, write()), answering);
                outcomes.push(outcome);
            }
            (outcomes, ids)
        })
    }

    #[test]
    fn numbers_follow_each_other_and_a_refused_one_is_free() {
        let busy = refused(WriteRefusal::Busy);
        let once = [busy.clone()];
        let (outcomes, ids) = run(&[&[done(1)], &once, &[done(3)], &[done(4)]]);
        assert_eq!(outcomes, [done(1), busy, done(3), done(4)]);
        let numbers: Vec<u32> = ids.iter().map(|id| id.number).collect();
        assert_eq!(numbers, [1, 2, 2, 3]);
        assert!(ids.iter().all(|id| id.session == ids[0].session));
    }

    #[test]
    fn an_unknown_outcome_is_asked_for_again_under_the_same_identifier() {
        let later = refused(WriteRefusal::NotRunning);
        let undecided = Err(Refusal::Undecided);
        let (outcomes, ids) = run(&[&[undecided.clone(), later, done(7)], &[done(8)]]);
        assert_eq!(outcomes, [done(7), done(8)]);
        assert!(ids[..3].iter().all(|id| *id == ids[0]));
        assert_eq!(Some(ids[3]), ids[0].next());
        let void = refused(WriteRefusal::Void);
        let (outcomes, _) = run(&[&[undecided.clone(), void.clone()]]);
        assert_eq!(outcomes, [void]);
        // A write that may be in effect is not refused where its session is forgotten.
        let order = refused(WriteRefusal::Order { expected: 1 });
        let (outcomes, _) = run(&[&[undecided.clone(), order]]);
        assert_eq!(outcomes, [undecided]);
    }

    /// However a remote I/O refuses for now what it may have taken, the write is not refused.
    #[test]
    fn a_write_that_was_sent_is_refused_only_by_what_is_final() {
        let refusals = [
            WriteRefusal::NotWritable,
            WriteRefusal::Type,
            WriteRefusal::Limits,
            WriteRefusal::Role { required: Role::Engineer },
            WriteRefusal::Busy,
            WriteRefusal::NotRunning,
            WriteRefusal::Void,
        ];
        for refusal in refusals {
            let is_for_now = matches!(refusal, WriteRefusal::Busy | WriteRefusal::NotRunning);
            for first in [Refusal::Undecided, Refusal::Said("U0581: lost".to_owned())] {
                let is_sent = first.is_undecided();
                let mut answers = vec![done(7), refused(refusal), Err(first.clone())];
                let outcome = attempt_until_decided(|| answers.pop().expect("an answer"));
                let expected = match (is_sent, is_for_now) {
                    (true, true) => done(7),
                    (true, false) => refused(refusal),
                    (false, _) => Err(first),
                };
                assert_eq!(outcome, expected, "{refusal:?}");
            }
        }
    }

    #[test]
    fn a_forgotten_session_is_replaced() {
        let order = refused(WriteRefusal::Order { expected: 1 });
        let (outcomes, ids) = run(&[&[done(1)], &[order, done(2)]]);
        assert_eq!(outcomes, [done(1), done(2)]);
        assert_eq!(ids[2].number, 1);
        assert_ne!(ids[2].session, ids[0].session);
    }
}
