//! The channel by mutual TLS, directly and through the router of a site as `deployment/site-router.json5` sets it up.

#![allow(missing_docs, reason = "a test")]
#![allow(
    clippy::disallowed_methods,
    reason = "certificates hold from one date to another, and what is waited for has a deadline"
)]

#[allow(dead_code, reason = "each test uses its part")]
mod members;

use std::fs;
use std::net::{Ipv6Addr, SocketAddr, TcpListener};
use std::path::{Path, PathBuf};
use std::thread::{JoinHandle, spawn};
use std::time::{Duration, Instant, SystemTime};

use members::{Chatter, endpoints, peers, station};
use serde_json::json;
use understudy_bus::{
    Admitted, BusError, Call, Changes, ChannelSettings, Commands, DONE, Documents, Endpoints,
    Guard, LinesInEffect, LinkKind, MemberSettings, NoField, Peer, Request, SpareReport, Summary,
    TlsKeys, Validity, run_member,
};
use understudy_cycle::Mode;
use understudy_keys::{Authority, Date, People};
use understudy_testing::press_cell;
use understudy_wire::{
    ConfigurationHash, Configurations, Force, Role, SignalPlace, Unforce, Write, WriteId,
};
use zenoh::Wait;

const DEADLINE: Duration = Duration::from_secs(60);

/// Of a journal without records in effect.
struct NothingInEffect;

impl LinesInEffect for NothingInEffect {
    fn note(&mut self, _: &[u8]) {}

    fn repetition(&self) -> Vec<u8> {
        Vec::new()
    }

    fn attendance(&mut self) -> Option<Vec<u8>> {
        None
    }
}

/// Keys of the robot and of some people, in a folder of this name.
fn issued(name: &str, people: &[(&str, Role)]) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    if folder.exists() {
        fs::remove_dir_all(&folder).expect("an old folder goes");
    }
    let now = Date::of(SystemTime::now());
    let cluster = press_cell(Mode::Full);
    let mut authority = Authority::init(&folder, &cluster, now).expect("an empty folder");
    let people: Vec<_> = people.iter().map(|(name, role)| ((*name).to_owned(), *role)).collect();
    let people = People::from(&people[..]);
    authority.issue(&cluster, &["robot".to_owned()], people, 1, now).expect("names of the cluster");
    folder.join("members")
}

fn keys(folder: &Path, name: &str) -> TlsKeys {
    let folder = folder.join(name);
    TlsKeys {
        validity: Default::default(),
        authority: folder.join("authority.pem"),
        certificate: folder.join("certificate.pem"),
        private_key: folder.join("private-key.pem"),
    }
}

/// A router as it stands in the file, but for its addresses and its keys.
fn router(folder: &Path, member: SocketAddr, own: SocketAddr) -> zenoh::Session {
    let text = include_str!("../../../deployment/site-router.json5");
    let mut config = zenoh::Config::from_json5(text).expect("Zenoh reads it");
    let keys = keys(folder, "site-router");
    let tls = "transport/link/tls";
    for (setting, value) in [
        ("connect/endpoints", json!([format!("tls/{member}")])),
        ("listen/endpoints", json!([format!("tls/{own}")])),
        (&format!("{tls}/root_ca_certificate"), json!(keys.authority)),
        (&format!("{tls}/connect_certificate"), json!(keys.certificate)),
        (&format!("{tls}/connect_private_key"), json!(keys.private_key)),
        (&format!("{tls}/listen_certificate"), json!(keys.certificate)),
        (&format!("{tls}/listen_private_key"), json!(keys.private_key)),
    ] {
        config.insert_json5(setting, &value.to_string()).expect("it is a setting");
    }
    zenoh::open(config).wait().expect("a free port")
}

fn changes() -> Changes {
    let text = "what everybody has to agree on";
    let own = ConfigurationHash::of(text.as_bytes());
    Changes::new(Configurations { own, prepared: None }, None, text.to_owned(), None)
}

/// A member that runs with a channel for those who are admitted.
fn member_with(
    endpoints: Endpoints,
    keys: TlsKeys,
    admitted: fn() -> Admitted,
) -> JoinHandle<Result<Summary, BusError>> {
    spawn(move || {
        let changes = changes();
        let settings = MemberSettings {
            changes: changes.clone(),
            retention: Default::default(),
            endpoints,
            link: LinkKind::Udp,
            period: press_cell(Mode::Full).agreement().schedule.period(),
            guard: Guard::Off,
            channel: Some(ChannelSettings {
                keys,
                admitted: Box::new(admitted),
                changes,
                in_effect: Box::new(NothingInEffect),
            }),
            field: Box::new(NoField),
            commands: Commands::None,
            ends_with_parent: false,
            real_time: false,
            spin: false,
        };
        run_member(Chatter::new(station(0), 1), settings, std::io::sink())
    })
}

fn until<T>(what: &str, mut ask: impl FnMut() -> Result<T, BusError>) -> T {
    let started = Instant::now();
    loop {
        match ask() {
            Ok(answer) => return answer,
            Err(error) => assert!(started.elapsed() < DEADLINE, "{what}: {error}"),
        }
    }
}

#[test]
fn a_control_room_reads_through_the_router_of_its_site_and_a_leader_commands() {
    let people = [
        ("site-router", Role::Engineer),
        ("control-room", Role::Viewer),
        ("shift-leader", Role::Engineer),
        ("line-operator", Role::Operator),
        ("passer-by", Role::Viewer),
    ];
    let folder = issued("channel", &people);
    let mut peers = peers(&[station(0)]);
    peers[0].name = "robot".into();
    let endpoint = endpoints(station(0), &peers);
    let (member, hash) = (endpoint.own().address, endpoint.cluster());
    let running = member_with(endpoint, keys(&folder, "robot"), || Admitted {
        engineers: vec!["site-router.1".into(), "shift-leader.1".into()],
        operators: vec!["line-operator.1".into()],
        viewers: Vec::new(),
        members: vec!["robot.1".into()],
    });
    let call = |address, who: &str| Call::to(address, hash, "robot", &keys(&folder, who));
    let asked = |address, who: &str, request| call(address, who)?.ask(&request);

    let text = until("the member itself", || asked(member, "shift-leader", Request::Configuration));
    assert_eq!(text, "what everybody has to agree on");
    let hash_there = asked(member, "shift-leader", Request::Cluster);
    let expected = ConfigurationHash::of(text.as_bytes()).to_string();
    assert_eq!(hash_there.ok(), Some(expected));
    let force = Request::Force(Force {
        signal: SignalPlace::Output(0),
        value: true.into(),
        seconds: 0,
        owner: "anna".to_owned(),
        reason: "to see it".to_owned(),
        points: None,
    });
    let refused = asked(member, "shift-leader", force);
    assert!(refused.as_ref().is_ok_and(|answer| answer != DONE), "no time: {refused:?}");
    let unforce = Request::Unforce(Unforce { signal: SignalPlace::Output(0), points: None });
    let taken = asked(member, "shift-leader", unforce.clone());
    assert_eq!(taken.ok().as_deref(), Some(DONE));
    let status = asked(member, "line-operator", Request::Status);
    assert!(status.is_ok(), "{status:?}");
    let denied = asked(member, "line-operator", unforce.clone());
    assert!(
        matches!(denied, Err(BusError::Unanswered { .. })),
        "an operator does not force: {denied:?}"
    );
    let denied = asked(member, "passer-by", unforce);
    assert!(matches!(denied, Err(BusError::Unanswered { .. })), "{denied:?}");
    let denied = asked(member, "passer-by", Request::Status);
    assert!(matches!(denied, Err(BusError::Unanswered { .. })), "{denied:?}");

    // This member takes writes and never answers them: that is no refusal.
    let write = Request::Write(Write {
        id: WriteId { session: 1, number: 1 },
        input: 0,
        value: true.into(),
        role: Role::Operator,
        owner: "anna".to_owned(),
        reason: "to see it".to_owned(),
        points: None,
    });
    let lost = asked(member, "line-operator", write.clone());
    assert!(matches!(lost, Err(BusError::AnswerLost { .. })), "{lost:?}");
    let denied = asked(member, "passer-by", write);
    assert!(matches!(denied, Err(BusError::Unanswered { .. })), "{denied:?}");

    let listener = TcpListener::bind(("127.0.0.1", 0)).expect("a free port");
    let site = listener.local_addr().expect("bound");
    drop(listener);
    let router = router(&folder, member, site);
    let status = until("the router", || asked(site, "control-room", Request::Status));
    assert!(status.contains("\"event\":\"ready\""), "{status}");
    let denied = asked(site, "control-room", Request::Stop);
    assert!(matches!(denied, Err(BusError::Unanswered { .. })), "{denied:?}");
    let denied = asked(site, "passer-by", Request::Status);
    assert!(matches!(denied, Err(BusError::Unanswered { .. })), "{denied:?}");
    let started = Instant::now();
    while !running.is_finished() {
        // Where the answer is lost, the member ends all the same.
        let _ = asked(site, "shift-leader", Request::Stop);
        assert!(started.elapsed() < DEADLINE, "the leader is not obeyed");
    }
    let ended = running.join().expect("no panic");
    ended.expect("it ends as it is told to");
    router.close().wait().expect("it is open");
}

/// A spare of one name cannot report for another one, and neither can a viewer or an operator.
#[test]
fn a_member_takes_the_report_of_a_spare_from_the_holder_of_its_name() {
    let people = ["spare-1", "spare-2", "leader"];
    let roles = [Role::Viewer, Role::Viewer, Role::Engineer];
    let issued_to: Vec<_> = people.into_iter().zip(roles).collect();
    let folder = issued("channel-spares", &issued_to);
    let mut peers = peers(&[station(0)]);
    peers[0].name = "robot".into();
    let endpoint = endpoints(station(0), &peers);
    let (member, hash) = (endpoint.own().address, endpoint.cluster());
    let running = member_with(endpoint, keys(&folder, "robot"), || Admitted {
        engineers: vec!["leader.1".into()],
        viewers: vec!["spare-1.1".into(), "spare-2.1".into()],
        ..Admitted::default()
    });
    let asked = |who: &str, request: Request| {
        Call::to(member, hash, "robot", &keys(&folder, who))?.ask(&request)
    };
    until("the member", || asked("leader", Request::Configuration));
    let report = |spare: &str| SpareReport { spare: spare.to_owned(), serves: None };
    for who in people {
        for spare in ["spare-1", "spare-2"] {
            let answer = asked(who, Request::Spare(report(spare)));
            if who == spare {
                assert_eq!(answer.as_deref().ok(), Some(DONE), "{who}: {answer:?}");
            } else {
                assert!(
                    matches!(answer, Err(BusError::Unanswered { .. })),
                    "{who} for {spare}: {answer:?}"
                );
            }
        }
    }
    let started = Instant::now();
    while !running.is_finished() {
        let _ = asked("leader", Request::Stop);
        assert!(started.elapsed() < DEADLINE, "the leader is not obeyed");
    }
    running.join().expect("no panic").expect("it ends as it is told to");
}

/// Keys whose certificates name `address`.
fn issued_at(address: Ipv6Addr) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("channel-ipv6");
    if folder.exists() {
        fs::remove_dir_all(&folder).expect("an old folder goes");
    }
    let text = format!(
        "[cluster]\nname = \"line\"\n\
         [[controller]]\nname = \"robot\"\nladder = \"robot.ladder\"\naddress = \"[{address}]:7450\"\n\
         [[understudy]]\nname = \"understudy\"\naddress = \"[{address}]:7451\"\n\
         [[remote_io]]\nname = \"robot-io\"\ncontroller = \"robot\"\naddress = \"[{address}]:7452\"\n"
    );
    let cluster = understudy_testing::cluster(&text, Mode::Full);
    let now = Date::of(SystemTime::now());
    let mut authority = Authority::init(&folder, &cluster, now).expect("an empty folder");
    let people = [("leader".to_owned(), Role::Engineer)];
    let people = People::from(&people[..]);
    authority.issue(&cluster, &["robot".to_owned()], people, 1, now).expect("names of the cluster");
    folder.join("members")
}

#[test]
fn an_operator_reaches_a_member_with_an_ipv6_address() {
    let Ok(found) = TcpListener::bind((Ipv6Addr::LOCALHOST, 0)) else {
        return understudy_testing::skip("this machine has no IPv6");
    };
    let address = found.local_addr().expect("bound");
    drop(found);
    let folder = issued_at(Ipv6Addr::LOCALHOST);
    let peers = [Peer::new(station(0), "robot".into(), address)];
    let endpoint = endpoints(station(0), &peers);
    let hash = endpoint.cluster();
    let running = member_with(endpoint, keys(&folder, "robot"), || Admitted {
        engineers: vec!["leader.1".into()],
        ..Admitted::default()
    });
    let ask = |request| Call::to(address, hash, "robot", &keys(&folder, "leader"))?.ask(&request);
    let text = until("the member", || ask(Request::Configuration));
    assert_eq!(text, "what everybody has to agree on");
    let started = Instant::now();
    while !running.is_finished() {
        // Where the answer is lost, the member ends all the same.
        let _ = ask(Request::Stop);
        assert!(started.elapsed() < DEADLINE, "the leader is not obeyed");
    }
    running.join().expect("no panic").expect("it ends as it is told to");
}

/// No call is made with a certificate that does not count by the clock of this machine: the answer is at once, and says so.
#[test]
fn a_caller_whose_clock_is_outside_its_certificate_is_told_both_times() {
    const REASON: &str =
        "valid from 2026-11-26T17:00:00Z, and the clock of this machine is at 2020-01-01T00:00:00Z";
    let keys = TlsKeys {
        authority: "authority.pem".into(),
        certificate: "certificate.pem".into(),
        private_key: "private-key.pem".into(),
        validity: Validity::by(|| Some(REASON.to_owned())),
    };
    let address = SocketAddr::from(([127, 0, 0, 1], 7450));
    let cluster = press_cell(Mode::Full).agreement().cluster;
    let call = Call::to(address, cluster, "robot", &keys).map(|_| ());
    let documents = Documents::open(address, Some(&keys)).map(|_| ());
    for refused in [call, documents] {
        let error = refused.expect_err("no call is made");
        assert_eq!(error.code(), "U0582");
        assert!(error.to_string().contains(REASON), "{error}");
    }
}
