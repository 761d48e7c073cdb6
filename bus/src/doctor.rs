//! What a machine lacks that a party is to run on, each with its remedy.
//!
//! Nothing is changed, and no frame is sent: peers are found by listening for as long as they surely speak.

use std::collections::BTreeMap;
use std::net::{SocketAddr, TcpListener, UdpSocket};
use std::time::Duration;

use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::resource::{Resource, getrlimit};
use nix::sys::time::TimeSpec;
use serde::Serialize;
use understudy_wire::{ConfigurationHash, Party};

use crate::clock::Clock;
use crate::endpoints::Endpoints;
use crate::error::BusError;
use crate::guard::Guard;
use crate::link::LinkKind;
use crate::rights::{CYCLE_PRIORITY, lock_memory, run_in_real_time};
use crate::wakefulness::Wakefulness;

/// For so long wake-ups are measured.
const SPAN: Duration = Duration::from_secs(1);

/// Clocks that take long to read, or are too coarse.
const SLOW_CLOCKS: [&str; 4] = ["hpet", "acpi_pm", "jiffies", "refined-jiffies"];
const CLOCK_SOURCE: &str = "/sys/devices/system/clocksource/clocksource0/current_clocksource";

/// How something stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Health {
    /// As it should be.
    Good,
    /// It works, and could be better.
    Warning,
    /// The party would not start, or not do its part.
    Bad,
}

/// One thing that was looked at.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// What: `clock`, `scheduler`, `memory`, `ports`, `keys`, `configuration` or `peer`.
    pub check: &'static str,
    /// How it stands.
    pub health: Health,
    /// What was found, with the numbers and names concerned.
    pub found: String,
    /// What to do about it, where something is to be done.
    pub remedy: Option<String>,
}

impl Finding {
    /// As it should be.
    pub fn good(check: &'static str, found: impl Into<String>) -> Self {
        Self {
            check,
            health: Health::Good,
            found: found.into(),
            remedy: None,
        }
    }

    /// Not as it should be.
    pub fn trouble(
        check: &'static str,
        health: Health,
        found: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self {
            check,
            health,
            found: found.into(),
            remedy: Some(remedy.into()),
        }
    }
}

/// Clock, scheduler rights and memory, for cycles of `period`.
pub fn examine_machine(period: Duration) -> Vec<Finding> {
    vec![clock_source(), scheduler(), memory(), sleeps(period)]
}

fn clock_source() -> Finding {
    let Ok(text) = std::fs::read_to_string(CLOCK_SOURCE) else {
        return Finding::good("clock", "the kernel does not say which clock it uses");
    };
    let name = text.trim();
    if SLOW_CLOCKS.contains(&name) {
        Finding::trouble(
            "clock",
            Health::Warning,
            format!("the clock source is {name}, which takes long to read"),
            format!(
                "boot with `clocksource=tsc`, or write `tsc` to {CLOCK_SOURCE} where it is listed as available"
            ),
        )
    } else {
        Finding::good("clock", format!("the clock source is {name}"))
    }
}

fn scheduler() -> Finding {
    // In a thread of its own: the rest of the examination is no real-time work.
    let tried = std::thread::spawn(|| run_in_real_time(CYCLE_PRIORITY)).join();
    match tried.unwrap_or_else(|_| Err("the attempt ended by itself".to_owned())) {
        Ok(()) => Finding::good(
            "scheduler",
            format!("SCHED_FIFO {CYCLE_PRIORITY} is granted"),
        ),
        Err(error) => Finding::trouble(
            "scheduler",
            Health::Warning,
            format!("no SCHED_FIFO ({error}): other programs delay the cycle"),
            "grant CAP_SYS_NICE: `AmbientCapabilities=CAP_SYS_NICE` in the unit, or `setcap cap_sys_nice+ep` on the program; root is not needed",
        ),
    }
}

fn memory() -> Finding {
    match lock_memory() {
        Ok(()) => Finding::good("memory", "memory can be locked"),
        Err(reason) => {
            let limit = getrlimit(Resource::RLIMIT_MEMLOCK).map_or(0, |(soft, _)| soft);
            Finding::trouble(
                "memory",
                Health::Warning,
                format!(
                    "memory is not locked ({reason}; the limit is {limit} bytes): paging may delay the cycle"
                ),
                "`LimitMEMLOCK=infinity` in the unit, or `ulimit -l unlimited`",
            )
        }
    }
}

/// How late sleepers are woken, which is what a cycle feels of everything above.
fn sleeps(period: Duration) -> Finding {
    let measured = Wakefulness::measure(SPAN, true);
    let found = format!("{measured}; a cycle has {} ms", period.as_secs_f64() * 1e3);
    if measured.keeps(period) {
        Finding::good("clock", found)
    } else {
        Finding::trouble(
            "clock",
            Health::Warning,
            found,
            format!(
                "a `period` of {} ms, real-time rights, a kernel with PREEMPT_RT, processors kept free of other work (`isolcpus`), or a machine that is not virtual",
                measured.period().as_millis()
            ),
        )
    }
}

/// Whether a party can listen where it should: for its frames over `link`, and by TCP for its operators.
pub fn examine_ports(endpoints: &Endpoints, link: LinkKind) -> Vec<Finding> {
    let operators = endpoints.own().address;
    let frames = match link.frames_address(operators) {
        Ok(frames) => frames,
        Err(error) => {
            return vec![Finding::trouble(
                "ports",
                Health::Bad,
                error.to_string(),
                "another port in the cluster file, or `link = \"udp\"`",
            )];
        }
    };
    let bound = match link {
        LinkKind::Udp => ("UDP", frames, UdpSocket::bind(frames).map(drop)),
        LinkKind::Zenoh => ("TCP", frames, TcpListener::bind(frames).map(drop)),
    };
    let bound = [
        bound,
        ("TCP", operators, TcpListener::bind(operators).map(drop)),
    ];
    let finding = |(protocol, address, bound): (&str, SocketAddr, std::io::Result<()>)| match bound
    {
        Ok(()) => Finding::good("ports", format!("{address} is free ({protocol})")),
        Err(source) => match BusError::listen(address, source) {
            BusError::PortInUse { .. } => Finding::trouble(
                "ports",
                Health::Warning,
                format!("{address} is in use ({protocol})"),
                format!(
                    "none where this party runs already; otherwise `ss -lpn 'sport = :{}'` names who has it",
                    address.port()
                ),
            ),
            error => Finding::trouble(
                "ports",
                Health::Bad,
                error.to_string(),
                "`ip address` lists the addresses of this machine; the cluster file has to name one of them for this party",
            ),
        },
    };
    bound.into_iter().map(finding).collect()
}

/// What a firewall has to let through to the member with this address.
fn ports_of(link: LinkKind, address: SocketAddr) -> String {
    match link.frames_address(address) {
        Ok(frames) if link == LinkKind::Zenoh => {
            format!("TCP ports {} and {}", address.port(), frames.port())
        }
        _ => format!("UDP and TCP port {}", address.port()),
    }
}

/// Listens in the place of a party that does not run, for so long, and says of each peer whether it was heard.
///
/// # Errors
/// As [`LinkKind::open`] has; [`BusError::PortInUse`] where the party runs.
pub fn examine_peers(
    endpoints: &Endpoints,
    link: LinkKind,
    guard: &mut Guard,
    configuration: ConfigurationHash,
    patience: Duration,
) -> Result<Vec<Finding>, BusError> {
    let mut opened = link.open(endpoints)?;
    let clock = Clock::start();
    let end = clock.now() + patience;
    let mut heard: BTreeMap<Party, ConfigurationHash> = BTreeMap::new();
    let mut refused: BTreeMap<Option<Party>, String> = BTreeMap::new();
    let expected = endpoints.heard().count();
    let mut bytes = Vec::new();
    while clock.now() < end && heard.len() < expected {
        while opened.receive(&mut bytes) {
            match guard.open(&mut bytes) {
                Ok(Some(frame)) if frame.header.cluster == endpoints.cluster() => {
                    heard.insert(frame.header.sender, frame.header.configuration);
                }
                Ok(_) => {}
                Err(reason) => {
                    refused.insert(reason.sender, reason.reason);
                }
            }
        }
        let mut descriptors = [PollFd::new(opened.readiness(), PollFlags::POLLIN)];
        let left = TimeSpec::from_duration(end.since(clock.now()));
        ppoll(&mut descriptors, Some(left), None)
            .map(drop)
            .or_else(|error| match error {
                nix::errno::Errno::EINTR => Ok(()),
                error => Err(BusError::system("to wait for frames")(error)),
            })?;
    }
    Ok(endpoints
        .heard()
        .map(|(peer, _)| {
            let name = format!("{} ({})", peer.name, peer.address);
            match (heard.get(&peer.party), refused.get(&Some(peer.party))) {
                (Some(theirs), _) if *theirs == configuration => {
                    Finding::good("peer", format!("{name} is heard"))
                }
                (Some(theirs), _) => Finding::trouble(
                    "configuration",
                    Health::Bad,
                    format!("{name} runs configuration {theirs}, and this is {configuration}"),
                    "copy one cluster file and its ladders to every machine; `understudy check` shows the hash",
                ),
                (None, Some(reason)) => Finding::trouble(
                    "peer",
                    Health::Bad,
                    format!("{name} is heard and not believed: {reason}"),
                    "issue its keys again and copy the changed folders to every machine",
                ),
                (None, None) => Finding::trouble(
                    "peer",
                    Health::Warning,
                    format!("{name} was not heard for {} ms", patience.as_millis()),
                    format!("start it; where it runs, check the network (`ping {}`) and the firewall ({})", peer.address.ip(), ports_of(link, peer.address)),
                ),
            }
        })
        .chain(refused.get(&None).map(|reason| {
            Finding::trouble(
                "peer",
                Health::Warning,
                format!("something else arrives at {}: {reason}", endpoints.own().address),
                "find who sends it; a party without keys, or another program",
            )
        }))
        .collect())
}
