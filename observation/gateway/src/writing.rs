//! Writes of other systems to operator inputs.
//!
//! ```text
//!   OPC UA, Modbus TCP, Zenoh ──► WriteGate: checked, limited ──► process that writes the run ──► remote I/O
//! ```
//!
//! Invariant: however many requests arrive, at most [`MAXIMUM_WRITES`] are under way and at most [`WRITES_PER_SECOND`] are passed on
//! in a second; the others are refused at once.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tokio::runtime::Handle;
use tokio::sync::Semaphore;
use tokio::time::Instant;
use understudy_bus::{RefusedOrder, RefusedOrders, WriteLimiter};
use understudy_cluster::{Cluster, same_point};
use understudy_journal::{
    Commander, Done, OperatorAction, PointsInEffect, Refusal, WriteRequest, WriteSessions,
    new_write,
};
use understudy_text::visible;
use understudy_typed::Point;
use understudy_view::Run;
use understudy_wire::{Member, Write, WriteId, WriteRefusal};

use crate::followed::{Followed, Naming};

/// Writes of all clients of a gateway that wait for their outcome at the same time.
pub const MAXIMUM_WRITES: usize = 8;

/// Writes that a gateway passes on in a second, of all its clients together; as many as a laboratory takes.
pub const WRITES_PER_SECOND: u32 = understudy_bus::WRITES_PER_SECOND / 2;

/// The way of a gateway to the operator inputs of a run.
#[derive(Debug)]
pub struct WriteGate {
    cluster: Arc<Cluster>,
    /// Where the points that count are known from; those of the cluster otherwise.
    naming: Option<Naming>,
    commander: Commander,
    sessions: WriteSessions,
    limiter: WriteLimiter,
    refused: RefusedOrders,
    places: Semaphore,
    numbered: Mutex<Numbered>,
}

/// Writes that callers have numbered themselves, with the time when they were sent last, and the outcome of those that are in effect.
type Numbered = BTreeMap<WriteId, (Instant, Write, Option<Done>)>;

/// Time for which the outcome of a numbered write is remembered; callers repeat it for half of it.
const REMEMBERED_FOR: Duration = Duration::from_secs(60);

impl WriteGate {
    /// The operator inputs of `run`, by the points that count as `followed` tells.
    pub fn new(run: &Run, followed: &Followed) -> Self {
        let naming = Some(followed.naming());
        Self { naming, ..Self::of(Arc::clone(run.cluster()), run.commander()) }
    }

    fn of(cluster: Arc<Cluster>, commander: Commander) -> Self {
        Self {
            cluster,
            naming: None,
            sessions: WriteSessions::new(commander.clone()),
            commander,
            limiter: WriteLimiter::new(WRITES_PER_SECOND),
            refused: RefusedOrders::default(),
            places: Semaphore::new(MAXIMUM_WRITES),
            numbered: Mutex::default(),
        }
    }

    /// The cluster of the run.
    pub fn cluster(&self) -> &Cluster {
        &self.cluster
    }

    /// The points that count.
    fn points(&self) -> PointsInEffect {
        let first = || PointsInEffect::of(Arc::clone(&self.cluster));
        self.naming.as_ref().map_or_else(first, Naming::points)
    }

    /// Whether a point of the cluster counts: an online change may have brought another one of its name.
    pub fn has(&self, member: Member, point: &Point) -> bool {
        let points = self.points();
        let controller = member.sampled_program().and_then(|program| points.controller(program));
        controller.is_some_and(|it| same_point(point, &it.interface.inputs).is_some())
    }

    /// Checks a request; sends nothing.
    ///
    /// # Errors
    /// The refusal that the remote I/O would give for any of its inputs.
    pub fn check(&self, member: Member, request: &WriteRequest<'_>) -> Result<Write, Refusal> {
        let points = self.points();
        let write = new_write(points.cluster(), member, request).map_err(Refusal::from);
        write.inspect_err(|refusal| {
            self.log(member, request.owner, refusal);
            let name = self.cluster.member_name(member).unwrap_or_default();
            self.refuse(name, request.input, request.owner, request.reason, refusal);
        })
    }

    /// Has a write recorded in the journal of the run that was refused before it was sent.
    pub fn refuse(&self, name: &str, input: &str, owner: &str, reason: &str, refusal: &Refusal) {
        let order = RefusedOrder::new("write", name, owner, refusal).with(input, reason);
        let Some(order) = self.refused.admit(order) else {
            return;
        };
        let commander = self.commander.clone();
        match Handle::try_current() {
            // The caller has its answer without it.
            Ok(runtime) => drop(runtime.spawn(async move {
                let _ = commander.act(OperatorAction::Refused(order)).await;
            })),
            Err(_) => commander.refused_and_wait(order),
        }
    }

    /// Sends a write and waits for its outcome: the cycle of the cluster from which it is in effect. Its identifier is that of the
    /// caller, or the next one of the gateway.
    ///
    /// # Errors
    /// [`Refusal`].
    pub async fn send(
        &self,
        member: Member,
        write: Write,
        id: Option<WriteId>,
    ) -> Result<u64, Refusal> {
        // A flood is not logged.
        let refusal = WriteRefusal::Busy;
        let busy = Err(Refusal::Write { refusal });
        let known = id.and_then(|id| self.numbered().get(&id).cloned());
        // Another write under the same identifier is one for the remote I/O, which refuses it.
        let known =
            known.filter(|(_, sent, _)| (sent.input, sent.value) == (write.input, write.value));
        if let Some((_, _, Some(done))) = known {
            return Ok(done.cycle.unwrap_or_default());
        }
        // One that was sent before may be in effect, so it is not refused.
        let busy = if known.is_some() { Err(Refusal::Undecided) } else { busy };
        let place = self.places.try_acquire();
        if place.is_err() || !self.limiter.admits(&write.owner) {
            let name = self.cluster.member_name(member).unwrap_or_default();
            let input = self.input_name(member, write.input);
            return busy.inspect_err(|busy| {
                self.refuse(name, &input, &write.owner, &write.reason, busy);
            });
        }
        let owner = write.owner.clone();
        let done = match id {
            Some(id) => self.send_numbered(member, &Write { id, ..write }, known.is_some()).await,
            None => self.sessions.write(member, write).await,
        };
        let done = done.inspect_err(|refusal| self.log(member, &owner, refusal));
        Ok(done?.cycle.unwrap_or_default())
    }

    async fn send_numbered(
        &self,
        member: Member,
        write: &Write,
        is_sent: bool,
    ) -> Result<Done, Refusal> {
        let id = write.id;
        let now = Instant::now();
        {
            let mut numbered = self.numbered();
            numbered.retain(|_, (sent, ..)| now.duration_since(*sent) < REMEMBERED_FOR);
            numbered.insert(id, (now, write.clone(), None));
        }
        let done = self.commander.write_again(member, write, is_sent).await;
        match &done {
            Ok(done) => {
                self.numbered().insert(id, (Instant::now(), write.clone(), Some(*done)));
            }
            Err(refusal) if refusal.is_undecided() => {}
            // It has no effect, so its number is free.
            Err(_) => {
                self.numbered().remove(&id);
            }
        }
        done
    }

    fn input_name(&self, member: Member, input: u16) -> String {
        let Member::RemoteIo(program) = member else {
            return String::new();
        };
        let points = self.points();
        let remote_io = points.remote_io(program);
        let mut sources = remote_io.iter().flat_map(|remote_io| &remote_io.inputs);
        let found = sources.find(|source| {
            source.operator().is_some_and(|operator| operator.input.place.bit == input)
        });
        found.map_or_else(String::new, |source| source.name.clone())
    }

    fn numbered(&self) -> MutexGuard<'_, Numbered> {
        self.numbered.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn log(&self, member: Member, owner: &str, refusal: &Refusal) {
        let name = self.cluster.member_name(member).unwrap_or_default();
        // The reader of the log may have ended.
        let line = format!("write to {name} by {owner:?} refused: {refusal}");
        let _ = writeln!(std::io::stderr(), "{}", visible(&line));
    }
}

#[cfg(test)]
mod tests {
    use understudy_cycle::Mode;
    use understudy_journal::commands;
    use understudy_wire::{ProgramId, Role};

    use super::*;

    const MEMBER: Member = Member::RemoteIo(ProgramId(0));

    fn write(number: u32) -> (Write, Option<WriteId>) {
        let id = WriteId { session: 1, number };
        let write = Write {
            id,
            input: 0,
            value: true.into(),
            role: Role::Operator,
            owner: format!("client {number}"),
            reason: "a test".to_owned(),
            points: None,
        };
        (write, Some(id))
    }

    /// Each refused write has a record on its way to the journal, with the name that does not exist, and a flood of them has a few.
    #[test]
    fn refused_writes_are_recorded_at_a_bounded_rate() {
        let (commander, mut commands) = commands();
        let cluster = understudy_testing::press_cell(Mode::Full);
        let gate = WriteGate::of(Arc::new(cluster), commander);
        let request = WriteRequest {
            input: "nothing",
            value: understudy_journal::RequestedValue::Stored(1),
            role: Role::Operator,
            owner: "anna",
            reason: "a test",
        };
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
        runtime.expect("a runtime").block_on(async {
            for _ in 0..1000 {
                gate.check(MEMBER, &request).expect_err("no such input");
            }
            let mut recorded = 0;
            while let Ok(commanded) =
                tokio::time::timeout(Duration::from_millis(100), commands.next()).await
            {
                let OperatorAction::Refused(order) = commanded.action.clone() else {
                    panic!("{commanded:?}");
                };
                assert_eq!((order.to.as_str(), order.signal.as_str()), ("robot-io", "nothing"));
                assert!(order.owner == "anna" && order.why.starts_with("U0640"), "{order:?}");
                commanded.answer(Ok(Done::default()));
                recorded += 1;
            }
            assert!((1..=20).contains(&recorded), "{recorded}");
        });
    }

    #[test]
    fn a_repeated_number_is_answered_with_its_effect_and_never_refused() {
        let (commander, mut commands) = commands();
        let cluster = understudy_testing::press_cell(Mode::Full);
        let gate = Arc::new(WriteGate::of(Arc::new(cluster), commander));
        let send = |number| {
            let (gate, (write, id)) = (Arc::clone(&gate), write(number));
            async move { gate.send(MEMBER, write, id).await }
        };
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
        runtime.expect("a runtime").block_on(async {
            let answered = async {
                let done = Done { cycle: Some(7) };
                commands.next().await.answer(Ok(done));
            };
            let (done, ()) = tokio::join!(send(1), answered);
            assert_eq!(done, Ok(7));
            // As many as may be under way, none of which is answered.
            let mut under_way = Vec::new();
            for number in 2..2 + MAXIMUM_WRITES as u32 {
                tokio::spawn(send(number));
                under_way.push(commands.next().await);
            }
            assert_eq!(send(1).await, Ok(7), "it is in effect");
            assert_eq!(send(2).await, Err(Refusal::Undecided), "it may be in effect");
            let refusal = WriteRefusal::Busy;
            assert_eq!(send(99).await, Err(Refusal::Write { refusal }), "it was never sent");
        });
    }
}
