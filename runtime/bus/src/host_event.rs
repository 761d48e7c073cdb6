//! What the process of a member reports besides its member.

use std::net::{IpAddr, SocketAddr};

use serde::{Deserialize, Serialize};
use understudy_wire::{Member, Via};

use crate::distribution::Quantiles;
use crate::host::Summary;
use crate::link::LinkKind;
use crate::refused_as::RefusedAs;
use crate::refused_orders::RefusedOrder;
use crate::rights::Rights;

fn first_version() -> u32 {
    1
}

/// What the process of a member reports.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum HostEvent {
    /// It listens, and its cycle starts.
    Ready {
        /// Version of the records that it reports.
        #[serde(default = "first_version")]
        version: u32,
        /// Process id.
        process: u32,
        /// Where it listens.
        address: SocketAddr,
        /// What carries its frames.
        link: LinkKind,
        /// What the system lets it have.
        rights: Rights,
    },
    /// An engineer has asked for a step of an online change.
    ChangeOrdered {
        /// What, in words.
        step: String,
        /// Why it was not done, with its code.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        refused: Option<String>,
    },
    /// Datagrams arrived that are no frames, since the last such record.
    RefusedBytes {
        /// How many.
        datagrams: u64,
        /// Why the last one is none.
        reason: String,
    },
    /// Frames arrived that do not count, since the last such record: a process on the network does what it must not.
    RefusedFrames {
        /// How many.
        datagrams: u64,
        /// Why.
        refused_as: RefusedAs,
        /// In whose name they came, where they bear one.
        sender: Option<Member>,
        /// The same in words.
        reason: String,
    },
    /// Operators can call, by mutual TLS.
    ChannelOpened {
        /// Where.
        address: SocketAddr,
        /// The common names of those who may command.
        operators: Vec<String>,
    },
    /// Operators cannot call; it is tried again.
    ChannelFailed {
        /// Why.
        reason: String,
    },
    /// What it keeps for the time after a power failure is not written to its disk.
    RetainFailed {
        /// Why.
        reason: String,
    },
    /// That is written again.
    RetainRegained,
    /// A file that it has kept is not used, or not to its end.
    RetainedRefused {
        /// The file.
        file: String,
        /// Why.
        reason: String,
    },
    /// It has taken over retentive values of the program before, which is another one.
    RetainedCarried {
        /// Its program.
        program: String,
        /// Values that are kept.
        kept: usize,
        /// Values of a type that is another one now.
        converted: usize,
        /// Values that the program before did not have.
        new: usize,
    },
    /// Retentive values of the program before are not taken over.
    RetainedDropped {
        /// Its program.
        program: String,
        /// Their paths, the first of them.
        paths: Vec<String>,
        /// Paths that are not listed.
        more: usize,
    },
    /// Frames of two lives of a member arrive in turn: two processes run with its keys, for example one of an old disk image.
    DuplicateFound {
        /// Whose keys they have.
        member: Member,
    },
    /// The earlier life of the member has sent nothing for some seconds.
    DuplicateGone {
        /// Whose keys they had.
        member: Member,
    },
    /// It goes on in a new life: the others do not receive it, or the numbers of its frames end.
    NewLife {
        /// Its number.
        life: u32,
    },
    /// It cannot go on in a new life.
    NoNewLife {
        /// Why.
        reason: String,
    },
    /// Connections to the operators' port were closed at once, since the last such record: there were too many, in all or from one
    /// address.
    RefusedConnections {
        /// How many.
        connections: u64,
        /// Where the last one came from.
        address: IpAddr,
    },
    /// The TLS listener refused certificates of callers, since the last such record.
    RefusedCertificates {
        /// How many.
        connections: u64,
        /// Why the last one; with the time of this machine and the end of the validity, where that is the reason.
        reason: String,
    },
    /// Writes of operators were refused at once since the last such record: more came in a second than this member takes.
    RefusedWrites {
        /// Their number.
        writes: u64,
    },
    /// An order of a person to this member was refused before it was sent: it names something that does not exist, or the person has no right to it.
    OrderRefused(RefusedOrder),
    /// A spare reports here for the first time, again, or from another place.
    SpareReceived {
        /// Its name in the plant file.
        spare: String,
        /// The group in which it is awake, as the plant file names it.
        serves: Option<String>,
    },
    /// A spare that has reported here has not done so for 15 s.
    SpareLost {
        /// Its name in the plant file.
        spare: String,
    },
    /// The member said frames that break a bound of the wire, since the last such record: a mistake in this program.
    UnsendableFrames {
        /// How many.
        frames: u64,
        /// Which bound, for the last one.
        reason: String,
    },
    /// What this member receives over one of several paths has changed. Each time all peers of which it is not in order are named.
    NetworkReception {
        /// Which path: 1 or 2 for a network, 3 for the direct link.
        network: Via,
        /// Peers of which nothing arrives over it in time, while another path carries their frames.
        lost: Vec<Member>,
        /// Peers of which less arrives over it in time than over another one.
        impaired: Vec<Member>,
    },
    /// No configured peer was received for so long, or one that is connected was not, that the link was closed and opened anew.
    LinkReopened {
        /// Over which of several paths it is.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        network: Option<Via>,
        /// How long, in milliseconds.
        silence_ms: u64,
        /// The one that is connected and was not received; none where no peer was.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        peer: Option<Member>,
    },
    /// The same, and the link could not be opened: no frame is sent or received. It is tried again.
    LinkFailed {
        /// Over which of several paths it is.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        network: Option<Via>,
        /// How long, in milliseconds.
        silence_ms: u64,
        /// The one that is connected and was not received; none where no peer was.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        peer: Option<Member>,
        /// Why it cannot be opened.
        reason: String,
    },
    /// The equipment of a remote I/O cannot be seen any more.
    FieldLost {
        /// Why.
        reason: String,
    },
    /// The equipment can be seen again.
    FieldRegained,
    /// The equipment of a remote I/O holds other outputs than the remote I/O wrote, again and again: another master writes them too.
    FieldContested,
    /// The equipment holds what the remote I/O wrote.
    FieldUncontested,
    /// The wall clock beside the monotonic time of the record, once in ten minutes.
    WallClock {
        /// Nanoseconds since 1970-01-01 UTC.
        unix_ns: u64,
    },
    /// The wall clock was set.
    WallClockStepped {
        /// Nanoseconds since 1970-01-01 UTC, after it.
        unix_ns: u64,
        /// By how much, in nanoseconds; negative for one that was set back.
        step_ns: i64,
    },
    /// How long a remote I/O took from its samples to its outputs since it runs, once in ten seconds and before it ends.
    Timed {
        /// From the sample until the field had the outputs that are proved for it. Deadlines with held or fail-safe outputs are not in it.
        sample_to_output: Quantiles,
        /// How late the system woke it.
        wakeups: Quantiles,
    },
    /// Records were lost because the journal was too slow, since the last such record.
    JournalLost {
        /// How many.
        records: u64,
    },
    /// A line was read that is no command.
    UnknownCommand {
        /// The line.
        line: String,
    },
    /// The member ends as it was told to.
    Stopped(Summary),
}
