//! The proxy on real sockets. What is random is tested where it is decided, in the shaper; here it is that it reaches the wire.

use std::io::{Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::time::Duration;

use understudy_network::{Impairment, NetworkError, Proxy, Route, Share, Transport};

/// Past it a test has failed.
const DEADLINE: Duration = Duration::from_secs(60);
/// For what must not come at all.
const MOMENT: Duration = Duration::from_millis(200);

fn anywhere() -> SocketAddr {
    (Ipv4Addr::LOCALHOST, 0).into()
}

fn socket(patience: Duration) -> UdpSocket {
    let socket = UdpSocket::bind(anywhere()).expect("a free port");
    socket.set_read_timeout(Some(patience)).expect("a timeout");
    socket
}

fn route(to: SocketAddr, transport: Transport, forth: Impairment) -> Route {
    Route { listen: anywhere(), to, transport, forth, back: Impairment::default() }
}

/// A proxy before a socket: client, server, and where the client sends to.
fn datagrams(forth: Impairment) -> (Proxy, UdpSocket, UdpSocket, SocketAddr) {
    let (client, server) = (socket(DEADLINE), socket(DEADLINE));
    let to = server.local_addr().expect("bound");
    let proxy = Proxy::start(&[route(to, Transport::Udp, forth)], 1).expect("a free port");
    let at = proxy.addresses()[0];
    (proxy, client, server, at)
}

#[test]
fn datagrams_go_there_and_answers_come_back_to_whom_they_are_for() {
    let (proxy, first, server, at) = datagrams(Impairment::default());
    let second = socket(DEADLINE);
    let mut buffer = [0; 64];
    for (client, word) in [(&first, b"one"), (&second, b"two")] {
        client.send_to(word, at).expect("sent");
        let (length, from) = server.recv_from(&mut buffer).expect("it arrives");
        assert_eq!(&buffer[..length], word);
        server.send_to(&buffer[..length], from).expect("sent");
    }
    for (client, word) in [(&first, b"one"), (&second, b"two")] {
        let length = client.recv(&mut buffer).expect("the answer comes");
        assert_eq!(&buffer[..length], word);
    }
    drop(proxy);
    first.send_to(b"late", at).expect("sent");
    server.set_read_timeout(Some(MOMENT)).expect("a timeout");
    assert!(server.recv(&mut buffer).is_err(), "a proxy that ended carries nothing");
}

#[test]
fn doubled_and_changed_datagrams_arrive_so() {
    let always = Share::new(1.0).expect("a share");
    let (proxy, client, server, at) = datagrams(Impairment {
        duplicate: always,
        corrupt: always,
        delay: Duration::from_millis(1),
        ..Impairment::default()
    });
    client.send_to(&[0; 8], at).expect("sent");
    for _ in 0..2 {
        let mut buffer = [0; 64];
        let length = server.recv(&mut buffer).expect("it arrives");
        let bits: u32 = buffer[..length].iter().map(|byte| byte.count_ones()).sum();
        assert_eq!((length, bits), (8, 1));
    }
    let counters = proxy.counters();
    assert_eq!((counters.came, counters.lost, counters.refused), (1, 0, 0));
}

#[test]
fn a_stream_arrives_whole_however_bad_the_line_is() {
    let listener = TcpListener::bind(anywhere()).expect("a free port");
    let to = listener.local_addr().expect("bound");
    let forth = Impairment {
        loss: Share::new(0.02).expect("a share"),
        jitter: Duration::from_millis(1),
        ..Impairment::default()
    };
    let proxy = Proxy::start(&[route(to, Transport::Tcp, forth)], 1).expect("a free port");
    let sent: Vec<u8> = (0..100_000_u32).map(|number| number as u8).collect();
    let mut client = TcpStream::connect(proxy.addresses()[0]).expect("it listens");
    client.set_read_timeout(Some(DEADLINE)).expect("a timeout");
    let (mut server, _) = listener.accept().expect("it connects");
    let writing = std::thread::spawn({
        let (mut client, sent) = (client.try_clone().expect("a handle"), sent.clone());
        move || {
            client.write_all(&sent).expect("taken");
            client.shutdown(std::net::Shutdown::Write).expect("closed");
        }
    });
    let mut received = Vec::new();
    server.read_to_end(&mut received).expect("it ends");
    writing.join().expect("no panic");
    assert!(received == sent, "{} of {} bytes", received.len(), sent.len());
    server.write_all(b"thanks").expect("taken");
    drop(server);
    let mut answer = Vec::new();
    client.read_to_end(&mut answer).expect("it ends");
    assert_eq!(answer, b"thanks");
}

#[test]
fn what_a_stream_cannot_have_is_refused() {
    let forth = Impairment { reorder: Share::new(0.1).expect("a share"), ..Impairment::default() };
    let refused = Proxy::start(&[route(anywhere(), Transport::Tcp, forth)], 1);
    assert!(matches!(refused, Err(NetworkError::NotOverTcp { what: "to reorder" })));
}

#[test]
fn an_address_in_use_is_named() {
    let taken = socket(DEADLINE);
    let address = taken.local_addr().expect("bound");
    let route =
        Route { listen: address, ..route(anywhere(), Transport::Udp, Impairment::default()) };
    let refused = Proxy::start(&[route], 1);
    assert!(
        matches!(refused, Err(NetworkError::Listen { address: named, .. }) if named == address)
    );
}
