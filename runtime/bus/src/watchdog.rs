//! Signs of life for systemd: `Type=notify` and `WatchdogSec=` of a unit.
//!
//! Invariant: a sign is given from the loop of the cycle itself, and only where the member keeps its own times: it was woken for one, or it
//! rests and the next comes before systemd's patience ends. (A plant that is driven in every cycle is never woken: its time comes only
//! where an actuation does not.) A loop that hangs, that is kept from its times by a flood, or that waits for nothing is not
//! alive, and systemd starts the member again. Whether other members are there makes no difference: a remote I/O that holds its outputs
//! alone is well.

use std::env;
use std::io;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::time::Duration;

use understudy_wire::Time;

/// Signs in the time after which systemd believes a member dead.
const SIGNS: u32 = 4;

/// Signs of life of this process: the socket that takes them, and how often systemd asks for one.
#[derive(Debug)]
pub struct Watchdog {
    socket: UnixDatagram,
    timeout: Option<Duration>,
    last: Option<Time>,
}

impl Watchdog {
    /// Of this process, where systemd started it and asks for signs.
    pub(crate) fn of_environment() -> Option<Self> {
        let path = env::var("NOTIFY_SOCKET").ok()?;
        let microseconds = env::var("WATCHDOG_USEC").ok();
        let microseconds = microseconds.and_then(|text| text.parse().ok());
        Self::at(&path, microseconds.map(Duration::from_micros)).ok()
    }

    fn at(path: &str, timeout: Option<Duration>) -> io::Result<Self> {
        let address = match path.strip_prefix('@') {
            Some(name) => SocketAddr::from_abstract_name(name)?,
            None => SocketAddr::from_pathname(path)?,
        };
        let socket = UnixDatagram::unbound()?;
        socket.connect_addr(&address)?;
        // A systemd that does not read must not stop a cycle.
        socket.set_nonblocking(true)?;
        Ok(Self { socket, timeout: timeout.filter(|timeout| !timeout.is_zero()), last: None })
    }

    /// It listens, and its cycle starts.
    pub(crate) fn ready(&self) {
        self.say("READY=1\nSTATUS=the cycle runs");
    }

    /// The member ends.
    pub(crate) fn stopping(&self) {
        self.say("STOPPING=1");
    }

    /// The member was woken for one of its own times.
    pub(crate) fn woken(&mut self, now: Time) {
        let Some(timeout) = self.timeout else {
            return;
        };
        if self.last.is_none_or(|last| now.since(last) >= timeout / SIGNS) {
            self.last = Some(now);
            self.say("WATCHDOG=1");
        }
    }

    /// The member has nothing left to do, and sleeps until its own next time, `until`, or until something comes.
    pub(crate) fn rests(&mut self, now: Time, until: Time) {
        if self.timeout.is_some_and(|timeout| until.since(now) < timeout) {
            self.woken(now);
        }
    }

    fn say(&self, text: &str) {
        // One that is not taken is missed like a cycle that did not run.
        if let Err(error) = self.socket.send(text.as_bytes()) {
            tracing::warn!(%error, "systemd was not told that the member is alive");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn systemd(name: &str) -> (String, UnixDatagram) {
        let name = format!("understudy-watchdog-{name}-{}", std::process::id());
        let address = SocketAddr::from_abstract_name(&name).expect("a short name");
        let socket = UnixDatagram::bind_addr(&address).expect("nobody else has it");
        socket.set_nonblocking(true).expect("it is a socket");
        (format!("@{name}"), socket)
    }

    fn said(socket: &UnixDatagram) -> Vec<String> {
        let mut said = Vec::new();
        let mut bytes = [0; 256];
        while let Ok(length) = socket.recv(&mut bytes) {
            said.push(String::from_utf8_lossy(&bytes[..length]).into_owned());
        }
        said
    }

    #[test]
    fn signs_are_given_while_the_member_is_woken_and_not_too_often() {
        let (path, socket) = systemd("signs");
        let timeout = Some(Duration::from_millis(400));
        let mut watchdog = Watchdog::at(&path, timeout).expect("somebody listens");
        watchdog.ready();
        // The system keeps some few datagrams only, so they are taken as they come.
        let mut all = said(&socket);
        for milliseconds in 0..1000 {
            watchdog.woken(Time(0) + Duration::from_millis(milliseconds));
            all.extend(said(&socket));
        }
        watchdog.stopping();
        all.extend(said(&socket));
        assert_eq!(all.first().map(|text| &text[..7]), Some("READY=1"));
        let signs = all.iter().filter(|text| *text == "WATCHDOG=1").count();
        assert_eq!(signs, 10);
        assert_eq!(all.last().map(String::as_str), Some("STOPPING=1"));
    }

    /// A plant whose next time is put off in every cycle, and a member that has none any more.
    #[test]
    fn a_member_that_rests_lives_if_it_has_a_time_to_come() {
        let (path, socket) = systemd("rests");
        let timeout = Duration::from_millis(400);
        let mut watchdog = Watchdog::at(&path, Some(timeout)).expect("somebody listens");
        let mut signs = |next: Duration, times: std::ops::Range<u64>| {
            let mut all = Vec::new();
            for milliseconds in times {
                let now = Time(0) + Duration::from_millis(milliseconds);
                watchdog.rests(now, now + next);
                all.extend(said(&socket));
            }
            all.len()
        };
        assert_eq!(signs(Duration::from_millis(15), 0..1000), 10);
        assert_eq!(signs(timeout, 1000..2000), 0);
        assert_eq!(signs(Duration::from_millis(399), 2000..2001), 1);
    }

    #[test]
    fn without_a_timeout_no_signs_are_asked_for() {
        let (path, socket) = systemd("none");
        let mut watchdog = Watchdog::at(&path, None).expect("somebody listens");
        watchdog.woken(Time(0));
        assert_eq!(said(&socket), Vec::<String>::new());
        assert!(Watchdog::at("@nobody-listens-here", None).is_err());
    }
}
