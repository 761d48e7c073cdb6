//! Stations, remote I/Os and plants as the process that this is.

use std::io;
use std::net::SocketAddrV4;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::Command;

use serde::Serialize;
use understudy_bus::{
    Commands, Endpoints, FieldDriver, LinkKind, MemberSettings, NoField, Peer, Retention,
    SimulatedField, run_member,
};
use understudy_cluster::{Cluster, Link, Twin};
use understudy_cycle::Machine;
use understudy_field::Device;
use understudy_journal::Segments;
use understudy_node::Station;
use understudy_plant::PlantMachine;
use understudy_remote_io::RemoteIo;
use understudy_wire::{Image, Member, Time};

use crate::changes::{StartedChange, started_change};
use crate::error::MemberError;
use crate::field::{Equipment, Wirings};
use crate::first_numbers::FirstNumbers;
use crate::held::read_keys;
use crate::peers::find_member;
use crate::retained::{later_than_retained, retained_notes, retained_runs};

/// What a member is told besides its cluster.
#[derive(Debug, Clone)]
pub struct MemberOptions {
    /// Its name.
    pub name: String,
    /// All members and their addresses.
    pub peers: Vec<Peer>,
    /// The first multicast group of the frames; nothing where each receiver gets a datagram of its own.
    pub multicast: Option<SocketAddrV4>,
    /// The folder of its keys.
    pub keys: Option<PathBuf>,
    /// Whether standard input is its operator: no other one is listened to.
    pub in_laboratory: bool,
    /// Whether it ends with standard input and with the process that started it.
    pub ends_with_parent: bool,
    /// Whether it asks for real-time rights.
    pub real_time: bool,
    /// The folder of what it keeps for the time after a power failure; nothing is kept without one.
    pub retain: Option<PathBuf>,
    /// The file of its journal in place of standard output.
    pub journal: Option<PathBuf>,
    /// Bytes of that file and its segments, at most.
    pub journal_limit: u64,
}

/// Runs a controller or an understudy until it is told to end.
///
/// # Errors
/// [`MemberError`].
pub fn run_station(cluster: &Cluster, options: &MemberOptions) -> Result<(), MemberError> {
    let wrong = || wrong_kind(options, "station", "understudy node");
    let member = find_member(cluster, &options.name)?;
    let Member::Station(station) = member else {
        return Err(wrong());
    };
    let started = started_change(cluster, member, options);
    let cluster = &started.cluster.clone();
    let settings = cluster.station_settings(station, FirstNumbers::now()?.founds);
    let settings = settings.ok_or_else(wrong)?;
    let is_loaded = |program, hash| started.has_loaded(program, hash);
    let own = started.own.station_settings(station, settings.founds).ok_or_else(wrong)?;
    let (runs, retention) = retained_runs(&started.own, options, &own, is_loaded);
    let settings = later_than_retained(settings, &runs);
    let mut machine = Station::new(Time::default(), settings);
    if let Some((change, configurations)) = &started.restored {
        machine = machine.changed(change, *configurations);
    }
    let machine = machine.retaining(cluster.retain_every(), &runs);
    run(cluster, options, member, machine, Box::new(NoField), (retention, started))
}

/// Runs a remote I/O until it is told to end.
///
/// # Errors
/// [`MemberError`].
pub fn run_remote_io(cluster: &Cluster, options: &MemberOptions) -> Result<(), MemberError> {
    let wrong = || wrong_kind(options, "remote I/O", "understudy remote-io");
    let member = find_member(cluster, &options.name)?;
    let started = started_change(cluster, member, options);
    let cluster = &started.cluster.clone();
    let settings_in = |cluster: &Cluster| match member {
        Member::RemoteIo(program) => cluster.remote_io_settings(program),
        Member::Twin(program) => cluster.twin_settings(program),
        Member::Station(_) | Member::Plant(_) => None,
    };
    let settings = settings_in(cluster).ok_or_else(wrong)?;
    let field = field_of(options, cluster, member, (&settings, &started.wirings))?;
    let is_retentive = settings.fallback.restart.is_some();
    let mut machine = RemoteIo::new(Time::default(), settings.clone());
    if let Some((change, configurations)) = &started.restored {
        machine = machine.changed(change, *configurations);
    }
    let machine = machine.telling_points();
    let Some(folder) = &options.retain else {
        let retention = Retention { is_missing: is_retentive, ..Retention::default() };
        return run(cluster, options, member, machine, field, (retention, started));
    };
    let own = settings_in(&started.own).ok_or_else(wrong)?;
    let (notes, retention) =
        retained_notes(&started.own, folder, options, &own, |program, hash| {
            started.has_loaded(program, hash)
        });
    let machine = machine.noting(notes.newest, notes.is_damaged);
    run(cluster, options, member, machine, field, (retention, started))
}

/// Runs a simulated plant until it is told to end.
///
/// # Errors
/// [`MemberError`].
pub fn run_plant(cluster: &Cluster, options: &MemberOptions) -> Result<(), MemberError> {
    let wrong = || wrong_kind(options, "plant", "understudy plant");
    let member = find_member(cluster, &options.name)?;
    let Member::Plant(program) = member else {
        return Err(wrong());
    };
    let started = started_change(cluster, member, options);
    let cluster = &started.cluster.clone();
    let settings = cluster.plant_settings(program).ok_or_else(wrong)?;
    let mut machine = PlantMachine::new(settings, Time::default());
    if let Some((change, configurations)) = &started.restored {
        machine = machine.changed(change, *configurations);
    }
    run(cluster, options, member, machine, Box::new(NoField), (Retention::default(), started))
}

fn wrong_kind(options: &MemberOptions, wanted: &'static str, command: &'static str) -> MemberError {
    MemberError::WrongKind { name: options.name.clone(), wanted, command }
}

/// The device of a remote I/O where it has one, and its simulated plant otherwise.
fn field_of(
    options: &MemberOptions,
    cluster: &Cluster,
    member: Member,
    (settings, wirings): (&understudy_remote_io::Settings, &Wirings),
) -> Result<Box<dyn FieldDriver>, MemberError> {
    let (agreement, program) = (cluster.agreement(), settings.program);
    let remote_io = cluster.remote_ios().get(program.index());
    let twin = remote_io.and_then(|remote_io| remote_io.twin.as_ref());
    let has_own_modules = twin.is_some_and(Twin::is_parallel);
    let device = match (member, twin) {
        (Member::Twin(_), Some(twin)) if has_own_modules => twin.field.clone(),
        _ => remote_io.and_then(|remote_io| remote_io.field.clone()),
    };
    let Some(places) = device else {
        let field = SimulatedField::new(program, agreement.clone());
        let field = if twin.is_some() { field.of_pair(member, has_own_modules) } else { field };
        let has_plant = cluster.member_name(Member::Plant(program)).is_some();
        return Ok(Box::new(if has_plant { field.with_plant() } else { field }));
    };
    let period = agreement.schedule.period();
    let fail_safe = &settings.fallback.fail_safe;
    let device = if has_own_modules {
        // The modules of one that ends in order are released: those of the other one drive the outputs.
        let released = Image::zero(fail_safe.width());
        Device::start(places, released, period, options.real_time)
    } else if twin.is_some() {
        Device::start_in_pair(places, period, options.real_time)
    } else {
        Device::start(places, fail_safe.clone(), period, options.real_time)
    };
    let device = device.map_err(MemberError::Device)?;
    Ok(Box::new(Equipment::new(device, settings.hash, wirings.clone())))
}

fn run<M>(
    cluster: &Cluster,
    options: &MemberOptions,
    member: Member,
    machine: M,
    field: Box<dyn FieldDriver>,
    (mut retention, started): (Retention, StartedChange),
) -> Result<(), MemberError>
where
    M: Machine + Send,
    M::Event: Serialize + Send + 'static,
{
    let peers = options.peers.clone();
    let endpoints = Endpoints::new(cluster.agreement().cluster, member, peers, cluster.roster());
    let endpoints = endpoints.map_err(MemberError::Endpoints)?;
    let endpoints = endpoints.with_multicast(options.multicast);
    let StartedChange { changes, found, programs, .. } = started;
    for (_, files) in &mut retention.files {
        *files = files.clone().with_loaded(programs.clone());
    }
    retention.found.extend(found);
    let keys = read_keys(options, cluster, member, changes.clone())?;
    let settings = MemberSettings {
        endpoints,
        link: link_kind(cluster),
        period: cluster.agreement().schedule.period(),
        guard: keys.guard,
        changes,
        channel: keys.channel,
        retention,
        field,
        commands: if options.ends_with_parent {
            Commands::ReadAndEndWithInput
        } else {
            Commands::Read
        },
        ends_with_parent: options.ends_with_parent,
        real_time: options.real_time,
        spin: cluster.spins() && options.real_time,
    };
    let output: Box<dyn io::Write + Send> = match &options.journal {
        None => Box::new(io::stdout()),
        Some(path) => {
            let segments = Segments::create(path, options.journal_limit);
            Box::new(
                segments.map_err(|source| MemberError::Journal { path: path.clone(), source })?,
            )
        }
    };
    // Its last record has said the summary already.
    run_member(machine, settings, output)?;
    Ok(())
}

/// What carries the frames of a cluster.
pub fn link_kind(cluster: &Cluster) -> LinkKind {
    match cluster.link() {
        Link::Udp => LinkKind::Udp,
        Link::Zenoh => LinkKind::Zenoh,
    }
}

/// Starts this program again with the environment that Zenoh needs: it takes the number of its threads from there, and only when a process
/// starts. To be called before anything else is started, which would be lost.
pub fn restart_for_zenoh((variable, value): (&str, &str)) {
    if std::env::var_os(variable).is_some() {
        return;
    }
    if let Ok(program) = std::env::current_exe() {
        // It only comes back where it fails; then Zenoh has more threads than it needs, and works.
        let mut arguments = std::env::args_os();
        let mut again = Command::new(program);
        if let Some(name) = arguments.next() {
            again.arg0(name);
        }
        let error = again.args(arguments).env(variable, value).exec();
        tracing::warn!(%error, "the program was not started again with fewer threads for Zenoh");
    }
}
