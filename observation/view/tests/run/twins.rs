//! Programs with two remote I/Os: what is shown names the one that drives, and records of either count as those of the program.

use std::sync::Arc;

use understudy_journal::{Happening, Record};
use understudy_remote_io::{Event, Missing};
use understudy_view::{Bounds, Filter, JournalLine, Listing, Model, Zone};
use understudy_wire::{Member, Part, ProgramId, Source};

use crate::support::{example, model, records, scenario};

const FAILS: &str = include_str!("../../../../examples/twin-remote-io/author-fails.toml");

fn listed(records: &[Record]) -> Vec<JournalLine> {
    let cluster = example("twin-remote-io");
    let filter = Filter { ordinary: true, ..Filter::default() };
    let mut listing = Listing::new(&cluster, filter).expect("a filter");
    records.iter().flat_map(|record| listing.take(record)).collect()
}

/// A killed author, a suspended one, and one that is killed after it has taken over.
#[test]
fn why_names_the_remote_io_that_drove() {
    let cluster = example("twin-remote-io");
    let model = model(&cluster, &scenario(&cluster, FAILS), 1);
    let check = |signal: &str, cycle: Option<i64>, expected: &str| {
        let why = model.why(signal, cycle).expect("it is explained");
        assert_eq!(why.remote_io, expected, "{cycle:?}");
        let text = why.to_text(Zone::default());
        assert!(text.contains(&format!("  {expected} ")), "{text}");
    };
    check("press.move_down", Some(399), "press-io");
    check("press.move_down", Some(405), "press-io-2");
    check("press.move_down", None, "press-io-2");
    check("robot.grip", Some(99), "robot-io");
    check("robot.grip", Some(105), "robot-io-2");
    check("robot.grip", Some(500), "robot-io-2");
    check("robot.grip", Some(605), "robot-io");
    // The understudy is killed: the twin of the press reports it.
    assert_eq!(model.counters().program(ProgramId(1)).protection_losses, 1);
}

#[test]
fn faults_after_a_take_over_are_listed_with_their_cycles() {
    let cluster = example("twin-remote-io");
    let records = records(&cluster, &scenario(&cluster, FAILS), 1);
    let lines = listed(&records);
    let faults = lines.iter().filter(|line| line.event == "fault");
    let cycles: Vec<i64> = faults.filter_map(|line| line.cycle).collect();
    assert_eq!(cycles, [100, 300, 400, 450, 600, 700]);
    let newest = lines.iter().filter_map(|line| line.cycle).max();
    assert!(newest >= Some(999), "{newest:?}");
}

/// An alarm that the first remote I/O raised ends with what the twin reports after it took over.
#[test]
fn an_alarm_of_the_author_before_ends_with_the_author_after_it() {
    let cluster = example("twin-remote-io");
    let quiet = scenario(&cluster, "title = \"quiet\"\ncycles = 50\n");
    let records = records(&cluster, &quiet, 1);
    let (first, twin) = (Member::RemoteIo(ProgramId(0)), Member::Twin(ProgramId(0)));
    let mut model = Model::new(Arc::new(cluster.clone()), Bounds::default());
    records.iter().for_each(|record| model.note(record));
    let applied = records.iter().rev().find(|record| {
        let is_applied = matches!(record.event, Happening::RemoteIo(Event::Applied { .. }));
        is_applied && record.member == Some(first)
    });
    let applied = applied.expect("a deadline");
    let other = records.iter().find(|record| record.member == Some(twin)).expect("it reports");
    let mut report = |by: &Record, later: u64, change: &dyn Fn(&mut Event)| {
        let mut record = Record { name: by.name.clone(), member: by.member, ..applied.clone() };
        if let Happening::RemoteIo(event) = &mut record.event {
            if let Event::Applied { moment, .. } = event {
                moment.cycle.0 += later;
            }
            change(event);
        }
        model.note(&record);
        let open = model.alarms().filter(|it| it.alarm == "fail-safe" && it.over.is_none());
        open.map(|alarm| alarm.name.clone()).collect::<Vec<_>>()
    };
    let fails = |event: &mut Event| {
        if let Event::Applied { source, missing, .. } = event {
            (*source, *missing) = (Source::FailSafe, Some(Missing::NotSynchronised));
        }
    };
    let author = |event: &mut Event| {
        if let Event::Applied { moment, .. } = *event {
            *event = Event::PartChanged { moment, part: Part::Author };
        }
    };
    assert_eq!(report(applied, 1, &fails), ["robot-io"]);
    assert_eq!(report(other, 2, &author), ["robot-io"]);
    assert_eq!(report(other, 2, &fails), ["robot-io"]);
    assert!(report(other, 3, &|_| {}).is_empty());
}
