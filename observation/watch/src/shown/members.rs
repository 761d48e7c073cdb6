//! Stations, remote I/Os and plants as the page shows them.

use serde::Serialize;
use understudy_view::{
    LinkSnapshot, PlantSnapshot, PlantState, RemoteIoSnapshot, RemoteIoState, Snapshot,
    StationSnapshot, StationState, TwinSnapshot, WordSnapshot,
};

#[derive(Debug, Serialize)]
pub(super) struct ShownMember {
    name: String,
    kind: &'static str,
    /// In one word.
    state: &'static str,
    /// It has no process.
    down: bool,
    is_cycle_master: bool,
    /// No member receives its frames.
    cut: bool,
    note: String,
    program: Option<usize>,
    /// The parity words that it sent in this cycle.
    parity_words: Vec<WordSnapshot>,
}

/// Stations by rank, then remote I/Os and plants by program.
pub(super) fn members(snapshot: &Snapshot) -> Vec<ShownMember> {
    let stations = snapshot.stations.iter();
    let remote_ios = snapshot.remote_ios.iter().enumerate();
    let twins = remote_ios.clone();
    let twins = twins.filter_map(|(program, of)| Some(twin(program, of.twin.as_ref()?)));
    let plants = snapshot.plants.iter();
    stations
        .map(|station| self::station(snapshot, station))
        .chain(remote_ios.map(|(program, remote_io)| self::remote_io(snapshot, program, remote_io)))
        .chain(twins)
        .chain(plants.map(|plant| self::plant(snapshot, plant)))
        .collect()
}

fn station(snapshot: &Snapshot, station: &StationSnapshot) -> ShownMember {
    let excluded = &station.excluded_from;
    let excluded = (!excluded.is_empty()).then(|| format!("excluded for {}", excluded.join(", ")));
    ShownMember {
        name: station.name.clone(),
        kind: if station.understudy { "understudy" } else { "controller" },
        state: station.state.word(),
        down: matches!(station.state, StationState::Killed | StationState::Ended),
        is_cycle_master: snapshot.cycle_master.as_ref() == Some(&station.name),
        cut: station.link.isolated,
        note: note([excluded, cut(&station.link), detached(&station.link)]),
        program: (!station.understudy).then_some(usize::from(station.rank)),
        parity_words: station.words.clone(),
    }
}

fn remote_io(snapshot: &Snapshot, program: usize, remote_io: &RemoteIoSnapshot) -> ShownMember {
    let forces = snapshot.programs.get(program).map(|own| own.forces.len());
    let forced = forces.filter(|forces| *forces > 0);
    ShownMember {
        name: remote_io.name.clone(),
        kind: "remote-io",
        state: match (&remote_io.twin, remote_io.state) {
            (Some(twin), RemoteIoState::Serving) if twin.drives => "follower",
            (Some(_), RemoteIoState::Serving) => "author",
            (_, state) => state.word(),
        },
        down: matches!(remote_io.state, RemoteIoState::Killed | RemoteIoState::Ended),
        is_cycle_master: false,
        cut: remote_io.link.isolated,
        note: note([
            forced.map(|forced| format!("{forced} forced")),
            cut(&remote_io.link),
            detached(&remote_io.link),
        ]),
        program: Some(program),
        parity_words: Vec::new(),
    }
}

fn twin(program: usize, twin: &TwinSnapshot) -> ShownMember {
    let down = matches!(twin.process, RemoteIoState::Killed | RemoteIoState::Ended);
    let is_suspended = twin.process == RemoteIoState::Suspended;
    ShownMember {
        name: twin.name.clone(),
        kind: "remote-io",
        state: match (down || is_suspended, twin.drives) {
            (true, _) => twin.process.word(),
            (false, true) => "author",
            (false, false) => "follower",
        },
        down,
        is_cycle_master: false,
        cut: twin.link.isolated,
        note: note([None, cut(&twin.link), detached(&twin.link)]),
        program: Some(program),
        parity_words: Vec::new(),
    }
}

fn plant(snapshot: &Snapshot, plant: &PlantSnapshot) -> ShownMember {
    let mut programs = snapshot.programs.iter();
    ShownMember {
        name: plant.name.clone(),
        kind: "plant",
        state: plant.state.word(),
        down: matches!(plant.state, PlantState::Killed | PlantState::Ended),
        is_cycle_master: false,
        cut: false,
        note: note([detached(&plant.link)]),
        program: programs.position(|program| program.program == plant.program),
        parity_words: Vec::new(),
    }
}

fn cut(link: &LinkSnapshot) -> Option<String> {
    match link.cut_from.as_slice() {
        [] => None,
        _ if link.isolated => Some("cut off".to_owned()),
        names => Some(format!("cut off from {}", names.join(", "))),
    }
}

fn detached(link: &LinkSnapshot) -> Option<String> {
    link.detached.then(|| "journal not received".to_owned())
}

fn note<const N: usize>(parts: [Option<String>; N]) -> String {
    let parts: Vec<String> = parts.into_iter().flatten().collect();
    parts.join(", ")
}
