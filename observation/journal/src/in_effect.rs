//! The records that are in effect: of all that happened once, the newest of each kind about each subject, until it is over.
//!
//! Whoever takes them in their order knows the processes, cuts, forces, exclusions and losses of the present as whoever read everything.
//! Invariant: their number is bounded by the members of the cluster and [`MOST_CHANGES`], whatever happens in a run.

use std::collections::{BTreeMap, BTreeSet};

use understudy_bus::HostEvent;
use understudy_node::Event as Station;
use understudy_plant::Event as Plant;
use understudy_remote_io::Event as RemoteIo;
use understudy_simulator::Action;
use understudy_wire::{Member, OrderRefusal, Part};

use crate::record::{Happening, Record, RunEvent};
use crate::rules::Process;

/// What a record is about; the newest one about a subject is in effect.
type Subject = (Option<Member>, &'static str, String);

/// What a record does to the ones about its subject.
enum Effect {
    /// It takes their place.
    Replaces(Subject),
    /// They are over.
    Ends(Subject),
}

#[derive(Debug, Default)]
pub(crate) struct InEffect {
    /// In the order of their numbers, with their cycles.
    records: BTreeMap<u64, (i64, Record)>,
    by_subject: BTreeMap<Subject, u64>,
    count: u64,
    /// Finished parts and faults of each plant, so far.
    plants: BTreeMap<Option<Member>, (u64, u64)>,
    /// Stations that have not published since they joined or adopted a state.
    joining: BTreeSet<Option<Member>>,
    /// Whether programs or points may be other ones than at the beginning of the run.
    is_changed: bool,
}

/// Online changes among them, at most: the newest.
const MOST_CHANGES: usize = 16;

const CHANGE_LOADED: &str = "change-loaded";

/// What a station reports before its first turn, and is over with it.
const BEFORE_TURNS: [&str; 2] = ["joins", "adopted"];

impl InEffect {
    /// Takes a record of a cycle.
    pub(crate) fn note(&mut self, record: &Record, cycle: i64) {
        if let Happening::Plant(Plant::Stepped { field, .. }) = &record.event {
            let now = (field.finished, field.plant_faults);
            let before = self.plants.insert(record.member, now);
            if field.plant_faults > before.map_or(0, |(_, faults)| faults) {
                self.replaces((record.member, "plant-faults", String::new()), record, cycle);
            } else if before != Some(now) {
                self.replaces((record.member, "plant", String::new()), record, cycle);
            }
            return;
        }
        if let Happening::Station(Station::Published { .. }) = &record.event {
            if self.joining.remove(&record.member) {
                self.end_all(|(member, kind, _)| {
                    *member == record.member && BEFORE_TURNS.contains(kind)
                });
            }
            return;
        }
        self.is_changed |= matches!(
            record.event,
            Happening::Run(RunEvent::ChangeLoaded { .. })
                | Happening::RemoteIo(RemoteIo::PointsChanged { .. })
        );
        match effect(record) {
            Some(Effect::Replaces(subject)) => {
                if BEFORE_TURNS.contains(&subject.1) {
                    self.joining.insert(record.member);
                }
                self.replaces(subject, record, cycle);
            }
            Some(Effect::Ends(subject)) => {
                if let Some(over) = self.by_subject.remove(&subject) {
                    self.records.remove(&over);
                }
            }
            None => {}
        }
    }

    /// Whether a turn of a station changes what is in effect.
    pub(crate) fn awaits_turns(&self) -> bool {
        !self.joining.is_empty()
    }

    fn end_all(&mut self, is_over: impl Fn(&Subject) -> bool) {
        for (_, number) in self.by_subject.extract_if(.., |subject, _| is_over(subject)) {
            self.records.remove(&number);
        }
    }

    fn replaces(&mut self, subject: Subject, record: &Record, cycle: i64) {
        self.count += 1;
        let is_change = subject.1 == CHANGE_LOADED;
        if let Some(before) = self.by_subject.insert(subject, self.count) {
            self.records.remove(&before);
        }
        self.records.insert(self.count, (cycle, record.clone()));
        if is_change {
            self.forget_old_changes();
        }
    }

    /// Whether programs or points may be other ones than at the beginning of the run: a reader that knows no record of before would give wrong names.
    pub(crate) fn is_changed(&self) -> bool {
        self.is_changed
    }

    fn forget_old_changes(&mut self) {
        let of_changes = |((_, kind, _), _): &(&Subject, &u64)| *kind == CHANGE_LOADED;
        let changes = || self.by_subject.iter().filter(of_changes);
        let oldest = changes().min_by_key(|(_, number)| **number);
        if changes().count() > MOST_CHANGES
            && let Some((subject, number)) =
                oldest.map(|(subject, number)| (subject.clone(), *number))
        {
            self.by_subject.remove(&subject);
            self.records.remove(&number);
        }
    }

    /// With their cycles, oldest first.
    pub(crate) fn records(&self) -> impl Iterator<Item = (i64, &Record)> {
        let records = self.records.values();
        records.map(|(cycle, record)| (*cycle, record))
    }

    pub(crate) fn shift(&mut self, by: i64) {
        for (cycle, _) in self.records.values_mut() {
            *cycle = cycle.saturating_add(by);
        }
    }
}

/// Nothing for a record that happens in every cycle, or that changes nothing of what comes after.
fn effect(record: &Record) -> Option<Effect> {
    let of = |kind| (record.member, kind, String::new());
    let about = |kind, subject: &dyn std::fmt::Debug| (record.member, kind, format!("{subject:?}"));
    let replaces = match &record.event {
        Happening::Station(event) => match event {
            Station::BecameCycleMaster { .. } => of("cycle-master"),
            Station::Joins { .. } => of("joins"),
            Station::Adopted { program, .. } => about("adopted", program),
            Station::Excluded { program, .. } => about("excluded", program),
            Station::Configured(_) => of("configured"),
            Station::NotPrepared { program, .. } => about("not-prepared", program),
            Station::Readmitted { program, .. } => about("readmitted", program),
            Station::Refused { member, .. } => about("refused", member),
            Station::SamplesMissing { program, .. } => about("samples-missing", program),
            Station::SamplesReturned { program, .. } => {
                return Some(Effect::Ends(about("samples-missing", program)));
            }
            Station::RefusalEnded { member } => {
                return Some(Effect::Ends(about("refused", member)));
            }
            _ => return None,
        },
        Happening::RemoteIo(event) => return of_remote_io(record, event),
        Happening::Plant(Plant::Refused { member, .. }) => about("refused", member),
        Happening::Plant(Plant::RefusalEnded { member }) => {
            return Some(Effect::Ends(about("refused", member)));
        }
        Happening::Plant(Plant::Stepped { .. }) => return None,
        Happening::Host(event) => match event {
            HostEvent::Ready { .. } => of("ready"),
            HostEvent::FieldLost { .. } | HostEvent::FieldRegained => of("field"),
            HostEvent::FieldContested | HostEvent::FieldUncontested => of("contested"),
            HostEvent::DuplicateFound { member } => about("duplicate", member),
            HostEvent::DuplicateGone { member } => {
                return Some(Effect::Ends(about("duplicate", member)));
            }
            HostEvent::SpareReceived { spare, .. } | HostEvent::SpareLost { spare } => {
                about("spare", spare)
            }
            HostEvent::RetainFailed { .. } | HostEvent::RetainRegained => of("retain"),
            HostEvent::RetainedRefused { file, .. } => about("retained-refused", file),
            HostEvent::RetainedDropped { program, .. } => about("retained-dropped", program),
            HostEvent::LinkFailed { network, .. } | HostEvent::LinkReopened { network, .. } => {
                about("link", network)
            }
            HostEvent::NetworkReception { network, lost, impaired } => {
                let subject = about("network", network);
                if lost.is_empty() && impaired.is_empty() {
                    return Some(Effect::Ends(subject));
                }
                subject
            }
            HostEvent::WallClock { .. } | HostEvent::WallClockStepped { .. } => of("wall-clock"),
            _ => return None,
        },
        Happening::Run(event) => of_run(event)?,
    };
    Some(Effect::Replaces(replaces))
}

fn of_remote_io(record: &Record, event: &RemoteIo) -> Option<Effect> {
    let of = |kind| (record.member, kind, String::new());
    let about = |kind, subject: &dyn std::fmt::Debug| (record.member, kind, format!("{subject:?}"));
    let replaces = match event {
        RemoteIo::StartedCold { .. } => of("started-cold"),
        RemoteIo::StartedWarm { .. } => of("started-warm"),
        RemoteIo::AdoptedLineage { .. } => of("adopted-lineage"),
        RemoteIo::Disputed { .. } => of("disputed"),
        RemoteIo::ConfigurationDisputed { .. } => of("configuration-disputed"),
        RemoteIo::StateLost { .. } => of("state-lost"),
        RemoteIo::StateRecovered { .. } => of("state-recovered"),
        RemoteIo::ChoiceRefused { refusal: OrderRefusal::OtherState { .. }, .. } => {
            of("choice-refused")
        }
        RemoteIo::Protected { .. } | RemoteIo::Unprotected { .. } => of("protection"),
        RemoteIo::Released { .. } => of("released"),
        RemoteIo::Configured(_) => of("configured"),
        RemoteIo::ProgramChanged { .. } => of("program-changed"),
        RemoteIo::ChangeTakenBack { .. } => of("change-taken-back"),
        RemoteIo::Points { .. } | RemoteIo::PointsChanged { .. } => of("points"),
        RemoteIo::PointsUnknown { .. } => of("points-unknown"),
        RemoteIo::Forced { force, .. } => about("forced", &force.signal),
        RemoteIo::Unforced { signal, .. } => return Some(Effect::Ends(about("forced", signal))),
        RemoteIo::SignalValidity { input, .. } => about("validity", input),
        RemoteIo::RecalledExclusion { stations, .. } => about("recalled", &stations.bits()),
        RemoteIo::Diagnosed { .. } => of("diagnosed"),
        RemoteIo::Flagged { station, .. } => about("flagged", station),
        RemoteIo::Cleared { station, .. } => return Some(Effect::Ends(about("flagged", station))),
        RemoteIo::ValueFault { accused, .. } => about("value-fault", &accused.bits()),
        RemoteIo::Refused { member, .. } => about("refused", member),
        RemoteIo::RefusalEnded { member } => {
            return Some(Effect::Ends(about("refused", member)));
        }
        // Of either remote I/O of the program, whichever process ends.
        RemoteIo::PartChanged { part: Part::Author, .. } => {
            let program = record.member.and_then(Member::sampled_program);
            (None, "author", format!("{program:?}"))
        }
        RemoteIo::PartnerLost { .. } => of("partner"),
        RemoteIo::InputsDiffer { input, .. } | RemoteIo::InputExcluded { input, .. } => {
            about("input-modules", input)
        }
        RemoteIo::InputsAgree { input, .. } => {
            return Some(Effect::Ends(about("input-modules", input)));
        }
        RemoteIo::PartnerReceived { .. } => return Some(Effect::Ends(of("partner"))),
        _ => return None,
    };
    Some(Effect::Replaces(replaces))
}

fn of_run(event: &RunEvent) -> Option<Subject> {
    Some(match event {
        // One change may begin where another one has led.
        RunEvent::ChangeLoaded { texts } => {
            (None, CHANGE_LOADED, [texts.before, texts.after].map(|it| it.to_string()).join(" "))
        }
        RunEvent::Started { member } | RunEvent::Ended { member, .. } => {
            (Some(*member), "process", String::new())
        }
        RunEvent::Fault { action, member, .. } => {
            let (kind, subject) = match (action, Process::after(*action)) {
                // None of the three undoes all that another did.
                (Action::Stop, _) => ("suspended", String::new()),
                (Action::Continue, _) => ("continued", String::new()),
                (_, Some(_)) => ("process", String::new()),
                (Action::Cut { to } | Action::Heal { to }, _) => ("cut", format!("{to:?}")),
                (Action::Unplug { network } | Action::Plug { network }, _) => {
                    ("unplugged", network.to_string())
                }
                // The newest is the cause that is named.
                _ => ("action", String::new()),
            };
            (Some(*member), kind, subject)
        }
        RunEvent::Acknowledged(seen) => {
            (None, "acknowledged", [&*seen.name, &seen.alarm].join("/"))
        }
        RunEvent::Shelved(shelving) => (None, "shelved", shelving.name.clone()),
        RunEvent::Unshelved(unshelving) => (None, "shelved", unshelving.name.clone()),
        RunEvent::Attached { member } | RunEvent::Detached { member, .. } => {
            (Some(*member), "attached", String::new())
        }
        RunEvent::ScenarioOver { .. } => (None, "scenario-over", String::new()),
        RunEvent::Interrupted => (None, "interrupted", String::new()),
        _ => return None,
    })
}

/// The records that no later one has ended: for a person who asks for the state. Viewers take all of
/// them, since alarms that are over may wait for an acknowledgement.
pub fn records_not_over(mut records: Vec<Record>) -> Vec<Record> {
    let mut kept = Vec::new();
    while let Some(record) = records.pop() {
        if !kept.iter().any(|later| ends(later, &record)) {
            kept.push(record);
        }
    }
    kept.reverse();
    kept
}

/// Whether a record ends the state that an earlier one of the same member says.
fn ends(later: &Record, earlier: &Record) -> bool {
    match (&later.event, &earlier.event) {
        (Happening::RemoteIo(later), Happening::RemoteIo(earlier)) => {
            let starts = |event: &RemoteIo| {
                matches!(
                    event,
                    RemoteIo::StartedCold { .. }
                        | RemoteIo::StartedWarm { .. }
                        | RemoteIo::AdoptedLineage { .. }
                )
            };
            match earlier {
                RemoteIo::StateLost { .. }
                | RemoteIo::Disputed { .. }
                | RemoteIo::ConfigurationDisputed { .. }
                | RemoteIo::ChoiceRefused { .. } => {
                    starts(later) || matches!(later, RemoteIo::StateRecovered { .. })
                }
                RemoteIo::StartedCold { .. }
                | RemoteIo::StartedWarm { .. }
                | RemoteIo::AdoptedLineage { .. }
                | RemoteIo::StateRecovered { .. } => starts(later),
                RemoteIo::ValueFault { .. } | RemoteIo::RecalledExclusion { .. } => {
                    matches!(later, RemoteIo::Released { .. })
                }
                _ => false,
            }
        }
        (Happening::Station(later), Happening::Station(earlier)) => match (later, earlier) {
            (Station::Readmitted { program, .. }, Station::Excluded { program: of, .. })
            | (Station::Excluded { program, .. }, Station::Readmitted { program: of, .. }) => {
                program == of
            }
            _ => false,
        },
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use understudy_cluster::ChangeTexts;
    use understudy_wire::ConfigurationHash;

    use super::*;

    /// A question is over once the program starts or the state is there again, in every order of the records.
    #[test]
    fn a_question_that_was_answered_is_not_in_effect() {
        let moment = r#""moment":{"epoch":1,"cycle":2}"#;
        let event = |event: &str, more: &str| {
            format!(
                r#"{{"at_ns":1,"name":"robot-io","member":{{"remote-io":0}},"event":{{"event":"{event}",{more}}}}}"#
            )
        };
        let read = |text: String| serde_json::from_str::<Record>(&text).expect("a record");
        let newest = r#""newest":{"epoch":1,"cycle":1}"#;
        let questions = [
            event(
                "state-lost",
                &format!(r#"{moment},"applied":null,{newest},"holder":0,"asks":true"#),
            ),
            event("disputed", &format!(r#"{moment},"stations":3"#)),
            event("configuration-disputed", &format!(r#"{moment},"stations":1,"others":1"#)),
            event(
                "choice-refused",
                &format!(r#"{moment},"refusal":{{"reason":"other-state",{newest}}}"#),
            ),
        ];
        let answers = [
            event("started-cold", r#""born":{"epoch":1,"cycle":2},"awaits_release":false"#),
            event("adopted-lineage", &format!(r#"{moment},"lineage":1,"from":0"#)),
            event("state-recovered", &format!(r#"{moment},"from":0"#)),
        ];
        for (question, answer) in questions
            .iter()
            .flat_map(|question| answers.iter().map(move |answer| (question, answer)))
        {
            let (question, answer) = (read(question.clone()), read(answer.clone()));
            let asked = vec![answer.clone(), question.clone()];
            assert_eq!(records_not_over(asked.clone()), asked, "it is asked now");
            assert_eq!(records_not_over(vec![question, answer.clone()]), [answer]);
        }
    }

    /// One change begins where another one has led, so each that is in effect is kept, and one that is loaded again is the newest; a run of many changes
    /// keeps the newest of them.
    #[test]
    fn the_newest_online_changes_are_in_effect() {
        let mut in_effect = InEffect::default();
        let mut load = |before: u64, after: u64| {
            let texts = ChangeTexts {
                cluster: 1,
                before: ConfigurationHash(before),
                after: ConfigurationHash(after),
                programs: Vec::new(),
                fallbacks: Vec::new(),
                points: Vec::new(),
            };
            let loaded = RunEvent::ChangeLoaded { texts: Box::new(texts) };
            in_effect.note(&Record::of_run(0, loaded), 0);
            let records = in_effect.records().filter_map(|(_, record)| match &record.event {
                Happening::Run(RunEvent::ChangeLoaded { texts }) => {
                    Some((texts.before.0, texts.after.0))
                }
                _ => None,
            });
            records.collect::<Vec<_>>()
        };
        load(0, 1);
        assert_eq!(load(1, 0), [(0, 1), (1, 0)]);
        assert_eq!(load(0, 1), [(1, 0), (0, 1)]);
        for number in 1..100 {
            load(number, number + 1);
        }
        let kept = load(0, 1);
        assert_eq!(kept.len(), MOST_CHANGES);
        assert_eq!(kept[MOST_CHANGES - 2..], [(99, 100), (0, 1)]);
    }
}
