//! A write whose answer is lost on the way, by IPv6 where this machine has it.

use std::collections::VecDeque;
use std::fs;
use std::io::{Read, Write};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use understudy_bus::free_addresses;

use super::{DEADLINE, Running, answer, codes, empty_folder, some_at_a_time, text};

/// Passes connections on, and ends each after the next number of bytes to the caller.
struct Proxy {
    address: SocketAddr,
    limits: Arc<Mutex<VecDeque<usize>>>,
    connections: Arc<AtomicUsize>,
    /// To callers, of all connections.
    bytes: Arc<AtomicUsize>,
}

fn pass_on(mut from: TcpStream, mut to: TcpStream, limit: usize, passed: &AtomicUsize) {
    let (mut bytes, mut left) = ([0; 1024], limit);
    while let Ok(length @ 1..) = from.read(&mut bytes) {
        let length = length.min(left);
        left -= length;
        passed.fetch_add(length, Ordering::SeqCst);
        if to.write_all(&bytes[..length]).is_err() || left == 0 {
            break;
        }
    }
    // One that has ended already says so.
    let _ = from.shutdown(Shutdown::Both);
    let _ = to.shutdown(Shutdown::Both);
}

impl Proxy {
    fn start(host: IpAddr, to: SocketAddr) -> Self {
        let listener = TcpListener::bind((host, 0)).expect("a free port");
        let proxy = Self {
            address: listener.local_addr().expect("bound"),
            limits: Arc::default(),
            connections: Arc::default(),
            bytes: Arc::default(),
        };
        let (limits, connections, bytes) =
            (Arc::clone(&proxy.limits), Arc::clone(&proxy.connections), Arc::clone(&proxy.bytes));
        std::thread::spawn(move || {
            for caller in listener.incoming() {
                let caller = caller.expect("a connection");
                let Ok(member) = TcpStream::connect(to) else {
                    continue;
                };
                connections.fetch_add(1, Ordering::SeqCst);
                let limit = limits.lock().expect("no panic").pop_front().unwrap_or(usize::MAX);
                let (other_caller, other_member) =
                    (caller.try_clone().expect("a copy"), member.try_clone().expect("a copy"));
                let bytes = Arc::clone(&bytes);
                std::thread::spawn(move || pass_on(member, caller, limit, &bytes));
                std::thread::spawn(move || {
                    pass_on(other_caller, other_member, usize::MAX, &AtomicUsize::new(0));
                });
            }
        });
        proxy
    }
}

fn cluster(addresses: &[SocketAddr]) -> String {
    format!(
        "[cluster]\nname = \"lost\"\nperiod = \"50ms\"\n\
         [[controller]]\nname = \"pump\"\nladder = \"pump.st\"\naddress = \"{}\"\n\
         [[understudy]]\nname = \"understudy\"\naddress = \"{}\"\n\
         [[remote_io]]\nname = \"pump-io\"\ncontroller = \"pump\"\naddress = \"{}\"\n\
         [remote_io.inputs]\nstart = {{ operator = \"level\" }}\n",
        addresses[0], addresses[1], addresses[2]
    )
}

#[test]
fn a_write_whose_answer_is_lost_is_in_effect_and_not_refused() {
    let _one = some_at_a_time();
    let has_ipv6 = TcpListener::bind((Ipv6Addr::LOCALHOST, 0)).is_ok();
    let host =
        if has_ipv6 { IpAddr::from(Ipv6Addr::LOCALHOST) } else { Ipv4Addr::LOCALHOST.into() };
    let folder = empty_folder("lost_answers");
    let found = free_addresses(3).expect("free ports");
    let mut addresses: Vec<SocketAddr> =
        found.iter().map(|address| (host, address.port()).into()).collect();
    let (file, near) = (folder.join("cluster.toml"), folder.join("near.toml"));
    fs::write(
        folder.join("pump.st"),
        "PROGRAM pump\n  VAR_INPUT start : BOOL; END_VAR\n  VAR_OUTPUT running : BOOL; END_VAR\n  \
         running := start;\nEND_PROGRAM\n",
    )
    .expect("written");
    fs::write(&file, cluster(&addresses)).expect("written");
    let keys = folder.join("keys");
    let (status, made, _) = answer(&["keys", "init", text(&file), "--folder", text(&keys)]);
    assert_eq!(status, 0, "{made:#}");
    let of = |name: &str| format!("{}/members/{name}", text(&keys));
    let start = |kind: &str, name: &str| {
        let (file, keys) = (text(&file), of(name));
        Running::start(&[
            kind,
            file,
            "--name",
            name,
            "--keys",
            &keys,
            "--link",
            "udp",
            "--no-real-time",
        ])
    };
    let _members =
        [start("node", "pump"), start("node", "understudy"), start("remote-io", "pump-io")];
    let proxy = Proxy::start(host, addresses[2]);
    addresses[2] = proxy.address;
    fs::write(&near, cluster(&addresses)).expect("written");
    let engineer = of("engineer");
    let operate = |what: &[&str]| {
        let call = ["operate", text(&near), "--name", "pump-io", "--keys", &engineer];
        answer(&[&call[..], what].concat())
    };
    // The outputs of a program that was started cold wait for a person.
    let started = Instant::now();
    while operate(&["write", "start=true"]).0 != 0 {
        operate(&["release"]);
        assert!(started.elapsed() < DEADLINE, "the program does not run");
    }
    let before = proxy.bytes.load(Ordering::SeqCst);
    assert_eq!(operate(&["write", "start=false"]).0, 0);
    let whole = proxy.bytes.load(Ordering::SeqCst) - before;
    let mut repeated = 0;
    for (place, left_out) in [1, 40, 80, 120, 200, 280, 360, 500, whole / 2].into_iter().enumerate()
    {
        proxy.limits.lock().expect("no panic").push_back(whole - left_out);
        let before = proxy.connections.load(Ordering::SeqCst);
        let value = if place % 2 == 0 { "start=true" } else { "start=false" };
        let (status, document, _) = operate(&["write", value]);
        let is_uncalled = codes(&document) == ["U0509"];
        assert!(status == 0 || is_uncalled, "{left_out} of {whole} bytes: {document:#}");
        let connections = proxy.connections.load(Ordering::SeqCst) - before;
        repeated += usize::from(status == 0 && connections > 1);
        proxy.limits.lock().expect("no panic").clear();
    }
    assert!(repeated > 0, "no answer was lost");
}
