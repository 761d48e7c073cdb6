//! Devices that end their connections, each a TCP server of its own that answers as Modbus TCP wants it.

use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use understudy_cluster::{Cluster, FieldDevice};

use super::*;

/// What the tests wait for, at most.
const DEADLINE: Duration = Duration::from_secs(60);

/// When the device ends its connection.
#[derive(Debug, Clone, Copy)]
enum Ends {
    /// After this number of answers.
    After(u64),
    /// Where no request comes for this time.
    Idle(Duration),
    /// In place of an answer, from the request with this number on.
    Unanswered(u64),
}

/// The coils that were written, and what the device has counted.
#[derive(Default)]
struct Held {
    coils: Mutex<BTreeMap<u16, bool>>,
    connections: AtomicU64,
    requests: AtomicU64,
}

/// Answers one request; false where the caller has gone or was idle for too long.
fn answer(stream: &mut TcpStream, held: &Held, ends: Ends) -> bool {
    let mut head = [0; 8];
    if stream.read_exact(&mut head).is_err() {
        return false;
    }
    let number = held.requests.fetch_add(1, Ordering::SeqCst);
    if matches!(ends, Ends::Unanswered(from) if number >= from) {
        return false;
    }
    let length = usize::from(u16::from_be_bytes([head[4], head[5]]));
    let mut body = vec![0; length - 2];
    if stream.read_exact(&mut body).is_err() {
        return false;
    }
    let word = |place: usize| u16::from_be_bytes([body[place], body[place + 1]]);
    let (start, second) = (word(0), word(2));
    let mut coils = held.coils.lock().expect("no panic");
    let pdu = match head[7] {
        // Discrete inputs and coils: as many zeros, and what was written.
        function @ (1 | 2) => {
            let mut bytes = vec![0_u8; usize::from(second).div_ceil(8)];
            for place in 0..second {
                let is_set = coils.get(&(start + place)).copied().unwrap_or(false);
                bytes[usize::from(place / 8)] |= u8::from(is_set) << (place % 8);
            }
            [vec![function, bytes.len() as u8], bytes].concat()
        }
        5 => {
            coils.insert(start, second != 0);
            [vec![5], body[..4].to_vec()].concat()
        }
        15 => {
            for place in 0..second {
                let byte = body[5 + usize::from(place / 8)];
                coils.insert(start + place, byte >> (place % 8) & 1 != 0);
            }
            [vec![15], body[..4].to_vec()].concat()
        }
        function => vec![function | 0x80, 1],
    };
    let length = (pdu.len() + 1) as u16;
    let bytes = [&head[..4], &length.to_be_bytes(), &head[6..7], &pdu].concat();
    stream.write_all(&bytes).is_ok()
}

/// Serves one connection after the other, as small devices do, while the test runs.
fn serve(ends: Ends) -> (SocketAddr, Arc<Held>) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let address = listener.local_addr().expect("bound");
    let held = Arc::new(Held::default());
    let served = Arc::clone(&held);
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            let mut stream = stream.expect("a connection");
            served.connections.fetch_add(1, Ordering::SeqCst);
            if let Ends::Idle(patience) = ends {
                stream.set_read_timeout(Some(patience)).expect("a time");
            }
            let most = if let Ends::After(most) = ends { most } else { u64::MAX };
            let mut answered = 0;
            while answered < most && answer(&mut stream, &served, ends) {
                answered += 1;
            }
        }
    });
    (address, held)
}

/// A device with two inputs apart and two outputs apart: four requests in one exchange.
fn settings(address: SocketAddr) -> FieldDevice {
    wired(
        address,
        "low = \"discrete:0\", high = \"discrete:900\"",
        "valve = \"coil:3\", pump = \"coil:800\"",
    )
}

/// The same device with these places of the signals.
fn wired(address: SocketAddr, inputs: &str, outputs: &str) -> FieldDevice {
    let text = format!(
        "[cluster]\nname = \"line\"\nsecurity = \"off\"\n\
         [[controller]]\nname = \"tank\"\nladder = \"tank.ladder\"\n\
         [[remote_io]]\nname = \"tank-io\"\ncontroller = \"tank\"\n\
         [remote_io.field]\nmodbus = \"{address}\"\ntimeout = \"5s\"\nstale_after = \"10s\"\n\
         inputs = {{ {inputs} }}\n\
         outputs = {{ {outputs} }}\n"
    );
    let ladder = "program tank\ninput low\ninput high\noutput valve\noutput pump\n\
                  rung\n    low ( valve )\nrung\n    high ( pump )\n";
    let mut open = |_: &str| Ok(ladder.to_owned());
    let loaded = understudy_cluster::read("cluster.toml", &text, &mut open);
    let cluster: Cluster = loaded.cluster.unwrap_or_else(|| panic!("{:?}", loaded.reports));
    cluster.remote_ios()[0].field.clone().expect("it has one")
}

fn started(ends: Ends, period: Duration) -> (Device, Arc<Held>) {
    let (address, held) = serve(ends);
    let fail_safe = Image::from_bits([false, false]);
    let device = Device::start(settings(address), fail_safe, period, false).expect("a thread");
    (device, held)
}

/// The states that the cycle sees until `enough` good ones were seen; both outputs are driven in each period.
fn looks(device: &mut Device, period: Duration, enough: usize) -> Vec<Look> {
    let started = Instant::now();
    let mut driven: Option<Instant> = None;
    let mut seen = Vec::new();
    let is_good = |look: &&Look| matches!(look, Look::Sensors(_));
    while seen.iter().filter(is_good).count() < enough {
        assert!(started.elapsed() < DEADLINE, "{seen:?}");
        if driven.is_none_or(|at| at.elapsed() >= period) {
            device.drive(&Image::from_bits([true, true]), Duration::ZERO);
            driven = Some(Instant::now());
        }
        seen.extend(device.look());
        std::thread::yield_now();
    }
    seen
}

#[test]
fn a_device_that_ends_its_connections_is_served_without_a_gap() {
    let idle = Duration::from_millis(5);
    let cases = [
        (Ends::After(1), Duration::from_millis(2)),
        (Ends::After(2), Duration::from_millis(2)),
        (Ends::After(3), Duration::from_millis(2)),
        (Ends::After(5), Duration::from_millis(2)),
        (Ends::After(7), Duration::from_millis(2)),
        (Ends::Idle(idle), 4 * idle),
    ];
    for (ends, period) in cases {
        let (mut device, held) = started(ends, period);
        let seen = looks(&mut device, period, 40);
        let lost: Vec<&Look> = seen.iter().filter(|look| matches!(look, Look::Lost(_))).collect();
        let first = Look::Lost("no answer yet".into());
        assert!(lost.iter().all(|look| **look == first), "{ends:?}: {lost:?}");
        assert!(held.connections.load(Ordering::SeqCst) > 8, "{ends:?}: it ends connections");
        let coils = held.coils.lock().expect("no panic").clone();
        assert_eq!(coils, BTreeMap::from([(3, true), (800, true)]), "{ends:?}");
        assert_eq!(device.contested(), None, "{ends:?}");
        // It is driven to the fail-safe values over a new connection, too.
        drop(device);
        let coils = held.coils.lock().expect("no panic").clone();
        assert_eq!(coils, BTreeMap::from([(3, false), (800, false)]), "{ends:?}");
    }
}

/// The device's own watchdog sets its outputs where the cycle drives them no more: what was driven last is not written again.
#[test]
fn outputs_that_are_not_driven_any_more_are_not_written_again() {
    let period = Duration::from_millis(2);
    let (mut device, held) = started(Ends::After(u64::MAX), period);
    looks(&mut device, period, 5);
    // The exchange that has begun by now ends, and the next one would be a period later.
    let (mut requests, mut since) = (0, Instant::now());
    while since.elapsed() < 20 * period {
        let now = held.requests.load(Ordering::SeqCst);
        if now != std::mem::replace(&mut requests, now) {
            since = Instant::now();
            held.coils.lock().expect("no panic").clear();
        }
        assert!(requests < 2_000, "it is exchanged with although nothing is driven");
        std::thread::yield_now();
    }
    assert_eq!(*held.coils.lock().expect("no panic"), BTreeMap::new());
    looks(&mut device, period, 5);
    let coils = held.coils.lock().expect("no panic").clone();
    assert_eq!(coils, BTreeMap::from([(3, true), (800, true)]), "driven again");
}

#[test]
fn a_device_that_ends_new_connections_unanswered_is_lost_and_not_besieged() {
    let (mut device, held) = started(Ends::Unanswered(9), Duration::from_millis(2));
    let started = Instant::now();
    let mut reason = String::new();
    while !reason.contains("127.0.0.1") {
        assert!(started.elapsed() < DEADLINE, "never lost");
        if let Some(Look::Lost(lost)) = device.look() {
            reason = lost;
        }
    }
    let before = held.connections.load(Ordering::SeqCst);
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_millis(200) {
        assert!(!matches!(device.look(), Some(Look::Sensors(_))), "unanswered");
        std::thread::yield_now();
    }
    let most = begun.elapsed().as_millis() / FIRST_PAUSE.as_millis() + 2;
    let connections = held.connections.load(Ordering::SeqCst) - before;
    assert!(u128::from(connections) <= most, "{connections} connections in {:?}", begun.elapsed());
}

/// A process that is suspended behind the arrival of an answer takes it up later: the answer is as old as its arrival.
#[test]
fn an_answer_that_is_taken_up_late_is_old() {
    let stale_after = Duration::from_secs(5);
    for (age, is_lost) in [(Duration::ZERO, false), (2 * stale_after, true)] {
        let Some(arrived) = Instant::now().checked_sub(age) else {
            // A machine that has not run for so long has no such time.
            continue;
        };
        let state = State {
            number: 1,
            seen: Look::Lost("no answer yet".into()),
            seen_at: arrived,
            seen_by: 0,
            wiring: Arc::new(Wiring {
                number: 0,
                inputs: Plan::new(&Side::default()),
                outputs: Plan::new(&Side::default()),
            }),
            left: Left::new(),
            outputs: None,
            contested: false,
            connected: true,
            fail_safe: None,
            ending: false,
        };
        let shared = Arc::new(Shared { state: Mutex::new(state), changed: Notify::new() });
        let seen = Arc::clone(&shared);
        let mut device = Device {
            shared,
            stale_after,
            looked_at: 1,
            stale: false,
            contested: false,
            connected: true,
            looked_by: 0,
            thread: None,
        };
        seen.see(Look::Sensors(Image::zero(1)), arrived, 0);
        assert_eq!(matches!(device.look(), Some(Look::Lost(_))), is_lost, "{age:?}");
    }
}

/// A device of one of two remote I/Os is connected by the author only, and is written to by none that has let it go, nor by one that ends.
/// The fail-safe values that count at the end are those that it was told last.
#[test]
fn a_device_is_left_with_the_newest_fail_safe_values() {
    let period = Duration::from_millis(2);
    for newest in [None, Some([true, false])] {
        let (mut device, held) = started(Ends::After(u64::MAX), period);
        looks(&mut device, period, 5);
        if let Some(newest) = newest {
            device.end_with(&Image::from_bits(newest));
            looks(&mut device, period, 5);
        }
        let coils = || held.coils.lock().expect("no panic").clone();
        assert_eq!(coils(), BTreeMap::from([(3, true), (800, true)]), "it runs on");
        drop(device);
        let [valve, pump] = newest.unwrap_or([false, false]);
        assert_eq!(coils(), BTreeMap::from([(3, valve), (800, pump)]));
    }
}

#[test]
fn a_device_of_two_remote_ios_is_written_to_by_the_author() {
    let (address, held) = serve(Ends::After(u64::MAX));
    let period = Duration::from_millis(2);
    let start = || Device::start_in_pair(settings(address), period, false).expect("a thread");
    let (mut author, mut follower) = (start(), start());
    let connections = || held.connections.load(Ordering::SeqCst);
    author.connect(true);
    looks(&mut author, period, 5);
    follower.drive(&Image::from_bits([false, false]), Duration::ZERO);
    author.end_with(&Image::from_bits([false, true]));
    assert_eq!((connections(), follower.look()), (1, None));
    let coils = || held.coils.lock().expect("no panic").clone();
    let driven = BTreeMap::from([(3, true), (800, true)]);
    assert_eq!(coils(), driven);
    author.connect(false);
    author.drive(&Image::from_bits([false, false]), Duration::ZERO);
    follower.connect(true);
    looks(&mut follower, period, 5);
    assert_eq!((coils(), author.look()), (driven.clone(), None));
    drop(author);
    drop(follower);
    assert_eq!(coils(), driven, "neither drives the fail-safe values when it ends");
}

/// Another wiring counts from the next exchange on, and what is seen names the wiring that it was read by. A coil that no output has any more gets the
/// fail-safe value of its output, once; one that another output takes over is driven by that.
#[test]
fn outputs_that_are_gone_are_driven_once_more() {
    let period = Duration::from_millis(2);
    let (mut device, held) = started(Ends::After(u64::MAX), period);
    looks(&mut device, period, 3);
    assert_eq!(device.looked_by(), 0);
    let (address, _) = serve(Ends::After(u64::MAX));
    let other = wired(
        address,
        "low = \"discrete:4\", high = \"discrete:3\"",
        "valve = \"coil:4\", pump = \"coil:3\"",
    );
    // Valve and pump before, in this order.
    let last = Image::from_bits([true, false]);
    let number = device.rewire(&other.inputs, &other.outputs, &last);
    let mut seen = None;
    let started = Instant::now();
    while seen.is_none() || device.looked_by() != number {
        assert!(started.elapsed() < DEADLINE);
        device.drive(&Image::from_bits([true, false]), Duration::ZERO);
        let look = device.look();
        seen = look.filter(|_| device.looked_by() == number);
        std::thread::sleep(period);
    }
    let coils = || held.coils.lock().expect("no panic").clone();
    assert_eq!(coils(), BTreeMap::from([(3, false), (4, true), (800, false)]));
    looks(&mut device, period, 3);
    assert_eq!(coils(), BTreeMap::from([(3, true), (4, true), (800, false)]));
    // It is not this remote I/O's any more.
    held.coils.lock().expect("no panic").insert(800, true);
    let seen = looks(&mut device, period, 5);
    assert_eq!(seen.last(), Some(&Look::Sensors(Image::from_bits([true, true]))));
    assert_eq!(coils().get(&800), Some(&true));
    assert_eq!(device.contested(), None);
}
