//! Members as processes: killed, told to stop, left alone. Has a main of its own, because the members are this program again.

#![allow(missing_docs, reason = "a test")]
#![allow(
    clippy::disallowed_methods,
    reason = "real links take real time, and a test that waits has a deadline"
)]
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "it reports what it tests")]

mod members;

use std::collections::{BTreeSet, HashMap};
use std::io::{BufRead, BufReader, Write};
use std::net::{TcpListener, UdpSocket};
use std::process::{Child, ChildStdin, Command, ExitCode, Stdio};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use members::{Chat, Chatter, agreement, endpoints, peers, plant, remote_io, station};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde::{Deserialize, Serialize};
use understudy_bus::{
    Changes, Commands, FieldDriver, Guard, HostEvent, LinkKind, MemberSettings, NoField, Noted,
    Peer, Record, SimulatedField, run_member, zenoh_runtime,
};
use understudy_wire::Member;

/// Past it a test has failed; nothing waits for it otherwise.
const DEADLINE: Duration = Duration::from_secs(60);
/// Before the part of a process that this program starts of itself.
const PART: &str = "--part";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [flag, part] = arguments.as_slice()
        && flag == PART
    {
        return act(&serde_json::from_str(part).expect("a part"));
    }
    let tests: [(&str, fn()); 8] = [
        ("one_who_is_killed_is_heard_again_over_udp", || killed(LinkKind::Udp)),
        ("one_who_is_killed_is_heard_again_over_zenoh", || killed(LinkKind::Zenoh)),
        ("one_who_was_stopped_is_heard_again_over_udp", || stopped(LinkKind::Udp)),
        ("one_who_was_stopped_is_heard_again_over_zenoh", || stopped(LinkKind::Zenoh)),
        ("a_member_says_that_it_is_ready_and_that_it_has_stopped", ready_and_stopped),
        ("a_member_ends_with_its_input_where_it_is_told_to", ends_with_input),
        ("commands_are_obeyed", commands_are_obeyed),
        ("a_port_in_use_is_said", port_in_use),
    ];
    let filters: Vec<&String> = arguments.iter().filter(|one| !one.starts_with('-')).collect();
    for (name, test) in tests {
        if filters.is_empty() || filters.iter().any(|filter| name.contains(filter.as_str())) {
            println!("test {name}");
            test();
        }
    }
    ExitCode::SUCCESS
}

/// What one process does.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Part {
    own: Member,
    life: u64,
    link: LinkKind,
    peers: Vec<Peer>,
    ends_with_input: bool,
}

fn act(part: &Part) -> ExitCode {
    let field: Box<dyn FieldDriver> = match part.own {
        Member::RemoteIo(program) => Box::new(SimulatedField::new(program, agreement())),
        _ => Box::new(NoField),
    };
    let settings = MemberSettings {
        changes: Changes::none(agreement().configuration),
        retention: Default::default(),
        guard: Guard::Off,
        channel: None,
        endpoints: endpoints(part.own, &part.peers),
        link: part.link,
        period: agreement().schedule.period(),
        field,
        commands: if part.ends_with_input { Commands::ReadAndEndWithInput } else { Commands::Read },
        ends_with_parent: true,
        real_time: true,
        spin: false,
    };
    match run_member(Chatter::new(part.own, part.life), settings, std::io::stdout()) {
        Ok(_) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

type Reports = (Member, Noted<Chat>);

/// A process that does not outlive its test.
struct Process {
    child: Child,
    input: Option<ChildStdin>,
}

impl Process {
    fn start(part: &Part, reports: &Sender<Reports>) -> Self {
        let mut child = Command::new(std::env::current_exe().expect("this program"))
            .args([PART, &serde_json::to_string(part).expect("plain data")])
            .env(zenoh_runtime(1).0, zenoh_runtime(1).1)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("this program starts");
        let output = BufReader::new(child.stdout.take().expect("piped"));
        let reports = reports.clone();
        std::thread::spawn(move || {
            for line in output.lines().map_while(Result::ok) {
                let record: Record<'_, Chat> = serde_json::from_str(&line).expect(&line);
                // A test that has ended listens no more.
                let _ = reports.send((record.member, record.event));
            }
        });
        let input = child.stdin.take();
        Self { child, input }
    }

    fn command(&mut self, line: &str) {
        let input = self.input.as_mut().expect("open");
        writeln!(input, "{line}").expect("it reads");
    }

    fn signal(&self, signal: Signal) {
        let process = Pid::from_raw(i32::try_from(self.child.id()).expect("a process id"));
        kill(process, signal).expect("it runs");
    }

    /// Waits for its end; true where it ended well.
    fn ended(&mut self) -> bool {
        let start = Instant::now();
        while start.elapsed() < DEADLINE {
            if let Some(status) = self.child.try_wait().expect("it is ours") {
                return status.success();
            }
            std::thread::yield_now();
        }
        panic!("a process does not end");
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // It can only fail where the process has ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Takes reports until one is as it should be.
fn wait_until(reports: &Receiver<Reports>, what: &str, mut good: impl FnMut(&Reports) -> bool) {
    let start = Instant::now();
    loop {
        let left = DEADLINE.saturating_sub(start.elapsed());
        match reports.recv_timeout(left) {
            Ok(report) if good(&report) => return,
            Ok(_) => {}
            Err(_) => panic!("{what} is missing"),
        }
    }
}

const TALKERS: [fn() -> Member; 4] = [|| station(0), || station(1), || station(2), || remote_io(0)];

fn talkers() -> impl Iterator<Item = Member> {
    TALKERS.iter().map(|member| member())
}

/// Every listener with every speaker.
fn pairs() -> BTreeSet<(Member, Member)> {
    let all = talkers().flat_map(|listener| talkers().map(move |speaker| (listener, speaker)));
    all.filter(|(listener, speaker)| listener != speaker).collect()
}

fn started(
    link: LinkKind,
    sender: &Sender<Reports>,
) -> (impl Fn(Member, u64) -> Part, HashMap<Member, Process>) {
    let members: Vec<Member> = talkers().chain([plant(0)]).collect();
    let peers = peers(&members);
    let part =
        move |own, life| Part { own, life, link, peers: peers.clone(), ends_with_input: true };
    let running = members.iter().map(|&own| (own, Process::start(&part(own, 1), sender))).collect();
    (part, running)
}

/// Takes reports until every one of `missing` has come, each a listener with a speaker.
fn wait_for_pairs(
    reports: &Receiver<Reports>,
    when: &str,
    mut missing: BTreeSet<(Member, Member)>,
    mut is_enough: impl FnMut(Member, u64) -> bool,
) {
    let start = Instant::now();
    while !missing.is_empty() {
        let left = DEADLINE.saturating_sub(start.elapsed());
        match reports.recv_timeout(left) {
            Ok((listener, Noted::Member(Chat::StillHears { speaker, hundreds }))) => {
                if is_enough(speaker, hundreds) {
                    missing.remove(&(listener, speaker));
                }
            }
            Ok(_) => {}
            Err(_) => panic!("{when}, not received (listener, speaker): {missing:?}"),
        }
    }
}

/// One is stopped for some seconds, and goes on.
fn stopped(link: LinkKind) {
    let (sender, reports) = channel();
    let (_part, running) = started(link, &sender);
    for own in [station(0), station(1), remote_io(0)] {
        let (its, others): (BTreeSet<_>, BTreeSet<_>) = pairs()
            .into_iter()
            .partition(|(listener, speaker)| *listener == own || *speaker == own);
        let mut newest = 0;
        wait_for_pairs(&reports, "before the stop", pairs(), |_, hundreds| {
            newest = newest.max(hundreds);
            true
        });
        running[&own].signal(Signal::SIGSTOP);
        // A hundred frames take a second.
        let during = |_, hundreds| hundreds >= newest + 2;
        wait_for_pairs(&reports, "during the stop", others, during);
        running[&own].signal(Signal::SIGCONT);
        let continued = Instant::now();
        // The one who was stopped is behind the others by as many frames as it did not say.
        let after = |speaker, hundreds| speaker == own || hundreds > newest + 2;
        wait_for_pairs(&reports, "after the stop", its, after);
        println!("  {own:?} hears and is heard again {:?} after its stop", continued.elapsed());
    }
}

fn killed(link: LinkKind) {
    let (sender, reports) = channel();
    let (part, mut running) = started(link, &sender);
    let mut missing = pairs();
    wait_until(&reports, "somebody at first", |(listener, event)| {
        if let Noted::Member(Chat::Heard { speaker, .. }) = event {
            missing.remove(&(*listener, *speaker));
        }
        missing.is_empty()
    });
    // The one whom all call, one who calls some, and one who calls all.
    for own in [station(0), station(1), remote_io(0)] {
        running.get(&own).expect("it runs").signal(Signal::SIGKILL);
        assert!(!running.remove(&own).expect("it runs").ended());
        let restarted = Instant::now();
        running.insert(own, Process::start(&part(own, 2), &sender));
        let others = || talkers().filter(|other| *other != own);
        let mut deaf: BTreeSet<Member> = others().collect();
        let mut unheard: BTreeSet<Member> = others().collect();
        wait_until(&reports, "somebody after a kill", |(listener, event)| {
            if let Noted::Member(Chat::Heard { speaker, life }) = event {
                if *speaker == own && *life == 2 {
                    deaf.remove(listener);
                } else if *listener == own {
                    unheard.remove(speaker);
                }
            }
            deaf.is_empty() && unheard.is_empty()
        });
        println!("  {own:?} hears and is heard again {:?} after its restart", restarted.elapsed());
    }
}

/// A remote I/O whose only peer is the socket of this test.
fn alone(ends_with_input: bool) -> (Process, Receiver<Reports>, UdpSocket) {
    let (sender, reports) = channel();
    let peers = peers(&[remote_io(0), station(0)]);
    let peer = UdpSocket::bind(peers[1].address).expect("found free");
    peer.set_read_timeout(Some(DEADLINE)).expect("a time that is not zero");
    let part = Part { own: remote_io(0), life: 1, link: LinkKind::Udp, peers, ends_with_input };
    (Process::start(&part, &sender), reports, peer)
}

fn ready_and_stopped() {
    for signal in [Signal::SIGTERM, Signal::SIGINT] {
        let (mut process, reports, peer) = alone(true);
        let (_, first) = reports.recv_timeout(DEADLINE).expect("a first record");
        let Noted::Host(HostEvent::Ready { process: id, rights, .. }) = first else {
            panic!("{first:?} is the first record");
        };
        assert_eq!(id, process.child.id());
        assert_eq!(rights.lacking.is_empty(), rights.real_time && rights.locked_memory);
        // How many it says before the signal is the scheduler's business; one, and it has something to count.
        peer.recv(&mut [0; 2048]).expect("its first frame");
        process.signal(signal);
        let mut frames_said = 0;
        wait_until(&reports, "its last word", |(_, event)| {
            if let Noted::Host(HostEvent::Stopped(summary)) = event {
                frames_said = summary.frames_said;
            }
            frames_said > 0
        });
        assert!(process.ended());
    }
}

fn ends_with_input() {
    let (mut process, _reports, _peer) = alone(true);
    process.input = None;
    assert!(process.ended());
    let (mut process, reports, _peer) = alone(false);
    let mut address = None;
    wait_until(&reports, "that it is ready", |(_, event)| {
        if let Noted::Host(HostEvent::Ready { address: bound, .. }) = event {
            address = Some(*bound);
        }
        address.is_some()
    });
    let address = address.expect("it is ready");
    process.command("nonsense");
    wait_until(
        &reports,
        "that the line is read",
        |(_, event)| matches!(event, Noted::Host(HostEvent::UnknownCommand { line }) if line == "nonsense"),
    );
    process.input = None;
    // It goes on: what is no frame still reaches it.
    let stranger = UdpSocket::bind(("127.0.0.1", 0)).expect("a free port");
    stranger.send_to(b"nonsense", address).expect("it is loopback");
    wait_until(&reports, "the datagram", |(_, event)| {
        matches!(event, Noted::Host(HostEvent::RefusedBytes { datagrams: 1, .. }))
    });
    process.signal(Signal::SIGTERM);
    wait_until(&reports, "its last word", |(_, event)| {
        matches!(event, Noted::Host(HostEvent::Stopped(_)))
    });
    assert!(process.ended());
}

fn commands_are_obeyed() {
    let (mut process, reports, _peer) = alone(true);
    process.command("release");
    wait_until(&reports, "the release", |(_, event)| *event == Noted::Member(Chat::Released));
    process.command("stop");
    assert!(process.ended());
}

fn port_in_use() {
    let peers = peers(&[station(0), station(1)]);
    let frames = LinkKind::Zenoh.frames_address(peers[0].address);
    let address = frames.expect("a port");
    let _taken = TcpListener::bind(address).expect("a free port");
    let part =
        Part { own: station(0), life: 1, link: LinkKind::Zenoh, peers, ends_with_input: true };
    let output = Command::new(std::env::current_exe().expect("this program"))
        .args([PART, &serde_json::to_string(&part).expect("plain data")])
        .stdin(Stdio::piped())
        .output()
        .expect("it starts");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success() && said.contains("U0501"), "{said}");
    assert!(said.contains(&address.port().to_string()), "{said}");
}
