//! One member as one process: what `understudy node`, `remote-io` and `plant` run.

use std::any::Any;
use std::io::Write;
use std::os::fd::AsFd;
use std::time::Duration;

use nix::sys::eventfd::{EfdFlags, EventFd};
use nix::sys::prctl::set_pdeathsig;
use nix::sys::signal::Signal;
use serde::Serialize;
use understudy_cycle::Machine;

use crate::changes::Changes;
use crate::channel::{Channel, ChannelSettings, DONE, followed};
use crate::clock::Clock;
use crate::control::{Commands, change_request, ending_signals, watch};
use crate::cores::OwnCore;
use crate::endpoints::Endpoints;
use crate::error::BusError;
use crate::field::FieldDriver;
use crate::guard::Guard;
use crate::host::{Host, Summary};
use crate::host_event::HostEvent;
use crate::journal::{EventSink, JOURNAL_RECORDS, JOURNAL_VERSION, Journal, Noted};
use crate::link::LinkKind;
use crate::network_reception::NetworkReception;
use crate::orders::{Order, orders};
use crate::retained::{CarriedOver, FoundFile, Retainer, Retention};
use crate::rights::{Rights, keep_times};
use crate::watchdog::Watchdog;

/// Dropped paths that a record lists.
const LISTED_PATHS: usize = 20;

/// What a process needs to know besides its member.
pub struct MemberSettings {
    /// Who is where.
    pub endpoints: Endpoints,
    /// What carries the frames.
    pub link: LinkKind,
    /// T, from one cycle to the next.
    pub period: Duration,
    /// Closes and opens the frames.
    pub guard: Guard,
    /// What it knows of online changes.
    pub changes: Changes,
    /// Where operators can call; nowhere without it.
    pub channel: Option<ChannelSettings>,
    /// What it keeps for the time after a power failure.
    pub retention: Retention,
    /// Sensors and actuators.
    pub field: Box<dyn FieldDriver>,
    /// Whether commands are read from standard input.
    pub commands: Commands,
    /// Whether the process is killed when the thread that started it ends (PR_SET_PDEATHSIG).
    pub ends_with_parent: bool,
    /// Whether SCHED_FIFO and locked memory are asked for.
    pub real_time: bool,
    /// Whether the member waits actively within the turn window, where it has a core of its own.
    pub spin: bool,
}

/// Runs a member until it is told to stop by a command, by SIGINT or SIGTERM, or by the end of standard input.
///
/// To be called from the main thread, before any other is started. Each report is one line of JSON on `output`
/// ([`crate::Record`]); the first is [`HostEvent::Ready`], the last [`HostEvent::Stopped`].
///
/// # Errors
/// [`BusError::PortInUse`], [`BusError::Listen`] or [`BusError::Zenoh`] where there is no link; [`BusError::System`] where the
/// system refuses what every process needs; [`BusError::Panicked`] where the cycle panics. Rights that are lacking are no error;
/// the ready record names them.
pub fn run_member<M>(
    mut machine: M,
    settings: MemberSettings,
    output: impl Write + Send + 'static,
) -> Result<Summary, BusError>
where
    M: Machine + Send,
    M::Event: Serialize + Send + 'static,
{
    let clock = Clock::start();
    let MemberSettings {
        endpoints,
        link: kind,
        period,
        mut guard,
        changes,
        channel,
        retention,
        mut field,
        commands,
        ends_with_parent,
        real_time,
        spin,
    } = settings;
    if ends_with_parent {
        end_with_parent()?;
    }
    let signals = ending_signals()?;
    let finished = EventFd::from_flags(EfdFlags::EFD_CLOEXEC)
        .map_err(BusError::system("an eventfd for the end"))?;
    let own = endpoints.own().clone();
    let span = tracing::error_span!("member", member = %own.name);
    let _member = span.clone().entered();
    let (output, telemetry): (Box<dyn Write + Send>, _) = match channel {
        Some(settings) => {
            let (output, telemetry) = followed(output, settings.changes.clone());
            (Box::new(output), Some((settings, telemetry)))
        }
        None => (Box::new(output), None),
    };
    // The journal's thread starts before the rights are claimed, so that it inherits none.
    let (mut sink, journal) =
        Journal::start::<M::Event>(JOURNAL_RECORDS, clock, own.member, own.name.clone(), output)?;
    let Retention { files, found, carried, is_missing } = retention;
    let retainer = match files.is_empty() {
        true => None,
        false => Some(Retainer::start(files)?),
    };
    let mut rights = if real_time { Rights::claim() } else { Rights::unclaimed() };
    let raises = rights.real_time;
    let mut link = kind.open(&endpoints)?;
    let networks = NetworkReception::of(clock.now(), period, &endpoints);
    if real_time {
        rights.lock();
    }
    let core = if spin { rights.claim_core() } else { None };
    let ready = HostEvent::Ready {
        version: JOURNAL_VERSION,
        process: std::process::id(),
        address: link.address(),
        link: kind,
        rights,
    };
    let watchdog = Watchdog::of_environment();
    if let Some(watchdog) = &watchdog {
        watchdog.ready();
    }
    let status = serde_json::to_string(&ready).unwrap_or_default();
    sink.record(clock.now(), Noted::Host(ready));
    if is_missing {
        let reason = "no folder was given for it (--retain)".to_owned();
        sink.record(clock.now(), Noted::Host(HostEvent::RetainFailed { reason }));
    }
    for FoundFile { path, problem } in found {
        if let Some(reason) = problem {
            let file = path.display().to_string();
            sink.record(clock.now(), Noted::Host(HostEvent::RetainedRefused { file, reason }));
        }
    }
    for CarriedOver { program, kept, converted, new, mut dropped } in carried {
        let more = dropped.len().saturating_sub(LISTED_PATHS);
        dropped.truncate(LISTED_PATHS);
        let carried = HostEvent::RetainedCarried { program: program.clone(), kept, converted, new };
        if kept + converted + new > 0 {
            sink.record(clock.now(), Noted::Host(carried));
        }
        if !dropped.is_empty() {
            let dropped = HostEvent::RetainedDropped { program, paths: dropped, more };
            sink.record(clock.now(), Noted::Host(dropped));
        }
    }
    let (control, orders) = orders()?;
    let channel = telemetry.map(|(settings, telemetry)| {
        let (control, sink) = (control.clone(), sink.clone());
        Channel::start(settings, &endpoints, status, control, telemetry, sink, clock)
    });
    let channel = channel.transpose()?;
    let mut noted = sink.clone();
    let finished_here = &finished;
    let summary = std::thread::scope(|scope| {
        let cycle = std::thread::Builder::new()
            .name("cycle".into())
            .spawn_scoped(scope, move || {
                let _finished = Finished(finished_here);
                let _member = span.entered();
                keep_times(raises);
                let held = core.as_ref().map(OwnCore::hold);
                if let Some(Err(error)) = &held {
                    tracing::warn!(error, "U0511: the member waits without spinning");
                }
                Host {
                    machine: &mut machine,
                    link: link.as_mut(),
                    networks,
                    guard: &mut guard,
                    field: field.as_mut(),
                    retainer,
                    sink: &mut sink,
                    watchdog,
                    orders: &orders,
                    clock,
                    spins: matches!(held, Some(Ok(()))),
                }
                .run()
            })
            .map_err(|source| BusError::System { what: "a thread for the cycle", source })?;
        let watched = watch(commands, &signals, finished.as_fd(), &control, |line| {
            let event = match change_request(&line) {
                Some(request) => {
                    let said = changes.take(&control, &request);
                    let refused = (said != DONE).then_some(said);
                    HostEvent::ChangeOrdered { step: request.words(), refused }
                }
                None => HostEvent::UnknownCommand { line },
            };
            noted.record(clock.now(), Noted::Host(event));
        });
        if watched.is_err() {
            control.give(Order::Stop);
        }
        let ran = cycle
            .join()
            .unwrap_or_else(|panic| Err(BusError::Panicked { message: said(panic.as_ref()) }));
        watched.and(ran)
    });
    drop(noted);
    if let Some(channel) = &channel {
        channel.stop();
    }
    let unwritten = journal.finish();
    if unwritten > 0 {
        tracing::error!(unwritten, "records are missing in the journal");
    }
    summary
}

/// The system kills this process when the thread that started it ends.
///
/// # Errors
/// [`BusError::System`] where the system refuses it.
pub fn end_with_parent() -> Result<(), BusError> {
    set_pdeathsig(Signal::SIGKILL)
        .map_err(BusError::system("to end with the process that started this one"))
}

/// Tells the main thread that the cycle has ended, also where it ends by a panic.
struct Finished<'a>(&'a EventFd);

impl Drop for Finished<'_> {
    fn drop(&mut self) {
        // A new eventfd takes one write.
        let _ = self.0.write(1);
    }
}

fn said(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied();
    let text = text.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("(without words)").to_owned()
}
