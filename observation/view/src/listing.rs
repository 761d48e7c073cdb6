//! The journal as a list of lines that a person chose.

use std::collections::BTreeMap;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Serialize;
use understudy_cluster::{AlarmDeclaration, Cluster};
use understudy_journal::{
    AlarmChange, AlarmFold, Cycles, Happening, Present, Record, RunEvent, TimeOfDay, TimesOfDay,
    Turn, moment,
};
use understudy_remote_io::{Event as RemoteIoEvent, Missing};
use understudy_text::spelling::suggestion;
use understudy_wire::{Member, Moment, ProgramId, Source};

use crate::describe::{PROGRAM_FAULT, Writes, alarm_event, describe, event_names};
use crate::error::ViewError;
use crate::event::Level;
use crate::stop::Stops;
use crate::zone::Zone;

/// Which records are wanted; an empty list is all.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Filter {
    /// Names of members, or `laboratory`.
    pub members: Vec<String>,
    /// Words such as `flagged`.
    pub events: Vec<String>,
    /// Names of controllers: what they, their remote I/Os and their plants say.
    pub programs: Vec<String>,
    /// The first cycle, from the origin.
    pub from: Option<i64>,
    /// The last cycle.
    pub to: Option<i64>,
    /// Also the records of every cycle. Those named in `events` are listed anyway.
    pub ordinary: bool,
}

/// One record in words.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct JournalLine {
    /// From the origin of the run; nothing while that is not known.
    pub cycle: Option<i64>,
    /// Time of the record.
    pub at_ns: u64,
    /// Time of day of the record; nothing where no wall clock was recorded, as in a simulated run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<TimeOfDay>,
    /// Who.
    pub name: String,
    /// What, in one word.
    pub event: &'static str,
    /// How much a person should care.
    pub level: Level,
    /// What happened.
    pub text: String,
}

/// Goes through the records of a run, and gives those that are wanted.
#[derive(Debug, Clone)]
pub struct Listing {
    filter: Filter,
    present: Present,
    writes: Writes,
    wanted: Vec<Member>,
    cycles: Cycles,
    sources: BTreeMap<ProgramId, Source>,
    stops: Stops,
    declared: Arc<[AlarmDeclaration]>,
    alarms: AlarmFold,
    times: TimesOfDay,
    /// The records that are in effect follow.
    continues: bool,
}

impl Listing {
    /// For a run of this cluster, from its first record on.
    ///
    /// # Errors
    /// Every name and word of the filter that does not exist.
    pub fn new(cluster: &Cluster, filter: Filter) -> Result<Self, Vec<ViewError>> {
        let present = Present::of(Arc::new(cluster.clone()));
        let members = present.members();
        let names: Vec<&str> = members.iter().map(|(_, name)| name).chain(["laboratory"]).collect();
        let programs: Vec<&str> =
            cluster.controllers().iter().map(|found| found.name.as_str()).collect();
        let mut errors = Vec::new();
        let mut check = |kind, asked: &[String], known: &[&str]| {
            for name in asked.iter().filter(|name| !known.contains(&name.as_str())) {
                errors.push(ViewError::NoName {
                    kind,
                    name: name.clone(),
                    hint: suggestion(name, known.iter().copied()),
                });
            }
        };
        check("member", &filter.members, &names);
        check("program", &filter.programs, &programs);
        let events: Vec<&str> = event_names().into_iter().collect();
        check("event", &filter.events, &events);
        if !errors.is_empty() {
            return Err(errors);
        }
        let of_program = |member: &Member| match member {
            Member::Station(station) => Some(station.index()),
            Member::RemoteIo(program) | Member::Plant(program) | Member::Twin(program) => {
                Some(program.index())
            }
        };
        let wanted: Vec<Member> = members
            .iter()
            .filter(|(member, _)| {
                let program = of_program(member).and_then(|place| programs.get(place));
                program.is_some_and(|name| filter.programs.iter().any(|wanted| wanted == name))
            })
            .map(|(member, _)| member)
            .collect();
        Ok(Self {
            wanted,
            filter,
            present,
            writes: Writes::default(),
            cycles: Cycles::default(),
            sources: BTreeMap::new(),
            stops: Stops::new(cluster),
            declared: Arc::clone(cluster.alarms()),
            alarms: AlarmFold::new(Arc::clone(cluster.alarms()), cluster.controllers().len()),
            times: TimesOfDay::new(cluster.agreement().schedule.period()),
            continues: false,
        })
    }

    /// The records before are not read: `moment` is cycle `cycle` of the run.
    pub(crate) fn begins_at(&mut self, moment: Moment, cycle: i64) {
        self.cycles = Cycles::at(moment, cycle);
    }

    /// The wall clocks of the members before the first record that is read.
    pub(crate) fn times_are(&mut self, times: TimesOfDay) {
        self.times = times;
    }

    /// `moment` is cycle `cycle` of the run.
    pub(crate) fn origin_is(&mut self, moment: Moment, cycle: i64) {
        self.cycles.origin_is(moment, cycle);
    }

    pub(crate) fn has_origin(&self) -> bool {
        self.cycles.has_origin()
    }

    /// The same from the first record on again, with what has been learnt of the origin.
    #[must_use]
    pub(crate) fn again(&self) -> Self {
        Self {
            cycles: self.cycles.again(),
            sources: BTreeMap::new(),
            stops: Stops::new(self.present.first()),
            present: self.present.again(),
            alarms: self.alarms.again(),
            ..self.clone()
        }
    }

    /// Takes the next record; answers with it in words and with the alarms that it changes, as far as they are wanted.
    pub fn take(&mut self, record: &Record) -> Vec<JournalLine> {
        match &record.event {
            Happening::Run(RunEvent::Continues(from)) => {
                // Whoever has read what was before knows it.
                self.continues = self.cycles.latest().is_none();
                if self.continues {
                    self.cycles = Cycles::continuing(from.numbering.clone(), from.origin);
                }
            }
            Happening::Run(RunEvent::InEffect { record, .. }) if self.continues => {
                self.turned(record);
            }
            Happening::Run(RunEvent::InEffect { .. }) => {}
            _ => self.continues = false,
        }
        self.times.note_all(record);
        let cycle = self.cycle_of(record);
        if let Some(shift) = self.cycles.take_shift() {
            self.alarms.shift(shift);
            self.times.shift(shift);
        }
        if let Happening::RemoteIo(RemoteIoEvent::Applied { .. }) = &record.event {
            self.times.passed(&record.name, cycle, record.at_ns);
        }
        let at = self.times.of_record(&record.name, record.at_ns);
        let at = at.or_else(|| self.times.of_cycle(cycle));
        let mut changes = self.turned(record);
        changes.extend(self.alarms.take(record, cycle));
        let cycle = self.cycles.has_origin().then_some(cycle);
        let mut lines: Vec<JournalLine> = self.line(record, cycle, at).into_iter().collect();
        if changes.is_empty() || !self.is_wanted(record, cycle) {
            return lines;
        }
        let alarms = changes.iter().filter_map(|change| {
            let declared = self.declared.get(change.alarm)?;
            Some(alarm_event(declared, change.transition?))
        });
        let wanted =
            alarms.filter(|(event, ..)| self.filter.events.is_empty() || self.wants(event));
        lines.extend(wanted.map(|(event, level, text)| JournalLine {
            cycle,
            at_ns: record.at_ns,
            at,
            name: record.name.clone(),
            event,
            level,
            text,
        }));
        lines
    }

    /// Other points may count from a record on; answers with the alarms that this changes.
    fn turned(&mut self, record: &Record) -> Vec<AlarmChange> {
        let Some(turn) = self.present.take(record) else {
            return Vec::new();
        };
        self.stops.turned(&turn, &self.present);
        match turn {
            Turn::Loaded(_) => Vec::new(),
            Turn::Points(program) => self.alarms.lay_out(program, &self.present),
        }
    }

    fn line(
        &mut self,
        record: &Record,
        cycle: Option<i64>,
        at: Option<TimeOfDay>,
    ) -> Option<JournalLine> {
        let changed = self.source_changed(record);
        let fault = self.stops.take(record, &self.present);
        self.writes.note(record, self.present.members());
        if !self.is_wanted(record, cycle) {
            return None;
        }
        let mut description = describe(record, self.present.members(), &self.writes, &self.cycles);
        let wants_source = self.filter.events.is_empty() || self.wants("source");
        if changed && wants_source && !self.filter.ordinary && !self.wants("applied") {
            description.event = "source";
            description.is_ordinary = false;
        }
        if let Some(fault) = fault
            && (self.filter.events.is_empty() || self.wants(PROGRAM_FAULT))
        {
            description.event = PROGRAM_FAULT;
            description.level = Level::Alarm;
            description.text = fault;
            description.is_ordinary = false;
        }
        let named = self.wants(description.event);
        let wanted = named
            || self.filter.events.is_empty() && (self.filter.ordinary || !description.is_ordinary);
        wanted.then(|| JournalLine {
            cycle,
            at_ns: record.at_ns,
            at,
            name: record.name.clone(),
            event: description.event,
            level: description.level,
            text: description.text,
        })
    }

    fn wants(&self, event: &str) -> bool {
        self.filter.events.iter().any(|wanted| wanted == event)
    }

    /// Whether the outputs of a program come from elsewhere than at the deadline before.
    fn source_changed(&mut self, record: &Record) -> bool {
        let (Some(program), Happening::RemoteIo(RemoteIoEvent::Applied { source, .. })) =
            (record.member.and_then(Member::sampled_program), &record.event)
        else {
            return false;
        };
        self.sources.insert(program, *source) != Some(*source)
    }

    fn cycle_of(&mut self, record: &Record) -> i64 {
        match (&record.event, record.member.and_then(Member::sampled_program)) {
            (
                Happening::RemoteIo(RemoteIoEvent::Applied { moment, missing, .. }),
                Some(program),
            ) => {
                let idle = *missing == Some(Missing::NoCycle);
                self.cycles.deadline(program, *moment, idle)
            }
            (Happening::Run(RunEvent::Origin { moment, cycle }), _) => {
                let cycle = i64::try_from(*cycle).unwrap_or(i64::MAX / 2);
                self.cycles.origin_is_recorded(*moment, cycle);
                cycle
            }
            (
                Happening::Run(
                    RunEvent::Finished
                    | RunEvent::Acknowledged(_)
                    | RunEvent::Shelved(_)
                    | RunEvent::Unshelved(_),
                ),
                _,
            ) => self.cycles.of(None),
            // What is done is felt in the next cycle.
            (Happening::Run(_), _) if self.cycles.latest().is_some() => {
                self.cycles.of(None).saturating_add(1)
            }
            _ => self.cycles.of(moment(&record.event)),
        }
    }

    fn is_wanted(&self, record: &Record, cycle: Option<i64>) -> bool {
        let Filter { members, from, to, programs, .. } = &self.filter;
        let by_name = members.is_empty() || members.contains(&record.name);
        let by_program = programs.is_empty()
            || record.member.is_some_and(|member| self.wanted.contains(&member));
        let after = from.is_none_or(|from| cycle.is_some_and(|cycle| cycle >= from));
        let before = to.is_none_or(|to| cycle.is_none_or(|cycle| cycle <= to));
        by_name && by_program && after && before
    }

    /// Whether records that are still to come are all behind the last wanted cycle.
    pub fn is_past(&self) -> bool {
        let latest = self.cycles.latest().filter(|_| self.cycles.has_origin());
        // Lines of different members may be a few cycles apart.
        self.filter.to.is_some_and(|to| latest.is_some_and(|latest| latest > to.saturating_add(64)))
    }
}

impl JournalLine {
    /// In columns, without the time of day.
    pub fn to_text(&self) -> String {
        let cycle = self.cycle.map_or("-".to_owned(), |cycle| cycle.to_string());
        format!("{cycle:>8}  {:14} {:14} {}", self.name, self.event, self.text)
    }
}

/// Lines as text, in a zone: the time of day first, and a line with the date and the zone wherever one of them changes.
#[derive(Debug, Clone, Default)]
pub struct JournalText {
    zone: Zone,
    day: Option<String>,
}

impl JournalText {
    /// Times in this zone.
    pub fn new(zone: Zone) -> Self {
        Self { zone, day: None }
    }

    /// The next line, with that of the day before it where it is another one.
    pub fn text(&mut self, line: &JournalLine) -> String {
        let text = line.to_text();
        let Some(at) = line.at else {
            // Before the first wall clock of a run, or a simulated run.
            return if self.day.is_some() { format!("{:12}  {text}", "") } else { text };
        };
        let text = format!("{}  {text}", self.zone.clock(at));
        let day = Some(format!("{} {}", self.zone.date(at), self.zone.name(at)));
        if self.day == day {
            return text;
        }
        self.day = day;
        format!("{}\n{text}", self.day.as_deref().unwrap_or_default())
    }
}
