//! Somebody on the network who says what he should not: nothing of it reaches a member, and the journal names it.

#![allow(missing_docs, reason = "a test")]
#![allow(
    clippy::disallowed_methods,
    reason = "real sockets take real time, and a test that waits has a deadline"
)]

#[allow(dead_code, reason = "each test uses its part")]
mod members;

use std::collections::BTreeSet;
use std::net::UdpSocket;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::{JoinHandle, spawn};
use std::time::{Duration, Instant};

use members::{Chat, Chatter, agreement, endpoints, guard, key, peers, plant, remote_io, station};
use understudy_bus::{
    Clock, Control, EventSink, Host, HostEvent, LinkKind, Noted, Order, Peer, RefusedAs,
    SimulatedField, orders,
};
use understudy_seal::{FrameKey, Seal};
use understudy_wire::{Body, Cycle, Epoch, Frame, Header, Member, Moment, ProgramId, Time, encode};

const DEADLINE: Duration = Duration::from_secs(30);

/// The life that only a stranger claims for others.
const STRANGE_LIFE: u64 = 666;

struct Sink {
    own: Member,
    reports: Sender<(Member, Noted<Chat>)>,
}

impl EventSink<Chat> for Sink {
    fn record(&mut self, _now: Time, event: Noted<Chat>) {
        // A test that has ended listens no more.
        let _ = self.reports.send((self.own, event));
    }
}

fn start(
    own: Member,
    peers: &[Peer],
    reports: &Sender<(Member, Noted<Chat>)>,
) -> (Control, JoinHandle<()>) {
    let endpoints = endpoints(own, peers);
    let mut link = LinkKind::Udp.open(&endpoints).expect("a free port");
    let mut guard = guard(own, 1, peers);
    let (control, orders) = orders().expect("an eventfd");
    let reports = reports.clone();
    let thread = spawn(move || {
        Host {
            machine: &mut Chatter::new(own, 1),
            link: link.as_mut(),
            guard: &mut guard,
            field: &mut SimulatedField::new(ProgramId(0), agreement()),
            sink: &mut Sink { own, reports },
            networks: None,
            retainer: None,
            watchdog: None,
            orders: &orders,
            clock: Clock::start(),
            spins: false,
        }
        .run()
        .expect("it sleeps");
    });
    (control, thread)
}

fn sync(sender: Member) -> (Frame, Vec<u8>) {
    let frame = Frame {
        header: Header {
            cluster: agreement().cluster,
            configuration: agreement().configuration,
            prepared: None,
            moment: Moment { epoch: Epoch(STRANGE_LIFE), cycle: Cycle(1) },
            sender,
            alone: false,
        },
        body: Body::Sync,
    };
    let mut bytes = Vec::new();
    encode(&frame, &mut bytes).expect("a sensible frame");
    (frame, bytes)
}

fn sealed(sender: Member, key: FrameKey) -> Vec<u8> {
    let (frame, bytes) = sync(sender);
    let mut datagram = Vec::new();
    Seal::new(sender, key, u32::MAX, [])
        .seal(&frame, &bytes, &mut datagram)
        .expect("it is in its own name");
    datagram
}

/// The stranger has the address of a station that is dead, and so hears what the others say to it.
#[test]
fn a_stranger_is_named_and_not_believed() {
    let (sender, reports) = channel();
    let all = peers(&[station(0), station(1), remote_io(0), plant(0)]);
    let running: Vec<_> = [station(0), remote_io(0)].map(|own| start(own, &all, &sender)).into();
    let at = |member| {
        let peer = all.iter().find(|peer| peer.member == member);
        peer.expect("it is among them").address
    };
    let stranger = UdpSocket::bind(at(station(1))).expect("nobody else has it");
    stranger.set_read_timeout(Some(Duration::from_millis(100))).expect("a time that is not zero");
    let done = Arc::new(AtomicBool::new(false));
    let stop = Arc::clone(&done);
    let (from_station, from_remote_io) = (at(station(0)), at(remote_io(0)));
    let forger = spawn(move || {
        let mut received = [0; 2048];
        while !stop.load(Ordering::Relaxed) {
            let Ok((length, from)) = stranger.recv_from(&mut received) else {
                continue;
            };
            let to = if from == from_station { from_remote_io } else { from_station };
            let mine = FrameKey::new([66; 32]);
            let said = [
                // What it was told, to the other one, for whom it was meant too and who has it by now or will have it.
                received[..length].to_vec(),
                received[..length].to_vec(),
                sealed(station(0), mine.clone()),
                sealed(station(0), key(station(1))),
                sealed(station(9), mine),
                sync(station(0)).1,
                b"nonsense".to_vec(),
            ];
            for datagram in said {
                stranger.send_to(&datagram, to).expect("it is loopback");
            }
        }
    });

    let mut missing: BTreeSet<(RefusedAs, Option<Member>)> = [
        (RefusedAs::Replayed, Some(station(0))),
        (RefusedAs::Forged, Some(station(0))),
        (RefusedAs::Foreign, Some(station(9))),
        (RefusedAs::Unsealed, None),
        (RefusedAs::NoFrame, None),
    ]
    .into();
    let start = Instant::now();
    let mut heard = false;
    while !missing.is_empty() || !heard {
        let left = DEADLINE.saturating_sub(start.elapsed());
        let (listener, event) = match reports.recv_timeout(left) {
            Ok(report) => report,
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {
                panic!("not named: {missing:?}; heard: {heard}")
            }
        };
        match event {
            Noted::Member(Chat::Heard { life, speaker }) => {
                assert_ne!(life, STRANGE_LIFE, "{listener:?} believes it of {speaker:?}");
                heard |= (listener, speaker) == (remote_io(0), station(0));
            }
            Noted::Host(HostEvent::RefusedFrames { refused_as, sender, .. })
                if listener == remote_io(0) =>
            {
                missing.remove(&(refused_as, sender));
            }
            Noted::Host(HostEvent::RefusedBytes { .. }) if listener == remote_io(0) => {
                missing.remove(&(RefusedAs::NoFrame, None));
            }
            _ => {}
        }
    }
    done.store(true, Ordering::Relaxed);
    for (control, thread) in running {
        control.give(Order::Stop);
        thread.join().expect("no panic");
    }
    forger.join().expect("no panic");
}
