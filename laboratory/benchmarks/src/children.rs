//! The processes of a benchmark, each a member of one cluster: this program again, with its part as an argument.

use std::io;
use std::process::Child;
use std::sync::Arc;

use understudy_bus::{BusError, Endpoints, Guard, Peer};
use understudy_seal::{ClusterSecret, KEY_BYTES, Opener, Seal, Title};

/// What the system refused.
pub(crate) fn refused(what: &'static str) -> impl FnOnce(io::Error) -> BusError {
    move |source| BusError::System { what, source }
}

/// Keys derived from no secret: the time that they cost is measured.
pub(crate) fn guard(endpoints: &Endpoints) -> Guard {
    let secret = ClusterSecret::new([0; KEY_BYTES]);
    let key = |peer: &Peer| {
        secret.frame_key(Title { cluster: "benchmark", member: &peer.name, generation: 1 })
    };
    let own = endpoints.own();
    let senders = endpoints.others().iter().map(|peer| (peer.member, key(peer)));
    Guard::with_keys(
        Seal::new(own.member, key(own), 1, []),
        Opener::new(own.member, senders, [], Arc::default()),
    )
}

/// Processes that end with their measurement.
pub(crate) struct Running(pub(crate) Vec<Child>);

impl Drop for Running {
    fn drop(&mut self) {
        for child in &mut self.0 {
            // It can only fail where the child has ended by itself.
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}
