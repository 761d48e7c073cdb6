//! What the system lets a process have for keeping its times.

use std::cell::Cell;
use std::sync::atomic::{AtomicBool, Ordering};

use nix::sys::mman::{MlockAllFlags, mlockall};
use nix::sys::prctl::set_timerslack;
use nix::sys::resource::{RLIM_INFINITY, Resource, getrlimit};
use nix::unistd::geteuid;
use serde::{Deserialize, Serialize};
use thread_priority::{
    NormalThreadSchedulePolicy, RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue,
    ThreadSchedulePolicy, set_thread_priority_and_policy, thread_native_id,
};

use crate::cores::OwnCore;

/// Of SCHED_FIFO, for the thread of the cycle.
pub(crate) const CYCLE_PRIORITY: u8 = 40;
/// Of SCHED_FIFO, for the threads on which a link hears, which run only when there is something to carry.
const LINK_PRIORITY: u8 = 30;

/// Of SCHED_FIFO, for a process that starts: before programs that are not in real time, and behind every member that runs.
const START_PRIORITY: u8 = 10;

/// Whether this process has claimed its rights, so that the threads of its link may raise themselves.
static LINK_IN_REAL_TIME: AtomicBool = AtomicBool::new(false);

thread_local! {
    static RAISED: Cell<bool> = const { Cell::new(false) };
}

/// What a process has, and what it lacks, said for people.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rights {
    /// Whether the cycle runs under SCHED_FIFO.
    pub real_time: bool,
    /// Whether its memory stays in memory.
    pub locked_memory: bool,
    /// Core on which it waits actively (`spin = true`), where it has one for itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub core: Option<usize>,
    /// What is lacking, what it costs, and how to grant it; one sentence each.
    pub lacking: Vec<String>,
}

impl Rights {
    /// Asks for real time before the process starts its threads, which inherit it.
    ///
    /// A process that starts does much at once and must not delay those that run: the threads of the link raise themselves later, by
    /// [`raise_link_thread`].
    pub(crate) fn claim() -> Self {
        let mut lacking = Vec::new();
        let real_time = match run_in_real_time(START_PRIORITY) {
            Ok(()) => true,
            Err(error) => {
                lacking.push(format!(
                    "no SCHED_FIFO ({error}): other programs delay the cycle; grant it with CAP_SYS_NICE or `ulimit -r 50`; root is not needed"
                ));
                false
            }
        };
        LINK_IN_REAL_TIME.store(real_time, Ordering::Relaxed);
        Self { real_time, locked_memory: false, core: None, lacking }
    }

    /// Locks the memory, once what the process needs is there.
    pub(crate) fn lock(&mut self) {
        match lock_memory() {
            Ok(()) => self.locked_memory = true,
            Err(reason) => self.lacking.push(format!(
                "memory is not locked ({reason}): paging may delay the cycle; grant it with `ulimit -l unlimited` or CAP_IPC_LOCK"
            )),
        }
    }

    /// Claims a core for a member that is to wait actively; it waits as always where there is none.
    pub(crate) fn claim_core(&mut self) -> Option<OwnCore> {
        match OwnCore::claim() {
            Ok(core) => {
                self.core = Some(core.number);
                Some(core)
            }
            Err(reason) => {
                self.lacking.push(format!("U0511: `spin = true` has no core of its own: {reason}; the member waits without spinning"));
                None
            }
        }
    }

    /// None was asked for.
    pub(crate) fn unclaimed() -> Self {
        Self {
            real_time: false,
            locked_memory: false,
            core: None,
            lacking: vec!["no real-time rights were asked for".into()],
        }
    }
}

/// Called by a thread of the link when it hears something: where the process has its rights, the thread takes its own.
pub(crate) fn raise_link_thread() {
    if LINK_IN_REAL_TIME.load(Ordering::Relaxed) && !RAISED.get() {
        RAISED.set(true);
        if let Err(error) = run_in_real_time(LINK_PRIORITY) {
            tracing::warn!(error, "a thread of the link keeps its priority");
        }
    }
}

/// Puts the calling thread under SCHED_FIFO.
pub(crate) fn run_in_real_time(priority: u8) -> Result<(), String> {
    let value = ThreadPriorityValue::try_from(priority)?;
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(value), policy)
        .map_err(|error| match error {
            thread_priority::Error::OS(code) => std::io::Error::from_raw_os_error(code).to_string(),
            error => error.to_string(),
        })
}

/// Takes the calling thread out of real time: what it does has time.
pub(crate) fn run_in_background() {
    let policy = ThreadSchedulePolicy::Normal(NormalThreadSchedulePolicy::Other);
    let normal = set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Min, policy);
    if let Err(error) = normal {
        tracing::warn!(%error, "a thread in the background keeps its priority");
    }
}

/// Gives the calling thread what the thread of a cycle needs: exact sleep and, with `real_time`, SCHED_FIFO.
pub fn keep_times(real_time: bool) {
    sleep_exactly();
    if real_time && let Err(error) = run_in_real_time(CYCLE_PRIORITY) {
        tracing::warn!(error, "the cycle keeps the priority of the link");
    }
}

/// Without SCHED_FIFO the system may add 50 µs to every sleep so as to wake several threads at once.
pub(crate) fn sleep_exactly() {
    // It can only fail on kernels that do not know it, and costs exactness there, nothing else.
    if let Err(error) = set_timerslack(1) {
        tracing::debug!(%error, "the system does not sleep exactly");
    }
}

/// All that the process has, and all that it will have.
pub(crate) fn lock_memory() -> Result<(), String> {
    // Under a limit the call may succeed and every later allocation past the limit fail, so it is not tried.
    let (limit, _) = getrlimit(Resource::RLIMIT_MEMLOCK).map_err(|error| error.to_string())?;
    if limit != RLIM_INFINITY && !geteuid().is_root() {
        return Err(format!("at most {limit} bytes may be locked"));
    }
    mlockall(MlockAllFlags::MCL_CURRENT | MlockAllFlags::MCL_FUTURE)
        .map_err(|error| error.desc().to_owned())
}
