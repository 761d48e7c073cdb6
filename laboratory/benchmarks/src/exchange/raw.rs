//! The yardstick: the same pattern on plain sockets, with datagrams of the same length.

use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::time::Duration;

use understudy_bus::{Clock, Endpoints};
use understudy_wire::{Frame, Member, StationId, Time, encode};

use super::meter::{Exchange, Meter};
use super::pattern::{CYCLE_MASTER, PROGRAMS, STATIONS, frames_of_a_cycle, turn_of};

/// Time without a datagram after which one was lost, and the cycle master starts the next cycle.
const LOST_AFTER: Duration = Duration::from_millis(100);

/// The eight datagrams of a cycle, in the order in which they are sent. Byte 0 is the place in that order, bytes 1 to 8 are the cycle; the
/// rest only has the length of the real frame.
struct Script {
    datagrams: Vec<Vec<u8>>,
    /// Sender of each, and the station whose turn it is.
    senders: Vec<(Member, Option<StationId>)>,
    /// Those who receive each, as the links send it.
    receivers: Vec<Vec<SocketAddr>>,
}

impl Script {
    fn new(endpoints: &Endpoints) -> Self {
        let frames = frames_of_a_cycle();
        let receivers = |frame: &Frame| {
            let roster = endpoints.roster();
            let audience = roster.audience(roster.topic(frame), frame.header.sender);
            let others = endpoints.others().iter();
            let others = others.filter(|peer| audience.contains(peer.member));
            others.map(|peer| peer.address).collect()
        };
        let datagrams = frames.iter().enumerate().map(|(place, frame)| {
            let mut bytes = Vec::new();
            encode(frame, &mut bytes).expect("the pattern keeps the bounds of the wire");
            bytes[0] = place as u8;
            bytes
        });
        Self {
            datagrams: datagrams.collect(),
            senders: frames.iter().map(|frame| (frame.header.sender, turn_of(frame))).collect(),
            receivers: frames.iter().map(receivers).collect(),
        }
    }

    fn send(&mut self, socket: &UdpSocket, place: usize, cycle: u64) -> io::Result<()> {
        let datagram = &mut self.datagrams[place];
        datagram[1..9].copy_from_slice(&cycle.to_le_bytes());
        for receiver in &self.receivers[place] {
            socket.send_to(datagram, receiver)?;
        }
        Ok(())
    }

    fn place_of(&self, member: Member, which: usize) -> Option<usize> {
        let own = |(place, sent): (usize, &(Member, _))| (sent.0 == member).then_some(place);
        self.senders.iter().enumerate().filter_map(own).nth(which)
    }
}

/// Plays the part of `own`: the cycle master returns the exchange, the others run until their process is killed.
pub(super) fn play(
    own: Member,
    socket: &UdpSocket,
    endpoints: &Endpoints,
    period: Duration,
    mut meter: Meter,
) -> io::Result<Exchange> {
    let mut script = Script::new(endpoints);
    let is_cycle_master = own == CYCLE_MASTER;
    // The cycle master's first datagram is the Sync, and its second the turn.
    let mine = script.place_of(own, usize::from(is_cycle_master)).unwrap_or(usize::MAX);
    let clock = Clock::start();
    let mut received = [0; 2048];
    let mut cycle = 0_u64;
    if is_cycle_master {
        socket.set_read_timeout(Some(LOST_AFTER))?;
    }
    loop {
        let mut heard = [false; 1 + PROGRAMS as usize + STATIONS as usize];
        let mut published = false;
        let started = clock.now();
        if is_cycle_master {
            cycle += 1;
            heard[0] = true;
            note(&mut meter, &script, 0, cycle, clock.now());
            script.send(socket, 0, cycle)?;
        }
        while !heard[heard.len() - 1] {
            let Ok(length) = socket.recv(&mut received) else {
                break;
            };
            let Some((place, of)) = place_and_cycle(&received[..length], heard.len()) else {
                continue;
            };
            if of > cycle {
                cycle = of;
                heard.fill(false);
                published = false;
            }
            if of == cycle {
                heard[place] = true;
                note(&mut meter, &script, place, cycle, clock.now());
            }
            let token = match own {
                CYCLE_MASTER => heard[1],
                Member::Station(_) => heard[mine - 1],
                _ => heard[0],
            };
            if token && !published {
                published = true;
                heard[mine] = true;
                note(&mut meter, &script, mine, cycle, clock.now());
                script.send(socket, mine, cycle)?;
            }
        }
        if is_cycle_master {
            if let Some(exchange) = meter.result() {
                return Ok(exchange);
            }
            let left = period.saturating_sub(clock.now().since(started));
            #[allow(
                clippy::disallowed_methods,
                reason = "the cycle master waits for the next period"
            )]
            std::thread::sleep(left);
        }
    }
}

fn place_and_cycle(datagram: &[u8], places: usize) -> Option<(usize, u64)> {
    let (&place, rest) = datagram.split_first()?;
    let cycle = rest.first_chunk().map(|bytes| u64::from_le_bytes(*bytes))?;
    (usize::from(place) < places).then_some((usize::from(place), cycle))
}

fn note(meter: &mut Meter, script: &Script, place: usize, cycle: u64, now: Time) {
    let (_, turn) = script.senders[place];
    meter.frame(now, cycle, turn);
}
