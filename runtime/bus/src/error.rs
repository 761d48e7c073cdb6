//! Why a member cannot run.

use std::io;
use std::net::SocketAddr;

use understudy_cycle::Outvoted;
use understudy_wire::{Member, ZENOH_PORT_OFFSET};

/// What stops a member before or while it runs. The codes are stable.
#[derive(Debug, thiserror::Error)]
pub enum BusError {
    /// Another process listens there.
    #[error("U0501: port {} of {} is in use by another process", address.port(), address.ip())]
    PortInUse {
        /// Where this member was to listen.
        address: SocketAddr,
    },
    /// The address is none of this machine, or may not be used.
    #[error("U0502: cannot listen on {address}: {source}")]
    Listen {
        /// Where this member was to listen.
        address: SocketAddr,
        /// What the system said.
        source: io::Error,
    },
    /// Zenoh did not start.
    #[error("U0503: Zenoh does not start on {address}: {reason}")]
    Zenoh {
        /// Where this member was to listen.
        address: SocketAddr,
        /// What Zenoh said.
        reason: String,
    },
    /// There is no port for the frames of this address.
    #[error("U0580: {address} cannot be used over Zenoh: its frames need the TCP port {} higher, and ports end at {}; use a port up to {}", ZENOH_PORT_OFFSET, u16::MAX, u16::MAX - ZENOH_PORT_OFFSET)]
    NoZenohPort {
        /// Of the member.
        address: SocketAddr,
    },
    /// A member is not in the list, so that it has no address.
    #[error("U0504: {member:?} has no address in the cluster")]
    NoAddress {
        /// Who.
        member: Member,
    },
    /// Two members with one address.
    #[error("U0505: {first} and {second} have the same address {address}")]
    SharedAddress {
        /// One name.
        first: String,
        /// The other name.
        second: String,
        /// Of both.
        address: SocketAddr,
    },
    /// The system refused something that every process needs.
    #[error("U0506: {what}: {source}")]
    System {
        /// What was asked of it.
        what: &'static str,
        /// What it said.
        source: io::Error,
    },
    /// The cycle's thread ended by a panic: a mistake in this program.
    #[error("U0507: the cycle ended by a panic: {message}")]
    Panicked {
        /// What the panic said.
        message: String,
    },
    /// More stations have another configuration than have that of this member, which does not take part yet.
    #[error(
        "U0598: {} stations of this cluster have configuration {}, and {} have {}, the one of this cluster file: nothing was started; start this member with the cluster file of the others, or the others with this one",
        .0.others, .0.theirs, .0.stations, .0.ours
    )]
    Outvoted(Outvoted),
    /// Nobody is there, or one side does not believe the other's certificate.
    #[error("U0509: {name} does not take a call at {address}: {reason}")]
    Uncalled {
        /// Who was called.
        name: String,
        /// Where.
        address: SocketAddr,
        /// What Zenoh said.
        reason: String,
    },
    /// A certificate does not count by the clock of this machine, so no member accepts it and none is called.
    #[error("U0582: cannot call {address}: {reason}")]
    ClockOutside {
        /// Who was to be called.
        address: SocketAddr,
        /// Whose certificate, its validity, and what the clock says.
        reason: String,
    },
    /// A call was taken, and its answer was lost on the way.
    #[error(
        "U0581: the answer of {name} at {address} to `{request}` is lost: what was asked may be done; ask for the state of the member"
    )]
    AnswerLost {
        /// Name of the member.
        name: String,
        /// Its address.
        address: SocketAddr,
        /// The request.
        request: &'static str,
    },
    /// A call was taken, and what was asked is not answered.
    #[error(
        "U0510: {name} at {address} does not answer `{request}`: this certificate is not admitted to it, or is revoked"
    )]
    Unanswered {
        /// Who was asked.
        name: String,
        /// Where.
        address: SocketAddr,
        /// What.
        request: &'static str,
    },
}

/// What Zenoh says, without the places in its source files: ` at /…/file.rs:12.`.
pub(crate) fn reason(error: &zenoh::Error) -> String {
    let said = error.to_string();
    let mut kept = String::new();
    let mut rest = said.as_str();
    while let Some(end) = rest.find(".rs:") {
        let after = rest[end + 4..].trim_start_matches(|digit: char| digit.is_ascii_digit());
        let Some(start) = rest[..end].rfind(" at ") else {
            break;
        };
        kept.push_str(&rest[..start]);
        rest = after.strip_prefix('.').unwrap_or(after);
    }
    kept.push_str(rest);
    kept
}

impl BusError {
    /// The stable code, such as `U0501`.
    pub fn code(&self) -> &'static str {
        match self {
            Self::PortInUse { .. } => "U0501",
            Self::Listen { .. } => "U0502",
            Self::Zenoh { .. } => "U0503",
            Self::NoZenohPort { .. } => "U0580",
            Self::NoAddress { .. } => "U0504",
            Self::SharedAddress { .. } => "U0505",
            Self::System { .. } => "U0506",
            Self::Panicked { .. } => "U0507",
            Self::Uncalled { .. } => "U0509",
            Self::Unanswered { .. } => "U0510",
            Self::Outvoted(_) => "U0598",
            Self::AnswerLost { .. } => "U0581",
            Self::ClockOutside { .. } => "U0582",
        }
    }

    pub(crate) fn listen(address: SocketAddr, source: io::Error) -> Self {
        if source.kind() == io::ErrorKind::AddrInUse {
            Self::PortInUse { address }
        } else {
            Self::Listen { address, source }
        }
    }

    pub(crate) fn system(what: &'static str) -> impl FnOnce(nix::Error) -> Self {
        move |error| Self::System { what, source: error.into() }
    }
}

#[cfg(test)]
mod tests {
    use super::reason;

    #[test]
    fn a_reason_has_no_places_of_source_files() {
        let check = |said: &str, expected: &str| {
            assert_eq!(reason(&zenoh::Error::from(said)), expected);
        };
        check("no route", "no route");
        check(
            "Unable to connect to any of [tls/127.0.0.1:9]! at /root/.cargo/zenoh-1.10.2/src/net/orchestrator.rs:305.",
            "Unable to connect to any of [tls/127.0.0.1:9]!",
        );
        check(
            "timeout at a/b.rs:1. - Caused by refused at 127.0.0.1 at /x y/c.rs:22.",
            "timeout - Caused by refused at 127.0.0.1",
        );
        check("see main.rs:7", "see main.rs:7");
    }
}
