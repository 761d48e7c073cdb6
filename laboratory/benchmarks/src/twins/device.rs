//! A Modbus TCP device that records each write, and who writes it.
//!
//! A writer is a connection. Two writers at one time are found by their order: once a connection has written, an earlier one must not write any more.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use understudy_bus::Clock;

use super::judge::Outputs;

/// Coils and discrete inputs.
const POINTS: usize = 64;

/// Time for which the inputs keep their values.
const INPUTS_CHANGE: Duration = Duration::from_millis(300);

/// What was recorded.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Recorded {
    /// Its coils after each write.
    pub(super) writes: Vec<Outputs>,
    /// Connections that have written.
    pub(super) writers: u64,
    /// Writes of a connection after a later one had written.
    pub(super) by_two: u64,
}

#[derive(Debug)]
struct State {
    coils: [bool; POINTS],
    recorded: Recorded,
    /// The newest connection that has written.
    writer: Option<u64>,
}

/// The device; it ends with the process.
#[derive(Debug, Clone)]
pub(super) struct Device {
    pub(super) address: SocketAddr,
    /// When its inputs began to change.
    began: Instant,
    clock: Clock,
    state: Arc<Mutex<State>>,
}

impl Device {
    /// A device on a free port of this machine.
    ///
    /// # Errors
    /// No port can be opened.
    pub(super) fn start() -> std::io::Result<Self> {
        Self::since(Instant::now())
    }

    /// Another device at the same sensors.
    ///
    /// # Errors
    /// No port can be opened.
    pub(super) fn beside(&self) -> std::io::Result<Self> {
        Self::since(self.began)
    }

    fn since(began: Instant) -> std::io::Result<Self> {
        let listener = TcpListener::bind("127.0.0.1:0")?;
        let state = State { coils: [false; POINTS], recorded: Recorded::default(), writer: None };
        let device = Self {
            address: listener.local_addr()?,
            began,
            clock: Clock::start(),
            state: Arc::new(Mutex::new(state)),
        };
        let served = device.clone();
        std::thread::spawn(move || {
            for (connection, stream) in (0..).zip(listener.incoming().flatten()) {
                let served = served.clone();
                std::thread::spawn(move || served.serve(stream, connection));
            }
        });
        Ok(device)
    }

    /// What was recorded since the last call; the connections stay known.
    pub(super) fn take(&self) -> Recorded {
        std::mem::take(&mut self.state().recorded)
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn serve(&self, mut stream: TcpStream, connection: u64) {
        let _ = stream.set_nodelay(true);
        let mut header = [0; 7];
        while stream.read_exact(&mut header).is_ok() {
            // The length counts the unit too.
            let length = usize::from(u16::from_be_bytes([header[4], header[5]]));
            let mut request = vec![0; length.saturating_sub(1).min(260)];
            if request.is_empty() || stream.read_exact(&mut request).is_err() {
                return;
            }
            let answer = self.answer(&request, connection);
            let length = (answer.len() as u16 + 1).to_be_bytes();
            let mut frame = header[..4].to_vec();
            frame.extend(length);
            frame.push(header[6]);
            frame.extend(answer);
            if stream.write_all(&frame).is_err() {
                return;
            }
        }
    }

    fn answer(&self, request: &[u8], connection: u64) -> Vec<u8> {
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
                let state = self.state();
                let tick = self.began.elapsed().as_millis() / INPUTS_CHANGE.as_millis();
                let bit = |at: usize| match function {
                    1 => state.coils[at],
                    _ => tick.wrapping_mul(0x9E37_79B9) >> (at + 3) & 1 == 1,
                };
                let mut bytes = vec![0_u8; count.div_ceil(8)];
                for at in (0..count).filter(|at| bit(first + at)) {
                    bytes[at / 8] |= 1 << (at % 8);
                }
                [vec![function, bytes.len() as u8], bytes].concat()
            }
            5 => {
                self.write(connection, first, &[number(3) == 0xFF00]);
                request.to_vec()
            }
            15 => {
                let bytes = request.get(6..).unwrap_or_default();
                let bit =
                    |at: usize| bytes.get(at / 8).is_some_and(|byte| byte >> (at % 8) & 1 == 1);
                let values: Vec<bool> = (0..count).map(bit).collect();
                self.write(connection, first, &values);
                request[..5].to_vec()
            }
            _ => vec![function | 0x80, 1],
        }
    }

    fn write(&self, connection: u64, first: usize, values: &[bool]) {
        let mut state = self.state();
        state.coils[first..first + values.len()].copy_from_slice(values);
        if state.writer.is_some_and(|newest| connection < newest) {
            state.recorded.by_two += 1;
        } else if state.writer != Some(connection) {
            state.recorded.writers += 1;
            state.writer = Some(connection);
        }
        let on = state.coils.iter().enumerate().filter(|(_, on)| **on);
        let coils = on.map(|(place, _)| 1 << place).sum();
        let at_ns = self.clock.host_ns(self.clock.now());
        state.recorded.writes.push(Outputs { at_ns, coils });
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
        let mut first = TcpStream::connect(device.address).expect("connected");
        let on = [15, 0, 2, 0, 3, 1, 0b101];
        assert_eq!(ask(&mut first, &on), [15, 0, 2, 0, 3]);
        assert_eq!(ask(&mut first, &[1, 0, 0, 0, 8]), [1, 1, 0b10100]);
        let mut second = TcpStream::connect(device.address).expect("connected");
        assert_eq!(ask(&mut second, &[5, 0, 2, 0, 0]), [5, 0, 2, 0, 0]);
        assert_eq!(ask(&mut second, &[1, 0, 0, 0, 8]), [1, 1, 0b10000]);
        let recorded = device.take();
        assert_eq!((recorded.writers, recorded.by_two), (2, 0));
        let coils: Vec<u64> = recorded.writes.iter().map(|write| write.coils).collect();
        assert_eq!(coils, [0b10100, 0b10000]);
        ask(&mut first, &on);
        assert_eq!(device.take().by_two, 1);
        assert_eq!(ask(&mut first, &[15, 0, 63, 0, 3, 1, 1]), [0x8F, 2], "beyond its coils");
    }
}
