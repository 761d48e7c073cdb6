//! Members in threads over each link: all hear all, whatever arrives beside the frames.

#![allow(missing_docs, reason = "a test")]
#![allow(
    clippy::disallowed_methods,
    reason = "real links take real time, and a test that waits has a deadline"
)]
#![allow(clippy::print_stderr, reason = "a measurement is shown")]

mod members;
mod wires;

use std::collections::BTreeSet;
use std::io::Write;
use std::net::{SocketAddr, SocketAddrV4, TcpListener, TcpStream, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use members::{
    Chat, Chatter, PERIOD, agreement, endpoints, guard, peers, plant, remote_io, station,
};
use understudy_bus::{
    Clock, Control, Cuts, Endpoints, EventSink, FieldDriver, Host, HostEvent, LinkKind,
    NetworkReception, NoField, Noted, Order, Peer, SimulatedField, Summary, free_addresses,
    loopback_groups, orders,
};
use understudy_testing::skip;
use understudy_wire::{Member, Time, Via};
use wires::{BreakingWire, LossyWire};

/// Past it a test has failed; nothing waits for it otherwise.
const DEADLINE: Duration = Duration::from_secs(60);

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

struct Running {
    control: Control,
    thread: JoinHandle<Summary>,
}

impl Running {
    fn start(
        own: Member,
        life: u64,
        link: LinkKind,
        peers: &[Peer],
        reports: &Sender<(Member, Noted<Chat>)>,
    ) -> Self {
        Self::over(link, endpoints(own, peers), life, peers, reports)
    }

    /// With more that the endpoints say.
    fn over(
        link: LinkKind,
        endpoints: Endpoints,
        life: u64,
        peers: &[Peer],
        reports: &Sender<(Member, Noted<Chat>)>,
    ) -> Self {
        let own = endpoints.own().member;
        let networks = NetworkReception::of(Time::default(), PERIOD, &endpoints);
        let mut link = link.open(&endpoints).expect("a free port");
        let mut guard = guard(own, life, peers);
        let (control, orders) = orders().expect("an eventfd");
        let mut sink = Sink { own, reports: reports.clone() };
        let thread = std::thread::spawn(move || {
            let mut field: Box<dyn FieldDriver> = match own {
                Member::RemoteIo(program) => Box::new(SimulatedField::new(program, agreement())),
                _ => Box::new(NoField),
            };
            Host {
                machine: &mut Chatter::new(own, life),
                link: link.as_mut(),
                guard: &mut guard,
                field: field.as_mut(),
                sink: &mut sink,
                networks,
                retainer: None,
                watchdog: None,
                orders: &orders,
                clock: Clock::start(),
                spins: false,
            }
            .run()
            .expect("it sleeps")
        });
        Self { control, thread }
    }

    fn stop(self) -> Summary {
        self.control.give(Order::Stop);
        self.thread.join().expect("no panic")
    }
}

const CELL: [fn() -> Member; 7] = [
    || station(0),
    || station(1),
    || station(2),
    || remote_io(0),
    || remote_io(1),
    || plant(0),
    || plant(1),
];

fn cell() -> Vec<Member> {
    CELL.iter().map(|member| member()).collect()
}

/// Everything that the members of the cell have to report when `changed` lives its `life` and all others their first.
fn expected(changed: Member, life: u64) -> BTreeSet<(Member, Chat)> {
    let mut expected = BTreeSet::new();
    let life_of = |speaker| if speaker == changed { life } else { 1 };
    for listener in cell() {
        for speaker in cell() {
            let heard = match (speaker, listener) {
                (Member::Plant(plant), Member::RemoteIo(program)) if plant == program => {
                    expected.insert((listener, Chat::Sensed));
                    false
                }
                (Member::RemoteIo(program), Member::Plant(plant)) => program == plant,
                (Member::Plant(feeder), Member::Plant(fed)) => feeder.0 == 0 && fed.0 == 1,
                (Member::Plant(_), _) | (_, Member::Plant(_)) => false,
                (Member::RemoteIo(_), Member::RemoteIo(_)) => false,
                _ => speaker != listener,
            };
            if heard {
                let life = life_of(speaker);
                expected.insert((listener, Chat::Heard { speaker, life }));
            }
        }
    }
    expected
}

/// Takes reports until all of `missing` have come.
fn wait_for(
    reports: &Receiver<(Member, Noted<Chat>)>,
    mut missing: BTreeSet<(Member, Chat)>,
    what: &str,
) -> Duration {
    let start = Instant::now();
    while !missing.is_empty() {
        let left = DEADLINE.saturating_sub(start.elapsed());
        let Ok((member, event)) = reports.recv_timeout(left) else {
            panic!("{what}: these are still missing: {missing:?}");
        };
        if let Noted::Member(chat) = event {
            missing.remove(&(member, chat));
        }
    }
    start.elapsed()
}

fn all_hear_all_and_one_who_comes_back(link: LinkKind, multicast: Option<SocketAddrV4>) {
    let peers = peers(&cell());
    let (sender, reports) = channel();
    let start = |own, life| {
        let endpoints = endpoints(own, &peers).with_multicast(multicast);
        Running::over(link, endpoints, life, &peers, &sender)
    };
    let mut running: Vec<Running> = cell().into_iter().map(|own| start(own, 1)).collect();
    wait_for(&reports, expected(station(0), 1), "at first");
    // One whom all others call, one in the middle, and one who calls: each comes back on its own port in another life.
    for place in [0, 3, 5] {
        let own = cell()[place];
        let stopped = running.remove(place).stop();
        assert!(stopped.frames_said > 0 && stopped.frames_heard > 0);
        running.insert(place, start(own, 2));
        let again = expected(own, 2).into_iter().filter(|(listener, chat)| {
            let new = matches!(chat, Chat::Heard { life: 2, .. });
            new || *listener == own
        });
        wait_for(&reports, again.collect(), "after a restart");
        running.remove(place).stop();
        running.insert(place, start(own, 1));
    }
    let summaries: Vec<Summary> = running.into_iter().map(Running::stop).collect();
    assert!(summaries.iter().all(|summary| summary.unsendable == 0));
}

#[test]
fn all_hear_all_over_udp() {
    all_hear_all_and_one_who_comes_back(LinkKind::Udp, None);
}

/// One datagram for all receivers: nobody misses a frame, and nobody refuses one that is not for him.
#[test]
fn all_hear_all_by_multicast() {
    match loopback_groups() {
        Some(first) => all_hear_all_and_one_who_comes_back(LinkKind::Udp, Some(first)),
        None => skip("the loopback interface delivers no multicast"),
    }
}

#[test]
fn all_hear_all_over_zenoh() {
    all_hear_all_and_one_who_comes_back(LinkKind::Zenoh, None);
}

/// How long each of so many restarts took, from the start of the new life until it received all of its peers and all of them received it,
/// in ascending order. Each member of the cell in turn, beside so many busy threads.
fn restarts(link: LinkKind, count: u64, busy: usize) -> Vec<Duration> {
    let _busy = Busy::start(busy);
    let peers = peers(&cell());
    let (sender, reports) = channel();
    let start = |own, life| Running::start(own, life, link, &peers, &sender);
    let mut running: Vec<Running> = cell().into_iter().map(|own| start(own, 1)).collect();
    wait_for(&reports, expected(station(0), 1), "at first");
    let mut lives = [1; CELL.len()];
    let mut times = Vec::new();
    for number in 0..count {
        let place = (number % CELL.len() as u64) as usize;
        let own = cell()[place];
        running.remove(place).stop();
        lives[place] += 1;
        // What was reported before is of the former life.
        while reports.try_recv().is_ok() {}
        running.insert(place, start(own, lives[place]));
        let life_of = |member| {
            let place = cell().iter().position(|one| *one == member);
            place.map_or(0, |place| lives[place])
        };
        let again = expected(own, 0).into_iter().filter_map(|(listener, chat)| {
            let chat = match chat {
                Chat::Heard { speaker, .. } if listener == own || speaker == own => {
                    Chat::Heard { speaker, life: life_of(speaker) }
                }
                Chat::Sensed if listener == own => chat,
                _ => return None,
            };
            Some((listener, chat))
        });
        times.push(wait_for(&reports, again.collect(), "after a restart"));
    }
    running.into_iter().for_each(|running| {
        running.stop();
    });
    times.sort_unstable();
    times
}

/// Threads that do nothing but compute. No processes: one that is being started holds a copy of every port for a moment.
struct Busy {
    over: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Busy {
    fn start(count: usize) -> Self {
        let over = Arc::new(AtomicBool::new(false));
        let compute = || {
            let over = Arc::clone(&over);
            std::thread::spawn(move || {
                while !over.load(Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
            })
        };
        let threads = (0..count).map(|_| compute()).collect();
        Self { over, threads }
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            // It cannot panic.
            let _ = thread.join();
        }
    }
}

/// `UNDERSTUDY_RESTARTS=1000 UNDERSTUDY_BUSY=8` measures what docs/evidence/performance.md says.
#[test]
fn restarts_beside_busy_threads_are_received_over_zenoh() {
    let number = |name, otherwise| {
        let text = std::env::var(name).ok();
        text.map_or(otherwise, |text| text.parse().expect("a number"))
    };
    let count = number("UNDERSTUDY_RESTARTS", 14);
    let busy = number("UNDERSTUDY_BUSY", 24);
    let times = restarts(LinkKind::Zenoh, count, busy as usize);
    let share = |percent: usize| times[(times.len() - 1) * percent / 100];
    eprintln!(
        "{count} restarts beside {busy} busy threads: p50 {:?}, p99 {:?}, longest {:?}",
        share(50),
        share(99),
        share(100)
    );
}

/// Two who are far too early: their sessions are opened anew, which they report, and are no less received by the others in the end.
#[test]
fn a_session_without_peers_is_opened_anew_over_zenoh() {
    let peers = peers(&cell());
    let (sender, reports) = channel();
    let start = |own| Running::start(own, 1, LinkKind::Zenoh, &peers, &sender);
    // The one connects to peers that are not there, and nobody connects to the other.
    let (first, plant) = (station(0), plant(1));
    let mut running = vec![start(first), start(plant)];
    let mut missing: BTreeSet<Member> = [first, plant].into();
    while !missing.is_empty() {
        let (member, event) = reports.recv_timeout(DEADLINE).expect("it is reported");
        if let Noted::Host(event) = event {
            match event {
                HostEvent::LinkReopened { silence_ms, peer: None, .. } => {
                    assert!(silence_ms >= 1000, "after {silence_ms} ms");
                    missing.remove(&member);
                }
                event => panic!("{event:?}"),
            }
        }
    }
    let others = cell().into_iter().filter(|own| ![first, plant].contains(own));
    running.extend(others.map(start));
    wait_for(&reports, expected(station(0), 1), "at last");
    let summaries = running.into_iter().map(Running::stop);
    let reopened: Vec<u64> = summaries.map(|summary| summary.link.reopened).collect();
    assert!(reopened[0] > 0 && reopened[1] > 0, "{reopened:?}");
}

/// Bytes that are no frame, empty and long ones among them.
fn garbage(target: SocketAddr) {
    let socket = UdpSocket::bind(("127.0.0.1", 0)).expect("a free port");
    for length in LENGTHS {
        socket.send_to(&noise(length), target).expect("it is loopback");
    }
}

/// The same as streams.
fn streams_of_garbage(target: SocketAddr) {
    for length in LENGTHS {
        let mut stream = TcpStream::connect(target).expect("it listens");
        // The other end may close before it has read everything.
        let _ = stream.write_all(&noise(length));
    }
}

const LENGTHS: [usize; 6] = [0, 1, 9, 60, 1400, 40_000];

fn noise(length: usize) -> Vec<u8> {
    (0..length).map(|place| (place * 31 + length) as u8).collect()
}

fn garbage_changes_nothing(link: LinkKind) {
    let peers = peers(&cell());
    let (sender, reports) = channel();
    let start = |own, life| Running::start(own, life, link, &peers, &sender);
    let mut running: Vec<Running> = cell().into_iter().map(|own| start(own, 1)).collect();
    wait_for(&reports, expected(station(0), 1), "at first");
    for peer in &peers {
        match link {
            LinkKind::Udp => garbage(peer.address),
            LinkKind::Zenoh => {
                streams_of_garbage(link.frames_address(peer.address).expect("a port"));
            }
        }
    }
    if link == LinkKind::Udp {
        // On plain UDP garbage reaches the host, which says so.
        let start = Instant::now();
        loop {
            let left = DEADLINE.saturating_sub(start.elapsed());
            let (_, event) = reports.recv_timeout(left).expect("it is said");
            if let Noted::Host(HostEvent::RefusedBytes { datagrams, reason }) = event {
                assert!(datagrams > 0 && !reason.is_empty());
                break;
            }
        }
    }
    running.remove(1).stop();
    running.insert(1, start(station(1), 2));
    let again = expected(station(1), 2)
        .into_iter()
        .filter(|(_, chat)| matches!(chat, Chat::Heard { life: 2, .. }));
    wait_for(&reports, again.collect(), "after garbage");
    running.into_iter().for_each(|running| {
        running.stop();
    });
}

#[test]
fn garbage_changes_nothing_on_udp() {
    garbage_changes_nothing(LinkKind::Udp);
}

#[test]
fn garbage_changes_nothing_on_zenoh() {
    garbage_changes_nothing(LinkKind::Zenoh);
}

#[test]
fn a_port_in_use_is_said_with_its_number() {
    let mut peers = peers(&cell());
    for link in [LinkKind::Udp, LinkKind::Zenoh] {
        let frames = link.frames_address(peers[0].address).expect("a port");
        let _datagrams = UdpSocket::bind(frames).expect("a free port");
        let _streams = TcpListener::bind(frames).expect("a free port");
        let error = link.open(&endpoints(station(0), &peers)).err().expect("the port is in use");
        assert_eq!(error.code(), "U0501");
        assert!(error.to_string().contains(&frames.port().to_string()));
    }
    peers[0].address.set_port(60_000);
    let error = LinkKind::Zenoh
        .open(&endpoints(station(0), &peers))
        .err()
        .expect("there is no port for its frames");
    assert_eq!(error.code(), "U0580");
}

/// All hear all where each is reached at another address than its own.
fn all_hear_all_by(link: LinkKind, peers: &[Peer], addresses: &[SocketAddr]) {
    let (sender, reports) = channel();
    let seen_by = |own: Member| -> Vec<Peer> {
        let seen = peers.iter().zip(addresses).map(|(peer, &address)| Peer {
            address: if peer.member == own { peer.address } else { address },
            ..peer.clone()
        });
        seen.collect()
    };
    let running: Vec<Running> = cell()
        .into_iter()
        .map(|own| Running::start(own, 1, link, &seen_by(own), &sender))
        .collect();
    wait_for(&reports, expected(station(0), 1), "over these wires");
    running.into_iter().for_each(|running| {
        running.stop();
    });
}

#[test]
fn all_hear_all_where_one_of_ten_is_lost_on_udp() {
    let peers = peers(&cell());
    let wires: Vec<LossyWire> =
        peers.iter().zip(1..).map(|(peer, seed)| LossyWire::to(peer.address, seed)).collect();
    let addresses: Vec<SocketAddr> = wires.iter().map(|wire| wire.address).collect();
    all_hear_all_by(LinkKind::Udp, &peers, &addresses);
}

#[test]
fn all_hear_all_where_streams_break_on_zenoh() {
    let peers = peers(&cell());
    let wires: Vec<BreakingWire> =
        peers.iter().zip(1..).map(|(peer, seed)| BreakingWire::to(peer.address, seed)).collect();
    let addresses: Vec<SocketAddr> = wires.iter().map(|wire| wire.address).collect();
    all_hear_all_by(LinkKind::Zenoh, &peers, &addresses);
}

/// The cell, each member at two addresses.
fn peers_on_two_networks() -> Vec<Peer> {
    let second = free_addresses(CELL.len()).expect("free ports");
    let peers = peers(&cell()).into_iter().zip(second);
    peers.map(|(peer, second)| Peer { second: Some(second), ..peer }).collect()
}

/// What is reported of networks, until `is_last`.
fn of_networks(
    reports: &Receiver<(Member, Noted<Chat>)>,
    mut is_last: impl FnMut(Member, &HostEvent) -> bool,
) {
    loop {
        let (member, event) = reports.recv_timeout(DEADLINE).expect("it is reported");
        if let Noted::Host(event) = event
            && is_last(member, &event)
        {
            return;
        }
    }
}

/// Whether a member says that it receives nothing of this one over a network.
fn has_lost(event: &HostEvent, of: Member, over: Via) -> bool {
    matches!(event, HostEvent::NetworkReception { network, lost, .. } if *network == over && lost.contains(&of))
}

#[test]
fn each_frame_counts_once_over_two_networks_and_a_pulled_cable_is_reported() {
    for link in [LinkKind::Udp, LinkKind::Zenoh] {
        let peers = peers_on_two_networks();
        let (sender, reports) = channel();
        let start = |own| Running::start(own, 1, link, &peers, &sender);
        let running: Vec<Running> = cell().into_iter().map(start).collect();
        wait_for(&reports, expected(station(0), 1), "over two networks");
        let (pulled, other) = (&running[0], station(1));
        let mut cuts = Cuts::default();
        cuts.unplug(Via::First, true);
        pulled.control.give(Order::Cut(cuts));
        of_networks(&reports, |by, event| by == other && has_lost(event, station(0), Via::First));
        cuts.unplug(Via::First, false);
        pulled.control.give(Order::Cut(cuts));
        of_networks(&reports, |by, event| {
            by == other
                && matches!(event, HostEvent::NetworkReception { network: Via::First, lost, impaired }
                    if lost.is_empty() && impaired.is_empty())
        });
        // Frames are still received: the other network carried them all the time.
        for summary in running.into_iter().map(Running::stop) {
            assert_eq!(summary.refused, 0, "a second copy is no replay: {summary:?}");
            assert!(summary.second_copies > 0, "{summary:?}");
        }
    }
}

/// An address that no interface of this machine has.
const NOWHERE: &str = "192.0.2.1";

#[test]
fn a_member_starts_with_the_network_that_there_is() {
    for link in [LinkKind::Udp, LinkKind::Zenoh] {
        for missing in Via::NETWORKS {
            let mut peers = peers_on_two_networks();
            let own = &mut peers[0];
            let place = match missing {
                Via::First => &mut own.address,
                _ => own.second.as_mut().expect("two"),
            };
            place.set_ip(NOWHERE.parse().expect("an address"));
            let (sender, reports) = channel();
            let start = |own| Running::start(own, 1, link, &peers, &sender);
            let running: Vec<Running> = cell().into_iter().map(start).collect();
            of_networks(&reports, |by, event| {
                by == station(0)
                    && matches!(event, HostEvent::LinkFailed { network, .. } if *network == Some(missing))
            });
            of_networks(&reports, |by, event| {
                by == station(1) && has_lost(event, station(0), missing)
            });
            for one in running {
                one.stop();
            }
        }
    }
}
