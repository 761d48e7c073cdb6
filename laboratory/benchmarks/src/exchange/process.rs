//! Seven processes that exchange one pattern: each is this program again, with its part as JSON.

use std::io::{self, BufRead, BufReader};
use std::net::UdpSocket;
use std::process::{ChildStdout, Stdio};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use clap::Args;
use nix::sys::prctl::set_pdeathsig;
use nix::sys::signal::Signal;
use serde::{Deserialize, Serialize};
use serde_json::json;
use understudy::{Answer, Status};
use understudy_bus::{
    BusError, Changes, Clock, Commands, Endpoints, EventSink as _, Journal, LinkKind,
    MemberSettings, NoField, Noted, Peer, Record, keep_times, zenoh_runtime,
};
use understudy_wire::{ClusterHash, ConfigurationHash, Member, ProgramId, Roster, StationId};

use crate::children::{Running, guard, own_command, peers_of, refused};

use super::meter::{Exchange, Meter};
use super::pattern::{PROGRAMS, Pattern, STATIONS};
use super::raw::play;

/// Complete cycles before the measurement, while the sessions are established.
const SKIPPED_CYCLES: u32 = 100;
/// Longer than any start takes.
const START_TIMEOUT: Duration = Duration::from_secs(20);

/// Carrier of the pattern.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Carrier {
    /// Plain sockets: the yardstick.
    Raw,
    /// A link.
    Link(LinkKind),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Settings {
    /// Complete cycles to measure.
    pub(super) cycles: u32,
    /// From one Sync to the next.
    pub(super) period: Duration,
    /// Whether SCHED_FIFO is requested.
    pub(super) real_time: bool,
}

/// The part of one process.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Part {
    own: Member,
    members: Vec<Peer>,
    carrier: Carrier,
    settings: Settings,
}

/// One process of the exchange
#[derive(Debug, Args)]
pub(crate) struct MemberArguments {
    /// Its part as JSON
    part: String,
}

fn failed(reason: &str) -> Answer {
    let message = format!("the cycle master of the benchmark {reason}");
    Answer::failed(Status::Failed, "U0508", message)
}

/// Measures one carrier.
pub(super) fn measure(carrier: Carrier, settings: Settings) -> Result<Exchange, Answer> {
    let members = members().map_err(refused("seven free ports"))?;
    let mut running = Running(Vec::new());
    // The cycle master is the last to start.
    for own in members.iter().rev().map(|peer| peer.member) {
        let part = Part { own, members: members.clone(), carrier, settings };
        let mut command = own_command().map_err(refused("to find this program"))?;
        command.arg("member");
        command.arg(serde_json::to_string(&part).unwrap_or_default());
        if std::env::var_os(zenoh_runtime(1).0).is_none() {
            command.env(zenoh_runtime(1).0, zenoh_runtime(1).1);
        }
        let child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(refused("to start a process of the benchmark"))?;
        running.0.push(child);
    }
    let cycle_master = running.0.last_mut().and_then(|child| child.stdout.take());
    let output = cycle_master.ok_or_else(|| failed("has no output"))?;
    let (found, result) = channel();
    let reader = std::thread::spawn(move || {
        let _ = found.send(read_exchange(output));
    });
    // Twice the number of cycles: if that is not enough, more than half were incomplete.
    let time = START_TIMEOUT + settings.period * (settings.cycles + SKIPPED_CYCLES) * 2;
    let exchange = match result.recv_timeout(time) {
        Ok(Some(exchange)) => Ok(exchange),
        Ok(None) | Err(RecvTimeoutError::Disconnected) => Err(failed("ended without a result")),
        Err(RecvTimeoutError::Timeout) => Err(failed("did not complete its cycles in time")),
    };
    drop(running);
    let _ = reader.join();
    exchange
}

/// Waits for the report of the cycle master.
fn read_exchange(output: ChildStdout) -> Option<Exchange> {
    let lines = BufReader::new(output).lines().map_while(Result::ok);
    let mut records = lines.filter_map(|line| {
        let record = serde_json::from_str::<Record<'_, Exchange>>(&line);
        record.ok().map(|record| record.event)
    });
    records.find_map(|event| match event {
        Noted::Member(exchange) => Some(exchange),
        Noted::Host(_) => None,
    })
}

/// Runs one process of the exchange: the yardstick, or the pattern over a link.
pub(crate) fn run_member(arguments: &MemberArguments) -> Answer {
    let part = match serde_json::from_str(&arguments.part) {
        Ok(part) => part,
        Err(error) => return Answer::failed(Status::BadInput, "U0607", error),
    };
    match play_part(part) {
        Ok(()) => Answer::done("", json!(null)),
        Err(error) => error.into(),
    }
}

fn play_part(part: Part) -> Result<(), BusError> {
    let Part { own, members, carrier, settings } = part;
    let roster = Roster::new(PROGRAMS.into(), STATIONS.into(), Vec::new());
    let endpoints = Endpoints::new(ClusterHash(u64::MAX), own, members, roster)?;
    let wanted = settings.cycles as usize;
    let meter = Meter::new(usize::from(STATIONS), u64::from(SKIPPED_CYCLES), wanted);
    match carrier {
        Carrier::Raw => run_raw(&endpoints, settings, meter),
        Carrier::Link(link) => {
            let member_settings = MemberSettings {
                changes: Changes::none(ConfigurationHash(0)),
                retention: Default::default(),
                guard: guard(&endpoints),
                endpoints,
                link,
                period: settings.period,
                channel: None,
                field: Box::new(NoField),
                commands: Commands::ReadAndEndWithInput,
                ends_with_parent: true,
                real_time: settings.real_time,
                spin: false,
            };
            let pattern = Pattern::new(own, settings.period, meter);
            understudy_bus::run_member(pattern, member_settings, io::stdout()).map(drop)
        }
    }
}

fn run_raw(endpoints: &Endpoints, settings: Settings, meter: Meter) -> Result<(), BusError> {
    set_pdeathsig(Signal::SIGKILL)
        .map_err(io::Error::from)
        .map_err(refused("to end with the process that started this one"))?;
    let own = endpoints.own().clone();
    let socket = UdpSocket::bind(own.address).map_err(refused("a socket"))?;
    let clock = Clock::start();
    let (mut sink, journal) =
        Journal::start::<Exchange>(1, clock, own.member, own.name, io::stdout())?;
    keep_times(settings.real_time);
    let exchange = play(own.member, &socket, endpoints, settings.period, meter)
        .map_err(refused("to carry a datagram"))?;
    sink.record(clock.now(), Noted::Member(exchange));
    drop(sink);
    journal.finish();
    Ok(())
}

/// All members of the pattern on free ports.
fn members() -> io::Result<Vec<Peer>> {
    let stations = (0..STATIONS).map(|rank| Member::Station(StationId(rank)));
    let remote_ios = (0..PROGRAMS).map(|program| Member::RemoteIo(ProgramId(program)));
    let members: Vec<Member> = stations.chain(remote_ios).collect();
    peers_of(members)
}
