//! Alarms on signals: states, acknowledgement, shelving, and readers that begin in the middle.

use std::sync::Arc;

use understudy_cluster::{Cluster, Overrides, Priority, read_with};
use understudy_journal::{Record, RunEvent, Shelving, Unshelving};
use understudy_view::{
    AlarmState, Bounds, Filter, Listing, Model, ProcessAlarm, Shelved, Snapshot, Trouble,
};

use crate::support::{records, scenario};

const CLUSTER: &str = r#"
[cluster]
name = "ramp"
period = "10ms"

[[controller]]
name = "keep"
ladder = "keep.st"

[[plant]]
controller = "keep"
ladder = "ramp.st"

[[alarm]]
signal = "keep.level"
name = "high"
above = 60.0
hysteresis = 20.0
on_delay = "50ms"
priority = "high"
text = "Level is too high"
action = "Close the inlet"

[[alarm]]
signal = "keep.far"
name = "far"
when = true
text = "Level is far"
"#;

const KEEP: &str = "\
PROGRAM keep
  VAR_INPUT level : REAL; END_VAR
  VAR_OUTPUT far : BOOL; END_VAR
  far := level > 30.0;
END_PROGRAM
";

/// The level rises by 1 in each cycle and falls to 0 after 99.
const RAMP: &str = "\
PROGRAM ramp
  VAR_INPUT far : BOOL; END_VAR
  VAR_OUTPUT level : REAL; END_VAR
  VAR n : INT; END_VAR
  n := (n + 1) MOD 100;
  level := INT_TO_REAL(n);
END_PROGRAM
";

pub(crate) const PLAIN: &str = "title = \"a ramp\"\ncycles = 400\n";

const KILLED: &str = "title = \"a ramp\"\ncycles = 300\n\
    [[step]]\nat = 180\naction = \"crash\"\nstation = \"keep-io\"\n\
    [[step]]\nat = 220\naction = \"restart\"\nstation = \"keep-io\"\n";

/// The first remote I/O is killed and returns: its twin drives from cycle 102 on.
const TAKEN_OVER: &str = "title = \"a ramp\"\ncycles = 300\n\
    [[step]]\nat = 100\naction = \"crash\"\nstation = \"keep-io\"\n\
    [[step]]\nat = 120\naction = \"restart\"\nstation = \"keep-io\"\n";

const TWINS: &str = "[[remote_io]]\nname = \"keep-io\"\ncontroller = \"keep\"\n\
    twin = { name = \"keep-io-2\", wiring = \"exclusive\" }\n";

pub(crate) fn ramp() -> Cluster {
    cluster(CLUSTER)
}

fn cluster(text: &str) -> Cluster {
    let loaded = read_with("cluster.toml", text, Overrides::default(), &mut |name| match name {
        "keep.st" => Ok(KEEP.to_owned()),
        "ramp.st" => Ok(RAMP.to_owned()),
        _ => Err("no such file".to_owned()),
    });
    let reports = loaded.reports.iter().flat_map(|it| &it.diagnostics);
    let found: Vec<String> = reports.map(|found| found.message.clone()).collect();
    loaded.cluster.unwrap_or_else(|| panic!("{found:?}"))
}

fn model_of(cluster: &Cluster, records: &[Record]) -> Model {
    let mut model = Model::new(Arc::new(cluster.clone()), Bounds::default());
    records.iter().for_each(|record| model.note(record));
    model
}

fn find<'s>(snapshot: &'s Snapshot, name: &str) -> &'s ProcessAlarm {
    let mut alarms = snapshot.process_alarms.iter();
    alarms.find(|alarm| alarm.name == name).expect("declared")
}

fn state_at(model: &Model, cycle: i64, name: &str) -> AlarmState {
    let snapshot = model.snapshot_at(cycle).expect("remembered");
    find(&snapshot, name).state
}

/// Level of the program as last sampled in a cycle.
fn level(model: &Model, cycle: i64) -> f64 {
    let snapshot = model.snapshot_at(cycle).expect("remembered");
    let value = &snapshot.programs[0].values["level"];
    value.as_f64().expect("a number")
}

fn shelving(seconds: u64) -> Record {
    let shelving = Shelving {
        name: "high".to_owned(),
        seconds,
        owner: "anna".to_owned(),
        reason: "sensor is exchanged".to_owned(),
        at_unix_s: 0,
    };
    Record::of_run(0, RunEvent::Shelved(shelving))
}

#[test]
fn an_alarm_is_raised_after_its_delay_and_over_behind_its_hysteresis() {
    let cluster = ramp();
    let records = records(&cluster, &scenario(&cluster, PLAIN), 1);
    let model = model_of(&cluster, &records);
    let newest = model.newest().expect("cycles");
    let raised: Vec<i64> =
        model.alarms().filter(|alarm| alarm.name == "high").map(|alarm| alarm.cycle).collect();
    assert!((3..=5).contains(&raised.len()), "{raised:?}");
    for cycle in &raised[1..] {
        // The condition holds from 61 on; five cycles later the alarm is active.
        assert_eq!(level(&model, *cycle), 66.0);
    }
    let (mut active, mut over) = (0, 0);
    for cycle in raised[1]..newest {
        let snapshot = model.snapshot_at(cycle).expect("remembered");
        let high = find(&snapshot, "high");
        let level = level(&model, cycle);
        let expected = level >= 66.0;
        assert_eq!(high.active, Some(expected), "cycle {cycle}, level {level}");
        // Nobody acknowledges it.
        let state = [AlarmState::Returned, AlarmState::Unacknowledged][usize::from(expected)];
        assert_eq!(high.state, state, "cycle {cycle}");
        assert_eq!(snapshot.alarms.len(), 2, "the repeated ones are one");
        active += u32::from(expected);
        over += u32::from(!expected);
        let far = find(&snapshot, "far").active;
        let outputs = snapshot.programs[0].values["far"].as_bool();
        assert_eq!(far, outputs, "cycle {cycle}");
    }
    assert!(active > 60 && over > 100, "{active} {over}");
    let high = find(&model.snapshot(), "high").clone();
    assert_eq!((high.program.as_str(), high.signal.as_str()), ("keep", "level"));
    assert_eq!(high.priority, Priority::High);
    assert_eq!(high.newest.map(|alarm| alarm.since_before), Some(false));
}

#[test]
fn an_acknowledged_alarm_is_normal_when_it_is_over() {
    let cluster = ramp();
    let records = records(&cluster, &scenario(&cluster, PLAIN), 1);
    let whole = model_of(&cluster, &records);
    // In the second time that it is active.
    let raised: Vec<i64> =
        whole.alarms().filter(|alarm| alarm.name == "high").map(|alarm| alarm.cycle).collect();
    let mut model = Model::new(Arc::new(cluster.clone()), Bounds::default());
    let mut seen = None;
    for record in &records {
        model.note(record);
        if seen.is_none() && model.cycle() == Some(raised[1] + 10) {
            let newest = model.alarms().rfind(|alarm| alarm.name == "high");
            let record = newest.expect("raised").acknowledgement("anna".to_owned(), 0);
            seen = model.cycle();
            model.note(&Record::of_run(0, RunEvent::Acknowledged(record)));
        }
    }
    let seen = seen.expect("acknowledged");
    assert_eq!(state_at(&model, seen - 1, "high"), AlarmState::Unacknowledged);
    assert_eq!(state_at(&model, seen, "high"), AlarmState::Acknowledged);
    let over = (seen..).find(|cycle| level(&model, *cycle) < 40.0).expect("it falls");
    assert_eq!(state_at(&model, over, "high"), AlarmState::Normal);
    assert_eq!(state_at(&model, raised[2], "high"), AlarmState::Unacknowledged);
    // The first time that it was raised is acknowledged with the second.
    let mut of_high = model.alarms().filter(|alarm| alarm.name == "high");
    let by = of_high.next().and_then(|alarm| alarm.acknowledged_by.clone());
    assert_eq!(by.as_deref(), Some("anna"));
}

#[test]
fn a_shelved_alarm_is_not_open_until_its_time_is_over() {
    let cluster = ramp();
    let records = records(&cluster, &scenario(&cluster, PLAIN), 1);
    let mut model = Model::new(Arc::new(cluster.clone()), Bounds::default());
    let mut shelved = None;
    for record in &records {
        model.note(record);
        if shelved.is_none() && model.has_origin() && model.cycle() == Some(120) {
            shelved = model.newest();
            model.note(&shelving(1));
            let snapshot = model.snapshot();
            let expected = Shelved {
                until_at: None,
                until: 220,
                owner: "anna".to_owned(),
                reason: "sensor is exchanged".to_owned(),
            };
            assert_eq!(find(&snapshot, "high").shelved, Some(expected));
            assert!(snapshot.alarms.iter().all(|alarm| alarm.name != "high"));
        }
    }
    assert!(shelved.is_some());
    for cycle in [121, 150, 219] {
        assert_eq!(state_at(&model, cycle, "high"), AlarmState::Shelved, "{cycle}");
    }
    for cycle in [119, 220, 300] {
        assert_ne!(state_at(&model, cycle, "high"), AlarmState::Shelved, "{cycle}");
    }
    let mut present = model.clone();
    present.note(&shelving(60));
    assert_eq!(find(&present.snapshot(), "high").state, AlarmState::Shelved);
    let unshelving = Unshelving {
        name: "high".to_owned(),
        owner: "bert".to_owned(),
        reason: "sensor is there".to_owned(),
        at_unix_s: 0,
    };
    present.note(&Record::of_run(0, RunEvent::Unshelved(unshelving)));
    assert_eq!(find(&present.snapshot(), "high").shelved, None);
}

#[test]
fn without_its_remote_io_an_alarm_is_unknown() {
    let cluster = ramp();
    let records = records(&cluster, &scenario(&cluster, KILLED), 1);
    let model = model_of(&cluster, &records);
    assert_ne!(state_at(&model, 170, "high"), AlarmState::Unknown);
    let unknown = (181..220).filter(|cycle| {
        let snapshot = model.snapshot_at(*cycle);
        snapshot.is_some_and(|snapshot| find(&snapshot, "high").state == AlarmState::Unknown)
    });
    assert!(unknown.count() > 20);
    assert_ne!(state_at(&model, 290, "high"), AlarmState::Unknown);
}

/// The records of one of two remote I/Os end: the alarms are unknown where it is the one that drives, and only there.
#[test]
fn without_the_twin_that_drives_an_alarm_is_unknown() {
    let cluster = cluster(&format!("{CLUSTER}\n{TWINS}"));
    let records = records(&cluster, &scenario(&cluster, TAKEN_OVER), 1);
    let whole = model_of(&cluster, &records);
    assert_ne!(state_at(&whole, 290, "high"), AlarmState::Unknown);
    for (name, is_known) in [("keep-io", true), ("keep-io-2", false)] {
        let from = records
            .iter()
            .position(|record| record.name == "keep-io-2" && record.at_ns > 1_500_000_000);
        let (before, after) = records.split_at(from.expect("it reports"));
        let after = after.iter().filter(|record| record.name != name);
        let kept: Vec<Record> = before.iter().chain(after).cloned().collect();
        let model = model_of(&cluster, &kept);
        let state = state_at(&model, 290, "high");
        assert_eq!(state != AlarmState::Unknown, is_known, "{name} is silent: {state:?}");
    }
}

#[test]
fn a_reader_that_begins_later_agrees_and_claims_no_beginning() {
    let cluster = ramp();
    let records = records(&cluster, &scenario(&cluster, PLAIN), 1);
    let whole = model_of(&cluster, &records);
    let mut claimed = 0;
    for skipped in (0..records.len()).step_by(records.len() / 40) {
        let mut late = Model::new(Arc::new(cluster.clone()), Bounds::default());
        let origin = records.iter().find_map(|record| match &record.event {
            understudy_journal::Happening::Run(RunEvent::Origin { moment, .. }) => Some(*moment),
            _ => None,
        });
        late.origin_is(origin.expect("synchronised"), 0);
        late.trouble(&Trouble::Gone { count: None });
        records[skipped..].iter().for_each(|record| late.note(record));
        let (Some(oldest), Some(newest)) = (late.oldest(), late.newest()) else {
            continue;
        };
        for cycle in oldest.max(1)..newest {
            let (Some(one), Some(other)) = (late.snapshot_at(cycle), whole.snapshot_at(cycle))
            else {
                continue;
            };
            for (late, whole) in one.process_alarms.iter().zip(&other.process_alarms) {
                if late.active.is_some() {
                    assert_eq!(late.active, whole.active, "{} in {cycle}", late.name);
                }
                let begun = late.newest.as_ref().filter(|alarm| !alarm.since_before);
                if let Some(begun) = begun.filter(|alarm| alarm.repeated_in.is_none()) {
                    let known = whole.newest.as_ref().map(|alarm| alarm.cycle);
                    assert_eq!(Some(begun.cycle), known, "{} in {cycle}", late.name);
                }
                claimed += u32::from(late.newest.as_ref().is_some_and(|it| it.since_before));
            }
        }
    }
    assert!(claimed > 0, "some reader begins while an alarm is active");
}

#[test]
fn the_list_of_the_journal_tells_the_same_alarms() {
    let cluster = ramp();
    let records = records(&cluster, &scenario(&cluster, KILLED), 1);
    let model = model_of(&cluster, &records);
    let is_of_alarm = |event: &str| event.starts_with("alarm-");
    let events: Vec<(&str, String)> = model
        .events()
        .filter(|event| is_of_alarm(event.event))
        .map(|event| (event.event, event.text.clone()))
        .collect();
    let mut listing = Listing::new(&cluster, Filter::default()).expect("no names");
    let lines = records.iter().flat_map(|record| listing.take(record));
    let lines: Vec<(&str, String)> =
        lines.filter(|line| is_of_alarm(line.event)).map(|line| (line.event, line.text)).collect();
    assert_eq!(lines, events);
    let raised = "the alarm high (high) is active: Level is too high";
    assert!(lines.contains(&("alarm-raised", raised.to_owned())), "{lines:?}");
    let filter = Filter { events: vec!["alarm-over".to_owned()], ..Filter::default() };
    let mut listing = Listing::new(&cluster, filter).expect("it is an event");
    let over = records.iter().flat_map(|record| listing.take(record));
    assert!(over.count() > 1);
}
