//! What is shown of a cycle while lines arrive late and in any order stays true when all of them are there.

use std::sync::Arc;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use understudy_journal::{Happening, Record, RunEvent};
use understudy_remote_io::Event as RemoteIoEvent;
use understudy_view::{Bounds, Model, RemoteIoState, Snapshot};
use understudy_wire::{Member, ProgramId, StationId};

use crate::support::{cell, records, scenario};

const PERIOD_NS: u64 = 10_000_000;

/// The longest delay of a line: its member gathers lines, and the network and the viewer take their time.
const LATEST_NS: u64 = 300_000_000;

pub(crate) const QUIET: &str = "title = \"quiet\"\ncycles = 150\n";

/// Losses of stations, of frames and of protection.
pub(crate) const DISTURBED: &str = r#"
title = "disturbed"
cycles = 300

[[step]]
at = 40
action = "cut"
station = "understudy"
to = "robot-io"
[[step]]
at = 90
action = "heal"
station = "understudy"
to = "robot-io"
[[step]]
at = 120
action = "crash"
station = "press"
[[step]]
at = 170
action = "restart"
station = "press"
[[step]]
at = 220
action = "cut"
station = "robot"
to = "press"
[[step]]
at = 250
action = "heal"
station = "robot"
to = "press"
"#;

/// The records in the order in which a viewer of a remote cluster gets them: those of each member in batches, with a delay that changes. Actions
/// of the laboratory are not known there.
pub(crate) fn delivered(records: &[Record], chance: &mut Pcg64Mcg) -> Vec<Record> {
    let mut arrives: std::collections::BTreeMap<Member, u64> = std::collections::BTreeMap::new();
    let gather_ns = chance.random_range(1..=60_000_000);
    let mut delivered: Vec<(u64, usize)> = Vec::new();
    for (place, record) in records.iter().enumerate() {
        let at = match (record.member, &record.event) {
            (Some(member), _) => {
                let batch = record.at_ns.div_ceil(gather_ns) * gather_ns;
                let delay = match chance.random_range(0..20) {
                    0 => chance.random_range(0..LATEST_NS),
                    _ => chance.random_range(0..PERIOD_NS),
                };
                let last = arrives.entry(member).or_default();
                *last = (batch + delay).max(*last);
                *last
            }
            (None, Happening::Run(RunEvent::Origin { .. })) => record.at_ns,
            (None, _) => continue,
        };
        delivered.push((at, place));
    }
    delivered.sort();
    delivered.into_iter().map(|(_, place)| records[place].clone()).collect()
}

/// What a snapshot says of its cycle, without what it says of what was read.
fn of_cycle(snapshot: Snapshot) -> impl PartialEq + std::fmt::Debug {
    let Snapshot { cycle, cycle_master, stations, programs, remote_ios, plants, margin, .. } =
        snapshot;
    (cycle, cycle_master, stations, programs, remote_ios, plants, margin)
}

#[test]
fn what_is_shown_of_a_cycle_is_what_the_complete_journal_shows() {
    let cell = cell();
    for text in [QUIET, DISTURBED] {
        let records = records(&cell, &scenario(&cell, text), 1);
        for seed in 0..12 {
            let delivered = delivered(&records, &mut Pcg64Mcg::seed_from_u64(seed));
            let mut whole = Model::new(Arc::new(cell.clone()), Bounds::default());
            delivered.iter().for_each(|record| whole.note(record));
            let mut model = Model::new(Arc::new(cell.clone()), Bounds::default());
            let mut shown = 0;
            let mut newest = None;
            for record in &delivered {
                model.note(record);
                assert!(model.newest() >= newest, "it goes back");
                if model.newest() == newest || !model.has_origin() {
                    continue;
                }
                newest = model.newest();
                let cycle = newest.expect("a cycle");
                if cycle < 0 {
                    continue;
                }
                let expected = whole.snapshot_at(cycle).map(of_cycle);
                let found = Some(of_cycle(model.snapshot()));
                assert_eq!(found, expected, "cycle {cycle} of {text}, seed {seed}");
                shown += 1;
            }
            assert!(shown > 20, "{shown} cycles were shown");
            let last = whole.cycle().expect("cycles");
            assert!(newest >= Some(last - 3), "{newest:?} of {last}");
        }
    }
}

#[test]
fn a_healthy_cluster_is_shown_as_healthy_in_every_cycle() {
    let cell = cell();
    let records = records(&cell, &scenario(&cell, QUIET), 1);
    for seed in 0..20 {
        let mut model = Model::new(Arc::new(cell.clone()), Bounds::default());
        for record in delivered(&records, &mut Pcg64Mcg::seed_from_u64(seed)) {
            model.note(&record);
            let snapshot = model.snapshot();
            if model.has_origin() && snapshot.cycle.is_some_and(|cycle| cycle >= 0) {
                let context = format!("cycle {:?}, seed {seed}", snapshot.cycle);
                assert_eq!(snapshot.margin.survives, 1, "{context}");
                assert_eq!(snapshot.margin.served.len(), 2, "{context}");
                assert!(snapshot.alarms.is_empty(), "{context}: {:?}", snapshot.alarms);
                assert!(snapshot.links().all(|(_, link)| !link.detached), "{context}");
            }
        }
    }
}

/// Records of a remote I/O end, and of the stations those with its samples: nobody says why.
pub(crate) fn without_remote_io(
    records: &[Record],
    from: i64,
    to: i64,
) -> (Model, Vec<(i64, Snapshot)>) {
    let cell = cell();
    let mut model = Model::new(Arc::new(cell), Bounds::default());
    let mut shown = Vec::new();
    let silent = Member::RemoteIo(ProgramId(0));
    for record in records {
        let cycle = model.cycle().unwrap_or(i64::MIN);
        let is_away = model.has_origin() && (from..to).contains(&cycle);
        let mut record = record.clone();
        if is_away && record.member == Some(silent) {
            continue;
        }
        if let Happening::Station(understudy_node::Event::Published { words, .. }) =
            &mut record.event
            && is_away
        {
            words.retain(|word| !word.mask.contains(ProgramId(0)));
        }
        model.note(&record);
        shown.push((model.cycle().unwrap_or(i64::MIN), model.snapshot()));
    }
    (model, shown)
}

#[test]
fn a_remote_io_that_gives_no_sign_is_an_alarm_within_two_seconds_until_it_is_back() {
    let cell = cell();
    let text = "title = \"quiet\"\ncycles = 600\n";
    let records = records(&cell, &scenario(&cell, text), 1);
    let (from, to) = (100, 400);
    let (model, shown) = without_remote_io(&records, from, to);
    let alarms = |snapshot: &Snapshot| -> Vec<String> {
        let lasting = snapshot.alarms.iter().filter(|alarm| alarm.over.is_none());
        let of_kind = lasting.filter(|alarm| alarm.alarm == "not-driven");
        of_kind.map(|alarm| format!("{}: {}", alarm.name, alarm.text)).collect()
    };
    let raised = shown.iter().find(|(_, snapshot)| !alarms(snapshot).is_empty());
    let (cycle, snapshot) = raised.expect("an alarm");
    assert!((from + 50..from + 150).contains(cycle), "in cycle {cycle}");
    assert_eq!(
        alarms(snapshot),
        [
            "robot-io: robot: no remote I/O drives the outputs, because robot-io reports nothing, and no station receives its samples"
        ]
    );
    // The other members are shown as they are meanwhile, and this one as what it is.
    let (_, late) = shown.iter().rfind(|(cycle, _)| *cycle < to).expect("a cycle");
    assert!(late.cycle.is_some_and(|cycle| cycle > to - 10), "{:?}", late.cycle);
    assert_eq!(late.remote_ios[0].state, RemoteIoState::NotReporting);
    assert_eq!(late.remote_ios[1].state, RemoteIoState::Serving);
    assert_eq!(late.programs[0].source, None);
    assert_eq!(late.margin.served, ["press"]);
    assert_eq!(late.margin.survives, 0, "of the robot it is not known");
    let now = model.snapshot();
    assert_eq!(alarms(&now), [""; 0]);
    assert_eq!(now.remote_ios[0].state, RemoteIoState::Serving);
}

/// The power of a plant far away fails: no member is left to say that the outputs are not driven.
#[test]
fn a_cluster_of_which_nothing_is_received_is_an_alarm_until_it_is_back() {
    let cell = cell();
    let text = "title = \"quiet\"\ncycles = 400\n";
    let mut model = Model::new(Arc::new(cell.clone()), Bounds::default());
    let lasting = |model: &Model| {
        let of_kind = model.alarms().filter(|alarm| alarm.alarm == "not-driven");
        let of_kind = of_kind.filter(|alarm| alarm.over.is_none());
        of_kind.map(|alarm| alarm.name.clone()).collect::<Vec<_>>()
    };
    let mut is_cut = false;
    for record in records(&cell, &scenario(&cell, text), 1) {
        if !is_cut && model.has_origin() && model.cycle() > Some(200) {
            is_cut = true;
            let members: Vec<Member> = cell.members().collect();
            let is_plant = |member: &&Member| matches!(member, Member::Plant(_));
            for &member in members.iter().filter(|member| !is_plant(member)) {
                assert_eq!(lasting(&model), [""; 0], "one is received");
                let reason = "the connection was refused".to_owned();
                let detached = RunEvent::Detached { member, reason };
                model.note(&Record::of_run(record.at_ns, detached));
            }
            assert_eq!(lasting(&model), ["robot-io", "press-io"]);
            for member in members {
                model.note(&Record::of_run(record.at_ns, RunEvent::Attached { member }));
            }
        }
        model.note(&record);
    }
    assert!(is_cut);
    assert_eq!(lasting(&model), [""; 0], "they are back");
}

/// The stations have its samples: only its journal is not received.
#[test]
fn a_remote_io_whose_journal_alone_is_missing_is_no_alarm() {
    let cell = cell();
    let text = "title = \"quiet\"\ncycles = 400\n";
    let mut model = Model::new(Arc::new(cell.clone()), Bounds::default());
    for record in records(&cell, &scenario(&cell, text), 1) {
        let is_deadline =
            matches!(record.event, Happening::RemoteIo(RemoteIoEvent::Applied { .. }));
        let is_late = model.has_origin() && model.cycle() > Some(100);
        if is_late && is_deadline && record.member == Some(Member::RemoteIo(ProgramId(0))) {
            continue;
        }
        model.note(&record);
    }
    let snapshot = model.snapshot();
    assert!(snapshot.alarms.iter().all(|alarm| alarm.alarm != "not-driven"));
    assert_eq!(snapshot.remote_ios[0].state, RemoteIoState::NotReporting);
    assert!(snapshot.remote_ios[0].link.detached);
}

/// The laboratory knows the processes that it suspends or kills.
#[test]
fn a_suspended_or_killed_remote_io_is_an_alarm_at_once() {
    let cell = cell();
    for (action, end) in [("stop", "continue"), ("crash", "restart")] {
        let text = format!(
            "title = \"away\"\ncycles = 200\n\
             [[step]]\nat = 50\naction = \"{action}\"\nstation = \"robot-io\"\n\
             [[step]]\nat = 100\naction = \"{end}\"\nstation = \"robot-io\"\n"
        );
        let mut model = Model::new(Arc::new(cell.clone()), Bounds::default());
        for record in records(&cell, &scenario(&cell, &text), 1) {
            model.note(&record);
        }
        let alarms = model.alarms().filter(|alarm| alarm.alarm == "not-driven");
        let alarms: Vec<_> = alarms.map(|alarm| (&alarm.name, alarm.cycle, alarm.over)).collect();
        let [(name, 50 | 51, Some(over))] = alarms.as_slice() else {
            panic!("{action}: {alarms:?}");
        };
        assert_eq!(*name, "robot-io");
        assert!((99..130).contains(over), "{action}: over in {over}");
    }
}

/// Where a viewer receives nothing of a station that the remote I/Os receive, it does not know what is left, and does not say that nothing is.
#[test]
fn what_a_station_covers_is_not_known_where_its_turns_are_not_received_here() {
    let cell = cell();
    let text = "title = \"a viewer without one connection\"\ncycles = 400\n";
    let records = records(&cell, &scenario(&cell, text), 1);
    let understudy = Member::Station(StationId(2));
    let mut model = Model::new(Arc::new(cell), Bounds::default());
    for record in &records {
        let is_away = model.has_origin() && model.cycle() >= Some(100);
        if !(is_away && record.member == Some(understudy)) {
            model.note(record);
        }
    }
    let margin_in = |cycle| model.snapshot_at(cycle).expect("remembered").margin;
    assert_eq!((margin_in(90).unknown, margin_in(90).survives), (Vec::new(), 1));
    let unknown = margin_in(390).unknown;
    assert_eq!(unknown, ["understudy"]);
    let snapshot = model.snapshot();
    assert!(snapshot.programs.iter().all(|program| {
        program.protection.as_ref().is_some_and(|protection| protection.protected)
    }));
}
