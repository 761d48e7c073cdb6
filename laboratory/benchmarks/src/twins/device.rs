//! A Modbus TCP device that records each write, and who writes it.
//!
//! A writer is a connection. Two writers at one time are found by their order: once a connection has written, an earlier one must not write any more.
//!
//! The order is that in which the kernel of this host has received the requests, by its own time stamps. Threads of the device may be late on a busy
//! machine, each by another time; that changes nothing of the order. They run in real time where the system grants it, as a device with a processor of its own
//! does, and the slowest answer is recorded: a remote I/O gives a device up that does not answer in time, and that is none of its failures.

use std::io::{self, ErrorKind, IoSliceMut, Read, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::os::fd::AsRawFd;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use nix::cmsg_space;
use nix::sys::socket::{ControlMessageOwned, MsgFlags, recv, recvmsg, setsockopt, sockopt};
use nix::sys::time::TimeSpec;
use nix::time::{ClockId, clock_gettime};
use understudy_bus::keep_times;
use understudy_journal::monotonic_ns;

use super::judge::Write;

/// Time within which a remote I/O wants an answer, and ends the connection otherwise: the `timeout` of a field device.
pub(super) const TIMEOUT: Duration = Duration::from_millis(100);

/// Coils and discrete inputs.
const POINTS: usize = 64;

/// Time for which the inputs keep their values.
const INPUTS_CHANGE: Duration = Duration::from_millis(300);

/// Time within which the connections of processes that have ended are read to their end.
const READ_TO_END: Duration = Duration::from_secs(20);

/// Time within which the kernel begins to stamp what is received.
const STAMPS_BEGIN: Duration = Duration::from_secs(5);

/// By how much the wall clock may move against the monotonic one, which orders the records of the members.
const CLOCK_TOLERANCE_NS: u64 = 1_000_000;

/// What was recorded.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Recorded {
    /// Its coils after each write.
    pub(super) writes: Vec<Write>,
    /// Connections that have written.
    pub(super) writers: u64,
    /// When a connection has written after a later one, in ns of the monotonic clock.
    pub(super) by_two: Vec<u64>,
    /// Longest time from a request to its answer, in ns.
    pub(super) slowest_ns: u64,
}

/// A request to write, as it was received.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Request {
    at_ns: u64,
    /// From when on it may have been received.
    since_ns: u64,
    connection: u64,
    /// The coils that it writes.
    coils: u64,
    values: u64,
}

/// What the requests have come to, in the order in which they were received.
#[derive(Debug, Default)]
struct Written {
    coils: u64,
    /// The newest connection that has written.
    writer: Option<u64>,
}

impl Written {
    fn take(&mut self, mut requests: Vec<Request>) -> Recorded {
        // Those of one connection are in its order.
        requests.sort_by_key(|request| request.at_ns);
        let mut recorded = Recorded::default();
        for Request { at_ns, since_ns, connection, coils, values } in requests {
            self.coils = self.coils & !coils | values;
            if self.writer.is_some_and(|newest| connection < newest) {
                recorded.by_two.push(at_ns);
            } else if self.writer != Some(connection) {
                recorded.writers += 1;
                self.writer = Some(connection);
            }
            recorded.writes.push(Write { at_ns, since_ns, coils: self.coils });
        }
        recorded
    }
}

#[derive(Debug, Default)]
struct State {
    /// Its coils as it answers them.
    coils: u64,
    requests: Vec<Request>,
    slowest_ns: u64,
    /// Connections that are read.
    open: u64,
    written: Written,
}

/// The device; it ends with the process.
#[derive(Debug, Clone)]
pub(super) struct Device {
    pub(super) address: SocketAddr,
    /// When its inputs began to change.
    began: Instant,
    /// The wall clock, which stamps what is received, less the monotonic one.
    ahead_ns: u64,
    state: Arc<Mutex<State>>,
}

/// The wall clock less the monotonic one: read again until nothing came between the two.
fn wall_clock_ahead_ns() -> io::Result<u64> {
    let reading = |_: u32| -> io::Result<(u64, u64)> {
        let before = monotonic_ns();
        let wall = stamp_ns(clock_gettime(ClockId::CLOCK_REALTIME)?);
        let after = monotonic_ns();
        Ok((after - before, wall.saturating_sub(before)))
    };
    let readings = (0..20).map(reading).collect::<io::Result<Vec<_>>>()?;
    let best = readings.into_iter().min_by_key(|(took, _)| *took);
    Ok(best.map_or(0, |(_, ahead)| ahead))
}

fn stamp_ns(time: TimeSpec) -> u64 {
    let seconds = u64::try_from(time.tv_sec()).unwrap_or(0);
    seconds.saturating_mul(1_000_000_000).saturating_add(u64::try_from(time.tv_nsec()).unwrap_or(0))
}

/// A connection that is read with the time at which each request was received.
struct Connection {
    stream: TcpStream,
    buffer: Vec<u8>,
    /// When the kernel received the newest bytes of the buffer, by the wall clock.
    received_ns: u64,
}

impl Connection {
    /// The next request: its head, and its function with what follows; nothing where the connection is over.
    fn next(&mut self) -> io::Result<Option<([u8; 7], Vec<u8>)>> {
        loop {
            if let Some(head) = self.buffer.first_chunk::<7>().copied() {
                // The length counts the unit too.
                let length = usize::from(u16::from_be_bytes([head[4], head[5]])).clamp(2, 260);
                if self.buffer.len() >= 6 + length {
                    let request = self.buffer[7..6 + length].to_vec();
                    self.buffer.drain(..6 + length);
                    return Ok(Some((head, request)));
                }
            }
            if !self.receive()? {
                return Ok(None);
            }
        }
    }

    /// Whether nothing more comes; it does not wait.
    fn has_ended(&self) -> bool {
        let flags = MsgFlags::MSG_PEEK | MsgFlags::MSG_DONTWAIT;
        self.buffer.is_empty() && recv(self.stream.as_raw_fd(), &mut [0], flags) == Ok(0)
    }

    /// Whether more was received.
    fn receive(&mut self) -> io::Result<bool> {
        let (bytes, stamp) = received(&self.stream)?;
        if bytes.is_empty() {
            return Ok(false);
        }
        let missing = || io::Error::new(ErrorKind::Unsupported, "the kernel stamps no time");
        self.received_ns = stamp.ok_or_else(missing)?;
        self.buffer.extend(bytes);
        Ok(true)
    }
}

/// The next bytes of a connection, none where it is over, and when the kernel received them, by the wall clock.
fn received(stream: &TcpStream) -> io::Result<(Vec<u8>, Option<u64>)> {
    let mut bytes = [0; 512];
    let mut space = cmsg_space!(TimeSpec);
    let mut into = [IoSliceMut::new(&mut bytes)];
    let received = loop {
        match recvmsg::<()>(stream.as_raw_fd(), &mut into, Some(&mut space), MsgFlags::empty()) {
            Err(nix::errno::Errno::EINTR) => {}
            other => break other?,
        }
    };
    let length = received.bytes;
    let stamp = received.cmsgs()?.find_map(|message| match message {
        ControlMessageOwned::ScmTimestampns(stamp) => Some(stamp_ns(stamp)),
        _ => None,
    });
    Ok((bytes[..length].to_vec(), stamp))
}

/// Waits until the kernel stamps what the connections of this listener receive: it begins to some time after it is asked to, and what it receives before
/// has no time.
fn await_stamps(listener: &TcpListener) -> io::Result<()> {
    let mut sender = TcpStream::connect(listener.local_addr()?)?;
    let (receiver, _) = listener.accept()?;
    let until = Instant::now() + STAMPS_BEGIN;
    loop {
        sender.write_all(&[0])?;
        if let (_, Some(_)) = received(&receiver)? {
            return Ok(());
        }
        if Instant::now() > until {
            return Err(io::Error::new(ErrorKind::Unsupported, "the kernel stamps no time"));
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}

impl Device {
    /// A device on a free port of this machine.
    ///
    /// # Errors
    /// No port can be opened.
    pub(super) fn start() -> io::Result<Self> {
        Self::since(Instant::now())
    }

    /// Another device at the same sensors.
    ///
    /// # Errors
    /// No port can be opened.
    pub(super) fn beside(&self) -> io::Result<Self> {
        Self::since(self.began)
    }

    fn since(began: Instant) -> io::Result<Self> {
        let listener = TcpListener::bind("127.0.0.1:0")?;
        // Connections inherit it.
        setsockopt(&listener, sockopt::ReceiveTimestampns, &true)?;
        await_stamps(&listener)?;
        let device = Self {
            address: listener.local_addr()?,
            began,
            ahead_ns: wall_clock_ahead_ns()?,
            state: Arc::default(),
        };
        let served = device.clone();
        std::thread::spawn(move || {
            for (number, stream) in (0..).zip(listener.incoming().flatten()) {
                let served = served.clone();
                served.state().open += 1;
                std::thread::spawn(move || {
                    // A connection ends as its process does.
                    let _ = served.serve(stream, number);
                    served.state().open -= 1;
                });
            }
        });
        Ok(device)
    }

    /// What was received since the last call, of processes that have ended; the connections stay known.
    ///
    /// # Errors
    /// A connection is still open, or the wall clock was set meanwhile.
    pub(super) fn take(&self) -> io::Result<Recorded> {
        // Connections are accepted in their order: once this one is answered, all earlier ones are read.
        let mut last = TcpStream::connect(self.address)?;
        last.write_all(&[0, 0, 0, 0, 0, 6, 1, 1, 0, 0, 0, 1])?;
        last.read_exact(&mut [0; 10])?;
        drop(last);
        let until = Instant::now() + READ_TO_END;
        while self.state().open > 0 {
            if Instant::now() > until {
                return Err(io::Error::new(ErrorKind::TimedOut, "a connection is still open"));
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        if wall_clock_ahead_ns()?.abs_diff(self.ahead_ns) > CLOCK_TOLERANCE_NS {
            return Err(io::Error::other("the wall clock was set during the run"));
        }
        let mut state = self.state();
        let requests = std::mem::take(&mut state.requests);
        let slowest_ns = std::mem::take(&mut state.slowest_ns);
        Ok(Recorded { slowest_ns, ..state.written.take(requests) })
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn serve(&self, stream: TcpStream, number: u64) -> io::Result<()> {
        stream.set_nodelay(true)?;
        keep_times(true);
        let mut connection = Connection { stream, buffer: Vec::new(), received_ns: 0 };
        while let Some((head, request)) = connection.next()? {
            let at_ns = connection.received_ns.saturating_sub(self.ahead_ns);
            // The kernel stamps bytes that are unread with the end of their connection.
            let unread = if connection.has_ended() { TIMEOUT.as_nanos() as u64 } else { 0 };
            let answer = self.answer(&request, (at_ns, at_ns.saturating_sub(unread)), number);
            let length = (answer.len() as u16 + 1).to_be_bytes();
            let frame = [&head[..4], &length, &head[6..], &answer].concat();
            connection.stream.write_all(&frame)?;
            let took_ns = monotonic_ns().saturating_sub(at_ns);
            let mut state = self.state();
            state.slowest_ns = state.slowest_ns.max(took_ns);
        }
        Ok(())
    }

    fn answer(&self, request: &[u8], received: (u64, u64), connection: u64) -> Vec<u8> {
        let number = |at: usize| match request.get(at..at + 2) {
            Some(&[high, low]) => usize::from(u16::from_be_bytes([high, low])),
            _ => POINTS,
        };
        let function = request[0];
        let (first, count) = (number(1), if function == 5 { 1 } else { number(3) });
        if first + count > POINTS {
            return vec![function | 0x80, 2];
        }
        match function {
            1 | 2 => {
                let coils = self.state().coils;
                let tick = self.began.elapsed().as_millis() / INPUTS_CHANGE.as_millis();
                let bit = |at: usize| match function {
                    1 => coils >> at & 1 == 1,
                    _ => tick.wrapping_mul(0x9E37_79B9) >> (at + 3) & 1 == 1,
                };
                let mut bytes = vec![0_u8; count.div_ceil(8)];
                for at in (0..count).filter(|at| bit(first + at)) {
                    bytes[at / 8] |= 1 << (at % 8);
                }
                [vec![function, bytes.len() as u8], bytes].concat()
            }
            5 => {
                self.write(received, connection, first, &[number(3) == 0xFF00]);
                request.to_vec()
            }
            15 => {
                let bytes = request.get(6..).unwrap_or_default();
                let bit =
                    |at: usize| bytes.get(at / 8).is_some_and(|byte| byte >> (at % 8) & 1 == 1);
                let values: Vec<bool> = (0..count).map(bit).collect();
                self.write(received, connection, first, &values);
                request[..5].to_vec()
            }
            _ => vec![function | 0x80, 1],
        }
    }

    fn write(&self, (at_ns, since_ns): (u64, u64), connection: u64, first: usize, new: &[bool]) {
        let places = || new.iter().zip(first..);
        let coils = places().map(|(_, place)| 1 << place).sum::<u64>();
        let values = places().filter(|(on, _)| **on).map(|(_, place)| 1 << place).sum::<u64>();
        let mut state = self.state();
        state.coils = state.coils & !coils | values;
        state.requests.push(Request { at_ns, since_ns, connection, coils, values });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ask(stream: &mut TcpStream, request: &[u8]) -> Vec<u8> {
        let length = (request.len() as u16 + 1).to_be_bytes();
        let frame = [&[0, 1, 0, 0][..], &length, &[1], request].concat();
        stream.write_all(&frame).expect("written");
        let mut header = [0; 7];
        stream.read_exact(&mut header).expect("an answer");
        let mut answer = vec![0; usize::from(u16::from_be_bytes([header[4], header[5]])) - 1];
        stream.read_exact(&mut answer).expect("an answer");
        answer
    }

    #[test]
    fn a_write_of_an_earlier_connection_is_found() {
        let device = Device::start().expect("a port");
        let began = monotonic_ns();
        let mut first = TcpStream::connect(device.address).expect("connected");
        let on = [15, 0, 2, 0, 3, 1, 0b101];
        assert_eq!(ask(&mut first, &on), [15, 0, 2, 0, 3]);
        assert_eq!(ask(&mut first, &[1, 0, 0, 0, 8]), [1, 1, 0b10100]);
        let mut second = TcpStream::connect(device.address).expect("connected");
        assert_eq!(ask(&mut second, &[5, 0, 2, 0, 0]), [5, 0, 2, 0, 0]);
        assert_eq!(ask(&mut second, &[1, 0, 0, 0, 8]), [1, 1, 0b10000]);
        ask(&mut first, &on);
        assert_eq!(ask(&mut first, &[15, 0, 63, 0, 3, 1, 1]), [0x8F, 2], "beyond its coils");
        drop((first, second));
        let recorded = device.take().expect("all connections are over");
        assert_eq!((recorded.writers, recorded.by_two.len()), (2, 1));
        let coils: Vec<u64> = recorded.writes.iter().map(|write| write.coils).collect();
        assert_eq!(coils, [0b10100, 0b10000, 0b10100]);
        let (times, ended) = (recorded.writes.iter().map(|it| it.at_ns), monotonic_ns());
        let tolerance = CLOCK_TOLERANCE_NS;
        let is_within = |at: u64| began <= at + tolerance && at <= ended + tolerance;
        assert!(times.clone().is_sorted() && times.clone().all(is_within), "{began} {recorded:?}");
        assert!(recorded.slowest_ns > 0);
        let nothing = device.take().expect("none is open");
        assert_eq!((nothing.writes, nothing.writers, nothing.by_two), (vec![], 0, vec![]));
    }

    /// Whichever thread is late: the order is that of the kernel.
    #[test]
    fn requests_count_in_the_order_in_which_they_were_received() {
        let request = |at_ns, connection, values| Request {
            at_ns,
            since_ns: at_ns,
            connection,
            coils: 3,
            values,
        };
        let mut written = Written::default();
        let late = vec![request(30, 1, 2), request(10, 0, 1), request(20, 0, 3), request(40, 1, 0)];
        let recorded = written.take(late);
        let coils: Vec<u64> = recorded.writes.iter().map(|write| write.coils).collect();
        assert_eq!((coils, recorded.by_two), (vec![1, 3, 2, 0], vec![]));
        assert_eq!(recorded.writers, 2);
        let recorded = written.take(vec![request(60, 2, 1), request(50, 0, 1), request(70, 1, 0)]);
        assert_eq!((recorded.by_two, recorded.writers), (vec![50, 70], 1));
    }
}
