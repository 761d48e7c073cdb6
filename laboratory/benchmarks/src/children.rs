//! The processes of a benchmark: this program again, with its part as an argument, or as the `understudy` command.

use std::io;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command};
use std::sync::Arc;

use understudy::{Answer, Status};
use understudy_bus::{BusError, Endpoints, Guard, Peer, free_addresses};
use understudy_seal::{ClusterSecret, KEY_BYTES, Opener, Seal, Title};
use understudy_wire::Member;

/// The name by which this program is the `understudy` command.
const NAME: &str = "understudy";

/// Whether this process was started by [`understudy_command`].
pub(crate) fn is_understudy() -> bool {
    std::env::args_os().next().is_some_and(|name| name == Path::new(NAME))
}

/// This program again.
pub(crate) fn own_command() -> io::Result<Command> {
    std::env::current_exe().map(Command::new)
}

/// The `understudy` command of this build: what is measured is never another version of the project than what judges it.
pub(crate) fn understudy_command() -> Result<Command, Answer> {
    let mut command = own_command().map_err(|error| {
        let message = format!("cannot find the executable of this program: {error}");
        Answer::failed(Status::Failed, "U0604", message)
    })?;
    command.arg0(NAME);
    Ok(command)
}

/// What the system refused.
pub(crate) fn refused(what: &'static str) -> impl FnOnce(io::Error) -> BusError {
    move |source| BusError::System { what, source }
}

/// These members on free ports.
pub(crate) fn peers_of(members: Vec<Member>) -> io::Result<Vec<Peer>> {
    let addresses = free_addresses(members.len())?;
    let peer = |(member, address)| Peer::new(member, format!("{member:?}"), address);
    Ok(members.into_iter().zip(addresses).map(peer).collect())
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
