//! Seven processes and one number.
//!
//! The caller starts the processes: each is its own program again, told its part as one argument ([`ExchangeMember`] as JSON).

use std::io::{self, BufRead, BufReader, Write};
use std::net::{SocketAddr, UdpSocket};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use nix::sys::prctl::set_pdeathsig;
use nix::sys::signal::Signal;
use serde::{Deserialize, Serialize};
use understudy_cycle::Machine;
use understudy_seal::{ClusterSecret, KEY_BYTES, Opener, Seal, Title};
use understudy_wire::{ClusterHash, Member, ProgramId, StationId, Topic};

use super::meter::{Exchange, ExchangeMeter};
use super::pattern::{CYCLE_MASTER, PROGRAMS, Pattern, STATIONS};
use super::raw::play;
use crate::clock::Clock;
use crate::control::Commands;
use crate::endpoints::{Endpoints, Peer};
use crate::error::BusError;
use crate::field::{FieldDriver, NoField};
use crate::guard::Guard;
use crate::journal::{EventSink, HostEvent, Journal, Noted, Record};
use crate::link::LinkKind;
use crate::member::{MemberSettings, run_member};
use crate::observer::{NoObserver, Observer};
use crate::ports::free_addresses;
use crate::rights::{CYCLE_PRIORITY, run_in_real_time, sleep_exactly};
use crate::zenoh_link::ZENOH_RUNTIME;

/// Complete cycles before the measurement, while the sessions come up.
const SKIPPED_CYCLES: u64 = 100;
/// Longer than any start takes; past it a measurement has failed.
const START_TIMEOUT: Duration = Duration::from_secs(20);

/// What carries the pattern.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Carrier {
    /// Plain sockets: the yardstick.
    Raw,
    /// A link.
    Link(LinkKind),
}

/// How much is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ExchangeSettings {
    /// Complete cycles to measure.
    pub cycles: u64,
    /// From one Sync to the next.
    pub period: Duration,
    /// Whether SCHED_FIFO is asked for.
    pub real_time: bool,
    /// Whether the frames carry authenticators.
    pub sealed: bool,
}

/// The part of one process, as it is handed to it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct ExchangeMember {
    own: Member,
    members: Vec<Peer>,
    carrier: Carrier,
    settings: ExchangeSettings,
}

/// Measures one carrier. `process` makes the command that runs [`run_exchange_member`] with the part it is given, writing to
/// its standard output.
///
/// # Errors
/// [`BusError::System`] where a process cannot be started, [`BusError::Benchmark`] where the cycle master's says nothing in time.
pub fn measure(
    carrier: Carrier,
    settings: ExchangeSettings,
    mut process: impl FnMut(&ExchangeMember) -> Command,
) -> Result<Exchange, BusError> {
    let members = members().map_err(|source| BusError::System {
        what: "seven free ports",
        source,
    })?;
    let mut running = Running(Vec::new());
    // The cycle master is the last to start.
    for own in members.iter().rev().map(|peer| peer.member) {
        let part = ExchangeMember {
            own,
            members: members.clone(),
            carrier,
            settings,
        };
        let mut command = process(&part);
        if std::env::var_os(ZENOH_RUNTIME.0).is_none() {
            command.env(ZENOH_RUNTIME.0, ZENOH_RUNTIME.1);
        }
        let child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|source| BusError::System {
                what: "to start a process of the benchmark",
                source,
            })?;
        running.0.push(child);
    }
    let failed = |reason: &str| BusError::Benchmark {
        member: CYCLE_MASTER,
        reason: reason.into(),
    };
    let cycle_master = running.0.last_mut().and_then(|child| child.stdout.take());
    let output = cycle_master.ok_or_else(|| failed("has no output"))?;
    let (found, result) = channel();
    let reader = std::thread::spawn(move || {
        let _ = found.send(read_exchange(output));
    });
    // Twice as many cycles as are wanted: past that, more than half were incomplete.
    let cycles = u32::try_from((settings.cycles + SKIPPED_CYCLES) * 2).unwrap_or(u32::MAX);
    let exchange = match result.recv_timeout(START_TIMEOUT + settings.period * cycles) {
        Ok(Some(exchange)) => Ok(exchange),
        Ok(None) | Err(RecvTimeoutError::Disconnected) => Err(failed("ended without a result")),
        Err(RecvTimeoutError::Timeout) => Err(failed("did not get its cycles together in time")),
    };
    drop(running);
    let _ = reader.join();
    exchange
}

/// Waits for what the cycle master has measured.
fn read_exchange(output: ChildStdout) -> Option<Exchange> {
    let lines = BufReader::new(output).lines().map_while(Result::ok);
    let mut records = lines.filter_map(|line| {
        let record = serde_json::from_str::<Record<'_, serde_json::Value>>(&line);
        record.ok().map(|record| record.event)
    });
    records.find_map(|event| match event {
        Noted::Host(HostEvent::Exchange(exchange)) => Some(exchange),
        _ => None,
    })
}

impl ExchangeMember {
    /// Whose part it is: a station below [`STATIONS`] or a remote I/O below [`PROGRAMS`].
    pub fn own(&self) -> Member {
        self.own
    }

    /// From one Sync to the next.
    pub fn period(&self) -> Duration {
        self.settings.period
    }
}

/// What a process of the benchmark runs: the yardstick, or the pattern over a link.
///
/// # Errors
/// As [`run_member`] has.
pub fn run_exchange_member(
    part: ExchangeMember,
    output: impl Write + Send + 'static,
) -> Result<(), BusError> {
    let pattern = Pattern::new(part.own, part.settings.period);
    run_exchange_machine(part, pattern, Box::new(NoField), output)
}

/// The same with a machine of the caller's own, such as a real station, in place of the pattern.
///
/// # Errors
/// As [`run_member`] has.
pub fn run_exchange_machine<M>(
    part: ExchangeMember,
    machine: M,
    field: Box<dyn FieldDriver>,
    output: impl Write + Send + 'static,
) -> Result<(), BusError>
where
    M: Machine + Send,
    M::Event: Serialize + Send + 'static,
{
    let ExchangeMember {
        own,
        members,
        carrier,
        settings,
    } = part;
    let endpoints = Endpoints::new(ClusterHash(u64::MAX), own, members, Vec::new())?;
    let meter = ExchangeMeter::new(usize::from(STATIONS), SKIPPED_CYCLES, settings.cycles);
    match carrier {
        Carrier::Raw => run_raw_member(&endpoints, settings, meter, output),
        Carrier::Link(link) => {
            let observer: Box<dyn Observer> = if own == CYCLE_MASTER {
                Box::new(meter)
            } else {
                Box::new(NoObserver)
            };
            let guard = if settings.sealed {
                guard(&endpoints)
            } else {
                Guard::Off
            };
            let member_settings = MemberSettings {
                endpoints,
                link,
                guard,
                channel: None,
                field,
                observer,
                commands: Commands::ReadAndEndWithInput,
                ends_with_parent: true,
                real_time: settings.real_time,
            };
            run_member(machine, member_settings, output).map(drop)
        }
    }
}

/// Keys that every process derives from nothing secret: what they cost is measured, not what they keep.
fn guard(endpoints: &Endpoints) -> Guard {
    let secret = ClusterSecret::new([0; KEY_BYTES]);
    let key = |peer: &Peer| {
        secret.frame_key(Title {
            cluster: "exchange",
            member: &peer.name,
            generation: 1,
        })
    };
    let own = endpoints.own();
    let senders = endpoints.heard().map(|(peer, _)| (peer.member, key(peer)));
    Guard::with_keys(
        Seal::new(own.member, key(own), 1, []),
        Opener::new(own.member, senders, [], Arc::default()),
    )
}

fn run_raw_member(
    endpoints: &Endpoints,
    settings: ExchangeSettings,
    mut meter: ExchangeMeter,
    output: impl Write + Send + 'static,
) -> Result<(), BusError> {
    set_pdeathsig(Signal::SIGKILL).map_err(BusError::system(
        "to end with the process that started this one",
    ))?;
    let own = endpoints.own().clone();
    let socket =
        UdpSocket::bind(own.address).map_err(|source| BusError::listen(own.address, source))?;
    let clock = Clock::start();
    let (mut sink, journal) = Journal::start::<()>(1, clock, own.member, own.name, output)?;
    sleep_exactly();
    if settings.real_time
        && let Err(error) = run_in_real_time(CYCLE_PRIORITY)
    {
        tracing::warn!(error, "the yardstick runs without real-time rights");
    }
    // The same datagrams as those of the links, one for each who is concerned.
    let audience = endpoints.audience(Topic::Cycle);
    let others: Vec<SocketAddr> = audience.map(|peer| peer.address).collect();
    play(own.member, &socket, &others, settings, &mut meter).map_err(|source| {
        BusError::System {
            what: "to carry a datagram",
            source,
        }
    })?;
    sink.record(
        clock.now(),
        Noted::Host(HostEvent::Exchange(meter.exchange())),
    );
    drop(sink);
    journal.finish();
    Ok(())
}

/// All members of the pattern on free ports.
fn members() -> io::Result<Vec<Peer>> {
    let stations = (0..STATIONS).map(|rank| Member::Station(StationId(rank)));
    let remote_ios = (0..PROGRAMS).map(|program| Member::RemoteIo(ProgramId(program)));
    let members: Vec<Member> = stations.chain(remote_ios).collect();
    let addresses = free_addresses(members.len())?;
    let peer = |(member, address)| Peer {
        member,
        name: format!("{member:?}"),
        address,
    };
    Ok(members.into_iter().zip(addresses).map(peer).collect())
}

/// Processes that do not outlive their measurement.
struct Running(Vec<Child>);

impl Drop for Running {
    fn drop(&mut self) {
        for child in &mut self.0 {
            // It can only fail where the child has ended by itself.
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}
