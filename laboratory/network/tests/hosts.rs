//! Hosts of namespaces, where this machine lets the tests make them.

use std::collections::BTreeSet;
use std::net::{SocketAddr, UdpSocket};
use std::time::Duration;

use understudy_network::{Hosts, NetworkError, Share};
use understudy_testing::skip;
use understudy_wire::Via;

/// For what comes at once or never.
const PATIENCE: Duration = Duration::from_secs(2);

fn hosts(count: usize) -> Option<Hosts> {
    let names: Vec<String> = (0..count).map(|number| format!("host-{number}")).collect();
    match Hosts::build(&names, false, &BTreeSet::new()) {
        Ok(hosts) => Some(hosts),
        Err(error @ (NetworkError::NotPermitted { .. } | NetworkError::NoTool { .. })) => {
            skip(error);
            None
        }
        Err(error) => panic!("{error}"),
    }
}

fn sockets(hosts: &Hosts) -> Vec<UdpSocket> {
    let places = 0..hosts.hosts().len();
    let socket = |place: usize| {
        let address = SocketAddr::from((hosts.hosts()[place].address(Via::First), 7450));
        let socket = hosts.within(place, || UdpSocket::bind(address));
        let socket = socket.expect("the host is there").expect("a free port");
        socket.set_read_timeout(Some(PATIENCE)).expect("a timeout");
        socket
    };
    places.map(socket).collect()
}

/// How many of `count` datagrams from one host to another arrive.
fn arrive(sockets: &[UdpSocket], from: usize, to: usize, count: usize) -> usize {
    let address = sockets[to].local_addr().expect("bound");
    for _ in 0..count {
        sockets[from].send_to(b"frame", address).expect("sent");
    }
    let mut buffer = [0; 16];
    (0..count).take_while(|_| sockets[to].recv(&mut buffer).is_ok()).count()
}

#[test]
fn links_are_cut_and_healed_one_way_at_a_time() {
    let Some(mut hosts) = hosts(3) else {
        return;
    };
    let sockets = sockets(&hosts);
    for from in 0..3 {
        for to in 0..3 {
            if from != to {
                assert_eq!(arrive(&sockets, from, to, 3), 3, "{from} to {to}");
            }
        }
    }
    hosts.cut((0, 1), true);
    hosts.apply().expect("cut");
    assert_eq!(arrive(&sockets, 0, 1, 3), 0);
    assert_eq!(arrive(&sockets, 1, 0, 3), 3);
    assert_eq!(arrive(&sockets, 0, 2, 3), 3);
    hosts.cut((0, 1), false);
    hosts.apply().expect("healed");
    assert_eq!(arrive(&sockets, 0, 1, 3), 3);
}

#[test]
fn a_share_is_lost_by_chance() {
    let Some(mut hosts) = hosts(2) else {
        return;
    };
    let sockets = sockets(&hosts);
    assert_eq!(arrive(&sockets, 0, 1, 100), 100);
    let half = Share::new(0.5).expect("a share");
    hosts.lose(&[(0, 1)], half);
    hosts.apply().expect("lost");
    let found = arrive(&sockets, 0, 1, 100);
    assert!((20..80).contains(&found), "{found} of 100");
    let none = Share::default();
    hosts.lose(&[(0, 1)], none);
    hosts.apply().expect("whole again");
    assert_eq!(arrive(&sockets, 0, 1, 100), 100);
}

#[test]
fn the_machines_own_network_stays_as_it_is() {
    let namespace = || std::fs::read_link("/proc/thread-self/ns/net").expect("a Linux");
    let before = namespace();
    let Some(hosts) = hosts(1) else {
        return;
    };
    assert_eq!(namespace(), before);
    let there = hosts.within(0, namespace).expect("the host is there");
    assert_ne!(there, before);
    assert_eq!(namespace(), before);
    let named = std::fs::read_dir("/run/netns").map_or(0, Iterator::count);
    drop(hosts);
    assert_eq!(std::fs::read_dir("/run/netns").map_or(0, Iterator::count), named);
}
