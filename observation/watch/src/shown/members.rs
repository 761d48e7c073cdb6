//! Stations, remote I/Os and plants as they stand in one cycle.

use serde::Serialize;
use understudy_remote_io::Missing;
use understudy_view::StationState;
use understudy_wire::{Member, ProgramId, StationId};

use super::{name, program_names};
use crate::changes::{Process, Standing};
use crate::foreseen::began;
use crate::model::Known;

#[derive(Debug, Serialize)]
pub(super) struct ShownMember {
    pub(super) name: String,
    kind: &'static str,
    /// In one word.
    state: &'static str,
    /// It has no process.
    down: bool,
    pub(super) is_cycle_master: bool,
    /// Nothing that it says arrives.
    cut: bool,
    note: String,
    program: Option<u8>,
    /// What it said in this cycle.
    words: Vec<ShownWord>,
}

#[derive(Debug, Serialize)]
pub(super) struct ShownWord {
    members: Vec<String>,
    pub(super) sum: String,
}

pub(super) fn station(
    known: &Known,
    standing: &Standing,
    station: StationId,
    cycle: i64,
) -> ShownMember {
    let member = Member::Station(station);
    let schedule = &known.run.cluster().agreement().schedule;
    let understudy = schedule.is_understudy(station);
    let process = standing.process(member);
    let excluded = known
        .programs()
        .filter(|&program| standing.excluded(program).contains(station));
    let excluded = program_names(known, excluded.collect());
    let cut = cut(known, standing, member);
    ShownMember {
        name: name(known, member),
        kind: if understudy {
            "understudy"
        } else {
            "controller"
        },
        state: state_of(known, standing, station, cycle),
        down: matches!(process, Some(Process::Killed | Process::Ended)),
        is_cycle_master: cycle_master(known, standing, cycle) == Some(station),
        cut: matches!(cut, Some(Cut::FromAll)),
        note: note([
            (!excluded.is_empty()).then(|| format!("excluded for {}", excluded.join(", "))),
            cut.map(|cut| cut.words()),
            not_told(standing, member),
        ]),
        program: (!understudy).then_some(station.0),
        words: words_of(known, station, cycle),
    }
}

/// Who starts the cycles: the first by rank that has started some, and speaks.
pub(super) fn cycle_master(known: &Known, standing: &Standing, cycle: i64) -> Option<StationId> {
    standing.cycle_masters().find(|&station| {
        let cut = cut(known, standing, Member::Station(station));
        let speaks = state_of(known, standing, station, cycle) == "speaking";
        speaks && !matches!(cut, Some(Cut::FromAll))
    })
}

fn state_of(known: &Known, standing: &Standing, station: StationId, cycle: i64) -> &'static str {
    let run = &known.run;
    let recorded = run
        .series()
        .station(station)
        .and_then(|series| series.at(cycle).copied());
    let state = recorded
        .or_else(|| run.station_state(station))
        .unwrap_or(StationState::NotStarted);
    station_word(state, standing.process(Member::Station(station)))
}

/// Whom a member does not reach any more.
enum Cut {
    FromAll,
    From(Vec<String>),
}

impl Cut {
    fn words(&self) -> String {
        match self {
            Self::FromAll => "cut off".to_owned(),
            Self::From(names) => format!("cut off from {}", names.join(", ")),
        }
    }
}

fn cut(known: &Known, standing: &Standing, member: Member) -> Option<Cut> {
    let names: Vec<String> = standing
        .cut_from(member)
        .map(|other| name(known, other))
        .collect();
    let stations = known.stations().count();
    // Remote I/Os say nothing to each other.
    let others = match member {
        Member::Station(_) => stations - 1 + known.programs().count(),
        _ => stations,
    };
    match names.len() {
        0 => None,
        all if all >= others => Some(Cut::FromAll),
        _ => Some(Cut::From(names)),
    }
}

fn station_word(state: StationState, process: Option<Process>) -> &'static str {
    match (process, state) {
        (Some(Process::Killed), _) => "killed",
        (Some(Process::Ended), _) => "ended",
        (Some(Process::StandsStill), _) => "stopped",
        // The record of its end is older than that of its new beginning.
        (_, StationState::Killed | StationState::Ended) => "joining",
        (_, StationState::Stopped) => "silent",
        (_, StationState::NotStarted) => "not-started",
        (_, StationState::Speaking) => "speaking",
        (_, StationState::Silent) => "silent",
        (_, StationState::Flagged) => "flagged",
        (_, StationState::Joining) => "joining",
        (_, StationState::Shadow) => "shadow",
        (_, StationState::Refused) => "refused",
    }
}

fn not_told(standing: &Standing, member: Member) -> Option<String> {
    let told = "not heard here";
    standing.is_detached(member).then(|| told.to_owned())
}

fn note<const N: usize>(parts: [Option<String>; N]) -> String {
    let parts: Vec<String> = parts.into_iter().flatten().collect();
    parts.join(", ")
}

pub(super) fn words_of(known: &Known, station: StationId, cycle: i64) -> Vec<ShownWord> {
    let mut moments = known.programs().filter_map(|program| {
        let step = known.run.history(program)?.at(cycle)?;
        began(step).then_some(step.moment)
    });
    let Some(moment) = moments.next() else {
        return Vec::new();
    };
    let turns = known.run.sent_turns(moment).iter();
    let words = turns
        .filter(|turn| turn.station == station)
        .flat_map(|turn| turn.words.iter());
    words
        .map(|word| ShownWord {
            members: program_names(known, word.mask),
            sum: word.sum.to_string(),
        })
        .collect()
}

fn process_word(process: Option<Process>) -> Option<&'static str> {
    match process? {
        Process::Running => None,
        Process::StandsStill => Some("stopped"),
        Process::Killed => Some("killed"),
        Process::Ended => Some("ended"),
    }
}

pub(super) fn remote_io(
    known: &Known,
    standing: &Standing,
    program: ProgramId,
    cycle: i64,
) -> ShownMember {
    let member = Member::RemoteIo(program);
    let step = known.run.history(program).and_then(|steps| steps.at(cycle));
    let driven = step.and_then(|step| step.driven.as_ref());
    let process = standing.process(member);
    let missing = driven.and_then(|driven| driven.missing);
    let alive = match (driven, missing) {
        (None, _) | (_, Some(Missing::NoHistory)) => "listening",
        (_, Some(Missing::NotReleased)) => "awaits-release",
        (_, Some(Missing::StateLost)) => "state-lost",
        _ => "serving",
    };
    let forced = standing.forced(program).count();
    let cut = cut(known, standing, member);
    ShownMember {
        name: name(known, member),
        kind: "remote-io",
        state: process_word(process).unwrap_or(alive),
        down: matches!(process, Some(Process::Killed | Process::Ended)),
        is_cycle_master: false,
        cut: matches!(cut, Some(Cut::FromAll)),
        note: note([
            (forced > 0).then(|| format!("{forced} forced")),
            cut.map(|cut| cut.words()),
            not_told(standing, member),
        ]),
        program: Some(program.0),
        words: Vec::new(),
    }
}

pub(super) fn plant(known: &Known, standing: &Standing, program: ProgramId) -> Option<ShownMember> {
    let member = Member::Plant(program);
    known.run.cluster().member_name(member)?;
    let process = standing.process(member);
    Some(ShownMember {
        name: name(known, member),
        kind: "plant",
        state: process_word(process).unwrap_or("moving"),
        down: matches!(process, Some(Process::Killed | Process::Ended)),
        is_cycle_master: false,
        cut: false,
        note: note([not_told(standing, member)]),
        program: Some(program.0),
        words: Vec::new(),
    })
}
