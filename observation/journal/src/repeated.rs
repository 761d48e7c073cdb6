//! The records in effect of one member, repeated for viewers that attach to it while it runs.
//!
//! ```text
//!   {"in_effect":{…record…}}
//!   …
//!   {"in_effect":null}          the end of one repetition
//! ```
//!
//! A line of this form is no record: a reader that does not know it leaves it out.

use serde::{Deserialize, Serialize};
use understudy_wire::StationSet;

use crate::in_effect::InEffect;
use crate::record::{Happening, Record};

/// A line of a repetition.
#[derive(Serialize, Deserialize)]
struct Line<R> {
    in_effect: Option<R>,
}

/// The beginning of a line of a repetition.
const BEGINS: &str = "{\"in_effect\":";

/// What happens in every cycle, and is never in effect: such a line is not parsed.
const EVERY_CYCLE: [&str; 3] = ["\"sampled\"", "\"applied\"", "\"holds\""];

/// What ends the joining of a station, and is parsed for that alone.
const TURN: &str = "\"published\"";

/// The records in effect, found in lines or records as they come.
#[derive(Debug, Default)]
pub struct RecordsInEffect {
    records: InEffect,
}

impl RecordsInEffect {
    /// Takes a line of a journal; what is no record is left out.
    pub fn note_line(&mut self, line: &str) {
        let event = line.split_once("\"event\":{\"event\":").map_or("", |(_, event)| event);
        let is_turn = event.starts_with(TURN);
        if EVERY_CYCLE.iter().any(|name| event.starts_with(name))
            || is_turn && !self.records.awaits_turns()
        {
            return;
        }
        if let Ok(record) = serde_json::from_str(line) {
            self.note(&record);
        }
    }

    /// Takes a record.
    pub fn note(&mut self, record: &Record) {
        self.records.note(record, 0);
    }

    /// The records of members in effect, oldest first.
    pub fn records(&self) -> impl Iterator<Item = &Record> {
        let records = self.records.records().map(|(_, record)| record);
        records.filter(|record| !matches!(record.event, Happening::Run(_)))
    }

    /// One repetition: a line for each record, and the end.
    pub fn repetition(&self) -> Vec<u8> {
        let mut text = Vec::new();
        for in_effect in self.records().map(Some).chain([None]) {
            // Writing to memory does not fail, and neither does a record that was read.
            let _ = serde_json::to_writer(&mut text, &Line { in_effect });
            text.push(b'\n');
        }
        text
    }
}

/// The stations that a remote I/O had received at a deadline; nothing for a line of another event. The line is not parsed.
pub fn heard_at_deadline(line: &str) -> Option<StationSet> {
    let (_, event) = line.split_once("\"event\":{\"event\":")?;
    if !event.starts_with("\"applied\"") {
        return None;
    }
    let (_, heard) = event.rsplit_once("\"heard\":")?;
    serde_json::from_str(heard.trim_end_matches(['}', '\n'])).ok()
}

/// A line of a repetition: a record in effect, or nothing at its end. An error for any other line.
///
/// # Errors
/// What is wrong with it.
pub fn repeated(line: &str) -> Result<Option<Record>, serde_json::Error> {
    if !line.starts_with(BEGINS) {
        return Err(serde::de::Error::custom("it is no repeated record"));
    }
    // A record cannot be taken from within another value.
    let line: Line<Box<serde_json::value::RawValue>> = serde_json::from_str(line)?;
    line.in_effect.map(|record| serde_json::from_str(record.get())).transpose()
}

#[cfg(test)]
mod tests {
    use understudy_bus::HostEvent;
    use understudy_remote_io::Event as RemoteIo;
    use understudy_wire::{Cycle, Epoch, Image, Member, Moment, ProgramId, Source, StationSet};

    use super::*;

    fn record(cycle: u64, event: impl Fn(Moment) -> RemoteIo) -> Record {
        let moment = Moment { epoch: Epoch(1), cycle: Cycle(cycle) };
        let event = Happening::RemoteIo(event(moment));
        let member = Some(Member::RemoteIo(ProgramId(0)));
        Record { at_ns: cycle, name: "robot-io".to_owned(), member, event }
    }

    /// Of a deadline the stations are found without parsing, and no other line is taken for one.
    #[test]
    fn the_stations_of_a_deadline_are_found_in_its_line() {
        let heard: StationSet = [0, 3, 17].map(understudy_wire::StationId).into_iter().collect();
        let applied = record(7, |moment| RemoteIo::Applied {
            moment,
            sampled: None,
            outputs: Image::default(),
            driven: None,
            source: Source::Direct,
            word_of: None,
            missing: None,
            points: Some(understudy_wire::ProgramHash(3)),
            heard,
        });
        let line = |record: &Record| serde_json::to_string(record).expect("JSON") + "\n";
        assert_eq!(heard_at_deadline(&line(&applied)), Some(heard));
        let lost = HostEvent::FieldLost { reason: "\"applied\" \"heard\":3".to_owned() };
        let other = Record { event: Happening::Host(lost), ..applied };
        assert_eq!(heard_at_deadline(&line(&other)), None);
        assert_eq!(heard_at_deadline("{"), None);
    }

    #[test]
    fn a_repetition_has_the_newest_record_of_each_subject() {
        let lost = Record {
            event: Happening::Host(HostEvent::FieldLost { reason: "no answer".to_owned() }),
            ..record(2, |moment| RemoteIo::Protected { moment })
        };
        let unprotected = record(3, |moment| RemoteIo::Unprotected {
            moment,
            since: moment,
            lacking: Default::default(),
        });
        let mut in_effect = RecordsInEffect::default();
        let applied = record(4, |moment| RemoteIo::Applied {
            moment,
            sampled: None,
            outputs: Image::zero(2),
            driven: None,
            source: Source::Direct,
            word_of: None,
            missing: None,
            points: None,
            heard: StationSet::EMPTY,
        });
        let first = record(1, |moment| RemoteIo::Protected { moment });
        for record in [&first, &lost, &unprotected, &applied] {
            in_effect.note_line(&serde_json::to_string(record).expect("JSON"));
        }
        in_effect.note_line("no record");
        let text = String::from_utf8(in_effect.repetition()).expect("text");
        let read: Result<Vec<Option<Record>>, _> = text.lines().map(repeated).collect();
        assert_eq!(read.expect("lines"), [Some(lost), Some(unprotected), None]);
        assert!(repeated(&serde_json::to_string(&applied).expect("JSON")).is_err());
    }
}
