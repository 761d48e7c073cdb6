//! What is driven of each program, and why.

use understudy_journal::{Record, moment, source_word};
use understudy_plant::Event as PlantEvent;
use understudy_remote_io::{Event as RemoteIoEvent, Missing};
use understudy_wire::{
    Field, Force, Image, Member, Moment, ProgramId, SignalPlace, Source, StationId, StationSet,
};

use super::Model;
use crate::describe::{describe, missing_text};
use crate::event::{Event, Level};
use crate::protection::{LostState, Protection};

/// One program at its remote I/O.
#[derive(Debug, Clone, Default)]
pub(crate) struct ProgramTrack {
    pub(crate) inputs: Option<Image>,
    pub(crate) outputs: Option<Image>,
    pub(crate) source: Option<Source>,
    pub(crate) word_of: Option<StationId>,
    pub(crate) missing: Option<Missing>,
    /// Since when its outputs come from there.
    pub(crate) since: i64,
    /// Cycles with direct, reconstructed, held and fail-safe outputs.
    pub(crate) counts: [u64; 4],
    /// At the last two deadlines: a single frame may be lost.
    heard: [StationSet; 2],
    pub(crate) excluded: StationSet,
    pub(crate) awaits_release: bool,
    pub(crate) forced: Vec<Force>,
    pub(crate) plant: Option<Field>,
    pub(crate) protection: Option<Protection>,
    pub(crate) lost: Option<LostState>,
    /// Whether it was ever driven by true outputs.
    served: bool,
}

impl ProgramTrack {
    pub(crate) fn hears(&self) -> StationSet {
        self.heard[0].or(self.heard[1])
    }

    pub(crate) fn shift(&mut self, by: i64) {
        let protection = self.protection.as_mut().map(|of| &mut of.since);
        let lost = self.lost.as_mut().map(|of| &mut of.since);
        for since in [Some(&mut self.since), protection, lost]
            .into_iter()
            .flatten()
        {
            *since = since.saturating_add(by);
        }
    }

    /// Whether nothing true is driven for a reason that no station can help.
    pub(crate) fn is_blocked(&self) -> bool {
        let reasons = [
            Missing::BadQuality,
            Missing::NoHistory,
            Missing::StateLost,
            Missing::NotReleased,
            Missing::ValueFault,
            Missing::TooLate,
        ];
        self.missing
            .is_some_and(|missing| reasons.contains(&missing))
    }
}

impl Model {
    pub(super) fn remote_io(&mut self, record: &Record, program: ProgramId, event: &RemoteIoEvent) {
        let place = program.index();
        if place >= self.programs.len() || !self.fits(place, event) {
            self.left_out += 1;
            return;
        }
        let cycle = match event {
            RemoteIoEvent::Applied {
                moment, missing, ..
            } => {
                let idle = *missing == Some(Missing::NoCycle);
                let cycle = self.cycles.deadline(program, *moment, idle);
                // It may tell of an epoch whose origin was awaited: what was told before moves, and this cycle is counted from there already.
                if let Some(shift) = self.cycles.take_shift() {
                    self.shift(shift);
                }
                cycle
            }
            RemoteIoEvent::Sampled { moment, .. } => {
                self.timings.sampled(*moment, record.at_ns);
                // The deadline of the cycle before has passed.
                self.cycles
                    .of_known(*moment)
                    .unwrap_or_else(|| self.cycles.of(None).saturating_add(1))
            }
            _ => self.cycles.of(moment(&record.event)),
        };
        if let Some(violation) = self.histories[place].note(cycle, event) {
            self.violated(record, cycle, &violation.to_string());
        }
        match event {
            RemoteIoEvent::Sampled { moment, .. } => {
                self.check_words(*moment);
                return;
            }
            RemoteIoEvent::Applied { moment, .. } => {
                self.applied(record, program, cycle, *moment, event);
                return;
            }
            _ => {}
        }
        self.protection_changed(record, program, cycle, event);
        self.changed(record, program, cycle, event);
        let cause = match event {
            RemoteIoEvent::Flagged { station, .. } => self.cause_of_silence(*station),
            RemoteIoEvent::Unprotected { lacking, .. } => lacking
                .iter()
                .find_map(|lacking| self.cause_of_silence(lacking.station)),
            _ => None,
        };
        self.happened(record, cycle, cause);
    }

    /// Whether the images of a report are as wide as those of the program: a journal of other programs is none of this cluster's.
    fn fits(&self, place: usize, event: &RemoteIoEvent) -> bool {
        let circuit = &self.cluster.controllers()[place].circuit;
        let inputs = |image: &Image| image.width() == circuit.inputs().len();
        match event {
            RemoteIoEvent::Sampled {
                inputs: sampled, ..
            } => inputs(sampled),
            RemoteIoEvent::Applied {
                sampled, outputs, ..
            } => sampled.as_ref().is_none_or(inputs) && outputs.width() == circuit.outputs().len(),
            _ => true,
        }
    }

    /// What changes a program's standing.
    fn changed(&mut self, record: &Record, program: ProgramId, cycle: i64, event: &RemoteIoEvent) {
        let track = &mut self.programs[program.index()];
        let subject = |alarm| (record.name.clone(), alarm);
        let mut alarm = None;
        match event {
            RemoteIoEvent::StartedCold { awaits_release, .. } => {
                track.awaits_release = *awaits_release;
                track.excluded = StationSet::EMPTY;
            }
            RemoteIoEvent::Released { .. } => {
                track.awaits_release = false;
                track.excluded = StationSet::EMPTY;
                let over = ["value-fault", "disputed"];
                self.alarms.all_over(&record.name, &over, cycle);
            }
            RemoteIoEvent::Disputed { .. } => alarm = Some("disputed"),
            RemoteIoEvent::ValueFault {
                accused, located, ..
            } => {
                if *located {
                    track.excluded = track.excluded.or(*accused);
                }
                alarm = Some("value-fault");
            }
            RemoteIoEvent::RecalledExclusion { stations, .. } => {
                track.excluded = track.excluded.or(*stations);
                alarm = Some("value-fault");
            }
            RemoteIoEvent::AdoptedLineage { .. } => self.alarms.over(&subject("disputed"), cycle),
            RemoteIoEvent::Flagged { station, .. } | RemoteIoEvent::Cleared { station, .. } => {
                let flagged = matches!(event, RemoteIoEvent::Flagged { .. });
                if let Some(silent) = self.stations.get_mut(station.index()) {
                    silent.flagged_by_remote_io(program, flagged);
                }
            }
            RemoteIoEvent::Refused { member, .. } => self.refused(*member),
            RemoteIoEvent::Forced { force, .. } => {
                track.forced.retain(|other| other.signal != force.signal);
                track.forced.push(force.clone());
                alarm = Some("forced");
            }
            RemoteIoEvent::Unforced { signal, .. } => {
                track.forced.retain(|other| other.signal != *signal);
                if track.forced.is_empty() {
                    self.alarms.over(&subject("forced"), cycle);
                }
            }
            _ => {}
        }
        if let Some(alarm) = alarm {
            let text = describe(record, &self.members).text;
            self.alarms.raise(subject(alarm), cycle, text);
        }
    }

    fn applied(
        &mut self,
        record: &Record,
        program: ProgramId,
        cycle: i64,
        moment: Moment,
        event: &RemoteIoEvent,
    ) {
        let RemoteIoEvent::Applied {
            sampled,
            outputs,
            source,
            word_of,
            missing,
            heard,
            ..
        } = event
        else {
            return;
        };
        self.timings.decided(moment, cycle);
        self.series
            .applied(program, cycle, sampled.as_ref(), outputs, *source);
        for station in heard.iter() {
            if let Some(track) = self.stations.get_mut(station.index()) {
                track.heard(cycle);
            }
        }
        self.close_up_to(cycle.saturating_sub(1));
        let track = &mut self.programs[program.index()];
        track.counts[*source as usize] += 1;
        track.heard = [*heard, track.heard[0]];
        track.word_of = *word_of;
        track.missing = *missing;
        track.outputs = Some(outputs.clone());
        if let Some(inputs) = sampled {
            track.inputs = Some(inputs.clone());
        }
        let before = track.source.replace(*source);
        let was_served = track.served;
        track.served |= missing.is_none();
        let changed = before != Some(*source);
        if changed {
            track.since = cycle;
        }
        if changed && (was_served || missing.is_none()) {
            self.source_changed(record, program, cycle, *source);
        }
    }

    fn source_changed(&mut self, record: &Record, program: ProgramId, cycle: i64, source: Source) {
        let track = &self.programs[program.index()];
        let mut text = format!("its outputs are {}", source_word(source));
        if let Some(station) = track.word_of {
            text += &format!(
                " from a word of {}",
                self.members.name(Member::Station(station))
            );
        }
        if let Some(missing) = track.missing {
            text += &format!(": {}", missing_text(missing));
        }
        let level = match source {
            Source::Direct | Source::Reconstructed => Level::Notice,
            Source::Held => Level::Warning,
            Source::FailSafe => Level::Alarm,
        };
        let own = StationId(program.0);
        let cause = match source {
            Source::Direct => None,
            _ if !track.heard[0].contains(own) => {
                let name = self.members.name(Member::Station(own));
                let why = self.cause_of_silence(own);
                Some(match why {
                    Some(why) => format!("{name} is silent: {why}"),
                    None => format!("{name} is silent"),
                })
            }
            _ => None,
        };
        let subject = (record.name.clone(), "fail-safe");
        if source == Source::FailSafe {
            let why = cause.clone().unwrap_or_else(|| text.clone());
            self.alarms.raise(subject, cycle, why);
        } else {
            self.alarms.over(&subject, cycle);
        }
        self.events.push(Event {
            number: 0,
            cycle,
            at_ns: record.at_ns,
            name: record.name.clone(),
            event: "source",
            level,
            text,
            cause,
        });
    }

    /// Something that must never happen.
    fn violated(&mut self, record: &Record, cycle: i64, what: &str) {
        self.events.push(Event {
            number: 0,
            cycle,
            at_ns: record.at_ns,
            name: record.name.clone(),
            event: "wrong",
            level: Level::Alarm,
            text: what.to_owned(),
            cause: None,
        });
        let subject = (record.name.clone(), "wrong");
        self.alarms.raise(subject, cycle, what.to_owned());
    }

    pub(super) fn plant(&mut self, record: &Record, program: ProgramId, event: &PlantEvent) {
        let Some(track) = self.programs.get_mut(program.index()) else {
            return;
        };
        match event {
            PlantEvent::Stepped { moment, field, .. } => {
                self.histories[program.index()].saw(&field.sensors);
                let before = track.plant.as_ref().map_or(0, |plant| plant.plant_faults);
                track.plant = Some(field.clone());
                if field.plant_faults > before {
                    let cycle = self.cycles.of(Some(*moment));
                    let text = format!(
                        "something happened to it that must not: {} so far",
                        field.plant_faults
                    );
                    self.alarms
                        .raise((record.name.clone(), "plant_fault"), cycle, text.clone());
                    self.events.push(Event {
                        number: 0,
                        cycle,
                        at_ns: record.at_ns,
                        name: record.name.clone(),
                        event: "plant_fault",
                        level: Level::Alarm,
                        text,
                        cause: None,
                    });
                }
            }
            PlantEvent::Refused { member, .. } => {
                self.refused(*member);
                let cycle = self.cycles.of(None);
                self.happened(record, cycle, None);
            }
        }
    }

    /// What every station was up to `cycle`, of which all remote I/Os have told but for the slowest.
    pub(super) fn close_up_to(&mut self, cycle: i64) {
        if self.closed.is_some_and(|closed| closed >= cycle) {
            return;
        }
        self.closed = Some(cycle);
        for (rank, track) in self.stations.iter().enumerate() {
            self.series
                .station_was(rank, cycle, track.state(Some(cycle), 0));
        }
    }

    /// The name of a signal that is forced.
    pub(crate) fn signal_name(&self, program: ProgramId, signal: SignalPlace) -> String {
        let circuit = &self.cluster.controllers()[program.index()].circuit;
        let name = match signal {
            SignalPlace::Input(place) => circuit.inputs().get(usize::from(place)).cloned(),
            SignalPlace::Output(place) => {
                let output = circuit.outputs().get(usize::from(place));
                output.map(|output| output.name.clone())
            }
        };
        name.unwrap_or_else(|| "a signal that it has not".to_owned())
    }
}
