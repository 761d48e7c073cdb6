//! Strangers who only connect: 5,000 connections to the operators' port of a remote I/O, without keys and without a byte, while its device
//! goes away and comes back.

#![allow(clippy::print_stderr, reason = "what was measured is worth a line")]

use std::collections::VecDeque;
use std::fs;
use std::io;
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, TcpListener, TcpStream};
use std::os::fd::AsRawFd;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, AtomicUsize, Ordering};
use std::thread::spawn;
use std::time::{Duration, Instant};

use nix::sys::socket::{AddressFamily, SockFlag, SockType, SockaddrIn, bind, connect, socket};
use understudy_bus::free_addresses;

use super::shared::modbus;
use super::{DEADLINE, Running, answer, empty_folder, one_at_a_time, text};

const CONNECTIONS: usize = 5_000;

/// The newest of them stay open; more than the remote I/O may have.
const KEPT: usize = 600;

/// As `ulimit -n` has it on most machines.
const DESCRIPTORS: usize = 1_024;

/// Not the address of the operator.
const STRANGER: Ipv4Addr = Ipv4Addr::new(127, 0, 0, 9);

/// A Modbus device: it puts the next question when the last one was answered.
#[derive(Default)]
pub(crate) struct Device {
    pub(crate) is_there: AtomicBool,
    asking: AtomicBool,
    answered: AtomicU64,
    fail_safe: AtomicU64,
    pub(crate) over: AtomicBool,
    /// Its coils.
    coils: AtomicU8,
}

impl Device {
    pub(crate) fn run(self: &Arc<Self>, address: SocketAddr) {
        while !self.over.load(Ordering::Relaxed) {
            if !self.is_there.load(Ordering::Relaxed) {
                pause();
                continue;
            }
            let listener = TcpListener::bind(address).expect("its port is its own");
            listener.set_nonblocking(true).expect("a socket");
            while self.is_there.load(Ordering::Relaxed) {
                match listener.accept() {
                    Ok((connection, _)) => {
                        let device = Arc::clone(self);
                        // It ends as it likes: the remote I/O makes a new one.
                        spawn(move || device.serve(connection));
                    }
                    Err(_) => std::thread::yield_now(),
                }
            }
        }
    }

    fn serve(&self, mut connection: TcpStream) -> io::Result<()> {
        connection.set_nonblocking(false)?;
        connection.set_nodelay(true)?;
        connection.set_read_timeout(Some(Duration::from_secs(5)))?;
        while self.is_there.load(Ordering::Relaxed) {
            let (head, request) = modbus::request(&mut connection)?;
            let answer = match request[..] {
                // Read one discrete input.
                [2, 0, 0, 0, 1] => vec![2, 1, u8::from(self.asking.load(Ordering::Relaxed))],
                // Read two coils.
                [1, 0, 0, 0, 2] => vec![1, 1, self.coils.load(Ordering::Relaxed)],
                // Write two coils.
                [15, 0, 0, 0, 2, 1, coils] => {
                    self.coils.store(coils & 3, Ordering::Relaxed);
                    self.written(coils & 1 == 1, coils & 2 == 2);
                    vec![15, 0, 0, 0, 2]
                }
                _ => return Err(io::ErrorKind::InvalidData.into()),
            };
            head.answer(&mut connection, &answer)?;
        }
        Ok(())
    }

    fn written(&self, alive: bool, acknowledged: bool) {
        if !alive {
            self.fail_safe.fetch_add(1, Ordering::Relaxed);
        } else if acknowledged == self.asking.load(Ordering::Relaxed) {
            self.answered.fetch_add(1, Ordering::Relaxed);
            self.asking.store(!acknowledged, Ordering::Relaxed);
        }
    }

    pub(crate) fn wait_for_answers(&self, more: u64) {
        let from = self.answered.load(Ordering::Relaxed);
        until("answers to the device", || self.answered.load(Ordering::Relaxed) >= from + more);
    }
}

/// Between two looks, which read whole journals: the processes of the cluster need the processors.
fn pause() {
    std::thread::sleep(Duration::from_millis(50));
}

pub(crate) fn until(what: &str, mut done: impl FnMut() -> bool) {
    let started = Instant::now();
    while !done() {
        assert!(started.elapsed() < DEADLINE, "waited for: {what}");
        pause();
    }
}

pub(crate) fn cluster(folder: &Path, addresses: &[SocketAddr]) -> String {
    let program =
        "program valve\ninput req\noutput alive\noutput ack\nrung ( alive )\nrung req ( ack )\n";
    fs::write(folder.join("valve.ladder"), program).expect("it is ours");
    let [valve, understudy, remote_io, device] = addresses else {
        panic!("four addresses");
    };
    let text = format!(
        r#"
[cluster]
name = "crowd"
period = "20ms"

[[controller]]
name = "valve"
address = "{valve}"
ladder = "valve.ladder"

[[understudy]]
name = "understudy"
address = "{understudy}"

[[remote_io]]
name = "valve-io"
address = "{remote_io}"
controller = "valve"
fail_safe = {{ alive = false, ack = false }}

[remote_io.field]
modbus = "{device}"
stale_after = "500ms"
inputs = {{ req = "discrete:0" }}
outputs = {{ alive = "coil:0", ack = "coil:1" }}
"#
    );
    let file = folder.join("cluster.toml");
    fs::write(&file, text).expect("it is ours");
    file.display().to_string()
}

/// Connects from an address of its own; nothing where the system does not let it.
fn stranger(to: SocketAddr) -> Option<TcpStream> {
    let SocketAddr::V4(to) = to else {
        return None;
    };
    let flags = SockFlag::SOCK_CLOEXEC;
    let socket = socket(AddressFamily::Inet, SockType::Stream, flags, None).ok()?;
    let own = SockaddrIn::from(SocketAddrV4::new(STRANGER, 0));
    bind(socket.as_raw_fd(), &own).ok()?;
    connect(socket.as_raw_fd(), &SockaddrIn::from(to)).ok()?;
    Some(TcpStream::from(socket))
}

/// The remote I/O, with no more descriptors than most machines give.
fn remote_io(cluster: &str, keys: &str, journal: &Path) -> Running {
    let limited = format!("ulimit -n {DESCRIPTORS} && exec \"$0\" \"$@\"");
    let child = Command::new("sh")
        .args(["-c", &limited, env!("CARGO_BIN_EXE_understudy")])
        .args(["remote-io", cluster, "--name", "valve-io", "--keys", keys])
        .args(["--link", "udp", "--no-real-time"])
        .args(["--journal", text(journal)])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn();
    Running(child.expect("a shell"))
}

fn descriptors(process: u32) -> usize {
    let open = fs::read_dir(format!("/proc/{process}/fd")).expect("it runs");
    open.count()
}

pub(crate) fn count(journal: &Path, event: &str) -> usize {
    let text = fs::read_to_string(journal).unwrap_or_default();
    text.matches(&format!("\"event\":\"{event}\"")).count()
}

#[test]
fn connections_of_strangers_take_no_plant_out_of_service() {
    let _one = one_at_a_time();
    let folder = empty_folder("crowd");
    let addresses = free_addresses(4).expect("four free ports");
    let cluster = cluster(&folder, &addresses);
    let (port, device_address) = (addresses[2], addresses[3]);
    let keys = folder.join("keys");
    let (status, made, _) = answer(&["keys", "init", &cluster, "--folder", text(&keys)]);
    assert_eq!(status, 0, "{made:#}");
    let keys_of = |name: &str| format!("{}/members/{name}", text(&keys));
    let station = |name: &str| {
        let (own, common) = (keys_of(name), ["--link", "udp", "--no-real-time"]);
        let start = ["node", &cluster, "--name", name, "--keys", &own];
        Running::start(&[&start[..], &common].concat())
    };
    let device = Arc::new(Device::default());
    device.is_there.store(true, Ordering::Relaxed);
    let running_device = {
        let device = Arc::clone(&device);
        spawn(move || device.run(device_address))
    };
    let stations = ["valve", "understudy"].map(station);
    let journal = folder.join("valve-io.jsonl");
    let remote_io = remote_io(&cluster, &keys_of("valve-io"), &journal);
    let process = remote_io.0.id();
    device.wait_for_answers(20);
    let operate = || {
        let own = keys_of("engineer");
        let call = ["operate", &cluster, "--name", "valve-io", "--keys", &own];
        answer(&[&call[..], &["status"]].concat()).0
    };
    until("the operators' port", || operate() == 0);
    let before = descriptors(process);

    let made = Arc::new(AtomicUsize::new(0));
    let crowd = {
        let made = Arc::clone(&made);
        spawn(move || {
            let mut kept = VecDeque::new();
            while made.load(Ordering::Relaxed) < CONNECTIONS {
                if let Some(connection) = stranger(port) {
                    kept.push_back(connection);
                    made.fetch_add(1, Ordering::Relaxed);
                }
                if kept.len() > KEPT {
                    kept.pop_front();
                }
            }
            kept
        })
    };
    let mut most = 0;
    let started = Instant::now();
    let goes_and_returns = || {
        let lost = count(&journal, "field-lost");
        device.is_there.store(false, Ordering::Relaxed);
        until("the loss of the device", || count(&journal, "field-lost") > lost);
        device.is_there.store(true, Ordering::Relaxed);
    };
    while !crowd.is_finished() {
        goes_and_returns();
        device.wait_for_answers(20);
        most = most.max(descriptors(process));
    }
    let kept = crowd.join().expect("no panic");
    eprintln!("{CONNECTIONS} connections in {:?}", started.elapsed());
    assert_eq!(made.load(Ordering::Relaxed), CONNECTIONS);
    goes_and_returns();
    device.wait_for_answers(20);
    until("an operator beside the strangers", || operate() == 0);
    most = most.max(descriptors(process));
    assert!(most < DESCRIPTORS / 2, "{before} descriptors without strangers, {most} with them");

    // No station is left, and the device was away: its outputs become fail-safe all the same.
    drop(stations);
    goes_and_returns();
    let written = device.fail_safe.load(Ordering::Relaxed);
    until("fail-safe outputs", || device.fail_safe.load(Ordering::Relaxed) > written);

    drop(kept);
    let gone = Instant::now();
    until("descriptors", || descriptors(process) <= before + 4);
    let freed = gone.elapsed();
    assert!(freed < Duration::from_secs(10), "the last after {freed:?}");
    eprintln!("{before} descriptors, {most} with strangers, freed after {freed:?}");
    assert_eq!(operate(), 0);
    assert!(count(&journal, "refused-connections") > 0);
    device.over.store(true, Ordering::Relaxed);
    device.is_there.store(false, Ordering::Relaxed);
    drop(remote_io);
    running_device.join().expect("no panic");
}
