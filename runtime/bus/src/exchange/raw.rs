//! The yardstick: the same pattern on plain sockets, with as many bytes in each datagram, and nothing of ours in between.

use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::time::Duration;

use understudy_wire::{Frame, Member, Time, encode};

use super::benchmark::ExchangeSettings;
use super::meter::ExchangeMeter;
use super::pattern::{CYCLE_MASTER, PROGRAMS, STATIONS, frames_of_a_cycle};
use crate::clock::Clock;
use crate::observer::Observer;

/// After so long without a datagram one was lost, and the cycle master starts the next cycle.
const LOST_AFTER: Duration = Duration::from_millis(100);

/// The eight datagrams of a cycle, in the order in which they are said. Byte 0 is the place in that order, bytes 1 to 8 are
/// the cycle; what follows only has the length of the real frame.
struct Script {
    datagrams: Vec<Vec<u8>>,
    frames: Vec<Frame>,
}

impl Script {
    fn new() -> Self {
        let frames = frames_of_a_cycle();
        let datagrams = frames.iter().enumerate().map(|(place, frame)| {
            let mut bytes = Vec::new();
            encode(frame, &mut bytes).expect("the pattern keeps the bounds of the wire");
            bytes[0] = place as u8;
            bytes
        });
        Self {
            datagrams: datagrams.collect(),
            frames,
        }
    }

    fn place_of(&self, member: Member, which: usize) -> Option<usize> {
        let said =
            |(place, frame): (usize, &Frame)| (frame.header.sender == member).then_some(place);
        self.frames.iter().enumerate().filter_map(said).nth(which)
    }
}

/// Plays the part of `own` until `cycles` were measured, where it is the cycle master, and until the process is
/// killed, where it is not.
pub(super) fn play(
    own: Member,
    socket: &UdpSocket,
    others: &[SocketAddr],
    settings: ExchangeSettings,
    meter: &mut ExchangeMeter,
) -> io::Result<()> {
    let mut script = Script::new();
    let is_cycle_master = own == CYCLE_MASTER;
    // The cycle master's first datagram is the Sync, and its second the turn.
    let mine = script
        .place_of(own, usize::from(is_cycle_master))
        .unwrap_or(usize::MAX);
    let clock = Clock::start();
    let mut received = [0; 2048];
    let mut cycle = 0_u64;
    if is_cycle_master {
        socket.set_read_timeout(Some(LOST_AFTER))?;
    }
    while !is_cycle_master || !meter.satisfied() {
        let mut heard = [false; 1 + PROGRAMS as usize + STATIONS as usize];
        let mut published = false;
        let started = clock.now();
        if is_cycle_master {
            cycle += 1;
            heard[0] = true;
            note(meter, &script, 0, cycle, clock.now());
            broadcast(socket, others, &mut script.datagrams[0], cycle)?;
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
                note(meter, &script, place, cycle, clock.now());
            }
            let token = match own {
                CYCLE_MASTER => heard[1..=usize::from(PROGRAMS)].iter().all(|&one| one),
                Member::Station(_) => heard[mine - 1],
                _ => heard[0],
            };
            if token && !published {
                published = true;
                heard[mine] = true;
                note(meter, &script, mine, cycle, clock.now());
                broadcast(socket, others, &mut script.datagrams[mine], cycle)?;
            }
        }
        if is_cycle_master {
            let left = settings.period.saturating_sub(clock.now().since(started));
            #[allow(
                clippy::disallowed_methods,
                reason = "the cycle_master waits for the next period"
            )]
            std::thread::sleep(left);
        }
    }
    Ok(())
}

fn place_and_cycle(datagram: &[u8], places: usize) -> Option<(usize, u64)> {
    let (&place, rest) = datagram.split_first()?;
    let cycle = rest.first_chunk().map(|bytes| u64::from_le_bytes(*bytes))?;
    (usize::from(place) < places).then_some((usize::from(place), cycle))
}

fn broadcast(
    socket: &UdpSocket,
    others: &[SocketAddr],
    datagram: &mut [u8],
    cycle: u64,
) -> io::Result<()> {
    datagram[1..9].copy_from_slice(&cycle.to_le_bytes());
    for other in others {
        socket.send_to(datagram, other)?;
    }
    Ok(())
}

fn note(meter: &mut ExchangeMeter, script: &Script, place: usize, cycle: u64, now: Time) {
    let mut frame = script.frames[place].clone();
    frame.header.moment.cycle.0 = cycle;
    meter.frame(now, &frame);
}
