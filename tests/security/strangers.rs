//! Somebody on the network of a cluster that runs. He takes the address of a station that is dead, receives what the others send to it and to
//! their multicast groups, and sends what he likes to them and to the groups: what he received again, frames that he made with keys of his
//! own, frames without keys, and nonsense.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, SocketAddrV4, UdpSocket};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::spawn;
use std::time::{Duration, Instant};

use serde_json::Value;
use socket2::{Domain, SockRef, Socket, Type};
use understudy_seal::{FrameKey, Seal};
use understudy_wire::{
    Body, ClusterHash, ConfigurationHash, Cycle, Epoch, Frame, Header, Member, Moment, StationId,
    encode,
};

use super::{DEADLINE, addressed_cell, answer, empty_folder, some_at_a_time, text};

const SCENARIO: &str = r#"
title = "a stranger in the place of the dead understudy"
cycles = 400

[[step]]
at = 40
action = "crash"
station = "understudy"
"#;

/// What the stranger has to offer each time that he hears something.
fn offers(heard: &[u8], kept: &[Vec<u8>]) -> Vec<Vec<u8>> {
    let sync = |sender| Frame {
        header: Header {
            cluster: ClusterHash::of(b"press-cell"),
            configuration: ConfigurationHash(1),
            prepared: None,
            moment: Moment { epoch: Epoch(u64::MAX), cycle: Cycle(1) },
            sender,
            alone: false,
        },
        body: Body::Sync,
    };
    let mut bytes = Vec::new();
    let mut sealed = |sender| {
        let frame = sync(sender);
        bytes.clear();
        encode(&frame, &mut bytes).expect("a sensible frame");
        let mut datagram = Vec::new();
        Seal::new(sender, FrameKey::new([66; 32]), u32::MAX, [])
            .seal(&frame, &bytes, &mut datagram)
            .expect("it is in its own name");
        datagram
    };
    let mut offers = vec![
        heard.to_vec(),
        sealed(Member::Station(StationId(0))),
        sealed(Member::Station(StationId(1))),
        sealed(Member::Station(StationId(9))),
        b"nonsense".to_vec(),
    ];
    offers.push(bytes);
    offers.extend(kept.iter().cloned());
    offers
}

/// The first multicast group of the members that run a cluster file, as their command lines say.
fn first_group(cluster: &Path) -> Option<SocketAddrV4> {
    let processes = fs::read_dir("/proc").ok()?.flatten();
    let mut lines = processes.filter_map(|process| fs::read(process.path().join("cmdline")).ok());
    lines.find_map(|line| {
        let line = String::from_utf8_lossy(&line).into_owned();
        let words: Vec<&str> = line.split('\0').collect();
        let place = words.iter().position(|word| *word == "--multicast")?;
        let is_ours = words.contains(&text(cluster));
        words.get(place + 1)?.parse().ok().filter(|_| is_ours)
    })
}

/// The group that all receive, two of turns and two of samples.
fn addresses_of_groups(first: SocketAddrV4) -> impl Iterator<Item = SocketAddr> {
    [0, 1, 2, 17, 18].into_iter().map(move |group| {
        let address = Ipv4Addr::from(u32::from(*first.ip()) + group);
        SocketAddr::from((address, first.port()))
    })
}

/// A socket that receives what is sent to the groups; `sender` sends to them from now on.
fn member_of_the_groups(first: SocketAddrV4, sender: &UdpSocket) -> UdpSocket {
    let open = || {
        let socket = Socket::new(Domain::IPV4, Type::DGRAM, None)?;
        socket.set_reuse_address(true)?;
        socket.bind(&SocketAddr::from((Ipv4Addr::UNSPECIFIED, first.port())).into())?;
        for group in addresses_of_groups(first) {
            if let IpAddr::V4(group) = group.ip() {
                socket.join_multicast_v4(&group, &Ipv4Addr::LOCALHOST)?;
            }
        }
        socket.set_read_timeout(Some(Duration::from_millis(200)))?;
        SockRef::from(sender).set_multicast_if_v4(&Ipv4Addr::LOCALHOST)?;
        Ok::<UdpSocket, std::io::Error>(socket.into())
    };
    open().expect("the groups that the members are in")
}

#[test]
fn a_stranger_moves_nothing_and_the_journal_names_what_he_did() {
    let _one = some_at_a_time();
    let folder = empty_folder("stranger");
    let cluster = addressed_cell(&folder);
    let scenario = folder.join("stranger.toml");
    fs::write(&scenario, SCENARIO).expect("it is ours");
    let addresses = addresses(&cluster);
    let (dead, others) = (addresses["understudy"], ["robot", "press", "robot-io", "press-io"]);
    let mut targets = others.map(|name| addresses[name]).to_vec();
    let file = cluster.clone();
    let done = Arc::new(AtomicBool::new(false));
    let stop = Arc::clone(&done);
    let stranger = spawn(move || {
        // Until the understudy has its address, and again until it has it no more.
        let started = Instant::now();
        while !is_bound(dead) && !stop.load(Ordering::Relaxed) && started.elapsed() < DEADLINE {
            std::thread::yield_now();
        }
        let socket = loop {
            if let Ok(socket) = UdpSocket::bind(dead) {
                break socket;
            }
            if stop.load(Ordering::Relaxed) || started.elapsed() > DEADLINE {
                return 0;
            }
            std::thread::yield_now();
        };
        let timeout = Some(Duration::from_millis(200));
        socket.set_read_timeout(timeout).expect("it is not zero");
        let groups = first_group(&file);
        let receiver = groups.map_or_else(
            || socket.try_clone().expect("a descriptor"),
            |first| member_of_the_groups(first, &socket),
        );
        targets.extend(groups.into_iter().flat_map(addresses_of_groups));
        let mut kept: Vec<Vec<u8>> = Vec::new();
        let mut bytes = [0; 4096];
        let mut said = 0_u64;
        while !stop.load(Ordering::Relaxed) {
            let Ok(length) = receiver.recv(&mut bytes) else {
                continue;
            };
            let heard = &bytes[..length];
            for offer in offers(heard, &kept) {
                for other in &targets {
                    // Some die before the stranger does.
                    said += u64::from(socket.send_to(&offer, other).is_ok());
                }
            }
            if kept.len() < 2 {
                kept.push(heard.to_vec());
            }
        }
        said
    });
    let (_, document, _) = answer(&[
        "lab",
        text(&cluster),
        "--scenario",
        text(&scenario),
        "--link",
        "udp",
        "--period",
        "20ms",
        "--out",
        text(&folder),
    ]);
    done.store(true, Ordering::Relaxed);
    let said = stranger.join().expect("no panic");
    let summary = &document["result"]["summary"];
    assert_eq!(summary["violation_count"], 0, "{document:#}");
    assert_eq!(summary["cycles_run"], summary["cycles_asked"], "{document:#}");
    assert!(said > 1000, "the stranger said {said} datagrams");

    let directory = document["result"]["directory"].as_str().expect("a path");
    let journal =
        fs::read_to_string(Path::new(directory).join("journal.jsonl")).expect("a journal");
    let mut named: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for line in journal.lines().filter(|line| line.contains("refused-")) {
        let record: Value = serde_json::from_str(line).expect("a record");
        let event = &record["event"];
        let kind = event["refused_as"].as_str().unwrap_or("no-frame");
        let kinds = named.entry(record["name"].to_string()).or_default();
        kinds.insert(kind.to_owned());
    }
    let all: BTreeSet<String> =
        ["foreign", "forged", "no-frame", "replayed", "unsealed"].map(str::to_owned).into();
    for name in ["\"robot\"", "\"press\"", "\"robot-io\"", "\"press-io\""] {
        assert_eq!(named.get(name), Some(&all), "{name} names something else");
    }
    let keys = Path::new(directory).join("keys");
    assert!(!keys.exists(), "the keys of a run are gone with it");
}

/// Whether somebody listens there, found without taking the place for a moment.
fn is_bound(address: SocketAddr) -> bool {
    let place = format!("0100007F:{:04X}", address.port());
    let sockets = fs::read_to_string("/proc/net/udp").expect("a Linux");
    sockets.lines().any(|line| line.split_whitespace().nth(1) == Some(place.as_str()))
}

/// Where each member listens, as its cluster file says.
fn addresses(cluster: &Path) -> BTreeMap<String, SocketAddr> {
    let text = fs::read_to_string(cluster).expect("it was written");
    let mut addresses = BTreeMap::new();
    let mut address = None;
    for line in text.lines() {
        if let Some(value) = line.strip_prefix("address = ") {
            address = value.trim_matches('"').parse().ok();
        }
        if let Some(value) = line.strip_prefix("name = ")
            && let Some(address) = address.take()
        {
            addresses.insert(value.trim_matches('"').to_owned(), address);
        }
    }
    addresses
}
