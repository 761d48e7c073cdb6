//! Writes of other systems to operator inputs.
//!
//! ```text
//!   OPC UA, Modbus TCP, Zenoh ──► WriteGate: checked, limited ──► process that writes the run ──► remote I/O
//! ```
//!
//! Invariant: however many requests arrive, at most [`MAXIMUM_WRITES`] are under way and at most [`WRITES_PER_SECOND`] are passed on
//! in a second; the others are refused at once.

use std::io::Write as _;
use std::sync::Arc;

use tokio::sync::Semaphore;
use understudy_bus::WriteLimiter;
use understudy_cluster::Cluster;
use understudy_journal::{Commander, Refusal, WriteRequest, WriteSessions, new_write};
use understudy_view::Run;
use understudy_wire::{Member, Write, WriteId, WriteRefusal};

/// Writes of all clients of a gateway that wait for their outcome at the same time.
pub const MAXIMUM_WRITES: usize = 8;

/// Writes that a gateway passes on in a second, of all its clients together; as many as a laboratory takes.
pub const WRITES_PER_SECOND: u32 = understudy_bus::WRITES_PER_SECOND / 2;

/// The way of a gateway to the operator inputs of a run.
#[derive(Debug)]
pub struct WriteGate {
    cluster: Arc<Cluster>,
    commander: Commander,
    sessions: WriteSessions,
    limiter: WriteLimiter,
    places: Semaphore,
}

impl WriteGate {
    /// The operator inputs of `run`.
    pub fn new(run: &Run) -> Self {
        Self {
            cluster: Arc::clone(run.cluster()),
            commander: run.commander(),
            sessions: WriteSessions::new(run.commander()),
            limiter: WriteLimiter::new(WRITES_PER_SECOND),
            places: Semaphore::new(MAXIMUM_WRITES),
        }
    }

    /// The cluster of the run.
    pub fn cluster(&self) -> &Cluster {
        &self.cluster
    }

    /// Checks a request; sends nothing.
    ///
    /// # Errors
    /// The refusal that the remote I/O would give for any of its inputs.
    pub fn check(&self, member: Member, request: &WriteRequest<'_>) -> Result<Write, Refusal> {
        let write = new_write(&self.cluster, member, request).map_err(Refusal::from);
        write.inspect_err(|refusal| self.log(member, request.owner, refusal))
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
        let refusal = WriteRefusal::Busy;
        let busy = Refusal::Write { refusal };
        // A flood is not logged.
        let Ok(_place) = self.places.try_acquire() else {
            return Err(busy);
        };
        if !self.limiter.admits() {
            return Err(busy);
        }
        let owner = write.owner.clone();
        let done = match id {
            Some(id) => self.commander.write(member, &Write { id, ..write }).await,
            None => self.sessions.write(member, write).await,
        };
        let done = done.inspect_err(|refusal| self.log(member, &owner, refusal));
        Ok(done?.cycle.unwrap_or_default())
    }

    fn log(&self, member: Member, owner: &str, refusal: &Refusal) {
        let name = self.cluster.member_name(member).unwrap_or_default();
        // The reader of the log may have ended.
        let _ = writeln!(std::io::stderr(), "write to {name} by {owner:?} refused: {refusal}");
    }
}
