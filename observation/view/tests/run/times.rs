//! Times of day: of the shown cycle, events, alarms, lines of the journal and explanations, from the recorded wall clocks alone.

use std::sync::Arc;

use understudy_bus::HostEvent;
use understudy_journal::{Happening, Record, RunEvent, TimeOfDay};
use understudy_view::{Alarm, Bounds, Filter, JournalText, Listing, Model, Zone};
use understudy_wire::{Member, ProgramId};

use crate::support::{cell, records, scenario};

/// 2026-11-26 13:03:12 UTC.
const NOON: u64 = 1_795_698_192_000_000_000;

const KILL: &str = "title = \"times\"\ncycles = 300\n\
    [[step]]\nat = 100\naction = \"crash\"\nstation = \"understudy\"\n\
    [[step]]\nat = 200\naction = \"restart\"\nstation = \"understudy\"\n";

/// A run of real processes: each member records its wall clock before its first record. That of a member is ahead by so many seconds.
fn run(ahead: &dyn Fn(&str) -> u64) -> Vec<Record> {
    let cell = cell();
    let mut seen = Vec::new();
    let mut run = Vec::new();
    for record in records(&cell, &scenario(&cell, KILL), 1) {
        if record.member.is_some() && !seen.contains(&record.name) {
            seen.push(record.name.clone());
            let unix_ns = NOON + record.at_ns + ahead(&record.name) * 1_000_000_000;
            run.push(clock(&record, HostEvent::WallClock { unix_ns }));
        }
        run.push(record);
    }
    run
}

fn clock(beside: &Record, event: HostEvent) -> Record {
    Record { event: Happening::Host(event), ..beside.clone() }
}

fn read(records: &[Record]) -> Model {
    let mut model = Model::new(Arc::new(cell()), Bounds::default());
    records.iter().for_each(|record| model.note(record));
    model
}

fn east(_: i64) -> i32 {
    2 * 3600 + 30 * 60
}

#[test]
fn every_view_has_the_same_times_of_day() {
    let records = run(&|_| 0);
    let model = read(&records);
    let snapshot = model.snapshot();
    let at = snapshot.at.expect("a time of day");
    assert_eq!(snapshot.clocks_apart, None);
    // Within the two cycles in which a deadline is decided.
    let of_cycle = |cycle: i64| {
        let behind = u64::try_from(snapshot.cycle.expect("a cycle") - cycle).expect("before");
        at.0 - behind * 10_000_000
    };
    let near = |time: Option<TimeOfDay>, cycle: i64| {
        let time = time.expect("a time of day");
        assert!(time.0.abs_diff(of_cycle(cycle)) < 25_000_000, "{time} of cycle {cycle}");
    };
    let alarms: Vec<Alarm> = model.alarms_at(i64::MAX).collect();
    let [alarm] = &alarms[..] else { panic!("{alarms:?}") };
    near(alarm.raised_at, alarm.cycle);
    near(alarm.over_at, alarm.over.expect("over"));
    for event in model.events().filter(|event| event.cycle >= 0) {
        near(event.at, event.cycle);
    }
    let why = model.why("press.move_down", Some(150)).expect("it is known");
    near(why.at, 150);
    assert!(why.to_text(Zone::UTC).contains("in cycle 150, 2026-11-26 13:03:1"));
    assert!(why.to_text(Zone::of(east)).contains(" 15:33:1"), "the same in another zone");
    let json = serde_json::to_value(alarm).expect("JSON");
    assert!(json["raised_at"].as_str().is_some_and(|at| at.ends_with('Z')), "{json}");
}

#[test]
fn the_journal_names_the_day_and_the_zone_once() {
    let records = run(&|_| 0);
    let text = |zone: Zone| {
        let mut listing = Listing::new(&cell(), Filter::default()).expect("no names");
        let mut shown = JournalText::new(zone);
        let lines = records.iter().flat_map(|record| listing.take(record));
        let lines: Vec<String> = lines.map(|line| shown.text(&line)).collect();
        lines.join("\n")
    };
    let utc = text(Zone::UTC);
    assert_eq!(utc.matches("2026-11-26 UTC\n").count(), 1, "{utc}");
    assert!(utc.lines().all(|line| line.starts_with("2026") || line.starts_with("13:03:1")));
    let east = text(Zone::of(east));
    assert_eq!(east.matches("2026-11-26 UTC+02:30\n").count(), 1, "{east}");
    assert!(east.contains("\n15:33:1"), "{east}");
}

/// All members are gone for eight seconds: the cycle in which the alarm was raised comes after them.
#[test]
fn an_alarm_of_an_outage_begins_with_it() {
    let mut records = run(&|_| 0);
    let gone = records.iter().position(|record| record.at_ns > 2_000_000_000).expect("later");
    let at_ns = records[gone].at_ns;
    let member = Member::RemoteIo(ProgramId(0));
    let ended = RunEvent::Ended { member, how: "killed".to_owned(), said: Vec::new() };
    records[gone..].iter_mut().for_each(|record| record.at_ns += 8_000_000_000);
    records.insert(gone, Record::of_run(at_ns, ended));
    let model = read(&records);
    let alarm = model.alarms_at(i64::MAX).find(|alarm| alarm.alarm == "not-driven");
    let alarm = alarm.expect("no member drives the outputs");
    assert_eq!(alarm.raised_at, Some(TimeOfDay(NOON + at_ns)));
    assert!(alarm.over_at.is_none_or(|at| at.0 > NOON + at_ns + 7_900_000_000), "{alarm:?}");
}

/// Before a step of the clock the times stay as they were, after it they are the new ones, and the step is an event.
#[test]
fn a_clock_that_is_set_is_said() {
    let mut records = run(&|_| 0);
    let hour = 3_600_000_000_000_i64;
    for name in ["robot-io", "press-io", "robot", "press", "understudy"] {
        let is_late = |record: &Record| record.name == name && record.at_ns > 2_500_000_000;
        let place = records.iter().position(is_late).expect("a late record");
        let unix_ns = NOON + records[place].at_ns - hour.unsigned_abs();
        let event = HostEvent::WallClockStepped { unix_ns, step_ns: -hour };
        let step = clock(&records[place], event);
        records.insert(place, step);
    }
    let model = read(&records);
    let at = |cycle| model.snapshot_at(cycle).and_then(|snapshot| snapshot.at);
    let (before, after) = (at(50).expect("a time"), at(290).expect("a time"));
    assert!(before.to_string().starts_with("2026-11-26T13:03:1"), "{before}");
    assert!(after.to_string().starts_with("2026-11-26T12:03:1"), "{after}");
    let steps = model.events().filter(|event| event.event == "wall-clock-stepped");
    assert_eq!(steps.count(), 5);
    let alarm = model.alarms_at(i64::MAX).next().expect("an alarm");
    let raised = alarm.raised_at.expect("a time");
    assert!(raised.to_string().starts_with("2026-11-26T13:03:1"), "{raised}");
}

#[test]
fn clocks_of_two_hosts_that_differ_are_said() {
    let model = read(&run(&|name| if name == "press-io" { 4 } else { 0 }));
    let apart = model.snapshot().clocks_apart.expect("they differ").text();
    assert!(
        apart == "press-io is 4.0 s ahead of robot-io"
            || apart == "robot-io is 4.0 s behind press-io"
    );
}

/// Nothing is made up: a simulated run, and a run whose clocks are not known yet.
#[test]
fn without_a_recorded_clock_there_is_no_time_of_day() {
    let cell = cell();
    let records = records(&cell, &scenario(&cell, KILL), 1);
    let model = read(&records);
    let snapshot = model.snapshot();
    assert_eq!((snapshot.at, snapshot.clocks_apart), (None, None));
    assert!(model.events().all(|event| event.at.is_none()));
    assert!(model.alarms_at(i64::MAX).all(|alarm| alarm.raised_at.is_none()));
    let json = serde_json::to_value(model.snapshot()).expect("JSON");
    assert!(json.get("at").is_none());
}

/// A viewer that comes later and is told the clocks knows the times, also of what was before.
#[test]
fn a_viewer_that_comes_later_knows_the_times() {
    let all = run(&|_| 0);
    let is_late = |record: &&Record| record.at_ns > 1_500_000_000;
    let is_clock =
        |record: &&Record| matches!(record.event, Happening::Host(HostEvent::WallClock { .. }));
    let clocks = all.iter().filter(is_clock);
    let told: Vec<Record> = clocks.chain(all.iter().filter(is_late)).cloned().collect();
    let (late, whole) = (read(&told).snapshot().at, read(&all).snapshot().at);
    let (late, whole) = (late.expect("a time"), whole.expect("a time"));
    assert!(late.0.abs_diff(whole.0) < 25_000_000, "{late} and {whole}");
}
