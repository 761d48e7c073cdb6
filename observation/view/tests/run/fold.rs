//! States, sources, events and alarms as they stand in the scenario.

use understudy_journal::{Happening, Record, RunEvent};
use understudy_remote_io::Event as RemoteIoEvent;
use understudy_scenarios::Scenario;
use understudy_view::{Model, RunState, Snapshot, StationState};
use understudy_wire::{Member, ProgramId, Source, StationId};

use crate::support::{KILL_EACH, cell, model, records, scenario};

/// What the trends say of a station or a source, cycle ranges and words.
fn spans<T: std::fmt::Debug>(spans: impl Iterator<Item = understudy_view::Span<T>>) -> String {
    let texts: Vec<String> =
        spans.map(|span| format!("{:?} {}-{}", span.value, span.from, span.to)).collect();
    texts.join(", ")
}

#[test]
fn each_station_is_seen_to_be_killed_and_repaired() {
    let cell = cell();
    let model = model(&cell, &scenario(&cell, KILL_EACH), 1);
    let series = model.series();
    let of_station =
        |rank| spans(series.station(StationId(rank)).expect("it is there").spans(0, 299));
    let sources = |program| {
        let sources = series.sources(ProgramId(program)).expect("it is there");
        spans(sources.spans(0, 299))
    };
    let bands = [of_station(0), of_station(1), of_station(2), sources(0), sources(1)];
    insta::assert_snapshot!(bands.join("\n"));
    let Snapshot { run, cycle, from_origin, stations, alarms, margin, .. } = model.snapshot();
    assert_eq!(run, RunState::Running);
    assert!(from_origin);
    assert_eq!(cycle, Some(299));
    assert!(!stations.is_empty());
    assert!(stations.iter().all(|station| station.state == StationState::Publishing));
    // Each kill cost the protection of programs, and each return brought it back: one alarm for each station.
    assert_eq!(alarms.len(), 3, "{alarms:?}");
    assert!(alarms.iter().all(|alarm| alarm.alarm == "unprotected" && alarm.over.is_some()));
    assert_eq!(margin.survives, 1);
    let events: Vec<String> = model
        .events()
        .filter(|event| event.cycle >= 0)
        .map(|event| {
            let cause = event.cause.as_ref().map_or(String::new(), |cause| format!("  <- {cause}"));
            format!("{:>4} {:10} {:9} {}{cause}", event.cycle, event.name, event.event, event.text)
        })
        .collect();
    insta::assert_snapshot!("events", events.join("\n"));
}

/// One bit of a state flips: the understudy's word differs from what the samples lead to, the remote I/O accuses, and both are said.
#[test]
fn a_value_fault_is_an_alarm() {
    let cell = cell();
    let text = "title = \"a flip\"\ncycles = 60\nseed = 1\n\
                [[step]]\nat = 20\naction = \"flip-state\"\nstation = \"press\"\nprogram = \"press\"\nbit = 0\n";
    let model = model(&cell, &scenario(&cell, text), 1);
    let alarms: Vec<&str> = model.alarms().map(|alarm| alarm.alarm).collect();
    assert!(alarms.contains(&"value-fault"), "{alarms:?}");
    assert!(alarms.contains(&"word-differs"), "{alarms:?}");
    let mut model = model;
    let seen: Vec<_> =
        model.alarms().map(|alarm| alarm.acknowledgement("anna".to_owned(), 0)).collect();
    assert!(!seen.is_empty(), "no alarm to acknowledge");
    for seen in seen {
        model.note(&Record::of_run(0, RunEvent::Acknowledged(seen)));
    }
    assert!(model.alarms().all(|alarm| alarm.acknowledged_by.as_deref() == Some("anna")));
}

/// With the controller and the understudy gone nothing true is there: held, then fail-safe, with its cause; and nothing is
/// masked any more.
#[test]
fn a_loss_is_an_alarm_with_its_cause() {
    let cell = cell();
    let text = "title = \"two\"\ncycles = 60\n\
                [[step]]\nat = 20\naction = \"crash\"\nstation = \"understudy\"\n\
                [[step]]\nat = 30\naction = \"crash\"\nstation = \"press\"\n";
    let model = model(&cell, &scenario(&cell, text), 1);
    let series = model.series();
    let sources = series.sources(ProgramId(1)).expect("it is there");
    assert_eq!(sources.at(29), Some(&Source::Direct));
    assert_eq!(sources.at(31), Some(&Source::Held));
    assert_eq!(sources.at(59), Some(&Source::FailSafe));
    let alarm = model.alarms().find(|alarm| alarm.alarm == "fail-safe");
    let alarm = alarm.expect("an alarm");
    assert_eq!((alarm.name.as_str(), alarm.over), ("press-io", None));
    assert_eq!(
        alarm.text,
        "press: fail-safe outputs, because press and understudy are not received: press is killed in cycle 30"
    );
    let snapshot = model.snapshot();
    assert_eq!(snapshot.margin.survives, 0);
    assert_eq!(snapshot.margin.served, ["robot"]);
    let states: Vec<&str> = snapshot.stations.iter().map(|station| station.state.word()).collect();
    assert_eq!(states, ["publishing", "killed", "killed"]);
    let lost = model.why("press.move_down", Some(50)).expect("it is known");
    assert_eq!((lost.source, lost.because), (Some("fail-safe"), None));
}

/// A station and a remote I/O whose processes end unexpectedly are alarms until they are started again; what they reported before may be
/// read afterwards.
#[test]
fn an_unexpected_end_is_an_alarm_until_the_member_is_started_again() {
    let cell = cell();
    let text = "title = \"quiet\"\ncycles = 60\n";
    let scenario = scenario(&cell, text);
    let mut model = model(&cell, &scenario, 1);
    let robot = Member::Station(StationId(0));
    let press_io = Member::RemoteIo(ProgramId(1));
    let is_deadline = |record: &Record| {
        let is_applied = matches!(record.event, Happening::RemoteIo(RemoteIoEvent::Applied { .. }));
        record.member == Some(press_io) && is_applied
    };
    let deadline = records(&cell, &scenario, 1).into_iter().rfind(is_deadline);
    for member in [robot, press_io] {
        let event = RunEvent::Ended {
            member,
            how: "signal: 9 (SIGKILL)".to_owned(),
            said: vec!["killed".to_owned()],
        };
        model.note(&Record::of_run(0, event));
    }
    assert_eq!(model.snapshot().stations[0].state, StationState::Ended);
    let open = |model: &Model| -> Vec<String> {
        let lasting = model.alarms().filter(|alarm| alarm.over.is_none());
        lasting.map(|alarm| alarm.text.clone()).collect()
    };
    assert_eq!(
        open(&model),
        [
            "robot ended unexpectedly: signal: 9 (SIGKILL)",
            "press: no remote I/O drives the outputs, because press-io ended unexpectedly: signal: 9 (SIGKILL)"
        ]
    );
    for member in [robot, press_io] {
        model.note(&Record::of_run(0, RunEvent::Started { member }));
    }
    // A remote I/O that is started drives nothing until its first deadline.
    assert_eq!(open(&model).len(), 1);
    let deadline = deadline.expect("a deadline of press-io");
    model.note(&deadline);
    assert_eq!(open(&model), [""; 0]);
    assert_ne!(model.snapshot().stations[0].state, StationState::Ended);
}

/// A run that nobody disturbs has no event of note and a quiet margin; its times are those of the schedule.
#[test]
fn a_quiet_run_is_quiet() {
    let cell = cell();
    let undisturbed = Scenario { title: "quiet".into(), cycles: 50, ..Scenario::default() };
    let model = model(&cell, &undisturbed, 1);
    let loud: Vec<_> =
        model.events().filter(|event| event.cycle > 0 && event.event != "origin").collect();
    assert_eq!(loud, Vec::<&understudy_view::Event>::new());
    let timings: Vec<_> = model.timings().filter(|timing| timing.cycle > 0).collect();
    assert!(timings.len() > 30);
    let period_ns = 10_000_000;
    for timing in timings {
        assert_eq!(timing.cycle_ns, Some(period_ns));
        assert!(timing.margin_ns > 0 && timing.margin_ns < 6_500_000, "{timing:?}");
    }
}
