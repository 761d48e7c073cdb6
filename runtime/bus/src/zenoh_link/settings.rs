//! How a session is set up, and the identity that tells others whose it is.

use understudy_wire::{ClusterHash, Member};
use zenoh::session::ZenohId;

use crate::endpoints::Endpoints;
use crate::link::LinkKind;

/// How long it may take to connect to a peer. Long compared with what a busy machine needs, because an attempt that is given up is an
/// attempt that is begun again.
const OPEN_TIMEOUT_MS: u32 = 2_000;

/// A connection on which nothing is received for so long has ended. A process that ends takes its connections with it at once;
/// this is for a machine or a cable that fails.
const LEASE_MS: u32 = 2_000;

/// A longer frame goes in parts. What waits for a peer takes eight batches of this size, at most.
const BATCH_BYTES: u16 = 16 * 1024;

/// The variable of the environment that sets up Zenoh's own threads.
const RUNTIME: &str = "ZENOH_RUNTIME";

/// How Zenoh's own threads are to be set up, as a variable of the environment of every process that opens a Zenoh link. Zenoh
/// reads it once, when its first session opens, and takes nothing else; without it there are six threads where two do. Over several paths there are as
/// many of each, so that what waits in the session of a network that has failed does not hold up the others.
pub fn zenoh_runtime(paths: usize) -> (&'static str, &'static str) {
    let threads = match paths {
        0 | 1 => {
            "(rx: (worker_threads: 1), tx: (handover: rx), acc: (handover: rx), app: (handover: net), net: (worker_threads: 1))"
        }
        2 => {
            "(rx: (worker_threads: 2), tx: (handover: rx), acc: (handover: rx), app: (handover: net), net: (worker_threads: 2))"
        }
        _ => {
            "(rx: (worker_threads: 3), tx: (handover: rx), acc: (handover: rx), app: (handover: net), net: (worker_threads: 3))"
        }
    };
    (RUNTIME, threads)
}

/// The same for a process that only follows members, such as a spare: one thread for everything, since each packet wakes every thread that handles it.
pub fn zenoh_runtime_of_follower() -> (&'static str, &'static str) {
    let threads = "(rx: (handover: net), tx: (handover: net), acc: (handover: net), app: (handover: net), net: (worker_threads: 1))";
    (RUNTIME, threads)
}

/// The first hexadecimal digits of the identity of a member's sessions. The rest is random, so that a second life is never taken for the
/// first.
pub(super) fn identity(cluster: ClusterHash, member: Member) -> String {
    let (kind, number) = match member {
        Member::Station(station) => (1, station.0),
        Member::RemoteIo(program) => (2, program.0),
        Member::Plant(program) => (3, program.0),
        Member::Twin(program) => (4, program.0),
    };
    format!("{kind}{number:02x}{:016x}", cluster.0)
}

pub(super) fn settings(endpoints: &Endpoints) -> zenoh::Result<zenoh::Config> {
    let locator = |address| -> zenoh::Result<String> {
        Ok(format!("tcp/{}", LinkKind::Zenoh.frames_address(address)?))
    };
    let listen = [locator(endpoints.own().address)?];
    let connect = endpoints.called().map(|peer| locator(peer.address));
    let connect = connect.collect::<zenoh::Result<Vec<String>>>()?;
    let peers = endpoints.others().iter();
    let peers = peers.filter(|peer| endpoints.talks_with(peer.member)).count();
    let random = format!("{:032x}", u128::from_le_bytes(ZenohId::default().to_le_bytes()));
    let mut id = identity(endpoints.cluster(), endpoints.own().member);
    id.push_str(&random[id.len()..]);
    let mut config = zenoh::Config::default();
    for (setting, value) in [
        ("id", format!("\"{id}\"")),
        ("mode", "\"peer\"".to_owned()),
        ("listen/endpoints", format!("{listen:?}")),
        ("connect/endpoints", format!("{connect:?}")),
        // For as long as the session is open, in the background.
        ("connect/timeout_ms", "-1".into()),
        ("connect/exit_on_failure", "false".into()),
        (
            "connect/retry",
            "{ period_init_ms: 25, period_max_ms: 400, period_increase_factor: 2 }".into(),
        ),
        ("open/return_conditions/connect_scouted", "false".into()),
        ("open/return_conditions/declares", "false".into()),
        ("scouting/multicast/enabled", "false".into()),
        ("scouting/gossip/enabled", "false".into()),
        // The low-latency transport sends on the calling thread, and would wait there for a peer that is suspended.
        ("transport/unicast/lowlatency", "false".into()),
        // Not to be switched off: with one queue for all priorities Zenoh 1.10.2 marks that queue as full under one priority and as free
        // under another one (`TransmissionPipelineProducer::push_network_message` and `TransmissionPipelineConsumer::refill`), so that
        // it drops every frame to this peer from the first full queue on.
        ("transport/unicast/qos/enabled", "true".into()),
        // Each frame is a batch of its own, and a member sends some in a row.
        ("transport/link/tx/queue/size/real_time", "8".into()),
        ("transport/link/tx/batch_size", BATCH_BYTES.to_string()),
        ("transport/unicast/open_timeout", OPEN_TIMEOUT_MS.to_string()),
        ("transport/unicast/accept_timeout", OPEN_TIMEOUT_MS.to_string()),
        // Every peer, the last life of each, and no more, so that strangers do not take all descriptors.
        ("transport/unicast/max_sessions", (2 * peers).to_string()),
        ("transport/unicast/accept_pending", (2 * peers).to_string()),
        ("transport/link/tx/lease", LEASE_MS.to_string()),
        ("transport/link/tx/keep_alive", "4".into()),
        ("transport/link/tx/queue/congestion_control/drop/wait_before_drop", "0".into()),
        // Declarations and farewells wait for so long, in microseconds, on the thread that carries all connections of this process: five
        // seconds for each peer behind a network that has failed, if it were for Zenoh.
        ("transport/link/tx/queue/congestion_control/block/wait_before_close", "20000".into()),
    ] {
        config
            .insert_json5(setting, &value)
            .map_err(|error| format!("{setting} = {value}: {error}"))?;
    }
    Ok(config)
}
