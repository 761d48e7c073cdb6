//! One cluster on processes of this machine, each of which measures its member for a short time.

use std::io::{self, BufRead, BufReader};
use std::process::Stdio;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use clap::Args;
use nix::sys::resource::{UsageWho, getrusage};
use serde::{Deserialize, Serialize};
use serde_json::json;
use understudy::{Answer, Status};
use understudy_bus::{
    Changes, Commands, Endpoints, LinkKind, MemberSettings, NoField, Noted, Peer, Record,
};
use understudy_cluster::{Cluster, Overrides, press_cell, read_with_files};
use understudy_cycle::Turns;
use understudy_node::Station;
use understudy_remote_io::RemoteIo;
use understudy_wire::{Epoch, Member, Moment, ProgramId, StationId, Time};

use super::observed::{Measured, Observed, Window, stations_of_understudy};
use crate::children::{Running, guard, own_command, peers_of, refused};

/// From the start of the processes to their windows.
const SETTLING: Duration = Duration::from_secs(1);
const STARTS_WITHIN: Duration = Duration::from_secs(6);
/// From the end of the windows to the end of the reports.
const REPORTS_WITHIN: Duration = Duration::from_secs(3);

/// A cluster that is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Case {
    pub(super) controllers: usize,
    pub(super) period: Duration,
    pub(super) schedule: Turns,
    pub(super) copies: u32,
    pub(super) measured_for: Duration,
    pub(super) real_time: bool,
    pub(super) spin: bool,
}

impl Case {
    /// The longest that it takes.
    pub(super) fn longest(self) -> Duration {
        self.window().longest() + REPORTS_WITHIN
    }

    fn window(self) -> Window {
        Window { settling: SETTLING, starts_within: STARTS_WITHIN, lasts: self.measured_for }
    }

    /// Every controller runs the press of the press cell; there is one understudy and no plant.
    fn cluster(self) -> Result<Cluster, Answer> {
        let Self { controllers, period, copies, .. } = self;
        let mut text = format!(
            "[cluster]\nname = \"timing\"\nperiod = \"{}ns\"\ncopies = {copies}\n",
            period.as_nanos()
        );
        for place in 1..=controllers {
            text += &format!(
                "[[controller]]\nname = \"c{place}\"\nladder = \"press.ladder\"\n[[remote_io]]\ncontroller = \"c{place}\"\n"
            );
        }
        let overrides = Overrides { turns: Some(self.schedule), ..Overrides::default() };
        let loaded = read_with_files(&text, press_cell(), overrides);
        let refused = || {
            let found = loaded.reports.iter().flat_map(|report| &report.diagnostics);
            let message = found.map(|it| it.message.clone()).collect::<Vec<_>>().join("; ");
            Answer::failed(Status::BadInput, "U0607", message)
        };
        loaded.cluster.ok_or_else(refused)
    }
}

/// What the members of one cluster measured together.
#[derive(Debug, Clone, Default)]
pub(super) struct Together {
    pub(super) measured: Measured,
    /// Members that reported.
    pub(super) members: usize,
    pub(super) of_members: usize,
    /// Processor time of all members by the time that they ran.
    pub(super) processors: f64,
}

/// The part of one process.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Part {
    case: Case,
    own: Member,
    peers: Vec<Peer>,
}

/// One process of the timing
#[derive(Debug, Args)]
pub(crate) struct TimedArguments {
    /// Its part as JSON
    part: String,
}

fn processor_seconds() -> f64 {
    let seconds =
        |time: nix::sys::time::TimeVal| time.tv_sec() as f64 + time.tv_usec() as f64 / 1e6;
    getrusage(UsageWho::RUSAGE_CHILDREN)
        .map_or(0.0, |usage| seconds(usage.user_time()) + seconds(usage.system_time()))
}

/// Runs one cluster.
pub(super) fn measure(case: Case) -> Result<Together, Answer> {
    let peers = peers(case.controllers).map_err(refused("free ports"))?;
    let (used, began) = (processor_seconds(), Instant::now());
    let mut running = Running(Vec::new());
    let (sender, reports) = channel();
    let mut readers = Vec::new();
    for own in peers.iter().map(|peer| peer.member) {
        let part = Part { case, own, peers: peers.clone() };
        let mut command = own_command().map_err(refused("to find this program"))?;
        command.arg("timed").arg(serde_json::to_string(&part).unwrap_or_default());
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut child = command.spawn().map_err(refused("to start a process of the benchmark"))?;
        let output = child.stdout.take();
        running.0.push(child);
        let sender = sender.clone();
        readers.push(std::thread::spawn(move || {
            if let Some(measured) = output.and_then(report) {
                let _ = sender.send(measured);
            }
        }));
    }
    drop(sender);
    let ends = Instant::now() + case.longest();
    let mut together = Together { of_members: peers.len(), ..Together::default() };
    while together.members < peers.len() {
        let left = ends.saturating_duration_since(Instant::now());
        match reports.recv_timeout(left) {
            Ok(measured) => together.add(&measured),
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => break,
        }
    }
    let lasted = began.elapsed().as_secs_f64();
    drop(running);
    for reader in readers {
        let _ = reader.join();
    }
    together.processors = (processor_seconds() - used) / lasted;
    Ok(together)
}

impl Together {
    fn add(&mut self, one: &Measured) {
        self.members += 1;
        let all = &mut self.measured;
        all.wakeups.add(&one.wakeups);
        all.exchange.add(&one.exchange);
        all.sample_to_output.add(&one.sample_to_output);
        all.incomplete_cycles += one.incomplete_cycles;
        all.missed += one.missed;
        all.deadlines += one.deadlines;
    }
}

/// Waits for the measurement of one member.
fn report(output: impl io::Read) -> Option<Measured> {
    let lines = BufReader::new(output).lines().map_while(Result::ok);
    let mut events = lines.filter_map(|line| {
        let record = serde_json::from_str::<Record<'_, Measured>>(&line);
        record.ok().map(|record| record.event)
    });
    events.find_map(|event| match event {
        Noted::Member(measured) => Some(measured),
        Noted::Host(_) => None,
    })
}

/// The members of a cluster on free ports. The understudy starts last: it waits for the others.
fn peers(controllers: usize) -> io::Result<Vec<Peer>> {
    let station = |rank: usize| Member::Station(StationId(rank as u8));
    let remote_ios = (0..controllers).map(|place| Member::RemoteIo(ProgramId(place as u8)));
    let members: Vec<_> = remote_ios.chain((0..=controllers).map(station)).collect();
    peers_of(members)
}

/// Runs one process of a cluster.
pub(crate) fn run_timed(arguments: &TimedArguments) -> Answer {
    let part = serde_json::from_str(&arguments.part);
    let ran = part.map_err(|error| Answer::failed(Status::BadInput, "U0607", error)).and_then(play);
    ran.map_or_else(|answer| answer, |()| Answer::done("", json!(null)))
}

fn play(part: Part) -> Result<(), Answer> {
    let Part { case, own, peers } = part;
    let cluster = case.cluster()?;
    let endpoints = Endpoints::new(cluster.agreement().cluster, own, peers, cluster.roster())?;
    let settings = MemberSettings {
        changes: Changes::none(cluster.agreement().configuration),
        retention: Default::default(),
        guard: guard(&endpoints),
        endpoints,
        link: LinkKind::Udp,
        period: cluster.agreement().schedule.period(),
        channel: None,
        field: Box::new(NoField),
        commands: Commands::ReadAndEndWithInput,
        ends_with_parent: true,
        real_time: case.real_time,
        spin: case.spin,
    };
    let window = case.window();
    let missing = || Answer::failed(Status::BadInput, "U0607", format!("no member {own:?}"));
    let ran = match own {
        Member::RemoteIo(program) => {
            let machine = cluster.remote_io_settings(program).ok_or_else(missing)?;
            let machine = RemoteIo::new(Time::default(), machine);
            let observed = Observed::new(machine, own, None, window);
            understudy_bus::run_member(observed, settings, io::stdout())
        }
        Member::Station(station) => {
            let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
            let epoch = Epoch(since.as_micros() as u64);
            let founds = Moment { epoch, ..Moment::default() };
            let machine = cluster.station_settings(station, founds).ok_or_else(missing)?;
            let machine = Station::new(Time::default(), machine);
            let understudy = stations_of_understudy(own, case.controllers);
            let observed = Observed::new(machine, own, understudy, window);
            understudy_bus::run_member(observed, settings, io::stdout())
        }
        Member::Plant(_) | Member::Twin(_) => return Err(missing()),
    };
    ran?;
    Ok(())
}
