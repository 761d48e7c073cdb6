//! A part of a run as a moving picture: the outputs of one program, their source and the stations, while a cursor passes over the cycles.
//!
//! Everything in it comes from the journal. [`Film::to_svg`] draws it as SVG with CSS animation, for pages that show pictures only.

mod picture;

use understudy_cluster::Card;
use understudy_typed::{Elementary, Point};
use understudy_wire::{Member, ProgramId, Source, StationId};

use crate::error::ViewError;
use crate::history::History;
use crate::model::Model;
use crate::station::StationState;
use crate::timeline::Span;
use crate::value::{card_text, is_declared};

/// Cycles of one film, at most.
const MAXIMUM_CYCLES: i64 = 2_000;

/// Outputs in one film, at most; the others are left out.
const MAXIMUM_OUTPUTS: usize = 12;

/// Stations in one film, at most: the first ones, and the program's own.
const MAXIMUM_STATIONS: usize = 6;

/// Cycles that are shown before the kill, and after the outputs are direct again.
const AROUND: i64 = 24;

const NO_KILL: &str = "no controller was killed in this run; name one with `--program`, and cycles with `--from` and `--to`";

/// What is filmed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Scene<'n> {
    /// The controller whose outputs are shown; by default the first one that was killed.
    pub program: Option<&'n str>,
    /// The first cycle; by default a little before the kill.
    pub from: Option<i64>,
    /// The last cycle; by default a little after the outputs are direct again.
    pub to: Option<i64>,
}

/// A part of a run, ready to be drawn.
#[derive(Debug, Clone)]
pub struct Film {
    cluster: String,
    program: String,
    remote_io: String,
    period_us: u64,
    /// The first cycle, and the first one after the last.
    cycles: (i64, i64),
    outputs: Vec<Output>,
    /// Outputs that are left out.
    further: usize,
    sources: Vec<Span<Applied>>,
    stations: Vec<Station>,
    faults: Vec<(i64, String)>,
}

#[derive(Debug, Clone)]
struct Output {
    name: String,
    /// The least and the greatest value of these cycles; nothing for a BOOL.
    range: Option<(String, String)>,
    values: Vec<Span<Level>>,
}

/// A value as it is drawn.
#[derive(Debug, Clone)]
struct Level {
    /// Where it is between the least and the greatest one, from 0 to 1.
    share: f64,
    /// As people read it; nothing for a BOOL.
    text: Option<String>,
}

/// Where the applied outputs came from: the sending station is its place in [`Film::stations`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Applied {
    source: Source,
    sender: Option<usize>,
}

#[derive(Debug, Clone)]
struct Station {
    name: String,
    understudy: bool,
    states: Vec<Span<StationState>>,
}

impl Film {
    /// The controller whose outputs it shows.
    pub fn program(&self) -> &str {
        &self.program
    }

    /// The first and the last cycle.
    pub fn cycles(&self) -> (i64, i64) {
        (self.cycles.0, self.cycles.1 - 1)
    }
}

impl Model {
    /// Films a part of the run.
    ///
    /// # Errors
    /// No station was killed and no part is named, or a name or a cycle is not in the journal.
    pub fn film(&self, scene: Scene<'_>) -> Result<Film, ViewError> {
        let program = match scene.program {
            Some(name) => self.program_called(name)?,
            None => self.first_killed().ok_or_else(|| ViewError::NoScene(NO_KILL.to_owned()))?,
        };
        let (from, to) = self.filmed_cycles(program, scene)?;
        let stations = self.filmed_stations(program);
        let sources = self.filmed_sources(program, (from, to), &stations);
        let faults = self.events().filter(|event| event.event == "fault");
        let faults = faults.filter(|event| (from..to).contains(&event.cycle));
        let (outputs, further) = self.filmed_outputs(program, (from, to));
        Ok(Film {
            cluster: self.cluster().name().to_owned(),
            program: self.program_name(program).to_owned(),
            remote_io: self.members().name(Member::RemoteIo(program)).to_owned(),
            period_us: self.snapshot().period_us,
            cycles: (from, to),
            outputs,
            further,
            sources,
            stations: stations
                .iter()
                .map(|&station| self.filmed_station(station, (from, to)))
                .collect(),
            faults: faults.map(|event| (event.cycle, event.text.clone())).collect(),
        })
    }

    fn program_called(&self, name: &str) -> Result<ProgramId, ViewError> {
        let names: Vec<&str> =
            self.program_ids().map(|program| self.program_name(program)).collect();
        let place = names.iter().position(|known| *known == name);
        let place = place.ok_or_else(|| ViewError::NoName {
            kind: "controller",
            name: name.to_owned(),
            hint: format!("the run has {}", names.join(", ")),
        })?;
        Ok(ProgramId(place as u8))
    }

    /// The controller that was killed first.
    fn first_killed(&self) -> Option<ProgramId> {
        let killed =
            self.program_ids().filter_map(|program| Some((self.killed_at(program)?, program)));
        Some(killed.min_by_key(|(cycle, _)| *cycle)?.1)
    }

    fn killed_at(&self, program: ProgramId) -> Option<i64> {
        let states = self.series().station(program.controller())?;
        let mut spans = states.spans(0, i64::MAX);
        let killed = spans.find(|span| *span.value == StationState::Killed)?;
        Some(killed.from)
    }

    fn filmed_cycles(&self, program: ProgramId, scene: Scene<'_>) -> Result<(i64, i64), ViewError> {
        let no_cycle = |cycle| self.no_cycle(program, cycle);
        let steps = self.history(program).map(History::steps);
        let extent = steps.and_then(|steps| Some((steps.front()?.cycle, steps.back()?.cycle + 1)));
        let (first, end) = extent.ok_or_else(|| no_cycle(scene.from.unwrap_or(0)))?;
        let killed = self.killed_at(program);
        let from = match (scene.from, killed) {
            (Some(from), _) => from,
            (None, Some(killed)) => killed.saturating_sub(AROUND).max(first),
            (None, None) => first.max(0),
        };
        let after = killed.filter(|_| scene.from.is_none()).unwrap_or(from);
        let to = match scene.to {
            Some(to) => to.saturating_add(1),
            None => self
                .direct_again(program, after)
                .map_or(end, |direct| direct.saturating_add(AROUND).min(end)),
        };
        let asked = [from, to.saturating_sub(1)];
        if let Some(absent) = asked.into_iter().find(|cycle| !(first..end).contains(cycle)) {
            return Err(no_cycle(absent));
        }
        if to <= from {
            let last = to.saturating_sub(1);
            return Err(ViewError::NoScene(format!(
                "the last cycle, {last}, comes before the first, {from}"
            )));
        }
        Ok((from, to.min(from.saturating_add(MAXIMUM_CYCLES))))
    }

    /// The first cycle after `from`, and after other sources, whose outputs are direct.
    fn direct_again(&self, program: ProgramId, from: i64) -> Option<i64> {
        let spans = self.series().sources(program)?.spans(from, i64::MAX);
        let mut others = spans.skip_while(|span| *span.value == Source::Direct);
        Some(others.find(|span| *span.value == Source::Direct)?.from)
    }

    fn filmed_stations(&self, program: ProgramId) -> Vec<StationId> {
        let schedule = &self.cluster().agreement().schedule;
        let own = program.controller();
        let all = (0..schedule.stations() as u8).map(StationId);
        let (understudies, controllers): (Vec<_>, Vec<_>) =
            all.partition(|station| schedule.is_understudy(*station));
        let others = controllers.into_iter().filter(|station| *station != own);
        let kept = MAXIMUM_STATIONS - 1;
        let understudies = understudies.into_iter().take(kept);
        let room = kept - understudies.len();
        let mut stations: Vec<_> = others.take(room).chain(understudies).chain([own]).collect();
        stations.sort_by_key(|station| station.0);
        stations
    }

    fn filmed_station(&self, station: StationId, (from, to): (i64, i64)) -> Station {
        let states = self.series().station(station);
        let spans = states.map(|states| states.spans(from, to).map(owned).collect());
        Station {
            name: self.members().name(Member::Station(station)).to_owned(),
            understudy: self.cluster().agreement().schedule.is_understudy(station),
            states: spans.unwrap_or_default(),
        }
    }

    /// The first outputs, and how many are left out.
    fn filmed_outputs(&self, program: ProgramId, (from, to): (i64, i64)) -> (Vec<Output>, usize) {
        let Some(images) = self.series().outputs(program) else {
            return (Vec::new(), 0);
        };
        // Those of the last cycle, as far back as the program has them.
        let Some(controller) = self.points_at(program, Some(to.saturating_sub(1))) else {
            return (Vec::new(), 0);
        };
        let filmed = controller.interface.outputs.iter().filter_map(|output| {
            let values = joined(images.spans(output, from, to));
            // A program fault that never was is not worth a trace.
            let is_shown = is_declared(&output.name) || values.iter().any(|it| it.value != 0);
            let card = self.card(program, &output.name, to.saturating_sub(1));
            is_shown.then(|| levels(output, &card, values))
        });
        let mut filmed: Vec<Output> = filmed.collect();
        let further = filmed.len().saturating_sub(MAXIMUM_OUTPUTS);
        filmed.truncate(MAXIMUM_OUTPUTS);
        (filmed, further)
    }

    /// The source of each cycle, with the station whose frame the outputs came from.
    fn filmed_sources(
        &self,
        program: ProgramId,
        (from, to): (i64, i64),
        stations: &[StationId],
    ) -> Vec<Span<Applied>> {
        let steps = self.history(program).into_iter().flat_map(|history| history.steps());
        let within = steps.filter(|step| (from..to).contains(&step.cycle));
        joined(within.filter_map(|step| {
            let driven = step.driven.as_ref()?;
            let sender = match driven.source {
                Source::Direct => Some(program.controller()),
                Source::Reconstructed => driven.word_of,
                Source::Held | Source::FailSafe => None,
            };
            let sender = stations.iter().position(|station| Some(*station) == sender);
            let source = driven.source;
            Some(Span {
                from: step.cycle,
                to: step.cycle.saturating_add(1),
                value: Applied { source, sender },
            })
        }))
    }
}

/// The stored values of an output as they are drawn.
fn levels(output: &Point, card: &Card, values: Vec<Span<u64>>) -> Output {
    let is_bool = output.of == Elementary::Bool;
    let declared = output.declared();
    let number = |stored: u64| output.of.number(stored);
    let mut ordered: Vec<u64> = values.iter().map(|span| span.value).collect();
    ordered.retain(|stored| number(*stored).is_finite());
    ordered.sort_by(|one, other| number(*one).total_cmp(&number(*other)));
    let ends = ordered.first().copied().zip(ordered.last().copied());
    let (least, most) = match ends {
        _ if is_bool => (0.0, 1.0),
        Some((least, most)) => (number(least), number(most)),
        None => (0.0, 0.0),
    };
    let level = |stored: u64| {
        let share = (number(stored) / 2.0 - least / 2.0) / (most / 2.0 - least / 2.0);
        Level {
            share: if share.is_finite() { share } else { 0.0 },
            text: (!is_bool).then(|| card_text(card, &declared, stored)),
        }
    };
    let text = |stored| card_text(card, &declared, stored);
    let spans = values.into_iter();
    let spans = spans.map(|span| Span { from: span.from, to: span.to, value: level(span.value) });
    Output {
        name: output.name.clone(),
        range: ends.filter(|_| !is_bool).map(|(least, most)| (text(least), text(most))),
        values: spans.collect(),
    }
}

fn owned<T: Clone>(span: Span<&T>) -> Span<T> {
    Span { from: span.from, to: span.to, value: span.value.clone() }
}

/// Neighbours of equal value become one span.
fn joined<T: PartialEq>(spans: impl Iterator<Item = Span<T>>) -> Vec<Span<T>> {
    let mut joined: Vec<Span<T>> = Vec::new();
    for span in spans {
        match joined.last_mut() {
            Some(last) if last.to == span.from && last.value == span.value => last.to = span.to,
            _ => joined.push(span),
        }
    }
    joined
}
